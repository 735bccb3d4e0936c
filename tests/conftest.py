# ruff: noqa: E402 - threads are set before anything is imported
"""Settings of all tests: one BLAS thread, profiles of hypothesis, and figures that are computed once per session."""

from __future__ import annotations

import os

# As `pipeline.__main__` does: before numpy is loaded, or every small solve waits for other threads.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import gc

gc.disable()  # until tests are collected: little of what is loaded and collected is ever let go

import getpass
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis.configuration import set_hypothesis_home_dir

# Imported where it is used: the process that gives out tests to others needs none of it, and they wait for it.
if TYPE_CHECKING:
    from pipeline.cli.summary import Outcome

# A shell starts what runs in its background deaf to SIGINT, and children inherit that: tests that interrupt would wait.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# Failing examples are remembered between runs, but outside of the tree.
set_hypothesis_home_dir(Path(tempfile.gettempdir()) / f"gait-pipeline-hypothesis-{getpass.getuser()}")
# No example fails because the machine is busy.
patient = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("dev", patient, max_examples=25)
settings.register_profile("ci", patient, max_examples=25, derandomize=True, database=None)
settings.register_profile("deep", patient, max_examples=500)  # HYPOTHESIS_PROFILE=deep make test
settings.load_profile(
    os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if os.environ.get("CI") == "true" else "dev")
)

# No number of the second author's average walker is in the project: one that is made up stands for it.
os.environ.setdefault("AVERAGE_WALKER", str(Path(__file__).resolve().parent / "fixtures" / "mm_made_up.mm"))

QUICK = ("scale=smoke", "figure.picture=false", "figure.recording=false")
"""Options that compute only the tables of a figure, from twelve walkers."""

FEW_TRIALS = {
    "park2011_fig3a": ["sweep.trials=15", "sweep.refined=6"],
    "park2011_fig3b": ["sweep.trials=20", "sweep.time_limit_s=0"],
    "park2011_fig3c": ["sweep.trials=8", "sweep.time_limit_s=0", "sweep.adjusts=[global]"],
    "park2011_fig3d": ["sweep.trials=3", "sweep.fractions=[0,0.05,0.3]"],
    "park2011_fig4": ["sweep.clips=3", "sweep.time_limit_s=0"],
    "mozerov2006_fig4": ["sweep.resamples=10", "sweep.measured=500"],
    "mozerov2006_warp_error": ["sweep.smoothness=[0,0.01,0.02,0.1,1,10]"],
    "zhang2007_fig6": ["scale.view_step_deg=30", "sweep.published_views_deg=[-60,0,60]"],
    "zhang2004_fig5": ["scale.view_step_deg=30"],
    "zhang2007_joint_angles": ["sweep.view_angle_deg.step=30"],
    "mozerov2006_tracking": [
        "sweep.particles=[200,500]", "sweep.tracked=5", "sweep.noise_mm=[0]", "sweep.occluded=[0]",
    ],
    "zhang2007_occlusion": ["scale.walkers=16", "sweep.seen_from_deg.step=90", "sweep.partners=2"],
}  # fmt: skip
"""Options that shorten the figures whose claims are tested, by figure: fewer trials, people or particles."""


@dataclass(frozen=True)
class CommandResult:
    """Exit status and printed text of one command."""

    status: int
    out: str
    err: str

    @property
    def result(self) -> str:
        """Standard output without its first line, which announces the setting up."""
        first, _, others = self.out.partition("\n")
        return others if first.startswith("setting up ") else self.out


@pytest.fixture
def say(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., CommandResult]:
    """Function that runs the command line in this process: ``say("experiment=…", …)``."""
    from pipeline.cli import main as command_line

    def say(*arguments: str) -> CommandResult:
        monkeypatch.setattr(sys, "argv", ["pipeline"])
        monkeypatch.setenv("HYDRA_FULL_ERROR", "1")  # which the command line sets; undone after the test
        capsys.readouterr()
        status = command_line.main(list(arguments))
        captured = capsys.readouterr()
        return CommandResult(status, captured.out, captured.err)

    return say


@pytest.fixture
def figure() -> Callable[..., Outcome]:
    """Function that computes one figure without cached stages: ``figure(results, name, *overrides)``."""
    from pipeline.cli.compose import compose
    from pipeline.cli.figures import make_figure
    from pipeline.storage.store import Store

    def figure(results: Path, name: str, *overrides: str, quick: bool = True) -> Outcome:
        inputs = [f"experiment={name}", f"results={results}", *(QUICK if quick else ()), *overrides]
        return make_figure(compose(inputs), results / "figures" / name, store=Store(results))

    return figure


@pytest.fixture(scope="session")
def synthetic_tables(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, np.ndarray]]:
    """Tables of the papers' figures for all synthetic people at coarse steps, by figure and table name.

    Names are ``zhang2007_fig5/table_walkers`` or, for ``table.csv``, the figure's name alone.
    Figures that no claim of a paper rests on are not among them.
    """
    from rich.console import Console

    from pipeline import papers
    from pipeline.cli.compose import compose
    from pipeline.cli.figures import make_figures
    from pipeline.cli.presets import presets
    from pipeline.storage import tables

    results = tmp_path_factory.mktemp("synthetic")
    coarse = [
        "data=synthetic", "scale=full", "scale.view_step_deg=15", "scale.sigma2_step_mm2=23", "scale.populations=2",
        "figure.picture=false", "figure.recording=false", f"results={results}",
    ]  # fmt: skip
    judged = {
        claim.figure
        for paper in papers.all_papers().values()
        for claim in paper.claims
        if claim.measure and claim.kind is not papers.Kind.TARGET
    }
    names = [name for name in presets() if name in judged]
    experiments = [compose([f"experiment={name}", *coarse, *FEW_TRIALS.get(name, ())]) for name in names]
    jobs = [(experiment, results / experiment.name) for experiment in experiments]
    assert make_figures(jobs, console=Console(file=StringIO(), width=200)) == []
    outcome = {}
    for name in names:
        for path in sorted((results / name).glob("table*.csv")):
            outcome[name if path.stem == "table" else f"{name}/{path.stem}"] = tables.read(path)
    return outcome


@pytest.fixture(scope="session")
def smoke_results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results folder with every figure at ``scale=smoke``, computed by one run of the command line."""
    from tests.processes import python

    results = tmp_path_factory.mktemp("smoke")
    command = ["-m", "pipeline", "figures", "scale=smoke", f"results={results}"]
    output = python(*command)
    assert output.returncode == 0, output.stderr
    return results


SHARING = {
    "tests/stages/test_every_preset.py": "smoke_results",
    "tests/stages/test_reuse.py": "smoke_results",
    "tests/studies/actions": "smoke_results",
    "tests/studies/limbs": "smoke_results",
    "tests/claims/test_planted_errors.py": "planted_errors",
    "tests/claims": "synthetic_tables",
}
"""Paths of test modules that share a slow fixture and therefore run in one process; the first matching path counts."""

FIRST = (
    *(path for path, shared in SHARING.items() if shared == "smoke_results"),
    "tests/cli",
    "tests/claims",
    "tests/studies/test_new_paper.py",
    "tests/studies/test_newcomers_bill.py",
    "tests/test_tutorial.py",
)
"""Slow test modules, which run first so that no process has to finish them while the other processes are idle."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Move the tests of the slowest modules to the front, and keep the order of all other tests."""
    rank = {name: number for number, name in enumerate(FIRST)}

    def place(item: pytest.Item) -> int:
        return next((n for name, n in rank.items() if item.nodeid.startswith(name)), len(rank))

    items.sort(key=place)


def pytest_collection_finish() -> None:
    """Exempt the collected tests from garbage collection, which would otherwise scan them repeatedly."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Give each test process whole modules, and give modules that share a fixture to the same process."""
    from xdist.scheduler import LoadFileScheduling

    class BySharedFixture(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            module = super()._split_scope(nodeid)
            return next((shared for path, shared in SHARING.items() if module.startswith(path)), module)

    return BySharedFixture(config, log)


@pytest.fixture(scope="session")
def mocap_mirror() -> Path:
    """Folder of the public recordings. Tests that need it are skipped if ``MOCAP_MIRROR`` is not set."""
    mirror = os.environ.get("MOCAP_MIRROR")
    if not mirror:
        pytest.skip("needs the recordings: set MOCAP_MIRROR")
    return Path(mirror)


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


@pytest.fixture(scope="session")
def browser() -> str:
    """Name of the installed browser. Tests that need a browser are skipped if Chromium is not installed."""
    outcome = next((name for name in BROWSERS if shutil.which(name)), "")
    if not outcome:
        pytest.skip("needs Chromium")
    return outcome
