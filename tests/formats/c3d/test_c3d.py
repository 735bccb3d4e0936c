"""The C3D reader: one contract, on bytes made here, on ezc3d's files and on real recordings."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from pipeline.formats import c3d
from pipeline.formats.c3d import header as c3d_header
from pipeline.skeleton.recorded import MILLIMETRES, MotionCapture
from pipeline.validation import InvalidInput
from tests.formats.contract import FIXTURES
from tests.rejects import rejects
from walk3d.export.c3d import write as write_c3d

INTEL, DEC, MIPS = 84, 85, 86
ORDER = {INTEL: "<", DEC: "<", MIPS: ">"}


# --- a C3D file, byte by byte ------------------------------------------------------------------------------


def reals(values: npt.ArrayLike, processor: int) -> bytes:
    """32-bit reals as the processor writes them; VAX by its definition, 0.1f (binary) 2^(e-128)."""
    if processor != DEC:
        return np.asarray(values, dtype=f"{ORDER[processor]}f4").tobytes()
    mantissa, exponent = np.frexp(np.asarray(values, dtype=np.float32).astype(float).reshape(-1))
    fraction = (np.abs(mantissa) * 2**24).astype(np.int64) - 2**23
    bits = (mantissa < 0).astype(np.int64) << 31 | (exponent + 128).astype(np.int64) << 23 | fraction
    bits[mantissa == 0] = 0
    return np.stack([bits >> 16, bits & 0xFFFF], axis=-1).astype("<u2").tobytes()


def integers(values: npt.ArrayLike, processor: int) -> bytes:
    return np.asarray(values).astype(np.int64).astype(f"{ORDER[processor]}u2").tobytes()


def parameter(name: str, group: int, value: object, processor: int) -> bytes:
    """One parameter record; the type follows the value's: text, list of text, float or int."""
    if isinstance(value, str):
        kind, dimensions, content = -1, [len(value)], value.encode("latin-1")
    elif isinstance(value, list) and value and isinstance(value[0], str):
        width = max(map(len, value))
        kind, dimensions = -1, [width, len(value)]
        content = b"".join(text.ljust(width).encode("latin-1") for text in value)
    else:
        array = np.asarray(value)
        kind = 4 if array.dtype.kind == "f" else 2
        dimensions = list(array.shape)
        content = reals(array, processor) if kind == 4 else integers(array, processor)
    body = struct.pack("bB", kind, len(dimensions)) + bytes(dimensions) + content + b"\0"
    return struct.pack("bb", len(name), group) + name.encode() + integers(len(body) + 2, processor) + body


def make(
    positions: np.ndarray,
    labels: list[str],
    *,
    residuals: np.ndarray | None = None,
    processor: int = INTEL,
    scale: float = -1.0,
    units: str = "mm  ",
    rate: float = 100.0,
    first: int = 1,
    analog: tuple[int, int] = (0, 0),
    point: dict[str, object] | None = None,
    trial: dict[str, object] | None = None,
    header: dict[int, bytes] | None = None,
) -> bytes:
    """The bytes of a C3D file; `point` and `trial` change parameters (None drops), `header` patches bytes."""
    frames, points = positions.shape[:2]
    last = first + frames - 1
    residuals = np.zeros((frames, points)) if residuals is None else residuals
    used: dict[str, object] = {
        "USED": points,
        "FRAMES": min(frames, 65535),
        "SCALE": float(scale),
        "RATE": float(rate),
        "UNITS": units,
    }
    for block, begin in enumerate(range(0, len(labels), 255), start=1):
        used["LABELS" + (str(block) if block > 1 else "")] = labels[begin : begin + 255]
    used |= point or {}
    channels: dict[str, object] = {"USED": analog[0], "RATE": float(rate * analog[1])}
    if analog[0]:  # ezc3d needs these four; the reader here none
        names = [f"channel {k}" for k in range(analog[0])]
        channels |= {"LABELS": names, "GEN_SCALE": 1.0, "SCALE": [1.0] * analog[0], "OFFSET": [0] * analog[0]}
    groups = {
        1: ("POINT", used),
        2: ("ANALOG", channels),
        3: ("TRIAL", trial or {}),
    }
    records = b""
    for group, (name, parameters) in groups.items():
        records += struct.pack("bb", len(name), -group) + name.encode() + integers(3, processor) + b"\0"
        for key, value in parameters.items():
            if value is not None:
                records += parameter(key, group, value, processor)
    blocks = -(-(4 + len(records) + 2) // 512)
    section = (b"\1\x50" + bytes([blocks, processor]) + records).ljust(blocks * 512, b"\0")
    words = b"\2\x50" + integers([points, analog[0] * analog[1], first, min(last, 65535), 10], processor)
    words += reals(scale, processor) + integers([2 + blocks, analog[1]], processor) + reals(rate, processor)
    head = bytearray(words.ljust(512, b"\0"))
    for at, patch in (header or {}).items():
        head[at : at + len(patch)] = patch
    samples = np.concatenate([positions / (1 if scale < 0 else scale), residuals[..., None]], axis=-1)
    rows = np.full((frames, 4 * points + analog[0] * analog[1]), 7.0)
    rows[:, : 4 * points] = np.nan_to_num(samples).reshape(frames, -1)
    data = reals(rows, processor) if scale < 0 else integers(np.round(rows), processor)
    return bytes(head) + section + data.ljust(-(-len(data) // 512) * 512, b"\0")


def steps(frames: int = 12, points: int = 4) -> np.ndarray:
    """Positions to work out in the head: 1 + 100 per point + 1000 per axis + a quarter per frame."""
    t, p, k = np.ogrid[:frames, :points, :3]
    return 100.0 * p + 0.25 * t + 1000.0 * k + 1


LABELS = ["head", "sternum", "left hip", "right hip"]


def read(tmp_path: Path, data: bytes, **options: str) -> MotionCapture:
    path = tmp_path / "made.c3d"
    path.write_bytes(data)
    return c3d.read(path, **options)


# --- the contract ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("analog", [(0, 0), (3, 10)], ids=["points", "analog"])
@pytest.mark.parametrize("scale", [-0.25, 0.25], ids=["reals", "integers"])
@pytest.mark.parametrize("processor", [INTEL, DEC, MIPS], ids=["intel", "dec", "mips"])
def test_every_encoding_gives_the_same_recording(
    tmp_path: Path, processor: int, scale: float, analog: tuple[int, int]
) -> None:
    expected = steps()
    residuals = np.zeros((12, 4))
    residuals[5, 2] = -1
    motion = read(
        tmp_path,
        make(
            expected, LABELS, residuals=residuals, processor=processor, scale=scale, analog=analog, rate=120.0
        ),
    )
    expected[5, 2] = np.nan
    np.testing.assert_array_equal(motion.positions_mm, expected)
    np.testing.assert_array_equal(motion.valid, residuals >= 0)
    assert motion.positions_mm.dtype == np.float64
    assert motion.names == tuple(LABELS)
    assert (motion.frame_rate_hz, motion.units, motion.notes) == (120.0, "mm", ())


def test_vax_reals_by_the_published_examples() -> None:
    # 1.0 is 80 40 00 00 and -1.0 is 80 C0 00 00 in memory; exponent 0 is zero, and with the sign set a trap.
    raw = bytes.fromhex("80400000 80c00000 00000000 00800000")
    np.testing.assert_array_equal(c3d_header.floats(raw, DEC), [1.0, -1.0, 0.0, np.nan])


@pytest.mark.parametrize("unit", MILLIMETRES)
def test_every_unit_becomes_millimetres(tmp_path: Path, unit: str) -> None:
    motion = read(tmp_path, make(steps(), LABELS, units=unit.upper()))
    np.testing.assert_allclose(motion.positions_mm, steps() * MILLIMETRES[unit], rtol=1e-15)
    assert motion.units == unit


def test_a_unit_that_is_not_known_is_asked_for_and_one_that_is_absent_is_assumed(tmp_path: Path) -> None:
    data = make(steps(), LABELS, point={"UNITS": "furlong"})
    with rejects("unknown_unit", "POINT:UNITS", unit="furlong"):
        read(tmp_path, data)
    np.testing.assert_array_equal(read(tmp_path, data, units="m").positions_mm, steps() * 1000)
    with rejects("unknown_unit", unit="ell"):
        read(tmp_path, data, units="ell")
    unstated = make(steps(), LABELS, point={"UNITS": None})
    motion = read(tmp_path, unstated)
    assert (motion.units, motion.units_assumed) == ("mm", True)
    np.testing.assert_array_equal(motion.positions_mm, steps())
    metres = read(tmp_path, unstated, units="m")
    assert (metres.units, metres.units_assumed) == ("m", False)


def test_the_unit_asked_for_wins_and_is_noted(tmp_path: Path) -> None:
    motion = read(tmp_path, make(steps(), LABELS), units="cm")
    assert motion.units == "cm"
    assert "'mm'" in motion.notes[0]


def test_more_labels_than_one_parameter_holds(tmp_path: Path) -> None:
    labels = [f"marker {k}" for k in range(600)]
    motion = read(tmp_path, make(steps(3, 600), labels))
    assert motion.names == tuple(labels)
    np.testing.assert_array_equal(motion.positions_mm, steps(3, 600))


@pytest.mark.parametrize(
    ("point", "trial"),
    [
        ({}, {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [70000 % 65536, 1]}),
        ({"LONG_FRAMES": 70000.0}, {}),
        ({"FRAMES": 70000.0}, {}),
        ({"FRAMES": 70000 % 65536, "LONG_FRAMES": 70000.0}, {}),
    ],
    ids=["trial", "long_frames", "real", "wrapped"],
)
def test_more_frames_than_the_header_counts(
    tmp_path: Path, point: dict[str, object], trial: dict[str, object]
) -> None:
    expected = np.arange(70000.0)[:, None, None] % 1000 * np.ones((1, 1, 3)) + 1
    data = make(expected, ["one"], scale=1.0, point=point, trial=trial)
    np.testing.assert_array_equal(read(tmp_path, data).positions_mm, expected)
    with pytest.raises(InvalidInput) as caught:
        read(tmp_path, data[: 68000 * 8])
    assert caught.value.code in ("truncated", "contradiction")
    assert caught.value.values["size"] == 68000 * 8
    assert caught.value.values["frames"][-1] == 70000


def test_a_full_frame_counter_alone_is_refused(tmp_path: Path) -> None:
    with rejects("full_counter", "byte 8"):
        read(tmp_path, make(np.ones((70000, 1, 3)), ["one"], scale=1.0))


def test_the_first_frame_is_noted(tmp_path: Path) -> None:
    motion = read(tmp_path, make(steps(), LABELS, first=125))
    assert motion.positions_mm.shape[0] == 12
    assert motion.notes == ("The first frame is number 125 of its trial.",)


def test_labels_missing_doubled_padded_and_foreign(tmp_path: Path) -> None:
    motion = read(tmp_path, make(steps(), ["hüfte   ", "hüfte", ""]))
    assert motion.names == ("hüfte", "hüfte_2", "point_3", "point_4")
    assert "2 points have no label" in motion.notes[0]
    assert motion.notes[1] == "Repeated names are numbered: hüfte_2."
    assert read(tmp_path, make(steps(), LABELS, point={"LABELS": None})).names[0] == "point_1"
    assert "dropped" in read(tmp_path, make(steps(), [*LABELS, "spare"])).notes[0]


def test_samples_that_are_no_positions_are_not_valid(tmp_path: Path) -> None:
    wild = steps()
    data = bytearray(make(wild, LABELS))
    at = len(data) - 1024 + 4 * 4 * 4  # 12 frames of 64 bytes fill 768 of the last 1024
    data[at : at + 12] = struct.pack("<3f", np.nan, np.inf, 1e30)
    motion = read(tmp_path, bytes(data))
    assert (~motion.valid).sum() == 1
    assert np.isnan(motion.positions_mm[~motion.valid]).all()
    assert "1 samples declared as measured" in motion.notes[0]


def test_measured_at_the_origin_is_a_gap(tmp_path: Path) -> None:
    positions = steps() + 500.0
    positions[3, 1] = 0
    motion = read(tmp_path, make(positions, LABELS))
    assert np.argwhere(~motion.valid).tolist() == [[3, 1]]
    assert "1 samples lie exactly at the origin" in motion.notes[0]


# --- a file that contradicts itself ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "header",
    [{2: b"\x05\0"}, {8: b"\x20\0"}, {4: b"\x64\0"}, {16: b"\x02\0"}],
    ids=["points", "frames", "analog", "start"],
)
def test_the_size_settles_a_contradiction(tmp_path: Path, header: dict[int, bytes]) -> None:
    # 50 frames of 4 points: far enough from the wrong layout's size to tell them apart.
    expected = steps(50)
    motion = read(tmp_path, make(expected, LABELS, header=header, point={"DATA_START": 3}))
    np.testing.assert_array_equal(motion.positions_mm, expected)
    assert len(motion.notes) == (0 if 16 in header else 1)


def test_a_contradiction_that_the_size_does_not_settle_is_refused(tmp_path: Path) -> None:
    # 12 and 13 frames of 64 bytes both end in the second block.
    with rejects("contradiction", frames=[12, 13]):
        read(tmp_path, make(steps(), LABELS, point={"FRAMES": 13}))


def test_a_stale_count_below_the_limit_is_noted(tmp_path: Path) -> None:
    trial: dict[str, object] = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [300, 0]}
    motion = read(tmp_path, make(steps(), LABELS, trial=trial))
    assert motion.positions_mm.shape[0] == 12
    assert "300 frames" in motion.notes[0]


def test_bytes_after_the_data_are_noted(tmp_path: Path) -> None:
    motion = read(tmp_path, make(steps(), LABELS) + bytes(1024))
    np.testing.assert_array_equal(motion.positions_mm, steps())
    assert "bytes after the last frame" in motion.notes[0]


def test_rates_that_disagree(tmp_path: Path) -> None:
    slightly = read(tmp_path, make(steps(), LABELS, point={"RATE": 100.5}))
    assert slightly.frame_rate_hz == 100.5
    assert "frame rate" in slightly.notes[0]
    assert read(tmp_path, make(steps(), LABELS, point={"RATE": None})).frame_rate_hz == 100.0
    assert read(tmp_path, make(steps(), LABELS, header={20: bytes(4)})).frame_rate_hz == 100.0
    with rejects("unusable_rate", "POINT:RATE and byte 20", rates=[120.0, 100.0]):
        read(tmp_path, make(steps(), LABELS, point={"RATE": 120.0}))
    with rejects("unusable_rate", "POINT:RATE and byte 20", rates=[0.0, 0.0]):
        read(tmp_path, make(steps(), LABELS, rate=0.0))


def test_a_rate_of_zero_follows_from_the_analog_samples_or_the_option(tmp_path: Path) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(make(steps(), LABELS, point={"RATE": 0.0}, header={20: bytes(4)}, analog=(2, 5)))
    recording = c3d.read(path, frame_rate_hz=60.0)
    assert recording.frame_rate_hz == 100.0
    assert any("the analog samples give" in note for note in recording.notes)
    path.write_bytes(make(steps(), LABELS, rate=0.0))
    assert c3d.read(path, frame_rate_hz=60.0).frame_rate_hz == 60.0
    path.write_bytes(make(steps(), LABELS))
    assert c3d.read(path, frame_rate_hz=60.0).frame_rate_hz == 100.0


@pytest.mark.parametrize("processor", ORDER)
def test_analog_channels_alone_are_no_points(processor: int, tmp_path: Path) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(make(np.empty((12, 0, 3)), [], processor=processor, analog=(8, 5)))
    with rejects("analog_alone", "a.c3d", channels=8):
        c3d.read(path)


@pytest.mark.parametrize("scale", [0.0, 1.0, float("nan")])
def test_a_scale_that_contradicts_the_header_is_refused(tmp_path: Path, scale: float) -> None:
    with rejects("unusable_scale", "byte 12 and POINT:SCALE"):
        read(tmp_path, make(steps(), LABELS, header={12: struct.pack("<f", scale)}))


# --- damage ------------------------------------------------------------------------------------------------


def test_a_file_cut_anywhere_is_refused_with_the_bytes(tmp_path: Path) -> None:
    data = make(steps(), LABELS, analog=(2, 3))
    needed = len(data) - 1536 + 12 * 4 * (16 + 6)  # the frames fill 1056 of the last three blocks
    for size in range(0, len(data), 7):
        if size < needed:
            with rejects("truncated" if size else "empty_file"):
                read(tmp_path, data[:size])
        else:  # only padding is gone
            np.testing.assert_array_equal(read(tmp_path, data[:size]).positions_mm, steps())
    with rejects("truncated", needed=[needed], size=needed - 1):
        read(tmp_path, data[: needed - 1])


@pytest.mark.parametrize(
    ("patch", "code", "where", "values"),
    [
        ({0: b"\0"}, "wrong_format", "byte 0", {}),
        ({1: b"\x51"}, "wrong_format", "byte 0", {}),
        ({0: b"\xff"}, "truncated", "", {"part": "parameters"}),
        ({514: b"\xff"}, "section_overrun", "byte 514", {}),
        ({515: b"\x01"}, "unknown_processor", "byte 515", {}),
        ({523: b"\xff\x7f"}, "record_overrun", "byte 523", {}),
        ({16: b"\0\0"}, "not_declared", "", {"name": "start of the data"}),
        ({16: b"\xff\xff"}, "misplaced_data", "byte 16", {}),
        ({6: b"\x0d\0", 8: b"\x01\0"}, "not_declared", "", {"name": "frames"}),
        ({2: b"\0\0"}, "no_points", "", {}),
    ],
)
def test_damage_is_named_by_its_place(
    tmp_path: Path, patch: dict[int, bytes], code: str, where: str, values: dict[str, object]
) -> None:
    data = bytearray(make(steps(), LABELS, point={"USED": None, "FRAMES": None}))
    for at, content in patch.items():
        data[at : at + len(content)] = content
    with rejects(code, where, **values):
        read(tmp_path, bytes(data))


def test_a_parameter_that_runs_past_its_section_is_refused(tmp_path: Path) -> None:
    data = bytearray(make(steps(), LABELS))
    at = data.index(b"LABELS") + len("LABELS") + 4  # after the step, the type and the number of dimensions
    data[at : at + 2] = b"\xff\xff"
    with rejects("parameter_overrun", parameter="POINT:LABELS", needed=65025):
        read(tmp_path, bytes(data))


# --- outside judges ----------------------------------------------------------------------------------------


def fixture_bytes() -> dict[str, bytes]:
    """The files of ``tests/fixtures/c3d_*.c3d``; the mutations start from them."""
    t, p = np.ogrid[:60, :15]
    swing = np.stack(np.broadcast_arrays(30 * np.sin(t / 9 + p), 12.0 * t, 100.0 * p + 5 * np.cos(t / 5)), -1)
    labels = [f"walker:joint{k:02d}" for k in range(15)]
    residuals = np.where((t + p) % 17 == 0, -1.0, 0.0)
    return {
        "c3d_intel_reals.c3d": make(swing, labels, residuals=residuals, first=20, rate=120.0),
        "c3d_intel_integers.c3d": make(swing, labels, residuals=residuals, scale=0.1, analog=(4, 5)),
        "c3d_dec_reals.c3d": make(swing, labels, residuals=residuals, processor=DEC, scale=-0.1),
        "c3d_mips_integers.c3d": make(
            swing, labels, residuals=residuals, processor=MIPS, scale=0.1, units="m"
        ),
    }


@pytest.mark.parametrize("name", fixture_bytes())
def test_the_fixtures_are_what_this_file_makes(name: str) -> None:
    assert (FIXTURES / name).read_bytes() == fixture_bytes()[name]


def ezc3d_points(path: Path) -> tuple[np.ndarray, list[str], float]:
    ezc3d = pytest.importorskip("ezc3d")
    content = ezc3d.c3d(str(path))
    point = content["parameters"]["POINT"]
    labels = [
        label
        for key in sorted((k for k in point if k.startswith("LABELS")), key=lambda k: int(k[6:] or 1))
        for label in point[key]["value"]
    ]
    return content["data"]["points"][:3].transpose(2, 1, 0), labels, float(point["RATE"]["value"][0])


def assert_agrees_with_ezc3d(path: Path) -> None:
    positions, labels, rate = ezc3d_points(path)
    motion = c3d.read(path)
    np.testing.assert_allclose(
        motion.positions_mm / MILLIMETRES[motion.units], positions, rtol=1e-6, atol=1e-30, equal_nan=True
    )
    assert list(motion.names) == labels
    assert motion.frame_rate_hz == rate


@pytest.mark.parametrize("name", [name for name in fixture_bytes() if "mips" not in name])  # it reads no MIPS
def test_ezc3d_reads_the_fixtures_alike(name: str) -> None:
    assert_agrees_with_ezc3d(FIXTURES / name)


@pytest.mark.parametrize(("points", "channels"), [(3, 0), (300, 0), (5, 4)])
def test_files_that_ezc3d_writes(tmp_path: Path, points: int, channels: int) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    content["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    content["parameters"]["POINT"]["LABELS"]["value"] = [f"m{k}" for k in range(points)]
    samples = np.ones((4, points, 20))
    samples[:3] = np.random.default_rng(points).normal(scale=1000, size=(3, points, 20))
    samples[:3, 1, 4] = np.nan
    content["data"]["points"] = samples
    if channels:
        content["parameters"]["ANALOG"]["RATE"]["value"] = [1000.0]
        content["parameters"]["ANALOG"]["LABELS"]["value"] = [f"a{k}" for k in range(channels)]
        content["data"]["analogs"] = np.ones((1, channels, 200))
    path = tmp_path / "written.c3d"
    content.write(str(path))
    assert_agrees_with_ezc3d(path)
    assert (~c3d.read(path).valid).sum() == 1


@pytest.mark.parametrize("frames", [65_535, 70_000])
def test_ezc3d_reads_all_frames_of_a_long_recording(tmp_path: Path, frames: int) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    positions = np.arange(3.0 * frames).reshape(frames, 1, 3)
    write_c3d(path := tmp_path / "long.c3d", ["a"], positions, 100.0)
    np.testing.assert_array_equal(ezc3d_points(path)[0], positions)
    np.testing.assert_array_equal(c3d.read(path).positions_mm, positions)
    last = ezc3d.c3d(str(path))["parameters"]["TRIAL"]["ACTUAL_END_FIELD"]["value"]
    assert (last.astype(np.uint16) @ [1, 1 << 16]) == frames
    # The 16 bits of the header hold their largest number: readers take it as a count that does not fit.
    assert struct.unpack_from("<HH", path.read_bytes(), 6) == (1, 65_535)


@pytest.mark.skipif(not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR")
def test_real_recordings_agree_with_ezc3d_to_the_bit() -> None:
    mirror = Path(os.environ["MOCAP_MIRROR"])
    paths = sorted([*mirror.glob("biomechzoo/*.c3d"), *mirror.glob("cmu/c3d/*.c3d")])
    assert len(paths) >= 19
    for path in paths:
        positions, labels, rate = ezc3d_points(path)
        motion = c3d.read(path)
        np.testing.assert_array_equal(motion.positions_mm.astype(np.float32), positions.astype(np.float32))
        assert list(motion.names) == labels
        assert motion.frame_rate_hz == rate
