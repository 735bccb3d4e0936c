"""Store of artefacts, which are identified by a key, written atomically, and verified when they are read.

An *artefact* is the result of a stage: named arrays and notes, in ``cache/<stage>-<key>/`` as ``arrays.npz`` and
``manifest.json``.  The key is a digest of everything on which the artefact depends: options, sources, numerical
libraries and the content of its inputs.  If an input is computed again with equal content, the key stays the same.

An artefact is written to a temporary folder that is renamed when complete: a killed run leaves no partial artefact.
"""

from __future__ import annotations

import copy
import dataclasses
import errno
import itertools
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from pipeline.locks import exclusive, remove_unheld
from pipeline.storage.artefacts import (
    ARRAYS,
    Artefact,
    Damaged,
    content_digest,
    differences,
    fixed,
    packed,
    read_artefact,
)
from pipeline.storage.provenance import versions
from pipeline.storage.sealed_folders import (
    FULL,
    MANIFEST,
    canonical,
    compact,
    digest,
    read_manifest,
    remove_stale,
    sync,
    temporary_folder,
    write_bytes,
    write_manifest,
    writing,
)
from pipeline.validation import InvalidInput

_KEYED_LIBRARIES = ("numpy", "scipy", "pandas", "numba")
"""Libraries that compute results; a new version of any of them changes the key of every artefact."""
_UNREADABLE = (OSError, ValueError, KeyError, TypeError, AttributeError)
"""Errors that reading a missing or damaged manifest may raise."""
_LOCK = ".lock-"
"""Prefix of the names of lock files, which are in the same folder as the artefacts."""


Compute = Callable[[], tuple[Mapping[str, Any], Mapping[str, Any]]]
"""Type of a function that computes the arrays and notes of an artefact."""
Fits = Callable[[Artefact], object]
"""Type of a function that raises InvalidInput for an artefact that does not fit the result type of its stage."""


class Store:
    """Store of artefacts in ``<results>/cache``.

    Several processes may share one folder: a process waits for an artefact that another one computes.  Without file
    locks (Windows) both compute it, and the first to finish keeps its artefact.

    Parameters
    ----------
    results : Path
        Folder of results, created at the first write.  Temporary folders of killed runs are removed from its cache.
    waiting : callable or None
        Function that returns the context manager in which this process waits for another one.  None: never wait; if
        two processes compute the same artefact, the first to finish keeps it.
    dry_run : bool
        Whether to compute and write nothing; `artefact` then returns keys, and reasons for their changes.
    before : mapping of str to (str, str)
        Key and content of earlier artefacts by stage, with which a dry run compares.

    Attributes
    ----------
    steps : list of dict
        Stage, options, names of the inputs and code of each artefact of a dry run, as plain values.
    """

    def __init__(
        self,
        results: Path,
        waiting: Callable[[], AbstractContextManager[None]] | None = nullcontext,
        *,
        dry_run: bool = False,
        before: Mapping[str, tuple[str, str]] | None = None,
    ) -> None:
        self.results, self.cache, self.dry_run = results, results / "cache", dry_run
        self.steps: list[dict[str, Any]] = []
        self._waiting, self._before = waiting, before or {}
        self._memory: dict[str, Artefact] = {}
        if waiting and not dry_run:
            remove_stale(self.cache)
            remove_unheld(self.cache, f"{_LOCK}*")

    def forgetful(self) -> Store:
        """Return a copy of the store with empty memory; deleting the copy frees the artefacts that it has read."""
        other = copy.copy(self)
        other._memory = {}
        return other

    def artefact(
        self,
        stage: str,
        options: Any,
        inputs: Sequence[Artefact | str],
        compute: Compute,
        *,
        code: str,
        fits: Fits = lambda artefact: None,
    ) -> Artefact:
        """Return the artefact of a stage for given options and inputs; compute it if it is not in the cache.

        A dry run returns the artefact without arrays.  Its `computed` tells that the artefact is not in the cache, and
        `why` states the change since the earlier artefact.

        Parameters
        ----------
        stage : str
            Name of the stage: letters, digits and underscores.
        options : dataclass or mapping
            Values that change the result: finite numbers, text, enums, lists and mappings.
        inputs : sequence of Artefact or str
            Artefacts, or digests of files.
        compute : callable
            Function that returns (arrays, notes); called at most once.
        code : str
            Digest of the sources.
        fits : callable
            Function that raises InvalidInput for an artefact of the wrong type: it counts as damaged and is computed
            again.

        Raises
        ------
        InvalidInput
            If the options or notes have no canonical form, an array holds objects, or the results folder
            cannot be written (``cannot write results: …``).
        """
        made_from, key = self._key(stage, options, inputs, code)
        if self.dry_run:
            reads = [item.stage if isinstance(item, Artefact) else item for item in inputs]
            self.steps.append({"stage": stage, "options": made_from["options"], "reads": reads, "code": code})
            return self._planned(made_from, key)
        name = f"{stage}-{key}"
        if remembered := self._memory.get(name):
            return dataclasses.replace(
                remembered, notes=copy.deepcopy(remembered.notes), computed=False, why=""
            )
        folder = self.cache / name
        result, damage = self._found(folder, fits)
        if result is None:
            with writing(folder):
                self.cache.mkdir(parents=True, exist_ok=True)
                if not os.access(self.cache, os.W_OK | os.X_OK):  # fail before the computation, not after it
                    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            with self._alone(name):
                result, damaged_since = self._found(folder, fits)  # another process may have been faster
                if result is None:
                    why = damage or damaged_since or self._why(made_from)
                    result = self._made(folder, made_from, compute, why)
        self._memory[name] = result
        return dataclasses.replace(result, notes=copy.deepcopy(result.notes))

    def _key(
        self, stage: str, options: Any, inputs: Sequence[Artefact | str], code: str
    ) -> tuple[dict[str, Any], str]:
        """Return the origin of an artefact (stage, options, inputs, code, libraries), and its key."""
        made_from = {
            "stage": stage,
            "options": canonical(options),
            "inputs": [
                f"{item.stage}-{item.content}" if isinstance(item, Artefact) else str(item) for item in inputs
            ],
            "code": code,
            "libraries": versions(_KEYED_LIBRARIES),
        }
        return made_from, digest(compact(made_from))[:16]

    def _planned(self, made_from: dict[str, Any], key: str) -> Artefact:
        """Return the artefact of a dry run, which has no arrays.

        Its content digest is that in the cache, or the earlier one if the key is the same.  Otherwise it is unknown,
        and so are the keys of later stages.
        """
        stage, why, computed = made_from["stage"], "", False
        before, content = self._before.get(stage, ("", ""))
        if before != key:
            try:
                earlier = read_manifest(self.cache / f"{stage}-{before}")
                why = "; ".join(differences(earlier, made_from)[:3])
            except _UNREADABLE:
                why = "changed (details unknown: the earlier artefact is no longer in the cache)"
            content = ""
        try:
            content = content_digest(read_manifest(self.cache / f"{stage}-{key}"))
        except _UNREADABLE:
            computed = True
        return Artefact(stage, key, content, {}, {}, computed, why)

    @contextmanager
    def _alone(self, name: str) -> Iterator[None]:
        """Hold the exclusive lock of an artefact during the ``with`` block."""
        if self._waiting is None:
            yield
            return
        path = self.cache / f"{_LOCK}{name}"
        with ExitStack() as stack:
            with writing(path):
                stack.enter_context(exclusive(path, self._waiting))
            yield

    def _found(self, folder: Path, fits: Fits) -> tuple[Artefact | None, str]:
        """Return an artefact from the cache or None, and a message if a damaged artefact was moved away."""
        try:
            if artefact := read_artefact(folder):
                fits(artefact)
            return artefact, ""
        except (Damaged, InvalidInput) as error:
            self._set_aside(folder)
            return None, f"artefact damaged: {error}"

    def _made(
        self,
        folder: Path,
        made_from: dict[str, Any],
        compute: Compute,
        why: str,
    ) -> Artefact:
        """Compute an artefact, write it to the cache, and return it."""
        stage, _, key = folder.name.rpartition("-")
        made_arrays, made_notes = compute()
        arrays = fixed(made_arrays, stage)
        notes = json.loads(compact(canonical(made_notes, "notes")))
        facts = {**made_from, "key": key, "notes": notes}
        packed_arrays = packed(arrays)
        if winner := self._place(folder, packed_arrays, facts):
            return dataclasses.replace(winner, computed=True, why=why)
        content = content_digest({"files": {ARRAYS: {"sha256": digest(packed_arrays)}}, "notes": notes})
        return Artefact(stage, key, content, arrays, notes, True, why)

    def _why(self, made_from: dict[str, Any]) -> str:
        """Return the reason to compute an artefact: its differences from the most similar artefact of the stage."""
        candidates: list[tuple[int, float, list[str]]] = []
        for path in sorted(self.cache.glob(f"{made_from['stage']}-*/{MANIFEST}")):
            with suppress(*_UNREADABLE):  # damage is reported when the artefact is read
                changes = differences(read_manifest(path.parent), made_from)
                candidates.append((len(changes), -path.stat().st_mtime, changes))
        if not candidates:
            return "first time"
        count, _, changes = min(candidates)
        phrases = changes[:3] + ([f"and {count - 3} more"] if count > 3 else [])
        return "; ".join(phrases) or "the artefact was removed"

    def _place(self, folder: Path, content: bytes, facts: Mapping[str, Any]) -> Artefact | None:
        """Write an artefact and return None; if another process wrote the same artefact first, return that artefact."""
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
                    if winner := read_artefact(folder):
                        return winner
                except Damaged:
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
