"""Tests of parallel processing: results keep their order, errors are raised, and killed workers are replaced."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
from pathlib import Path

import pytest

from pipeline import processes
from pipeline.processes import core_lent, map_processes, processes_for, usable_cores

needs_fork = pytest.mark.skipif(not processes.CAN_FORK, reason="needs forks")


@pytest.mark.parametrize("workers", [1, 2, 5])
@pytest.mark.parametrize("count", [0, 1, 20, 2500])
def test_the_order_is_kept(workers: int, count: int) -> None:
    assert map_processes(lambda n: n * n, range(count), workers) == [n * n for n in range(count)]


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_the_first_error_comes_through(workers: int) -> None:
    def fail(n: int) -> int:
        if n in (3, 5):
            raise ValueError(f"item {n}")
        return n

    with pytest.raises(ValueError, match="item 3"):
        map_processes(fail, range(12), workers)


def meeting(folder: Path, n: int) -> int:
    """Return the number of this process, after another process has taken the other of two work items."""
    (folder / str(n)).touch()
    while not (folder / str(1 - n)).exists():
        time.sleep(0.0005)
    return os.getpid()


@needs_fork
def test_a_helper_takes_its_share_and_ends(tmp_path: Path) -> None:
    ours, its = map_processes(lambda n: meeting(tmp_path, n), range(2), 2)
    assert ours == os.getpid()
    assert its != ours
    with pytest.raises(ProcessLookupError):
        os.kill(its, 0)


@needs_fork
def test_what_a_killed_helper_had_taken_is_done_again(tmp_path: Path) -> None:
    us = os.getpid()

    def one(n: int) -> int:
        if n < 2 and not (tmp_path / str(n)).exists():
            meeting(tmp_path, n)
            if os.getpid() != us:
                os.kill(os.getpid(), signal.SIGKILL)
        return n

    assert map_processes(one, range(6), 2) == list(range(6))


@needs_fork
def test_a_result_that_cannot_be_sent_is_made_here() -> None:
    output = map_processes(lambda n: lambda: n, range(4), 2)
    assert [function() for function in output] == [0, 1, 2, 3]


@needs_fork
def test_a_helper_forks_no_helpers(tmp_path: Path) -> None:
    def one(n: int) -> int:
        meeting(tmp_path, n)
        return len(set(map_processes(lambda _: os.getpid(), range(3), 2))) if n else 1

    assert map_processes(one, range(2), 2)[1] == 1


@needs_fork
def test_an_interruption_ends_the_helpers(tmp_path: Path) -> None:
    us = os.getpid()

    def one(n: int) -> None:
        meeting(tmp_path, n)
        if os.getpid() != us:
            (tmp_path / "writing").write_text(str(os.getpid()))
            (tmp_path / "writing").rename(tmp_path / "helper")
            signal.pause()
        while not (tmp_path / "helper").exists():
            time.sleep(0.0005)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        map_processes(one, range(2), 2)
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "helper").read_text()), 0)


@needs_fork
def test_helpers_take_cores_that_are_spare_and_give_them_back(monkeypatch: pytest.MonkeyPatch) -> None:
    spare = multiprocessing.get_context("fork").Semaphore(0)
    monkeypatch.setattr(processes._Share, "spare", spare)

    def pids() -> int:
        return len(set(map_processes(lambda _: os.getpid(), range(200), 4)))

    def count() -> int:
        return int(spare.get_value())

    assert pids() == 1, "no core is spare"
    with core_lent():
        assert count() == 1, "what waits lends its core"
        assert pids() <= 2
        assert count() == 1
        assert spare.acquire(False)  # another process takes it
    assert processes._Share.not_returned == 1
    spare.release()
    assert pids() == 1, "the core that comes back pays the debt"
    assert (processes._Share.not_returned, count()) == (0, 0)


def test_as_many_processes_as_cores_at_most() -> None:
    assert usable_cores() >= 1
    assert processes_for(1) == 1
    assert processes_for(2) == 2
    assert processes_for(1000) == max(usable_cores(), 2)
    if hasattr(os, "sched_setaffinity") and sys.platform == "linux":
        before = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {min(before)})
        try:
            assert usable_cores() == 1
        finally:
            os.sched_setaffinity(0, before)
