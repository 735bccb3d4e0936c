"""Parallel computation of figures: each figure has a separate process, which frees its memory at the end.

If a process dies, only its figure fails.  The processes end together with the program.
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
"""Figures to make: the experiment and the output folder of each figure."""

Make = Callable[[Experiment, Path, Callable[[str], None]], Made]

MAX_SIGNALS, SIGNAL_INTERVAL_S = 10, 0.5
"""Number of termination signals sent to a worker before it is killed, and the time between signals, s."""

_SHARED_MODULES = ("numba", "pipeline.pictures.picture")
"""Modules that are slow to import; the main process imports them once for all later workers.

The module rerun is excluded because it starts threads.
"""

# Workers fork while no thread runs, and reuse the modules and experiments that the program has loaded.
_CONTEXT: Any = multiprocessing.get_context("fork" if CAN_FORK else "spawn")


@dataclass(frozen=True)
class _Worker:
    """Worker process, the main process's end of the pipe to the worker, and the index of the figure that it makes."""

    process: BaseProcess
    pipe: Connection
    figure: int


def make_side_by_side(jobs: Jobs, make: Make, display: Display, *, processes: int, cores: int) -> list[Made]:
    """Make figures in parallel, in the order of the jobs, and return the outcome or failure of each figure.

    Parameters
    ----------
    jobs : sequence of (Experiment, Path)
    make : callable
        Function that makes a figure from its experiment, its folder, and a callback for the start of each stage.
    display : Display
        Display of the running figures and their stages.
    processes : int
        Number of figures at a time.
    cores : int
        Number of cores.  Cores without a process, or released by one, help the figures that still run.
    """
    results: dict[int, Made] = {}
    spare = _CONTEXT.Semaphore(cores - processes)
    queue = deque(range(len(jobs)))
    workers: dict[int, _Worker] = {}

    def begin(slot: int, not_returned: int = 0) -> None:
        """Start the next figure in a process slot; if no figure remains, release the slot's core for other figures."""
        if queue:
            figure = queue.popleft()
            ours, its = _CONTEXT.Pipe()
            arguments = (its, *jobs[figure], make, spare, not_returned, os.getpid())
            process = _CONTEXT.Process(target=_work, args=arguments)
            process.start()
            its.close()
            workers[slot] = _Worker(process, ours, figure)
            display.began(slot, figure)
        elif not not_returned:
            spare.release()

    gc.freeze()  # otherwise a collection in a worker would write to shared memory pages and so copy them
    gc.set_threshold(50_000)  # figures create little garbage, and collections take long
    with _signal_connection() as end_signal:
        try:
            for slot in range(processes):
                begin(slot)
            for module in _SHARED_MODULES if queue else ():
                plugins.resolve(module)
            for figure in queue:
                figure_code(jobs[figure][0])  # parse the sources once for all workers
            while workers:
                ready = wait([end_signal, *(worker.pipe for worker in workers.values())])
                if end_signal in ready:
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
                        message = _failure_of_dead(worker, jobs[worker.figure][0].name)
                    worker.pipe.close()
                    worker.process.kill()  # its work is done, but exiting normally may take long
                    worker.process.join()
                    del workers[slot]
                    results[worker.figure] = message
                    display.ended(slot, worker.figure, message)
                    begin(slot, not_returned)
        except BaseException:
            _end(workers.values(), jobs)
            raise
    return [results[number] for number in range(len(jobs))]


@contextmanager
def _signal_connection() -> Iterator[Connection]:
    """Yield a pipe connection that receives a message for each Ctrl-C or SIGTERM.

    An exception raised by a signal at any moment could leave a started worker out of the list of workers.
    """
    receiver, signals = _CONTEXT.Pipe(duplex=False)
    before = {}
    in_main_thread = (
        threading.current_thread() is threading.main_thread()
    )  # only this thread can handle signals
    try:
        for number in (signal.SIGINT, signal.SIGTERM) if in_main_thread else ():
            before[number] = signal.signal(number, lambda *_: signals.send(None))
        yield receiver
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if receiver.poll():  # a signal arrived after the last figure
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
    """Make a figure in a worker; send the name of each stage, then the outcome and the number of cores to give back."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C and ends its workers
    signal.signal(signal.SIGTERM, _interrupt)
    sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__  # the display had replaced them
    die_with_parent(parent)
    share_cores(spare, not_returned)
    with suppress(KeyboardInterrupt):  # SIGTERM to the process group arrives twice
        with suppress(KeyboardInterrupt, BrokenPipeError):  # the parent has ended, or ends this worker
            pipe.send((make(experiment, folder, pipe.send), cores_not_returned()))
        signal.signal(signal.SIGTERM, signal.SIG_IGN)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _failure_of_dead(worker: _Worker, name: str) -> Failure:
    """Return the failure of a figure whose worker process has died."""
    worker.process.join()
    code = worker.process.exitcode or 0
    how = f"by signal {-code}" if code < 0 else f"with status {code}"
    return Failure(
        name,
        f"the process of the figure ended {how}; finished stages are kept, and the same command continues",
    )


def _end(workers: Any, jobs: Jobs) -> None:
    """Terminate the worker processes, kill those that take too long, and remove their temporary files.

    The signal is repeated, since an interrupt within a callback of a library is lost.
    """
    processes: list[Any] = [worker.process for worker in workers]
    try:
        for _ in range(MAX_SIGNALS):
            running = [process for process in processes if process.is_alive()]
            for process in running:
                process.terminate()
            ends = time.monotonic() + SIGNAL_INTERVAL_S
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
        Store(Path(results))  # a new store removes stale files from its cache
