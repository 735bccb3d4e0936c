"""Tests of the files that a newcomer edits to add a column, a claim, a file reader and a figure.

A paper is in `test_new_paper`.  All four are edited in one copy, before its figures and tests run once.
Golden files are renewed by their command and not counted; what is edited by hand is.
"""

from __future__ import annotations

import shutil
import textwrap
from pathlib import Path

import pytest

from tests.contents import columns_of
from tests.processes import copy_tree
from tests.studies.test_new_paper import ROOT, run

pytestmark = pytest.mark.thorough

CLAIM = """\
  zhang2007_gain_from_the_front:
    class: gain_of_the_prior
    short: error of the mean
    section: "4.2"
    quote: the error of 3D motion reconstruction is about 30% smaller than the error by approach I
    published: 30
    unit: '%'
    kind: sentence
    figure: zhang2007_fig5
    how: 1 − mean absolute_error_mm2 of MAP from the front, over that of least squares
    measure: {percent_less: {of: {mean: {table: table, column: absolute_error_mm2, where: method == 'map' and
          view_angle_deg == 0}}, than: {mean: {table: table, column: absolute_error_mm2,
          where: method == 'least_squares' and view_angle_deg == 0}}}}
    bounds:
      agrees: {within: 10}
      close: {above: 0, below: 100}
      reason: ten points either way

"""
BEFORE_CLAIM = "  zhang2007_map_thirty_percent_relative:\n"

READER = '''\
"""Point lists: the rate and the names in the first line, then a line of coordinates to each frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.formats.contract import damaged, motion_capture, read_bytes
from pipeline.formats.text import millimetres_in
from pipeline.skeleton.recorded import MotionCapture


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read a point list in millimetres, if no unit is given."""
    where = Path(path).name
    head, *lines = read_bytes(Path(path)).decode("ascii", errors="replace").splitlines()
    rate, *names = head.split() or [""]
    if not names or not lines:
        raise damaged("a point list has names, and a line to each frame", where, code="no_points")
    try:
        positions = np.array([line.split() for line in lines], dtype=float).reshape(len(lines), len(names), 3)
        return motion_capture(
            names, positions * millimetres_in(units or "mm", where), float(rate), units or "mm", []
        )
    except ValueError as error:
        raise damaged("this is no point list", where, received=str(error), code="not_a_number") from None
'''


def edit(project: Path, name: str, before: str, after: str) -> None:
    """Insert text in front of a passage that occurs exactly once in a file."""
    text = (project / name).read_text(encoding="utf-8")
    assert text.count(before) == 1, before
    (project / name).write_text(text.replace(before, after + before), encoding="utf-8")


def edited(project: Path) -> set[str]:
    """Return the files of the copy that are new or changed, without results and golden files."""
    result = set()
    for path in project.rglob("*"):
        name = path.relative_to(project)
        if (
            path.is_file()
            and not {"results", "golden", "__pycache__"} & set(name.parts)
            and name != Path("docs/figures.md")
            and name.parts[0][0] != "."
        ):
            start = ROOT / name
            if not start.is_file() or start.read_bytes() != path.read_bytes():
                result.add(str(name))
    return result


KNOWN_VIEW, PAPER, WORKED = (
    "pipeline/studies/walks/known_view.py",
    "conf/paper/zhang2007.yaml",
    "tests/papers/test_papers.py",
)
FIGURE = '''\
"""Error of a walker against the fundamental frequency of the walk."""

from __future__ import annotations

from pipeline.charts import Chart, Sheet
from pipeline.palette import Style
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.study import Figure, Tables
from pipeline.studies.walks.known_view import KnownView, KnownViewErrors

Inputs = FigureInputs[FourierSamples, Eigenwalkers, KnownViewErrors]


class PaceErrors(Figure):
    """Error of a walker against the fundamental frequency of the walk."""

    model = EigenwalkersModel
    sweep = KnownView

    recording: bool = False

    def tables(self, inputs: Inputs) -> Tables:
        """``table``: frequency and error of MAP, mean over views, to each walker."""
        rows = inputs.sweep.rows
        error = rows[rows["method"] == "map"].groupby("walker", sort=False)["absolute_error_mm2"].mean()
        columns = {"walker": inputs.samples, "frequency_hz": inputs.dataset.frequency_hz}
        return {"table": tidy({**columns, "absolute_error_mm2": error[inputs.samples]}, by=["walker"])}

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """A point to each walker."""
        points = Style(line="points")
        return Sheet(charts=[Chart(x="frequency_hz", y="absolute_error_mm2", styles=points)])
'''
PRESET = """\
# @package _global_
# Zhang & Troje 2007, ours: error of each walker against the fundamental frequency.
defaults:
  - override /sweep: known_view
  - override /figure: pace_errors
name: zhang2007_pace
paper: zhang2007
title: Reconstruction errors against the fundamental frequency
expect: Errors do not depend on the frequency.
cost_s: 4
"""
FIGURES, PACE = "pipeline/studies/walks/__init__.py", "pipeline/studies/walks/figures/pace.py"
PACE_PRESET = "conf/experiment/zhang2007_pace.yaml"
FORMATS, POINT_LIST = "pipeline/formats/__init__.py", "pipeline/formats/pointlist.py"
FIXTURE = "tests/fixtures/points_by_hand.pts"


def edit_scalar(project: Path) -> None:
    """Edit the sweep so that it measures one additional number."""
    measured = '"relative_error": errors.walker_error(relative),\n'
    edit(project, KNOWN_VIEW, measured, '"worst_joint_mm2": np.nanmax(of_joints, axis=1),\n' + 20 * " ")


def edit_claim(project: Path) -> None:
    """Add a claim, and its value as calculated by hand, to the files that list them."""
    edit(project, PAPER, BEFORE_CLAIM, CLAIM)
    finite = '    "zhang2007_map_thirty_percent": 50,\n'
    edit(project, WORKED, finite, '    "zhang2007_gain_from_the_front": 62.5,\n')


def edit_reader(project: Path) -> None:
    """Add a reader of a file format, its line in the table of suffixes, and a small example file."""
    (project / POINT_LIST).write_text(textwrap.dedent(READER), encoding="utf-8")
    edit(project, FORMATS, '    ".npz": arrays.read,\n', '    ".pts": pointlist.read,\n')
    text = (project / FORMATS).read_text(encoding="utf-8")
    text = text.replace(", mvnx\n", ", mvnx, pointlist\n")
    (project / FORMATS).write_text(text, encoding="utf-8")
    lines = "100 LKNE RKNE\n" + "".join(f"0 0 {k} 100 0 {k}\n" for k in range(5))
    (project / FIXTURE).write_text(lines, encoding="ascii")


def edit_figure(project: Path) -> None:
    """Add a figure of an existing sweep: its class, preset, and lines in the study and in the paper's list."""
    (project / PACE).write_text(FIGURE, encoding="utf-8")
    (project / PACE_PRESET).write_text(PRESET, encoding="utf-8")
    edit(
        project, FIGURES,
        "from pipeline.studies.walks.figures.postures",
        "from pipeline.studies.walks.figures.pace import PaceErrors\n",
    )  # fmt: skip
    edit(project, FIGURES, '        "postures": Postures,\n', '        "pace_errors": PaceErrors,\n')
    text = (project / PAPER).read_text(encoding="utf-8")
    assert text.count("\nbeyond: [") == 1
    (project / PAPER).write_text(text.replace("\nbeyond: [", "\nbeyond: [zhang2007_pace, "), encoding="utf-8")


BILL = {
    edit_scalar: {KNOWN_VIEW},
    edit_claim: {PAPER, WORKED},
    edit_reader: {FORMATS, POINT_LIST, FIXTURE},
    edit_figure: {PACE, PACE_PRESET, FIGURES, PAPER},
}
"""Names of the files that each edit changes."""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy of the project with all edits: a new column, a claim, a reader and a figure."""
    copy = tmp_path_factory.mktemp("newcomer") / "project"
    copy_tree(ROOT, copy, "results", ".*", "raw", "site")
    (copy / "results").mkdir()
    for table in ("published.csv", "durations.csv"):
        shutil.copy(ROOT / "results" / table, copy / "results")
    for change in BILL:
        change(copy)
    return copy


@pytest.fixture(scope="module")
def folder(project: Path) -> Path:
    """Golden folder of figure 5 of zhang2007 in the copy, after the golden files were renewed."""
    figure, names = "zhang2007_fig5", "zhang2007_fig5,zhang2007_pace"
    tracked = run(
        project, "pipeline", "figures", f"experiment={names}", "scale=smoke", "results=results/golden"
    )
    assert tracked.returncode == 0, tracked.stderr
    renewed = run(project, "tests.contents", "results/golden/synthetic/smoke", *names.split(","))
    assert renewed.returncode == 0, renewed.stderr
    assert "ViewErrors also makes zhang2004_fig4: make golden FIGURE=… renews each" in renewed.stdout
    assert run(project, "pipeline", "readme").returncode == 0  # which lists the figures
    return project / "results" / "golden" / "synthetic" / "smoke" / figure


def test_no_other_file_is_edited(project: Path, folder: Path) -> None:
    assert edited(project) == set().union(*BILL.values())


def test_a_scalar_of_a_sweep_is_named_in_one_file(folder: Path) -> None:
    """The new number is a column of figure 5's table, with an interval, and of its table of walkers."""
    for table, names in (
        ("table", ["worst_joint_mm2", "worst_joint_mm2_low", "worst_joint_mm2_high"]),
        ("table_people", ["worst_joint_mm2"]),
    ):
        with (folder / f"{table}.csv").open(encoding="utf-8") as written:
            columns = written.readline().strip().split(",")
        assert sorted(set(columns) - set(columns_of("zhang2007_fig5")[table])) == sorted(names)


def test_a_claim_is_its_entry_and_its_value_worked_out_in_the_head(folder: Path) -> None:
    assert "zhang2007_gain_from_the_front" in (folder / "claims.csv").read_text(encoding="utf-8")


def test_the_tests_of_each_change_hold(project: Path, folder: Path) -> None:
    """The tests of structure, columns, claims and file readers pass in the copy with all edits."""
    tests = (
        "tests/test_architecture.py",
        "tests/test_documentation.py::test_every_column_of_the_golden_tables_is_listed",
        "tests/studies/walks/test_unmeasured.py",
        "tests/papers/test_papers.py",
        "tests/formats/test_contract.py",
        "tests/cli/test_config.py",
        "tests/studies/test_study.py",
        "tests/test_golden_digits.py",
        "tests/test_pages.py::test_the_result_tables_are_those_of_the_published_numbers",
    )
    only = "[studies.walks or [formats or test_unmeasured or test_contract or gain_from_the_front or pace"
    only += " or test_golden_digits or result_tables"
    only += " or (every and test_papers) or not ([ or test_papers)"
    tracked = run(project, "pytest", "-n", "0", *tests, "-k", only, "-x", "--tb=short")
    assert tracked.returncode == 0, tracked.stdout[-3000:]
