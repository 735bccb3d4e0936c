"""Figures side by side, begun in order: each in a process of its own, which takes its memory with it when it ends.

A process that dies costs its figure, not the others.  However the program ends, the processes end with it.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from pipeline import plugins
from pipeline.cli.progress import Display
from pipeline.cli.summary import Failure, Made
from pipeline.processes import CAN_FORK, cores_not_returned, die_with_parent, share_cores
from pipeline.stages.figure import figure_code
from pipeline.storage.sealed_folders import remove_stale
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment

Jobs = Sequence[tuple[Experiment, Path]]
"""Each figure's experiment and folder."""

Make = Callable[[Experiment, Path, Callable[[str], None]], Made]

TIMES, EACH_S = 10, 0.5
"""How often a worker is told to end, and what it has each time to tidy up, before it is killed."""

_OF_MOST_FIGURES = ("numba", "pipeline.pictures.picture")
"""What takes long to import: imported once for all but the first figures.  Not rerun, which begins threads."""

# No thread runs when workers begin, and what the program has imported and composed is not loaded again.
_CONTEXT: Any = multiprocessing.get_context("fork" if CAN_FORK else "spawn")


@dataclass(frozen=True)
class _Worker:
    """A process, our end of its pipe, and the number of the figure it is making."""

    process: BaseProcess
    pipe: Connection
    figure: int


def make_side_by_side(jobs: Jobs, make: Make, display: Display, *, processes: int, cores: int) -> list[Made]:
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
    found: dict[int, Made] = {}
    spare = _CONTEXT.Semaphore(cores - processes)
    queue = deque(range(len(jobs)))
    workers: dict[int, _Worker] = {}

    def begin(slot: int, not_returned: int = 0) -> None:
        """Begin the next figure in a slot, or give its core to the others."""
        if queue:
            figure = queue.popleft()
            ours, its = _CONTEXT.Pipe()
            given = (its, *jobs[figure], make, spare, not_returned, os.getpid())
            process = _CONTEXT.Process(target=_work, args=given)
            process.start()
            its.close()
            workers[slot] = _Worker(process, ours, figure)
            display.began(slot, figure)
        elif not not_returned:
            spare.release()

    gc.freeze()  # or a collection in a worker writes to what it shares with this process, which is then copied
    gc.set_threshold(50_000)  # little of what figures make is garbage, and looking for it takes long
    with _told_to_end() as told_to_end:
        try:
            for slot in range(processes):
                begin(slot)
            for module in _OF_MOST_FIGURES if queue else ():
                plugins.resolve(module)
            for figure in queue:
                figure_code(jobs[figure][0])  # the sources are parsed once for all of them
            while workers:
                ready = wait([told_to_end, *(worker.pipe for worker in workers.values())])
                if told_to_end in ready:
                    raise KeyboardInterrupt
                for slot, worker in list(workers.items()):
                    if worker.pipe not in ready:
                        continue
                    not_returned = 0
                    try:
                        message = worker.pipe.recv()
                        if isinstance(message, str):
                            display.at(slot, message)
                            continue
                        message, not_returned = message
                    except (EOFError, OSError):
                        message = _dead(worker, jobs[worker.figure][0].name)
                    worker.pipe.close()
                    worker.process.kill()  # which has nothing left to do, but may be long about it
                    worker.process.join()
                    del workers[slot]
                    found[worker.figure] = message
                    display.ended(slot, worker.figure, message)
                    begin(slot, not_returned)
        except BaseException:
            _end(workers.values(), jobs)
            raise
    return [found[number] for number in range(len(jobs))]


@contextmanager
def _told_to_end() -> Iterator[Connection]:
    """Let signals be read from a connection: raised anywhere, they could leave a worker that is not in the list."""
    receiver, signals = _CONTEXT.Pipe(duplex=False)
    before = {}
    in_main_thread = threading.current_thread() is threading.main_thread()  # elsewhere there are none
    try:
        for number in (signal.SIGINT, signal.SIGTERM) if in_main_thread else ():
            before[number] = signal.signal(number, lambda *_: signals.send(None))
        yield receiver
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if receiver.poll():  # when all was done
        raise KeyboardInterrupt


def _work(
    pipe: Connection,
    experiment: Experiment,
    folder: Path,
    make: Make,
    spare: Any,
    not_returned: int,
    parent: int,
) -> None:
    """Make a figure; send each stage that begins, and what became of it with the cores that it still owes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which then ends its workers
    signal.signal(signal.SIGTERM, _interrupt)
    sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__  # not the display's
    die_with_parent(parent)
    share_cores(spare, not_returned)
    with suppress(KeyboardInterrupt):  # who tells a whole group to end tells us twice
        with suppress(KeyboardInterrupt, BrokenPipeError):  # the parent has ended, or ends us
            pipe.send((make(experiment, folder, pipe.send), cores_not_returned()))
        signal.signal(signal.SIGTERM, signal.SIG_IGN)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _dead(worker: _Worker, name: str) -> Failure:
    """Return what is said of the figure of a worker that has died."""
    worker.process.join()
    code = worker.process.exitcode or 0
    how = f"by signal {-code}" if code < 0 else f"with status {code}"
    return Failure(
        name, f"the process that made it ended {how}; finished stages are kept: the same command continues"
    )


def _end(workers: Any, jobs: Jobs) -> None:
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
