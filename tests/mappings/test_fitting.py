"""Tests of the mapping and the unit that are found for a recording, and of proposed mappings."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from pipeline import mappings
from pipeline.ingestion.nearest_joints import propose
from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import map_joints
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import UpAxis
from tests.rejects import rejects
from walk3d.film.keypoints import detections
from walk3d.film.reconstruct import layouts

HEIGHT = [1650, 1420, 1420, 1100, 860, 1420, 1100, 860, 950, 900, 480, 80, 900, 480, 80]
SIDE = [0, 0, -180, -250, -270, 180, 250, 270, 0, -90, -90, -90, 90, 90, 90]


def body(names: dict[str, str]) -> MotionCapture:
    """Return a recording of an upright person whose points have the given names for joints."""
    joints = [WALKER15.index(joint) for joint in names]
    positions = np.array([[SIDE[j], 0.0, HEIGHT[j]] for j in joints])[None].repeat(5, axis=0)
    valid = np.ones(positions.shape[:2], dtype=bool)
    return MotionCapture(tuple(names.values()), positions, valid, 100.0, "mm")


def named(pattern: str, words: dict[str, str]) -> MotionCapture:
    sided = {
        f"{side}_{joint}": pattern.format(side=side.capitalize(), S=side[0].upper(), word=word)
        for joint, word in words.items()
        for side in ("left", "right")
    }
    return body(sided | {"head": "Head", "sternum": "Neck", "pelvis": "Hips"})


def with_points(motion: MotionCapture, *names: str) -> MotionCapture:
    """Return the recording with additional points on the floor."""
    count = len(names)
    return dataclasses.replace(
        motion,
        names=(*motion.names, *names),
        positions_mm=np.concatenate([motion.positions_mm, np.zeros((5, count, 3))], axis=1),
        valid=np.concatenate([motion.valid, np.ones((5, count), dtype=bool)], axis=1),
    )


def renamed(motion: MotionCapture, middle: str) -> MotionCapture:
    """Return the recording with the last three points renamed by a pattern, in lower case."""
    last = [middle.format(name.lower()) for name in motion.names[-3:]]
    return dataclasses.replace(motion, names=(*motion.names[:-3], *last))


def behind(beginning: str, motion: MotionCapture) -> MotionCapture:
    """Return the recording with the same beginning in front of each point name."""
    return dataclasses.replace(motion, names=tuple(beginning + name for name in motion.names))


PARTS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
UNITY = dict(zip(PARTS, ("UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand"), strict=True))
QUEST = {**UNITY, "ankle": "FootAnkle", "shoulder": "ArmUpper", "elbow": "ArmLower", "wrist": "HandWrist"}
XSENS_IN_SHORT = dict(zip(PARTS, ("U_Leg", "L_Leg", "Foot", "U_Arm", "F_Arm", "Hand"), strict=True))
HUMANIK = dict(zip(PARTS, ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand"), strict=True))
BIPED = dict(zip(PARTS, ("Thigh", "Calf", "Foot", "UpperArm", "Forearm", "Hand"), strict=True))
UNREAL = dict(zip(PARTS, ("thigh", "calf", "foot", "upperarm", "lowerarm", "hand"), strict=True))
RIGIFY = dict(zip(PARTS, ("thigh", "shin", "foot", "upper_arm", "forearm", "hand"), strict=True))
POSER = dict(zip(PARTS, ("Thigh", "Shin", "Foot", "Shldr", "ForeArm", "Hand"), strict=True))
MAKEHUMAN = dict(
    zip(PARTS, ("upperleg01", "lowerleg01", "foot", "upperarm01", "lowerarm01", "wrist"), strict=True)
)
DEPTH = dict(zip(PARTS, ("Hip", "Knee", "Foot", "Shoulder", "Elbow", "Hand"), strict=True))
TALKING = dict(zip(PARTS, ("upleg", "leg", "talocrural", "arm", "forearm", "wrist"), strict=True))
OLD_MAKEHUMAN = dict(zip(PARTS, ("UpLeg", "LoLeg", "Foot", "UpArm", "LoArm", "Hand"), strict=True))
SOMA = dict(zip(PARTS, ("Leg", "Shin", "Foot", "Arm", "ForeArm", "Hand"), strict=True))
AUTO_RIG_PRO = dict(
    zip(
        PARTS,
        ("thigh_stretch", "leg_stretch", "foot", "arm_stretch", "forearm_stretch", "hand"),
        strict=True,
    )
)
MMD = dict(zip(PARTS, ("足", "ひざ", "足首", "腕", "ひじ", "手首"), strict=True))
MMD_IN_ENGLISH = dict(zip(PARTS, ("leg", "knee", "ankle", "arm", "elbow", "wrist"), strict=True))
PLAIN = {part: part.capitalize() for part in PARTS}
ANATOMY = dict(zip(PARTS, ("troch", "condylus", "malleolus", "acromion", "epicond", "styloid"), strict=True))


@pytest.mark.parametrize(
    ("motion", "family"),
    [
        (named("{word}_{S}", UNITY), "bandai_namco"),
        (behind("FullBody_", named("{side}{word}", QUEST)), "bandai_namco"),
        (with_points(named("{S}_{word}", XSENS_IN_SHORT), "L5", "T8", "L_Shou", "R_Shou"), "xsens"),
        (named("{side}{word}", HUMANIK), "mixamo"),
        (named("mixamorig:{side}{word}", HUMANIK), "mixamo"),
        (behind("Bip01 ", named("{S} {word}", BIPED)), "bones"),
        (named("{word}_{S}", UNREAL), "bones"),
        (named("{word}.{S}", RIGIFY), "bones"),
        (named("{S}{word}", POSER), "bones"),
        (named("{word}.{S}", MAKEHUMAN), "bones"),
        (named("{S}{word}", DEPTH), "named_joints"),
        (named("{S}{word}", PLAIN), "named_joints"),
        (named("subject:{S}.{word}", PLAIN), "named_joints"),
        (named("m{word}{side}", PLAIN), "named_joints"),
        (behind("b_", named("{S}_{word}", TALKING)), "mixamo"),
        (named("{word}_{S}", OLD_MAKEHUMAN), "bones"),
        (named("{side}{word}", SOMA), "rokoko"),
        (with_points(renamed(named("{side}{word}", SOMA), "Bob_{}"), "Head", "Neck", "Spine4"), "rokoko"),
        (with_points(named("{word}.{S}", MMD), "上半身", "下半身", "肩.L", "肩.R"), "mikumikudance"),
        (
            with_points(
                named("{word}_{S}", MMD_IN_ENGLISH), "upper body", "lower body", "shoulder_L", "shoulder_R"
            ),
            "mikumikudance",
        ),
        (renamed(named("{word}.{S}", AUTO_RIG_PRO), "{}.x"), "auto_rig_pro"),
        (
            with_points(
                renamed(
                    named("{word}.{S}", {**AUTO_RIG_PRO, "hip": "thigh_twist", "shoulder": "arm_twist"}),
                    "{}.x",
                ),
                *("thigh_stretch.L", "thigh_stretch.R", "arm_stretch.L", "arm_stretch.R"),
            ),
            "auto_rig_pro",
        ),
        (body({joint: joint for joint in WALKER15.joints}), "walker15"),
    ],
)
def test_the_family_is_recognised(motion: MotionCapture, family: str) -> None:
    fit = mappings.suggest(motion, mappings.shipped().values())
    assert (fit.mapping.name, fit.usable, fit.missing) == (family, True, ())
    positions, valid = map_joints(motion, fit.mapping)
    assert valid.all()
    for j, joint in enumerate(WALKER15.joints):
        if "_" in joint:
            np.testing.assert_allclose(positions[0, j], [SIDE[j], 0, HEIGHT[j]])


@pytest.mark.parametrize(
    ("patterns", "family"),
    [
        ("{S}ASI {S}PSI {S}KNEE {S}KNEEM {S}ANK {S}ANKM", "skin_landmarks"),
        ("{S}_IAS {S}_IPS {S}_LEP {S}_MEP {S}_LMAL {S}_MMAL", "skin_landmarks"),
        ("{S}ASIS {S}PSIS {S}LK {S}MK {S}LA {S}MA", "skin_landmarks"),
        ("{side}_ASIS {side}_PSIS Lat_Epicondyle_{side} Malleolus_{side}", "skin_landmarks"),
        ("{side}_HipJC {side}_Knee_Center {side}_AJC", "skin_landmarks"),
        ("{S}GT {S}KNE {S}KNM {S}ANK {S}ANM", "trochanters"),
        ("{S}ASI {S}PSI {S}GT {S}KNE {S}ANK {S}HEE", "plugin_gait"),
        ("{S}ASI {S}PSI {S}LFC {S}MFC {S}LMAL {S}MMAL", "rajagopal"),
    ],
)
def test_landmarks_go_by_many_names(patterns: str, family: str) -> None:
    names = [
        pattern.format(side=side, S=side[0].upper())
        for side in ("left", "right")
        for pattern in patterns.split()
    ]
    fit = mappings.suggest(with_points(body({"head": "Head"}), *names), mappings.shipped().values())
    assert (fit.mapping.name, fit.usable) == (family, True)


LANGUAGES = [
    "hanche genou cheville épaule coude poignet gauche droite g d",
    "cadera rodilla tobillo hombro codo muñeca izquierda derecha izq der",
    "Hüfte Knie Sprunggelenk Schulter Ellbogen Handgelenk links rechts li re",
    "anca ginocchio caviglia spalla gomito polso sinistra destra sx dx",
    "quadril joelho tornozelo ombro cotovelo punho esquerdo direito esq dir",
    "heup knie enkel schouder elleboog pols links rechts L R",
]


@pytest.mark.parametrize("words", LANGUAGES)
@pytest.mark.parametrize("written", ["{0} {1}", "{1}_{0}", "{2}_{0}", "{0}.{2}", "{3}{4}"])
def test_joints_and_sides_in_other_languages(words: str, written: str) -> None:
    *parts, left, right, short_left, short_right = words.split()
    sides = {"left": (left, short_left), "right": (right, short_right)}
    names = {
        f"{side}_{joint}": written.format(part, *both, part.capitalize(), both[0].capitalize())
        for joint, part in zip(PARTS, parts, strict=True)
        for side, both in sides.items()
    }
    motion = body(names | {"head": "Head", "sternum": "Neck", "pelvis": "Hips"})
    fit = mappings.suggest(motion, mappings.shipped().values())
    assert (fit.mapping.name, fit.missing) == ("named_joints", ())
    joints, _ = map_joints(motion, fit.mapping)
    np.testing.assert_array_equal(joints[0, 3:8, 2], HEIGHT[3:8])
    assert joints[0, WALKER15.index("left_knee"), 0] == SIDE[WALKER15.index("left_knee")]
    result = detections("csv", "a", [(0, "", np.arange(45.0).reshape(15, 3))], 1, names=motion.names)
    layout, order, _ = layouts.recognise(result)
    assert motion.names[order[layout.points.index("left_knee")]] == names["left_knee"]


def test_the_nearest_mapping_is_told_by_the_markers_that_are_missing() -> None:
    names = {
        "left_hip": "LASI",
        "right_hip": "RASI",
        "pelvis": "SACR",
        "left_knee": "LKNE",
        "left_ankle": "LANK",
    }
    fit = mappings.suggest(body(names | {"right_ankle": "RANK"}), mappings.shipped().values())
    assert (fit.mapping.name, fit.usable, fit.lacking) == ("plugin_gait", False, ("RKNE",))


def test_without_legs_nothing_fits() -> None:
    fit = mappings.suggest(
        body({"head": "Head", "sternum": "Neck", "left_knee": "LKnee"}), mappings.shipped().values()
    )
    assert not fit.usable
    assert "left_ankle" in fit.missing


@pytest.mark.parametrize(("unit", "factor"), [("cm", 10.0), ("m", 1000.0), ("in", 25.4)])
def test_a_unit_that_nobody_stated_is_told_by_the_legs_and_said(unit: str, factor: float) -> None:
    motion = dataclasses.replace(body({joint: joint for joint in WALKER15.joints}), units_assumed=True)
    mapping = mappings.shipped()["walker15"]
    result, sentence = mappings.rescaled(motion, mapping, 850.0 / factor)
    assert result == pytest.approx(factor)
    assert f"taken as {unit}" in sentence
    assert mappings.rescaled(motion, mapping, 850.0) == (
        1.0,
        "The file states no unit; its numbers are taken as mm, which makes legs of 850 mm.",
    )
    family = dataclasses.replace(mapping, units="in/0.45")
    assert mappings.rescaled(motion, family, 15.0)[0] == pytest.approx(25.4 / 0.45)
    assert mappings.rescaled(motion, family, 0.85)[0] == 1000.0  # exported again, in metres
    assert mappings.rescaled(motion, mapping, 21.7)[0] == 25.4, "a child in inches, no giant in CMU's unit"
    assert mappings.rescaled(motion, mapping, 41.0)[0] == 10.0, (
        "a small child in centimetres, no giant in inches"
    )
    assert mappings.rescaled(motion, mapping, 38.0)[0] == 25.4, "a tall man in inches"
    stated = dataclasses.replace(motion, units_assumed=False)
    assert mappings.rescaled(stated, mapping, 850.0 / factor) == (1.0, "")


def test_a_proposal_is_read_again_and_finds_the_joints(tmp_path: Path) -> None:
    motion = named("{side} {word}", ANATOMY)
    assert not mappings.suggest(motion, mappings.shipped().values()).usable
    path = tmp_path / "my_lab.yaml"
    path.write_text(mappings.written(propose(motion, "my_lab"), motion), encoding="utf-8")
    mapping = mappings.load(path)
    assert set(mapping.guessed) == set(WALKER15.joints)
    positions, _ = map_joints(motion, mapping)
    for joint in ("left_ankle", "right_knee", "left_hip", "right_shoulder", "left_elbow", "right_wrist"):
        j = WALKER15.index(joint)
        inwards = 0.5 if "hip" in joint else 1.0  # a quarter of the distance of the trochanters
        np.testing.assert_allclose(positions[0, j], [inwards * SIDE[j], 0, HEIGHT[j]])
    # Angles that a model wrote among the points, far below the floor, are no points of the body.
    outputs = dataclasses.replace(
        motion,
        names=(*motion.names, "LAnkleAngles", "RAnkleAngles"),
        positions_mm=np.concatenate([motion.positions_mm, np.full((5, 2, 3), -9000.0)], axis=1),
        valid=np.ones((5, len(motion.names) + 2), dtype=bool),
    )
    assert propose(outputs, "my_lab").joints == mapping.joints
    with rejects("too_few_points"):
        propose(body({"head": "Head"}), "x")
    hands = body({joint: f"tip{k}" for k, joint in enumerate(WALKER15.joints[:8])})
    with rejects("no_joint_like"):
        propose(dataclasses.replace(hands, positions_mm=hands.positions_mm * 0.0), "x")


PIG = [
    *("LFHD", "RFHD", "LBHD", "RBHD", "CLAV", "C7"),
    *(side + point for side in "LR" for point in ("SHO", "ELB", "WRA", "WRB", "ASI", "PSI", "KNE", "ANK")),
]
CGM2 = [side + point for side in "LR" for point in ("KNM", "MED", "THAP", "THAD", "TIAP", "TIAD")]
GAIT2392 = ["Top.Head", "Sternum", "V.Sacral"] + [
    f"{side}.{point}"
    for side in "LR"
    for point in (
        "ASIS", "Acromium", "Elbow", "Wrist", "Thigh.Upper", "Knee.Lat", "Shank.Front", "Ankle.Lat", "Heel", "Toe.Tip",
    )
]  # fmt: skip


CMU = [point.replace("ASI", "FWT").replace("PSI", "BWT") for point in PIG]
SPRINTER = ["C7", "MAN", "SACR"] + [
    side + point for side in "LR" for point in ("ASI", "SH", "ELB", "WR", "LEPI", "LMAL")
]


@pytest.mark.parametrize("up", [1, 2])
def test_markers_by_the_names_of_cmu_stand_upright_in_any_axes(up: int) -> None:
    motion = placed(CMU)
    motion = dataclasses.replace(motion, positions_mm=np.roll(motion.positions_mm, up - 2, axis=-1))
    fit = mappings.suggest(motion, mappings.shipped().values())
    positions, _ = map_joints(motion, fit.mapping)
    assert fit.mapping.name == "cmu_41_markers"
    assert (positions[:, WALKER15.index("left_hip"), 2] > positions[:, WALKER15.index("left_ankle"), 2]).all()


def test_epicondyles_of_a_laboratory() -> None:
    points = [
        side + point for side in "LR" for point in ("ASIS", "PSIS", "LatEpi", "MedEpi", "LatMal", "MedMal")
    ]
    fit = mappings.suggest(placed(points), mappings.shipped().values())
    assert (fit.mapping.name, fit.usable) == ("helen_hayes", True)


@pytest.mark.parametrize(
    ("sacrum", "pattern", "words"),
    [
        ("V.Sacral", "{}.{}", ("ASIS", "Shoulder", "Elbow", "Wrist", "Thigh", "Knee", "Shank", "Ankle", "Heel", "Toe")),
        ("Psis", "{}x{}", ("Asis", "Should", "Elbow", "Wrist", "Thigh", "LatCon", "Shank", "LatMal", "Heel", "Toe1")),
    ],
)  # fmt: skip
def test_lateral_markers_that_are_called_knee_and_ankle_lie_outside_of_them(
    sacrum: str, pattern: str, words: tuple[str, ...]
) -> None:
    motion = placed([sacrum, *(pattern.format(side, word) for side in "LR" for word in words)])
    fit = mappings.suggest(motion, mappings.shipped().values())
    assert (fit.mapping.name, fit.missing) == ("helen_hayes", ("head", "sternum"))
    knee, other, waist = (motion.positions_mm[:, k] for k in (6, 11, 1))
    result = map_joints(motion, fit.mapping)[0][:, WALKER15.index("left_knee")]
    np.testing.assert_allclose(result, knee + 0.24 * (other - waist))


def test_markers_and_joints_that_differ_in_case_alone() -> None:
    joints = named("{S}{word}", dict(zip(PARTS, map(str.capitalize, PARTS), strict=True)))
    markers = with_points(joints, *(f"{side}_{part}" for side in "lr" for part in ("knee", "ankle")))
    fit = mappings.suggest(markers, mappings.shipped().values())
    assert (fit.mapping.name, fit.missing) == ("named_joints", ())
    without = markers.names.index("LHip")
    lacking = dataclasses.replace(
        markers, names=(*markers.names[:without], "x", *markers.names[without + 1 :])
    )
    with rejects("point_twice", point="l knee", count=2):
        mappings.suggest(lacking, mappings.shipped().values())


def test_joints_that_are_named_are_taken_before_markers_beside_them() -> None:
    legs = {
        f"{side}_{part}": f"{side.upper()}_{part.upper()}" for side in ("left", "right") for part in PARTS[:3]
    }
    motion = with_points(body(legs), "LEFT_ASIS", "RIGHT_ASIS", "SACRUM", "LEFT_PSIS", "RIGHT_PSIS")
    assert mappings.suggest(motion, mappings.shipped().values()).mapping.name == "named_joints"


@pytest.mark.parametrize(
    "points", ["ASI PSI KNE ANK Thigh Shin Foot", "_IAS _IPS _FLE _FAL _Thigh _Calf _Foot"]
)
def test_markers_on_thigh_and_shin_are_no_bones(points: str) -> None:
    motion = placed([side + point for side in "LR" for point in points.split()])
    fit = mappings.suggest(motion, mappings.shipped().values())
    assert (fit.mapping.name, fit.usable) == ("ior" if "_IAS" in points else "plugin_gait", True)


def test_the_root_that_a_rig_lacks_is_named() -> None:
    motion = placed(
        [side + point for side in ("Left", "Right") for point in ("UpperLeg", "LowerLeg", "Foot")]
    )
    fit = mappings.suggest(motion, mappings.shipped().values())
    assert (fit.usable, fit.mapping.name, fit.lacking[0]) == (False, "bandai_namco", "Hips")


def test_of_what_is_lacking_only_what_legs_and_pelvis_need_is_named() -> None:
    motion = placed([side + point for side in "LR" for point in ("_IAS", "_IPS", "_FLE", "_outer_ankle")])
    assert mappings.suggest(motion, mappings.shipped().values()).lacking == ("L_FAL", "R_FAL")


def test_markers_of_a_sprinter() -> None:
    fit = mappings.suggest(placed(SPRINTER), mappings.shipped().values())
    assert (fit.mapping.name, fit.missing) == ("rajagopal", ("head",))


@pytest.mark.parametrize(
    ("points", "family", "missing"),
    [
        ("ASIS PSIS LEK LM HEE SHO LEE MEE MW LW", "rajagopal", ("head", "sternum")),
        ("IAS IPS FLE FME FAL TAM FCC CAJ HLE HME RSP UHE", "ior", ("head", "sternum")),
    ],
)
def test_markers_of_public_treadmill_and_overground_walks(
    points: str, family: str, missing: tuple[str, ...]
) -> None:
    motion = placed([side + point for side in "LR" for point in points.split()])
    fit = mappings.suggest(motion, mappings.shipped().values())
    assert (fit.mapping.name, fit.usable, fit.missing) == (family, True, missing)
    assert fit.points == len(motion.names) - 2  # all but the heels


def test_a_wrist_of_ior_is_the_middle_of_both_styloids_by_whatever_name() -> None:
    words = "IAS IPS FLE FME FAL TAM HLE HME RSP UHE"
    points = [side + point for side in "LR" for point in words.split()]
    motion = placed(points)
    positions, _ = map_joints(motion, mappings.shipped()["ior"])
    middle = motion.positions_mm[:, [points.index("LRSP"), points.index("LUHE")]].mean(axis=1)
    wrist = positions[:, WALKER15.index("left_wrist")]
    np.testing.assert_allclose(np.linalg.norm(wrist, axis=1), np.linalg.norm(middle, axis=1))


@pytest.mark.parametrize(
    ("points", "family"), [(PIG, "plugin_gait"), ([*PIG, *CGM2], "cgm2"), (GAIT2392, "gait2392")]
)
def test_families_of_markers_by_their_own_names(points: list[str], family: str) -> None:
    motion = placed(points)
    fit = mappings.suggest(motion, mappings.shipped().values())
    assert (fit.mapping.name, fit.usable, fit.missing) == (family, True, ())
    assert mappings.chosen(family) is fit.mapping
    if family == "cgm2":
        positions, _ = map_joints(dataclasses.replace(motion, up=UpAxis.z), fit.mapping)
        middle = motion.positions_mm[:, [points.index("LANK"), points.index("LMED")]].mean(axis=1)
        np.testing.assert_allclose(positions[:, WALKER15.index("left_ankle")], middle)


def test_without_a_shoulder_marker_shoulders_are_missing_and_no_others() -> None:
    motion = placed([point for point in PIG if point != "LSHO"])
    assert mappings.suggest(motion, mappings.shipped().values()).missing == (
        "left_shoulder",
        "right_shoulder",
    )
    joints = map_joints(motion, mappings.chosen("plugin_gait"))[1]
    assert joints.all(axis=0).sum() == 13


def placed(points: list[str]) -> MotionCapture:
    """Return a recording of named points, with points of the pelvis above points of the ankles."""
    low = [0.0 if any(word in point.upper() for word in ("AN", "MED", "MAL")) else 900.0 for point in points]
    positions = np.array([[40.0 * k, 10.0 * (k % 3), z] for k, z in enumerate(low)])[None].repeat(3, axis=0)
    valid = np.ones(positions.shape[:2], dtype=bool)
    return MotionCapture(tuple(points), positions, valid, 100.0, "mm")
