"""Artefacts (the results of stages) as folders: reading, packing, and differences between two artefacts."""

from __future__ import annotations

import dataclasses
import io
import json
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from pipeline.reading import MAX_BYTES, read_arrays, read_file
from pipeline.storage.sealed_folders import (
    ARTEFACT,
    MANIFEST,
    compact,
    complaints_about,
    digest,
    read_manifest,
)
from pipeline.validation import InvalidInput

ARRAYS = "arrays.npz"

_KINDS = "biufcUSV"
"""NumPy's codes of the data types that can be stored without pickle."""


@dataclasses.dataclass(frozen=True, eq=False)
class Artefact:
    """Result of a stage, computed now or read from the cache.

    Attributes
    ----------
    stage, key : str
        Parts of the folder's name, ``<stage>-<key>``.
    content : str
        Digest of arrays and notes, from which the keys of later stages are computed; empty if unknown.
    arrays : mapping of str to np.ndarray
        Arrays: read-only, contiguous, bit-identical whether computed or read.
    notes : dict
        Plain JSON values.
    computed : bool
        False if the artefact was found in the cache.
    why : str
        Reason for the computation: ``"first time"``, ``"options.step changed 1 -> 5"``, …; empty if reused.
    """

    stage: str
    key: str
    content: str
    arrays: Mapping[str, np.ndarray]
    notes: dict[str, Any]
    computed: bool
    why: str

    @property
    def name(self) -> str:
        """Name of the artefact's folder: stage and key."""
        return f"{self.stage}-{self.key}"

    @property
    def facts(self) -> dict[str, Any]:
        """Entry for this artefact in a figure's manifest."""
        return {"key": self.key, "content": self.content}


def content_digest(manifest: Mapping[str, Any]) -> str:
    """Return the digest of an artefact's arrays and notes, computed from the artefact's manifest."""
    return digest(compact([manifest["files"][ARRAYS]["sha256"], manifest["notes"]]))[:16]


class Damaged(Exception):
    """Error for an artefact whose files differ from the files that were written.

    Parameters
    ----------
    what : str
        The difference.
    """

    def __init__(self, what: str) -> None:
        super().__init__(what)


def read_artefact(folder: Path) -> Artefact | None:
    """Return the verified artefact in a folder; None if the folder does not exist.

    Raises `Damaged` if the artefact differs from its manifest.
    """
    if not folder.is_dir():
        return None
    try:
        if complaints := complaints_about(folder, hashes=False):
            raise Damaged(complaints[0])
        manifest = read_manifest(folder, ARTEFACT)
        if f"{manifest['stage']}-{manifest['key']}" != folder.name:
            raise Damaged(f"{MANIFEST} belongs to {manifest['stage']}-{manifest['key']}")
        content = read_file(folder / ARRAYS, at_most=MAX_BYTES, subject=ARRAYS)
        if ARRAYS not in manifest["files"] or digest(content) != manifest["files"][ARRAYS]["sha256"]:
            raise Damaged(f"the sha256 of {ARRAYS} differs")
        arrays = read_arrays(folder / ARRAYS, content, subject=ARRAYS)
    except OSError as error:
        raise Damaged(f"cannot be read: {error.strerror}") from error
    except InvalidInput as error:
        raise Damaged(error.what) from error
    for array in arrays.values():
        array.setflags(write=False)
    facts = {name: manifest[name] for name in ("stage", "key", "notes")}
    return Artefact(
        **facts, content=content_digest(manifest), arrays=MappingProxyType(arrays), computed=False, why=""
    )


def fixed(arrays: Mapping[str, Any], stage: str) -> Mapping[str, np.ndarray]:
    """Return arrays as read-only views, with the same memory layout as if they were read from disk."""
    fixed_arrays = {}
    for name, value in arrays.items():
        array = np.asarray(value)
        if isinstance(value, np.ma.MaskedArray) or array.dtype.hasobject or array.dtype.kind not in _KINDS:
            raise InvalidInput(
                f"the array {name!r} cannot be stored",
                stage,
                "numbers, booleans or text",
                f"{type(value).__name__} of {array.dtype}",
                code="not_storable",
                array=name,
                type=type(value).__name__,
            )
        if not re.fullmatch(r"\w[\w.\-/]*", name) or name.endswith(".npy"):
            raise InvalidInput(
                "the name of an array cannot be used as a file name",
                stage,
                received=repr(name),
                code="unusable_name",
            )
        contiguous = array.flags.c_contiguous or array.flags.f_contiguous
        fixed_arrays[name] = (array if contiguous else array.copy(order="C")).view()
        fixed_arrays[name].setflags(write=False)
    return MappingProxyType(fixed_arrays)


def packed(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return the content of an ``.npz`` file without time stamps, so that equal arrays give equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
    return buffer.getvalue()


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return phrases for the changes of code, libraries, options and inputs between two artefacts of a stage."""
    changes = []
    if before["code"] != now["code"]:
        changes.append("code changed")
    for part in ("libraries", "options"):
        old, new = _leaves(before[part], part), _leaves(now[part], part)
        for path in sorted(old.keys() | new.keys()):
            if old.get(path) != new.get(path):
                changes.append(f"{path} changed {old.get(path, 'absent')} -> {new.get(path, 'absent')}")
    gone, came = before["inputs"], now["inputs"]
    fresh = [name for name in came if name not in gone]
    changes += [f"input {name if len(name) < 40 else name[:12] + '…'} changed" for name in fresh]
    if gone != came and not fresh:
        changes.append(f"inputs changed in number or order ({len(gone)} -> {len(came)})")
    return changes


def _leaves(value: Any, path: str) -> dict[str, str]:
    """Return the JSON text of each value in nested mappings, by dotted path."""
    if isinstance(value, dict):
        return {k: v for name, part in value.items() for k, v in _leaves(part, f"{path}.{name}").items()}
    return {path: json.dumps(value)}
