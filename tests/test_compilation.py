"""Tests of compiled loops: one process compiles them for all, and their results equal those of plain Python."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from pipeline.compilation import compiled_exactly
from tests.processes import started

LOOPS = """
import numpy as np
from pipeline.compilation import compiled_exactly

@compiled_exactly
def square(x):
    return x * x

@compiled_exactly
def squares(numbers):
    total = 0.0
    for number in numbers:
        total += square(number)
    return total
"""
RUN = """
import numpy as np
import loops
loops.squares(np.ones(3))
print(sum(loops.squares.stats.cache_hits.values()), sum(loops.squares.stats.cache_misses.values()))
"""


def test_of_several_processes_one_compiles_and_the_others_read(tmp_path: Path) -> None:
    (tmp_path / "loops.py").write_text(LOOPS)
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n" + RUN]
    with ExitStack() as stack:
        processes = [stack.enter_context(started(command)) for _ in range(3)]
        message = sorted(process.communicate()[0].split() for process in processes)
    assert message == [["0", "1"], ["1", "0"], ["1", "0"]]
    assert not list(tmp_path.rglob("*.lock"))


def test_a_compiled_loop_equals_the_plain_one() -> None:
    def total(numbers: np.ndarray) -> float:
        result = 0.0
        for number in numbers:
            result += 1.0 / number
        return result

    numbers = np.array([0.1, 3.0, -7.0, 1e-300])
    assert compiled_exactly(total)(numbers) == total(numbers)
