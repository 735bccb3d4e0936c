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
import functools
import hashlib
import importlib.metadata
import io
import itertools
import json
import os
import platform
import re
import secrets
import shutil
import subprocess
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from pipeline.refusal import Refusal

PACKAGE = Path(__file__).resolve().parent
PROJECT = PACKAGE.parent
LOCK = PROJECT / "requirements.lock"
MANIFEST = "manifest.json"
ARRAYS = "arrays.npz"
TYPE = "<type>"
"""Key that keeps the class of an option in its canonical form: classes with equal fields are not equal."""

_ONLY_DRAW_OR_DESCRIBE = re.compile(r"(pictures|recording|papers)(_\w+)?\.py")
_KEYED_LIBRARIES = ("numpy", "scipy")
_PACKAGES = ("numpy", "scipy", "pandas", "hydra-core", "omegaconf", "rerun-sdk", "matplotlib")
_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_CORETYPE")
_CANNOT_WRITE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EFBIG, errno.EACCES, errno.EPERM}
_FULL = {errno.ENOTEMPTY, errno.EEXIST}
"""What a rename onto a folder with files in it answers."""
_ONE_DAY_S = 86400.0
_KINDS = "biufcUSV"
"""Kinds of array that need no pickle."""
_HERE = hashlib.sha256(platform.node().encode()).hexdigest()[:6]
"""Tells this machine's temporary folders from another's on a shared disk, without writing its name."""
_live_temporaries: set[str] = set()


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
        self._made_by = {"code": code_hash(), "libraries": _versions(_KEYED_LIBRARIES)}
        remove_stale(self.cache)

    def artefact(
        self,
        stage: str,
        options: Any,
        inputs: Sequence[Artefact | str],
        compute: Callable[[], tuple[Mapping[str, Any], Mapping[str, Any]]],
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

        Raises
        ------
        Refusal
            If the options or notes have no canonical form, an array holds objects, or the results folder
            cannot be written (``cannot write results: …``).
        """
        if not re.fullmatch(r"[A-Za-z0-9_]+", stage):
            raise Refusal("the stage has no usable name", expected="letters, digits, _", received=repr(stage))
        made_from = {
            "stage": stage,
            "options": canonical(options),
            "inputs": [item.name if isinstance(item, Artefact) else str(item) for item in inputs],
            **self._made_by,
        }
        key = digest(_compact(made_from))[:16]
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
            with _writing(folder):
                self.cache.mkdir(parents=True, exist_ok=True)
                if not os.access(self.cache, os.W_OK | os.X_OK):  # learnt before the work, not after it
                    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            why = damage or self._why(made_from)
            started = time.perf_counter()
            made_arrays, made_notes = compute()
            seconds = time.perf_counter() - started
            arrays = _fixed(made_arrays, stage)
            notes = json.loads(_compact(canonical(made_notes, "notes")))
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
        raises, the older `folder` stays as it was.

        Raises
        ------
        Refusal
            If the results cannot be written.
        """
        with _writing(folder):
            folder.parent.mkdir(parents=True, exist_ok=True)
        remove_stale(folder.parent)
        with _writing(folder, only=_CANNOT_WRITE), temporary_folder(folder.parent) as temporary:
            publication = Publication(temporary)
            yield publication
            publication._seal()
            _swap_in(temporary, folder)

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
        packed = _packed(arrays)
        with _writing(folder):
            while True:
                with temporary_folder(self.cache) as temporary:
                    write_bytes(temporary / ARRAYS, packed)
                    write_manifest(temporary, facts)
                    try:
                        temporary.replace(folder)
                    except OSError as error:
                        if error.errno not in _FULL:
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
        with _writing(folder):
            (self.cache / "damaged").mkdir(exist_ok=True)
            for n in itertools.count(1):
                try:
                    folder.rename(self.cache / "damaged" / f"{folder.name}-{n}")
                except FileNotFoundError:
                    return  # another process was faster
                except OSError as error:
                    if error.errno not in _FULL:
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
            raise Refusal(
                f"the array {name!r} cannot be kept",
                where=stage,
                expected="numbers, booleans or text",
                received=f"{type(value).__name__} of {array.dtype}",
            )
        if not re.fullmatch(r"\w[\w.\-/]*", name) or name.endswith(".npy"):
            raise Refusal("an array has no usable name", where=stage, received=repr(name))
        contiguous = array.flags.c_contiguous or array.flags.f_contiguous
        fixed[name] = (array if contiguous else array.copy(order="C")).view()
        fixed[name].setflags(write=False)
    return MappingProxyType(fixed)


def _packed(arrays: Mapping[str, np.ndarray]) -> bytes:
    """The bytes of an ``.npz``: equal arrays give equal bytes, for no time of day is in them."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
    return buffer.getvalue()


def canonical(value: Any, where: str = "options") -> Any:
    """The value as JSON can hold it, in one way only; a dataclass keeps the name of its class.

    Raises
    ------
    Refusal
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
            raise Refusal("a key cannot be kept", where=where, expected="text", received=repr(strange[0]))
        return {key: canonical(value[key], f"{where}.{key}") for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [canonical(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, float) and not np.isfinite(value):
        raise Refusal("the number is not finite", where=where, received=repr(value))
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise Refusal(
        "the value cannot be kept",
        where=where,
        expected="a number, text, enum, list, mapping or dataclass",
        received=type(value).__name__,
    )


def _compact(value: Any) -> bytes:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


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
    manifest["seal"] = digest(_compact(manifest))
    write_bytes(folder / MANIFEST, json.dumps(manifest, sort_keys=True, indent=1).encode() + b"\n")
    sync(folder)


def complaints_about(folder: Path, *, hashes: bool = True) -> list[str]:
    """What is wrong with a folder that `write_manifest` sealed; empty if nothing is.

    Parameters
    ----------
    folder : Path
    hashes : bool
        Also read every file and compare its sha256; without it, sizes only.
    """
    try:
        manifest = json.loads((folder / MANIFEST).read_bytes())
        seal = manifest.pop("seal")
        if digest(_compact(manifest)) != seal:
            return [f"{MANIFEST} was changed"]
        files = manifest["files"].items()
    except FileNotFoundError:
        return [f"{MANIFEST} is missing"]
    except (ValueError, KeyError, AttributeError, TypeError):
        return [f"{MANIFEST} cannot be understood"]
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


def _swap_in(temporary: Path, folder: Path) -> None:
    """Put a finished temporary folder in the place of `folder`.

    A full folder cannot be renamed over another: the older one steps aside for an instant, under a name from
    which `remove_stale` brings it back should the run be killed just there.
    """
    aside = folder.with_name(f".old-{_tag()}-{folder.name}")
    _live_temporaries.add(aside.name)
    try:
        while True:
            with suppress(FileNotFoundError):
                folder.replace(aside)
            try:
                temporary.replace(folder)
                break
            except OSError as error:
                if error.errno not in _FULL:
                    raise
                shutil.rmtree(aside, ignore_errors=True)  # another process published just now: its turn to go
        sync(folder.parent)
    except BaseException:
        if not folder.exists() and aside.exists():
            aside.replace(folder)
        raise
    finally:
        if folder.exists():
            shutil.rmtree(aside, ignore_errors=True)
        _live_temporaries.discard(aside.name)


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
            if kind == "old" and name and not (parent / name).exists():
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
def _writing(target: Path, *, only: set[int] | None = None) -> Iterator[None]:
    """Turn a failing disk into a sentence; `only` limits it to errors that cannot be anything else."""
    try:
        yield
    except OSError as error:
        if only is not None and error.errno not in only:
            raise
        raise Refusal(f"cannot write results: {error.strerror or error} ({target})") from error


@functools.cache
def code_hash() -> str:
    """The sha256 of the package's sources, except those that only draw or describe."""
    sources = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        relative = path.relative_to(PACKAGE).as_posix()
        if not _ONLY_DRAW_OR_DESCRIBE.fullmatch(relative):
            sources.update(f"{relative}\0{file_digest(path)}\n".encode())
    return sources.hexdigest()


@functools.cache
def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _versions(packages: Sequence[str]) -> dict[str, str]:
    return {package: _version(package) for package in packages}


def _git(*arguments: str) -> str | None:
    """What git says of the project, None without git or outside the project's own repository."""
    try:
        answer = subprocess.run(
            ["git", "-C", str(PROJECT), *arguments],
            capture_output=True,
            text=True,
            timeout=20,
            env={**os.environ, "GIT_OPTIONAL_LOCKS": "0"},
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip() if answer.returncode == 0 else None


def provenance() -> dict[str, Any]:
    """With what a result was made: versions, commit, machine type, threads and lock file.

    Holds no path and no name of a person or machine.  ``commit`` and ``dirty`` are ``"unknown"`` without git.
    """
    top = _git("rev-parse", "--show-toplevel")
    ours = top is not None and Path(top).resolve() == PROJECT
    commit = _git("rev-parse", "--verify", "HEAD") if ours else None
    changes = _git("status", "--porcelain") if ours else None
    return {
        "python": platform.python_version(),
        "packages": _versions(_PACKAGES),
        "commit": commit or "unknown",
        "dirty": "unknown" if changes is None else bool(changes),
        "machine": platform.machine(),
        "system": platform.system(),
        "threads": {name: os.environ.get(name, "not set") for name in _THREAD_VARIABLES},
        "lock_sha256": file_digest(LOCK) if LOCK.is_file() else "absent",
    }


def derive_generator(seed: int, stage_name: str) -> np.random.Generator:
    """A generator of random numbers that depends on the seed and the stage, and on nothing else."""
    entropy = int(digest(f"{seed}:{stage_name}".encode()), 16)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy)))
