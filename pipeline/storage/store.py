"""Where artefacts and results live: found by a key, written whole or not at all, checked when read.

An *artefact* is what a stage hands to the next: named arrays and notes, in ``cache/<stage>-<key>/`` as
``arrays.npz`` and ``manifest.json``.  The key is a digest of everything that the artefact is made from, so a
changed option, input, line of code or numerical library gives another key, and equal work is found again.
A *publication* is what a person gets: the folder of one figure.

Both appear by one rename of a finished temporary folder; ``manifest.json`` is written last and carries the
size and digest of every other file and of itself.  Whatever kills a run leaves the old state or the new one.
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
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

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
_KINDS = "biufcUSV"
"""Kinds of array that need no pickle."""


@dataclasses.dataclass(frozen=True, eq=False)
class Artefact:
    """What a stage made, or made before.

    Attributes
    ----------
    stage, key : str
        Together the folder's name.
    arrays : mapping of str to np.ndarray
        Read-only, C- or Fortran-contiguous, the same bits whether computed now or read back.
    notes : dict
        Small facts, as JSON gives them back.
    computed : bool
        False when it was found and reused.
    seconds : float
        What the computation took, when it was made.
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
        """Stage and key, as a folder's name and as another artefact's input."""
        return f"{self.stage}-{self.key}"


class Publication:
    """The temporary folder in which a figure's files are made ready.

    Attributes
    ----------
    folder : Path
        Write the files here.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._facts: Mapping[str, Any] | None = None

    def manifest(self, facts: Mapping[str, Any]) -> None:
        """State what the manifest says; the size and digest of every file are added when the body ends."""
        self._facts = facts

    def _seal(self) -> None:
        if self._facts is None:
            raise RuntimeError("the publication has no manifest: call manifest(facts) before it ends")
        write_manifest(self.folder, self._facts)


class Store:
    """Artefacts under ``<results>/cache`` and publications anywhere below `results`.

    Several processes may share one folder: of two that compute the same artefact the first to finish wins.

    Parameters
    ----------
    results : Path
        Made at the first write.  Temporary folders that a killed run left in its cache are removed.
    """

    def __init__(self, results: Path) -> None:
        self.results = Path(results)
        self.cache = self.results / "cache"
        self._memory: dict[str, Artefact] = {}
        self._libraries = versions(_KEYED_LIBRARIES)
        remove_stale(self.cache)

    def artefact(
        self,
        stage: str,
        options: Any,
        inputs: Sequence[Artefact | str],
        compute: Callable[[], tuple[Mapping[str, Any], Mapping[str, Any]]],
        *,
        code: str,
    ) -> Artefact:
        """The artefact that this stage makes from these options and inputs, computed only if need be.

        Parameters
        ----------
        stage : str
            Letters, digits and underscores.
        options : dataclass or mapping
            Of finite numbers, text, enums, lists and further mappings; whatever changes the result.
        inputs : sequence of Artefact or str
            Artefacts, or digests of files.
        compute : callable
            Returns (arrays, notes).  Called at most once.
        code : str
            Digest of the sources that do the work.

        Raises
        ------
        InvalidInput
            If the options or notes have no canonical form, an array holds objects, or the results folder
            cannot be written (``cannot write results: …``).
        """
        if not re.fullmatch(r"[A-Za-z0-9_]+", stage):
            raise InvalidInput(
                "the stage has no usable name", expected="letters, digits, _", received=repr(stage)
            )
        made_from = {
            "stage": stage,
            "options": canonical(options),
            "inputs": [item.name if isinstance(item, Artefact) else str(item) for item in inputs],
            "code": code,
            "libraries": self._libraries,
        }
        key = digest(compact(made_from))[:16]
        name = f"{stage}-{key}"
        if known := self._memory.get(name):
            return dataclasses.replace(known, notes=copy.deepcopy(known.notes), computed=False, why="")
        folder = self.cache / name
        damage = ""
        try:
            found = _read(folder)
        except _Damaged as error:
            damage = f"artefact damaged: {error}"
            self._set_aside(folder)
            found = None
        if found is None:
            with writing(folder):
                self.cache.mkdir(parents=True, exist_ok=True)
                if not os.access(self.cache, os.W_OK | os.X_OK):  # learnt before the work, not after it
                    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            why = damage or self._why(made_from)
            started = time.perf_counter()
            made_arrays, made_notes = compute()
            seconds = time.perf_counter() - started
            arrays = _fixed(made_arrays, stage)
            notes = json.loads(compact(canonical(made_notes, "notes")))
            facts = {**made_from, "key": key, "notes": notes, "seconds": round(seconds, 6)}
            found = Artefact(stage, key, arrays, notes, True, facts["seconds"], why)
            if winner := self._place(folder, arrays, facts):
                found = dataclasses.replace(winner, computed=True, seconds=found.seconds, why=why)
        self._memory[name] = found
        return dataclasses.replace(found, notes=copy.deepcopy(found.notes))

    @contextmanager
    def publish(self, folder: Path) -> Iterator[Publication]:
        """A folder beside `folder` to fill, which takes its place when the body ends well.

        The body writes files into ``publication.folder`` and calls ``publication.manifest(facts)``.  If it
        raises, the older `folder` stays as it was.  Files in the older one that its manifest does not list are
        kept: they move into the new one.

        Raises
        ------
        InvalidInput
            If the results cannot be written, or what stands at `folder` carries no manifest of ours.
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
        """What differs from the most alike artefact of the same stage."""
        nearest: tuple[int, float, list[str]] | None = None
        for path in sorted(self.cache.glob(f"{made_from['stage']}-*/{MANIFEST}")):
            try:
                differences = _differences(json.loads(path.read_bytes()), made_from)
                candidate = (len(differences), -path.stat().st_mtime, differences)
            except (OSError, ValueError, KeyError, TypeError, AttributeError):
                continue  # damaged: only its own reader may judge it
            nearest = min(nearest, candidate) if nearest else candidate
        if nearest is None:
            return "first time"
        shown = nearest[2][:3] + ([f"and {len(nearest[2]) - 3} more"] if len(nearest[2]) > 3 else [])
        return "; ".join(shown) or "the artefact was removed"

    def _place(
        self, folder: Path, arrays: Mapping[str, np.ndarray], facts: Mapping[str, Any]
    ) -> Artefact | None:
        """Write an artefact; None, or the other process's if that was faster."""
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
        """Move a damaged artefact out of the way, so that a person can look at it."""
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


class _Damaged(Exception):
    """An artefact that is not what was written."""


def _read(folder: Path) -> Artefact | None:
    """A verified artefact, None if there is none; `_Damaged` says what is wrong."""
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
    return Artefact(
        manifest["stage"],
        manifest["key"],
        MappingProxyType(arrays),
        manifest["notes"],
        False,
        manifest["seconds"],
        "",
    )


def _fixed(arrays: Mapping[str, Any], stage: str) -> Mapping[str, np.ndarray]:
    """Read-only arrays, laid out in memory as they will be when read back."""
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
    """The bytes of an ``.npz``: equal arrays give equal bytes, for no time of day is in them."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
    return buffer.getvalue()


def _differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Sentences on what changed between two artefacts of one stage."""
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
    """``{dotted path: JSON text}`` of everything that is not a mapping."""
    if isinstance(value, dict):
        return {k: v for name, part in value.items() for k, v in _leaves(part, f"{path}.{name}").items()}
    return {path: json.dumps(value)}
