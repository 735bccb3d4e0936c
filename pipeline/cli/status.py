"""Which figures are current, stale or missing, found without computing anything, and the jobs that make them."""

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
"""Folder of scripts and logs of a cluster's jobs, beside the figures."""
_SUBMITTED = "_submitted.pkl"


@dataclass(frozen=True)
class Status:
    """Whether a published figure is what its experiment would make now.

    Attributes
    ----------
    figure, state : str
        The state is ``current``, ``stale`` or ``missing``.
    why : str
        Which option, input or source changed; empty if it is current.
    to_compute : tuple of str
        Stages that are not in the cache.
    """

    figure: str
    state: str
    why: str
    to_compute: tuple[str, ...]


def status(experiment: Experiment, folder: Path) -> Status:
    """Compare a published figure with its experiment: stages by content, the figure by options and sources.

    Raises
    ------
    InvalidInput
        If the data set has no clips for it, or an option cannot be kept.
    """
    complaints = (
        complaints_about(folder, hashes=False, needed=FIGURE) if folder.is_dir() else ["not made yet"]
    )
    manifest = {} if complaints else read_manifest(folder)
    before = {
        name: (stage["key"], stage.get("content", "")) for name, stage in manifest.get("stages", {}).items()
    }
    store = Store(Path(experiment.results), dry_run=True, before=before)
    artefacts = [kept.artefact for kept in chain.run(experiment, store)]
    changed = [a for a in artefacts if not a.content or a.content != before.get(a.stage, ("", ""))[1]]
    state, why = STALE, ""
    if complaints:
        state, why = MISSING, complaints[0]
    elif changed:  # the first explains those that follow from it
        why = f"{changed[0].stage}: {changed[0].why}"
    elif manifest["configuration"].get("figure") != canonical(experiment.figure):
        why = "figure: options changed"
    elif not manifest.get("code"):
        why = "figure: without further populations yet"
    elif manifest["code"] != figure_code(experiment):
        why = "figure: code changed"
    else:
        state = CURRENT
    return Status(experiment.name, state, why, tuple(a.stage for a in artefacts if a.computed))


def print_status(found: Sequence[Status], console: Console, results: Path | None) -> None:
    """Print a row for each figure, and what is known of the cluster's jobs of a folder of results.

    Those of figures stand in the table, those of shared work below it.
    """
    jobs = jobs_of(results) if results else {}
    table = Table(box=None, pad_edge=False)
    for heading in ("figure", "state", "to compute", "why", *(["job"] if jobs else [])):
        table.add_column(heading, overflow="fold")
    for one in found:
        state = Text(one.state, style=_STYLES[one.state])
        job = jobs.pop(one.figure, "")
        if job.startswith("ended") and one.state != CURRENT:
            job = job.replace("ended", "failed", 1)
        table.add_row(one.figure, state, " ".join(one.to_compute) or "-", one.why, *([job] if job else []))
    console.print(table)
    for name in sorted(jobs):
        if not jobs[name].startswith("ended"):
            console.print(Text(f"{name}: {jobs[name]}"), soft_wrap=True)
    counts = {state: sum(one.state == state for one in found) for state in _STYLES}
    console.print(", ".join(f"{count} {state}" for state, count in counts.items()) + "; nothing was computed")


def states() -> dict[str, str] | None:
    """Return the state of each of this user's jobs that has not ended; None if Slurm does not answer."""
    command = ["squeue", "--me", "-h", "-o", "%i %T"]
    try:
        listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    return dict(line.split(" ", 1) for line in listing.splitlines() if " " in line)


def latest(folder: Path) -> str:
    """Return the number of the last job of a task, empty if there was none."""
    names = (path.name.removesuffix(_SUBMITTED) for path in folder.glob(f"[0-9]*{_SUBMITTED}"))
    return max((name for name in names if name.isdecimal()), key=int, default="")


def jobs_of(results: Path) -> dict[str, str]:
    """Return what is known of the last job of each task below ``jobs``: queued, running or ended, and its log."""
    found: dict[str, str] = {}
    names = {path.name: number for path in visible(results / JOBS, "*") if (number := latest(path))}
    seen = (states() or {}) if names else {}
    words = {"PENDING": "queued", "CONFIGURING": "queued"}
    for name, number in names.items():
        log = results / JOBS / name / f"{number}_0_log.err"
        state = words.get(seen[number], "running") if number in seen else "ended"
        found[name] = f"{state} {number}" + (f", {log}" if log.is_file() else "")
    return found
