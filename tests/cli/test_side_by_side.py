"""Tests of figures computed in parallel: same tables, each stage computed once, and no process or partial file left."""

from __future__ import annotations

import functools
import os
import signal
import time
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from pipeline import processes
from pipeline.cli import main as command_line
from pipeline.cli import pool
from pipeline.cli.compose import compose
from pipeline.cli.pool import make_side_by_side
from pipeline.cli.presets import presets
from pipeline.cli.progress import Display
from pipeline.cli.summary import Failure
from pipeline.papers import all_papers
from pipeline.processes import CAN_FORK, map_processes, processes_for
from pipeline.studies.walks.known_view import KnownView
from tests.processes import forked, is_complete

pytestmark = pytest.mark.thorough

QUICK = ("scale=smoke", "figure.picture=false", "figure.recording=false")
needs_fork = pytest.mark.skipif(not CAN_FORK, reason="workers are forks, which know what a test has replaced")


def made(results: Path) -> dict[str, bytes]:
    """Return tables and arrays of all figures in ``scratch``, by figure and file."""
    return {
        f"{path.parent.name}/{path.name}": path.read_bytes()
        for path in results.glob("scratch/*/*/*")
        if path.suffix in (".csv", ".npz")
    }


def test_one_process_and_two_give_the_same_bytes(say: Callable, tmp_path: Path) -> None:
    names = "zhang2007_fig2,zhang2007_fig4,zhang2004_fig5,mozerov2006_fig2,park2011_fig3a"
    tables = []
    for workers in (1, 2):
        message = say(
            "figures", f"experiment={names}", *QUICK, f"results={tmp_path / str(workers)}", f"workers={workers}"
        )  # fmt: skip
        assert (message.status, message.err) == (0, "")
        tables.append(made(tmp_path / str(workers)))
    assert {name.split("/")[0] for name in tables[0]} == set(names.split(","))
    assert tables[0] == tables[1]


@needs_fork
def test_two_figures_of_one_sweep_measure_it_once(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    really = KnownView.measure

    @functools.wraps(really)  # the store reads the annotations
    def counted(self: KnownView, inputs: object) -> object:
        with (tmp_path / "measured").open("a") as stream:
            stream.write(f"{os.getpid()}\n")
        return really(self, inputs)

    monkeypatch.setattr(KnownView, "measure", counted)
    message = say(
        "figures", "experiment=zhang2007_fig4,zhang2007_fig5", *QUICK, f"results={tmp_path}", "workers=2"
    )
    assert (message.status, message.err) == (0, "")
    (process,) = (tmp_path / "measured").read_text().split()
    assert int(process) != os.getpid()


@needs_fork
def test_a_worker_that_dies_is_named_and_the_others_go_on(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = [
        "figures", "experiment=zhang2007_fig5,zhang2007_fig2,zhang2007_fig6", *QUICK, f"results={tmp_path}", "workers=2"
    ]  # fmt: skip
    with monkeypatch.context() as patch:

        @functools.wraps(KnownView.measure)
        def killed(self: KnownView, inputs: object) -> None:
            os.kill(os.getpid(), signal.SIGKILL)

        patch.setattr(KnownView, "measure", killed)
        message = say(*arguments)
    assert message.status == 1
    assert message.err.strip() == (
        "not made (zhang2007_fig5): the process of the figure ended by signal 9; "
        "finished stages are kept, and the same command continues"
    )
    assert {path.parent.name for path in tmp_path.glob("scratch/*/*/table.csv")} == {
        "zhang2007_fig2", "zhang2007_fig6"
    }  # fmt: skip
    message = say(*arguments)
    assert (message.status, message.err) == (0, "")
    assert "zhang2007_fig6: " in message.out
    assert "reused ingest dataset model sweep" in message.out


@needs_fork
def test_a_bug_in_one_figure_is_shown_and_the_others_go_on(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @functools.wraps(KnownView.measure)
    def wrong(self: KnownView, inputs: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(KnownView, "measure", wrong)
    for workers in (1, 2):
        message = say(
            "figures", "experiment=zhang2007_fig5,zhang2007_fig2", *QUICK, f"results={tmp_path}", f"workers={workers}"
        )  # fmt: skip
        assert message.status == 1
        assert "Traceback" in message.err
        assert message.err.splitlines()[-1] == "not made (zhang2007_fig5): ZeroDivisionError: a bug"
        assert "zhang2007_fig2" in message.out


def sleeping(arguments: list[str]) -> int:
    """Run the command line with a sweep of walks that prints a word and then never returns."""

    @functools.wraps(KnownView.measure)
    def asleep(self: KnownView, inputs: object) -> None:
        print("here", flush=True)
        while True:  # a signal that comes just before a sleep is only noticed after it
            time.sleep(0.01)

    KnownView.measure = asleep  # type: ignore[assignment, method-assign]
    return command_line.main(arguments)


def losing(arguments: list[str]) -> int:
    """Run the command line with a sweep of walks that ignores the first interrupt, as a library's callback may do."""
    pool.TIMES = 10_000  # however busy the machine is

    @functools.wraps(KnownView.measure)
    def asleep(self: KnownView, inputs: object) -> None:
        message = lost = False
        try:
            while True:
                try:
                    if not message:
                        message = True
                        print("here", flush=True)
                    time.sleep(0.01)
                except KeyboardInterrupt:
                    if lost:
                        raise
                    lost = True
        finally:
            print("tidied", flush=True)

    KnownView.measure = asleep  # type: ignore[assignment, method-assign]
    return command_line.main(arguments)


@needs_fork
def test_an_interrupt_that_is_lost_comes_again(tmp_path: Path) -> None:
    arguments = [
        "figures", "experiment=zhang2007_fig4,zhang2007_fig5", *QUICK, f"results={tmp_path}", "workers=2"
    ]  # fmt: skip
    with forked(lambda: losing(arguments)) as process:
        assert process.stdout.readline().startswith("setting up")
        assert process.stdout.readline() == "here\n"
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate()
        assert "tidied" in out, "it received the signal again, and was not killed"
    assert process.returncode == 130
    assert list(tmp_path.rglob(".*")) == []


def none_is_left(group: int) -> bool:
    """Return whether every process of a process group has ended."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


@needs_fork
@pytest.mark.parametrize(
    ("number", "send"),
    [
        (signal.SIGINT, os.killpg),  # as a terminal does
        (signal.SIGINT, os.kill),
        (signal.SIGTERM, os.killpg),  # as `timeout` does
        (signal.SIGTERM, os.kill),
        (signal.SIGKILL, os.kill),
    ],
)
def test_a_signal_ends_all_processes_and_the_next_run_goes_on(
    say: Callable, tmp_path: Path, number: int, send: Callable
) -> None:
    arguments = [
        "figures", "experiment=zhang2007_fig2,zhang2007_fig5", *QUICK, f"results={tmp_path}", "workers=2"
    ]  # fmt: skip
    with forked(lambda: sleeping(arguments)) as process:
        assert process.stdout.readline().startswith("setting up")
        first, second = sorted(process.stdout.readline() for _ in range(2))
        assert first.startswith("1/2 zhang2007_fig2: "), "a line as soon as a figure is finished"
        assert second == "here\n"
        send(process.pid, number)
        _, err = process.communicate()
        if number == signal.SIGKILL:
            while not none_is_left(process.pid):
                time.sleep(0.01)
        assert none_is_left(process.pid)
    if number != signal.SIGKILL:
        assert process.returncode == 130
        assert err == "interrupted: finished work is kept, and the same command continues from there\n"
        hidden = list(tmp_path.rglob(".*"))
        assert hidden == [], "no temporary folder, no lock"
    assert [path.name for path in tmp_path.glob("scratch/*/*")] == ["zhang2007_fig2"]
    assert all(is_complete(path) for path in (tmp_path / "cache").glob("[!.]*"))
    message = say(*arguments)
    assert (message.status, message.err) == (0, "")
    assert "zhang2007_fig5: " in message.out
    assert list(tmp_path.glob("cache/.*")) == []


def test_figures_are_begun_by_paper_and_short_before_long(
    say: Callable, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    begun = []

    def only_listed(jobs: list, **_: object) -> list[str]:
        begun.extend(jobs)
        return []

    monkeypatch.setattr("pipeline.cli.figures.make_figures", only_listed)
    assert say("figures", "scale=smoke", f"results={tmp_path}").status == 0
    experiments = [experiment for experiment, _ in begun]
    assert sorted(experiment.name for experiment in experiments) == presets()
    papers = list(dict.fromkeys(experiment.paper for experiment in experiments))
    assert papers == sorted(all_papers(), key=lambda key: all_papers()[key].order)
    assert papers[:4] == ["zhang2007", "zhang2004", "mozerov2006", "park2011"]
    for paper in papers:
        beyond = all_papers()[paper].beyond
        for ours in (False, True):
            costs = [e.cost_s for e in experiments if e.paper == paper and (e.name in beyond) is ours]
            assert costs == sorted(costs)
    names = [experiment.name for experiment in experiments]
    assert names.index("zhang2007_structure") > names.index("zhang2004_fig5"), (
        "the papers' figures before ours"
    )


def test_more_workers_than_cores_are_as_many_as_cores() -> None:
    assert compose(["experiment=zhang2007_fig5", "workers=1000"]).workers == processes_for(1000)


def test_on_a_terminal_one_display_names_what_runs_and_what_is_left() -> None:
    console = Console(file=StringIO(), force_terminal=True, width=120, height=20)
    names = ("zhang2007_fig2", "zhang2007_fig5", "zhang2007_fig6")
    experiments = [compose([f"experiment={name}"]) for name in names]
    with Display(experiments, console, slots=2) as display:
        for slot in range(2):
            display.began(slot, slot)
        display.at(0, "sweep")
        display.ended(1, 1, Failure("zhang2007_fig5", "no"))
        display.began(1, 2)
        display._progress.refresh()
        with console.capture() as capture:
            console.print(display._progress.get_renderable())
    displayed = capture.get()
    assert "1/3" in displayed
    assert "zhang2007_fig2: sweep" in displayed
    assert "zhang2007_fig6" in displayed
    assert "zhang2007_fig5" not in displayed
    assert "0:00:00" in displayed


@needs_fork
def test_each_figure_has_a_process_of_its_own_and_hands_on_the_cores_that_it_owes(tmp_path: Path) -> None:
    """Each figure has its own process, and passes the cores that it has not returned to the next figure."""

    def make(experiment: Any, folder: Path, at: Callable[[str], None]) -> Failure:
        before = processes.cores_not_returned()
        if folder.name == "0":
            with processes.core_lent():
                assert processes._Share.spare.acquire(False)
        else:
            processes._Share.spare.release()
        map_processes(str, range(4), 4)
        return Failure(folder.name, f"{os.getpid()} {before} {processes.cores_not_returned()}")

    experiments = [compose([f"experiment={name}"]) for name in ("zhang2007_fig2", "zhang2007_fig5")]
    jobs = [(single, tmp_path / str(number)) for number, single in enumerate(experiments)]
    with Display(experiments, Console(file=StringIO()), slots=1) as display:
        ended = make_side_by_side(jobs, make, display, processes=1, cores=1)
    (first, *owed), (second, *paid) = (
        single.sentence.split() for single in ended if isinstance(single, Failure)
    )
    assert len({first, second, str(os.getpid())}) == 3
    assert (owed, paid) == (["0", "1"], ["1", "0"])
