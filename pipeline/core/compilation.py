"""Loops compiled by numba as they stand: sums in the written order, NaN and infinity as IEEE has them.

So the numbers do not depend on the processor, and a compiled loop equals the plain one.  What numba keeps on disk goes
by the file of a loop: what it calls has to stand in the same file, or an edited callee leaves a stale copy.
"""

from __future__ import annotations

from collections.abc import Callable

from numba import njit


def compiled_exactly(loop: Callable) -> Callable:
    """The loop, compiled when it is first called, and kept on disk where that is possible.

    Where neither the package's folder nor the user's cache can be written to, every process compiles for itself.
    """
    try:
        return njit(cache=True, nogil=True, error_model="numpy")(loop)
    except RuntimeError:  # numba's word for no place to keep it
        return njit(nogil=True, error_model="numpy")(loop)
