"""Metadata of an archive: a Process Run Crate, which data repositories can read, and a bill of materials."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any

from pipeline.resources import NAME, project
from pipeline.storage.sealed_folders import file_digest

SBOM = "sbom.cdx.json"
_MAX_LICENCE = 80
"""Maximum number of characters of the name of a licence."""


def bill_of_materials(lock: Path, commit: str) -> bytes:
    """Return the bill of materials (CycloneDX 1.6): the installed packages that the program needs, even indirectly.

    Versions, licences and dependencies are those of the environment.  The digests of the packages' files are only in
    the lock file, which the bill names with its digest.
    """
    direct = _installed(_requirements())
    needs: dict[str, list[str]] = {}
    waiting = [*direct]
    while waiting:
        if (name := waiting.pop()) not in needs:
            needs[name] = _installed(metadata.requires(name) or [])
            waiting += needs[name]
    packages = [
        {
            "type": "library",
            "bom-ref": purl,
            "name": name,
            "version": version,
            "purl": purl,
            **_licences(name),
        }
        for name in sorted(needs)
        for version, purl in [(metadata.version(name), _purl(name))]
    ]
    program = {
        "type": "application",
        "bom-ref": NAME,
        "name": NAME,
        "version": commit,
        "licenses": [{"license": {"id": "MIT"}}],
        "externalReferences": [
            {
                "type": "other",
                "url": lock.name,
                "comment": "versions, and the digest of every file that may be installed",
                "hashes": [{"alg": "SHA-256", "content": file_digest(lock)}],
            }
        ],
    }
    edges = [(NAME, direct), *((_purl(name), needs[name]) for name in sorted(needs))]
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": program},
        "components": packages,
        "dependencies": [{"ref": ref, "dependsOn": [*map(_purl, names)]} for ref, names in edges],
    }
    return json.dumps(bill, indent=1).encode() + b"\n"


def _requirements() -> list[str]:
    """Return the requirements of the program and of its extra ``papers``, without conditions on extras."""
    if content := project():
        return [*content["dependencies"], *content["optional-dependencies"]["papers"]]
    stated = (
        re.sub(r"\s*(and|;)\s*extra == ['\"]papers['\"]", "", each) for each in metadata.requires(NAME) or []
    )
    return [*stated]


def _installed(requirements: Sequence[str]) -> list[str]:
    """Return the sorted, normalised names of installed requirements; requirements of extras are left out."""
    names = set()
    for each in requirements:
        if "extra ==" not in each and (name := re.match(r"[A-Za-z0-9._-]+", each)):
            with suppress(metadata.PackageNotFoundError):
                names.add(_normal(metadata.metadata(name[0])["Name"]))
    return sorted(names)


def _normal(name: str) -> str:
    return re.sub(r"[._-]+", "-", name).lower()


def _purl(name: str) -> str:
    return f"pkg:pypi/{name}@{metadata.version(name)}"


def _licences(name: str) -> dict[str, Any]:
    """Return the licence that a package declares: an SPDX expression, classifiers, or the first line of a text."""
    stated: Any = metadata.metadata(name)
    if expression := stated.get("License-Expression"):
        return {"licenses": [{"expression": expression}]}
    classes = [
        each.rpartition(" :: ")[2] for each in stated.get_all("Classifier") or [] if "License ::" in each
    ]
    texts = classes or [(stated.get("License") or "").strip().partition("\n")[0][:_MAX_LICENCE]]
    return {"licenses": [{"license": {"name": text}} for text in texts if text]}


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
    """Return the metadata of an archive: each file, and for each figure the run that produced the figure's files.

    Parameters
    ----------
    files : mapping of str to (int, str)
        Size in bytes and sha256 of each file, by name in the archive.
    figures : mapping of str to mapping
        Title, command and provenance of each figure; its files are in the folder of the same name.
    name, description : str
    date : str
        Date as ``2026-01-31``.
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
