"""Tests of the MVNX reader: segments, poses, truncated files, and XML features that would be harmful."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.formats import mvnx
from tests.formats.contract import FIXTURES, check_contract
from tests.rejects import rejects

WHOLE = (FIXTURES / "mvnx_by_hand.mvnx").read_text(encoding="utf-8")


def test_the_fixture() -> None:
    motion = mvnx.read(FIXTURES / "mvnx_by_hand.mvnx")
    check_contract(motion)
    assert motion.names == ("Pelvis", "LeftUpperLeg")
    assert (motion.frame_rate_hz, motion.units) == (120.0, "m")
    np.testing.assert_array_equal(motion.positions_mm[0], [[1000, 2000, 3000], [4000, 5000, 6000]])
    assert motion.valid.tolist() == [[True, True], [True, True], [True, False]]


def test_of_several_subjects_the_frames_that_all_have_are_read(tmp_path: Path) -> None:
    subject = WHOLE[WHOLE.index("  <subject") : WHOLE.index("</mvnx>")]
    last = subject[subject.index('      <frame type="normal" time="16"') : subject.index("    </frames>")]
    other = subject.replace('label="A"', 'label="B"').replace(last, "").replace("<position>", "<position>9")
    path = tmp_path / "two.mvnx"
    path.write_text(WHOLE.replace("</mvnx>", f"{other}</mvnx>"), encoding="utf-8")
    motion = mvnx.read(path)
    assert motion.names == ("A:Pelvis", "A:LeftUpperLeg", "B:Pelvis", "B:LeftUpperLeg")
    assert motion.positions_mm[:, [0, 2], 0].tolist() == [[1000.0, 91000.0], [1500.0, 91500.0]]
    assert "The subjects have different numbers of frames; the first 2 of each are read." in motion.notes


@pytest.mark.parametrize(
    ("text", "code", "where", "values"),
    [
        (WHOLE[:-9], "truncated", "line 15", {}),
        (WHOLE.replace("mvnx", "html"), "wrong_format", "", {"root": "html"}),
        (WHOLE.replace("1.5 2 3 4 5 6", "1.5 2 3"), "wrong_count", "frame 2", {"needed": 6, "count": 3}),
        (WHOLE.replace("1.5 2", "1.5 two"), "not_number", "frame 2, segment Pelvis", {"text": "two"}),
        (WHOLE.replace('"normal"', '"npose"'), "no_frames", "frame 1", {}),
        (WHOLE.replace('frameRate="120"', ""), "unknown_rate", "", {}),
        (WHOLE.replace("<mvnx", '<!DOCTYPE a [<!ENTITY b "c">]><mvnx', 1), "document_type", "", {}),
    ],
)
def test_damage_is_refused_in_a_sentence(
    text: str, code: str, where: str, values: dict[str, object], tmp_path: Path
) -> None:
    path = tmp_path / "a.mvnx"
    path.write_text(text, encoding="utf-8")
    with rejects(code, where, **values) as caught:
        mvnx.read(path)
    assert "\n" not in str(caught.value)


def test_a_comment_may_speak_of_a_document_type(tmp_path: Path) -> None:
    comment = "<!-- <!DOCTYPE mvnx SYSTEM 'mvnx.dtd'> and <!ENTITY a> as MVN writes them -->\n<mvnx"
    path = tmp_path / "a.mvnx"
    path.write_text(WHOLE.replace("<mvnx", comment, 1), encoding="utf-8")
    whole = mvnx.read(FIXTURES / "mvnx_by_hand.mvnx")
    np.testing.assert_array_equal(mvnx.read(path).positions_mm, whole.positions_mm)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-le", "utf-16-be"])
def test_a_document_type_is_refused_in_any_encoding(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mvnx"
    text = WHOLE.partition("\n")[2]  # without the line that says UTF-8
    mark = "\ufeff" if encoding in ("utf-16-le", "utf-16-be") else ""
    path.write_text(mark + text, encoding=encoding)
    assert mvnx.read(path).names == ("Pelvis", "LeftUpperLeg")
    entities = '<!DOCTYPE mvnx [<!ENTITY a "lol"><!ENTITY b "&a;&a;&a;">]>\n' + text
    path.write_text(mark + entities, encoding=encoding)
    with rejects("document_type"):
        mvnx.read(path)


def test_the_frames_of_several_subjects(tmp_path: Path) -> None:
    begin, end = WHOLE.index("  <subject"), WHOLE.index("</mvnx>")
    other = (
        WHOLE[begin:end]
        .replace('"A"', '"B"')
        .replace('<frame type="normal" time="16"', '<frame type="x" time="16"')
    )
    path = tmp_path / "a.mvnx"
    path.write_text(WHOLE[:end] + other + WHOLE[end:], encoding="utf-8")
    motion = mvnx.read(path)
    assert motion.names == ("A:Pelvis", "A:LeftUpperLeg", "B:Pelvis", "B:LeftUpperLeg")
    np.testing.assert_array_equal(motion.positions_mm[:, 2], [[1000, 2000, 3000], [1500, 2000, 3000]])
    assert any("the first 2 of each" in note for note in motion.notes)
