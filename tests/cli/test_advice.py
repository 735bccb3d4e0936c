"""Tests of the advice of `inspect`: every advised command runs, and its result differs from the previous result."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.compose import compose
from pipeline.cli.inspect import inspect
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from tests.clustered_walk import ANATOMICAL, trials, without
from walk3d.export.c3d import write as write_c3d

HZ = 50.0
_COMMAND = re.compile(r"python -m pipeline ([^;]*?)(?:   |;|$)")
MAX_STEPS = 6


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """Joints (T, 15, 3), mm, of one walker on a treadmill."""
    output = walkers.walking_population(
        np.random.default_rng(3), male=1, female=1, duration_s=3.0, frame_rate_hz=HZ
    )
    return np.asarray(output.positions_mm[0])


def commands(lines: list[str]) -> list[list[str]]:
    """Return the arguments of the commands in printed lines of advice."""
    advice = [line for line in lines if line.startswith(("next", "if it is a walk"))]
    return [shlex.split(match[1]) for line in advice for match in _COMMAND.finditer(line)]


def follow(path: Path, static: Path | None = None) -> list[str]:
    """Run the commands that `inspect` advises until it advises none or names a figure; return the last output lines."""
    arguments, before = [str(path)], [""]
    for _ in range(MAX_STEPS):
        (result,) = inspect(arguments)
        assert result.lines != before, f"the answer to {arguments} is the same"
        before = result.lines
        further = commands(result.lines)
        for command in further:
            if command[0].startswith("experiment="):
                compose([item for item in command if not item.startswith("#")])
            assert command[0] in ("inspect", "reconstruct") or command[0].startswith("experiment=")
        again = [command[1:] for command in further if command[0] == "inspect"]
        if not again:
            return result.lines
        arguments = [item.replace("STANDING_TRIAL", str(static)) for item in again[0]]
    raise AssertionError(f"the advice leads in a circle: {before[-1]}")


def relabelled(path: Path, unit: str) -> Path:
    path.write_text(path.read_text().replace("\tmm\t", f"\t{unit}\t"), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("stated", "divisor", "advised"),
    [
        ("mm", 1000.0, "m"),
        ("m", 1.0, "mm"),
        ("mm", 4.5, "mm/0."),
        ("cm", 1000.0, "m"),
        ("mm", 10.0, "cm"),
    ],
)
def test_a_wrong_unit_in_the_file_is_corrected_by_the_advice(
    walk: np.ndarray, tmp_path: Path, stated: str, divisor: float, advised: str
) -> None:
    trc.write(tmp_path / "a.trc", WALKER15.joints, walk / divisor, HZ)
    path = relabelled(tmp_path / "a.trc", stated)
    (first,) = inspect([str(path)])
    assert f" units={advised}" in first.lines[-1]
    last = follow(path)
    assert any(line.startswith("walk: ") for line in last), last
    assert any(f"the requested unit '{advised}" in line for line in last)


def test_a_wrong_unit_of_a_c3d_is_corrected_by_the_advice(walk: np.ndarray, tmp_path: Path) -> None:
    write_c3d(tmp_path / "a.c3d", WALKER15.joints, walk / 1000.0, HZ)
    assert any(line.startswith("walk: ") for line in follow(tmp_path / "a.c3d"))


def test_points_without_a_mapping_get_one_that_is_then_used(
    walk: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = {"knee": "kn", "ankle": "fo", "hip": "be"}
    other = [re.sub("knee|ankle|hip", lambda word: names[word[0]], joint) for joint in WALKER15.joints]
    trc.write(tmp_path / "a.trc", other, walk, HZ)
    monkeypatch.chdir(tmp_path)
    last = follow(tmp_path / "a.trc")
    assert any(line.startswith("mapping: my_lab") for line in last), last


def test_two_people_are_told_apart_by_the_advice(walk: np.ndarray, tmp_path: Path) -> None:
    names = [f"{who}:{joint}" for who in ("anna", "ben") for joint in WALKER15.joints]
    write_c3d(tmp_path / "a.c3d", names, np.concatenate([walk, walk + 900], axis=1), HZ)
    assert any(line.startswith("walk: ") for line in follow(tmp_path / "a.c3d"))


def save(path: Path, points: dict[str, np.ndarray]) -> Path:
    path.parent.mkdir(exist_ok=True)
    trc.write(path, list(points), np.stack(list(points.values()), axis=1), HZ)
    return path


def test_clusters_need_a_static_trial_and_get_it(tmp_path: Path) -> None:
    walk, static = trials(noise_mm=0.4)
    alone = save(tmp_path / "walk" / "anna_1.trc", without(walk, ANATOMICAL))
    standing = save(tmp_path / "other" / "standing.trc", static)
    assert any(line.startswith("walk: ") for line in follow(alone, standing))


def test_a_static_trial_that_does_not_fit_is_not_asked_for_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A static trial is not requested again if it was given but a displaced thigh marker makes its cluster unusable."""
    walk, static = trials()
    static["R.Thigh.Front"] = static["R.Thigh.Front"] + 40.0
    alone = save(tmp_path / "walk" / "anna_1.trc", without(walk, ANATOMICAL))
    standing = save(tmp_path / "other" / "standing.trc", static)
    (result,) = inspect([str(alone), f"static={standing}"])
    described = "\n".join(result.lines)
    fit = re.search(r"R.Thigh.Upper, R.Thigh.Front, R.Thigh.Rear only fit to (\d+) mm", described)
    assert fit, described
    assert 10 < int(fit[1]) < 40
    assert "STANDING_TRIAL" not in described
    save(tmp_path / "walk" / "anna_static.trc", static)
    (result,) = inspect([str(alone)])
    assert "only fit to" in "\n".join(result.lines)
    assert "STANDING_TRIAL" not in "\n".join(result.lines)
    monkeypatch.chdir(tmp_path)
    follow(alone, standing)


def test_a_walk_that_stops_is_advised_bounds(walk: np.ndarray, tmp_path: Path) -> None:
    """The advice for a walk that stops contains complete commands with bounds."""
    slow = np.repeat(walk[:60], 4, axis=0)
    trc.write(tmp_path / "a.trc", WALKER15.joints, slow, HZ)
    follow(tmp_path / "a.trc")
