"""Tests of the ASF/AMC reader: known values, damaged files, and independent forward kinematics."""

from __future__ import annotations

import dataclasses
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

from pipeline import formats
from pipeline.formats import acclaim
from pipeline.formats.acclaim import asf
from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import map_joints
from pipeline.validation import InvalidInput
from tests.formats.contract import FIXTURES, check_contract, recording, replace, source_mapping
from tests.rejects import rejects

ASF, AMC = FIXTURES / "asf_by_hand.asf", FIXTURES / "amc_by_hand.amc"
needs_recordings = pytest.mark.skipif(
    not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR"
)


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path]:
    """Handwritten motion and skeleton files in a new folder, where tests may damage them."""
    for source, name in ((ASF, "a.asf"), (AMC, "a_01.amc")):
        (tmp_path / name).write_bytes(source.read_bytes())
    return tmp_path / "a_01.amc", tmp_path / "a.asf"


def test_the_hand_made_motion_has_the_positions_worked_out_by_hand() -> None:
    # The root stands at 9 units of 100 mm.  Frame 1: the thigh (4 units) and shin (4) hang down, the arm (3)
    # points to +x.  Frame 2: the root steps to +x, the thigh turns by 90 degrees about x, so -y becomes -z,
    # and the shin turns back; the arm's frame is turned by 90 degrees about z, so its x is our y, and turning
    # about y by 90 brings +x to -z.  Frame 3: the root turns about y, so +x becomes -z; the thigh turns about
    # z, so -y becomes +x, seen by the world as -z; the arm's first-named angle acts first (+x stays in the
    # arm's frame, ends as +y); the other order would end at +x.
    motion = acclaim.read(AMC)
    check_contract(motion)
    assert motion.names == ("root", "hip", "Thigh", "shin", "arm")
    expected = [
        [[0, 900, 0], [0, 900, 0], [0, 500, 0], [0, 100, 0], [300, 900, 0]],
        [[100, 900, 0], [100, 900, 0], [100, 900, -400], [100, 500, -400], [100, 900, -300]],
        [[0, 900, 0], [0, 900, 0], [0, 900, -400], [0, 900, -800], [0, 1200, 0]],
    ]
    assert motion.positions_mm == pytest.approx(np.array(expected), abs=1e-9)
    assert motion.valid.all()
    assert motion.frame_rate_hz == 120
    assert motion.units == "in/0.254"
    assert motion.notes == ()


def test_units_of_the_caller_take_the_place_of_the_skeletons() -> None:
    in_metres = acclaim.read(AMC, units="m")
    assert in_metres.units == "m"
    assert in_metres.positions_mm == pytest.approx(acclaim.read(AMC).positions_mm * 10)


def test_the_cmu_unit_is_56_444_millimetres(pair: tuple[Path, Path]) -> None:
    replace(pair[1], "length 0.254", "length 0.45")
    assert asf.read_skeleton(pair[1]).millimetres == pytest.approx(56.444, abs=5e-4)


def test_radians_of_motion_and_skeleton_are_read_each_in_its_own_file(pair: tuple[Path, Path]) -> None:
    degrees = acclaim.read(AMC)
    text = pair[0].read_text().replace(":DEGREES", ":RADIANS")
    for value in ("-90", "90"):
        text = text.replace(f" {value}", f" {math.radians(float(value))!r}").replace(
            f"\t{value}", f"\t{math.radians(float(value))!r}"
        )
    pair[0].write_text(text)
    replace(pair[1], "angle deg", "angle RAD")
    replace(pair[1], "axis 0 0 90 XYZ", f"axis 0 0 {math.pi / 2!r} xyz")
    radians = acclaim.read(pair[0])
    assert radians.positions_mm == pytest.approx(degrees.positions_mm, abs=1e-9)
    # Without a word from the motion, the skeleton's unit holds.
    replace(pair[0], ":RADIANS\n", "")
    assert acclaim.read(pair[0]).positions_mm == pytest.approx(degrees.positions_mm, abs=1e-9)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace(" ", "\t"),
        lambda text: text.upper(),
        lambda text: text.replace("\n", "\n\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("shin 0\n2", "# a comment\n  shin 0 # another\n2"),
        lambda text: text.replace("arm\t0\t90\nthigh 90 0 0\n", "thigh 90 0 0\narm\t0\t90\n"),
        lambda text: text.replace("thigh 90 0 0", "THIGH 90 0 0"),
    ],
    ids=["crlf", "cr", "tabs", "case", "blank", "bom", "comments", "order changes", "case changes"],
)
def test_harmless_differences_of_the_text_change_nothing(
    pair: tuple[Path, Path], spoil: Callable[[str], str]
) -> None:
    text = pair[0].read_text()
    assert spoil(text) != text
    pair[0].write_text(spoil(text), newline="")
    motion, original = acclaim.read(pair[0]), acclaim.read(AMC)
    assert np.array_equal(motion.positions_mm, original.positions_mm)
    assert motion.notes == ()


def test_what_is_odd_but_readable_is_noted(pair: tuple[Path, Path]) -> None:
    text = re.sub(r"^(\d)$", r"1\1", pair[0].read_text(), flags=re.MULTILINE)
    text = text.replace(":DEGREES", ":DEGREES\n:SAMPLES-PER-SECOND 60").rstrip("\n")
    pair[0].write_text(text.replace("shin -90", "shin nan"))
    motion = acclaim.read(pair[0])
    check_contract(motion)
    assert [motion.valid[1].tolist(), motion.valid[[0, 2]].all()] == [[True, True, True, False, True], True]
    joined = " ".join(motion.notes)
    for word in ("numbered from 11", "SAMPLES-PER-SECOND 60", "no line end", "1 of 3 frames contain NaN"):
        assert word in joined


@pytest.mark.parametrize(
    ("old", "new", "code", "where", "values"),
    [
        ("\n2\n", "\n4\n", "frame_order", "after frame 1", {"needed": 2, "frame": 4}),
        ("\n2\n", "\n1\n", "frame_order", "after frame 1", {"needed": 2, "frame": 1}),
        ("\n2\n", "\n" + "2" * 5000 + "\n", "unknown_joint", "frame 1", {"joint": "2" * 5000}),
        ("thigh 90 0 0", "thigh 90 0", "wrong_count", "frame 2, bone Thigh", {"needed": 3, "count": 2}),
        ("thigh 90 0 0", "thigh 90 0 0 0", "wrong_count", "frame 2, bone Thigh", {"needed": 3, "count": 4}),
        ("shin -90\n", "", "incomplete_frame", "frame 2, bone shin", {"joint": "shin"}),
        ("shin -90", "tail -90", "unknown_joint", "frame 2", {"joint": "tail"}),
        ("shin -90", "shin -90\nshin -90", "joint_twice", "frame 2, bone shin", {}),
        ("thigh 90 0 0", "thigh 90 x 0", "not_number", "frame 2, bone Thigh, ry", {"text": "x"}),
        ("thigh 90 0 0", "thigh 90 1_0 0", "not_number", "frame 2, bone Thigh, ry", {"text": "1_0"}),
        ("thigh 90 0 0", "thigh 90 -1.#IND 0", "not_number", "frame 2, bone Thigh, ry", {"text": "-1.#IND"}),
        ("thigh 90 0 0", "thigh 90 inf 0", "not_number", "frame 2, bone Thigh, ry", {"text": "inf"}),
        ("thigh 90 0 0", "thigh 90 1e300 0", "not_number", "frame 2, bone Thigh, ry", {"text": "1e300"}),
        ("thigh 0 0 0   # hangs down\n", "", "incomplete_frame", "frame 1, bone Thigh", {"joint": "Thigh"}),
        ("thigh 0 0 0 ", "leg 0 0 0 ", "unknown_joint", "frame 1", {"joint": "leg"}),
        (":DEGREES", "DEGREES", "unknown_keyword", "a_01.amc", {"keyword": "DEGREES"}),
    ],
)
def test_a_motion_that_contradicts_itself_is_refused_by_frame_and_bone(
    pair: tuple[Path, Path], old: str, new: str, code: str, where: str, values: dict[str, object]
) -> None:
    replace(pair[0], old, new)
    with rejects(code, where, **values):
        acclaim.read(pair[0])


@pytest.mark.parametrize(
    ("old", "new", "code", "where", "values"),
    [
        ("dof rz rx", "dof rz l", "wrong_channels", "bone arm, dof", {"channels": "rz l"}),
        ("dof rz rx", "dof rz rz", "wrong_channels", "bone arm, dof", {"channels": "rz rz"}),
        ("dof rz rx", "dof tx", "wrong_channels", "bone arm, dof", {"channels": "tx"}),
        ("axis 0 0 90 XYZ", "axis 0 0 90 XYX", "unknown_axes", "bone arm, axis", {"axes": "xyx"}),
        ("axis 0 0 90 XYZ", "axis 0 90 XYZ", "unusable_line", "bone arm, axis", {"needed": 3}),
        ("direction 0 -2 0", "direction 0 0 0", "no_direction", "bone shin", {"length": 4.0}),
        ("length 3\r\n", "length -3\r\n", "no_direction", "bone arm", {"length": -3.0}),
        ("length 3\r\n", "length 3\r\n    length 3\r\n", "key_twice", "line 47", {"key": "length"}),
        ("direction 0 -2 0", "direction 0 -2", "unusable_line", "bone shin, direction", {"needed": 3}),
        ("name arm", "name shin", "no_own_name", "bone 4 of :bonedata", {"name": "shin"}),
        ("name arm", "name root", "no_own_name", "bone 4 of :bonedata", {"name": "root"}),
        ("angle deg", "angle grad", "unknown_angle", ":units", {"unit": "grad"}),
        ("length 0.254", "", "unknown_unit", "a.asf", {"unit": ""}),
        ("length 0.254", "length 0", "unknown_unit", "a.asf", {"unit": "in/0"}),
        ("orientation 0 0 0", "orientation 0 90 0", "preset_orientation", ":root", {}),
        ("hip thigh", "hip thigh shin", "two_parents", ":hierarchy", {"joint": "shin"}),
        ("root hip arm", "root hip", "no_path_to_root", ":hierarchy", {"joint": "arm"}),
        ("root hip arm", "root hip arm tail", "unknown_joint", ":hierarchy", {"joint": "tail"}),
        ("hip thigh\r\n  end\r\n", "hip thigh\r\n", "truncated", "a.asf", {}),
        (":hierarchy\r\n  begin", ":hierarchy", "unbalanced", "line 54", {}),
    ],
)
def test_a_skeleton_that_contradicts_itself_is_refused_by_bone(
    pair: tuple[Path, Path], old: str, new: str, code: str, where: str, values: dict[str, object]
) -> None:
    replace(pair[1], old, new)
    with rejects(code, where, **values):
        asf.read_skeleton(pair[1])


def test_a_preset_position_moves_the_root(pair: tuple[Path, Path]) -> None:
    replace(pair[1], "position 0 0 0", "position 0 1 0")
    raised = acclaim.read(AMC).positions_mm + np.array([0, 100, 0])
    assert acclaim.read(pair[0]).positions_mm == pytest.approx(raised)


def test_the_skeleton_beside_the_motion_is_found_or_asked_for(pair: tuple[Path, Path]) -> None:
    motion, skeleton = pair
    asf = skeleton.read_bytes()
    assert acclaim.read(motion).positions_mm.shape == (3, 5, 3)
    (motion.parent / "b.asf").write_bytes(b"of another person")
    assert acclaim.read(motion).positions_mm.shape == (3, 5, 3)
    (motion.parent / "A_0.ASF").write_bytes(asf.replace(b" shin", b" calf"))
    with rejects("unknown_joint", joint="shin"):
        acclaim.read(motion)  # the longest beginning wins, and it is the wrong skeleton
    skeleton.unlink()
    (motion.parent / "A_0.ASF").rename(motion.parent / "c.asf")
    with rejects("unclear_skeleton", skeletons=["b.asf", "c.asf"]):
        acclaim.read(motion)
    (motion.parent / "b.asf").unlink()
    (motion.parent / "c.asf").unlink()
    with rejects("unclear_skeleton", skeletons=[]):
        acclaim.read(motion)


def test_the_skeleton_one_folder_up_is_found_where_there_is_none_beside(pair: tuple[Path, Path]) -> None:
    motion, skeleton = pair
    below = motion.parent / "squats"
    below.mkdir()
    moved = motion.rename(below / f"{skeleton.stem}_squat_001.amc")
    (motion.parent / "zz.asf").write_bytes(b"of another person")
    assert acclaim.skeleton_of(moved) == skeleton
    assert acclaim.read(moved).positions_mm.shape == (3, 5, 3)
    (below / "q.asf").write_bytes(b"of another person")
    assert acclaim.skeleton_of(moved) == below / "q.asf", "the motion's own folder comes first"


def test_the_skeleton_in_a_folder_of_its_own_is_found_by_number(pair: tuple[Path, Path]) -> None:
    motion, skeleton = pair
    motions, skeletons = motion.parent / "amc", motion.parent / "asf"
    motions.mkdir()
    skeletons.mkdir()
    moved = motion.rename(motions / "07_01-walk.amc")
    reference = skeleton.rename(skeletons / "07-walk.asf")
    for other in ("08-walk.asf", "70-walk.asf"):
        (skeletons / other).write_bytes(b"of another person")
    assert acclaim.skeleton_of(moved) == reference
    assert acclaim.read(moved).positions_mm.shape == (3, 5, 3)
    with rejects("unclear_skeleton", skeletons=[]):
        acclaim.read(moved.rename(motions / "09_01-walk.amc"))


def test_a_cut_within_a_frame_is_refused_and_at_its_end_leaves_whole_frames(pair: tuple[Path, Path]) -> None:
    data = AMC.read_bytes()
    whole = acclaim.read(AMC).positions_mm
    for size in range(len(data)):
        cut = data[:size]
        pair[0].write_bytes(cut)
        if not re.search(rb"\nshin -?\d+\n?$", cut):
            with pytest.raises(InvalidInput):
                acclaim.read(pair[0])
            continue
        motion = acclaim.read(pair[0])
        frames = cut.count(b"shin")
        assert len(motion.valid) == frames
        assert np.array_equal(motion.positions_mm[:-1], whole[: frames - 1])
        # Without its line end, the last value may have lost digits: -9 of -90.
        is_noted = any("no line end" in note for note in motion.notes)
        assert is_noted != cut.endswith(b"\n")
        assert is_noted or np.array_equal(motion.positions_mm, whole[:frames])


@pytest.mark.parametrize("content", [b"1\n", b"HIERARCHY\nROOT Hips\n{\n"])
def test_foreign_files_are_refused(pair: tuple[Path, Path], content: bytes) -> None:
    pair[0].write_bytes(content)
    with pytest.raises(InvalidInput):
        acclaim.read(pair[0])
    with pytest.raises(InvalidInput):
        asf.read_skeleton(pair[0])


def test_unusable_rates_are_refused() -> None:
    for rate in (0, -1, math.nan, math.inf):
        with rejects("out_of_range", "the frame rate", value=rate):
            formats.read(AMC, frame_rate_hz=rate)


# ----------------------------------------------------------------------- independent forward kinematics


def turned(axis: int, degrees: float) -> np.ndarray:
    """Return the 4×4 rotation about a coordinate axis by Rodrigues' formula."""
    k = np.zeros((3, 3))
    k[(axis + 2) % 3, (axis + 1) % 3], k[(axis + 1) % 3, (axis + 2) % 3] = 1, -1
    matrix = np.eye(4)
    matrix[:3, :3] += math.sin(math.radians(degrees)) * k + (1 - math.cos(math.radians(degrees))) * k @ k
    return matrix


def moved(vector: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = vector
    return matrix


@dataclasses.dataclass
class Bone:
    name: str
    parent: str
    direction: np.ndarray
    length: float
    axis: np.ndarray
    axis_order: str
    dof: list[str]


def random_skeleton(generator: np.random.Generator, count: int) -> list[Bone]:
    bones: list[Bone] = []
    for b in range(count):
        direction = generator.normal(size=3)
        bones.append(
            Bone(
                name=f"bone{b}",
                parent=generator.choice(["root", *(bone.name for bone in bones)]),
                direction=direction / np.linalg.norm(direction),
                length=float(generator.choice([0.0, generator.uniform(0.1, 9)])),
                axis=generator.uniform(-180, 180, 3),
                axis_order="".join(generator.permutation(list("XYZ"))),
                dof=list(generator.permutation(["rx", "ry", "rz"])[: generator.integers(4)]),
            )
        )
    return bones


def naive_positions(
    bones: list[Bone], root: list[str], frame: dict[str, list[float]]
) -> dict[str, np.ndarray]:
    """Return the positions of the bone ends in one frame, in the file's units, computed with 4×4 matrices."""
    positions: dict[str, np.ndarray] = {}

    def walk(name: str, matrix: np.ndarray) -> None:
        positions[name] = matrix[:3, 3]
        for bone in bones:
            if bone.parent == name:
                c = np.eye(4)
                for letter in bone.axis_order:
                    c = turned("XYZ".index(letter), bone.axis["XYZ".index(letter)]) @ c
                motion = np.eye(4)
                for freedom, value in zip(bone.dof, frame[bone.name], strict=True):
                    motion = turned("xyz".index(freedom[1]), value) @ motion
                end = moved(bone.direction * bone.length)
                walk(bone.name, matrix @ c @ motion @ np.linalg.inv(c) @ end)

    start, turn = np.eye(4), np.eye(4)
    for freedom, value in zip(root, frame["root"], strict=True):
        axis = "xyz".index(freedom[1])
        if freedom[0] == "t":
            start = start @ moved(value * np.eye(3)[axis])
        else:
            turn = turned(axis, value) @ turn
    walk("root", start @ turn)
    return positions


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 9), frames=st.integers(1, 4))
def test_positions_equal_a_recursion_with_4x4_matrices(seed: int, count: int, frames: int) -> None:
    generator = np.random.default_rng(seed)
    bones = random_skeleton(generator, count)
    root = list(generator.permutation(["tx", "ty", "tz", "rx", "ry", "rz"]))[: generator.integers(1, 7)]
    motion = [
        {"root": list(generator.uniform(-200, 200, len(root)))}
        | {bone.name: list(generator.uniform(-200, 200, len(bone.dof))) for bone in bones}
        for _ in range(frames)
    ]
    hierarchy = [f"{bone.parent} {bone.name}" for bone in bones]
    asf = [":units", "length 2.54", "angle deg", ":root", f"order {' '.join(root)}", ":bonedata"]
    for bone in bones:
        direction, axis = (" ".join(map(repr, v.tolist())) for v in (bone.direction, bone.axis))
        asf += ["begin", f"name {bone.name}", f"direction {direction}", f"length {bone.length!r}"]
        asf += [f"axis {axis} {bone.axis_order}"]
        asf += [f"dof {' '.join(bone.dof)}"] * bool(bone.dof) + ["end"]
    asf += [":hierarchy", "begin", *generator.permutation(hierarchy), "end"]
    amc = [":DEGREES"]
    order = generator.permutation(["root", *(bone.name for bone in bones)])
    for number, frame in enumerate(motion, start=1):
        amc.append(str(number))
        amc += [f"{name} {' '.join(repr(float(v)) for v in frame[name])}" for name in order if frame[name]]
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "s.asf").write_text("\n".join(asf) + "\n")
        Path(folder, "s.amc").write_text("\n".join(amc) + "\n")
        read = acclaim.read(Path(folder, "s.amc"))
    check_contract(read)
    for t, frame in enumerate(motion):
        expected = naive_positions(bones, root, frame)
        for p, name in enumerate(read.names):
            assert read.positions_mm[t, p] == pytest.approx(expected[name] * 10, abs=1e-8)


# ----------------------------------------------------------------------------------- real recordings


def mirror() -> Path:
    return Path(os.environ["MOCAP_MIRROR"])


@pytest.mark.parametrize("name", ["cmu_asf", "hdm_asf"])
def test_mappings_make_every_joint_of_walker15(name: str) -> None:
    points = ["root", "head", "lowerneck"]
    points += [s + b for s in "lr" for b in ("hipjoint", "femur", "tibia", "clavicle", "humerus", "wrist")]
    motion = recording(tuple(points), np.random.default_rng(0).normal(size=(2, len(points), 3)))
    positions, valid = map_joints(motion, source_mapping(name))
    assert valid.all()
    # y is up in the file, z here; and every left joint comes from a bone on the left.
    assert np.array_equal(positions[:, 0, 2], motion.positions_mm[:, 1, 1])
    for joint, rule in source_mapping(name).joints.items():
        side = joint[0] if joint.startswith(("left", "right")) else ""
        assert not side or all(point.startswith(side) for point in rule)
    assert source_mapping("cmu_asf").joints == source_mapping("hdm_asf").joints


@needs_recordings
def test_a_sample_of_the_cmu_and_hdm05_recordings_parses_with_constant_bones() -> None:
    paths = sorted(mirror().rglob("*.amc"))
    assert len(paths) > 100
    for path in paths[::12]:
        motion = acclaim.read(path)
        check_contract(motion)
        assert motion.valid.all()
        assert set(motion.notes) <= {"The text is not UTF-8; it was read as Latin-1."}
        for bone, parent in (("lfemur", "lhipjoint"), ("rtibia", "rfemur"), ("lhumerus", "lclavicle")):
            ends = (motion.positions_mm[:, motion.names.index(name)] for name in (bone, parent))
            lengths = np.linalg.norm(next(ends) - next(ends), axis=1)
            assert np.ptp(lengths) < 1e-6
        assert motion.units == "in/0.45"


@needs_recordings
@pytest.mark.parametrize("subject", ["02", "07", "12", "29", "35", "49"])
def test_walks_are_of_human_size_with_the_right_hip_to_the_right(subject: str) -> None:
    walks = sorted((mirror() / "cmu" / subject).glob("*.amc"))
    listed = (mirror() / "sources.csv").read_text().splitlines()
    path = next(p for p in walks if any(f"/{p.name}," in row and ",walk," in row for row in listed))
    positions, valid = map_joints(acclaim.read(path), source_mapping("cmu_asf"))
    assert valid.all()

    def joint(name: str) -> np.ndarray:
        return positions[:, WALKER15.index(name)]

    for side in ("left", "right"):
        hip, knee, ankle = (joint(f"{side}_{name}") for name in ("hip", "knee", "ankle"))
        leg = np.linalg.norm(hip - knee, axis=1) + np.linalg.norm(knee - ankle, axis=1)
        assert 700 < leg.mean() < 1000
    assert 750 < np.median(joint("pelvis")[:, 2]) < 1050
    assert 1350 < np.median(joint("head")[:, 2]) < 1900
    assert np.all(np.median(joint("head")[:, 2]) > np.median(positions[:, 1:, 2], axis=0))
    # Heading along +y means that +x, the right, is the velocity turned clockwise seen from above.
    velocity = np.gradient(joint("pelvis"), axis=0)
    right = np.stack([velocity[:, 1], -velocity[:, 0]], axis=1)
    across = (joint("right_hip") - joint("left_hip"))[:, :2]
    assert np.mean(np.sum(right * across, axis=1) > 0) > 0.8
