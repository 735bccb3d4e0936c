"""Figures side by side: each worker process makes one after the other, in order, until there are none left.

A worker that dies costs its figure, not the others; another takes its place.  However the program ends, the workers
end with it.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from pipeline.cli.progress import Display
from pipeline.cli.summary import Failure, Outcome
from pipeline.processes import CAN_FORK, die_with_parent, share_cores
from pipeline.storage.sealed_folders import remove_stale
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment

Make = Callable[[Experiment, Path, Callable[[str], None]], Outcome | Failure]

TIMES, EACH_S = 10, 0.5
"""How often a worker is told to end, and what it has each time to tidy up, before it is killed."""

# No thread runs when workers begin, and what the program has imported and composed is not loaded again.
_CONTEXT: Any = multiprocessing.get_context("fork" if CAN_FORK else "spawn")


@dataclass(frozen=True)
class _Worker:
    """A process, our end of its pipe, and the number of the figure it is making."""

    process: BaseProcess
    pipe: Connection
    figure: int


def make_side_by_side(
    jobs: Sequence[tuple[Experiment, Path]], make: Make, display: Display, *, processes: int, cores: int
) -> list[Outcome | Failure]:
    """Make figures, begun in the order of the jobs, and return what became of each.

    Parameters
    ----------
    jobs : sequence of (Experiment, Path)
    make : callable
        Makes one, given its experiment, its folder and what is to be called with each stage that begins.
    display : Display
        Is told what runs where.
    processes : int
        Figures at a time.
    cores : int
        What is beyond the processes, and what they no longer need, helps those that still run.
    """
    found: dict[int, Outcome | Failure] = {}
    spare = _CONTEXT.Semaphore(cores - processes)
    queue = deque(range(len(jobs)))
    workers: dict[int, _Worker] = {}

    def begin(slot: int, worker: _Worker | None) -> None:
        """Give a slot, and its worker if it has one, the next figure, or its core to the others."""
        if not queue:
            if worker:
                worker.pipe.send(None)
                worker.pipe.close()
                worker.process.join()
            spare.release()
            return
        figure = queue.popleft()
        process, pipe = (worker.process, worker.pipe) if worker else _started(make, spare)
        workers[slot] = _Worker(process, pipe, figure)
        display.began(slot, figure)
        with suppress(OSError):  # it has just died, which is read from its pipe
            pipe.send(jobs[figure])

    gc.freeze()  # or a collection in a worker writes to what it shares with this process, which is then copied
    try:
        for slot in range(processes):
            begin(slot, None)
        while workers:
            ready = wait([worker.pipe for worker in workers.values()])
            for slot, worker in list(workers.items()):
                if worker.pipe not in ready:
                    continue
                try:
                    told = worker.pipe.recv()
                except (EOFError, OSError):
                    del workers[slot]
                    told = found[worker.figure] = _dead(worker, jobs[worker.figure][0].name)
                    display.ended(slot, worker.figure, told)
                    begin(slot, None)
                    continue
                if isinstance(told, str):
                    display.at(slot, told)
                    continue
                found[worker.figure] = told
                display.ended(slot, worker.figure, told)
                del workers[slot]
                begin(slot, worker)
    except BaseException:
        _end(workers.values(), jobs)
        raise
    return [found[number] for number in range(len(jobs))]


@contextmanager
def _signals_held() -> Iterator[None]:
    """Hold signals back until a new process has set what it does about them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _started(make: Make, spare: Any) -> tuple[BaseProcess, Connection]:
    ours, its = _CONTEXT.Pipe()
    process = _CONTEXT.Process(target=_work, args=(its, make, spare, os.getpid()))
    with _signals_held():
        process.start()
    its.close()
    return process, ours


def _work(pipe: Connection, make: Make, spare: Any, parent: int) -> None:
    """Make the figures that come through the pipe; send each stage that begins, and what became of the figure."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which then ends its workers
    signal.signal(signal.SIGTERM, _interrupt)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGTERM})
    sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__  # not the display's
    die_with_parent(parent)
    share_cores(spare)
    with suppress(KeyboardInterrupt, EOFError, BrokenPipeError):  # the parent has ended, or ends us
        while job := pipe.recv():
            experiment, folder = job
            pipe.send(make(experiment, folder, pipe.send))
    signal.signal(signal.SIGTERM, signal.SIG_IGN)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _dead(worker: _Worker, name: str) -> Failure:
    """Return what is said of the figure of a worker that has died."""
    worker.pipe.close()
    worker.process.join()
    code = worker.process.exitcode or 0
    how = f"by signal {-code}" if code < 0 else f"with status {code}"
    return Failure(
        name, f"the process that made it ended {how}; finished stages are kept: the same command continues"
    )


def _end(workers: Any, jobs: Sequence[tuple[Experiment, Path]]) -> None:
    """End workers, who tidy up; those that take long are killed, and what they leave is removed.

    They are told again and again: an interrupt that comes within a callback of a library is lost.
    """
    processes: list[Any] = [worker.process for worker in workers]
    try:
        for _ in range(TIMES):
            running = [process for process in processes if process.is_alive()]
            for process in running:
                process.terminate()
            ends = time.monotonic() + EACH_S
            for process in running:
                process.join(max(ends - time.monotonic(), 0.0))
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.join()
    for folder in {folder.parent for _, folder in jobs}:
        remove_stale(folder)
    for results in {experiment.results for experiment, _ in jobs}:
        Store(Path(results))  # which tidies its cache
