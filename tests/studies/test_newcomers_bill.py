"""What a newcomer edits, done on a copy: a scalar of a sweep, a claim, a reader.  A paper is in `test_new_paper`.

All three are edited in one copy, in turn, before its figure is made and its tests run once.
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
        raise damaged("a point list has names, and a line to each frame", where)
    try:
        positions = np.array([line.split() for line in lines], dtype=float).reshape(len(lines), len(names), 3)
        return motion_capture(
            names, positions * millimetres_in(units or "mm", where), float(rate), units or "mm", []
        )
    except ValueError as error:
        raise damaged("this is no point list", where, received=str(error)) from None
'''


def edit(project: Path, name: str, before: str, after: str) -> None:
    """Put text in front of what stands once in a file."""
    text = (project / name).read_text(encoding="utf-8")
    assert text.count(before) == 1, before
    (project / name).write_text(text.replace(before, after + before), encoding="utf-8")


def edited(project: Path) -> set[str]:
    """Files of the copy that are new or not as they were, but for results and golden files."""
    found = set()
    for path in project.rglob("*"):
        name = path.relative_to(project)
        if (
            path.is_file()
            and not {"results", "golden", "__pycache__"} & set(name.parts)
            and name.parts[0][0] != "."
        ):
            here = ROOT / name
            if not here.is_file() or here.read_bytes() != path.read_bytes():
                found.add(str(name))
    return found


KNOWN_VIEW, PAPER, WORKED = (
    "pipeline/studies/walks/known_view.py",
    "conf/paper/zhang2007.yaml",
    "tests/papers/test_papers.py",
)
FORMATS, POINT_LIST = "pipeline/formats/__init__.py", "pipeline/formats/pointlist.py"
FIXTURE = "tests/fixtures/points_by_hand.pts"


def edit_scalar(project: Path) -> None:
    """Have the sweep measure one scalar more."""
    measured = '"relative_error": errors.walker_error(relative),\n'
    edit(project, KNOWN_VIEW, measured, '"worst_joint_mm2": np.nanmax(of_joints, axis=1),\n' + 20 * " ")


def edit_claim(project: Path) -> None:
    """Enter a claim, and its value worked out in the head."""
    edit(project, PAPER, BEFORE_CLAIM, CLAIM)
    known = '    "zhang2007_map_thirty_percent": 50,\n'
    edit(project, WORKED, known, '    "zhang2007_gain_from_the_front": 62.5,\n')


def edit_reader(project: Path) -> None:
    """Write a reader, its line in the table of suffixes, and a small file."""
    (project / POINT_LIST).write_text(textwrap.dedent(READER), encoding="utf-8")
    edit(project, FORMATS, '    ".npz": arrays.read,\n', '    ".pts": pointlist.read,\n')
    text = (project / FORMATS).read_text(encoding="utf-8")
    text = text.replace("bvh, c3d, mvnx\n", "bvh, c3d, mvnx, pointlist\n")
    (project / FORMATS).write_text(text, encoding="utf-8")
    lines = "100 LKNE RKNE\n" + "".join(f"0 0 {k} 100 0 {k}\n" for k in range(5))
    (project / FIXTURE).write_text(lines, encoding="ascii")


BILL = {
    edit_scalar: {KNOWN_VIEW},
    edit_claim: {PAPER, WORKED},
    edit_reader: {FORMATS, POINT_LIST, FIXTURE},
}
"""What each edit touches, and nothing else."""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project with all three."""
    copy = tmp_path_factory.mktemp("newcomer") / "project"
    copy_tree(ROOT, copy, "results", ".*", "raw", "site")
    (copy / "results").mkdir()
    shutil.copy(ROOT / "results" / "published.csv", copy / "results")
    for change in BILL:
        change(copy)
    return copy


@pytest.fixture(scope="module")
def folder(project: Path) -> Path:
    """Figure 5 of the copy, whose golden files are renewed."""
    figure = "zhang2007_fig5"
    made = run(
        project, "pipeline", "figures", f"experiment={figure}", "scale=smoke", "results=results/golden"
    )
    assert made.returncode == 0, made.stderr
    renewed = run(project, "tests.contents", "results/golden/synthetic/smoke", figure)
    assert renewed.returncode == 0, renewed.stderr
    return project / "results" / "golden" / "synthetic" / "smoke" / figure


def test_no_other_file_is_edited(project: Path, folder: Path) -> None:
    assert edited(project) == set().union(*BILL.values())


def test_a_scalar_of_a_sweep_is_named_in_one_file(folder: Path) -> None:
    """It is then a column of figure 5's table, with its interval, and of the table of every walker."""
    for table, names in (
        ("table", ["worst_joint_mm2", "worst_joint_mm2_low", "worst_joint_mm2_high"]),
        ("table_people", ["worst_joint_mm2"]),
    ):
        with (folder / f"{table}.csv").open(encoding="utf-8") as written:
            columns = written.readline().strip().split(",")
        assert sorted(set(columns) - set(columns_of("zhang2007_fig5")[table])) == sorted(names)


def test_a_claim_is_its_entry_and_its_value_worked_out_in_the_head(folder: Path) -> None:
    assert "zhang2007_gain_from_the_front" in (folder / "claims.csv").read_text(encoding="utf-8")


def test_the_tests_of_scalar_claim_and_reader_hold(project: Path, folder: Path) -> None:
    """Those of structure, columns, claims and the contract of readers; not again of each module as it was."""
    tests = (
        "tests/test_architecture.py",
        "tests/test_documentation.py::test_every_column_of_the_golden_tables_is_listed",
        "tests/studies/walks/test_unmeasured.py",
        "tests/papers/test_papers.py",
        "tests/formats/test_contract.py",
    )
    only = "[studies.walks or [formats or test_unmeasured or test_contract or gain_from_the_front"
    only += " or (every and test_papers) or not ([ or test_papers)"
    found = run(project, "pytest", "-n", "0", *tests, "-k", only, "-x", "--tb=short")
    assert found.returncode == 0, found.stdout[-3000:]
