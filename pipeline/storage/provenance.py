"""Provenance of a result: versions, commit, machine type, threads and lock file."""

from __future__ import annotations

import functools
import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline import plugins
from pipeline.resources import PACKAGE
from pipeline.storage import source_code
from pipeline.storage.sealed_folders import file_digest
from pipeline.validation import InvalidInput

PROJECT = PACKAGE.parent
LOCK = PROJECT / "requirements.lock"

PACKAGES = ("numpy", "scipy", "pandas", "numba", "hydra-core", "omegaconf", "rerun-sdk", "matplotlib")
_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_CORETYPE")


@functools.cache
def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def versions(packages: Sequence[str]) -> dict[str, str]:
    """Return the installed version of each package; ``not installed`` for a missing package."""
    return {package: _version(package) for package in packages}


def _git(*arguments: str) -> str | None:
    """Return the output of a git command in the project folder; None if the command fails or git is not installed."""
    try:
        answer = subprocess.run(
            ["git", "-C", str(PROJECT), *arguments],
            capture_output=True,
            text=True,
            timeout=600,
            env={**os.environ, "GIT_OPTIONAL_LOCKS": "0"},
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip() if answer.returncode == 0 else None


def provenance() -> dict[str, Any]:
    """Return the provenance of results: versions, commit, machine type, threads and digest of the lock file.

    It contains no paths and no names of people or machines.  Without git, ``commit`` and ``dirty`` are ``"unknown"``.
    """
    top = _git("rev-parse", "--show-toplevel")
    ours = top is not None and Path(top).resolve() == PROJECT
    commit = _git("rev-parse", "--verify", "HEAD") if ours else None
    # Changes of these outputs do not make the tree dirty: no result depends on them.
    excluded = (
        "results/archive",
        "results/sensitivity.csv",
        "results/sensitivity_runs.csv",
        "conf/paper/interventions.csv",
    )
    arguments = ("--", ".", *(f":(exclude){path}" for path in excluded))
    changes = _git("status", "--porcelain", *arguments) if ours else None
    return {
        "python": platform.python_version(),
        "packages": versions(PACKAGES),
        "commit": commit or "unknown",
        "dirty": "unknown" if changes is None else bool(changes),
        "machine": platform.machine(),
        "system": platform.system(),
        "threads": {name: os.environ.get(name, "not set") for name in _THREAD_VARIABLES},
        "lock_sha256": file_digest(LOCK) if LOCK.is_file() else "absent",
    }


def used_plugins(modules: Iterable[str], files: Iterable[str]) -> list[dict[str, str]]:
    """Return the plug-ins and users' files that the given modules use, as entries of a manifest.

    The entry of an installed plug-in states distribution, version and the sha256 of the sources used; that of a user's
    file states the sha256 of its content.
    """
    reached = source_code.reached(modules)
    names = {Path(file).stem for file in files}
    described = []
    for each in plugins.loaded():
        modules_used = sorted(name for name in reached if name.partition(".")[0] == each.root)
        if each.file and (modules_used or each.name in names):
            described.append({"file": each.file.name, "sha256": plugins.digest_of(each)})
        elif modules_used:
            facts = {"name": each.name, "distribution": each.distribution, "version": each.version}
            described.append({**facts, "sha256": source_code.sources_digest(modules_used)})
    return described


def require_plugins(used: Sequence[Mapping[str, str]], where: object) -> list[str]:
    """Return the paths of the loaded users' files that equal the users' files with which a result was computed.

    Raises
    ------
    InvalidInput
        If a file is not loaded; the message states its name and sha256.
    """
    paths = {plugins.digest_of(each): str(each.file) for each in plugins.loaded() if each.file}
    texts = isinstance(used, list) and all(isinstance(each, dict) for each in used)
    if not texts or any({*map(type, each.values())} - {str} for each in used):
        raise InvalidInput("the manifest's list of plug-ins is malformed", where, code="other_entries")
    entries = [{"sha256": "", **each} for each in used if "file" in each]
    for each in entries:
        if each["sha256"] not in paths:
            raise InvalidInput(
                f"the result used the file {each['file']} with sha256 {each['sha256']}: pass your own copy by"
                " plugins=FILE, since code in an archive is never run",
                where,
                code="plugin_not_loaded",
            )
    return [paths[each["sha256"]] for each in entries]


FOLDERS = {"mirror", "raw", "path"}
"""Names of the data options whose values are folders on this machine."""


def without_paths(configuration: dict[str, Any]) -> dict[str, Any]:
    """Return the configuration with each path of a folder or file replaced by its last component."""
    data = dict(configuration["data"])
    for option in FOLDERS & {name for name, value in data.items() if value}:
        data[option] = Path(data[option]).name
    sweep = {
        name: Path(value).name if isinstance(value, str) and os.sep in value else value
        for name, value in configuration.get("sweep", {}).items()
    }
    files = [Path(file).name for file in configuration.get("plugins", [])]
    results = Path(configuration["results"]).name
    return {**configuration, "data": data, "sweep": sweep, "results": results, "plugins": files}
