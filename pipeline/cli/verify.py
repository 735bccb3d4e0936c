"""Verifying archives: every file by its digest; and, if asked, every table by computing it again."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from pipeline.cli.compose import compose, with_options
from pipeline.cli.earlier_names import earlier_names
from pipeline.cli.figures import make_figures
from pipeline.cli.presets import apart
from pipeline.cli.summary import open_console
from pipeline.storage import agreement, archive, provenance
from pipeline.storage.sealed_folders import FIGURE, MANIFEST, read_manifest, visible
from pipeline.validation import InvalidInput


def verify(arguments: Sequence[str]) -> int:
    """Re-hash archives and print every file that changed, is missing or was added.

    ``rerun=1`` also computes their figures again, with ``only=FIGURE`` one of them, and compares tables and verdicts to
    the digits that the archive promises in digits.csv.  Options and columns of earlier versions are read by today's
    names, and figures that are no longer computed are named.  No code of an archive is run: a figure that used a user's
    file needs ``plugins=FILE``.
    """
    own, named = apart(arguments, ("rerun", "only", "plugins"))
    if not named:
        raise InvalidInput(
            "no archive is named", expected="verify results/archive/<date>-<commit>", code="no_archive_named"
        )
    status = 0
    for folder in [one for path in map(Path, named) for one in _archives(path)]:
        complaints = archive.verify(folder)
        for complaint in complaints:
            print(f"{folder}: {complaint}")
        if not complaints:
            print(f"{folder}: every file is as it was kept")
            if own.get("rerun") not in (None, "", "0"):
                complaints = computed_again(folder, own.get("only", ""))
        status |= bool(complaints)
    return status


def _archives(path: Path) -> list[Path]:
    """Return an archive, or those in a folder of light archives, which has one for each data set."""
    inside = [one.parent for one in visible(path, f"*/{archive.CHECKSUMS}")]
    return [path] if (path / archive.CHECKSUMS).is_file() or not inside else inside


def computed_again(folder: Path, only: str = "") -> list[str]:
    """Compute the figures of an archive again, print how each table agrees, and return what does not."""
    kept = {
        one.parent: manifest
        for one in visible(folder, f"**/*/{MANIFEST}")
        if "figure" in (manifest := read_manifest(one.parent, FIGURE)) and only in ("", one.parent.name)
    }
    if not kept:
        raise InvalidInput(
            "no figure to compute again", folder, received=only or "none in it", code="no_figure"
        )
    out, failures, earlier = open_console(), [], earlier_names()
    todays = {place: earlier.todays_preset(manifest["figure"]) for place, manifest in kept.items()}
    for place in [place for place, change in todays.items() if not change.now]:
        out.print(f"{place.name}: no longer computed: {todays.pop(place).gone}", soft_wrap=True)
    here = provenance.provenance()["commit"]
    if others := {kept[place]["provenance"].get("commit", "unknown") for place in todays} - {here}:
        out.print(
            f"made by {', '.join(sorted(other[:12] for other in others))}, computed again by {here[:12]}",
            soft_wrap=True,
        )
    with tempfile.TemporaryDirectory(prefix="verify-") as results:
        jobs = []
        for place, figure in todays.items():
            manifest = kept[place]
            preset = [f"experiment={figure.now}", f"data={manifest['data']}", f"results={results}"]
            files = provenance.require_plugins(manifest.get("plugins", []), place)
            made = with_options(compose(preset), {**manifest["configuration"], "plugins": files})
            made.figure.picture = made.figure.recording = False
            jobs.append((made, Path(results) / manifest["data"] / manifest["scale"] / made.name))
        failures += make_figures(jobs, console=out) if jobs else []
        for place, (_, made_in) in zip(todays, jobs, strict=True):
            if not (made_in / MANIFEST).is_file():
                failures.append(f"{place.name}: not made again")
                continue
            compared = agreement.compare_again(place, made_in, earlier.alike)
            worst = max(compared, key=lambda one: one.difference / one.tolerance)
            wrong = [
                f"{place.name}/{one.table}: {sentence}" for one in compared for sentence in one.complaints
            ]
            out.print(
                f"{place.name}: {len(compared)} tables {'differ' if wrong else 'agree'}, by {worst.difference:.0e}"
                f" at most ({worst.table}; {worst.tolerance:.0e} allowed)",
                soft_wrap=True,
            )
            failures += wrong
    for sentence in failures:
        print(f"{folder}: {sentence}")
    return failures
