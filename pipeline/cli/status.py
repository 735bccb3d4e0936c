"""Status of figures (current, stale or missing), determined without computing them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pipeline.stages import chain
from pipeline.stages.sources import figure_code
from pipeline.storage.sealed_folders import FIGURE, canonical, complaints_about, read_manifest
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment

CURRENT, STALE, MISSING = "current", "stale", "missing"
_STYLES = {CURRENT: "green", STALE: "yellow", MISSING: "red"}


@dataclass(frozen=True)
class Status:
    """Status of a published figure relative to its experiment.

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


def status(experiment: Experiment, folder: Path) -> Status:
    """Return the status of a published figure: current, stale or missing.

    Stages are compared by content, the figure itself by its options and sources.

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


def print_status(figures: Sequence[Status], console: Console) -> None:
    """Print one row for each figure, with its status."""
    table = Table(box=None, pad_edge=False)
    for heading in ("figure", "state", "to compute", "why"):
        table.add_column(heading, overflow="fold")
    for each in figures:
        state = Text(each.state, style=_STYLES[each.state])
        table.add_row(each.figure, state, " ".join(each.to_compute) or "-", each.why)
    console.print(table)
    counts = {state: sum(each.state == state for each in figures) for state in _STYLES}
    console.print(", ".join(f"{count} {state}" for state, count in counts.items()) + "; nothing was computed")
