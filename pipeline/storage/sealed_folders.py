"""Folders written atomically, with a sealed manifest: the basis of `store` and `archive`.

A folder is filled under a temporary name, synced to disk and renamed.  Its ``manifest.json`` lists the size and sha256
of every other file, and has a digest of itself, the seal.  A published folder is replaced only if it has such a
manifest; files that the manifest does not list are moved into the new folder.
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
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import Enum
from pathlib import Path, PurePosixPath
from typing import Any, TypedDict

import numpy as np

from pipeline.reading import MAX_JSON_BYTES, open_regular, read_json
from pipeline.validation import InvalidInput, is_relative

MANIFEST = "manifest.json"
TYPE = "<type>"
"""JSON key that stores the name of a dataclass in canonical form; it distinguishes classes with equal fields."""

CANNOT_WRITE = {
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EROFS,
    errno.EIO,
    errno.EFBIG,
    errno.EACCES,
    errno.EPERM,
    errno.EINTR,
}
FULL = {errno.ENOTEMPTY, errno.EEXIST}
"""Error numbers that a rename raises if the target folder is not empty."""
_ONE_DAY_S = 86400.0


class _File(TypedDict):
    bytes: int
    sha256: str


class _Stage(TypedDict):
    key: str


class _Provenance(TypedDict, total=False):
    commit: str
    dirty: bool | str
    packages: dict[str, str]


class _FigureFacts(TypedDict, total=False):
    """Types of the entries of a figure's manifest."""

    figure: str
    paper: str
    title: str
    data: str
    scale: str
    caption: str
    configuration: dict[str, Any]
    stages: dict[str, _Stage]
    charts: list[dict[str, Any]]
    provenance: _Provenance


class _Facts(_FigureFacts, total=False):
    """Types of the entries of a figure's manifest and of an artefact's manifest."""

    code: str
    inputs: dict[str, str] | list[str]
    stage: str
    key: str
    notes: Any
    libraries: dict[str, str]


class _Manifest(_Facts):
    files: dict[str, _File]
    seal: str


FIGURE = ("figure", "data", "scale", "configuration", "provenance")
ARTEFACT = ("stage", "key", "notes", "options", "inputs", "code", "libraries")
"""Names of the required entries in a figure's manifest, and in an artefact's manifest."""


def _process_space() -> str:
    """Return six hexadecimal digits that identify the machine, boot and container, within which process ids are unique.

    Two containers may share a host name and a folder of results, but have separate process numbers.
    """
    parts = [platform.node()]
    with suppress(OSError):
        parts.append(Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii"))
    with suppress(OSError):
        parts.append(str(Path("/proc/self/ns/pid").readlink()))
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:6]


_HERE = _process_space()
"""Digits that identify machine and container in names of temporary folders, because machines may share a disk."""
_TEMPORARY = re.compile(r"\.(tmp|old)-(\d+)-([0-9a-f]{6})[0-9a-f]{8}(?:-(.+))?")
"""Pattern of the names of temporary folders and replaced folders: kind, process id, machine digits, folder name."""
_live_temporaries: set[str] = set()


def canonical(value: Any, where: str = "options") -> Any:
    """Return a value as plain JSON types in canonical form; for a dataclass, the form contains the class name.

    Raises
    ------
    InvalidInput
        If a part is not a finite number, text, enum, or a list, mapping or dataclass of these.

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
                "the key of a mapping cannot be stored", where, "text", repr(strange[0]), code="key_not_text"
            )
        return {key: canonical(value[key], f"{where}.{key}") for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [canonical(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, float) and not np.isfinite(value):
        raise InvalidInput("the number is not finite", where, received=repr(value), code="not_finite")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise InvalidInput(
        "a value of this type cannot be stored",
        where,
        "a number, text, enum, list, mapping or dataclass",
        type(value).__name__,
        code="not_storable",
        type=type(value).__name__,
    )


def compact(value: Any) -> bytes:
    """Return the canonical JSON text of a value: sorted keys, no blanks, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def digest(content: bytes) -> str:
    """Return the sha256 of some bytes, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def file_digest(path: Path) -> str:
    """Return the sha256 of a file, in hexadecimal."""
    with open_regular(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()  # type: ignore[arg-type]


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file and sync it to disk."""
    with path.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def sync(folder: Path) -> None:
    """Sync a folder or file to disk, on systems that support it."""
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def write_manifest(folder: Path, facts: Mapping[str, Any]) -> None:
    """Write ``manifest.json``: the facts, size and sha256 of every file, and the manifest's own digest (the seal)."""
    files = {}
    for path in sorted(p for p in folder.rglob("*") if p.is_file() and p != folder / MANIFEST):
        sync(path)
        relative = path.relative_to(folder).as_posix()
        files[relative] = {"bytes": path.stat().st_size, "sha256": file_digest(path)}
    manifest = {**canonical(facts, "manifest"), "files": files}
    manifest["seal"] = digest(compact(manifest))
    content = json.dumps(manifest, sort_keys=True, indent=1).encode() + b"\n"
    if len(content) > MAX_JSON_BYTES:
        raise InvalidInput(
            "the manifest is too large",
            folder,
            f"at most {MAX_JSON_BYTES} bytes",
            len(content),
            code="file_too_large",
        )
    write_bytes(folder / MANIFEST, content)
    sync(folder)


def read_manifest(folder: Path, needed: Iterable[str] = ()) -> dict[str, Any]:
    """Return the content of a sealed ``manifest.json``, without the seal.

    Parameters
    ----------
    folder : Path
    needed : iterable of str
        Required entries, such as `FIGURE`.

    Raises
    ------
    InvalidInput
        If the manifest is missing, was changed, lacks an entry, lists a file outside its folder, or was not written by
        `write_manifest`.
    """
    try:
        manifest: dict[str, Any] = read_json(folder / MANIFEST, _Manifest, subject=MANIFEST)
    except InvalidInput as error:
        raise InvalidInput(error.what, folder, code=error.code, **error.values) from None
    seal = manifest.pop("seal")
    try:
        sealed = digest(compact(manifest)) == seal
    except ValueError:
        what = f"{MANIFEST} contains numbers that are not finite"
        raise InvalidInput(what, folder, code="not_finite") from None
    if not sealed:
        raise InvalidInput(f"{MANIFEST} was changed", folder, code="changed")
    if lacking := [name for name in needed if name not in manifest]:
        what = f"{MANIFEST} has no entry {lacking[0]!r}"
        raise InvalidInput(what, folder, code="missing_key", key=lacking[0])
    if outside := [name for name in manifest["files"] if not is_relative(name)]:
        what = f"{MANIFEST} lists a file whose path is not inside its folder: {outside[0]!r:.80}"
        raise InvalidInput(what, folder, code="not_plain_path", name=outside[0])
    return manifest


def is_sealed(folder: Path) -> bool:
    """Return True if a folder has a sealed manifest."""
    with suppress(InvalidInput):
        return bool(read_manifest(folder))
    return False


def _edition(folder: Path) -> tuple[int, ...]:
    """Return values that change when a folder is replaced or gets a new entry; empty if the folder does not exist.

    The values are the folder's device, inode and times.
    """
    try:
        state = folder.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return ()
    return state.st_dev, state.st_ino, state.st_mtime_ns, state.st_ctime_ns


def require_replaceable(folder: Path, *, having: str = "") -> None:
    """Raise InvalidInput unless a path does not exist, or is an empty folder or a folder with a sealed manifest.

    Parameters
    ----------
    folder : Path
    having : str
        Entry that the manifest must have; empty for none.

    Raises
    ------
    InvalidInput
        If the path may not be replaced.
    """
    while edition := _edition(folder):
        reason, why = "it is a symbolic link", "link"
        if not folder.is_symlink():
            try:
                manifest = read_manifest(folder)
                if not having or having in manifest:
                    return
                reason, why = f"another command wrote it: {MANIFEST} has no {having!r}", "other_command"
            except InvalidInput as complaint:
                reason, why = complaint.what, complaint.code
            with suppress(FileNotFoundError, NotADirectoryError):
                if not any(folder.iterdir()):
                    return
        if _edition(folder) == edition:  # otherwise another process has just published the folder
            break
    else:
        return
    raise InvalidInput(
        f"the folder is not replaced, since this program did not publish it: {reason}. Move the folder away",
        folder,
        code="not_replaced",
        why=why,
    )


def complaints_about(folder: Path, *, hashes: bool = True, needed: Iterable[str] = ()) -> list[str]:
    """Return the differences between a folder and its sealed manifest, one phrase each; empty if there are none.

    Parameters
    ----------
    folder : Path
    hashes : bool
        Whether to compare the sha256 of every file.  Otherwise sizes are compared, and the sha256 only of files that
        are newer than the manifest.
    needed : iterable of str
        Required entries, as for `read_manifest`.
    """
    try:
        files = read_manifest(folder, needed)["files"].items()
        sealed_ns = (folder / MANIFEST).stat().st_mtime_ns
    except InvalidInput as complaint:
        return [complaint.what]
    complaints = []
    for name, fact in files:
        path = folder / name
        if not path.is_file():
            complaints.append(f"{name} is missing")
        elif path.stat().st_size != fact["bytes"]:
            complaints.append(f"{name} has {path.stat().st_size} bytes, not {fact['bytes']}")
        elif (hashes or path.stat().st_mtime_ns > sealed_ns) and file_digest(path) != fact["sha256"]:
            complaints.append(f"the sha256 of {name} differs")
    return complaints


def visible(folder: Path, pattern: str) -> list[Path]:
    """Return the sorted paths in a folder that match a pattern, without names that begin with a dot.

    Such names belong to folders that are being written, and to files of other programs.
    """
    below = (path for path in folder.glob(pattern) if path != folder)
    return sorted(p for p in below if not any(part.startswith(".") for part in p.relative_to(folder).parts))


@contextmanager
def temporary_folder(parent: Path) -> Iterator[Path]:
    """Yield a new temporary folder inside `parent`, and remove it after the ``with`` block unless it was renamed."""
    path = parent / f".tmp-{_tag()}"
    _live_temporaries.add(path.name)
    try:
        path.mkdir()
        yield path
    finally:
        for _ in range(2):  # one failed call leaves the rest of a folder
            shutil.rmtree(path, ignore_errors=True)
        _live_temporaries.discard(path.name)


def swap_in(temporary: Path, folder: Path) -> None:
    """Replace `folder` by a finished temporary folder.

    A folder cannot be renamed onto a folder with files, so the older one is renamed first.  If the run is killed in
    between, `remove_stale` restores it.

    Raises
    ------
    InvalidInput
        If `folder` has no sealed manifest, or a file that the manifest does not list has the name of a new file.
    """
    aside = folder.with_name(f".old-{_tag()}-{folder.name}")
    _live_temporaries.add(aside.name)
    try:
        while True:
            require_replaceable(folder)
            if conflicts := [name for name in _not_listed(folder) if os.path.lexists(temporary / name)]:
                raise InvalidInput(
                    "a new file has the name of this file, which this program did not write: move it away",
                    folder / conflicts[0],
                    code="not_ours",
                )
            with suppress(FileNotFoundError):
                folder.replace(aside)
            try:
                temporary.replace(folder)
                break
            except OSError as error:
                if error.errno not in FULL:
                    raise
                _retire(aside, folder)  # another process published meanwhile
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
    """Return the relative names of the files and folders in a published folder that its manifest does not list.

    The function repeats until manifest and files belong together: another process may publish the folder in between.
    """
    while edition := _edition(folder):
        ours = {MANIFEST}
        with suppress(InvalidInput):
            ours |= read_manifest(folder)["files"].keys()
        with suppress(FileNotFoundError):
            names = list(_names_except(folder, ours))
            if _edition(folder) == edition:
                return names
    return []


def _names_except(folder: Path, ours: set[str]) -> Iterator[str]:
    """Yield the relative names of a folder's entries, except the files in `ours`; raise OSError if unreadable."""
    parents = {parent.as_posix() for name in ours for parent in PurePosixPath(name).parents}

    def walk(inside: Path) -> Iterator[str]:
        for path in sorted(inside.iterdir()):
            name = path.relative_to(folder).as_posix()
            if _TEMPORARY.fullmatch(path.name):  # of a killed run
                continue
            if path.is_dir() and not path.is_symlink():
                if name in parents:
                    yield from walk(path)
                else:
                    yield name
            elif name not in ours:
                yield name

    yield from walk(folder)


def _retire(aside: Path, folder: Path) -> None:
    """Move the unlisted files of a replaced folder to `folder`, and delete the replaced folder.

    If a file cannot be moved, the replaced folder is not deleted.
    """
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
    """Remove the temporary folders of killed runs, and restore the folders that those runs had moved away."""
    with suppress(OSError):
        for path in list(parent.iterdir()):
            left = _TEMPORARY.fullmatch(path.name)
            if not left or path.name in _live_temporaries:
                continue
            kind, pid, machine, name = left.groups()
            # Processes of another machine cannot be checked: remove its folders after a day.
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
    """Return True if another process with this process id is running.

    Folders of the present process are listed in `_live_temporaries`.
    """
    if pid == os.getpid():
        return False
    with suppress(OSError):  # a zombie process does not run
        return Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()[0] not in "ZX"
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


@contextmanager
def writing(target: Path, *, only: set[int] | None = None) -> Iterator[None]:
    """Convert an OSError in the ``with`` block to InvalidInput; with `only`, convert just the given error numbers."""
    try:
        yield
    except OSError as error:
        if only is not None and error.errno not in only:
            raise
        raise InvalidInput(
            f"cannot write results: {error.strerror or error} ({target})",
            code="cannot_write",
            errno=error.errno,
        ) from error
