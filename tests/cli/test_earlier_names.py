"""Tests of names from earlier versions: old archives can be verified, and messages give the present name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline import plugins
from pipeline.cli import earlier_names as module
from pipeline.cli import verify
from pipeline.cli.commands import claims
from pipeline.cli.compose import _classes, compose, with_options
from pipeline.cli.earlier_names import Change, EarlierNames, earlier_names
from pipeline.cli.main import command
from pipeline.ingestion.data import DATA_SETS
from pipeline.report.light import keep_light
from pipeline.storage import tables
from pipeline.storage.agreement import compare_again
from pipeline.storage.sealed_folders import TYPE, canonical, digest
from pipeline.studies import registry
from tests.rejects import rejects, rejects_options
from tests.report.planted import CLAIM, plant

FIG5 = "zhang2007_fig5"


def as_in_75f0dec2(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options of zhang2007_fig5 as a manifest of commit 75f0dec2 contains them."""
    old = {name: value for name, value in options.items() if name != "plugins"}
    old["scale"] = {**options["scale"], "faced": 10}
    methods = [{TYPE: "Method", "name": name} for name in options["sweep"]["methods"]]
    old["sweep"] = {**options["sweep"], "methods": methods}
    return old


@pytest.fixture
def old_archive(tmp_path: Path) -> Path:
    """Archive of commit 75f0dec2 with one figure that still exists and two that were removed."""
    lock = tmp_path / "requirements.lock"
    lock.write_text("numpy==2.4.6\n")
    retained = as_in_75f0dec2(canonical(compose([f"experiment={FIG5}", "seed=5"])))
    figures = [FIG5, "park2011_proofs", "zhang2007_noise"]
    for name in figures:
        output: dict[str, Any] = {"scale": "full", "lock_sha256": digest(lock.read_bytes())}
        plant(tmp_path / "synthetic" / "full" / name, claims=CLAIM, configuration=retained, **output)
    facts: dict[str, Any] = {"date": "2026-11-26", "commit": "f" * 40, "dirty": False, "lock": lock}
    keep_light(tmp_path / "synthetic" / "full", tmp_path / "light", figures, **facts)
    return tmp_path / "light"


def test_an_old_archive_is_computed_again_and_figures_that_went_are_named(
    old_archive: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    requested = []

    def make(jobs: list[tuple[Any, Path]], *, console: Any) -> list[str]:
        for experiment, folder in jobs:
            requested.append(experiment)
            plant(folder, claims=CLAIM)
        return []

    monkeypatch.setattr(verify, "make_figures", make)
    assert command("verify")([str(old_archive), "rerun=1"]) == 0
    message = capsys.readouterr().out
    assert "park2011_proofs: no longer computed: it is a benchmark now" in message
    assert "zhang2007_noise: no longer computed" in message
    assert f"{FIG5}: 3 tables agree" in message
    (first,) = requested
    like = compose([f"experiment={FIG5}", "seed=5", "figure.picture=false", "figure.recording=false"])
    assert {**vars(first), "results": ""} == {**vars(like), "results": ""}
    assert command("verify")([str(old_archive), "rerun=1", "only=park2011_proofs"]) == 0
    assert len(requested) == 1


def _existing(group: str) -> set[str]:
    finite = DATA_SETS if group == "data" else registry.options(group) if group in registry.GROUPS else {}
    return {*plugins.conf_files(group), *finite}


def _members(kind: type[Any]) -> set[str]:
    return {*kind.__members__} if issubclass(kind, Enum) else {*kind.__dataclass_fields__}


def test_old_names_are_free_and_new_ones_exist() -> None:
    """In the table of earlier names, no old name is in use again, and every new name exists."""
    names, classes = earlier_names(), {kind.__name__: kind for kind in _classes()}
    for old, change in names.files.items():
        group, _, name = old.partition("/")
        assert name not in _existing(group), old
        assert not change.now or change.now.removeprefix(f"{group}/") in _existing(group), old
    for old, change in names.classes.items():
        assert old not in classes
        assert change.now == module.TEXT or change.now in classes, old
    for old, change in names.options.items():
        owner, _, name = old.partition(".")
        assert name not in _members(classes[owner]), old
        assert not change.now or change.now in _members(classes[owner]), old
        group, _, moved = change.moved.partition(".")
        owners = registry.options(group).values() if moved else ()
        assert not moved or any(moved.partition(".")[0] in _members(kind) for kind in owners), old
    assert all(old.split("/")[-2].endswith(".csv") for old in names.columns)
    assert {name for name in names.files if name.startswith("experiment/")} == {
        f"experiment/{name}"
        for name in ("park2011_face_off", "park2011_proofs", "zhang2007_noise", "zhang2007_view_posterior")
    }


@pytest.fixture
def with_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], EarlierNames]]:
    """Function that reads a plug-in's table of earlier names together with those of the package."""
    folders = plugins.conf_folders()

    def read(text: str) -> EarlierNames:
        (tmp_path / module.TABLE).write_text(text)
        monkeypatch.setattr(plugins, "conf_folders", lambda: (*folders, tmp_path))
        module._earlier_names.cache_clear()
        return earlier_names()

    yield read
    module._earlier_names.cache_clear()


def test_a_renamed_option_choice_and_class_are_read_by_todays_names(
    with_table: Callable[[str], EarlierNames],
) -> None:
    experiment = compose([f"experiment={FIG5}"])
    retained = canonical(experiment)
    with_table(
        "classes: {Volker: SyntheticData}\n"
        "options: {Experiment.germ: seed, Heading.feet: steps, Scale.sides: {moved: sweep.sides}}\n"
    )
    old = {name: value for name, value in retained.items() if name != "seed"} | {"germ": 11}
    old["data"] = {**retained["data"], TYPE: "Volker", "heading": {TYPE: "Heading", "name": "feet"}}
    old["scale"] = {**retained["scale"], "sides": 6}
    result = with_options(experiment, old)
    assert result.seed == 11
    assert canonical(result) == {**retained, "seed": 11}


def test_an_option_that_went_with_a_value_that_is_not_computed_is_rejected(
    with_table: Callable[[str], EarlierNames],
) -> None:
    experiment = compose([f"experiment={FIG5}"])
    with_table('options: {Experiment.depth: {gone: "depth is always 1", was: [1]}}\n')
    assert with_options(experiment, {"depth": 1}) == experiment
    with rejects("gone", "Experiment.depth"):
        with_options(experiment, {"depth": 2})


def test_an_option_of_a_class_above_is_renamed_for_those_that_inherit_it(
    with_table: Callable[[str], EarlierNames],
) -> None:
    kinds = [kind for kind in _classes() if is_dataclass(kind) and len(kind.__mro__) > 2]
    above = next(first for first in kinds[0].__mro__[1:] if first is not object)
    names = with_table(f"options: {{{above.__name__}.former: latter}}\n")
    assert names.todays_options(kinds[0], {"former": 1, "other": 2}) == {"latter": 1, "other": 2}
    assert names.todays_options(dict, {"former": 1}) == {"former": 1}


def test_old_names_that_are_typed_give_the_new_one(with_table: Callable[[str], EarlierNames]) -> None:
    with_table(
        "files: {experiment/zhang2007_fig9: experiment/zhang2007_fig5}\n"
        "options: {Scale.people: walkers, Scale.sides: {moved: sweep.sides}}\n"
    )
    for override in ("scale.people=3", "+scale.people=3"):
        with rejects_options("renamed", "scale.people", "scale.walkers"):
            compose([f"experiment={FIG5}", override])
    with rejects_options("renamed", "scale.sides", "sweep.sides"):
        compose([f"experiment={FIG5}", "scale.sides=3"])
    with rejects_options("renamed", "experiment", FIG5):
        compose(["experiment=zhang2007_fig9"])
    with rejects("renamed", "experiment", now=FIG5):
        claims(["zhang2007_fig9"])
    with rejects_options("gone", "experiment", "make bench"):
        compose(["experiment=park2011_proofs"])
    with rejects_options("gone", "sweep"):
        compose([f"experiment={FIG5}", "sweep=face_off"])
    with rejects_options("gone", "scale.faced"):
        compose([f"experiment={FIG5}", "scale.faced=3"])
    with rejects_options("unknown_option", "scale.faces"):
        compose([f"experiment={FIG5}", "scale.faces=3"])


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("colours: {a: b}\n", "unknown_choice"),
        ("options: [a]\n", "not_a_mapping"),
        ("options: {Scale.a: {gone: x, now: y}}\n", "not_understood"),
        ("options: {Scale.a: {went: x}}\n", "not_understood"),
        ("options: {Scale.a: {now: b, was: [1]}}\n", "not_understood"),
        ("options: {Scale.a: ''}\n", "not_understood"),
        ("options: {Scale.a: 3}\n", "not_understood"),
        ("options: {Scale.a: {gone: x, was: 1}}\n", "not_understood"),
    ],
)
def test_a_table_that_cannot_be_understood_is_rejected(
    with_table: Callable[[str], EarlierNames], text: str, code: str
) -> None:
    with rejects(code):
        with_table(text)


COLUMNS = EarlierNames(
    columns={
        "table.csv/error": Change(now="error_mm"),
        "table.csv/left": Change(gone="no one read it"),
        "table.csv/right": Change(added="of both sides"),
        f"{FIG5}/table.csv/why": Change(text="sentences"),
    }
)


@pytest.mark.parametrize(("off", "agrees"), [(1.0, True), (1.01, False)])
def test_renamed_columns_are_compared_by_todays_names(tmp_path: Path, off: float, agrees: bool) -> None:
    old = {"error": [20.0, 30.0], "left": [1.0, 2.0], "why": ["as it was", "written"]}
    new = {"error_mm": [20.0, 30.0 * off], "right": [3.0, 4.0], "why": ["as it", "is written"]}
    for folder, table in (("kept", old), ("made", new)):
        (tmp_path / folder / FIG5).mkdir(parents=True)
        tables.write(tmp_path / folder / FIG5 / "table.csv", table)
    (result,) = compare_again(tmp_path / "kept" / FIG5, tmp_path / "made" / FIG5, COLUMNS.alike)
    assert result.complaints == (() if agrees else ("line 3, error_mm: 30 is not 30.3",))
    (plain,) = compare_again(tmp_path / "kept" / FIG5, tmp_path / "made" / FIG5)
    assert "columns differ" in plain.complaints[0]


def test_a_column_that_was_added_is_compared_where_the_archive_has_it() -> None:
    first = {"right": np.array([1.0])}
    assert COLUMNS.alike(FIG5, "table.csv", first, first) == (first, first)
    assert COLUMNS.alike(FIG5, "table.csv", {}, first) == ({}, {})
    assert COLUMNS.alike(FIG5, "table_joints.csv", {}, first) == ({}, first)
