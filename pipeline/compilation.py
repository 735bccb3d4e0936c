"""Loops compiled by numba, once on a machine, with sums that do not depend on it.

Every loop has NaN and infinity as IEEE has them.  What numba keeps on disk goes by the file of a loop: what it calls
has to stand in the same file, or an edited callee leaves a stale copy in its caller.

The first compilation of all loops takes half a minute.  Of several processes that need one, one compiles it, and the
others wait and read what it has kept on disk.  A process that calls no loop does not import numba.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from pathlib import Path
from threading import RLock
from typing import Any

from pipeline.locks import exclusive

_NUMBA = "numba (extra `papers`), which is not installed: pip install 'gait-pipeline[papers]', in a clone make install"

_HELD: set[Path] = set()
"""Folders in which this process compiles: a loop is compiled while the one that calls it is."""

_ONE_THREAD = RLock()


class CompiledLoop:
    """A loop that is compiled when it is first called; its attributes are those of numba's dispatcher."""

    def __init__(self, loop: Callable, **options: Any) -> None:
        update_wrapper(self, loop)
        self._loop, self._options = loop, options
        self._dispatcher: Any = None

    def dispatcher(self) -> Any:
        """Return numba's dispatcher, after all loops of the module have become dispatchers: they call each other."""
        with _ONE_THREAD:
            if self._dispatcher is None:
                self._dispatcher = _compiled(self._loop, **self._options)
                names = self._loop.__globals__
                for name, value in list(names.items()):
                    if isinstance(value, CompiledLoop):
                        names[name] = value.dispatcher()
            return self._dispatcher

    def __call__(self, *arguments: Any) -> Any:
        return (self._dispatcher or self.dispatcher())(*arguments)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # of Python's own, which the loop has or has not
            raise AttributeError(name)
        return getattr(self.dispatcher(), name)


def compiled_exactly(loop: Callable) -> CompiledLoop:
    """The loop, compiled when it is first called, with sums in the written order: it equals the plain one.

    It is kept on disk.  Where neither the package's folder nor the user's cache can be written to, every process
    compiles for itself.
    """
    return CompiledLoop(loop, error_model="numpy")


def compiled_with_free_sums(loop: Callable) -> CompiledLoop:
    """The loop as by `compiled_exactly`, but the terms of a sum may be taken in another order, and fused.

    Nothing else is assumed.  The result depends on the processor by rounding, which whoever uses it has to allow for.
    """
    return CompiledLoop(loop, fastmath={"reassoc", "contract"})


def _compiled(loop: Callable, **options: Any) -> Any:
    try:
        from numba import njit  # takes a fifth of a command's start
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"this needs {_NUMBA}", name=error.name) from None

    try:
        dispatcher = njit(cache=True, nogil=True, **options)(loop)
    except RuntimeError:  # numba's word for no place to keep it
        return njit(nogil=True, **options)(loop)
    compile_for = dispatcher.compile
    folder = Path(dispatcher.stats.cache_path)

    def compile_once(signature: Any) -> Any:
        """Keep other processes from compiling what is kept in this folder."""
        with _ONE_THREAD:
            if folder in _HELD:
                return compile_for(signature)
            folder.mkdir(parents=True, exist_ok=True)
            with exclusive(folder / "compiling.lock"):
                _HELD.add(folder)
                try:
                    return compile_for(signature)
                finally:
                    _HELD.discard(folder)

    dispatcher.compile = compile_once
    return dispatcher
