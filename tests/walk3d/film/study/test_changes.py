"""Tests that all conditions use the same clips, and that each condition changes the right setting."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.core import fourier
from tests.walk3d.film.study.test_headings import walkers
from tests.walk3d.film.walk.walkers import RATE, motions, prior, walks
from walk3d.film.simulation.filmed import lasting
from walk3d.film.study.changes import KeypointChanges
from walk3d.film.study.conditions import CONDITIONS, USUAL, Changes, Condition
from walk3d.film.study.kinds import FILM_KINDS, FilmKind, crossing, film_as, see
from walk3d.film.study.model import with_harmonics
from walk3d.film.walk.training import BLOCKS


@pytest.mark.parametrize("changes", Changes)
def test_a_condition_changes_one_thing(changes: Changes) -> None:
    first, *others = CONDITIONS[changes]
    assert first == Condition()
    assert first.kind == USUAL
    assert len({condition.name for condition in CONDITIONS[changes]}) == len(CONDITIONS[changes])
    for condition in others:
        parts = [name for name in vars(first) if getattr(condition, name) != getattr(first, name)]
        changed = set(parts) - {"kind", "level"}
        # A known bias is also an option of the model; wrong labels are tried both ways; an estimated focal length
        # has a wrong start.  Every other condition changes one thing.
        both = condition.level in ("20 mm, told", "both tried") or condition.kind == "focal length found"
        assert len(changed) == (2 if both else 1), condition.name


@pytest.mark.parametrize("sources", [1, 2])
def test_every_condition_has_the_same_clips(sources: int) -> None:
    data = walkers(20)
    data = replace(data, source=np.array([f"s{k % sources}" for k in range(len(data.person))]))
    data = replace(data, source=np.array([f"s{int(who[1:]) % sources}" for who in data.person.tolist()]))
    sweep = KeypointChanges(changes=Changes.ablation, takes=16, levels=0, films=2)
    cases = sweep.cases(data)
    filmed = {
        number: [
            (c.take, c.person, c.walk, c.heading_deg, c.overground) for c in cases if c.condition == number
        ]
        for number in {case.condition for case in cases}
    }
    assert len({tuple(clips) for clips in filmed.values()}) == 1
    assert len({person for _, person, *_ in filmed[0]}) == 16
    # Without people of another source there is no one to learn from.
    assert len(filmed) == len(sweep.conditions) - (sources == 1)


def test_few_levels_are_the_farthest() -> None:
    sweep = KeypointChanges(changes=Changes.degradations, takes=2, levels=1, films=2)
    assert [c.level for c in sweep.conditions if c.kind == "strides"] == ["1"]
    assert [c.kind for c in sweep.conditions] == list(
        dict.fromkeys(c.kind for c in CONDITIONS[Changes.degradations])
    )


def test_a_walk_goes_on_where_its_recording_ends() -> None:
    generator = np.random.default_rng(0)
    rate, frequency = 60.0, 1.0
    times = np.arange(150) / rate
    series = generator.normal(size=(9, 15, 3)) * 50.0
    series[1, 11, 1] += 400.0  # the left ankle swings
    series[1, 14, 1] -= 400.0
    motion = fourier.synthesise(series, frequency, times) + generator.normal(size=(150, 15, 3))
    again = lasting(motion, rate, 5.0)
    representation = fourier.represent(motion, rate, harmonics=4)
    assert len(again) == round(5.0 / representation.frequency_hz * rate) + 1
    np.testing.assert_allclose(again[:150], motion, atol=1e-6)
    later = fourier.synthesise(series, frequency, np.arange(len(again)) / rate)
    assert np.abs(again - later).max() < 12.0
    np.testing.assert_allclose(
        lasting(motion, rate, 1.0), motion[: round(rate / representation.frequency_hz) + 1], atol=1e-6
    )


def test_harmonics_that_are_taken_away_are_none() -> None:
    model = prior().model
    two = with_harmonics(model, 2)
    assert not two.mean[:, :, 5:].any()
    np.testing.assert_array_equal(two.mean[:, :, :5], model.mean[:, :, :5])
    variance = np.diag(two.covariance).reshape(15, 3, BLOCKS)
    assert variance[:, :, 5:].max() < 1e-3 < variance[:, :, :5].min()
    np.testing.assert_array_equal(with_harmonics(model, 4).covariance, model.covariance)


def test_of_two_who_meet_the_farther_is_hidden_and_whoever_is_followed_is_compared() -> None:
    clips = SimpleNamespace(motion=lambda k: motions()[k], frame_rate_hz=np.full(14, RATE))
    kind = FilmKind(kind="crossed", crossed=True)
    generator = np.random.default_rng(4)
    first = film_as(kind, generator, clips, 0, walks()[0], 0.5, overground=False)  # type: ignore[arg-type]
    both = crossing(generator, clips, 1, walks()[1], first)  # type: ignore[arg-type]
    hidden = [np.isnan(person.pixels).all(axis=(1, 2)) for person in both]
    heights = [np.nanmax(np.ptp(person.pixels[..., 1], axis=1)) for person in both]
    assert [len(person.pixels) for person in both] == [len(person.positions_mm) for person in both]
    middle = len(first.pixels) // 2
    assert hidden[int(np.argmin(heights))][middle]
    assert not hidden[int(np.argmax(heights))][middle]
    observed = see(both, [walks()[0].frequency_hz, walks()[1].frequency_hz], 1.0, prior())
    assert (observed.verdict == "not_a_walk") == np.isnan(observed.error_mm)
    assert not observed.wrong_frequency
    assert observed.error_mm < 60.0


def test_films_of_walks_and_of_what_is_none_are_told_apart() -> None:
    clips = SimpleNamespace(motion=lambda k: motions()[k], frame_rate_hz=np.full(14, RATE))
    assert len({kind.name for kind in FILM_KINDS}) == len(FILM_KINDS)
    for kind in FILM_KINDS:
        if kind.stated < 1.0 or kind.crossed:  # long films: in the figure
            continue
        filmed = film_as(kind, np.random.default_rng(1), clips, 0, walks()[0], 0.6, overground=True)  # type: ignore[arg-type]
        observed = see([filmed], [walks()[0].frequency_hz], kind.stated, prior())
        assert (observed.verdict == "not_a_walk") == (kind.activity is not None), kind.name
        assert not observed.wrong_frequency
