"""The store: artefacts found by a key, and published figures; written atomically, verified when read.

An *artefact* is the result of a stage: named arrays and notes, in ``cache/<stage>-<key>/`` as ``arrays.npz`` and
``manifest.json``.  The key is a digest of everything that the artefact depends on: options, inputs, sources and
numerical libraries.  A *publication* is the folder of one figure.

Both are written to a temporary folder that is renamed when complete: a killed run leaves the old state or the new one.
"""

from __future__ import annotations

import copy
import dataclasses
import errno
import io
import itertools
import json
import os
import re
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from pipeline.locks import exclusive, remove_unheld
from pipeline.storage.provenance import versions
from pipeline.storage.sealed_folders import (
    CANNOT_WRITE,
    FULL,
    MANIFEST,
    canonical,
    compact,
    complaints_about,
    digest,
    remove_stale,
    require_replaceable,
    swap_in,
    sync,
    temporary_folder,
    write_bytes,
    write_manifest,
    writing,
)
from pipeline.validation import InvalidInput

ARRAYS = "arrays.npz"
_KEYED_LIBRARIES = ("numpy", "scipy")
_LOCK = ".lock-"
"""Beginning of the name of a lock file, beside the artefacts."""
_KINDS = "biufcUSV"
"""Kinds of data types that are stored without pickle."""


@dataclasses.dataclass(frozen=True, eq=False)
class Artefact:
    """The result of a stage, computed or found in the cache.

    Attributes
    ----------
    stage, key : str
        Name of the folder: ``<stage>-<key>``.
    arrays : mapping of str to np.ndarray
        Read-only, contiguous, bit-identical whether computed or read.
    notes : dict
        Plain JSON values.
    computed : bool
        False if it was found in the cache.
    seconds : float
        Duration of the computation.
    why : str
        Why it was computed, empty when reused: ``"first time"``, ``"options.step changed 1 -> 5"``, …
    """

    stage: str
    key: str
    arrays: Mapping[str, np.ndarray]
    notes: dict[str, Any]
    computed: bool
    seconds: float
    why: str

    @property
    def name(self) -> str:
        """Stage and key: the name of the folder, and of an input of another artefact."""
        return f"{self.stage}-{self.key}"


class Publication:
    """The temporary folder of a figure that is being published.

    Attributes
    ----------
    folder : Path
        Write the files here.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._facts: Mapping[str, Any] | None = None

    def manifest(self, facts: Mapping[str, Any]) -> None:
        """Set the content of the manifest; the size and digest of every file are added at the end."""
        self._facts = facts

    def _seal(self) -> None:
        if self._facts is None:
            raise RuntimeError("the publication has no manifest: call manifest(facts) before it ends")
        write_manifest(self.folder, self._facts)


class Store:
    """Artefacts under ``<results>/cache`` and publications anywhere below `results`.

    Several processes may share one folder: an artefact that another one computes is waited for.  Where files cannot
    be locked (Windows) both compute it, and that of the first to finish is kept.

    Parameters
    ----------
    results : Path
        Created at the first write.  Temporary folders of killed runs are removed from its cache.
    waiting : callable
        Makes the context in which another process's artefact is waited for.
    """

    def __init__(
        self, results: Path, waiting: Callable[[], AbstractContextManager[None]] = nullcontext
    ) -> None:
        self.results = Path(results)
        self._waiting = waiting
        self.cache = self.results / "cache"
        self._memory: dict[str, Artefact] = {}
        self._libraries = versions(_KEYED_LIBRARIES)
        remove_stale(self.cache)
        remove_unheld(self.cache, f"{_LOCK}*")

    def artefact(
        self,
        stage: str,
        options: Any,
        inputs: Sequence[Artefact | str],
        compute: Callable[[], tuple[Mapping[str, Any], Mapping[str, Any]]],
        *,
        code: str,
    ) -> Artefact:
        """Return the artefact of a stage for these options and inputs; compute it if it is not in the cache.

        Parameters
        ----------
        stage : str
            Letters, digits and underscores.
        options : dataclass or mapping
            Whatever changes the result: finite numbers, text, enums, lists and mappings.
        inputs : sequence of Artefact or str
            Artefacts, or digests of files.
        compute : callable
            Returns (arrays, notes).  Called at most once.
        code : str
            Digest of the sources.

        Raises
        ------
        InvalidInput
            If the options or notes have no canonical form, an array holds objects, or the results folder
            cannot be written (``cannot write results: …``).
        """
        if not re.fullmatch(r"[A-Za-z0-9_]+", stage):
            raise InvalidInput(
                "no usable name", where="stage", expected="letters, digits, _", received=repr(stage)
            )
        made_from, key = self._key(stage, options, inputs, code)
        name = f"{stage}-{key}"
        if known := self._memory.get(name):
            return dataclasses.replace(known, notes=copy.deepcopy(known.notes), computed=False, why="")
        folder = self.cache / name
        found, damage = self._found(folder)
        if found is None:
            with writing(folder):
                self.cache.mkdir(parents=True, exist_ok=True)
                if not os.access(self.cache, os.W_OK | os.X_OK):  # before the work, not after it
                    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            with self._alone(name):
                found, damaged_since = self._found(folder)  # another process may have been faster
                if found is None:
                    why = damage or damaged_since or self._why(made_from)
                    found = self._made(folder, made_from, compute, why)
        self._memory[name] = found
        return dataclasses.replace(found, notes=copy.deepcopy(found.notes))

    def _key(
        self, stage: str, options: Any, inputs: Sequence[Artefact | str], code: str
    ) -> tuple[dict[str, Any], str]:
        """Return what an artefact is made from, and its key."""
        made_from = {
            "stage": stage,
            "options": canonical(options),
            "inputs": [item.name if isinstance(item, Artefact) else str(item) for item in inputs],
            "code": code,
            "libraries": self._libraries,
        }
        return made_from, digest(compact(made_from))[:16]

    @contextmanager
    def _alone(self, name: str) -> Iterator[None]:
        """Hold the lock of an artefact."""
        path = self.cache / f"{_LOCK}{name}"
        with ExitStack() as held:
            with writing(path):
                held.enter_context(exclusive(path, self._waiting))
            yield

    def _found(self, folder: Path) -> tuple[Artefact | None, str]:
        """Return an artefact, None if there is none; and what is wrong with one that was therefore set aside."""
        try:
            return _read(folder), ""
        except _Damaged as error:
            self._set_aside(folder)
            return None, f"artefact damaged: {error}"

    def _made(
        self,
        folder: Path,
        made_from: dict[str, Any],
        compute: Callable[[], tuple[Mapping[str, Any], Mapping[str, Any]]],
        why: str,
    ) -> Artefact:
        """Compute an artefact and keep it."""
        stage, _, key = folder.name.rpartition("-")
        started = time.perf_counter()
        made_arrays, made_notes = compute()
        seconds = round(time.perf_counter() - started, 6)
        arrays = _fixed(made_arrays, stage)
        notes = json.loads(compact(canonical(made_notes, "notes")))
        facts = {**made_from, "key": key, "notes": notes, "seconds": seconds}
        if winner := self._place(folder, arrays, facts):
            return dataclasses.replace(winner, computed=True, seconds=seconds, why=why)
        return Artefact(stage, key, arrays, notes, True, seconds, why)

    @contextmanager
    def publish(self, folder: Path) -> Iterator[Publication]:
        """Fill a temporary folder that replaces `folder` when the ``with`` block ends without an exception.

        The block writes files into ``publication.folder`` and calls ``publication.manifest(facts)``.  If it raises,
        `folder` is not changed.  Files in `folder` that its manifest does not list move into the new folder.

        Raises
        ------
        InvalidInput
            If the results cannot be written, or `folder` exists and has no sealed manifest.
        """
        with writing(folder):
            folder.parent.mkdir(parents=True, exist_ok=True)
        remove_stale(folder.parent)
        require_replaceable(folder)
        with writing(folder, only=CANNOT_WRITE), temporary_folder(folder.parent) as temporary:
            publication = Publication(temporary)
            yield publication
            publication._seal()
            swap_in(temporary, folder)

    def _why(self, made_from: dict[str, Any]) -> str:
        """Return what differs from the most similar artefact of the same stage."""
        nearest: tuple[int, float, list[str]] | None = None
        for path in sorted(self.cache.glob(f"{made_from['stage']}-*/{MANIFEST}")):
            try:
                differences = _differences(json.loads(path.read_bytes()), made_from)
                candidate = (len(differences), -path.stat().st_mtime, differences)
            except (OSError, ValueError, KeyError, TypeError, AttributeError):
                continue  # damaged, which is reported when it is read
            nearest = min(nearest, candidate) if nearest else candidate
        if nearest is None:
            return "first time"
        shown = nearest[2][:3] + ([f"and {len(nearest[2]) - 3} more"] if len(nearest[2]) > 3 else [])
        return "; ".join(shown) or "the artefact was removed"

    def _place(
        self, folder: Path, arrays: Mapping[str, np.ndarray], facts: Mapping[str, Any]
    ) -> Artefact | None:
        """Write an artefact; return that of another process if it was faster, else None."""
        content = packed(arrays)
        with writing(folder):
            while True:
                with temporary_folder(self.cache) as temporary:
                    write_bytes(temporary / ARRAYS, content)
                    write_manifest(temporary, facts)
                    try:
                        temporary.replace(folder)
                    except OSError as error:
                        if error.errno not in FULL:
                            raise
                    else:
                        sync(self.cache)
                        return None
                try:
                    if winner := _read(folder):
                        return winner
                except _Damaged:
                    self._set_aside(folder)

    def _set_aside(self, folder: Path) -> None:
        """Move a damaged artefact to ``cache/damaged``."""
        with writing(folder):
            (self.cache / "damaged").mkdir(exist_ok=True)
            for n in itertools.count(1):
                try:
                    folder.rename(self.cache / "damaged" / f"{folder.name}-{n}")
                except FileNotFoundError:
                    return  # another process was faster
                except OSError as error:
                    if error.errno not in FULL:
                        raise
                else:
                    return


class Plan(Store):
    """A store that computes nothing: it returns the keys that artefacts would have, and why they differ.

    Parameters
    ----------
    results : Path
    before : mapping of str to str
        Keys of earlier artefacts by stage, to compare with.
    """

    def __init__(self, results: Path, before: Mapping[str, str]) -> None:
        self.cache, self.before = Path(results) / "cache", before
        self._libraries = versions(_KEYED_LIBRARIES)

    def artefact(
        self,
        stage: str,
        options: Any,
        inputs: Sequence[Artefact | str],
        compute: Callable[[], tuple[Mapping[str, Any], Mapping[str, Any]]],
        *,
        code: str,
    ) -> Artefact:
        """Return an artefact without arrays: `computed` if it is not in the cache, `why` it differs from before."""
        made_from, key = self._key(stage, options, inputs, code)
        before, why = self.before.get(stage, ""), ""
        if before != key:
            try:
                earlier = json.loads((self.cache / f"{stage}-{before}" / MANIFEST).read_bytes())
                why = "; ".join(_differences(earlier, made_from)[:3])
            except (OSError, ValueError, KeyError, TypeError, AttributeError):
                why = "changed; what it was made from is no longer in the cache"
        there = (self.cache / f"{stage}-{key}" / MANIFEST).is_file()
        return Artefact(stage, key, {}, {}, not there, 0.0, why)


class _Damaged(Exception):
    """An artefact that differs from what was written."""


def _read(folder: Path) -> Artefact | None:
    """Return a verified artefact, None if there is none.  Raises `_Damaged`."""
    if not folder.is_dir():
        return None
    try:
        if complaints := complaints_about(folder, hashes=False):
            raise _Damaged(complaints[0])
        manifest = json.loads((folder / MANIFEST).read_bytes())
        if f"{manifest['stage']}-{manifest['key']}" != folder.name:
            raise _Damaged(f"{MANIFEST} belongs to {manifest['stage']}-{manifest['key']}")
        content = (folder / ARRAYS).read_bytes()
        if digest(content) != manifest["files"][ARRAYS]["sha256"]:
            raise _Damaged(f"{ARRAYS} sha256 differs")
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except OSError as error:
        raise _Damaged(f"cannot be read: {error.strerror}") from error
    except (KeyError, ValueError, zipfile.BadZipFile) as error:
        raise _Damaged(f"cannot be understood: {error!r}") from error
    for array in arrays.values():
        array.setflags(write=False)
    facts = {name: manifest[name] for name in ("stage", "key", "notes", "seconds")}
    return Artefact(**facts, arrays=MappingProxyType(arrays), computed=False, why="")


def _fixed(arrays: Mapping[str, Any], stage: str) -> Mapping[str, np.ndarray]:
    """Return read-only arrays with the memory layout that they will have when read."""
    fixed = {}
    for name, value in arrays.items():
        array = np.asarray(value)
        if isinstance(value, np.ma.MaskedArray) or array.dtype.hasobject or array.dtype.kind not in _KINDS:
            raise InvalidInput(
                f"the array {name!r} cannot be kept",
                where=stage,
                expected="numbers, booleans or text",
                received=f"{type(value).__name__} of {array.dtype}",
            )
        if not re.fullmatch(r"\w[\w.\-/]*", name) or name.endswith(".npy"):
            raise InvalidInput("an array has no usable name", where=stage, received=repr(name))
        contiguous = array.flags.c_contiguous or array.flags.f_contiguous
        fixed[name] = (array if contiguous else array.copy(order="C")).view()
        fixed[name].setflags(write=False)
    return MappingProxyType(fixed)


def packed(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return the bytes of an ``.npz`` without time stamps, so that equal arrays give equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
    return buffer.getvalue()


def _differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return what changed between two artefacts of one stage, in phrases."""
    told = []
    if before["code"] != now["code"]:
        told.append("code changed")
    for part in ("libraries", "options"):
        old, new = _leaves(before[part], part), _leaves(now[part], part)
        for path in sorted(old.keys() | new.keys()):
            if old.get(path) != new.get(path):
                told.append(f"{path} changed {old.get(path, 'absent')} -> {new.get(path, 'absent')}")
    gone, came = before["inputs"], now["inputs"]
    fresh = [name for name in came if name not in gone]
    told += [f"input {name if len(name) < 40 else name[:12] + '…'} changed" for name in fresh]
    if gone != came and not fresh:
        told.append(f"inputs changed in number or order ({len(gone)} -> {len(came)})")
    return told


def _leaves(value: Any, path: str) -> dict[str, str]:
    """Return the JSON text of everything that is not a mapping, by dotted path."""
    if isinstance(value, dict):
        return {k: v for name, part in value.items() for k, v in _leaves(part, f"{path}.{name}").items()}
    return {path: json.dumps(value)}
