"""Work spread over processes, and the cores that they share: the only module that forks.

`map_processes` calls a function on items in this process and in helpers that are forked from it, so that the function
may be any closure and arrays are not copied.  Items are handed out one by one, and results come in the order of the
items: they do not depend on how many processes there are.

Figures that are made side by side share the cores.  One that waits lends its core, one that has ended gives it up
(`core_lent`, the pool of `pipeline.cli`), and a figure that maps takes what is spare before each of its items: so the
last figures of a run use all cores, and no core has two processes at work.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from multiprocessing import Pipe
from typing import TYPE_CHECKING, Any, TypeVar

from threadpoolctl import threadpool_limits

if TYPE_CHECKING:
    from multiprocessing.synchronize import Semaphore

Item = TypeVar("Item")
Result = TypeVar("Result")

CAN_FORK = sys.platform == "linux"
"""Elsewhere the libraries of linear algebra do not survive a fork, or there is none: items are then not shared."""

_MOST_BLOCKS = 1000
"""Entries of the queue: each has four bytes, and all of them fit into the smallest pipe."""
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG
_LIBRARY: Any = ctypes.CDLL(None) if CAN_FORK else None


class _Share:
    """What this process knows of the spare cores.

    Attributes
    ----------
    spare : Semaphore or None
        Count of spare cores that several processes share; None: nobody shares, and `map_processes` starts as many
        helpers as it may.
    not_returned : int
        Cores that were lent and have not come back: the next spare ones are not taken but returned.
    helper : bool
        Whether this process is a helper, which forks no others.
    """

    spare: Semaphore | None = None
    not_returned = 0
    helper = False


def usable_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processes_for(wanted: int) -> int:
    """Return how many processes to use: no more than there are cores, or two.

    More would only wait for each other and hold memory.
    """
    return min(wanted, max(usable_cores(), 2))


def share_cores(spare: Semaphore, not_returned: int = 0) -> None:
    """Take the helpers of this process from a count of spare cores, of which it owes some."""
    _Share.spare, _Share.not_returned = spare, not_returned


def cores_not_returned() -> int:
    """Return how many cores this process has lent to others and used again before they came back."""
    return _Share.not_returned


@contextmanager
def core_lent() -> Iterator[None]:
    """Lend this process's core to others while it waits for something."""
    if _Share.spare is None or _Share.helper:
        yield
        return
    _give_core()
    try:
        yield
    finally:
        # Not waited for: who has it returns it when his item is done, and the next spare core pays for it.
        if not _Share.spare.acquire(False):
            _Share.not_returned += 1


def _take_core() -> bool:
    """Take a spare core if there is one."""
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
    """End this process with the process that started it, whose number is given, however that one ends (on Linux)."""
    if CAN_FORK:
        _LIBRARY.prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def return_memory() -> None:
    """Give memory that is free in this process back to the system (GNU C library; elsewhere nothing)."""
    if hasattr(_LIBRARY, "malloc_trim"):
        _LIBRARY.malloc_trim(0)


def one_thread() -> AbstractContextManager[object]:
    """Limit the libraries of linear algebra to one thread: in many small solves several would wait for each other."""
    return threadpool_limits(limits=1)


def map_processes(function: Callable[[Item], Result], items: Iterable[Item], workers: int) -> list[Result]:
    """``[function(item) for item in items]``, on up to `workers` processes; the same for any number.

    Parameters
    ----------
    function : callable
        Anything; what it changes outside of its result is lost.  What it returns or raises has to be sent.
    items : iterable
    workers : int
        This process and its helpers; fewer if figures that run side by side leave no core.
    """
    tasks = list(items)
    with one_thread():
        most = min(workers, len(tasks)) - 1
        if most < 1 or _Share.helper or not CAN_FORK:
            return [function(item) for item in tasks]
        size = -(-len(tasks) // _MOST_BLOCKS)
        blocks = [tasks[start : start + size] for start in range(0, len(tasks), size)]
        return [result for block in _spread(function, blocks, most) for result in block]


def _spread(
    function: Callable[[Item], Result], blocks: Sequence[Sequence[Item]], most: int
) -> list[list[Result]]:
    """Return the results of each block, from this process and up to so many helpers."""
    queue, filling = os.pipe()
    os.write(filling, b"".join(number.to_bytes(4, "little") for number in range(len(blocks))))
    os.close(filling)
    found: dict[int, list[Result] | Exception] = {}
    helpers: list[_Helper] = []
    try:
        for number in _taken(queue):
            while number < len(blocks) - 1 and len(helpers) < most and _take_core():
                helpers.append(_Helper(function, blocks, queue))
            _attempt(function, blocks, number, queue, found)
        for helper in helpers:
            found |= helper.results()
    finally:
        for helper in helpers:
            helper.end()
        os.close(queue)
    made: list[list[Result]] = []
    for number, block in enumerate(blocks):
        # Not there: of a helper that was killed, or could not send it.
        results = found[number] if number in found else [function(item) for item in block]
        if isinstance(results, Exception):
            raise results  # the first, as without helpers: blocks before it were all begun
        made.append(results)
    return made


def _taken(queue: int) -> Iterator[int]:
    """Numbers of blocks that this process takes from the queue, until it is empty."""
    while entry := os.read(queue, 4):
        yield int.from_bytes(entry, "little")


def _attempt(
    function: Callable, blocks: Sequence[Sequence], number: int, queue: int, found: dict[int, Any]
) -> None:
    """Add a block's results to what was found; or its error, which empties the queue."""
    try:
        found[number] = [function(item) for item in blocks[number]]
    except Exception as error:
        found[number] = error
        for _ in _taken(queue):
            pass


class _Helper:
    """A fork of this process that takes blocks from the queue and sends all results when it is empty."""

    def __init__(self, function: Callable, blocks: Sequence[Sequence], queue: int) -> None:
        self._receiver, sender = Pipe(duplex=False)
        parent = os.getpid()
        with warnings.catch_warnings():
            # Threads of this process draw the display: a helper touches nothing of what they may have locked.
            warnings.simplefilter("ignore", DeprecationWarning)
            self._pid = os.fork()
        if self._pid == 0:
            try:
                self._receiver.close()
                die_with_parent(parent)
                signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for this process's parent
                signal.signal(signal.SIGTERM, signal.SIG_DFL)
                _Share.helper = True
                found: dict[int, Any] = {}
                for number in _taken(queue):
                    _attempt(function, blocks, number, queue, found)
                sender.send(found)
            finally:
                os._exit(0)
        sender.close()

    def results(self) -> dict[int, Any]:
        """Return what it found, when it has ended; nothing if it was killed or could not send it."""
        try:
            return dict(self._receiver.recv())
        except (EOFError, OSError):
            return {}

    def end(self) -> None:
        """End it, if it has not, and give its core back."""
        self._receiver.close()
        with suppress(ProcessLookupError):
            os.kill(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)
        _give_core()
