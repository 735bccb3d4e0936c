"""Tests on a random sample of damaged files with matching checksums, and of failing calls to the file system."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests import faults, hostile
from tests.hostile_targets import targets
from tests.rejects import PYTHON

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="forks, pipes and /proc")


def test_damaged_files_of_ours_are_read_or_rejected_and_nothing_is_written_elsewhere(tmp_path: Path) -> None:
    chosen = targets(tmp_path)
    results = hostile.fuzz(chosen, 2 * len(chosen), 26, tmp_path)
    assert {result.target for result in results} == {target.name for target in chosen}
    assert not [result for result in results if result.outcome in hostile.FAILURES]
    assert {hostile.ACCEPTED, hostile.REJECTED} == {result.outcome for result in results}
    rejected = [result.words for result in results if result.outcome == hostile.REJECTED]
    assert not [words for words in rejected if PYTHON.search(words)]


def test_after_a_fault_the_old_result_or_the_new_one_is_there_and_the_command_continues(
    tmp_path: Path,
) -> None:
    assert faults.inject(5, 26, tmp_path, []) == []
