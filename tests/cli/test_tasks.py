"""The work of several figures as tasks: nothing twice, nothing before what it needs, and the same tables."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.cli.figures import make_figure
from pipeline.cli.tasks import FIGURE, SAMPLES, SWEPT, Task, plan
from pipeline.stages import populations
from pipeline.storage.store import Store
from tests.kills import tables
from tests.stages.run import smoke

FIGURES = ("zhang2007_fig2", "zhang2007_fig3", "zhang2007_fig5", "zhang2004_fig2", "mozerov2006_fig3")
QUIET = ("figure.picture=false", "figure.recording=false", "scale.populations=3")


def tasks_of(results: Path, *figures: str, task_s: float = 60.0) -> list[Task]:
    """Tasks of figures at smoke scale, with three further populations."""
    return plan([smoke(name, *QUIET, f"results={results}") for name in figures], task_s=task_s)


def test_a_task_comes_after_those_that_it_needs_and_none_comes_twice(tmp_path: Path) -> None:
    tasks = tasks_of(tmp_path, *FIGURES)
    names = [task.name for task in tasks]
    assert len(set(names)) == len(names)
    for number, task in enumerate(tasks):
        assert set(task.needs) <= set(names[:number])
    assert [task.name for task in tasks if task.through == FIGURE] == list(FIGURES)


def test_what_one_figure_alone_needs_is_its_own_work(tmp_path: Path) -> None:
    (alone,) = tasks_of(tmp_path, "mozerov2006_fig3")
    assert (alone.name, alone.needs) == ("mozerov2006_fig3", ())


def test_what_two_need_is_a_task_as_far_as_they_share_it(tmp_path: Path) -> None:
    needs = {task.name: task for task in tasks_of(tmp_path, *FIGURES)}

    def last(figure: str) -> list[str]:
        return [needs[name].through for name in needs[figure].needs]

    assert last("zhang2007_fig3") == last("zhang2007_fig5") == ["sweep", SAMPLES, SWEPT]
    assert last("zhang2007_fig2") == ["model", SAMPLES]
    assert last("zhang2004_fig2") == ["ingest", SAMPLES]  # its model is no other figure's
    assert last("mozerov2006_fig3") == []


@pytest.mark.parametrize(("task_s", "blocks"), [(1e-9, [1, 1, 1]), (1e9, [3])])
def test_long_work_on_populations_is_cut_into_blocks(
    tmp_path: Path, task_s: float, blocks: list[int]
) -> None:
    tasks = tasks_of(tmp_path, *FIGURES, task_s=task_s)
    for through in (SAMPLES, SWEPT):
        owner = [task for task in tasks if task.through == through]
        assert [len(task.populations) for task in owner] == blocks
        assert sorted(number for task in owner for number in task.populations) == [0, 1, 2]


def test_a_long_stage_is_one_task_and_one_that_a_figure_alone_needs_is_its_own_work(tmp_path: Path) -> None:
    many = ("data.population=10000", "data.populations=0", "scale.populations=0", f"results={tmp_path}")
    fig3, fig5 = (smoke(name, *QUIET[:2], *many) for name in ("zhang2007_fig3", "zhang2007_fig5"))
    assert [task.through for task in plan([fig5], task_s=1e-9)] == [FIGURE]
    shared = [task for task in plan([fig3, fig5], task_s=1e-9) if task.through != FIGURE]
    assert [task.through for task in shared] == ["sweep"]
    assert shared[0].cost_s > 60.0


@pytest.mark.thorough
def test_figures_after_their_tasks_have_the_tables_of_figures_alone(tmp_path: Path) -> None:
    distance, alone = tmp_path / "apart", tmp_path / "alone"
    tasks = tasks_of(distance, "zhang2007_fig3", "zhang2007_fig5", task_s=0.7)
    assert len([task for task in tasks if task.through == "sweep"]) == 1
    dry_run = Store(distance, dry_run=True)
    for task in tasks:
        if task.through != FIGURE:
            assert task.run(dry_run), "it is to be computed"
            assert task.run(Store(distance))
            assert not task.run(dry_run), "it is there"
            assert not task.run(Store(distance))
            continue
        for results in (distance, alone):
            first = smoke(task.name, *QUIET, f"results={results}")
            output = make_figure(first, results / "synthetic" / "smoke" / task.name, store=Store(results))
            if results == distance:
                assert output.reused == ("ingest", "dataset", "model", "sweep")
    assert tables(distance) == tables(alone)
    assert any("table_populations" in name for name in tables(distance))


def test_populations_are_counted_where_they_are_made() -> None:
    assert populations.count(smoke("zhang2007_fig5", *QUIET)) == 3
    assert populations.count(smoke("zhang2007_fig5")) == 0
    assert populations.count(smoke("mozerov2006_fig3", *QUIET)) == 0
