"""Tests of `status`, which lists the figures that must be recomputed without computing them."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline import plugins
from pipeline.cli import commands
from pipeline.cli.compose import compose
from pipeline.cli.figures import attempt, make_figure
from pipeline.cli.main import main
from pipeline.cli.presets import presets
from pipeline.cli.status import Status, status
from pipeline.stages import chain, ingest
from pipeline.storage import source_code
from pipeline.storage.sealed_folders import read_manifest
from pipeline.storage.source_code import sources_digest
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment

FIGURE = "zhang2007_fig2"


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results folder with one small figure."""
    folder = tmp_path_factory.mktemp("results")
    make_figure(experiment(folder), place(folder), store=Store(folder))
    return folder


def experiment(results: Path, *overrides: str):  # type: ignore[no-untyped-def]
    """Return the experiment of the figure, with overrides."""
    quick = ["figure.picture=false", "figure.recording=false", "scale=smoke"]
    return compose([f"experiment={FIGURE}", f"results={results}", *quick, *overrides])


def state_of(one: Experiment, folder: Path) -> Status:
    """Return the status of an experiment's figure in a folder."""
    return status(one, folder)


def place(results: Path) -> Path:
    return results / "synthetic" / "smoke" / FIGURE


def snapshot(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*")}


def test_what_was_just_made_is_current_and_nothing_is_written(results: Path) -> None:
    before = snapshot(results)
    result = state_of(experiment(results), place(results))
    assert (result.state, result.why, result.to_compute) == ("current", "", ())
    assert snapshot(results) == before


@pytest.mark.parametrize(
    ("override", "why", "to_compute"),
    [
        ("model.components=20", "model: options.components changed 30 -> 20", ("model", "sweep")),
        ("dataset.harmonics=3", "ingest: options.dataset.harmonics changed 2 -> 3", chain.STAGES),
        ("figure.picture=true", "figure: options changed", ()),
    ],
)
def test_it_says_which_option_changed(
    results: Path, override: str, why: str, to_compute: tuple[str, ...]
) -> None:
    result = state_of(experiment(results, override), place(results))
    assert (result.state, result.why, result.to_compute) == ("stale", why, to_compute)


def test_it_says_that_the_code_changed(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.stages.artefacts.sources_digest", lambda modules: "0" * 64)
    result = state_of(experiment(results), place(results))
    assert (result.state, result.why) == ("stale", "ingest: code changed")
    assert result.to_compute == ("ingest", "dataset", "model", "sweep")


def test_it_says_that_the_figures_own_code_changed(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.stages.sources.sources_digest", lambda modules: "0" * 64)
    result = state_of(experiment(results), place(results))
    assert (result.state, result.why) == ("stale", "figure: code changed")


@pytest.fixture
def edited_readers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Copy of the sources with an additional constant in every reader, mapping and fetcher."""
    copy = tmp_path / "pipeline"
    shutil.copytree(plugins.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in ("formats", "mappings", "fetch"):
        for path in (copy / folder).rglob("*.py"):
            path.write_text(path.read_text(encoding="utf-8") + "\nUNUSED = 1\n", encoding="utf-8")
    monkeypatch.setattr(plugins, "PACKAGE", copy)
    source_code._module.cache_clear()
    yield copy
    source_code._module.cache_clear()


def test_an_edited_reader_leaves_synthetic_figures_current(
    edited_readers: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    modules = {}
    for name in presets():
        first = compose(["scale=smoke", f"experiment={name}"])
        if first.sweep.further_files(first.data):
            continue  # which its sweep reads
        made_by = first.data.request(first.dataset.corpus, first.skeleton, first.seed, 1).source
        options = (first.dataset, first.model, first.sweep, first.figure)
        modules[name] = [made_by, *(type(option).__module__ for option in options)]

    def digests() -> dict[str, list[str]]:
        return {name: [sources_digest([module]) for module in owner] for name, owner in modules.items()}

    after, reader = digests(), sources_digest(["pipeline.formats.mvnx"])
    monkeypatch.undo()
    source_code._module.cache_clear()
    assert digests() == after
    assert sources_digest(["pipeline.formats.mvnx"]) != reader


def test_a_made_figure_is_current_after_readers_are_edited(results: Path, edited_readers: Path) -> None:
    result = state_of(experiment(results), place(results))
    assert (result.state, result.to_compute) == ("current", ())


def test_clips_that_come_out_equal_leave_the_figure_current(
    results: Path, tmp_path: Path, edited_readers: Path
) -> None:
    copy = tmp_path / "results"
    shutil.copytree(results, copy)
    first = dataclasses.replace(experiment(results), results=str(copy))
    walks = edited_readers / "clips" / "walks.py"
    walks.write_text(walks.read_text(encoding="utf-8") + "\nUNUSED = 1\n", encoding="utf-8")
    source_code._module.cache_clear()
    result = state_of(first, place(copy))
    assert (result.state, result.why) == ("stale", "ingest: code changed")
    assert result.to_compute == ("ingest", "dataset", "model", "sweep"), "what follows is not known"
    assert ingest.run(first, Store(copy)).artefact.why == "code changed"
    result = state_of(first, place(copy))
    assert (result.state, result.to_compute) == ("current", ())


def test_what_is_missing_damaged_or_forgotten_is_named(results: Path, tmp_path: Path) -> None:
    copy = tmp_path / "results"
    shutil.copytree(results, copy)
    shutil.rmtree(copy / "cache")
    first = dataclasses.replace(experiment(results), results=str(copy))
    assert state_of(first, place(copy)).state == "current"
    other = dataclasses.replace(experiment(results, "model.components=20"), results=str(copy))
    assert "no longer in the cache" in state_of(other, place(copy)).why
    (place(copy) / "table.csv").unlink()
    assert state_of(first, place(copy)).why == "table.csv is missing"
    shutil.rmtree(place(copy))
    result = state_of(first, place(copy))
    assert (result.state, result.why) == ("missing", "not made yet")


def test_a_dry_run_makes_nothing(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = snapshot(results)
    words = ["experiment=zhang2007_fig2,zhang2007_fig3", "scale=smoke", f"results={results}"]
    assert main(["figures", *words, "--dry-run"]) == 0
    assert main(["status", *words]) == 0
    described = capsys.readouterr().out
    assert described.count("1 missing; nothing was computed") == 2
    assert snapshot(results) == before


def test_results_of_another_commit_may_be_archived_while_the_sources_are_the_same(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    quick = ["figure.picture=false", "figure.recording=false", "scale=smoke", f"results={results}"]
    folder = place(results).parent
    made_by = read_manifest(place(results))["provenance"]["commit"]

    def current(*overrides: str, commit: str = "e" * 40) -> list[str]:
        return commands._current([FIGURE, "zhang2007_fig3"], folder, [*quick, *overrides], commit=commit)

    assert current() == [FIGURE]
    assert current("model.components=20") == []
    assert current(commit=made_by) == []  # of this commit: nothing is asked
    monkeypatch.setattr("pipeline.stages.artefacts.sources_digest", lambda modules: "0" * 64)
    assert current() == []


def test_a_figure_is_there_before_its_further_populations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few, folder = experiment(tmp_path, "data.populations=2"), place(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr("pipeline.stages.populations.tables", _interrupt)
        with pytest.raises(KeyboardInterrupt):
            attempt(few, folder, lambda _: None)  # the first of a sweep
    assert {"table.csv", "claims.csv"} < set(read_manifest(folder)["files"])
    result = state_of(few, folder)
    assert (result.state, result.why) == ("stale", "figure: further populations are missing")
    make_figure(few, folder, store=Store(tmp_path), early=True)
    assert state_of(few, folder).state == "current"
    assert (folder / "table_populations.csv").is_file()


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt
