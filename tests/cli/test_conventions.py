"""Tests of the command line's conventions: --quiet, --json, suggested names, and paths that contain an equals sign."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli import main
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.storage import archive
from pipeline.synthetic import walkers
from pipeline.validation import InvalidInput


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """File with a walk, in a folder whose name contains an equals sign."""
    output = walkers.walking_population(
        np.random.default_rng(3), male=1, female=1, duration_s=3.0, frame_rate_hz=50.0
    )
    path = tmp_path / "session=2" / "anna=1.trc"
    path.parent.mkdir()
    trc.write(path, WALKER15.joints, output.positions_mm[0], 50.0)
    return path


def test_findings_are_printed_as_json(say: Callable, recording: Path) -> None:
    result = say("inspect", str(recording), "--json")
    (findings,) = json.loads(result.out)
    assert (result.status, findings["name"], findings["mapping"]) == (0, "anna=1.trc", "walker15")
    assert findings["strides"] > 2
    (of_folder,) = json.loads(say("inspect", str(recording.parent), "--json").out)
    assert of_folder["mapping"] == "walker15"


def test_a_quiet_command_prints_errors_only(say: Callable, recording: Path) -> None:
    result = say("inspect", str(recording), "--quiet")
    assert (result.status, result.out, result.err) == (0, "", "")
    result = say("inspect", str(recording), "unit=m", "--quiet")
    assert (result.status, result.out) == (1, "")
    assert "did you mean units?" in result.err


def test_complaints_about_an_archive_are_printed_as_json(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archive, "verify", lambda folder: ["table.csv changed"])
    (tmp_path / archive.CHECKSUMS).write_text("", encoding="utf-8")
    result = say("verify", str(tmp_path), "--json")
    assert (result.status, json.loads(result.out)) == (1, {str(tmp_path): ["table.csv changed"]})


def test_status_is_printed_as_json(say: Callable, tmp_path: Path) -> None:
    result = say("status", "experiment=zhang2007_fig2", "scale=smoke", f"results={tmp_path}", "--json")
    (figure,) = json.loads(result.out)
    assert (result.status, figure["figure"], figure["state"]) == (0, "zhang2007_fig2", "missing")


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["figurs"], "figures"),
        (["experiment=zhang2007_figg5"], "zhang2007_fig5"),
        (["experiment=zhang2007_fig5", "sweep.sigma2_mm.stop=3"], "sigma2_mm2"),
        (["experiment=zhang2007_fig5", "skeleton=plugin_gate"], "plugin_gait"),
        (["reconstruct", "a.json", "input.widht=3"], "width"),
    ],
)
def test_the_nearest_name_is_suggested(say: Callable, arguments: list[str], name: str) -> None:
    result = say(*arguments)
    assert (result.status, f"did you mean {name}?" in result.err) == (1, True), result.err


def test_nothing_is_suggested_that_is_not_near() -> None:
    error = InvalidInput("must be red or blue", "colour", received="harmonics", code="unknown_choice")
    assert "did you mean" not in str(error)


def test_the_help_names_the_exit_statuses() -> None:
    assert "Exit status: 0 success, 1 failure" in main.help_text()
