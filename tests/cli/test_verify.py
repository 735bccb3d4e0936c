"""Tests of `verify`, which recomputes the figures of an archive and compares them within the archive's tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from pipeline.cli import verify as module
from pipeline.cli.compose import compose, with_options
from pipeline.cli.main import command
from pipeline.report.light import keep_light
from pipeline.storage.sealed_folders import canonical, digest
from tests.rejects import rejects
from tests.report.planted import CLAIM, plant, view_errors

repeated: list[Any] = []
"""Experiments that the last verification recomputed."""
FIGURES = ["zhang2007_fig5", "mozerov2006_fig1"]


@pytest.fixture
def archived(tmp_path: Path) -> Path:
    """Folder of light archives, with one archive of two figures."""
    lock = tmp_path / "requirements.lock"
    lock.write_text("numpy==2.4.6\n")
    output: dict[str, Any] = {"scale": "full", "lock_sha256": digest(lock.read_bytes())}
    for name in FIGURES:
        retained = canonical(compose([f"experiment={name}", "seed=5", "data.walkers=7"]))
        plant(tmp_path / "synthetic" / "full" / name, claims=CLAIM, configuration=retained, **output)
    light = tmp_path / "light"
    facts: dict[str, Any] = {"date": "2026-11-22", "commit": "f" * 40, "dirty": False, "lock": lock}
    keep_light(tmp_path / "synthetic" / "full", light / "synthetic", FIGURES, **facts)
    return light


def making(monkeypatch: pytest.MonkeyPatch, off: float) -> list[str]:
    """Replace computed figures by results whose errors differ by a factor; return the list of figure names."""
    names: list[str] = []
    repeated.clear()

    def make(jobs: Sequence[tuple[Any, Path]], *, console: Any) -> list[str]:
        for experiment, folder in jobs:
            names.append(f"{experiment.name} {experiment.data.name} {experiment.scale.name}")
            repeated.append(experiment)
            errors = [value * off for value in view_errors()["absolute_error_mm2"]]
            plant(folder, table=view_errors() | {"absolute_error_mm2": errors}, claims=CLAIM)
        return []

    monkeypatch.setattr(module, "make_figures", make)
    return names


def test_figures_are_made_again_and_agree(
    archived: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = making(monkeypatch, 1.0)
    assert command("verify")([str(archived), "rerun=1"]) == 0
    assert sorted(names) == ["mozerov2006_fig1 synthetic full", "zhang2007_fig5 synthetic full"]
    message = capsys.readouterr().out
    assert "every file is unchanged" in message
    assert {(first.seed, first.data.walkers, first.figure.picture) for first in repeated} == {(5, 7, False)}
    assert message.count("tables agree") == 2
    assert "made by commit ffffffffffff, computed again by" in message


def test_one_that_differs_is_named_and_the_status_says_so(
    archived: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    making(monkeypatch, 1.01)
    assert command("verify")([str(archived / "synthetic"), "rerun=1", "only=zhang2007_fig5"]) == 1
    message = capsys.readouterr().out
    assert "zhang2007_fig5/table.csv: line 2, absolute_error_mm2: 500.0 is not 505.0" in message
    assert "mozerov2006_fig1" not in message


def test_nothing_is_computed_of_a_changed_archive_or_of_a_figure_that_is_not_in_it(
    archived: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = making(monkeypatch, 1.0)
    with rejects("no_figure", "synthetic"):
        command("verify")([str(archived), "rerun=1", "only=zhang2007_fig2"])
    (archived / "synthetic" / "zhang2007_fig5" / "table.csv").write_text("method\nmap\n")
    assert command("verify")([str(archived), "rerun=1"]) == 1
    assert names == []


def test_an_option_without_a_value_is_taken_for_an_archive_and_refused(archived: Path) -> None:
    with rejects("no_archive", "rerun"):
        command("verify")([str(archived), "rerun"])


@pytest.mark.parametrize("kept", [{"of_tomorrow": 1}, {"sweep": {"<type>": "Forgotten"}}])
def test_options_of_another_version_are_not_made_again(kept: dict[str, Any]) -> None:
    with rejects("other_version", "zhang2007_fig5"):
        with_options(compose(["experiment=zhang2007_fig5"]), kept)
