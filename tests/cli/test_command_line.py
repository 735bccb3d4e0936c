"""Tests of the command line: fast help, errors in one sentence, and no incomplete files."""

from __future__ import annotations

import errno
import functools
import hashlib
import importlib
import importlib.util
import os
import re
import shutil
import signal
import sys
import textwrap
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.cli import main as command_line
from pipeline.cli.main import commands
from pipeline.cli.options import filled
from pipeline.cli.presets import presets
from pipeline.formats.points import csv, trc
from pipeline.skeleton import WALKER15
from pipeline.storage import sealed_folders, store, tables
from pipeline.synthetic.walkers import WalkingPopulation, walking_population
from pipeline.validation import InvalidInput
from tests.processes import forked, is_complete, python
from walk3d.film.reconstruct.writing import Reconstruct

ROOT = Path(__file__).resolve().parents[2]
FIXTURES = ROOT / "tests" / "fixtures"
RATE_HZ = 60.0
QUICK = ("scale=smoke", "figure.picture=false", "figure.recording=false")


def run(*arguments: str, **environment: str) -> CompletedProcess[str]:
    """Run ``python -m pipeline …`` in a separate process."""
    return python("-m", "pipeline", *arguments, **environment)


def leftovers(folder: Path) -> list[str]:
    """Return the temporary files that a run must not leave behind."""
    return [
        str(path.relative_to(folder))
        for path in folder.rglob("*")
        if path.name.startswith((".tmp", ".old")) or path.name.endswith((".tmp", ".part", ".part.rrd"))
    ]


def assert_one_sentence(message: str, *words: str) -> None:
    """Assert that a message is a single line without a traceback, and contains these words."""
    assert "Traceback" not in message
    assert "HYDRA_FULL_ERROR" not in message
    assert len(message.strip().splitlines()) == 1, message
    assert [word for word in words if word not in message] == [], message


# --- help and commands ------------------------------------------------------------------------------------


def test_help_waits_for_no_library() -> None:
    heavy = ["numpy", "scipy", "pandas", "rerun", "matplotlib", "hydra", "omegaconf", "rich", "pyarrow"]
    code = f"""
        import runpy, sys
        sys.argv = ["pipeline", "--help"]
        try:
            runpy.run_module("pipeline", run_name="__main__")
        except SystemExit as end:
            assert end.code == 0
        print("imported:", [name for name in {heavy} if name in sys.modules])
    """
    done = python("-c", textwrap.dedent(code))
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("imported: []\n")
    assert done.stderr == ""


def test_help_names_every_figure_command_and_exit_status(say: Callable) -> None:
    message = say("--help")
    assert message.status == 0
    assert message.out == say().out == say("-h").out == say("help").out
    for word in (*presets(), *commands(), "-m", "Exit status"):
        assert word in message.out
    assert "{figures}" not in message.out
    assert max(map(len, message.out.splitlines())) <= 120


def test_help_on_a_terminal_that_knows_only_ascii() -> None:
    done = run("--help", PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["frobnicate"], ["command is unknown", "figures", "verify", "frobnicate"]),
        (["=3"], ["command is unknown"]),
        (["scale=smoke"], ["no experiment is named", *presets()]),
        (["experiment=zhang2007_fig9"], ["experiment:", "zhang2007_fig5", "got zhang2007_fig9"]),
        (["experiment=zhang2007_fig5", "model.component=3"], ["model.component:", "components"]),
        (["experiment=zhang2007_fig5", "model.components=x"], ["model.components:", "Integer"]),
        (["figures", "workers=two"], ["workers:", "two", "Integer"]),
        (["experiment=zhang2007_fig5", "+x=1"], ["x:", "option does not exist"]),
        (["experiment=zhang2007_fig5", "model.components=1,2"], ["-m in front"]),
        (["figures", "data=nowhere"], ["data:", "synthetic", "got nowhere"]),
        (["figures", "walk"], ["not an override", "walk"]),
        (["claims", "zhang2007_fig9"], ["experiment must be one of", "zhang2007_fig5", "got zhang2007_fig9"]),
        (["model", "training.components=x"], ["training.components must be a whole number", "got x"]),
        (["claims", "scale=huge"], ["scale:", "full", "got huge"]),
        (["claims", "scale=0"], ["scale:", "full", "got 0"]),
        (["verify"], ["no archive is named"]),
        (["verify", "results/archive/nowhere"], ["nowhere"]),
        (["equations", "newton1687"], ["the paper must be one of", "zhang2004", "newton1687"]),
        (["fetch", "data=synthetic"], ["optical, cmu or hdm05"]),
    ],
)
def test_a_wrong_command_is_answered_in_one_sentence(
    say: Callable, arguments: list[str], words: list[str]
) -> None:
    message = say(*arguments)
    assert message.status == 1
    assert message.result == ""
    assert_one_sentence(message.err, *words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "no figure is named"),
        (["zhang2007_fig55"], "experiment must be one of"),
        (["zhang2007_fig5", "results=nowhere"], "the recording file does not exist"),
    ],
)
def test_what_cannot_be_viewed_is_said_in_one_sentence(
    say: Callable, arguments: list[str], words: str
) -> None:
    message = say("view", *arguments)
    assert (message.status, message.result) == (1, "")
    assert_one_sentence(message.err, words)


def test_the_equations_are_printed_with_their_homes(say: Callable) -> None:
    message = say("equations", "zhang2007")
    assert message.status == 0
    assert "(3.15)" in message.out
    assert "pipeline/core/reconstruction/known_view.py:" in message.out


@pytest.mark.parametrize(
    ("figure", "override", "words"),
    [
        (
            "zhang2007_fig5",
            "sweep.noise_variance_mm2=0",
            ["sweep.noise_variance_mm2 must be above 0", "got 0"],
        ),
        ("zhang2007_fig5", "sweep.noise_variance_mm2=-70", ["must be above 0", "got -70"]),
        ("zhang2007_fig5", "sweep.noise_variance_mm2=nan", ["noise_variance_mm2", "got nan"]),
        ("zhang2007_fig3", "sweep.sigma2_mm2.start=0", ["noise variance", "must be above 0"]),
        ("zhang2007_fig3", "sweep.methods=[least_squares]", ["sweep.methods", "map"]),
        ("zhang2007_fig5", "sweep.view_angle_deg.stop=-90", ["sweep.view_angle_deg.stop must be above -90"]),
        ("zhang2007_fig6", "sweep.view_angle_deg.step=0", ["sweep.view_angle_deg", "step"]),
        ("zhang2007_fig5", "sweep.methods=[]", ["sweep.methods", "none"]),
        ("zhang2007_fig5", "sweep.methods=[map,map]", ["sweep.methods must be non-empty", "got map, map"]),
        ("zhang2007_fig5", "sweep.methods=[mpa]", ["sweep.methods", "least_squares", "mpa"]),
        ("zhang2007_fig5", "sweep.truth=video", ["sweep.truth", "motion, fourier"]),
        ("zhang2007_fig5", "sweep.missing_variance=x", ["temporal, overall"]),
        ("zhang2007_fig4", "sweep.demonstration_views_deg=[]", ["sweep.demonstration_views_deg"]),
        ("zhang2007_fig6", "sweep.solver=guess", ["global, published"]),
        ("zhang2007_fig6", "sweep.angle_range_deg=[0]", ["sweep.angle_range_deg", "[low, high]"]),
        ("zhang2007_fig6", "sweep.angle_range_deg=[90,-90]", ["range of view angles is empty"]),
        ("zhang2007_fig5", "sweep=unknown_view", ["sweep: ", "expected KnownView"]),
        ("zhang2007_fig6", "sweep=known_view", ["sweep: ", "expected UnknownView"]),
        ("zhang2007_fig4", "sweep=none", ["sweep: ", "expected KnownView"]),
        ("zhang2007_fig4", "figure.walker=12", ["figure.walker must be at most 11", "got 12"]),
        ("zhang2007_fig4", "figure.instants=0", ["figure.instants"]),
        ("zhang2007_fig5", "model.components=0", ["model.components must be at least 1"]),
        ("zhang2007_fig5", "model.divisor=R-2", ["R-1, R"]),
        ("zhang2004_fig4", "model.omega_scale_mm=0", ["model.omega_scale_mm must be above 0"]),
        ("zhang2007_fig5", "dataset.harmonics=0", ["dataset.harmonics must be at least 1"]),
        ("zhang2007_coverage", "dataset.harmonics=1", ["dataset.harmonics must be at least 2"]),
        ("zhang2007_joint_angles", "sweep.instants=1000000", ["must be at least 5 and at most 1000"]),
        ("zhang2007_fig5", "dataset.walks=some", ["dataset.walks", "best, all"]),
        ("zhang2007_fig5", "dataset.size=big", ["dataset.size", "absolute, stature"]),
        ("zhang2007_fig5", "dataset.origin=moon", ["pelvis_mean, floor"]),
        ("zhang2007_fig5", "data.population=0", ["data.population"]),
        ("zhang2007_fig5", "data.walkers=-1", ["data.walkers"]),
        ("zhang2007_fig5", "data.walkers=1", ["at least three walkers", "found 1"]),
        ("zhang2007_fig5", "data.walkers=2", ["at least three walkers", "found 2"]),
        ("zhang2007_fig5", "data.duration_s=0.2", ["duration_s", "at least"]),
        ("zhang2007_fig5", "data.marker_noise_mm=-1", ["marker_noise_mm must be at least 0"]),
        ("zhang2007_fig5", "workers=0", ["workers must be at least 1 (got 0)"]),
        ("zhang2007_fig5", "workers=-1", ["workers must be at least 1 (got -1)"]),
        ("zhang2007_fig5", "data=folder", ["data.path must be an existing folder"]),
        ("zhang2007_fig5", "data=optical data.raw=nowhere", ["nowhere", "make data", "MOCAP_MIRROR"]),
    ],
)
def test_options_that_cannot_work_end_in_one_sentence(
    say: Callable,
    smoke_cache: Path,
    monkeypatch: pytest.MonkeyPatch,
    figure: str,
    override: str,
    words: list[str],
) -> None:
    monkeypatch.delenv("MOCAP_MIRROR", raising=False)
    message = say(f"experiment={figure}", "scale=smoke", f"results={smoke_cache}", *override.split())
    assert message.status == 1
    assert message.result == ""
    # A choice that is none is found when options are composed, before there is a figure.
    assert_one_sentence(message.err, *words, *([] if "Invalid value" in message.err else [figure]))
    assert leftovers(smoke_cache) == []


@pytest.mark.parametrize(
    ("figure", "override"),
    [("zhang2007_fig5", "sweep.view_angle_deg.step=7.5"), ("zhang2007_fig3", "sweep.sigma2_mm2.start=0.5")],
)
def test_a_broken_step_suits_a_table_and_not_a_recording(
    say: Callable, smoke_cache: Path, figure: str, override: str
) -> None:
    message = say(f"experiment={figure}", "scale=smoke", f"results={smoke_cache}", override)
    assert_one_sentence(message.err, "whole numbers", "figure.recording=false")
    assert say(f"experiment={figure}", *QUICK, f"results={smoke_cache}", override).status == 0


@pytest.mark.parametrize(
    ("figure", "override"),
    [
        ("zhang2007_fig5", "sweep.view_angle_deg={start:30,stop:31}"),
        ("zhang2007_fig4", "sweep.demonstration_views_deg=[-30.5]"),
        ("mozerov2006_fig2", "model.steps=[0]"),
    ],
)
def test_one_view_and_one_step_make_a_figure(
    say: Callable, smoke_cache: Path, figure: str, override: str
) -> None:
    message = say(f"experiment={figure}", "scale=smoke", f"results={smoke_cache}", override)
    assert (message.status, message.err) == (0, "")


def test_clips_of_two_kinds_are_refused_beside_each_other(say: Callable, tmp_path: Path) -> None:
    for figure, change, kind in (
        ("zhang2007_fig2", "data.marker_noise_mm=1e9", "walks"),
        ("mozerov2006_fig1", "data.performances.limit=1", "performances"),
    ):
        message = say(f"experiment={figure}", *QUICK, f"results={tmp_path}", change)
        assert_one_sentence(message.err, f"every reason is in {tmp_path}/synthetic/smoke/refused_{kind}.csv")


ANATOMICAL = [f"zhang2007_{name}" for name in ("author", "coverage", "occlusion", "sources", "structure")]


@pytest.mark.parametrize("figure", ANATOMICAL)
def test_three_walkers_are_too_few_for_the_anatomical_prior(
    say: Callable, smoke_cache: Path, figure: str
) -> None:
    message = say(f"experiment={figure}", *QUICK, f"results={smoke_cache}", "data.walkers=3")
    assert message.status == 1
    assert_one_sentence(message.err, "found 3")


@pytest.mark.parametrize(
    "figure", [name for name in presets() if name.startswith("zhang") and name not in ANATOMICAL]
)
def test_three_walkers_make_every_figure_and_it_is_said_that_components_are_fewer(
    say: Callable, smoke_cache: Path, figure: str
) -> None:
    message = say(f"experiment={figure}", *QUICK, f"results={smoke_cache}", "data.walkers=3")
    assert (message.status, message.err) == (0, "")
    requested = 28 if "2004" in figure else 30
    assert (
        f"1 eigenwalkers instead of {requested}: leave-one-out has only 2 people to learn from" in message.out
    )


def test_one_refused_figure_does_not_stop_the_others(say: Callable, smoke_cache: Path) -> None:
    message = say(
        "figures", "experiment=zhang2007_fig5,zhang2007_fig2", *QUICK, f"results={smoke_cache}", "workers=1",
        "data.walkers=3", "model.components=0",
    )  # fmt: skip
    assert message.status == 1
    assert_one_sentence(
        message.err, "not made (zhang2007_fig5, zhang2007_fig2)", "model.components must be at least 1"
    )
    message = say(
        "figures", "experiment=zhang2007_fig3,zhang2007_fig2", *QUICK, f"results={smoke_cache}", "figure.picture=false",
        "dataset.size=stature",
    )  # fmt: skip
    assert message.status == 0


@pytest.fixture(scope="session")
def smoke_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results folder that the tests share, so that walkers are simulated only once."""
    return tmp_path_factory.mktemp("command_line")


# --- the user's own files ---------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def people() -> WalkingPopulation:
    """Eight synthetic walkers, recorded for four seconds."""
    return walking_population(
        np.random.default_rng(7), male=3, female=5, duration_s=4.0, frame_rate_hz=RATE_HZ
    )


def overground(people: WalkingPopulation, walker: int, heading: float = 0.7) -> np.ndarray:
    """Return the joints (T, 15, 3), mm, of a walker who walks straight across the room."""
    motion = people.positions_mm[walker].copy()
    motion[..., 1] += (people.people[walker].speed * np.arange(len(motion)) / RATE_HZ)[:, None]
    c, s = np.cos(heading), np.sin(heading)
    return motion @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


@pytest.fixture
def walks(tmp_path: Path, people: WalkingPopulation) -> Path:
    """Folder with four valid walks as TRC and CSV files, two on a treadmill and two across the room."""
    folder = tmp_path / "walks"
    folder.mkdir()
    trc.write(folder / "anna_1.trc", WALKER15.joints, people.positions_mm[0], RATE_HZ)
    csv.write(folder / "bela_1.csv", WALKER15.joints, people.positions_mm[1], RATE_HZ)
    trc.write(folder / "cleo_1.trc", WALKER15.joints, overground(people, 2), RATE_HZ)
    csv.write(folder / "dora_1.csv", WALKER15.joints, overground(people, 3, heading=-2.5), RATE_HZ)
    return folder


def of_folder(folder: Path, results: Path, *overrides: str) -> list[str]:
    """Return the arguments that compute a figure from the files in a folder."""
    return [
        "experiment=zhang2007_fig2", *QUICK, "data=folder", f"data.path={folder}", f"results={results}", *overrides
    ]  # fmt: skip


def ingest_report(results: Path) -> dict[str, Mapping[str, str]]:
    """Return the rows of the only ``table_ingest.csv`` below `results`, by clip."""
    (path,) = results.glob("scratch/*/*/table_ingest.csv")
    return {row["clip"]: row for row in tables.read_rows(path)}


def test_a_file_name_that_is_a_formula_is_none_in_the_table_of_refused_clips(
    say: Callable, people: WalkingPopulation, tmp_path: Path
) -> None:
    folder = tmp_path / "walks"
    folder.mkdir()
    name = "=HYPERLINK(1;2)_1.csv"
    csv.write(folder / name, WALKER15.joints, np.repeat(people.positions_mm[0][:1], 300, axis=0), RATE_HZ)
    message = say(*of_folder(folder, tmp_path / "results"))
    path = tmp_path / "results" / "folder_walks" / "smoke" / "refused_walks.csv"
    assert_one_sentence(message.err, f"every reason is in {path}")
    cells = path.read_text("utf-8").replace("\n", ",").split(",")
    assert f"'{name}" in cells
    assert name not in cells
    assert [row["clip"] for row in tables.read_rows(path)] == [name]


def test_a_folder_of_walks_is_enough(say: Callable, walks: Path, tmp_path: Path) -> None:
    message = say(*of_folder(walks, tmp_path / "results"))
    assert (message.status, message.err) == (0, "")
    report = ingest_report(tmp_path / "results")
    assert {row["verdict"] for row in report.values()} == {"kept"}
    assert {name: row["person"] for name, row in report.items()} == {
        "anna_1.trc": "anna", "bela_1.csv": "bela", "cleo_1.trc": "cleo", "dora_1.csv": "dora"
    }  # fmt: skip
    assert [report[n]["locomotion"] for n in ("anna_1.trc", "cleo_1.trc")] == ["treadmill", "overground"]


def metres(people: WalkingPopulation, folder: Path) -> None:
    path = folder / "bad_1.csv"
    csv.write(path, WALKER15.joints, overground(people, 7) / 1000.0, RATE_HZ)
    path.write_text(path.read_text().replace("_mm", "", 3))  # the header no longer says what they are


def missing_joint(people: WalkingPopulation, folder: Path) -> None:
    retained = [j for j, name in enumerate(WALKER15.joints) if name != "left_knee"]
    trc.write(
        folder / "bad_1.trc",
        [WALKER15.joints[j] for j in retained],
        overground(people, 7)[:, retained],
        RATE_HZ,
    )


def joint_never_seen(people: WalkingPopulation, folder: Path) -> None:
    motion = overground(people, 7)
    motion[:, WALKER15.index("left_knee")] = np.nan
    trc.write(folder / "bad_1.trc", WALKER15.joints, motion, RATE_HZ)


def head_never_seen(people: WalkingPopulation, folder: Path) -> None:
    motion = overground(people, 7)
    motion[:, WALKER15.index("head")] = np.nan
    trc.write(folder / "bad_1.trc", WALKER15.joints, motion, RATE_HZ)


def two_people(people: WalkingPopulation, folder: Path) -> None:
    names = [f"{who}:{joint}" for who in ("A", "B") for joint in WALKER15.joints]
    both = np.concatenate([overground(people, 6), overground(people, 7)], axis=1)
    trc.write(folder / "bad_1.trc", names, both, RATE_HZ)


def standing(people: WalkingPopulation, folder: Path) -> None:
    still = np.repeat(overground(people, 7)[:1], 240, axis=0)
    trc.write(folder / "bad_1.trc", WALKER15.joints, still, RATE_HZ)


def backwards(people: WalkingPopulation, folder: Path) -> None:
    trc.write(folder / "bad_1.trc", WALKER15.joints, overground(people, 7)[::-1], RATE_HZ)


def few_frames(people: WalkingPopulation, folder: Path) -> None:
    trc.write(folder / "bad_1.trc", WALKER15.joints, overground(people, 7)[:30], RATE_HZ)


def one_frame(people: WalkingPopulation, folder: Path) -> None:
    trc.write(folder / "bad_1.trc", WALKER15.joints, overground(people, 7)[:1], RATE_HZ)


def half_the_rate(people: WalkingPopulation, folder: Path) -> None:
    trc.write(folder / "bad_1.trc", WALKER15.joints, overground(people, 7), RATE_HZ / 2)


def truncated_c3d(people: WalkingPopulation, folder: Path) -> None:
    (folder / "bad_1.c3d").write_bytes((FIXTURES / "c3d_intel_reals.c3d").read_bytes()[:1100])


def empty_file(people: WalkingPopulation, folder: Path) -> None:
    (folder / "bad_1.bvh").write_bytes(b"")


def amc_without_its_skeleton(people: WalkingPopulation, folder: Path) -> None:
    (folder / "bad_1.amc").write_bytes((FIXTURES / "amc_by_hand.amc").read_bytes())


BAD_CLIPS: list[tuple[Callable[[WalkingPopulation, Path], None], str]] = [
    (missing_joint, "needs the point 'left_knee'"),
    (joint_never_seen, "needs the point 'left_knee'"),
    (two_people, "the file has 2 people: select one with"),
    (standing, "no steady walking"),
    (backwards, "walks backwards"),
    (few_frames, "no steady walking"),
    (one_frame, "no steady walking"),
    (truncated_c3d, "truncated"),
    (empty_file, "empty"),
    (amc_without_its_skeleton, "expected one .asf file in its folder"),
]


@pytest.mark.parametrize(("write", "words"), BAD_CLIPS, ids=[write.__name__ for write, _ in BAD_CLIPS])
def test_one_bad_clip_among_good_ones_is_listed_with_its_reason(
    say: Callable, walks: Path, tmp_path: Path, people: WalkingPopulation, write: Callable, words: str
) -> None:
    write(people, walks)
    message = say(*of_folder(walks, tmp_path / "results"))
    assert (message.status, message.err) == (0, "")
    assert "1 of 5 clips are rejected; table_ingest.csv has the reasons" in message.out
    report = ingest_report(tmp_path / "results")
    (bad,) = [row for name, row in report.items() if name.startswith("bad_1")]
    assert bad["verdict"] == "refused"
    assert words in bad["reason"]
    assert str(tmp_path) not in bad["reason"], "a table names no folder of this machine"
    assert sum(row["verdict"] == "kept" for row in report.values()) == 4


@pytest.mark.parametrize(
    ("write", "column", "words"),
    [(metres, "reason", "taken as m,"), (head_never_seen, "missing_joints", "head")],
    ids=["metres", "head_never_seen"],
)
def test_an_odd_clip_is_used_and_what_was_decided_is_listed(
    say: Callable,
    walks: Path,
    tmp_path: Path,
    people: WalkingPopulation,
    write: Callable,
    column: str,
    words: str,
) -> None:
    write(people, walks)
    message = say(*of_folder(walks, tmp_path / "results"))
    assert (message.status, message.err) == (0, "")
    (odd,) = [row for name, row in ingest_report(tmp_path / "results").items() if name.startswith("bad_1")]
    assert odd["verdict"] == "kept"
    assert words in odd[column]


def test_a_walk_far_slower_than_the_others_is_kept_and_said(
    say: Callable, walks: Path, tmp_path: Path, people: WalkingPopulation
) -> None:
    # Its frequency is right for what the file says, so only a person can know that the rate is wrong.
    half_the_rate(people, walks)
    message = say(*of_folder(walks, tmp_path / "results"))
    assert (message.status, message.err) == (0, "")
    assert "bad_1.trc is slower than the others" in message.out
    (bad,) = [row for name, row in ingest_report(tmp_path / "results").items() if name == "bad_1.trc"]
    assert bad["verdict"] == "kept"
    assert "slower than the others" in bad["reason"]


def test_nothing_but_bad_clips_is_refused_with_reasons(
    say: Callable, tmp_path: Path, people: WalkingPopulation
) -> None:
    folder = tmp_path / "walks"
    folder.mkdir()
    standing(people, folder)
    truncated_c3d(people, folder)
    message = say(*of_folder(folder, tmp_path / "results"))
    assert (message.status, message.result) == (1, "")
    assert_one_sentence(message.err, "none of the 2 clips", "no steady walking", "truncated")
    assert leftovers(tmp_path) == []


def test_short_gaps_are_bridged_and_long_ones_end_the_stretch(
    say: Callable, walks: Path, tmp_path: Path, people: WalkingPopulation
) -> None:
    short, long = people.positions_mm[4].copy(), people.positions_mm[5].copy()
    short[50:55, WALKER15.index("left_wrist")] = np.nan
    long[150:200, WALKER15.index("left_wrist")] = np.nan
    trc.write(walks / "emil_1.trc", WALKER15.joints, short, RATE_HZ)
    trc.write(walks / "fritz_1.trc", WALKER15.joints, long, RATE_HZ)
    assert say(*of_folder(walks, tmp_path / "results")).status == 0
    report = ingest_report(tmp_path / "results")
    assert [report["emil_1.trc"][c] for c in ("verdict", "bridged_values", "last_frame")] == [
        "kept",
        "5",
        "239",
    ]
    assert [report["fritz_1.trc"][c] for c in ("verdict", "bridged_values", "last_frame")] == [
        "kept",
        "0",
        "149",
    ]


def test_metres_that_are_said_to_be_metres_are_read(
    say: Callable, walks: Path, tmp_path: Path, people: WalkingPopulation
) -> None:
    metres(people, walks)
    overrides = ["data.pattern=bad*", "data.units=m", "data.walkers=0"]
    message = say(*of_folder(walks, tmp_path / "results", *overrides))
    assert_one_sentence(message.err, "three walkers", "found 1")  # it was kept: there is only one


@pytest.mark.parametrize(
    ("make", "overrides", "words"),
    [
        (lambda folder: None, [], ["data.path must be an existing folder"]),
        (lambda folder: folder.mkdir(), [], ["no motion capture", ".c3d", "an empty folder"]),
        (
            lambda folder: (folder.mkdir(), (folder / "walk.fbx").write_text("x")),
            [],
            ["no motion capture", ".fbx"],
        ),
        (lambda folder: folder.write_text("x"), [], ["data.path must be an existing folder"]),
        (lambda folder: folder.mkdir(), ["data.pattern="], ["data.pattern"]),
        (lambda folder: folder.mkdir(), ["data.pattern=/*.c3d"], ["data.pattern"]),
        (
            lambda folder: (folder.mkdir(), (folder / "a.trc").write_text("x")),
            ["data.person='('"],
            ["data.person"],
        ),
    ],
)
def test_a_folder_without_walks_is_refused(
    say: Callable, tmp_path: Path, make: Callable, overrides: list[str], words: list[str]
) -> None:
    make(tmp_path / "walks")
    message = say(*of_folder(tmp_path / "walks", tmp_path / "results", *overrides))
    assert (message.status, message.result) == (1, "")
    assert_one_sentence(message.err, *words)
    assert leftovers(tmp_path) == []


def test_a_file_that_may_not_be_read_is_named(
    say: Callable, walks: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = Path.read_bytes

    def forbidden(path: Path) -> bytes:
        if path.suffix == ".trc":
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return read(path)

    monkeypatch.setattr(Path, "read_bytes", forbidden)
    message = say(*of_folder(walks, tmp_path / "results"))
    assert message.status == 1
    assert_one_sentence(message.err, "anna_1.trc", "Permission denied")


def test_a_person_is_what_the_expression_finds(say: Callable, walks: Path, tmp_path: Path) -> None:
    """A file is assigned to a person by the expression; a file without a match counts as a separate person."""
    message = say(*of_folder(walks, tmp_path / "results", "data.person='(anna)?(bela)?'"))
    assert message.status == 0
    people = {row["person"] for row in ingest_report(tmp_path / "results").values()}
    assert people == {"anna", "bela_1", "cleo_1", "dora_1"}


def test_a_listed_recording_that_is_not_here_is_listed_as_such(
    say: Callable, walks: Path, tmp_path: Path
) -> None:
    message = say(
        "experiment=zhang2007_fig2", *QUICK, f"results={tmp_path / 'results'}", "data=cmu", "data.sources=[mine]",
        f"data.table={sources(tmp_path, walks, 'gone_1.trc')}", f"data.raw={walks}", "data.mirror=",
        "data.skeletons=[walker15]",
    )  # fmt: skip
    assert (message.status, message.err) == (0, "")
    report = ingest_report(tmp_path / "results")
    assert "not available" in report["gone_1"]["reason"]
    assert "1 of 5 clips are rejected" in message.out


@pytest.mark.parametrize("place", ["data.raw", "data.mirror"])
def test_a_listed_recording_that_was_changed_is_refused_and_the_others_are_used(
    say: Callable, walks: Path, tmp_path: Path, place: str
) -> None:
    table, changed = sources(tmp_path, walks), walks / "bela_1.csv"
    content = changed.read_bytes()
    changed.write_bytes(content[:-3] + bytes([content[-3] ^ 1]) + content[-2:])
    assert changed.stat().st_size == len(content)
    folders = {"data.raw": tmp_path / "none", "data.mirror": tmp_path / "none"} | {place: walks}
    message = say(
        "experiment=zhang2007_fig2", *QUICK, f"results={tmp_path / 'results'}", "data=cmu", "data.sources=[mine]",
        f"data.table={table}", *(f"{option}={folder}" for option, folder in folders.items()),
        "data.skeletons=[walker15]",
    )  # fmt: skip
    assert (message.status, message.err) == (0, "")
    report = ingest_report(tmp_path / "results")
    assert {name: row["verdict"] for name, row in report.items()} == {
        "anna_1": "kept", "bela_1": "refused", "cleo_1": "kept", "dora_1": "kept"
    }  # fmt: skip
    assert report["bela_1"]["reason"].startswith("bela_1.csv: the file differs from the table of recordings")
    assert f"expected sha256 {hashlib.sha256(content).hexdigest()[:12]}…" in report["bela_1"]["reason"]
    assert "1 of 4 clips are rejected" in message.out


def sources(folder: Path, walks: Path, *gone: str) -> Path:
    """Write a table of sources that lists the files in a folder and some missing files; return its path."""
    (like,) = tables.read_rows(ROOT / "data" / "sources.csv")[:1]
    rows = [
        {**like, "path": path.name, "source": "mine", "action": "walk", "subject": path.stem, "trial": path.stem,
         "skeleton": "walker15", "frame_rate_hz": "60", "bytes": str(path.stat().st_size if path.exists() else 1),
         "sha256": hashlib.sha256(path.read_bytes() if path.exists() else b"").hexdigest()}
        for path in [*sorted(walks.iterdir()), *(walks / name for name in gone)]
    ]  # fmt: skip
    lines = [",".join(rows[0]), *(",".join(f'"{value}"' for value in row.values()) for row in rows)]
    path = folder / "sources.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


# --- what stands at the destination -----------------------------------------------------------------------


@pytest.fixture
def thesis(tmp_path: Path) -> Path:
    """Folder that the project did not write, with files of the user."""
    folder = tmp_path / "thesis"
    (folder / "chapters").mkdir(parents=True)
    (folder / "chapters" / "one.tex").write_text("years of work")
    (folder / "table.csv").write_text("mine\n")
    return folder


def assert_unharmed(thesis: Path) -> None:
    files = {path.relative_to(thesis).as_posix(): path.read_text() for path in thesis.rglob("*.*")}
    assert files == {"chapters/one.tex": "years of work", "table.csv": "mine\n"}


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("name", "{thesis}"),
        ("name", "../../.."),
        ("name", "../thesis"),
        ("name", ".."),
        ("name", "''"),
        ("name", ".hidden"),
        ("data.name", "../thesis"),
        ("data.name", "{thesis}"),
        ("scale.name", "../../thesis"),
    ],
)
def test_a_name_that_is_a_path_is_refused_before_anything_is_computed(
    say: Callable, tmp_path: Path, thesis: Path, option: str, value: str
) -> None:
    message = say(
        "experiment=zhang2007_fig2", *QUICK, f"results={tmp_path / 'results'}",
        f"{option}={value.format(thesis=thesis)}",
    )  # fmt: skip
    assert (message.status, message.result) == (1, "")
    assert_one_sentence(message.err, f"{option} must be a plain name, not a path")
    assert_unharmed(thesis)
    assert not (tmp_path / "results").exists()


def test_the_name_of_the_users_own_data_is_no_path_either(
    say: Callable, walks: Path, tmp_path: Path, thesis: Path
) -> None:
    message = say(*of_folder(walks, tmp_path / "results", "data.name=../thesis"))
    assert (message.status, message.result) == (1, "")
    assert_one_sentence(message.err, "data.name must be a plain name")
    assert_unharmed(thesis)


def test_the_users_own_data_do_not_take_the_place_of_another_data_set(
    say: Callable, walks: Path, tmp_path: Path
) -> None:
    for name in ("synthetic", "optical"):
        message = say(*of_folder(walks, tmp_path / "results", f"data.name={name}"))
        assert (message.status, message.result) == (1, "")
        assert_one_sentence(message.err, f"data.name must not be the name of another data set (got {name})")
    assert not (tmp_path / "results").exists()


def test_a_folder_that_was_not_published_is_not_replaced(
    say: Callable, tmp_path: Path, thesis: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    destination = tmp_path / "results" / "synthetic" / "smoke" / "zhang2007_fig2"
    destination.parent.mkdir(parents=True)
    thesis.rename(destination)
    monkeypatch.setattr("pipeline.synthetic.walkers.walking_population", _not_called)
    message = say("experiment=zhang2007_fig2", "scale=smoke", f"results={tmp_path / 'results'}")
    assert (message.status, message.result) == (1, "")
    assert_one_sentence(
        message.err, str(destination), "this program did not publish it", "manifest.json is missing"
    )
    assert_unharmed(destination)


def test_a_readers_own_files_survive_another_run(say: Callable, tmp_path: Path) -> None:
    arguments = ["experiment=zhang2007_fig2", "scale=smoke", f"results={tmp_path}"]
    assert say(*arguments).status == 0
    folder = tmp_path / "synthetic" / "smoke" / "zhang2007_fig2"
    (folder / "notes.txt").write_text("mine")
    (folder / "table.csv").write_text("edited")
    assert say(*arguments).status == 0
    assert sealed_folders.complaints_about(folder) == []
    assert (folder / "notes.txt").read_text() == "mine"
    assert leftovers(tmp_path) == []


@pytest.mark.thorough
def test_claims_of_an_edited_table_are_refused_and_the_file_is_named(say: Callable, tmp_path: Path) -> None:
    arguments = ["scale=smoke", f"results={tmp_path}"]
    figure = "experiment=zhang2007_fig2"
    assert say(figure, *arguments).status == 0
    assert say("claims", figure, *arguments).status == 0
    table = tmp_path / "synthetic" / "smoke" / "zhang2007_fig2" / "table.csv"
    frame = pd.read_csv(table)
    frame.assign(eigenvalue_mm2=0.7 * frame["eigenvalue_mm2"]).to_csv(table, index=False)
    for command in (["claims", figure], ["archive"]):
        message = say(*command, *arguments)
        assert (message.status, message.result) == (1, "")
        assert_one_sentence(message.err, str(table), "changed after it was published")


# --- disks ------------------------------------------------------------------------------------------------


def test_a_file_in_the_place_of_the_results_folder(say: Callable, tmp_path: Path) -> None:
    (tmp_path / "results").write_text("mine")
    message = say("experiment=zhang2007_fig2", *QUICK, f"results={tmp_path / 'results'}")
    assert (message.status, message.result) == (1, "")
    assert_one_sentence(message.err, "cannot write results")
    assert (tmp_path / "results").read_text() == "mine"


def test_a_results_folder_that_may_not_be_written(say: Callable, tmp_path: Path) -> None:
    if os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    tmp_path.chmod(0o500)
    try:
        message = say("experiment=zhang2007_fig2", *QUICK, f"results={tmp_path / 'results'}")
    finally:
        tmp_path.chmod(0o700)
    assert message.status == 1
    assert_one_sentence(message.err, "cannot write results", "ermission")


def test_a_read_only_results_folder_is_noticed_before_the_work(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store.os, "access", lambda path, mode: False)
    monkeypatch.setattr("pipeline.synthetic.walkers.walking_population", _not_called)
    message = say("experiment=zhang2007_fig2", *QUICK, f"results={tmp_path}")
    assert message.status == 1
    assert_one_sentence(message.err, "cannot write results", "Permission denied")


def _not_called(*arguments: object, **options: object) -> None:
    raise AssertionError("the work began although its result cannot be kept")


@pytest.mark.parametrize("part", ["arrays.npz", "table.csv", "manifest.json"])
def test_a_full_disk_leaves_nothing_half_written_and_the_next_run_picks_up(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, part: str
) -> None:
    arguments = ["experiment=zhang2007_fig2", *QUICK, f"results={tmp_path}"]
    really_open = Path.open

    def full(path: Path, mode: str = "r", *others: object, **options: object) -> object:
        if "w" in mode and part in path.name:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        return really_open(path, mode, *others, **options)  # type: ignore[call-overload]

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", full)
        message = say(*arguments)
    assert (message.status, message.result) == (1, "")
    assert_one_sentence(message.err, "cannot write results", "No space left on device")
    assert leftovers(tmp_path) == []
    assert list(tmp_path.glob("scratch/*/*/*")) == []
    assert say(*arguments).status == 0


FULL_DISK = """
    import resource, sys
    from pipeline.cli import main as command_line

    arguments = ["experiment=zhang2007_fig4", "scale=smoke", f"results={sys.argv[1]}"]

    def publish():
        return command_line.main(arguments)

    assert publish() == 0
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
    sys.exit(publish())
"""


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit on the size of files")
def test_a_recording_cut_short_by_a_full_disk_is_not_published(tmp_path: Path) -> None:
    """A recording that a full disk truncates is not published, although the Rerun library only logs the error."""
    done = python("-c", textwrap.dedent(FULL_DISK), str(tmp_path))
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert "cannot write results: the recording is truncated" in done.stderr.splitlines()[-1]
    figure = tmp_path / "synthetic" / "smoke" / "zhang2007_fig4"
    assert sealed_folders.complaints_about(figure) == [], "the older figure stands as it was"
    assert (figure / "recording.rrd").stat().st_size > 400_000
    assert leftovers(tmp_path) == []


# --- interruptions ----------------------------------------------------------------------------------------


def stopping_after(module: str, function: str, arguments: Sequence[str]) -> int:
    """Run the command line with a function that prints a word after its work and then never returns."""
    *above, name = function.split(".")
    owner = functools.reduce(getattr, above, importlib.import_module(module))
    really = getattr(owner, name)

    @functools.wraps(really)
    def slow(*arguments: Any, **options: Any) -> None:
        really(*arguments, **options)
        print("here", flush=True)
        while True:  # a signal that comes just before a sleep is only noticed after it
            time.sleep(0.01)

    setattr(owner, name, slow)
    return command_line.main(arguments)


def interrupted(module: str, function: str, number: int, *arguments: str) -> tuple[int, str]:
    """Return the exit status and the last message of a run that receives a signal after a function has finished."""
    with forked(lambda: stopping_after(module, function, arguments)) as process:
        assert process.stdout.readline().startswith("setting up")
        line = process.stdout.readline()
        process.send_signal(number)
        _, err = process.communicate()
        assert line == "here\n", err
        assert process.returncode is not None
        return process.returncode, err


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
def test_ctrl_c_in_the_middle_ends_in_one_sentence_and_keeps_what_was_finished(
    say: Callable, tmp_path: Path
) -> None:
    arguments = ["experiment=zhang2007_fig5", *QUICK, f"results={tmp_path}"]
    status, err = interrupted(
        "pipeline.studies.walks.known_view", "KnownView.measure", signal.SIGINT, *arguments
    )
    assert status == 130
    assert_one_sentence(err, "interrupted", "continues from there")
    assert leftovers(tmp_path) == []
    assert list(tmp_path.glob("scratch/*/*")) == []
    names = sorted(path.name.split("-")[0] for path in (tmp_path / "cache").iterdir())
    assert names == ["dataset", "ingest", "model"]
    assert all(is_complete(path) for path in (tmp_path / "cache").iterdir())
    message = say(*arguments)
    assert message.status == 0
    assert "ingest dataset model" in message.out, "the next run goes on from there"
    assert "model sweep" not in message.out


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
def test_a_run_that_was_killed_while_it_published_resumes(say: Callable, tmp_path: Path) -> None:
    arguments = ["experiment=zhang2007_fig5", *QUICK, f"results={tmp_path}"]
    status, _ = interrupted("pipeline.stages.figure", "judge_figure", signal.SIGKILL, *arguments)
    assert status == -signal.SIGKILL
    assert len(leftovers(tmp_path)) == 1, (
        "the kill left its temporary folder, which nothing takes for a result"
    )
    (scratch,) = (tmp_path / "scratch").iterdir()
    assert [path.name for path in scratch.iterdir()] == leftovers(scratch)
    sealed_folders.remove_stale(scratch)
    assert leftovers(tmp_path) == []
    message = say(*arguments)
    assert message.status == 0
    assert "ingest dataset model sweep" in message.out


def test_ctrl_c_while_options_are_read_is_no_traceback(
    say: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ctrl_c(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pipeline.cli.compose.compose", ctrl_c)
    message = say("figures")
    assert message.status == 130
    assert_one_sentence(message.err, "interrupted")


@pytest.mark.thorough
def test_claims_and_archive_ask_only_for_what_the_data_set_has() -> None:
    from pipeline.cli.commands import figures_for
    from pipeline.cli.compose import built_figures

    every = built_figures()
    assert set(every) == set(presets())
    assert figures_for([])[1] == every
    _, bends = figures_for(["data=hdm05"])
    assert set(bends) == {f for f in every if f.startswith("mozerov2006")} - {"mozerov2006_warp_error"}


def test_figures_that_are_all_current_are_not_made_again(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    both = ["zhang2004_fig2", "zhang2007_fig2"]
    monkeypatch.setattr("pipeline.cli.compose.built_figures", lambda: both)
    sweep = ("figures", "data=synthetic", "scale=smoke", f"results={tmp_path}")
    assert say(*sweep).status == 0
    output = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("manifest.json")}
    again = say(*sweep)
    assert (again.status, "2 figures are current" in again.out) == (0, True)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("manifest.json")} == output
    shutil.rmtree(tmp_path / "synthetic" / "smoke" / both[0])
    assert "figures are current" not in say(*sweep).out
    assert (tmp_path / "synthetic" / "smoke" / both[0] / "manifest.json").is_file()


def test_what_a_data_set_has_nothing_for_is_left_out_and_said(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.cli.compose.built_figures", lambda: ["mozerov2006_fig1", "zhang2007_fig5"])
    message = say("figures", "data=hdm05", "data.raw=nowhere", "data.mirror=", f"results={tmp_path}")
    assert message.status == 1, "none of its recordings is on this machine"
    assert "Left out: " in message.out
    assert "zhang2007_fig5" in message.out
    assert "has no walks" in message.out
    assert_one_sentence(message.err, "none of the 32 recordings", "make data")
    chosen = say("figures", "data=hdm05", "experiment=zhang2007_fig5", f"results={tmp_path}")
    assert chosen.status == 1
    assert_one_sentence(chosen.err, "zhang2007_fig5", "has no walks")


# --- variants ---------------------------------------------------------------------------------------------


def has_launcher(name: str) -> bool:
    """Return whether the package with this Hydra launcher is installed."""
    names = ("hydra_plugins", f"hydra_plugins.hydra_{name}_launcher")
    return all(map(importlib.util.find_spec, names))


@pytest.mark.thorough
@pytest.mark.parametrize(
    "launcher",
    [
        pytest.param(
            "joblib", marks=pytest.mark.skipif(not has_launcher("joblib"), reason="needs the extra `cluster`")
        ),
    ],
)
def test_variants_by_every_launcher(launcher: str, tmp_path: Path) -> None:
    variants = tmp_path / "variants"
    done = run(
        "-m", f"hydra/launcher={launcher}", "experiment=zhang2007_fig2", *QUICK, f"results={tmp_path / 'results'}",
        f"hydra.sweep.dir={variants}", "data.walkers=3", "model.components=1,2", MALLOC_ARENA_MAX="2",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    folders = sorted(path.parent for path in variants.glob("*/zhang2007_fig2/manifest.json"))
    names = [folder.parent.name for folder in folders]
    assert [("model.components=1," in name, "model.components=2," in name) for name in names] == [
        (True, False), (False, True)
    ]  # fmt: skip
    assert all(is_complete(folder) for folder in folders)
    first, second = (tables.read(folder / "table.csv") for folder in folders)
    np.testing.assert_array_equal(first["eigenvalue_mm2"], second["eigenvalue_mm2"])


def test_a_refused_variant_ends_non_zero_and_the_others_are_made(say: Callable, tmp_path: Path) -> None:
    variants = tmp_path / "variants"
    message = say(
        "-m", "experiment=zhang2007_fig2", *QUICK, f"results={tmp_path / 'results'}",
        f"hydra.sweep.dir={variants}", "model.components=0,5",
    )  # fmt: skip
    assert message.status == 1
    assert "Traceback" not in message.err
    assert "model.components=0," in message.err.splitlines()[-1]
    assert "model.components must be at least 1 (got 0)" in message.err
    (output,) = variants.glob("*/*/table.csv")
    assert output.parts[-3].startswith("1_")
    assert "model.components=5," in output.parts[-3]


def test_variants_go_below_the_results_folder_that_is_named(say: Callable, tmp_path: Path) -> None:
    both = ("data.walkers=3,4", "--multirun")  # behind the overrides, as Hydra's own users type it
    message = say("experiment=zhang2007_fig2", *QUICK, f"results={tmp_path}", *both)
    assert (message.status, message.err) == (0, "")
    names = sorted(path.parts[-3] for path in tmp_path.glob("scratch/*/*/zhang2007_fig2/table.csv"))
    assert [name.split(",")[0] for name in names] == ["0_data.walkers=3", "1_data.walkers=4"]


def test_a_run_leaves_nothing_in_the_folder_it_is_started_from(
    say: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = tmp_path / "here"
    start.mkdir()
    monkeypatch.chdir(start)
    assert say("experiment=zhang2007_fig2", *QUICK, f"results={tmp_path / 'results'}").status == 0
    assert list(start.iterdir()) == []


def test_a_preset_goes_to_its_own_folder_and_anything_else_to_scratch(say: Callable, tmp_path: Path) -> None:
    assert say("experiment=zhang2007_fig2", "scale=smoke", f"results={tmp_path}").status == 0
    assert is_complete(tmp_path / "synthetic" / "smoke" / "zhang2007_fig2")
    assert not (tmp_path / "scratch").exists()
    assert say("experiment=zhang2007_fig2", *QUICK, f"results={tmp_path}", "seed=1").status == 0
    (scratch,) = tmp_path.glob("scratch/*/zhang2007_fig2")
    assert is_complete(scratch)


def test_a_refusal_survives_the_way_back_from_another_process() -> None:
    import pickle

    refusal = pickle.loads(pickle.dumps(InvalidInput("no", where="here", expected="yes", received="no")))
    assert (str(refusal), refusal.where) == ("here: no (expected yes, found no)", "here")


def test_help_of_reconstruct_names_every_option_and_no_other(say: Callable) -> None:
    described = say("reconstruct", "--help").out
    named = set(re.findall(r"\b((?:(?:input|output)\.)?[a-z_]+)=", described))
    options = Reconstruct()
    requested = {f"{group}.{name}" for group in ("input", "output") for name in vars(getattr(options, group))}
    assert named == (requested - {"input.path"}) | {"model_folder"}
    assert filled(
        Reconstruct, ["input.least_confidence=.3", "output.formats=[c3d,csv]", "input.labels=as_given"]
    )


def test_an_option_without_its_group_is_named_with_it(say: Callable) -> None:
    message = say("reconstruct", "frame_rate_hz=25")
    assert (message.status, message.err) == (
        1, "frame_rate_hz: this option does not exist (expected input.frame_rate_hz)\n"
    )  # fmt: skip
