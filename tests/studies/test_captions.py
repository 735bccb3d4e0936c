"""Tests of captions: numbers come from tables, claims, options and constants, and colours from the palette."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline import papers, plugins
from pipeline.core.bootstrap import LEVEL
from pipeline.palette import COLOURS, ROLES, name_on_dark
from pipeline.storage import tables
from pipeline.studies.captions import filled_caption
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.ledger import number_of_figure
from pipeline.studies.registry import all_measures
from pipeline.studies.replicated import OVER_PEOPLE
from tests.rejects import rejects

ROOT = Path(__file__).parents[2]
PRESETS = [*plugins.conf_files("experiment").values()]
ARCHIVE = ROOT / "results/archive/light"

NUMBERS = (
    r"(?<![\w`.-])[0-9][0-9.]*(?![0-9]*D\b)",
    r"\b(two|three|four|five|six|seven|eight|nine|ten|eleven|twelve|sixteen|twenty|thirty|hundred|half|third|quarter"
    r"|fifth|sixth|seventh|eighth|ninth|tenth|twice)(s|-\w+)?\b",
)
"""Patterns of numbers as digits and as words, without numbers in names and in words such as 3D."""

COLOUR_WORDS = rf"(?i)\b({'|'.join([*COLOURS, 'gray', 'red', 'pink', 'brown', 'violet'])})\b"


def literals(text: str, patterns: tuple[str, ...]) -> list[str]:
    """Return all numbers or colours in a template that are outside its placeholders."""
    outside = re.sub(r"\{[^{}]*\}", "", re.sub(r"[Ff]igure [0-9]+", "", text))
    return [result.group() for pattern in patterns for result in re.finditer(pattern, outside)]


def sentences(source: Path) -> Iterator[tuple[int, str]]:
    """Yield line number and text of each caption string and each string with a full stop in a module."""
    tree = ast.parse(source.read_text("utf-8"))
    prose = {
        id(part)
        for node in ast.walk(tree)
        for top in (
            [word.value for word in node.keywords if word.arg == "caption"] + node.args[:1] * _begins(node)
            if isinstance(node, ast.Call)
            else []
        )
        for part in ast.walk(top)
    }
    statements = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}  # docstrings
    errors = {
        id(part)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and "InvalidInput" in ast.unparse(node.func)
        for part in ast.walk(node)
    }
    formats = {
        id(part) for node in ast.walk(tree) if isinstance(node, ast.FormattedValue) for part in ast.walk(node)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            described = " " in node.value and (id(node) in prose or re.search(r"\.(\s|$)", node.value))
            if described and id(node) not in statements | errors | formats:
                yield node.lineno, node.value


def _begins(node: ast.Call) -> bool:
    return isinstance(node.func, ast.Name) and node.func.id == "begin"


def caption_modules() -> list[Path]:
    """Return the paths of all modules of studies that contain texts of captions."""
    studies = ROOT / "pipeline/studies"
    return sorted(
        path
        for path in studies.rglob("*.py")
        if "figures" in path.parts
        or re.search(r"caption=|with begin\(", path.read_text("utf-8"))
        or path.name in ("presentation.py", "figure_inputs.py")
    )


def presets() -> dict[str, dict[str, str]]:
    return {path.stem: yaml.safe_load(path.read_text("utf-8")) for path in PRESETS}


@pytest.mark.parametrize("module", caption_modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_captions_of_figures_and_recordings_state_no_number_and_no_colour_of_their_own(module: Path) -> None:
    for line, text in sentences(module):
        assert not literals(text, (*NUMBERS, COLOUR_WORDS)), f"line {line}: {text}"


@pytest.mark.parametrize("name", [path.stem for path in PRESETS])
def test_titles_and_expectations_state_no_number_and_no_colour_of_their_own(name: str) -> None:
    preset = presets()[name]
    for part in ("title", "expect"):
        assert not literals(preset[part], (*NUMBERS, COLOUR_WORDS)), preset[part]
    assert not papers.placeholders(preset["title"]), "titles are not filled in"


@pytest.mark.parametrize("paper", papers.all_papers())
def test_sentences_of_the_page_state_no_number_of_their_own(paper: str) -> None:
    page = papers.all_papers()[paper].page
    for text in (page.question, *page.sentences):
        assert not literals(text, (NUMBERS[0], COLOUR_WORDS)), text
        assert "no number" not in filled_caption(text, lambda name: 1.0)


@pytest.mark.parametrize("template", ["pipeline/report/page/index.html.j2", "walk3d/page/walk.html"])
def test_templates_of_the_pages_name_no_colour(template: str) -> None:
    text = (ROOT / template).read_text("utf-8")
    displayed = re.sub(
        r"<(style|script).*?</\1>|<[^>]*>|\{%.*?%\}|\{\{.*?\}\}|\$\w+", " ", text, flags=re.DOTALL
    )
    assert not literals(displayed, (COLOUR_WORDS,))


def test_literals_are_noticed() -> None:
    every = (*NUMBERS, COLOUR_WORDS)
    assert literals("Legs to three or 4.5 cm, a third less; Orange: {colour_map}, {x:.0f} mm", every) == [
        "4.5", "three", "third", "Orange"
    ]  # fmt: skip
    assert not literals("Figure 4 in 3D, of `zhang2007_fig4`, once", every)


def published(data: str, figure: str) -> dict[str, Any]:
    """Return the tables of a figure in the light archive, compressed or uncompressed."""
    paths = (ARCHIVE / data / figure).glob("*.csv*")
    return {path.name.split(".")[0]: tables.read(path) for path in paths}


@pytest.mark.parametrize("data", ["synthetic", "optical"])
@pytest.mark.parametrize("name", [path.stem for path in PRESETS])
def test_every_number_of_an_expectation_is_in_the_tables_of_its_figure(name: str, data: str) -> None:
    text = filled_caption(
        presets()[name]["expect"], number_of_figure(name, published(data, name), all_measures())
    )
    assert "no number" not in text
    assert "{" not in text


def test_hidden_joints_are_as_far_off_as_their_table_has_it() -> None:
    """The errors of hidden joints in the text are those of the table; an earlier text stated larger errors."""
    output = published("optical", "zhang2007_occlusion")
    rows = output["table_hidden"]
    error = {
        method: value
        for hidden, method, value in zip(rows["hidden"], rows["method"], rows["hidden_error_mm"], strict=True)
        if hidden == "far_side"
    }
    template = presets()["zhang2007_occlusion"]["expect"]
    text = filled_caption(template, number_of_figure("zhang2007_occlusion", output, all_measures()))
    stated = [float(number) for number in re.findall(r"(\d+) mm", text)]
    assert stated == [round(error[method]) for method in ("anatomical", "map_tuned", "average_walker")]


def test_undecided_limbs_are_called_by_the_colour_that_they_are_drawn_in() -> None:
    """The text names the colour in which the palette draws undecided limbs; an earlier text named red."""
    text = filled_caption(presets()["park2011_fig4"]["expect"], lambda name: np.nan)
    assert f"most limbs are {ROLES['undecided']}," in text
    assert ROLES["undecided"] in COLOURS


def test_recordings_name_colours_as_their_dark_ground_shows_them() -> None:
    assert name_on_dark("original") == name_on_dark("black") == "silver"
    assert name_on_dark("undecided") == "orange"


def test_the_level_of_bands_is_that_of_the_bootstrap() -> None:
    percent = f"{100.0 * LEVEL:g} %"
    assert str(FigureInputs.banded.fget(SimpleNamespace(population=0))).startswith(
        f"{percent} interval of the mean"
    )
    assert f"{percent} intervals over people" == OVER_PEOPLE


def test_slips_in_a_template_are_errors_and_unknown_numbers_are_written_as_such() -> None:
    assert filled_caption("{zhang2007_walkers:.0f} people", lambda name: np.nan) == "(no number here) people"
    with rejects("unknown_claim", name="zhang2007_wlakers"):
        filled_caption("{zhang2007_wlakers:.0f}", lambda name: 1.0)
    with rejects("unknown_claim", name="zhang2007_wlakers"):
        filled_caption("{published_zhang2007_wlakers:.0f}", lambda name: 1.0)
    with pytest.raises(KeyError):
        filled_caption("{colour_of_nothing}", lambda name: 1.0)
