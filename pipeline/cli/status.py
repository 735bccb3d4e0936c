"""Which figures are current, stale or missing, found without computing anything."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pipeline.stages import chain
from pipeline.stages.figure import figure_code
from pipeline.storage.sealed_folders import canonical, complaints_about, read_manifest
from pipeline.storage.store import Plan
from pipeline.studies.experiment import Experiment

CURRENT, STALE, MISSING = "current", "stale", "missing"
_STYLES = {CURRENT: "green", STALE: "yellow", MISSING: "red"}


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
    """Compare a published figure with its experiment: stages by content, the figure by options and sources."""
    there = folder.is_dir() and not complaints_about(folder, hashes=False)
    manifest = read_manifest(folder) if there else {}
    before = {
        name: (str(stage["key"]), str(stage.get("content", "")))
        for name, stage in manifest.get("stages", {}).items()
    }
    plan = Plan(Path(experiment.results), before)
    artefacts = [kept.artefact for kept in chain.run(experiment, plan)]
    to_compute = tuple(artefact.stage for artefact in artefacts if artefact.computed)
    if not folder.is_dir():
        return Status(experiment.name, MISSING, "not made yet", to_compute)
    if not there:
        return Status(experiment.name, MISSING, complaints_about(folder, hashes=False)[0], to_compute)
    changed = [a for a in artefacts if not a.content or a.content != before.get(a.stage, ("", ""))[1]]
    if changed:  # the first explains those that follow from it
        return Status(experiment.name, STALE, f"{changed[0].stage}: {changed[0].why}", to_compute)
    if manifest["configuration"].get("figure") != canonical(experiment.figure):
        return Status(experiment.name, STALE, "figure: options changed", to_compute)
    if not manifest.get("code"):
        return Status(experiment.name, STALE, "figure: without further populations yet", to_compute)
    if manifest.get("code") != figure_code(experiment):
        return Status(experiment.name, STALE, "figure: code changed", to_compute)
    return Status(experiment.name, CURRENT, "", to_compute)


def print_status(found: Sequence[Status], console: Console, jobs: Mapping[str, str]) -> None:
    """Print a row for each figure, and what is known of the cluster's jobs: of figures in it, of shared work below."""
    table = Table(box=None, pad_edge=False)
    for heading in ("figure", "state", "to compute", "why", *(["job"] if jobs else [])):
        table.add_column(heading, overflow="fold")
    for one in found:
        state = Text(one.state, style=_STYLES[one.state])
        job = jobs.get(one.figure, "")
        if job.startswith("ended") and one.state != CURRENT:
            job = job.replace("ended", "failed", 1)
        table.add_row(one.figure, state, " ".join(one.to_compute) or "-", one.why, *([job] if jobs else []))
    console.print(table)
    for name in sorted(set(jobs) - {one.figure for one in found}):
        if not jobs[name].startswith("ended"):
            console.print(Text(f"{name}: {jobs[name]}"), soft_wrap=True)
    counts = {state: sum(one.state == state for one in found) for state in _STYLES}
    console.print(", ".join(f"{count} {state}" for state, count in counts.items()) + "; nothing was computed")
