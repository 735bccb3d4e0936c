"""Tests that the pictures at the top of the README are drawn from published figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.report import first_screen
from pipeline.report.first_screen import draw_first_screen
from pipeline.report.published import read_published
from tests.rejects import rejects
from tests.report.planted import CLAIM, plant

VIEWS = [0, 30]


def arrays() -> dict[str, np.ndarray]:
    """Return arrays of three walkers and two views, where the second walker has the median error at 0°."""
    generator = np.random.default_rng(3)
    original = 100.0 * generator.standard_normal((3, 5, 15, 3))
    return {
        "walker": np.array(["a", "b", "c"]),
        "methods": np.array(["map"]),
        "demonstration_view_deg": np.array(VIEWS, dtype=float),
        "missing": generator.standard_normal((1, 3, 2, 5, 15)),
        "original": original,
        "stride_hz": np.array([1.0, 0.8, 1.0]),
        "unmeasured": np.zeros((3, 15), dtype=bool),
    }


def people() -> dict[str, list[object]]:
    """Return a table with the errors of each walker at 0° and 30°."""
    return {
        "walker": ["a", "b", "c"] * 4,
        "method": ["map"] * 6 + ["average_walker"] * 6,
        "view_angle_deg": [0.0] * 3 + [30.0] * 3 + [0.0] * 3 + [30.0] * 3,
        "rms_error_mm": [30.0, 20.0, 10.0] + [1.0] * 3 + [50.0] * 3 + [1.0] * 3,
    }


def table() -> dict[str, list[object]]:
    """Return a table with the errors of four methods at three views."""
    methods = [method for method in ("average_walker", "least_squares", "map", "map_1") for _ in range(3)]
    return {
        "method": list(methods),
        "view_angle_deg": [-30, 0, 30] * 4,
        "rms_error_mm": [20.0] * 12,
        "rms_error_mm_low": [19.0] * 12,
        "rms_error_mm_high": [21.0] * 12,
    }


def test_what_agrees_comes_first_and_is_told_apart_by_its_baseline(tmp_path: Path) -> None:
    folder = tmp_path / "synthetic" / "smoke"
    rows = [
        ("result", "agrees", "yes", ""),
        ("result", "agrees", "yes", "zhang2007_first"),
        ("sentence", "agrees", "worse", ""),
        ("sentence", "agrees", "no", ""),
        ("sentence", "agrees", "not applicable", ""),
        ("sentence", "differs", "yes", ""),
        ("condition", "met", "not applicable", ""),
        ("target", "agrees", "yes", ""),
    ]
    names = ("kind", "agreement", "beyond_baseline", "same_as")
    claims = {name: values * len(rows) for name, values in CLAIM.items()}
    claims |= {"claim": [f"zhang2007_{n}" for n in range(len(rows))]}
    claims |= {name: [row[n] for row in rows] for n, name in enumerate(names)}
    plant(
        folder / "zhang2007_fig5",
        table=table(),
        more={"table_people.csv": people()},
        arrays=arrays(),
        claims=claims,
    )
    counts = first_screen._counts(read_published(folder, ["zhang2007_fig5"]).claims_of(paper="zhang2007"))
    assert counts == {
        "agrees, beyond its baseline": 1,
        "agrees, not beyond its baseline": 2,
        "agrees, has no baseline": 1,
        "differs": 1,
    }
    assert list(first_screen._ANSWERS)[:4] == [name for name in first_screen._ANSWERS if "agrees" in name]


def test_the_walker_nearest_to_the_medians_is_drawn(tmp_path: Path) -> None:
    folder = tmp_path / "synthetic" / "smoke"
    plant(
        folder / "zhang2007_fig5",
        table=table(),
        more={"table_people.csv": people()},
        arrays=arrays(),
        claims=CLAIM,
    )
    results = read_published(folder, ["zhang2007_fig5"])
    files = draw_first_screen(results, results, tmp_path / "pictures")
    assert {path.name for path in files} == {"walker.svg", "walker_still.svg", "curve.svg", "verdicts.svg"}
    assert {path.name for path in (tmp_path / "pictures").iterdir()} == {path.name for path in files}
    walker = (tmp_path / "pictures" / "walker.svg").read_text(encoding="utf-8")
    assert "20 mm off in depth (average walker: 50 mm)" in walker
    assert 'dur="1.250s"' in walker


@pytest.mark.parametrize(
    ("figure", "views", "code", "where"),
    [
        ("zhang2007_fig6", VIEWS, "not_made", "synthetic"),
        ("zhang2007_fig5", [30, 45], "no_such_view", "zhang2007_fig5"),
    ],
)
def test_pictures_without_their_figure_are_refused(
    tmp_path: Path, figure: str, views: list[int], code: str, where: str
) -> None:
    folder = tmp_path / "synthetic" / "smoke"
    finite = arrays() | {"demonstration_view_deg": np.array(views, dtype=float)}
    plant(folder / figure, table=table(), arrays=finite, claims=CLAIM)
    with rejects(code, where):
        results = read_published(folder, [figure])
        draw_first_screen(results, results, tmp_path / "pictures")
