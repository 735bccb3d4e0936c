"""Tests that the generated parts of the documentation are complete, and that it is built without a warning."""

from __future__ import annotations

import importlib.util
import re
import sys
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import pytest
import yaml

from pipeline.cli.presets import presets
from pipeline.studies import registry
from pipeline.validation import require_distinct, require_range
from tests.processes import ROOT, finished

SPEC = importlib.util.spec_from_file_location("generated", ROOT / "docs" / "generated.py")
assert SPEC is not None
assert SPEC.loader is not None
generated = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(generated)


def test_every_option_stands_in_the_table_with_who_uses_it() -> None:
    output = generated.options()
    for group in registry.GROUPS:
        for name, kind in registry.options(group).items():
            part = output.partition(f"### {group}={name}\n")[2].partition("\n### ")[0]
            described = {
                line.split("`")[1].split(".")[1] for line in part.splitlines() if line.startswith("| `")
            }
            assert described == {field.name for field in fields(kind)}
    assert "`input.frame_rate_hz` | number | `0.0` |" in output
    used = {name for line in output.splitlines() if "Used by" in line for name in line.split("`")[1::2]}
    assert set(presets()) <= used
    # A class without an option has no table.
    assert "| `name`" in output.partition("### Every figure")[2]


def test_every_option_says_what_it_means() -> None:
    described = [
        row for _, before, kind, _ in generated.option_classes() for row in generated.rows_of(before, kind)
    ]
    assert [row[0] for row in described if not all(row[k].strip() for k in (0, 1, 2, 5))] == []
    units = {row[0]: row[4] for row in described}
    assert units["sweep.sigma2_mm2.step"] == "mm²"
    assert units["data.steady.turn_deg_s"] == "°/s"


def test_a_table_has_type_default_bounds_unit_and_meaning() -> None:
    @dataclass
    class Sweep:
        """Sweep of a figure, with three options.

        Attributes
        ----------
        trials : int
            How often.
        """

        trials: Annotated[int, partial(require_range, at_least=1, at_most=9)] = 3
        noise_mm: Annotated[list[float], require_distinct] | None = None
        penalty: bool = True

    rows = list(generated.rows_of("sweep.", Sweep))
    assert rows[0] == ("sweep.trials", "whole number", "`3`", "≥ 1, ≤ 9", "", "How often.")
    assert rows[1][:5] == ("sweep.noise_mm", "list of number", "`None`", "distinct", "mm")
    assert rows[2][1:3] == ("true or false", "`true`")


def test_every_column_of_the_golden_tables_is_listed() -> None:
    output = generated.columns()
    having = generated.golden_columns()
    assert set(having) == set(presets())
    for figure, names in having.items():
        for name in names:
            if not name.endswith(("_low", "_high")):
                (line,) = (line for line in output.splitlines() if line.startswith(f"| `{name}` |"))
                assert f"`{figure}`" in line


def test_every_column_says_what_it_means() -> None:
    rows = [line.split(" | ") for line in generated.columns().splitlines()[2:]]
    assert len(rows) > 120
    assert [row[0] for row in rows if not row[2].partition("(with its")[0].strip()] == []
    assert set(generated.COLUMNS) <= {row[0].strip("| `") for row in rows}


def test_the_library_is_described_from_its_docstrings() -> None:
    output = generated.library()
    assert (
        "from_view(model: LinearModel, walk: FourierRepresentation, view_angle_deg: float, *, hidden:"
        in output
    )
    assert "- `hidden : sequence of str`" in output
    assert "noise_variance_mm2: float = 70.0, laboratory: str = 'known') -> Reconstruction" in output
    assert "adjust: Adjustment = 'per_frame'" in output
    assert (
        "px, in the order of the chain's joints"
        in output.partition("articulated_trajectory.reconstruct\n")[2]
    )


def test_the_drawing_has_every_package_and_no_arrow_upwards() -> None:
    graph, levels = generated.imports(), generated.levels()
    assert {name for names in levels for name in names} | generated.GROUND == set(graph)
    height = {name: k for k, names in enumerate(levels) for name in names}
    for name, others in graph.items():
        assert all(height[other] < height[name] for other in others - generated.GROUND if name in height)
    output = generated.drawing()
    assert all(f">{name}</text>" in output for name in height)


def test_documentation_imports_the_name_that_no_folder_of_a_user_hides() -> None:
    pages = [*(ROOT / "docs").glob("*.md"), ROOT / "README.md", ROOT / "tutorial.py"]
    assert len(pages) > 20
    texts = {path.name: path.read_text("utf-8") for path in pages} | {"api.md, made": generated.library()}
    wrong = [
        (name, line)
        for name, text in texts.items()
        for line in text.splitlines()
        if re.search(r"(^|[\s\"`])(from|import) pipeline\b", line)
    ]
    assert wrong == []


def test_the_table_of_closures_has_each_figure_and_counts_as_the_bound_does() -> None:
    from tests.test_architecture import FIGURES
    from tests.test_architecture import reached as bounded

    output = generated.closures()
    assert all(f"| `{name}` | " in output for name in presets())
    for module in [*FIGURES, "walk3d.film.command"]:
        dotted = module if module.startswith("walk3d") else f"pipeline.{module}"
        assert len(generated.reached(dotted)) == len(bounded(module)), module


def test_every_page_is_in_the_menu() -> None:
    settings: dict[str, Any] = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    groups = [entry if isinstance(entry, str) else next(iter(entry.values())) for entry in settings["nav"]]
    named = [page for group in groups for page in ([group] if isinstance(group, str) else group)]
    assert sorted(named) == sorted(path.name for path in (ROOT / "docs").glob("*.md"))


@pytest.mark.thorough
def test_the_documentation_is_built_without_a_warning_and_needs_no_network(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    site = tmp_path / "site"
    message = finished(
        [sys.executable, "-W", "error", "-m", "mkdocs", "build", "--quiet", "--site-dir", str(site)]
    )
    assert (message.returncode, message.stderr) == (0, "")
    page = (site / "options.html").read_text(encoding="utf-8")
    assert "sweep.noise_variance_mm2" in page
    for path in site.glob("*.html"):
        text = path.read_text(encoding="utf-8")
        assert 'src="http' not in text, path.name
        assert 'rel="stylesheet" href="http' not in text, path.name


def test_the_first_page_says_what_its_curve_shows() -> None:
    figure = ROOT / "results" / "archive" / "light" / "optical" / "zhang2007_fig5"
    errors = pd.read_csv(figure / "table.csv.gz").groupby("method")["rms_error_mm"]
    least, most = errors.min().round().astype(int), errors.max().round().astype(int)
    assert (
        f"{least['map']} to {most['map']} mm with a prior, up to {most['least_squares']} mm by least squares"
        f" and {most['average_walker']} mm for the average walker"
    ) in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_gallery_shows_twelve_pictures_with_command_and_duration() -> None:
    page = (ROOT / "docs" / "gallery.md").read_text("utf-8")
    cards = re.findall(r"\[!\[[^]]+\]\((gallery/[^)]+)\)\]\((\w+\.md)\)", page)
    assert len(cards) == len({address for address, _ in cards}) == 12
    assert all((ROOT / "docs" / target).is_file() for _, target in cards)
    assert len(re.findall(r"^make [^#\n]+# \(about [0-9a-z ]+\)$", page, re.MULTILINE)) == 12
    pictures = generated.gallery_pictures()
    assert set(pictures) == {address for address, _ in cards}
    for address, content in pictures.items():
        assert content.startswith(b"RIFF" if address.endswith("webp") else (b"<svg", b"<?xml")), address
        assert len(content) < 120_000


def test_tables_code_and_footer_can_be_reached() -> None:
    page = generated.on_page_content("<table>\n<tr></tr></table><pre><code>make</code></pre><table></table>")
    assert page.count('<div class="wide" tabindex="0"><table>') == page.count("</table></div>") == 2
    assert '<pre tabindex="0"><code>' in page
    assert generated.on_post_page("<footer>a</footer>") == '<footer role="contentinfo">a</footer>'
