"""Tests of the simulated clips: people, headings, and error bars that are calibrated on other people only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.studies.study import stack
from walk3d.film.study.clip import ClipErrors
from walk3d.film.study.dataset import FilmedWalkers
from walk3d.film.study.headings import HEADINGS_DEG, KeypointHeadings
from walk3d.film.study.measured import calibrations_by_person, covered, covered_cycle
from walk3d.film.walk import TrainingWalk
from walk3d.film.walk.calibration import StandardErrors


def walkers(people: int) -> FilmedWalkers:
    """Return walks of the given number of people; every second person has two walks."""
    person = np.array([f"p{k:02d}" for k in range(people) for _ in range(1 + k % 2)])
    W = len(person)
    return FilmedWalkers(
        walks=stack([TrainingWalk(np.zeros((15, 3, 9)), 1.0, np.zeros((15, 3)), 1500.0)] * W), person=person,
        clip=np.arange(W).astype(str), source=np.full(W, "synthetic"), words="",
    )  # fmt: skip


@pytest.mark.parametrize("people", [12, 16, 33, 80])
def test_people_and_sides_take_turns(people: int) -> None:
    data = walkers(people)
    cases = KeypointHeadings(clips=96).cases(data)
    times = np.bincount([case.person for case in cases], minlength=people)
    assert times.max() - times.min() <= 1
    sides = [(case.heading_deg, case.overground) for case in cases]
    counts = [sides.count((heading, way)) for heading in HEADINGS_DEG for way in (True, False)]
    assert min(counts) >= 96 // 16 - 2
    for person in range(people):
        reference = [(c.heading_deg, c.overground) for c in cases if c.person == person]
        assert len(set(reference)) == len(reference)
        assert all(data.person[c.walk] == data.people[person] for c in cases if c.person == person)


def measured(seed: int, sd: float) -> ClipErrors:
    """Return normally distributed errors of one simulated clip."""
    generator = np.random.default_rng(seed)
    return ClipErrors(
        view_error_deg=1.0, cadence_error_percent=0.1, distance_mm=np.ones(3), angle_deg=np.ones((3, 6)),
        event_ms=np.array([5.0, np.nan]), over_sd=StandardErrors(
            sd * generator.normal(size=(60, 15, 3)), generator.normal(size=(60, 11)),
            [generator.normal(size=6), np.empty(0)], generator.normal(size=25), generator.normal(size=2)),
        residual_percent=1.0, verdict="walk", labels_right=True, labels_unsure=False,
    )  # fmt: skip


def test_bars_are_calibrated_on_other_people_alone() -> None:
    person = np.array(["a", "b", "c", "a"])
    clips = [measured(seed, sd=2.0) for seed in range(4)]
    before = calibrations_by_person(person, clips)
    clips[0] = replace(clips[0], over_sd=replace(clips[0].over_sd, joints=100.0 * clips[0].over_sd.joints))
    after = calibrations_by_person(person, clips)
    np.testing.assert_array_equal(before["a"].joints, after["a"].joints)
    assert after["b"].joints.mean() > 2.0 * before["b"].joints.mean()
    # Bars that were half as wide as the errors hold what they say once they are calibrated.
    np.testing.assert_allclose(covered(clips[1], before["b"]), [0.5, 0.8, 0.95], atol=0.03)
    assert (covered(clips[1], None) < [0.3, 0.55, 0.75]).all()


def test_events_and_numbers_are_covered_by_bars_of_other_people() -> None:
    person = np.array(["a", "b", "c", "d"])
    clips = [measured(seed, sd=1.0) for seed in range(4)]
    finite = calibrations_by_person(person, clips)["a"]
    message = covered_cycle(clips[0], finite)
    assert message["contact_error_ms"] == 5.0
    assert np.isnan(message["toe_off_error_ms"])
    assert 50 <= message["covered_cycle_percent"] <= 100  # learnt on three clips
    off = clips[0].over_sd
    far = replace(
        off, angles=99.0 + off.angles, events=[np.full(6, -99.0), np.empty(0)], numbers=99.0 + off.numbers
    )
    message = covered_cycle(replace(clips[0], over_sd=far), finite)
    assert message["covered_cycle_percent"] == message["covered_angles_percent"] == 0
