"""Figures as jobs of a real Slurm: two nodes on this machine, one of them killed; jobs lost, left, cancelled.

Needs Debian's packages slurmctld, slurmd, slurm-client and munge, and submitit (`make test-cluster`).
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pipeline.cli.status import jobs_of, states
from tests.kills import require_tidy, require_whole, tables
from tests.processes import ROOT, WAIT_S, finished, started

MISSING = [
    *(name for name in ("slurmctld", "slurmd", "sbatch", "munged") if not shutil.which(name)),
    *(["submitit"] if importlib.util.find_spec("submitit") is None else []),
    # When a node is missed depends on how busy the machine is, so that these are asked for by name.
    *([] if os.environ.get("TEST_CLUSTER") else ["TEST_CLUSTER in the environment, as by make test-cluster"]),
]
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(bool(MISSING), reason=f"missing: {', '.join(MISSING)}"),
]
FIGURES = "zhang2007_fig2,zhang2007_fig3,zhang2007_fig5,mozerov2006_fig3"
SMOKE = ["-m", "pipeline", "figures", f"experiment={FIGURES}", "scale=smoke"]
SLURM = ["launch=slurm", "launch.task_s=3", "launch.cores=2", "launch.memory_gb=1"]


@pytest.fixture(scope="module")
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of a Slurm that runs; commands find it by their environment."""
    folder = tmp_path_factory.mktemp("slurm")
    script = str(ROOT / "tests" / "cluster" / "slurm_up.sh")
    up = subprocess.run([script, str(folder)], check=False, capture_output=True, text=True, timeout=WAIT_S)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SLURM_CONF", str(folder / "slurm.conf"))
        try:
            assert up.returncode == 0, up.stderr
            yield folder
        finally:
            subprocess.run(["scancel", "--me", "--signal=KILL"], check=False, timeout=WAIT_S)
            subprocess.run([script, str(folder), "down"], check=False, timeout=WAIT_S)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Tables and arrays of the figures, made on this machine."""
    results = tmp_path_factory.mktemp("here")
    done = finished([sys.executable, *SMOKE, "workers=2", f"results={results}"])
    assert done.returncode == 0, done.stderr
    return tables(results)


def wait_for(what: str, seen: Callable[[], object], driver: subprocess.Popen[str] | None = None) -> None:
    """Wait until a function returns something true, while a process goes on."""
    ends = time.monotonic() + WAIT_S
    while not seen():
        assert driver is None or driver.poll() is None, (what, driver.communicate())
        assert time.monotonic() < ends, what
        time.sleep(0.2)


def running(*more: str) -> list[str]:
    """Numbers of jobs that run, or of those that `squeue` shows otherwise."""
    command = ["squeue", "--me", "-h", "-o", "%i", *(more or ("-t", "RUNNING"))]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=WAIT_S).stdout.split()


def tree(pid: int) -> list[int]:
    """A process and all below it."""
    listed = subprocess.run(
        ["ps", "-e", "-o", "pid=,ppid="], check=True, capture_output=True, text=True
    ).stdout
    parents = {int(child): int(parent) for child, parent in map(str.split, listed.splitlines())}
    result = [pid]
    for first in result:
        result += [child for child, parent in parents.items() if parent == first]
    return result


def kill_node(folder: Path, name: str) -> None:
    """End a node as a power cut does: its daemon, the keepers of its jobs, and all that they started."""
    keepers = subprocess.run(
        ["pgrep", "-f", "slurmstepd"], check=False, capture_output=True, text=True
    ).stdout.split()
    pids = [int((folder / f"{name}.pid").read_text())]
    for keeper in map(int, keepers):
        environment = Path(f"/proc/{keeper}/cmdline").read_bytes().decode()
        numbers = {part for word in environment.split() for part in word.strip("[]\0").split(".")}
        if numbers & set(running("-w", name)):
            pids += tree(keeper)
    for pid in pids:
        os.kill(pid, signal.SIGKILL)


def test_a_node_dies_a_job_is_lost_and_the_tables_are_the_same_bytes(
    slurm: Path, undisturbed: dict[str, bytes], tmp_path: Path
) -> None:
    results = tmp_path / "results"
    command = [sys.executable, *SMOKE, *SLURM, f"results={results}"]
    with started(command) as driver:
        wait_for("a job on the second node", lambda: running("-t", "RUNNING", "-w", "n2"), driver)
        kill_node(slurm, "n2")
        wait_for("the node is down", lambda: "n2" in down_nodes(), driver)
        lost = running()[:1] or running("-t", "PENDING")[:1]
        subprocess.run(["scancel", "--signal=KILL", "--full", *lost], check=True, timeout=WAIT_S)
        out, err = driver.communicate(timeout=WAIT_S)
    assert driver.returncode == 0, (out, err)
    assert tables(results) == undisturbed
    assert list(results.glob("synthetic/smoke/jobs/sweep_*")), "a shared sweep is among them"
    shutil.rmtree(results / "synthetic" / "smoke" / "jobs")  # the only folder that is not a figure's
    require_whole(results)
    require_tidy(results)
    subprocess.run(["slurmd", "-N", "n2"], check=True, timeout=WAIT_S)


def down_nodes() -> list[str]:
    """Nodes that Slurm has given up."""
    command = ["sinfo", "-h", "-N", "-o", "%N %T"]
    message = subprocess.run(command, check=True, capture_output=True, text=True, timeout=WAIT_S).stdout
    return [line.split()[0] for line in message.splitlines() if line.split()[1].startswith("down")]


def interrupted(results: Path, *more: str) -> tuple[str, str, int]:
    """Interrupt the submitting command when a job runs; return its output, its errors and its exit status."""
    with started([sys.executable, *SMOKE, *SLURM, f"results={results}", *more]) as driver:
        wait_for("a job runs", running, driver)
        driver.send_signal(signal.SIGINT)
        out, err = driver.communicate(timeout=WAIT_S)
        return out, err, driver.returncode


def test_jobs_that_ctrl_c_leaves_are_found_again(slurm: Path, tmp_path: Path) -> None:
    out, err, code = interrupted(tmp_path)
    assert code == 130, (out, err)
    assert "jobs continue" in out
    left = set(states() or {})
    assert left
    displayed = finished([sys.executable, "-m", "pipeline", "status", "scale=smoke", f"results={tmp_path}"])
    assert any(word in displayed.stdout for word in ("queued", "running")), displayed.stdout
    command = [sys.executable, *SMOKE, *SLURM, f"results={tmp_path}"]
    again = finished(command)
    assert again.returncode == 0, again.stderr
    finite = jobs_of(tmp_path / "synthetic" / "smoke")
    submitted = {path.name.split("_")[0] for path in tmp_path.glob("synthetic/smoke/jobs/*/*_submitted.pkl")}
    assert len(submitted) == len(finite), "a job that was left was submitted twice"
    once_more = finished(command)
    assert "4 figures are current" in once_more.stdout


def test_jobs_that_ctrl_c_cancels_are_gone(slurm: Path, tmp_path: Path) -> None:
    out, _, code = interrupted(tmp_path, "launch.interrupt=cancel")
    assert code == 130
    assert "jobs are cancelled" in out
    wait_for("no job is left", lambda: not (states() or {}))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("launch.partition=nowhere", "partition"),
        ("launch.cores=0", "launch.cores"),
        ("launch.nodes=2", "launch.nodes"),
        ("launch=pbs", "slurm"),
    ],
)
def test_what_cannot_be_launched_is_refused_in_a_sentence(
    slurm: Path, tmp_path: Path, given: str, words: str
) -> None:
    done = finished([sys.executable, *SMOKE, *SLURM, given, f"results={tmp_path}"])
    assert done.returncode == 1
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert states() == {}
