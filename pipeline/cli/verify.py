"""Command `verify`: check the digest of every file of an archive and, on request, recompute all its tables."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from pipeline.cli.compose import compose, with_options
from pipeline.cli.earlier_names import earlier_names
from pipeline.cli.figures import make_figures
from pipeline.cli.output import tell_json
from pipeline.cli.presets import split_options
from pipeline.cli.summary import open_console
from pipeline.storage import agreement, archive, provenance
from pipeline.storage.sealed_folders import FIGURE, MANIFEST, read_manifest, visible
from pipeline.validation import InvalidInput


def verify(arguments: Sequence[str]) -> int:
    """Check archives against their checksums, and print every file that changed, is missing or was added.

    ``rerun=1`` also computes the figures again (``only=FIGURE``: one of them).  Tables and verdicts must agree within
    the tolerances in the archive's digits.csv.  Archives of earlier versions are read by today's names; figures that
    no longer exist are named.  Code in an archive is never run: a figure that used a user's file needs
    ``plugins=FILE``.  ``--json`` prints the complaints about each archive for other programs.
    """
    options, named = split_options(arguments, ("rerun", "only", "plugins"))
    if not named:
        raise InvalidInput(
            "no archive is named", expected="verify results/archive/<date>-<commit>", code="no_archive_named"
        )
    as_json, named = "--json" in named, [item for item in named if item != "--json"]
    complaints_of: dict[str, list[str]] = {}
    for folder in [archived for path in map(Path, named) for archived in _archives(path)]:
        complaints = archive.verify(folder)
        if not as_json:
            print("\n".join(f"{folder}: {each}" for each in complaints or ["every file is unchanged"]))
        if not complaints and options.get("rerun") not in (None, "", "0"):
            complaints = computed_again(folder, options.get("only", ""))
        complaints_of[str(folder)] = complaints
    if as_json:
        tell_json(complaints_of)
    return int(any(complaints_of.values()))


def _archives(path: Path) -> list[Path]:
    """Return the archive at a path, or the archives in a folder of light archives (one for each data set)."""
    inside = [sums.parent for sums in visible(path, f"*/{archive.CHECKSUMS}")]
    return [path] if (path / archive.CHECKSUMS).is_file() or not inside else inside


def computed_again(folder: Path, only: str = "") -> list[str]:
    """Recompute the figures of an archive, print the agreement of their tables, and return the disagreements."""
    manifests = {
        each.parent: manifest
        for each in visible(folder, f"**/*/{MANIFEST}")
        if "figure" in (manifest := read_manifest(each.parent, FIGURE)) and only in ("", each.parent.name)
    }
    if not manifests:
        raise InvalidInput(
            "the archive has no figure of this name" if only else "the archive has no figures",
            folder,
            received=only,
            code="no_figure",
            typed=True,
        )
    out, failures, earlier = open_console(), [], earlier_names()
    todays = {
        figure_folder: earlier.todays_preset(manifest["figure"])
        for figure_folder, manifest in manifests.items()
    }
    for figure_folder in [figure_folder for figure_folder, change in todays.items() if not change.now]:
        out.print(
            f"{figure_folder.name}: no longer computed: {todays.pop(figure_folder).gone}", soft_wrap=True
        )
    commit = provenance.provenance()["commit"]
    if others := {
        manifests[figure_folder]["provenance"].get("commit", "unknown") for figure_folder in todays
    } - {commit}:
        out.print(
            f"made by commit {', '.join(sorted(other[:12] for other in others))}, computed again by {commit[:12]}",
            soft_wrap=True,
        )
    with tempfile.TemporaryDirectory(prefix="verify-") as results:
        jobs = []
        for figure_folder, figure in todays.items():
            manifest = manifests[figure_folder]
            preset = [f"experiment={figure.now}", f"data={manifest['data']}", f"results={results}"]
            files = provenance.require_plugins(manifest.get("plugins", []), figure_folder)
            experiment = with_options(compose(preset), {**manifest["configuration"], "plugins": files})
            experiment.figure.picture = experiment.figure.recording = False
            jobs.append((experiment, Path(results) / manifest["data"] / manifest["scale"] / experiment.name))
        failures += make_figures(jobs, console=out) if jobs else []
        for figure_folder, (_, made_in) in zip(todays, jobs, strict=True):
            if not (made_in / MANIFEST).is_file():
                failures.append(f"{figure_folder.name}: not made again")
                continue
            compared = agreement.compare_again(figure_folder, made_in, earlier.alike)
            worst = max(compared, key=lambda each: each.difference / each.tolerance)
            wrong = [
                f"{figure_folder.name}/{each.table}: {sentence}"
                for each in compared
                for sentence in each.complaints
            ]
            out.print(
                f"{figure_folder.name}: {len(compared)} tables {'differ' if wrong else 'agree'}, largest difference"
                f" {worst.difference:.0e} ({worst.table}; tolerance {worst.tolerance:.0e})",
                soft_wrap=True,
            )
            failures += wrong
    for sentence in failures:
        print(f"{folder}: {sentence}")
    return failures
