"""Stages that several jobs compute together: the same artefact, whoever dies, and nothing left behind."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.cli.divided import DividedStore
from pipeline.processes import CAN_FORK, map_processes
from pipeline.storage.artefacts import Artefact
from pipeline.storage.store import Store

ITEMS = 37


def stage(made: list[int], at: Callable[[int], object] = lambda item: None) -> Callable[[], Any]:
    """What computes the artefact by two calls of `map_processes`; each item that is made is noted."""

    def one(item: int) -> np.ndarray:
        at(item)
        made.append(item)
        return np.sqrt(np.arange(3.0) + sum(map_processes(float, range(item), 1)))

    def compute() -> Any:
        roots = np.stack(map_processes(one, range(ITEMS), 1))
        total = map_processes(lambda column: float(roots[:, column].sum()), range(3), 1)
        return {"roots": roots, "total": np.array(total)}, {"none": map_processes(str, [], 1)}

    return compute


def asked(store: Store, compute: Callable[[], Any]) -> Artefact:
    return store.artefact("sweep", {"number": 1}, [], compute, code="c")


def plain(folder: Path) -> Artefact:
    return asked(Store(folder), stage([]))


def require_same(found: Artefact, folder: Path) -> None:
    """The artefact is that of one job, and nothing hidden is left."""
    alone = plain(folder / "alone")
    assert (found.key, found.content) == (alone.key, alone.content)
    assert [path.name for path in (folder / "cache").iterdir()] == [f"sweep-{found.key}"]


def test_one_job_of_several_makes_everything_if_no_other_comes(tmp_path: Path) -> None:
    made: list[int] = []
    found = asked(DividedStore(tmp_path, 2, 3), stage(made))
    assert found.computed
    assert made[0] > 0, "it begins with its own part"
    assert sorted(made) == list(range(ITEMS))
    require_same(found, tmp_path)


def test_of_a_job_that_dies_the_others_take_what_it_has_made_and_make_what_it_had_begun(
    tmp_path: Path,
) -> None:
    def dies(item: int) -> None:
        if item == 17:
            raise KeyboardInterrupt

    first: list[int] = []
    second: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        asked(DividedStore(tmp_path, 0, 2), stage(first, dies))
    found = asked(DividedStore(tmp_path, 1, 2), stage(second))
    assert sorted({*first, *second}) == list(range(ITEMS))
    assert 0 < len(set(first) & set(second)) < 5, "the block in which it died, and no other"
    require_same(found, tmp_path)


def test_a_job_stops_when_another_has_the_artefact(tmp_path: Path) -> None:
    def overtaken(item: int) -> None:
        if item == 20:
            plain(tmp_path)

    made: list[int] = []
    found = asked(DividedStore(tmp_path, 0, 2), stage(made, overtaken))
    assert 20 <= max(made) < ITEMS - 1
    assert found.computed
    require_same(found, tmp_path)


def test_what_the_artefact_became_is_looked_at(tmp_path: Path) -> None:
    """Another job's artefact that is damaged is set aside, and the work goes on."""
    made: list[int] = []

    def damaged(item: int) -> None:
        if item == 20 and item not in made:
            path = tmp_path / "cache" / f"sweep-{plain(tmp_path).key}" / "arrays.npz"
            path.write_bytes(path.read_bytes()[:-9])

    found = asked(DividedStore(tmp_path, 0, 2), stage(made, damaged))
    assert set(made) == set(range(ITEMS))
    assert found.content == plain(tmp_path / "alone").content


@pytest.mark.parametrize(
    "damage", [lambda content: content[:-9], lambda content: b"", lambda content: b"x" * 99]
)
def test_a_damaged_block_is_made_again(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    def wrong(item: int) -> None:
        if item == 30:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        asked(DividedStore(tmp_path, 0, 2), stage([], wrong))
    block = next(tmp_path.glob("cache/.blocks-*/*/0.pickle"))
    block.write_bytes(damage(block.read_bytes()))
    made: list[int] = []
    found = asked(DividedStore(tmp_path, 0, 2), stage(made))
    assert 0 in made
    assert 10 not in made
    require_same(found, tmp_path)


def test_an_error_is_raised_and_what_was_made_is_kept_for_the_next_run(tmp_path: Path) -> None:
    def wrong(item: int) -> None:
        if item == 30:
            raise ZeroDivisionError

    made: list[int] = []
    with pytest.raises(ZeroDivisionError):
        asked(DividedStore(tmp_path, 0, 2), stage([], wrong))
    found = asked(DividedStore(tmp_path, 0, 2), stage(made))
    assert 0 < len(made) < ITEMS
    require_same(found, tmp_path)


@pytest.mark.skipif(not CAN_FORK, reason="the jobs are forks")
@pytest.mark.parametrize("jobs", [2, 5])
def test_jobs_at_once_have_one_artefact(tmp_path: Path, jobs: int) -> None:
    context = multiprocessing.get_context("fork")
    ready, keys = context.Barrier(jobs), context.SimpleQueue()

    def job(number: int) -> None:
        store = DividedStore(tmp_path, number, jobs)
        ready.wait()
        found = asked(store, stage([]))
        keys.put((found.key, found.content))

    processes = [context.Process(target=job, args=(number,)) for number in range(jobs)]
    for process in processes:
        process.start()
    found = [keys.get() for _ in processes]
    for process in processes:
        process.join()
    assert len(set(found)) == 1
    require_same(plain(tmp_path), tmp_path)
