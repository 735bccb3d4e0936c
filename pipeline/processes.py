"""Parallel work in several processes that share the cores: the only module that forks.

`map_processes` calls a function on items in this process and in helpers that are forked from it.  The function may
therefore be any closure, and arrays are not copied.  Processes take items one by one, and results are in the order of
the items: they do not depend on the number of processes.

Figures that are made in parallel share the cores.  A figure that waits lends its core (`core_lent`), and a figure that
has ended releases it (the pool of `pipeline.cli`).  A figure that maps takes the spare cores before each of its items.
The last figures of a run thus use all cores, and no core runs two processes.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from contextvars import ContextVar
from multiprocessing import Pipe
from typing import TYPE_CHECKING, Any, TypeVar

from threadpoolctl import threadpool_limits

if TYPE_CHECKING:
    from multiprocessing.synchronize import Semaphore

Item = TypeVar("Item")
Result = TypeVar("Result")

CAN_FORK = sys.platform == "linux"
"""True if helper processes can be forked; elsewhere, fork is missing or breaks linear-algebra libraries."""

_MAX_BLOCKS = 1000
"""Maximum number of blocks in the queue: with four bytes for each block, the queue fits into the smallest pipe."""
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG
_LIBRARY: Any = ctypes.CDLL(None) if CAN_FORK else None


class _Share:
    """State of this process for the sharing of cores with other processes.

    Attributes
    ----------
    spare : Semaphore or None
        Number of spare cores, shared by several processes.  None: no sharing; `map_processes` starts up to its maximum
        of helpers.
    not_returned : int
        Cores that this process lent and used again before they were returned.  It owes as many spare cores.
    helper : bool
        Whether this process is a helper, which forks no others.
    """

    spare: Semaphore | None = None
    not_returned = 0
    helper = False


Mapper = Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]
"""Type of a function that applies another function to each item and returns the results."""
_mapper: ContextVar[Mapper | None] = ContextVar("mapper", default=None)


@contextmanager
def mapped_by(mapper: Mapper) -> Iterator[None]:
    """Replace the forking of helpers in `map_processes` by `mapper`, in this thread, during the ``with`` block."""
    before = _mapper.set(mapper)
    try:
        yield
    finally:
        _mapper.reset(before)


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processes_for(workers: int) -> int:
    """Return the number of processes to start: the requested number, limited to the cores (at least two).

    More processes would only wait for each other and use memory.
    """
    return min(workers, max(usable_cores(), 2))


def share_cores(spare: Semaphore, not_returned: int = 0) -> None:
    """Set the semaphore of spare cores for this process's helpers, and the number of cores that it must give back."""
    _Share.spare, _Share.not_returned = spare, not_returned


def cores_not_returned() -> int:
    """Return the number of cores that this process must still give back to other processes."""
    return _Share.not_returned


@contextmanager
def core_lent() -> Iterator[None]:
    """Lend this process's core to other processes during the ``with`` block, in which this process waits."""
    if _Share.spare is None or _Share.helper:
        yield
        return
    _give_core()
    try:
        yield
    finally:
        # Go on without waiting: the borrower returns the core after its item, and the next spare core settles the debt.
        if not _Share.spare.acquire(False):
            _Share.not_returned += 1


def _take_core() -> bool:
    """Take a spare core if one is available; return True if a helper process may start."""
    spare = _Share.spare
    if spare is None:
        return True
    while _Share.not_returned and spare.acquire(False):
        _Share.not_returned -= 1
    return not _Share.not_returned and spare.acquire(False)


def _give_core() -> None:
    if _Share.spare is None:
        return
    if _Share.not_returned:
        _Share.not_returned -= 1
    else:
        _Share.spare.release()


def die_with_parent(parent: int) -> None:
    """Let the system kill this process when its parent ends for any reason (Linux only).

    `parent` is the process id of the parent.
    """
    if CAN_FORK:
        _LIBRARY.prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def return_memory() -> None:
    """Return unused memory of this process to the system (GNU C library only)."""
    if hasattr(_LIBRARY, "malloc_trim"):
        _LIBRARY.malloc_trim(0)


def one_thread() -> AbstractContextManager[object]:
    """Limit the linear-algebra libraries to one thread; in many small solves, more threads would only wait."""
    return threadpool_limits(limits=1)


def map_processes(function: Callable[[Item], Result], items: Iterable[Item], workers: int) -> list[Result]:
    """Return ``[function(item) for item in items]``, computed on up to `workers` processes.

    The result does not depend on the number of processes.

    Parameters
    ----------
    function : callable
        Any callable.  Its results and exceptions must be picklable; its side effects are lost.
    items : iterable
    workers : int
        Maximum number of processes, this one included; fewer if parallel figures leave no core.
    """
    tasks = list(items)
    with one_thread():
        most, mapper = min(workers, len(tasks)) - 1, _mapper.get()
        if most >= 1 and mapper:
            return mapper(function, tasks)
        if most < 1 or _Share.helper or not CAN_FORK:
            return [function(item) for item in tasks]
        size = -(-len(tasks) // _MAX_BLOCKS)
        blocks = [tasks[start : start + size] for start in range(0, len(tasks), size)]
        return [result for block in _spread(function, blocks, most) for result in block]


def _spread(
    function: Callable[[Item], Result], blocks: Sequence[Sequence[Item]], most: int
) -> list[list[Result]]:
    """Return the results of each block of items, computed by this process and at most `most` helper processes."""
    queue, filling = os.pipe()
    os.write(filling, b"".join(number.to_bytes(4, "little") for number in range(len(blocks))))
    os.close(filling)
    results_by_block: dict[int, list[Result] | Exception] = {}
    helpers: list[_Helper] = []
    try:
        for number in _block_numbers(queue):
            while number < len(blocks) - 1 and len(helpers) < most and _take_core():
                helpers.append(_Helper(function, blocks, queue))
            _attempt(function, blocks, number, queue, results_by_block)
        for helper in helpers:
            results_by_block |= helper.results()
    finally:
        for helper in helpers:
            helper.end()
        os.close(queue)
    ordered: list[list[Result]] = []
    for number, block in enumerate(blocks):
        # A result is missing if its helper was killed or could not send it: compute it here.
        results = (
            results_by_block[number] if number in results_by_block else [function(item) for item in block]
        )
        if isinstance(results, Exception):
            raise results  # the first error, as without helpers: all blocks before it were begun
        ordered.append(results)
    return ordered


def _block_numbers(queue: int) -> Iterator[int]:
    """Yield the indices of the blocks that this process takes from the queue, until the queue is empty."""
    while entry := os.read(queue, 4):
        yield int.from_bytes(entry, "little")


def _attempt(
    function: Callable, blocks: Sequence[Sequence], number: int, queue: int, results: dict[int, Any]
) -> None:
    """Add the results of a block of items, or its error, to `results`; an error empties the queue."""
    try:
        results[number] = [function(item) for item in blocks[number]]
    except Exception as error:
        results[number] = error
        for _ in _block_numbers(queue):
            pass


class _Helper:
    """Forked helper process, which takes blocks from the queue and sends all results when the queue is empty."""

    def __init__(self, function: Callable, blocks: Sequence[Sequence], queue: int) -> None:
        self._receiver, sender = Pipe(duplex=False)
        parent = os.getpid()
        with warnings.catch_warnings():
            # Threads of this process draw the display: a helper uses nothing that they may have locked.
            warnings.simplefilter("ignore", DeprecationWarning)
            self._pid = os.fork()
        if self._pid == 0:
            try:
                self._receiver.close()
                die_with_parent(parent)
                signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for this process's parent
                signal.signal(signal.SIGTERM, signal.SIG_DFL)
                _Share.helper = True
                results: dict[int, Any] = {}
                for number in _block_numbers(queue):
                    _attempt(function, blocks, number, queue, results)
                sender.send(results)
            finally:
                os._exit(0)
        sender.close()

    def results(self) -> dict[int, Any]:
        """Return the results of a helper process; empty if the process was killed or could not send them."""
        try:
            return dict(self._receiver.recv())
        except (EOFError, OSError):
            return {}

    def end(self) -> None:
        """Kill the helper process if it still runs, and release its core."""
        self._receiver.close()
        with suppress(ProcessLookupError):
            os.kill(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)
        _give_core()
