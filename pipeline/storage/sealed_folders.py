"""Folders that are whole or not there: sealed manifests, temporary folders, renames, and what a kill leaves.

A finished folder carries ``manifest.json`` with the size and sha256 of every other file and of itself.  It is
filled under a temporary name, synced, and renamed.  `store` and `archive` are built on this.

A published folder is replaced only if it carries such a manifest, and files in it that the manifest does not list are
moved into the folder that takes its place.
"""

from __future__ import annotations

import dataclasses
import errno
import hashlib
import json
import os
import platform
import re
import secrets
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import Enum
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from pipeline.validation import InvalidInput

MANIFEST = "manifest.json"
TYPE = "<type>"
"""Key that keeps the class of an option in its canonical form: classes with equal fields are not equal."""

CANNOT_WRITE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EFBIG, errno.EACCES, errno.EPERM}
FULL = {errno.ENOTEMPTY, errno.EEXIST}
"""What a rename onto a folder with files in it answers."""
_ONE_DAY_S = 86400.0
_HERE = hashlib.sha256(platform.node().encode()).hexdigest()[:6]
"""Tells this machine's temporary folders from another's on a shared disk, without writing its name."""
_live_temporaries: set[str] = set()


def canonical(value: Any, where: str = "options") -> Any:
    """The value as JSON can hold it, in one way only; a dataclass keeps the name of its class.

    Raises
    ------
    InvalidInput
        If a part is not a finite number, text, enum, list, mapping or dataclass of such.

    Examples
    --------
    >>> canonical({"b": (1, np.float64(0.5)), "a": None})
    {'a': None, 'b': [1, 0.5]}
    """
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Enum):
        return {TYPE: type(value).__name__, "name": value.name}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        return {TYPE: type(value).__name__, **canonical(parts, where)}
    if isinstance(value, Mapping):
        if strange := [k for k in value if not isinstance(k, str)]:
            raise InvalidInput(
                "a key cannot be kept", where=where, expected="text", received=repr(strange[0])
            )
        return {key: canonical(value[key], f"{where}.{key}") for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [canonical(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, float) and not np.isfinite(value):
        raise InvalidInput("the number is not finite", where=where, received=repr(value))
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise InvalidInput(
        "the value cannot be kept",
        where=where,
        expected="a number, text, enum, list, mapping or dataclass",
        received=type(value).__name__,
    )


def compact(value: Any) -> bytes:
    """The one JSON text of a value: sorted keys, no blanks, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def digest(content: bytes) -> str:
    """The sha256 of some bytes, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def file_digest(path: Path) -> str:
    """The sha256 of a file, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file and wait until the disk has it."""
    with path.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def sync(folder: Path) -> None:
    """Wait until the disk has a folder's (or file's) entry, where the system knows how to."""
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def write_manifest(folder: Path, facts: Mapping[str, Any]) -> None:
    """Write ``manifest.json``: the facts, every file's size and sha256, and a seal on the manifest itself."""
    files = {}
    for path in sorted(p for p in folder.rglob("*") if p.is_file() and p != folder / MANIFEST):
        sync(path)
        relative = path.relative_to(folder).as_posix()
        files[relative] = {"bytes": path.stat().st_size, "sha256": file_digest(path)}
    manifest = {**canonical(facts, "manifest"), "files": files}
    manifest["seal"] = digest(compact(manifest))
    write_bytes(folder / MANIFEST, json.dumps(manifest, sort_keys=True, indent=1).encode() + b"\n")
    sync(folder)


def read_manifest(folder: Path) -> dict[str, Any]:
    """What a sealed ``manifest.json`` says, without its seal.

    Raises
    ------
    InvalidInput
        If it is missing, was changed, or was not written by `write_manifest`.
    """
    try:
        manifest = json.loads((folder / MANIFEST).read_bytes())
        seal = manifest.pop("seal")
        known = all({"bytes", "sha256"} <= fact.keys() for fact in manifest["files"].values())
        unchanged = digest(compact(manifest)) == seal
    except (FileNotFoundError, NotADirectoryError):
        raise InvalidInput(f"{MANIFEST} is missing", where=str(folder)) from None
    except OSError as error:
        raise InvalidInput(f"{MANIFEST} cannot be read: {error.strerror}", where=str(folder)) from None
    except (ValueError, KeyError, AttributeError, TypeError):
        raise InvalidInput(f"{MANIFEST} cannot be understood", where=str(folder)) from None
    if not known:
        raise InvalidInput(f"{MANIFEST} cannot be understood", where=str(folder))
    if not unchanged:
        raise InvalidInput(f"{MANIFEST} was changed", where=str(folder))
    return dict(manifest)


def require_replaceable(folder: Path) -> None:
    """Validate a destination: nothing is there, or a folder with a sealed manifest.

    Raises
    ------
    InvalidInput
        If anything else is there.
    """
    if not os.path.lexists(folder):
        return
    reason = "it is a symbolic link"
    if not folder.is_symlink():
        try:
            read_manifest(folder)
            return
        except InvalidInput as complaint:
            reason = complaint.what
    raise InvalidInput(
        "what stands here was not published by this program and is not replaced",
        where=str(folder),
        expected=f"nothing, or a folder with its sealed {MANIFEST}",
        received=reason,
    )


def complaints_about(folder: Path, *, hashes: bool = True) -> list[str]:
    """What is wrong with a folder that `write_manifest` sealed; empty if nothing is.

    Parameters
    ----------
    folder : Path
    hashes : bool
        Also read every file and compare its sha256; without it, sizes only.
    """
    try:
        files = read_manifest(folder)["files"].items()
    except InvalidInput as complaint:
        return [complaint.what]
    complaints = []
    for name, fact in files:
        path = folder / name
        if not path.is_file():
            complaints.append(f"{name} is missing")
        elif path.stat().st_size != fact["bytes"]:
            complaints.append(f"{name} has {path.stat().st_size} bytes, not {fact['bytes']}")
        elif hashes and file_digest(path) != fact["sha256"]:
            complaints.append(f"{name} sha256 differs")
    return complaints


def is_complete(folder: Path) -> bool:
    """Whether a folder has its manifest, and every file of it at the right size."""
    return not complaints_about(folder, hashes=False)


@contextmanager
def temporary_folder(parent: Path) -> Iterator[Path]:
    """A new folder inside `parent`, gone afterwards unless it was renamed."""
    path = parent / f".tmp-{_tag()}"
    _live_temporaries.add(path.name)
    try:
        path.mkdir()
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        _live_temporaries.discard(path.name)


def swap_in(temporary: Path, folder: Path) -> None:
    """Put a finished temporary folder in the place of `folder`.

    A full folder cannot be renamed over another: the older one steps aside for an instant, under a name from
    which `remove_stale` brings it back should the run be killed just there.

    Raises
    ------
    InvalidInput
        If `folder` carries no sealed manifest, or holds a file that is not ours under a name that is needed.
    """
    aside = folder.with_name(f".old-{_tag()}-{folder.name}")
    _live_temporaries.add(aside.name)
    try:
        while True:
            require_replaceable(folder)
            if taken := [name for name in _not_listed(folder) if os.path.lexists(temporary / name)]:
                raise InvalidInput(
                    "a file stands here that this program did not write, under a name that it needs",
                    where=str(folder / taken[0]),
                )
            with suppress(FileNotFoundError):
                folder.replace(aside)
            try:
                temporary.replace(folder)
                break
            except OSError as error:
                if error.errno not in FULL:
                    raise
                _retire(aside, folder)  # another process published just now: its turn to go
        sync(folder.parent)
    except BaseException:
        if not folder.exists() and aside.exists():
            aside.replace(folder)
        raise
    finally:
        if folder.exists():
            _retire(aside, folder)
        _live_temporaries.discard(aside.name)


def _not_listed(folder: Path) -> list[str]:
    """Files and folders in a published folder that its manifest does not list, as relative names."""
    ours = {MANIFEST}
    with suppress(InvalidInput):
        ours |= read_manifest(folder)["files"].keys()
    parents = {parent.as_posix() for name in ours for parent in PurePosixPath(name).parents}

    def walk(inside: Path) -> Iterator[str]:
        for path in sorted(inside.iterdir()):
            name = path.relative_to(folder).as_posix()
            if path.is_dir() and not path.is_symlink():
                if name in parents:
                    yield from walk(path)
                else:
                    yield name
            elif name not in ours:
                yield name

    return list(walk(folder)) if folder.is_dir() else []


def _retire(aside: Path, folder: Path) -> None:
    """Delete an older publication; what its manifest does not list moves to `folder`, or all of it stays."""
    with suppress(OSError):
        for name in _not_listed(aside):
            if os.path.lexists(folder / name):
                return
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (aside / name).rename(folder / name)
        shutil.rmtree(aside, ignore_errors=True)


def _tag() -> str:
    return f"{os.getpid()}-{_HERE}{secrets.token_hex(4)}"


def remove_stale(parent: Path) -> None:
    """Clear what killed runs left: remove their half-made folders, bring back what they had put aside."""
    with suppress(OSError):
        for path in list(parent.iterdir()):
            left = re.fullmatch(r"\.(tmp|old)-(\d+)-([0-9a-f]{6})[0-9a-f]{8}(?:-(.+))?", path.name)
            if not left or path.name in _live_temporaries:
                continue
            kind, pid, machine, name = left.groups()
            # Another machine's processes cannot be asked for: its folders go once they are a day old.
            if _is_alive(int(pid)) if machine == _HERE else time.time() - path.stat().st_mtime < _ONE_DAY_S:
                continue
            if kind == "old" and name:
                if (parent / name).exists():
                    _retire(path, parent / name)
                else:
                    path.replace(parent / name)
            else:
                shutil.rmtree(path, ignore_errors=True)


def _is_alive(pid: int) -> bool:
    """Whether another process has this number; our own leftovers are in `_live_temporaries`."""
    if pid == os.getpid():
        return False
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


@contextmanager
def writing(target: Path, *, only: set[int] | None = None) -> Iterator[None]:
    """Turn a failing disk into a sentence; `only` limits it to errors that cannot be anything else."""
    try:
        yield
    except OSError as error:
        if only is not None and error.errno not in only:
            raise
        raise InvalidInput(f"cannot write results: {error.strerror or error} ({target})") from error
