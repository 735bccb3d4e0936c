"""Two thousand damaged C3D files: each is read or refused, and nothing else happens."""

from __future__ import annotations

import contextlib
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from pipeline.formats import c3d
from pipeline.validation import InvalidInput

FIXTURES = sorted((Path(__file__).parents[1] / "fixtures").glob("c3d_*.c3d"))
COPIES = 500
FRAMES = 60
"""Frames in every fixture."""


def damaged(original: bytes, seed: int) -> tuple[str, bytes]:
    """What was done, and the damaged copy; most damage is where the counts and the parameters are."""
    rng = np.random.default_rng(seed)
    data = np.frombuffer(original, dtype=np.uint8).copy()
    reach = data.size if rng.random() < 0.3 else 1536
    kind = ("cut", "bytes", "bit", "words", "erased", "moved")[seed % 6]
    begin = int(rng.integers(0, reach - 64))
    if kind == "cut":
        data = data[: int(rng.integers(0, data.size))]
    elif kind == "bytes":
        at = rng.integers(0, reach, size=int(rng.integers(1, 9)))
        data[at] = rng.integers(0, 256, size=at.size)
    elif kind == "bit":
        data[int(rng.integers(0, reach))] ^= 1 << int(rng.integers(0, 8))
    elif kind == "words":
        extremes = np.array([0, 1, 127, 128, 255, 256, 32767, 32768, 65535], dtype="<u2")
        word = rng.choice(extremes, size=int(rng.integers(1, 4))).tobytes()
        data[begin : begin + len(word)] = np.frombuffer(word, dtype=np.uint8)
    elif kind == "erased":
        data[begin : begin + int(rng.integers(1, 64))] = rng.choice([0, 255])
    else:  # a piece is lost or stands twice
        length = int(rng.integers(1, 64))
        piece = data[begin : begin + length]
        tail = data[begin + length :] if rng.random() < 0.5 else np.concatenate([piece, piece, data[begin:]])
        data = np.concatenate([data[:begin], tail])
    return kind, data.tobytes()


@pytest.mark.parametrize("path", FIXTURES, ids=[path.stem for path in FIXTURES])
def test_damaged_copies_are_read_or_refused(path: Path, tmp_path: Path) -> None:
    original = path.read_bytes()
    copy = tmp_path / "damaged.c3d"
    outcomes = {"read": 0, "refused": 0}
    nameless = 0
    for seed in range(COPIES):
        kind, data = damaged(original, seed)
        copy.write_bytes(data)
        try:
            motion = c3d.read(copy)
        except InvalidInput as refusal:
            outcomes["refused"] += 1
            nameless += str(copy) not in str(refusal)
            continue
        outcomes["read"] += 1
        frames, points = motion.valid.shape
        assert motion.positions_mm.shape == (frames, points, 3), (seed, kind)
        assert len(motion.names) == points > 0, (seed, kind)
        assert motion.frame_rate_hz > 0, (seed, kind)
        np.testing.assert_array_equal(np.isfinite(motion.positions_mm).all(axis=-1), motion.valid)
        if kind == "cut":  # never a shorter recording in silence
            assert frames == FRAMES, seed
    assert nameless == 0  # every refusal names the file
    assert outcomes["read"] + outcomes["refused"] == COPIES
    assert min(outcomes.values()) > COPIES // 10  # the damage is neither harmless nor always fatal


def test_memory_stays_in_proportion_to_the_file(tmp_path: Path) -> None:
    copy = tmp_path / "damaged.c3d"
    tracemalloc.start()
    try:
        for path in FIXTURES:
            original = path.read_bytes()
            for seed in range(0, COPIES, 7):
                _, data = damaged(original, seed)
                copy.write_bytes(data)
                tracemalloc.reset_peak()
                before, _ = tracemalloc.get_traced_memory()
                with contextlib.suppress(InvalidInput):
                    c3d.read(copy)
                _, peak = tracemalloc.get_traced_memory()
                assert peak - before < 64 * len(data) + 2**18, (path, seed)
    finally:
        tracemalloc.stop()


def test_there_are_two_thousand_copies() -> None:
    assert len(FIXTURES) * COPIES >= 2000
