"""Metadata of an archive as a Process Run Crate: ``ro-crate-metadata.json``, which repositories with a DOI read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

CRATE = "ro-crate-metadata.json"

_CRATE_TERMS = "https://w3id.org/ro/crate/1.1"
_RUN_TERMS = "https://w3id.org/ro/wfrun/process/0.5"
_LICENSE = "https://spdx.org/licenses/MIT"
_TYPES = {
    ".csv": "text/csv",
    ".gz": "application/gzip",
    ".html": "text/html",
    ".json": "application/json",
    ".lock": "text/plain",
    ".rrd": "application/octet-stream",
    ".svg": "image/svg+xml",
    ".webp": "image/webp",
}


def crate(
    files: Mapping[str, tuple[int, str]],
    figures: Mapping[str, Mapping[str, Any]],
    *,
    name: str,
    description: str,
    date: str,
    commit: str,
) -> dict[str, Any]:
    """Return the metadata: every file, and for each figure the run that made its files.

    Parameters
    ----------
    files : mapping of str to (int, str)
        Bytes and sha256 by name in the archive.
    figures : mapping of str to mapping
        Title, command and provenance of each figure; its files are those in the folder of its name.
    name, description : str
    date : str
        ``2026-01-31``.
    commit : str
    """
    software = {
        "@id": "#gait-pipeline",
        "@type": "SoftwareApplication",
        "name": "gait-pipeline",
        "softwareVersion": commit,
        "description": "Methods and figures of four papers on 3D human motion from 2D motion",
        "license": {"@id": _LICENSE},
    }
    runs = [_run(figure, facts, files, software) for figure, facts in figures.items()]
    root = {
        "@id": "./",
        "@type": "Dataset",
        "conformsTo": {"@id": _RUN_TERMS},
        "name": name,
        "description": description,
        "datePublished": date,
        "license": {"@id": _LICENSE},
        "hasPart": _references(files),
        "mentions": _references([run["@id"] for run in runs]),
    }
    descriptor = {
        "@id": CRATE,
        "@type": "CreativeWork",
        "conformsTo": {"@id": _CRATE_TERMS},
        "about": {"@id": "./"},
    }
    terms = {"@id": _RUN_TERMS, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5"}
    license_of_all = {"@id": _LICENSE, "@type": "CreativeWork", "name": "MIT License"}
    return {
        "@context": [f"{_CRATE_TERMS}/context", {"sha256": "https://w3id.org/ro/terms/workflow-run#sha256"}],
        "@graph": [descriptor, root, terms, license_of_all, software, *runs, *map(_file, files.items())],
    }


def _run(
    figure: str, facts: Mapping[str, Any], files: Mapping[str, Any], software: Mapping[str, Any]
) -> dict[str, Any]:
    return {
        "@id": f"#{figure}",
        "@type": "CreateAction",
        "name": facts["title"],
        "description": facts["command"],
        "instrument": {"@id": software["@id"]},
        "actionStatus": {"@id": "http://schema.org/CompletedActionStatus"},
        "result": _references([name for name in files if name.startswith(f"{figure}/")]),
    }


def _references(names: Sequence[str] | Mapping[str, Any]) -> list[dict[str, str]]:
    return [{"@id": name} for name in names]


def _file(item: tuple[str, tuple[int, str]]) -> dict[str, Any]:
    name, (size, sha256) = item
    suffix = f".{name.rpartition('.')[2]}"
    return {
        "@id": name,
        "@type": "File",
        "name": name.rpartition("/")[2],
        "contentSize": str(size),
        "encodingFormat": _TYPES.get(suffix, "application/octet-stream"),
        "sha256": sha256,
    }
