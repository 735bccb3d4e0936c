"""Tests that unknown options are rejected by name, and that the command line prints a line before it loads Hydra."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import pytest

from pipeline.cli import composition
from pipeline.cli.compose import (
    built_figures,
    compose,
    compose_figures,
    on_this_machine,
    reason_without_clips,
)
from pipeline.cli.errors import sentence
from pipeline.cli.main import _help_of, command, commands
from pipeline.cli.presets import presets
from pipeline.resources import CONF
from tests.processes import finished
from tests.rejects import rejects, rejects_options

HEAVY = ("hydra", "numpy", "pandas", "scipy", "numba", "matplotlib", "rerun", "rich")

FIRST_LINE = f"""
import os, sys
class Watch:
    def find_spec(self, name, *_):
        if name in {HEAVY}:
            print("imports", name, flush=True)
            os._exit(0)
sys.meta_path.insert(0, Watch())
from pipeline.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["experiment=zhang2007_fig5", "sweep.truht=motion"], "setting up zhang2007_fig5"),
        (
            ["figures", "experiment=zhang2007_fig2,zhang2007_fig5", "seed=x"],
            "setting up zhang2007_fig2, zhang2007_fig5",
        ),
        (["status", "data=nowhere"], "setting up status"),
        (["claims", "scale=huge"], "setting up claims"),
        (["-m", "experiment=zhang2007_fig5", "model.components=x,y"], "setting up zhang2007_fig5"),
    ],
)
def test_the_first_line_comes_before_any_library(arguments: list[str], line: str) -> None:
    """The command line prints its first line before it imports any large library."""
    done = finished([sys.executable, "-c", FIRST_LINE, *arguments])
    first, imported = done.stdout.splitlines()
    assert (first, done.returncode, done.stderr) == (line, 0, "")
    assert imported.removeprefix("imports ") in HEAVY


def test_a_slip_ends_with_the_first_line_and_one_sentence() -> None:
    done = finished([sys.executable, "-m", "pipeline", "experiment=zhang2007_fig5", "sweep.truht=motion"])
    assert (done.stdout.splitlines(), done.returncode) == (["setting up zhang2007_fig5"], 1)
    assert len(done.stderr.splitlines()) == 1


def test_training_prints_a_line_before_it_loads_hydra() -> None:
    done = finished(
        [sys.executable, "-c", FIRST_LINE.replace(repr(HEAVY), "('hydra',)"), "model", "data=nowhere"]
    )
    assert (done.stdout.splitlines(), done.stderr) == (["setting up model", "imports hydra"], "")


def test_what_hydra_prints_of_the_options_is_all_that_is_printed() -> None:
    done = finished([sys.executable, "-m", "pipeline", "experiment=zhang2007_fig2", "--cfg", "job"])
    assert done.stdout.startswith("name: zhang2007_fig2\n")


def test_help_loads_no_library() -> None:
    for arguments in (["--help"], ["claims", "--help"]):
        done = finished([sys.executable, "-c", FIRST_LINE, *arguments])
        assert done.returncode == 0
        assert "imports" not in [line.split(" ")[0] for line in done.stdout.splitlines()]


def test_help_of_a_command_is_its_docstring() -> None:
    for name in commands():
        assert _help_of(name).split() == (command(name).__doc__ or "").split()


@pytest.mark.parametrize(
    ("slip", "code", "where"),
    [
        ("experiment=zhang2007_fig55", "unknown_option", "experiment"),
        ("data=opticall", "unknown_option", "data"),
        ("scale=large", "unknown_option", "scale"),
        ("sweep=known_views", "unknown_option", "sweep"),
        ("swep.truth=motion", "unknown_option", "swep"),
        ("sweep.truht=motion", "unknown_option", "sweep.truht"),
        ("sweep.truth=fourrier", "invalid_value", "sweep.truth"),
        ("sweep.view_angle_deg.stepp=1", "unknown_option", "sweep.view_angle_deg.stepp"),
        ("sweep.view_angle_deg.step=abc", "invalid_value", "sweep.view_angle_deg.step"),
        ("model.components=0", "out_of_range", "model.components"),
        ("model.components=many", "invalid_value", "model.components"),
        ("data.population=0", "out_of_range", "data.population"),
        ("seed.x=1", "invalid_value", "seed"),
        ("skeleton.maping=auto", "unknown_option", "skeleton.maping"),
    ],
)
def test_a_slip_is_refused_and_its_option_named(slip: str, code: str, where: str) -> None:
    with rejects_options(code, where):
        compose(["experiment=zhang2007_fig5", slip]).validate()


def test_figures_are_composed_in_the_papers_order_with_the_same_overrides() -> None:
    assert sorted(built_figures()) == presets()
    first, second = compose_figures(["zhang2007_fig5", "mozerov2006_fig1"], ["data=hdm05", "seed=3"])
    assert [single.name for single in (first, second)] == ["zhang2007_fig5", "mozerov2006_fig1"]
    assert (first.seed, second.seed) == (3, 3)
    assert "has no walks" in reason_without_clips(first)
    assert reason_without_clips(second) == ""


def test_a_folder_is_named_as_it_is_called_now(tmp_path: Path) -> None:
    link, names = tmp_path / "walks", []
    for name in ("mine", "yours"):
        (tmp_path / name).mkdir()
        link.unlink(missing_ok=True)
        link.symlink_to(tmp_path / name)
        names.append(compose(["experiment=zhang2007_fig5", "data=folder", f"data.path={link}"]).data.name)
    assert names == ["folder_mine", "folder_yours"]


def test_the_last_folder_of_results_counts() -> None:
    assert compose(["experiment=zhang2007_fig5", "results=one", "results=two"]).results == "two"
    assert (
        compose(["experiment=zhang2007_fig5", "results=one", "results='two and a half'"]).results[:4]
        == "two "
    )
    for nowhere, code in (
        ("results=", "no_folder_named"),
        ("results=null", "invalid_value"),
        ("results=~/three", "no_folder_named"),
    ):
        with rejects_options(code, "results"):
            compose(["experiment=zhang2007_fig5", "results=one", nowhere])


@pytest.mark.parametrize(
    ("preset", "words"),
    [
        ("defaults:\n", "conf: .*broken', defaults must be a list"),
        ("name: [a\n", r"while parsing .*broken\.yaml"),
        ("foo: 1\n", "Key 'foo' not in 'Experiment'"),
        ("title: \udce9\n", r"broken\.yaml \(save it as UTF-8\): 'utf-8' codec can't decode byte 0xe9"),
        (
            "defaults:\n  - zhang2004_fig2\n",
            r"experiment/broken\.yaml, name must equal the name of the preset's file"
            r" \(expected broken, found zhang2004_fig2\)",
        ),
    ],
)
def test_a_broken_preset_is_refused_in_a_sentence(
    preset: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(CONF, tmp_path / "conf")
    monkeypatch.setattr("pipeline.plugins.CONF", tmp_path / "conf")
    (tmp_path / "conf" / "experiment" / "broken.yaml").write_text(
        f"# @package _global_\n{preset}", encoding="utf-8", errors="surrogateescape"
    )
    with pytest.raises(Exception) as caught:
        composition.composed(["experiment=broken"])
    assert re.search(words, sentence(caught.value))


def test_a_preset_may_stand_in_brackets() -> None:
    assert composition.composed(["experiment=[zhang2007_fig5]"]).name == "zhang2007_fig5"


def test_a_paper_that_does_not_exist_is_refused() -> None:
    experiment = compose(["experiment=zhang2007_fig5"])
    experiment.paper = "nobody1999"
    with rejects("unknown_choice", "paper", value="nobody1999"):
        on_this_machine(experiment)
