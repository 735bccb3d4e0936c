"""Threads change nothing: results keep their order, and an error comes through."""

from __future__ import annotations

import pytest

from pipeline.threads import map_threads


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_threads_keep_the_order(workers: int) -> None:
    assert map_threads(lambda n: n * n, range(20), workers) == [n * n for n in range(20)]


@pytest.mark.parametrize("workers", [1, 3])
def test_the_first_error_comes_through(workers: int) -> None:
    def fail(n: int) -> int:
        if n == 3:
            raise ValueError("three")
        return n

    with pytest.raises(ValueError, match="three"):
        map_threads(fail, range(6), workers)
