"""Tests of figures on Dask: identical files, shared stages computed once, lost workers, Ctrl-C, and job scripts."""

from __future__ import annotations

import importlib.util
import os
import re
import signal
import stat
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from rich.console import Console

from pipeline.cli import engine
from pipeline.cli.engine import QUEUES, Launch, job_queue, make, stage_keys
from pipeline.cli.status import Status
from tests.kills import require_tidy, running
from tests.processes import ROOT, WAIT_S, finished, started
from tests.rejects import rejects
from tests.stages.run import smoke

MISSING = [name for name in ("distributed", "dask_jobqueue") if importlib.util.find_spec(name) is None]
needs_dask = pytest.mark.skipif(bool(MISSING), reason=f"missing: {', '.join(MISSING)} (make cluster)")

QUIET = ("scale=smoke", "figure.picture=false", "figure.recording=false", "scale.populations=2")
PLUGIN = """
import functools, os, signal, time
from pathlib import Path
from pipeline.plugins import Plugin
from pipeline.studies.actions.model import ActionSpaceModel
from pipeline.studies.walks.known_view import KnownView
from pipeline.validation import InvalidInput

PLUGIN = Plugin()
HERE = Path(__file__).parent
really = KnownView.measure

@functools.wraps(really)
def measure(self, inputs):
    if not (HERE / "undisturbed").exists():
        try:
            (HERE / "begun").mkdir()
        except FileExistsError:
            pass
        else:
            if (HERE / "kill").exists():
                os.kill(os.getpid(), signal.SIGKILL)
            time.sleep(3600)
    return really(self, inputs)

KnownView.measure = measure
learn = ActionSpaceModel.learn

@functools.wraps(learn)
def rejected(self, dataset, *, workers):
    raise InvalidInput("is rejected by the test", "model", code="test")

ActionSpaceModel.learn = rejected
"""


def figures(results: Path, names: str, *more: str) -> list[str]:
    """Return the command that computes small figures in ``scratch``, with the test's plug-in."""
    command = [
        sys.executable,
        "-m",
        "pipeline",
        "figures",
        f"experiment={names}",
        f"results={results}",
        *QUIET,
    ]
    return [*command, f"plugins={results.parent}/disturbing.py", *more]


def made(results: Path) -> dict[str, bytes]:
    """Return tables and arrays of all figures in ``scratch``, by figure and file."""
    return {
        f"{path.parent.name}/{path.name}": path.read_bytes()
        for path in results.glob("scratch/*/*/*")
        if path.suffix in (".csv", ".npz")
    }


@needs_dask
def test_a_worker_is_lost_a_figure_is_rejected_and_the_others_have_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "disturbing.py").write_text(PLUGIN, encoding="utf-8")
    (tmp_path / "kill").touch()
    names = "zhang2007_fig3,zhang2007_fig5,mozerov2006_fig3"
    done = finished(figures(tmp_path / "dask", names, "workers=2", "launch=dask"))
    assert (tmp_path / "begun").exists(), done.stderr
    assert "was lost; its tasks run again" in done.stdout
    require_tidy(tmp_path / "dask")
    (tmp_path / "undisturbed").touch()
    alone = finished(figures(tmp_path / "alone", names, "workers=2"))
    for each in (done, alone):
        assert each.returncode == 1
        assert each.stderr.splitlines() == ["not made (mozerov2006_fig3): model: is rejected by the test"]
    tables = made(tmp_path / "dask")
    assert tables == made(tmp_path / "alone")
    assert {"zhang2007_fig3/table.csv", "zhang2007_fig5/table_populations.csv"} <= set(tables)


@needs_dask
def test_ctrl_c_ends_all_workers_and_the_same_command_continues(tmp_path: Path) -> None:
    (tmp_path / "disturbing.py").write_text(PLUGIN, encoding="utf-8")
    command = figures(tmp_path / "results", "zhang2007_fig3,zhang2007_fig5", "workers=2")
    with started([*command, "launch=dask"]) as driver:
        ends = time.monotonic() + WAIT_S
        while not (tmp_path / "begun").exists():
            assert driver.poll() is None, driver.communicate()
            assert time.monotonic() < ends
            time.sleep(0.05)
        os.killpg(driver.pid, signal.SIGINT)  # as a terminal does
        _, errors = driver.communicate(timeout=WAIT_S)
        assert driver.returncode == 130, errors
        while running(driver.pid):
            assert time.monotonic() < ends
            time.sleep(0.05)
    assert errors == "interrupted: finished work is kept, and the same command continues from there\n"
    require_tidy(tmp_path / "results")
    (tmp_path / "undisturbed").touch()
    again = finished(command)
    assert again.returncode == 0, again.stderr
    assert "zhang2007_fig5/table_populations.csv" in made(tmp_path / "results")
    assert len(list(tmp_path.glob("results/cache/ingest-*"))) == 1, "the stage that was finished is kept"


def test_stages_that_figures_share_have_the_same_keys(tmp_path: Path) -> None:
    names = ("zhang2007_fig2", "zhang2007_fig3", "zhang2007_fig5", "zhang2004_fig2", "mozerov2006_fig3")
    more = ("scale.populations=2", f"results={tmp_path}")
    keys = {name: stage_keys(smoke(name, *more)) for name in names}

    def shared(first: str, second: str) -> list[str]:
        return [stage for stage, key in keys[first].items() if key in keys[second].values()]

    assert shared("zhang2007_fig3", "zhang2007_fig5") == [
        "ingest", "dataset", "model", "sweep", "population", "population_sweep"
    ]  # fmt: skip
    assert shared("zhang2007_fig2", "zhang2007_fig5") == ["ingest", "dataset", "model", "population"]
    assert shared("zhang2004_fig2", "zhang2007_fig2") == ["ingest", "population"]
    assert shared("mozerov2006_fig3", "zhang2007_fig5") == []
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "where"),
    [
        (["launch=cloud"], "unknown_choice", "launch"),
        (["launch=slurm", "launch.cores=0"], "out_of_range", "launch.cores"),
        (["launch=slurm", "launch.nodes=2"], "unknown_option", "launch.nodes"),
    ],
)
def test_unknown_engines_and_options_are_rejected(arguments: list[str], code: str, where: str) -> None:
    with rejects(code, where):
        make([], arguments, console=Console(quiet=True))


def test_current_figures_start_no_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        engine, "status", lambda experiment, folder: Status(experiment.name, "current", "", ())
    )
    console = Console(record=True)
    jobs = [(smoke("zhang2007_fig2", f"results={tmp_path}"), tmp_path / "zhang2007_fig2")]
    assert make(jobs, ["launch=dask"], console=console) == []
    assert "1 figures are current" in console.export_text()


@needs_dask
def test_a_scheduler_that_does_not_answer_and_a_batch_system_that_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import dask
    import dask_jobqueue  # noqa: F401 - its defaults are read before others are set

    jobs = [(smoke("zhang2007_fig2", f"results={tmp_path}"), tmp_path / "zhang2007_fig2")]
    console = Console(quiet=True)
    monkeypatch.setenv("PATH", "")
    with dask.config.set({"distributed.comm.timeouts.connect": "0.2s", "jobqueue.slurm.interface": "lo"}):
        with rejects("no_cluster", "tcp://127.0.0.1:9"):
            make(jobs, ["launch=dask", "launch.scheduler=tcp://127.0.0.1:9"], console=console)
        with rejects("no_cluster", "slurm"):
            make(jobs, ["launch=slurm"], console=console)
    with rejects("unsafe_path", "results"):
        make([(jobs[0][0], tmp_path / "with space" / "figure")], ["launch=slurm"], console=console)
    require_tidy(tmp_path)


@needs_dask
def test_workers_whose_versions_differ_are_rejected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import Client

    observed = iter(["1.0", "2.0"])
    monkeypatch.setattr(engine, "versions", lambda packages: {"numpy": next(observed)})
    monkeypatch.chdir(tmp_path)
    cluster = Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0")
    with cluster as client, rejects("worker_differs") as caught:
        engine._prepare_workers(client, [])
    assert "numpy 2.0, not 1.0" in str(caught.value)


SCRIPTS = ROOT / "tests" / "fixtures" / "jobs"


@needs_dask
@pytest.mark.parametrize("name", QUEUES)
def test_job_scripts_are_the_kept_ones(name: str, tmp_path: Path) -> None:
    """The job scripts equal the stored ones; the test writes them anew if KEEP_JOB_SCRIPTS=1 is set."""
    import dask
    import dask_jobqueue  # noqa: F401 - its defaults are read before others are set

    extra = ["Requirements=Memory > 2"] if name == "htcondor" else ["--exclusive"]
    options = Launch(
        queue="short", account="gait", cores=4, memory_gb=8, walltime="01:30", extra=extra, tls=False
    )
    config = {f"jobqueue.{name}.interface": "lo", "jobqueue.lsf.lsf-units": "mb",
             "jobqueue.oar.memory-per-core-property-name": "mem_core"}  # fmt: skip
    with dask.config.set(config), ExitStack() as stack:
        script = stack.enter_context(job_queue(name, options, tmp_path, stack, "127.0.0.1:0")).job_script()
    for path, word in ((str(tmp_path), "LOGS"), (sys.executable, "PYTHON"), (str(ROOT), "CHECKOUT")):
        script = script.replace(path, word)
    script = re.sub(r"tcp://127\.0\.0\.1:\d+", "SCHEDULER", script)
    expected = SCRIPTS / f"{name}.sh"
    if os.environ.get("KEEP_JOB_SCRIPTS"):
        expected.write_text(script, encoding="utf-8")
    assert script == expected.read_text(encoding="utf-8")


@needs_dask
def test_job_queues_leave_ctrl_c_to_the_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "dask_jobqueue", raising=False)
    monkeypatch.delitem(sys.modules, "dask_jobqueue.runner", raising=False)
    before = signal.getsignal(signal.SIGINT)
    with rejects("unsafe_path"), ExitStack() as stack:
        job_queue("slurm", Launch(), tmp_path / "with space", stack, "127.0.0.1:0")
    assert signal.getsignal(signal.SIGINT) is before


@needs_dask
def test_certificates_are_for_the_user_alone_and_gone_afterwards(tmp_path: Path) -> None:
    import dask
    import dask_jobqueue  # noqa: F401 - its defaults are read before others are set

    with dask.config.set({"jobqueue.slurm.interface": "lo"}):
        with ExitStack() as stack:
            script = stack.enter_context(
                job_queue("slurm", Launch(), tmp_path, stack, "127.0.0.1:0")
            ).job_script()
            (folder,) = tmp_path.glob(".tls-*")
            assert stat.S_IMODE(folder.stat().st_mode) == 0o700
            assert {stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()} == {0o600}
            files = re.findall(r"--tls-(?:ca-file|cert|key) (\S+)", script)
            assert {Path(file) for file in files} == set(folder.iterdir())
            assert re.search(r"dask_worker tls://", script)
        assert list(tmp_path.iterdir()) == []
