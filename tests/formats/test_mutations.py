"""Damaged copies of files of every format: each is read or refused, and nothing else happens."""

from __future__ import annotations

import contextlib
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.validation import InvalidInput
from tests.formats.contract import FIXTURES, check_contract

ASF, AMC = FIXTURES / "asf_by_hand.asf", FIXTURES / "amc_by_hand.amc"
FILES = sorted(p for p in FIXTURES.iterdir() if p.suffix in (*formats.READERS, ".asf"))
COPIES = 500
FRAMES = 60
"""Frames in every C3D file."""


def damaged_c3d(original: bytes, seed: int) -> tuple[str, bytes]:
    """What was done, and the damaged copy: mostly where the counts and the parameters are."""
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


def damaged_text(original: bytes, seed: int) -> tuple[str, bytes]:
    """A damaged copy: bytes changed, cut out, put in, pieces repeated or the end lost."""
    rng = np.random.default_rng(seed)
    copy = bytearray(original)
    for _ in range(rng.integers(1, 3)):
        at = int(rng.integers(len(copy) + 1))
        match rng.integers(8):
            case 0 if at < len(copy):
                copy[at] = rng.integers(256)
            case 1:
                del copy[at : at + int(rng.integers(1, 40))]
            case 2:
                copy[at:at] = rng.bytes(int(rng.integers(1, 8)))
            case 3:
                copy[at:at] = copy[at : at + int(rng.integers(1, 40))]
            case 4 | 5 | 6 if at < len(copy):
                copy[at] = rng.choice(np.frombuffer(b'\t \n\r,;."-e0_9Xn\xff', dtype=np.uint8))
            case _:
                del copy[max(at, len(copy) // 2) :]
    return "text", bytes(copy)


def damaged(path: Path, seed: int) -> tuple[str, bytes]:
    return (damaged_c3d if path.suffix == ".c3d" else damaged_text)(path.read_bytes(), seed)


def place_copy(path: Path, folder: Path) -> tuple[Path, Path]:
    """Where a damaged copy of a file goes, and the file to read then: a skeleton is read with its motion."""
    for whole in (ASF, AMC):
        (folder / whole.name).write_bytes(whole.read_bytes())
    return folder / path.name, folder / (AMC.name if path == ASF else path.name)


@pytest.mark.parametrize("path", FILES, ids=[path.name for path in FILES])
def test_damaged_copies_are_read_or_refused(path: Path, tmp_path: Path) -> None:
    copy, read = place_copy(path, tmp_path)
    refusals = []
    for seed in range(COPIES):
        kind, data = damaged(path, seed)
        copy.write_bytes(data)
        try:
            motion = formats.read(read)
        except InvalidInput as refusal:
            refusals.append(str(refusal))
            continue
        check_contract(motion)
        if kind == "cut":  # a C3D file is never read as a shorter recording
            assert len(motion.valid) == FRAMES, seed
    assert all(copy.name in sentence or read.name in sentence for sentence in refusals)
    assert not any("\n" in sentence for sentence in refusals)
    assert 0.1 < len(refusals) / COPIES < 0.97  # the damage is neither harmless nor always fatal


@pytest.mark.parametrize("path", FILES, ids=[path.name for path in FILES])
def test_memory_stays_in_proportion_to_the_file(path: Path, tmp_path: Path) -> None:
    copy, read = place_copy(path, tmp_path)
    tracemalloc.start()
    try:
        for seed in range(0, COPIES, 7):
            _, data = damaged(path, seed)
            copy.write_bytes(data)
            tracemalloc.reset_peak()
            before, _ = tracemalloc.get_traced_memory()
            with contextlib.suppress(InvalidInput):
                formats.read(read)
            _, peak = tracemalloc.get_traced_memory()
            assert peak - before < 64 * len(data) + 2**18, seed
    finally:
        tracemalloc.stop()
