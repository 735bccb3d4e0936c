"""Loops that numba compiles once on each machine.

NaN and infinity behave as in IEEE arithmetic.  Numba's cache on disk is keyed by the file of a loop.  A loop and its
callees must therefore be in the same file: otherwise an edited callee leaves a stale copy in its caller.

The first compilation of all loops takes half a minute.  When several processes need the same loop, one compiles it and
the others wait for the cached result.  A process that calls no loop does not import numba.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from pathlib import Path
from threading import RLock
from typing import Any

from pipeline.locks import exclusive

_NUMBA = "numba (extra `papers`), which is not installed: pip install 'gait-pipeline[papers]', in a clone make install"

_COMPILING: set[Path] = set()
"""Cache folders that this process has locked, because compiling a loop also compiles the loops that it calls.
"""

_ONE_THREAD = RLock()


class CompiledLoop:
    """Loop that is compiled at its first call, and that has the attributes of numba's dispatcher."""

    def __init__(self, loop: Callable, **options: Any) -> None:
        update_wrapper(self, loop)
        self._loop, self._options = loop, options
        self._dispatcher: Any = None

    def dispatcher(self) -> Any:
        """Return the loop's numba dispatcher; replace the module's other loops too, since loops call each other."""
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
        if name.startswith("_"):  # Python's special names are not looked up in the dispatcher
            raise AttributeError(name)
        return getattr(self.dispatcher(), name)


def compiled_exactly(loop: Callable) -> CompiledLoop:
    """Return a loop that is compiled at its first call and gives exactly the results of the Python code.

    The compiled code is cached on disk.  If neither the package's folder nor the user's cache is writable, every
    process compiles for itself.
    """
    return CompiledLoop(loop, error_model="numpy")


def compiled_with_free_sums(loop: Callable) -> CompiledLoop:
    """Return a loop like `compiled_exactly`, but allow the compiler to reorder and fuse the terms of sums.

    The rounding error of the result depends on the processor; callers must allow for it.
    """
    return CompiledLoop(loop, fastmath={"reassoc", "contract"})


def _compiled(loop: Callable, **options: Any) -> Any:
    try:
        from numba import njit  # takes a fifth of a command's start
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"this needs {_NUMBA}", name=error.name) from None

    try:
        dispatcher = njit(cache=True, nogil=True, **options)(loop)
    except RuntimeError:  # numba finds no writable cache folder
        return njit(nogil=True, **options)(loop)
    compile_for = dispatcher.compile
    folder = Path(dispatcher.stats.cache_path)

    def compile_once(signature: Any) -> Any:
        """Compile a loop, while other processes that use the same cache folder wait."""
        with _ONE_THREAD:
            if folder in _COMPILING:
                return compile_for(signature)
            folder.mkdir(parents=True, exist_ok=True)
            with exclusive(folder / "compiling.lock"):
                _COMPILING.add(folder)
                try:
                    return compile_for(signature)
                finally:
                    _COMPILING.discard(folder)

    dispatcher.compile = compile_once
    return dispatcher
