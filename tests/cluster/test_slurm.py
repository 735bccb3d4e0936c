"""Tests of figures computed in Slurm jobs on two local nodes, with a killed node and a cancelled job.

Needs Debian's packages slurmctld, slurmd, slurm-client and munge (`make test-cluster`).
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

from tests.kills import require_tidy, require_whole, tables
from tests.processes import ROOT, WAIT_S, finished, started

MISSING = [
    *(name for name in ("slurmctld", "slurmd", "sbatch", "munged") if not shutil.which(name)),
    *(["dask-jobqueue"] if importlib.util.find_spec("dask_jobqueue") is None else []),
    # When a node is missed depends on how busy the machine is, so that these are asked for by name.
    *([] if os.environ.get("TEST_CLUSTER") else ["TEST_CLUSTER in the environment, as by make test-cluster"]),
]
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(bool(MISSING), reason=f"missing: {', '.join(MISSING)}"),
]
FIGURES = "zhang2007_fig2,zhang2007_fig3,zhang2007_fig5,mozerov2006_fig3"
SMOKE = ["-m", "pipeline", "figures", f"experiment={FIGURES}", "scale=smoke"]
SLURM = ["launch=slurm", "launch.jobs=2", "launch.cores=2"]  # each job fills a node


@pytest.fixture(scope="module")
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Folder of a running Slurm, which commands find through environment variables."""
    folder = tmp_path_factory.mktemp("slurm")
    script = str(ROOT / "tests" / "cluster" / "slurm_up.sh")
    up = subprocess.run([script, str(folder)], check=False, capture_output=True, text=True, timeout=WAIT_S)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SLURM_CONF", str(folder / "slurm.conf"))
        patch.setenv("DASK_JOBQUEUE__SLURM__INTERFACE", "lo")
        try:
            assert up.returncode == 0, up.stderr
            yield folder
        finally:
            subprocess.run(["scancel", "--me", "--signal=KILL"], check=False, timeout=WAIT_S)
            subprocess.run([script, str(folder), "down"], check=False, timeout=WAIT_S)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Tables and arrays of the figures, computed on this machine without Slurm."""
    results = tmp_path_factory.mktemp("here")
    done = finished([sys.executable, *SMOKE, "workers=2", f"results={results}"])
    assert done.returncode == 0, done.stderr
    return tables(results)


def wait_for(what: str, seen: Callable[[], object], driver: subprocess.Popen[str] | None = None) -> None:
    """Wait until a function returns a true value, while a given process must keep running."""
    ends = time.monotonic() + WAIT_S
    while not seen():
        assert driver is None or driver.poll() is None, (what, driver.communicate())
        assert time.monotonic() < ends, what
        time.sleep(0.2)


def running(*more: str) -> list[str]:
    """Return the numbers of the running Slurm jobs, or of the jobs selected by other options of `squeue`."""
    command = ["squeue", "--me", "-h", "-o", "%i", *(more or ("-t", "RUNNING"))]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=WAIT_S).stdout.split()


def tree(pid: int) -> list[int]:
    """Return the numbers of a process and of all its descendants."""
    listed = subprocess.run(
        ["ps", "-e", "-o", "pid=,ppid="], check=True, capture_output=True, text=True
    ).stdout
    parents = {int(child): int(parent) for child, parent in map(str.split, listed.splitlines())}
    result = [pid]
    for first in result:
        result += [child for child, parent in parents.items() if parent == first]
    return result


def kill_node(folder: Path, name: str) -> None:
    """Kill a node as a power failure would: its daemon, the job managers of its jobs, and all their child processes."""
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
        wait_for("an artefact", lambda: list(results.glob("cache/[!.]*/manifest.json")), driver)
        wait_for("a job on each node", lambda: running("-w", "n1") and running("-w", "n2"), driver)
        kill_node(slurm, "n2")
        subprocess.run(
            ["scancel", "--signal=KILL", "--full", *running("-w", "n1")], check=True, timeout=WAIT_S
        )
        out, err = driver.communicate(timeout=WAIT_S)
    assert driver.returncode == 0, (out, err)
    assert "was lost; its tasks run again" in out
    assert tables(results) == undisturbed
    logs = results / "synthetic" / "smoke" / "jobs"
    assert len(list(logs.glob("*.err"))) >= 3, "a third job took over"
    shutil.rmtree(logs)  # the only folder that is not a figure's
    require_whole(results)
    require_tidy(results)
    wait_for("no job is left", lambda: not running("-w", "n1"))
    wait_for("the node is down", lambda: "n2" in down_nodes())
    subprocess.run(["slurmd", "-N", "n2"], check=True, timeout=WAIT_S)
    wait_for("the node is up", lambda: "n2" not in down_nodes())


def down_nodes() -> list[str]:
    """Return the nodes that Slurm reports as down."""
    command = ["sinfo", "-h", "-N", "-o", "%N %T"]
    message = subprocess.run(command, check=True, capture_output=True, text=True, timeout=WAIT_S).stdout
    return [line.split()[0] for line in message.splitlines() if line.split()[1].startswith("down")]


def test_ctrl_c_ends_the_jobs_and_the_same_command_continues(
    slurm: Path, undisturbed: dict[str, bytes], tmp_path: Path
) -> None:
    command = [sys.executable, *SMOKE, *SLURM, f"results={tmp_path}"]
    with started(command) as driver:
        wait_for("an artefact", lambda: list(tmp_path.glob("cache/[!.]*/manifest.json")), driver)
        driver.send_signal(signal.SIGINT)
        out, err = driver.communicate(timeout=WAIT_S)
    assert driver.returncode == 130, (out, err)
    wait_for("no job is left", lambda: not running("-t", "PENDING,RUNNING,COMPLETING"))
    assert list(tmp_path.glob("synthetic/smoke/jobs/.tls-*")) == []
    again = finished(command)
    assert again.returncode == 0, again.stderr
    assert tables(tmp_path) == undisturbed
    assert "4 figures are current" in finished(command).stdout


def test_a_job_that_slurm_rejects_is_one_sentence(slurm: Path, tmp_path: Path) -> None:
    done = finished([sys.executable, *SMOKE, *SLURM, "launch.queue=nowhere", f"results={tmp_path}"])
    assert done.returncode == 1
    assert done.stderr.startswith("slurm: the Dask cluster cannot be used")
    assert "partition" in done.stderr
    assert len(done.stderr.splitlines()) == 1
