"""Tests of the BVH reader: known values, variants that other programs write, and damaged files."""

from __future__ import annotations

import math
import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.formats import acclaim, bvh
from pipeline.skeleton.mapped_joints import map_joints
from pipeline.validation import InvalidInput
from tests.formats.contract import FIXTURES, check_contract, recording, replace, source_mapping
from tests.rejects import rejects

BVH = FIXTURES / "bvh_by_hand.bvh"


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Copy of the handwritten BVH file, which tests may damage."""
    (tmp_path / "a.bvh").write_bytes(BVH.read_bytes())
    return tmp_path / "a.bvh"


def test_the_hand_made_file_has_the_positions_worked_out_by_hand() -> None:
    # Centimetres.  Frame 1: nothing turns; the spine is 20 above the hips (at 90), the arm 30 to its side and
    # 10 long, the leg 40 below and 40 long.  Frame 2: the spine's channels Z X, both 90, are Rz·Rx: the arm
    # along x keeps x, then becomes y; the spine's end along y becomes z, then keeps z (Rx·Rz would send it to
    # -x).  The hips stand at x = 10 and the leg's position channel lifts it by 10.  Frame 3: the hips turn by
    # 90 about y (x becomes -z) and the arm by 90 about z.
    motion = bvh.read(BVH)
    check_contract(motion)
    assert motion.names == ("Hips", "Spine", "Left Arm", "Left Arm_end", "Spine_end", "Leg", "Leg_end")
    expected_cm = [
        [[0, 90, 0], [0, 110, 0], [30, 110, 0], [40, 110, 0], [0, 120, 0], [5, 50, 0], [5, 10, 0]],
        [[10, 90, 0], [10, 110, 0], [10, 140, 0], [10, 150, 0], [10, 110, 10], [15, 60, 0], [15, 20, 0]],
        [[0, 90, 0], [0, 110, 0], [0, 110, -30], [0, 120, -30], [0, 120, 0], [0, 50, -5], [0, 10, -5]],
    ]
    assert motion.positions_mm == pytest.approx(np.array(expected_cm) * 10, abs=1e-9)
    assert motion.valid.all()
    assert motion.frame_rate_hz == 50
    assert motion.units == "cm"
    assert motion.units_assumed
    (note,) = motion.notes
    assert "OFFSET of Leg" in note


@pytest.mark.parametrize(
    ("encoding", "name"),
    [
        ("shift_jis", "左足ボーン"),
        ("utf-16", "左足"),
        ("utf-16-le", "Épaule"),
        ("utf-16-be", "膝"),
        ("latin-1", "Hüfte"),
        ("latin-1", "\x9cil créé"),
    ],
)
def test_names_in_whatever_encoding(encoding: str, name: str, copy: Path) -> None:
    copy.write_bytes(copy.read_text().replace("Spine", name).encode(encoding))
    motion = bvh.read(copy)
    assert (motion.names[1], motion.names[4]) == (name, f"{name}_end")
    noted = {"shift_jis": "Shift-JIS", "latin-1": "Latin-1"}.get(encoding)
    assert [note for note in motion.notes if "UTF-8" in note] == (
        [f"The text is not UTF-8; it was read as {noted}."] if noted else []
    )


@pytest.mark.parametrize(
    ("encoding", "name"), [("euc_kr", "왼어깨"), ("euc_jp", "左足ボーン"), ("gb2312", "左膝关节")]
)
def test_names_in_other_encodings_are_no_japanese_and_stay_apart(
    encoding: str, name: str, copy: Path
) -> None:
    copy.write_bytes(copy.read_text().replace("Spine", name).encode(encoding))
    motion = bvh.read(copy)
    assert motion.names[1] == name.encode(encoding).decode("latin-1")
    assert "The text is not UTF-8; it was read as Latin-1." in motion.notes


@pytest.mark.parametrize(("units", "factor"), [("mm", 0.1), ("m", 100.0), ("in/0.45", 5.64444)])
def test_the_caller_says_the_unit(units: str, factor: float) -> None:
    motion = bvh.read(BVH, units=units)
    assert motion.positions_mm == pytest.approx(bvh.read(BVH).positions_mm * factor, rel=1e-5)
    assert motion.units == units
    assert not motion.units_assumed


def test_the_caller_says_the_rate_where_the_file_does_not(copy: Path) -> None:
    copy.write_text(
        re.sub(r"Frame Time:\t\S+", "Frame Time:\t0", copy.read_text(encoding="utf-8")), encoding="utf-8"
    )
    motion = bvh.read(copy, frame_rate_hz=40.0)
    assert motion.frame_rate_hz == pytest.approx(40.0)
    assert "requested frame rate is used" in " ".join(motion.notes)


def with_decimal_commas(text: str) -> str:
    return re.sub(r"(\d)\.(\d)", r"\1,\2", text)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text.replace("\r\n", "\n"),
        lambda text: text.replace("\r\n", "\r"),
        lambda text: text.replace(" ", "\t").replace("Left\tArm", "Left Arm"),
        lambda text: text.replace("\r\n", "\r\n\r\n"),
        lambda text: text.replace("\r\n\t", "\r\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\r\n{", " {"),
        lambda text: re.sub("ROOT|JOINT|End Site|OFFSET|CHANNELS|MOTION|Frame|position", lower, text),
        lambda text: text.replace("End Site", "End Site Foo"),
    ],
    ids="lf cr tabs blank indentation bom braces case named-end".split(),  # noqa: SIM905
)
def test_harmless_differences_of_the_text_change_nothing(copy: Path, spoil: Callable[[str], str]) -> None:
    text = copy.read_bytes().decode()
    assert spoil(text) != text
    copy.write_bytes(spoil(text).encode())
    motion, original = bvh.read(copy), bvh.read(BVH)
    assert motion.names == original.names
    assert np.array_equal(motion.positions_mm, original.positions_mm)
    assert motion.notes == original.notes


def lower(match: re.Match[str]) -> str:
    return match[0].lower()


def test_decimal_commas_are_read_if_nothing_has_a_point(copy: Path) -> None:
    copy.write_bytes(with_decimal_commas(copy.read_bytes().decode()).encode())
    motion = bvh.read(copy)
    assert np.array_equal(motion.positions_mm, bvh.read(BVH).positions_mm)
    assert motion.frame_rate_hz == 50
    assert any("Decimal commas" in note for note in motion.notes)
    replace(copy, "OFFSET 30,0", "OFFSET 30.0")
    with rejects("ambiguous_commas"):
        bvh.read(copy)


def test_commas_between_values_are_not_taken_for_decimals(copy: Path) -> None:
    text = (
        copy.read_bytes().decode().replace(".0", "").replace("0.02", "1").replace("0 90 0 0", "0, 90, 0, 0")
    )
    copy.write_bytes(text.encode())
    with rejects("ambiguous_commas"):
        bvh.read(copy)


def test_a_last_line_without_an_end_is_noted(copy: Path) -> None:
    copy.write_bytes(copy.read_bytes().rstrip())
    motion = bvh.read(copy)
    assert np.array_equal(motion.positions_mm, bvh.read(BVH).positions_mm)
    assert any("no line end" in note for note in motion.notes)


@pytest.mark.parametrize("declared", [2, 4])
def test_a_wrong_number_of_frames_is_noted_and_all_frames_are_read(copy: Path, declared: int) -> None:
    replace(copy, "Frames:\t3", f"Frames:\t{declared}")
    motion = bvh.read(copy)
    assert len(motion.positions_mm) == 3
    assert any(f"declares {declared} frames but has 3" in note for note in motion.notes)


def test_nan_makes_invalid_what_depends_on_it_and_is_noted(copy: Path) -> None:
    replace(copy, "10 90 0 0 0 0 90 90 0 -30", "10 90 0 0 0 0 90 NaN 0 -30")
    motion = bvh.read(copy)
    check_contract(motion)
    assert motion.valid[[0, 2]].all()
    assert motion.valid[1].tolist() == [True, True, False, False, False, True, True]
    assert any("1 of 3 frames contain NaN" in note for note in motion.notes)


def test_a_root_without_channels_stands_at_its_offset(copy: Path) -> None:
    replace(copy, "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation", "CHANNELS 0")
    text = copy.read_bytes().decode()
    head, motion = text.split("0.02\r\n")
    rows = [" ".join(row.split()[6:]) for row in motion.splitlines()]
    for start in (head, head.replace("CHANNELS 0", "")):
        copy.write_bytes(
            (start.replace("OFFSET 0 0 0", "OFFSET 1 2 3") + "0.02\n" + "\n".join(rows)).encode()
        )
        read = bvh.read(copy)
        assert read.positions_mm[:, 0] == pytest.approx(np.tile([10, 20, 30], (3, 1)))
        assert read.positions_mm[0, 1] == pytest.approx([10, 220, 30])


def test_joints_of_two_people_with_equal_names_have_the_number_of_the_person_in_front(copy: Path) -> None:
    head, motion = copy.read_text().split("MOTION")
    joints = head.partition("ROOT")[2]
    rows = [f"{row} {row}" for row in motion.splitlines() if row[:1].isdigit() or row[:1] == "-"]
    times = [line for line in motion.splitlines() if line.startswith("Frame")]
    copy.write_text(f"{head}ROOT{joints}MOTION\n" + "\n".join([*times, *rows]) + "\n")
    single, double = bvh.read(BVH), bvh.read(copy)
    assert double.names == tuple(f"{person}:{name}" for person in (1, 2) for name in single.names)
    np.testing.assert_array_equal(double.positions_mm, np.tile(single.positions_mm, (1, 2, 1)))


def test_two_end_sites_of_one_joint_have_names_of_their_own(copy: Path) -> None:
    end = "\t\tEnd Site\r\n\t\t{\r\n\t\t\tOFFSET 0.0 10.0 0.0\r\n\t\t}\r\n"
    replace(copy, end, end + end.replace("10.0", "12.0"))
    motion = bvh.read(copy)
    assert motion.names[4:6] == ("Spine_end", "Spine_end2")
    assert motion.positions_mm[0, 5] == pytest.approx([0, 1220, 0])


OFFSET, END = "OFFSET 30.0 0.0 0.0", "OFFSET 10.0 0.0 0.0"
TURNS, ROW = "CHANNELS 2 Zrotation Xrotation", "10 90 0 0 0 0 90 90 0 -30"


@pytest.mark.parametrize(
    ("old", "new", "code", "where", "values"),
    [
        ("HIERARCHY", "HIERACHY", "wrong_format", "line 1", {}),
        ("ROOT Hips\r\n{", "ROOT Hips", "unbalanced", "line 3", {}),
        ("\t}\r\n}\r\nMOTION", "\t}\r\nMOTION", "unclosed", "line 30", {"joint": "Hips", "line": 2}),
        ("\t}\r\n}\r\nMOTION", "\t}\r\n}\r\n}\r\nMOTION", "unopened", "line 31", {}),
        ("\tJOINT Spine", "\t{\r\n\tJOINT Spine", "unbalanced", "line 6", {}),
        ("JOINT Leg", "JOINT Spine", "no_own_name", "line 24", {"name": "Spine"}),
        ("JOINT Leg", "JOINT", "no_own_name", "line 24", {"name": ""}),
        ("JOINT Leg", "ROOT Leg", "joint_misplaced", "line 24", {"key": "ROOT"}),
        ("ROOT Hips", "JOINT Hips", "joint_misplaced", "line 2", {"key": "JOINT"}),
        (
            OFFSET,
            "OFFSET 30.0 0.0",
            "unreadable_offset",
            "line 12",
            {"joint": "Left Arm", "text": "30.0 0.0"},
        ),
        (OFFSET, "OFFSET 30.0 x 0.0", "unusable_line", "OFFSET of Left Arm, line 10", {"needed": 3}),
        (OFFSET, "OFFSET 30.0 nan 0.0", "unusable_line", "OFFSET of Left Arm, line 10", {"needed": 3}),
        ("\t\t\t" + OFFSET + "\r\n", "", "unusable_line", "OFFSET of Left Arm, line 10", {"needed": 3}),
        ("CHANNELS 2 Z", "CHANNELS 3 Z", "wrong_channels", "line 9", {"joint": "Spine"}),
        (TURNS, "CHANNELS 2 Zrotation Zrotation", "wrong_channels", "line 9", {"joint": "Spine"}),
        (TURNS, "CHANNELS 2 Zrotation Wrotation", "wrong_channels", "line 9", {"joint": "Spine"}),
        (END, END + "\r\nCHANNELS 1 Xrotation", "wrong_channels", "line 17", {"joint": "Left Arm_end"}),
        (END, END + "\r\nJOINT a", "joint_in_end_site", "line 17", {}),
        (END, END.replace("FF", "F"), "unreadable_line", "line 16", {"text": "OFSET 10.0 0.0 0.0"}),
        ("Frames:\t3", "Frames:\tthree", "unreadable_header", "line 32", {"key": "Frames"}),
        ("Frames:\t3\r\n", "", "unreadable_header", "line 32", {"key": "Frames"}),
        ("Frame Time:\t0.02", "Frame Time:\t0", "unusable_rate", "Frame Time", {"text": "0"}),
        ("Frame Time:\t0.02", "Frame Time:\t-0.02", "unusable_rate", "Frame Time", {"text": "-0.02"}),
        ("Frame Time:\t0.02", "Frame Time:\tnan", "unusable_rate", "Frame Time", {"text": "nan"}),
        (ROW, "10 90 0 0 0 0 90 90 0", "wrong_count", "line 35", {"needed": 10, "count": 9}),
        (ROW, ROW + " 1", "wrong_count", "line 35", {"needed": 10, "count": 11}),
        (ROW, ROW.replace("90 0 -", "9O 0 -"), "not_number", "line 35, channel Spine.rx", {"text": "9O"}),
        (ROW, ROW.replace("90 0 -", "9_0 0 -"), "not_number", "line 35, channel Spine.rx", {"text": "9_0"}),
        (ROW, ROW.replace("90 0 -", "inf 0 -"), "not_number", "line 35, channel Spine.rx", {"text": "inf"}),
        (ROW, ROW.replace("10 ", "1e300 "), "not_number", "line 35, channel Hips.tx", {"text": "1e300"}),
        ("0 90 0 0 0 90 0 0 90 -40", "0 90 0 0", "truncated", "line 36", {"needed": 10, "count": 4}),
    ],
)
def test_a_file_that_contradicts_itself_is_refused_by_line(
    copy: Path, old: str, new: str, code: str, where: str, values: dict[str, object]
) -> None:
    replace(copy, old, new)
    with rejects(code, where, **values):
        bvh.read(copy)


def test_a_cut_within_a_frame_is_refused_and_between_frames_is_noted(copy: Path) -> None:
    data = BVH.read_bytes()
    whole = bvh.read(BVH).positions_mm
    start = data.index(b"0.02\r\n") + 6
    for size in range(len(data)):
        copy.write_bytes(data[:size])
        rows = data[start:size].split(b"\r\n") if size > start else []
        widths = [len(row.split()) for row in rows if row.split()]
        if not widths or widths[-1] != 10 or data[:size].endswith(b"-"):
            with pytest.raises(InvalidInput):
                bvh.read(copy)
            continue
        motion = bvh.read(copy)
        assert np.array_equal(motion.positions_mm[:-1], whole[: len(widths) - 1])
        assert len(widths) == 3 or any(f"has {len(widths)};" in note for note in motion.notes)


def test_a_file_without_frames_or_channels_is_refused(copy: Path) -> None:
    text = copy.read_bytes().decode()
    copy.write_bytes(b"HIERARCHY\nMOTION\n")
    with rejects("truncated", part="header"):
        bvh.read(copy)
    copy.write_bytes(text[: text.index("0 90 0")].encode())
    with rejects("no_frames"):
        bvh.read(copy)
    copy.write_bytes(re.sub(r"\t+CHANNELS.*", "", text).encode())
    with rejects("no_channels"):
        bvh.read(copy)


# ----------------------------------------------------------------------- independent forward kinematics


def turned(axis: str, degrees: float) -> np.ndarray:
    """Return the 4×4 rotation about a coordinate axis by Rodrigues' formula."""
    a = "XYZ".index(axis)
    k = np.zeros((3, 3))
    k[(a + 2) % 3, (a + 1) % 3], k[(a + 1) % 3, (a + 2) % 3] = 1, -1
    matrix = np.eye(4)
    matrix[:3, :3] += math.sin(math.radians(degrees)) * k + (1 - math.cos(math.radians(degrees))) * k @ k
    return matrix


def moved(vector: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = vector
    return matrix


class Writer:
    """Writer of a BVH file with a random hierarchy, with the positions of one frame from 4×4 matrices."""

    def __init__(self, generator: np.random.Generator, count: int) -> None:
        self.generator = generator
        self.left = count
        self.lines: list[str] = ["HIERARCHY"]
        self.values: list[float] = []
        self.expected: list[np.ndarray] = []
        self.joint("ROOT", np.eye(4))

    def joint(self, kind: str, parent: np.ndarray) -> None:
        self.left -= 1
        offset = self.generator.normal(size=3) * 10
        every = [f"{axis}{what}" for axis in "XYZ" for what in ("position", "rotation")]
        channels = list(self.generator.permutation(every)[: self.generator.integers(7)])
        if kind == "ROOT":
            channels = channels or ["Xposition"]
        values = list(self.generator.uniform(-200, 200, len(channels)))
        self.values += values
        position, turn = offset.copy(), np.eye(4)
        for channel, value in zip(channels, values, strict=True):
            if channel.endswith("position"):
                position["XYZ".index(channel[0])] = value
            else:
                turn = turn @ turned(channel[0], value)
        matrix = parent @ moved(position) @ turn
        self.expected.append(matrix[:3, 3])
        self.lines += [f"{kind} joint{len(self.expected)}", "{"]
        self.lines += [f"OFFSET {' '.join(map(repr, offset.tolist()))}"]
        self.lines += [f"CHANNELS {len(channels)} {' '.join(channels)}"]
        while self.left > 0 and self.generator.random() < 0.7:
            self.joint("JOINT", matrix)
        end = self.generator.normal(size=3)
        self.expected.append((matrix @ moved(end))[:3, 3])
        self.lines += ["End Site", "{", f"OFFSET {' '.join(map(repr, end.tolist()))}", "}", "}"]


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 9))
def test_positions_equal_a_recursion_with_4x4_matrices(seed: int, count: int) -> None:
    writer = Writer(np.random.default_rng(seed), count)
    values = " ".join(repr(float(value)) for value in writer.values)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.bvh")
        path.write_text("\n".join([*writer.lines, "MOTION", "Frames: 1", "Frame Time: 1", values]))
        motion = bvh.read(path, units="mm")
    check_contract(motion)
    assert motion.positions_mm[0] == pytest.approx(np.array(writer.expected), abs=1e-8)


# ----------------------------------------------------------------------------------- the CMU conversion


CONVERSION = {
    "root": "Hips",
    "lhipjoint": "LeftUpLeg",
    "lfemur": "LeftLeg",
    "ltibia": "LeftFoot",
    "rhipjoint": "RightUpLeg",
    "rfemur": "RightLeg",
    "rtibia": "RightFoot",
    "lowerback": "Spine",
    "upperback": "Spine1",
    "lowerneck": "Neck1",
    "head": "Head_end",
    "lclavicle": "LeftArm",
    "lhumerus": "LeftForeArm",
    "lradius": "LeftHand",
    "rclavicle": "RightArm",
    "rhumerus": "RightForeArm",
    "rradius": "RightHand",
}
"""Joint of the BVH conversion that corresponds to each bone end of the original ASF/AMC file."""


@pytest.mark.skipif(not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR")
@pytest.mark.parametrize("clip", ["02/02_01", "07/07_01", "35/35_01"])
def test_the_bvh_mapping_puts_back_the_bones_that_the_conversion_lost(clip: str) -> None:
    original = acclaim.read(Path(os.environ["MOCAP_MIRROR"], "cmu", f"{clip}.amc"))

    def end(bone: str) -> np.ndarray:
        return original.positions_mm[:, original.names.index(bone)]

    # The conversion as it is: all that hangs on the thorax stands too low by the thorax.
    above = ("neck", "head", "clavicle", "humerus", "radius")
    lost = end("thorax") - end("upperback")
    positions = np.stack([end(bone) - lost * bone.endswith(above) for bone in CONVERSION], axis=1)
    converted = recording(tuple(CONVERSION.values()), positions)
    expected, _ = map_joints(original, source_mapping("cmu_asf"))
    restored, valid = map_joints(converted, source_mapping("cmu_bvh"))
    assert valid.all()
    errors = np.linalg.norm(restored - expected, axis=-1).mean(axis=0)
    assert errors[:8].max() < 20
    assert errors[8:].max() < 1e-9
    assert np.linalg.norm(lost, axis=1).min() > 100  # what the mapping would miss without the repair
