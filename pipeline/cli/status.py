"""Status of figures (current, stale or missing), without computing, and the cluster jobs that make them."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pipeline.stages import chain
from pipeline.stages.sources import figure_code
from pipeline.storage.sealed_folders import FIGURE, canonical, complaints_about, read_manifest, visible
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment

CURRENT, STALE, MISSING = "current", "stale", "missing"
_STYLES = {CURRENT: "green", STALE: "yellow", MISSING: "red"}

JOBS = "jobs"
"""Name of the folder for scripts and logs of cluster jobs, next to the figures."""
_SUBMITTED = "_submitted.pkl"

QUEUED, RUNNING, ENDED = "queued", "running", "ended"
"""States of a cluster job."""


@dataclass(frozen=True)
class Status:
    """Status of a published figure compared with its experiment.

    Attributes
    ----------
    figure, state : str
        Name of the figure, and ``current``, ``stale`` or ``missing``.
    why : str
        Option, input or source that changed; empty if the figure is current.
    to_compute : tuple of str
        Stages that are not in the cache.
    """

    figure: str
    state: str
    why: str
    to_compute: tuple[str, ...]


@dataclass(frozen=True)
class Job:
    """Latest cluster job of a task.

    Attributes
    ----------
    number : str
    state : str
        ``queued``, ``running`` or ``ended``.
    log : Path or None
        Log of errors, if the job has started.
    """

    number: str
    state: str
    log: Path | None = None

    def describe(self, *, current: bool) -> str:
        """Return the job in words; an ended job has failed if its figure is not current."""
        state = "failed" if self.state == ENDED and not current else self.state
        return f"{state} {self.number}" + (f", {self.log}" if self.log else "")


def status(experiment: Experiment, folder: Path) -> Status:
    """Return the status of a published figure; stages are compared by content, the figure by options and sources.

    Raises
    ------
    InvalidInput
        If the data set has no clips for the experiment, or an option cannot be stored.
    """
    complaints = (
        complaints_about(folder, hashes=False, needed=FIGURE) if folder.is_dir() else ["not made yet"]
    )
    manifest = {} if complaints else read_manifest(folder)
    before = {
        name: (stage["key"], stage.get("content", "")) for name, stage in manifest.get("stages", {}).items()
    }
    store = Store(Path(experiment.results), dry_run=True, before=before)
    artefacts = [result.artefact for result in chain.run(experiment, store)]
    changed = [a for a in artefacts if not a.content or a.content != before.get(a.stage, ("", ""))[1]]
    state, why = STALE, ""
    if complaints:
        state, why = MISSING, complaints[0]
    elif changed:  # the first changed stage explains the later ones
        why = f"{changed[0].stage}: {changed[0].why}"
    elif manifest["configuration"].get("figure") != canonical(experiment.figure):
        why = "figure: options changed"
    elif not manifest.get("code"):
        why = "figure: further populations are missing"
    elif manifest["code"] != figure_code(experiment):
        why = "figure: code changed"
    else:
        state = CURRENT
    return Status(experiment.name, state, why, tuple(a.stage for a in artefacts if a.computed))


def print_status(figures: Sequence[Status], console: Console, results: Path | None) -> None:
    """Print a row for each figure, with its cluster job if `results` has jobs, and the jobs of shared stages below."""
    jobs = jobs_of(results) if results else {}
    table = Table(box=None, pad_edge=False)
    for heading in ("figure", "state", "to compute", "why", *(["job"] if jobs else [])):
        table.add_column(heading, overflow="fold")
    for each in figures:
        state = Text(each.state, style=_STYLES[each.state])
        job = jobs.pop(each.figure, None)
        cells = [job.describe(current=each.state == CURRENT)] if job else []
        table.add_row(each.figure, state, " ".join(each.to_compute) or "-", each.why, *cells)
    console.print(table)
    for name in sorted(jobs):
        if jobs[name].state != ENDED:
            console.print(Text(f"{name}: {jobs[name].describe(current=True)}"), soft_wrap=True)
    counts = {state: sum(each.state == state for each in figures) for state in _STYLES}
    console.print(", ".join(f"{count} {state}" for state, count in counts.items()) + "; nothing was computed")


def states() -> dict[str, str] | None:
    """Return the Slurm state of each queued or running job of this user; None if Slurm does not answer."""
    command = ["squeue", "--me", "-h", "-o", "%i %T"]
    try:
        listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    return dict(line.split(" ", 1) for line in listing.splitlines() if " " in line)


def latest(folder: Path) -> str:
    """Return the number of the latest job in a task's folder; empty without a job."""
    names = (path.name.removesuffix(_SUBMITTED) for path in folder.glob(f"[0-9]*{_SUBMITTED}"))
    return max((name for name in names if name.isdecimal()), key=int, default="")


def jobs_of(results: Path) -> dict[str, Job]:
    """Return the latest job of each task in the folder ``jobs`` of some results, by name of the task."""
    jobs: dict[str, Job] = {}
    numbers = {path.name: number for path in visible(results / JOBS, "*") if (number := latest(path))}
    slurm_states = (states() or {}) if numbers else {}
    words = {"PENDING": QUEUED, "CONFIGURING": QUEUED}
    for name, number in numbers.items():
        log = results / JOBS / name / f"{number}_0_log.err"
        state = words.get(slurm_states[number], RUNNING) if number in slurm_states else ENDED
        jobs[name] = Job(number, state, log if log.is_file() else None)
    return jobs
