"""Tests with damaged copies of files for every reader: each is read or rejected within limits of time and memory."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest

from pipeline import formats
from pipeline.formats.budget import MIN_BYTES, PER_BYTE
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import InvalidInput
from tests.formats.contract import FIXTURES, check_contract
from tests.formats.samples import SAMPLES, Sample
from tests.rejects import PYTHON

COPIES = 5000 // len(SAMPLES) + 1
C3D = sorted(FIXTURES.glob("*.c3d"))


def test_every_reader_of_motion_has_a_sample() -> None:
    assert {Path(sample.opened).suffix for sample in SAMPLES if sample.read is formats.read} == set(
        formats.READERS
    )


def _read(sample: Sample, path: Path) -> tuple[object, list[str]]:
    try:
        return sample.read(path), []
    except InvalidInput as refusal:
        return None, [str(refusal)]


@pytest.mark.parametrize("sample", SAMPLES, ids=[sample.name for sample in SAMPLES])
def test_damaged_copies_are_read_or_refused(sample: Sample, tmp_path: Path) -> None:
    sample.read(sample.copy(tmp_path, -1)[0])  # whole, and what is loaded once is not counted
    refusals: list[str] = []
    tracemalloc.start()
    try:
        for seed in range(COPIES):
            path, size = sample.copy(tmp_path, seed)
            for _ in range(2):  # what is loaded once, by whichever branch, is not counted
                tracemalloc.reset_peak()
                before, _ = tracemalloc.get_traced_memory()
                content, refusal = _read(sample, path)
                _, peak = tracemalloc.get_traced_memory()
                if within := peak - before < max(PER_BYTE * size, MIN_BYTES):
                    break
            assert within, seed
            refusals += refusal
            if isinstance(content, MotionCapture):
                check_contract(content)
    finally:
        tracemalloc.stop()
    names = {Path(name).name for name in (*sample.files, sample.opened)}
    assert all(any(name in sentence for name in names) for sentence in refusals)
    assert not any("\n" in sentence for sentence in refusals)
    assert not [sentence for sentence in refusals if PYTHON.search(sentence)]
    assert 0.1 < len(refusals) / COPIES < 0.99  # the damage is neither harmless nor always fatal


@pytest.mark.parametrize("path", C3D, ids=[path.name for path in C3D])
def test_a_c3d_file_that_was_cut_is_never_a_shorter_recording(path: Path, tmp_path: Path) -> None:
    data, copy = path.read_bytes(), tmp_path / path.name
    frames = len(formats.read(path).valid)
    for size in range(0, len(data), 97):
        copy.write_bytes(data[:size])
        try:
            assert len(formats.read(copy).valid) == frames, size
        except InvalidInput:
            continue
