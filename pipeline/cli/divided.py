"""Stages that several jobs compute together: the items of each `map_processes` in it are divided among them.

Every job runs the whole stage and leaves what it has made of a block of items in a file, where the others find it.
None waits for another: who finds all blocks begun makes those that are not there yet as well, so that a job that dies
costs its blocks and no more.  The first to have the artefact keeps it, and the others stop.
"""

from __future__ import annotations

import pickle
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from pipeline.processes import divided_by, map_processes
from pipeline.storage.artefacts import Artefact
from pipeline.storage.sealed_folders import digest, write_bytes
from pipeline.storage.store import Compute, Store

_BLOCKS_OF_EACH = 4
"""Blocks to a job: what two make twice is at most about one of them."""

_SEAL = len(digest(b""))
"""Bytes of the digest before the content of a block's file."""


class _Elsewhere(Exception):
    """Another job has the artefact."""


class DividedStore(Store):
    """A store whose artefacts are computed together with other jobs that see the same folder.

    Parameters
    ----------
    results : Path
    job, jobs : int
        Number of this job, from 0, and how many there are.
    """

    def __init__(self, results: Path, job: int, jobs: int) -> None:
        super().__init__(results)
        self._job, self._jobs = job, jobs

    @contextmanager
    def _alone(self, name: str) -> Iterator[None]:
        yield

    def _made(
        self,
        folder: Path,
        made_from: dict[str, Any],
        compute: Compute,
        why: str,
    ) -> Artefact:
        blocks = _Blocks(folder, self._job, self._jobs)
        try:
            with divided_by(blocks.map):
                return super()._made(folder, made_from, compute, why)
        except _Elsewhere:
            found, damage = self._found(folder)
            if found is None:  # removed or damaged since
                return self._made(folder, made_from, compute, damage or why)
            return replace(found, computed=True, why=why)
        finally:
            if folder.exists():
                shutil.rmtree(blocks.folder, ignore_errors=True)


class _Blocks:
    """Blocks of the items of one stage, in files of a hidden folder beside its artefact."""

    def __init__(self, artefact: Path, job: int, jobs: int) -> None:
        self.folder = artefact.with_name(f".blocks-{artefact.name}")
        self._artefact, self._job, self._jobs, self._calls = artefact, job, jobs, 0

    def map(self, function: Callable[[Any], Any], items: list[Any], workers: int) -> list[Any]:
        """``[function(item) for item in items]``, of which other jobs make a part."""
        self._calls += 1
        size = max(1, -(-len(items) // (_BLOCKS_OF_EACH * self._jobs)))
        starts = range(0, len(items), size)
        place = self.folder / f"{self._calls}_{len(items)}_{size}"
        place.mkdir(parents=True, exist_ok=True)
        first = len(starts) * self._job // self._jobs
        order = [*starts[first:], *starts[:first]]
        found: dict[int, list[Any]] = {}
        for mine_alone in (True, False):
            for start in order:
                path = place / f"{start}.pickle"
                if path.exists() or (mine_alone and not _claimed(place / f"{start}.begun")):
                    continue
                if self._artefact.exists():
                    raise _Elsewhere
                found[start] = map_processes(function, items[start : start + size], workers)
                with suppress(FileNotFoundError):  # the folder went when another job had the artefact
                    temporary = place / f"{start}.{self._job}"
                    content = pickle.dumps(found[start])
                    write_bytes(temporary, digest(content).encode() + content)
                    temporary.replace(path)
        for start in starts:
            if start not in found:
                kept = _kept(place / f"{start}.pickle")
                found[start] = kept or map_processes(function, items[start : start + size], workers)
        return [one for start in starts for one in found[start]]


def _kept(path: Path) -> list[Any]:
    """What another job has made of a block; nothing if the file is not as it was written."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise _Elsewhere from None
    seal, made = content[:_SEAL], content[_SEAL:]
    return list(pickle.loads(made)) if seal == digest(made).encode() else []


def _claimed(path: Path) -> bool:
    """Whether this job is the first to begin a block."""
    try:
        path.open("x").close()
    except FileExistsError:
        return False
    except FileNotFoundError:
        raise _Elsewhere from None
    return True
