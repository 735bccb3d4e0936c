"""Tests of the animated SVG of a walker: it contains every frame, and the still picture shows one of these frames."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.pictures.walking import draw_walking
from tests.rejects import rejects

BONES = ((0, 1), (1, 2))
LIMB = np.array([[0.0, 1700.0], [50.0, 900.0], [-200.0, 0.0]])
STEPS = LIMB + 10.0 * np.arange(4)[:, None, None]
draw = partial(
    draw_walking,
    bones=BONES,
    observed=STEPS,
    original=np.tile(STEPS, (2, 1, 1)),
    reconstructed=np.tile(STEPS, (2, 1, 1)) + 5.0,
    seconds=1.25,
    estimated=np.array([True, False, False]),
)
WORDS = (("seen <flat>", "points"), ("in depth", "bones & joints"))


def elements(path: Path, name: str) -> list[ElementTree.Element]:
    """Return all elements of an SVG file with the given tag name."""
    return [e for e in ElementTree.parse(path).getroot().iter() if e.tag.endswith(f"}}{name}")]


def test_points_and_bones_go_through_all_frames_and_back_to_the_first(tmp_path: Path) -> None:
    draw(tmp_path / "a.svg", words=WORDS)
    moving = elements(tmp_path / "a.svg", "animate")
    frames = [element.get("values", "").split(";") for element in moving]
    assert [len(each) for each in frames] == [5, 9, 9, 9, 9]
    assert all(each[0] == each[-1] for each in frames)
    assert [element.get("dur") for element in moving] == ["1.250s", *["2.500s"] * 4]
    assert {each[1].count("L") for each in frames[1:3]} == {len(BONES)}
    assert frames[-1][0].count("h0") == 1, "one joint is estimated, hence hollow"
    assert "seen <flat>" in [element.text for element in elements(tmp_path / "a.svg", "text")]


def test_the_still_picture_is_one_frame(tmp_path: Path) -> None:
    draw(tmp_path / "a.svg", estimated=np.zeros(3, bool), words=WORDS, still=2)
    assert elements(tmp_path / "a.svg", "animate") == []
    assert len(elements(tmp_path / "a.svg", "path")) == 4


def test_turns_of_broken_cycles_are_refused(tmp_path: Path) -> None:
    with rejects("not_whole_cycles", "a.svg"):
        draw(tmp_path / "a.svg", observed=STEPS[:3], words=WORDS)
