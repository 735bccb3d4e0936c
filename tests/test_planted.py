"""The table of small defects: every one can still be planted, and names tests that are there and no golden tables."""

from __future__ import annotations

import re
from collections import Counter

import pytest

from tests.planted import ROOT, Defect, chosen, defects


def complaints(defect: Defect) -> list[str]:
    """Why a defect cannot be planted or noticed."""
    source = (ROOT / defect.file).read_text(encoding="utf-8")
    described = [f"{defect.old!r} stands {source.count(defect.old)} times"] * (source.count(defect.old) != 1)
    described += ["it changes nothing"] * (defect.new == defect.old)
    try:
        compile(source.replace(defect.old, defect.new), defect.file, "exec")
    except SyntaxError as error:
        described.append(f"it does not compile: {error}")
    for test in defect.tests.split():
        path, _, name = test.partition("::")
        if not (ROOT / path).exists() or not path.startswith("tests/"):
            described.append(f"no test {path}")
        elif name and not re.search(
            rf"^def {name.partition('[')[0]}\(", (ROOT / path).read_text(), re.MULTILINE
        ):
            described.append(f"no test {test}")
        elif "golden" in test or "test_every_preset" in test:
            described.append(f"{test} compares golden tables")
    return [f"{defect.file}: {sentence}" for sentence in described + ["no test"] * (not defect.tests)]


def test_every_defect_can_be_planted() -> None:
    assert [sentence for defect in defects() for sentence in complaints(defect)] == []


def test_there_are_a_hundred_or_more_each_another_one_all_over_the_package() -> None:
    rows = defects()
    assert len({(row.file, row.old, row.new) for row in rows}) == len(rows) >= 100
    assert max(Counter(row.file for row in rows).values()) <= 5
    assert len({row.file for row in rows}) >= 60


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="draws by the commit")
def test_a_number_draws_rows_and_a_word_picks_them() -> None:
    assert len(set(chosen(["10"]))) == 10
    assert chosen(["10"]) == chosen(["10"])
    assert {row.file for row in chosen(["core/camera.py"])} == {"pipeline/core/camera.py"}
    assert chosen([]) == defects()
