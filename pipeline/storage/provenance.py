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

PACKAGES = ("numpy", "scipy", "pandas", "hydra-core", "omegaconf", "rerun-sdk", "matplotlib")
_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_CORETYPE")


@functools.cache
def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def versions(packages: Sequence[str]) -> dict[str, str]:
    """Return the installed version of each package, or ``not installed``."""
    return {package: _version(package) for package in packages}


def _git(*arguments: str) -> str | None:
    """Return the output of a git command in the project, None if it fails or there is no git."""
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
    """Return versions, commit, machine type, threads and the digest of the lock file.

    It contains no path and no name of a person or machine.  ``commit`` and ``dirty`` are ``"unknown"`` without git.
    """
    top = _git("rev-parse", "--show-toplevel")
    ours = top is not None and Path(top).resolve() == PROJECT
    commit = _git("rev-parse", "--verify", "HEAD") if ours else None
    # Results do not depend on what is kept of them: the archive, numbers that texts quote.
    kept = (
        "results/archive",
        "results/sensitivity.csv",
        "results/sensitivity_runs.csv",
        "conf/paper/interventions.csv",
    )
    aside = ("--", ".", *(f":(exclude){path}" for path in kept))
    changes = _git("status", "--porcelain", *aside) if ours else None
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
    """Return the plug-ins whose sources these modules reach, and users' files, as a manifest has them.

    An installed plug-in has its distribution, version and the sha256 of the sources that are reached; a user's file the
    sha256 of its text.
    """
    reached = source_code.reached(modules)
    names = {Path(file).stem for file in files}
    described = []
    for each in plugins.loaded():
        own = sorted(name for name in reached if name.partition(".")[0] == each.root)
        if each.file and (own or each.name in names):
            described.append({"file": each.file.name, "sha256": plugins.digest_of(each)})
        elif own:
            facts = {"name": each.name, "distribution": each.distribution, "version": each.version}
            described.append({**facts, "sha256": source_code.sources_digest(own)})
    return described


def require_plugins(used: Sequence[Mapping[str, str]], where: object) -> list[str]:
    """Return the paths of the users' files that a result used, if files with the same content are loaded.

    Raises
    ------
    InvalidInput
        If one is not; the sentence has its name and sha256.
    """
    here = {plugins.digest_of(each): str(each.file) for each in plugins.loaded() if each.file}
    texts = isinstance(used, list) and all(isinstance(each, dict) for each in used)
    if not texts or any({*map(type, each.values())} - {str} for each in used):
        raise InvalidInput("the manifest lists plug-ins in another form", where, code="other_entries")
    wanted = [{"sha256": "", **each} for each in used if "file" in each]
    for each in wanted:
        if each["sha256"] not in here:
            raise InvalidInput(
                f"the result used the file {each['file']} with sha256 {each['sha256']}: give your own copy, since no"
                " code of an archive is run",
                where,
                "plugins=FILE",
                code="plugin_not_loaded",
            )
    return [here[each["sha256"]] for each in wanted]


FOLDERS = {"mirror", "raw", "path"}
"""Options of data that name folders of this machine."""


def without_paths(configuration: dict[str, Any]) -> dict[str, Any]:
    """Return the configuration with folders and files of this machine reduced to their last name."""
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
