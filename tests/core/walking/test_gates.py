"""Tests that runs, bends and kicks are not accepted as walks."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.clips.options import Steady
from pipeline.clips.usable import RawClip, report_row
from pipeline.clips.walks import REPORT_COLUMNS, steady_walk
from pipeline.core.walking import require_walk
from pipeline.core.walking.gates import unusual_cadence
from pipeline.ingestion.joints import joints_of
from pipeline.mappings import shipped
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from tests.rejects import rejects

ROOT = Path(__file__).parents[3]
MIRROR = os.environ.get("MOCAP_MIRROR", "")
LEG_MM, RATE_HZ = 850.0, 60.0
LEFT, RIGHT = WALKER15.index("left_ankle"), WALKER15.index("right_ankle")


@pytest.fixture(scope="module")
def people() -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.asarray(
        walkers.walking_population(rng, male=3, female=3, duration_s=3.0, frame_rate_hz=RATE_HZ).positions_mm
    )


def check(level: np.ndarray, speed_mm_s: float = 0.0) -> None:
    require_walk(level, RATE_HZ, leg_mm=LEG_MM, speed_mm_s=speed_mm_s)


def test_walkers_walk(people: np.ndarray) -> None:
    for level in people:
        check(level)
        check(level[:, list(WALKER15.mirror)] * [-1.0, 1.0, 1.0])
        check(level, 1300.0)


def test_a_run_is_called_one_by_its_speed_or_by_its_heels(people: np.ndarray) -> None:
    level = people[0]
    with rejects("running", froude=pytest.approx(1.55, abs=0.005)):
        check(level, 3600.0)
    lifted = level.copy()
    for ankle in (LEFT, RIGHT):
        z = lifted[:, ankle, 2]
        lifted[:, ankle, 2] = z.min() + 0.42 * LEG_MM * (z - z.min()) / np.ptp(z)
    check(lifted, 1500.0)  # who lifts the feet high is no runner yet
    with rejects("running", lift=pytest.approx(0.42, abs=0.005)):
        check(lifted, 2000.0)


def test_feet_that_move_together_or_not_in_turn_are_no_walk(people: np.ndarray) -> None:
    level = people[1]
    together = level.copy()
    together[:, RIGHT] = together[:, LEFT] + [200.0, 0.0, 0.0]
    with rejects("feet_do_not_alternate"):
        check(together)
    standing = level.copy()
    standing[:, [LEFT, RIGHT]] = standing[:1, [LEFT, RIGHT]]
    with rejects("feet_do_not_alternate"):
        check(standing)
    hopping = level.copy()
    hopping[:, RIGHT, 2] = hopping[:, LEFT, 2].max() + 50.0  # one foot is never down
    with rejects("no_stance_and_swing"):
        check(hopping)
    backwards = level.copy()
    backwards[..., 1] *= -1.0
    with rejects("no_stance_and_swing"):
        check(backwards)


def test_a_trunk_that_bows_is_no_walk(people: np.ndarray) -> None:
    level = people[2]
    stooped, bowing = level.copy(), level.copy()
    for joint in ("left_shoulder", "right_shoulder"):
        position = WALKER15.index(joint)
        stooped[:, position, 1] += 250.0
        bowing[:, position, 1] += 250.0 * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, len(level))))
    check(stooped)  # all the time
    with rejects("trunk_bows"):
        check(bowing)


def test_a_wrong_frame_rate_shows_in_the_cadence() -> None:
    """A wrong frame rate changes the cadence but not the stride length, so that the warning appears."""
    people = walkers.walking_population(
        np.random.default_rng(2), male=2, female=2, duration_s=3.0, frame_rate_hz=RATE_HZ
    )
    for level, person in zip(people.positions_mm, people.people, strict=True):
        frequency = person.frequency
        for known_speed in (person.speed, 0.0):  # 0 on a treadmill: the speed of the lower ankle
            for factor, other in ((1.0, ""), (2.0, "or 60 Hz?"), (0.5, "or 60 Hz?")):
                words = unusual_cadence(
                    level,
                    factor * RATE_HZ,
                    leg_mm=LEG_MM,
                    speed_mm_s=factor * known_speed,
                    frequency_hz=factor * frequency,
                )
                assert words.endswith(other)
                assert bool(words) == bool(other)
                assert words.startswith(f"{120 * factor * frequency:.0f} steps a minute" if other else "")
    words = unusual_cadence(level, 60.0, leg_mm=900.0, speed_mm_s=1800.0, frequency_hz=2.0)
    assert words.startswith("240 steps a minute of 450 mm are unusual")


@pytest.mark.thorough
@pytest.mark.skipif(not MIRROR, reason="needs the recordings: set MOCAP_MIRROR")
def test_every_recorded_walk_is_one_and_nothing_else() -> None:
    refused_walks = {"26_01", "32_02"}  # not periodic, and a wrong frequency
    with (ROOT / "data" / "sources.csv").open(newline="") as stream:
        listed = [row for row in csv.DictReader(stream) if row["skeleton"] in shipped() and row["trial"]]
    folders = [Path(folder) for folder in MIRROR.split(os.pathsep)]
    retained: dict[str, list[str]] = {"walk": [], "other": []}
    for row in listed:
        path = next((folder / row["path"] for folder in folders if (folder / row["path"]).is_file()), None)
        if path is None:
            continue
        motion = formats.read(path, frame_rate_hz=float(row["frame_rate_hz"]))
        motion, positions, valid = joints_of(motion, shipped()[row["skeleton"]])
        raw = RawClip(report_row(REPORT_COLUMNS), positions, motion.frame_rate_hz, valid)
        walk = steady_walk(raw, Steady()).positions is not None
        listed_as = (
            "walk" if row["action"].endswith("walk") else "other"
        )  # some walks are among varied motion
        if listed_as == "walk":
            assert walk is (row["trial"] not in refused_walks), row["path"]
        retained[listed_as] += [row["trial"]] * walk
    assert len(retained["walk"]) >= 105
    assert retained["other"] == []
