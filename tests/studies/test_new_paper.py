"""Test of adding a paper with one figure: it needs five new files and a change of the registry."""

from __future__ import annotations

import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from tests.processes import WAIT_S, copy_tree

ROOT = Path(__file__).resolve().parents[2]

FILES = {
    "conf/paper/pace2030.yaml": """\
        # pace2030: a paper that does not exist.
        title: Pace and the Size of a Walk
        authors: Anna Novak
        year: 2030
        venue: nowhere
        figures: [pace2030_fig1]
        clips: walks
        page:
          figure: pace2030_fig1
          question: Do quick people walk large?
          sentences: [Quick people walk large., It is the first harmonic., The second adds little.]
        equations: []
        claims: {}
        """,
    "conf/experiment/pace2030_fig1.yaml": """\
        # @package _global_
        # Novak 2030, figure 1: size of the fundamental against its frequency.
        defaults:
          - override /figure: pace
        name: pace2030_fig1
        paper: pace2030
        title: Size of the fundamental against its frequency
        expect: Quick people walk large.
        cost_s: 1
        """,
    "pipeline/studies/pace/__init__.py": """\
        \"\"\"Pace and size of walks: pace2030.\"\"\"

        from pipeline.studies.pace.figure import Pace
        from pipeline.studies.study import Study

        STUDY = Study("pace", figures={"pace": Pace})
        """,
    "pipeline/studies/pace/figure.py": """\
        \"\"\"Size of the fundamental against its frequency: pace2030 figure 1.\"\"\"

        from __future__ import annotations

        from typing import Any

        import numpy as np
        import pandas as pd

        from pipeline.charts import Chart, Sheet
        from pipeline.palette import Style
        from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
        from pipeline.studies.eigenwalkers.samples import FourierSamples
        from pipeline.studies.figure_inputs import FigureInputs, tidy
        from pipeline.studies.study import Figure, NoResult


        class Pace(Figure):
            \"\"\"Size of the fundamental against its frequency.\"\"\"

            model = EigenwalkersModel

            recording: bool = False

            def tables(
                self, inputs: FigureInputs[FourierSamples, Eigenwalkers, NoResult]
            ) -> dict[str, pd.DataFrame]:
                \"\"\"Return ``table``: frequency and root mean square of the fundamental, to each walker.\"\"\"
                data = inputs.dataset
                size = np.sqrt((data.coefficients[:, 1:3] ** 2).sum(axis=(1, 3)).mean(axis=1))
                columns = {"walker": inputs.samples, "frequency_hz": data.frequency_hz, "size_mm": size}
                return {"table": tidy(columns, by=["walker"])}

            def charts(self, inputs: Any, tables: dict[str, pd.DataFrame]) -> Sheet:
                \"\"\"A point to each walker.\"\"\"
                return Sheet(charts=[Chart(x="frequency_hz", y="size_mm", styles=Style(line="points"))])
        """,
}
REGISTRY = "pipeline/studies/registry.py"


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy of the project to which a paper with one figure is added."""
    copy = tmp_path_factory.mktemp("fifth") / "project"
    copy_tree(ROOT, copy, "results", ".*", "raw")
    (copy / "results").mkdir()
    for table in ("published.csv", "durations.csv"):
        shutil.copy(ROOT / "results" / table, copy / "results")
    for name, text in FILES.items():
        (copy / name).parent.mkdir(exist_ok=True)
        (copy / name).write_text(textwrap.dedent(text), encoding="utf-8")
    lines = (copy / REGISTRY).read_text(encoding="utf-8")
    for before, after in (
        ("measures, walks", "measures, pace, walks"),
        ("limbs.STUDY)", "limbs.STUDY, pace.STUDY)"),
    ):
        assert before in lines
        lines = lines.replace(before, after)
    (copy / REGISTRY).write_text(lines, encoding="utf-8")
    figure = ["experiment=pace2030_fig1", "scale=smoke", "results=made"]
    assert run(copy, "pipeline", *figure).returncode == 0
    output = ["made/synthetic/smoke", "pace2030_fig1"]
    assert run(copy, "tests.contents", *output).returncode == 0
    return copy


def run(project: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a Python module in the copy of the project, and return the finished process."""
    return subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=project,
        capture_output=True,
        text=True,
        check=False,
        timeout=WAIT_S,
    )


@pytest.mark.thorough
def test_the_figure_is_made_and_shown(project: Path) -> None:
    where = ["results=made", "scale=smoke"]
    assert "frequency_hz" in (project / "tests" / "golden" / "pace2030_fig1.csv").read_text(encoding="utf-8")
    message = run(project, "pipeline", "status", "experiment=pace2030_fig1", *where)
    assert "1 current" in message.stdout, message.stdout + message.stderr
    message = run(project, "pipeline", "report", *where)
    assert message.returncode == 0, message.stderr
    assert (project / "made" / "synthetic" / "smoke" / "pace2030_fig1" / "figure.svg").is_file()
    page = (project / "made" / "synthetic" / "smoke" / "index.html").read_text(encoding="utf-8")
    assert "Quick people walk large." in page


@pytest.mark.thorough
def test_the_tests_hold_with_a_new_paper(project: Path) -> None:
    """The tests of structure, options, papers and the report page pass in the copy with the new paper.

    Nor of skeletons, of slips of the pen, of odd tables and of pages that are too large, which are the same with any
    paper.
    """
    tests = (
        "tests/test_architecture.py",
        "tests/cli/test_config.py",
        "tests/cli/test_side_by_side.py::test_figures_are_begun_by_paper_and_short_before_long",
        "tests/papers",
        "tests/report/test_page.py",
        "tests/studies/test_study.py",
    )
    others = "zhang2004_ or zhang2007_ or park2011_ or mozerov2006_ or keypoints_ or skeleton or slip"
    others += " or odd_tables or too_large"
    others += "".join(f" or [{path.stem}" for path in (ROOT / "pipeline").iterdir() if path.stem != "studies")
    tracked = run(project, "pytest", *tests, "-k", f"not ({others})", "-x", "--tb=short")
    assert tracked.returncode == 0, tracked.stdout[-3000:]
