"""Tests that no command changes existing files of the user, even if they have the names of its outputs.

The commands are those of the registry: one without a declaration, or that writes and is not tried here, fails.
"""

from __future__ import annotations

import hashlib
import itertools
import multiprocessing
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from pipeline.cli.commands import FILLED_PAGES
from pipeline.cli.compose import compose
from pipeline.cli.figures import make_figure
from pipeline.cli.main import commands
from pipeline.fetch import NEEDED_COLUMNS
from pipeline.ingestion.data import RecordedData
from pipeline.processes import CAN_FORK
from pipeline.storage import provenance
from pipeline.storage.store import Store
from tests.conftest import QUICK, CommandResult
from tests.processes import ROOT
from tests.report.planted import CLAIM, plant
from tests.walk3d.film.reconstruct.walks import ERROR, alphapose, in_layout
from tests.walk3d.film.walk.walkers import clip
from walk3d.film.reconstruct import model_file

FIGURE = "synthetic/smoke/zhang2007_fig5"
COMMIT = "f" * 40
SMOKE = ("data=synthetic", "scale=smoke")


@dataclass(frozen=True)
class Case:
    """Way to call a command: its arguments, and a function that prepares the folder to write into."""

    arguments: Callable[[Path, Path], list[str]]
    before: Callable[[Path, Path, pytest.MonkeyPatch], Any] = lambda folder, given, patch: None


def one_figure(patch: pytest.MonkeyPatch) -> None:
    """Restrict the presets to one figure, because composing all of them takes long."""
    patch.setattr("pipeline.cli.compose.built_figures", lambda: ["zhang2007_fig5"])


def published(folder: Path, given: Path, patch: pytest.MonkeyPatch) -> None:
    one_figure(patch)
    shutil.copytree(given / "synthetic", folder / "synthetic")


def full_scale(folder: Path, given: Path, patch: pytest.MonkeyPatch) -> None:
    one_figure(patch)
    patch.setattr(provenance, "provenance", lambda: {"commit": COMMIT, "dirty": False})
    lock = hashlib.sha256(provenance.LOCK.read_bytes()).hexdigest()
    plant(folder / "synthetic" / "full" / "zhang2007_fig5", scale="full", lock_sha256=lock, claims=CLAIM)


def listed(folder: Path, given: Path, patch: pytest.MonkeyPatch) -> None:
    content = (given / "walk.c3d").read_bytes()
    row = {"path": "walk.c3d", "source": "zoo", "bytes": str(len(content)), "address": "", "origin": ""}
    row["sha256"] = hashlib.sha256(content).hexdigest()
    lines = [",".join(NEEDED_COLUMNS), ",".join(row[name] for name in NEEDED_COLUMNS)]
    (given / "sources.csv").write_text("\n".join(lines) + "\n")
    patch.setattr(RecordedData, "listing", given / "sources.csv")


def trained(folder: Path, given: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setattr("walk3d.film.training_command.train", lambda *_: model_file.load())


def switched(folder: Path, given: Path, patch: pytest.MonkeyPatch) -> None:
    (folder / "sensitivity" / "synthetic" / "walks").mkdir(parents=True)  # where its figures are
    row = {"claim": "a", "switch": "b", "value": 1.0, "value_as_it_is": 1.0, "answer_moves": False}
    patch.setattr("pipeline.cli.sensitivity._measured", lambda *_: ([row], []))


def cloned(folder: Path, given: Path, patch: pytest.MonkeyPatch) -> None:
    for name in (*FILLED_PAGES, "conf/readme.yaml", "results/published.csv", "results/durations.csv"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    page = folder / "docs" / "figures.md"
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace("results:begin figures -->\n", "results:begin figures -->\nold\n"))
    patch.setattr(provenance, "PROJECT", folder)


CASES: dict[str, list[Case]] = {
    "figures": [
        Case(lambda to, given: ["figures", "experiment=zhang2007_fig2", *SMOKE, f"results={to}"]),
        Case(
            lambda to, given: [
                "-m", "experiment=zhang2007_fig2", *QUICK, f"results={given}", f"hydra.sweep.dir={to}/run", "seed=1,2"
            ]
        ),
    ],
    "fetch": [Case(lambda to, given: ["fetch", "data=optical", f"data.raw={to}", f"data.mirror={given}"], listed)],
    "reconstruct": [
        Case(
            lambda to, given: [
                "reconstruct", f"{given}/keypoints.json", "input.frame_rate_hz=30", "input.width=1920",
                "input.height=1080", "output.formats=[c3d,trc,bvh,csv,csv_wide]", f"output.path={to}/out",
            ]
        )
    ],
    "model": [Case(lambda to, given: ["model", *SMOKE, f"output={to}/model"], trained)],
    "report": [Case(lambda to, given: ["report", *SMOKE, f"results={to}"], published)],
    "claims": [Case(lambda to, given: ["claims", *SMOKE, f"results={to}"], published)],
    "sensitivity": [Case(lambda to, given: ["sensitivity", "walks", *SMOKE, f"results={to}"], switched)],
    "readme": [Case(lambda to, given: ["readme"], cloned)],
    "archive": [
        Case(
            lambda to, given, more=more: [  # type: ignore[misc]
                "archive", "data=synthetic", f"results={to}", *(more or ["only=zhang2007_fig5"])
            ],
            full_scale,
        )
        for more in ([], ["only=zhang2007_fig5", "light=1"], ["name=mine", "run=RUN"])
    ],
    "inspect": [Case(lambda to, given: ["inspect", f"{given}/walk.c3d", f"write={to}/my_lab.yaml"])],
    "export": [
        Case(lambda to, given, end=end: ["export", f"{given}/{FIGURE}", f"to={to}/walk.{end}"])  # type: ignore[misc]
        for end in ("c3d", "trc", "bvh", "csv", "npz")
    ],
    "pointlight": [
        Case(lambda to, given, end=end: ["pointlight", "synthetic", f"to={to}/walk.{end}"])  # type: ignore[misc]
        for end in ("svg", "csv", "gif", "ptd")
    ],
}  # fmt: skip
CALLS = [
    pytest.param(command, case, id=f"{command}{number}")
    for command, cases in CASES.items()
    for number, case in enumerate(cases)
]


def test_every_command_says_how_it_writes_and_is_tried() -> None:
    assert set(WRITES) == set(commands())
    assert {name for name, how in WRITES.items() if how} == set(CASES)


@pytest.fixture(scope="session")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with inputs of the commands: a published figure, a recording and keypoints."""
    folder = tmp_path_factory.mktemp("given")
    experiment = compose(["experiment=zhang2007_fig5", f"results={folder}", *QUICK])
    make_figure(experiment, folder / FIGURE, store=Store(folder))
    from walk3d.export.command import export

    export([str(folder / FIGURE), "motion=original", f"to={folder}/walk.c3d"])
    alphapose(folder / "keypoints.json", in_layout(clip(-30.0, ERROR), "coco17"))
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    """Return the bytes of all files below a folder, without the cache."""
    files = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return {
        name: path.read_bytes()
        for path in files
        if not (name := path.relative_to(folder).as_posix()).startswith("cache/")
    }


def call(case: Case, folder: Path, given: Path, say: Callable[..., CommandResult]) -> CommandResult:
    arguments = case.arguments(folder, given)
    return say(*[item.replace("run=RUN", f"run={folder}/synthetic/full") for item in arguments])


def written(case: Case, folder: Path, given: Path, say: Callable, patch: pytest.MonkeyPatch) -> set[str]:
    """Return the names of the files that a command writes into a new folder."""
    folder.mkdir()
    case.before(folder, given, patch)
    before = contents(folder)
    message = call(case, folder, given, say)
    assert (message.status, message.err) == (0, "")
    names = {name for name, content in contents(folder).items() if before.get(name) != content}
    assert names
    return names


@pytest.fixture(scope="module")
def all_names() -> dict[str, set[str]]:
    """Names of the files that each command writes, filled in while the tests run."""
    return {}


@pytest.mark.parametrize("linked", [False, True], ids=["files", "links"])
@pytest.mark.parametrize(("command", "case"), CALLS)
def test_files_of_others_under_all_names_are_found_again(
    command: str, case: Case, linked: bool, given: Path, tmp_path: Path, say: Callable,
    monkeypatch: pytest.MonkeyPatch, all_names: dict[str, set[str]],
) -> None:  # fmt: skip
    call_id = f"{command}{CASES[command].index(case)}"
    if call_id not in all_names:
        all_names[call_id] = written(case, tmp_path / "own", given, say, monkeypatch)
    names = all_names[call_id]
    folder, aside = tmp_path / "others", tmp_path / "aside"
    folder.mkdir()
    aside.mkdir()
    case.before(folder, given, monkeypatch)
    for number, name in enumerate(sorted(names)):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        if linked:
            path.symlink_to(aside / f"{number}")
        path.write_bytes(f"of others {number}".encode())
    before, of_links = contents(folder), contents(aside)
    message = call(case, folder, given, say)
    assert contents(aside) == of_links
    assert contents(folder) == before
    assert all((folder / name).is_symlink() == linked for name in names)
    assert message.status == 1, message.out
    described = message.err if command != "fetch" else message.out
    assert "Traceback" not in described
    assert described.strip()
    assert command in ("figures", "fetch") or len(described.splitlines()) == 1


@pytest.mark.parametrize(("command", "case"), CALLS)
def test_it_may_be_written_again_where_it_wrote_before(
    command: str, case: Case, given: Path, tmp_path: Path, say: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A command may replace its own earlier output; output that is a single file needs ``replace=true``."""
    names = written(case, tmp_path / "own", given, say, monkeypatch)
    message = call(case, tmp_path / "own", given, say)
    if WRITES[command] == "file":
        assert "the file is not replaced, since it exists" in message.err
        plain = case.arguments
        message = call(
            Case(lambda to, given: [*plain(to, given), "replace=true"]), tmp_path / "own", given, say
        )
    assert (message.status, message.err) == (0, "")
    assert names <= set(contents(tmp_path / "own"))
    assert not list((tmp_path / "own").rglob(".*"))


@pytest.mark.parametrize("command", ["export", "pointlight", "inspect"])
def test_a_file_goes_neither_over_its_source_nor_into_a_published_folder(
    command: str, given: Path, tmp_path: Path, say: Callable
) -> None:
    before = contents(given)
    option, end = ("write", "yaml") if command == "inspect" else ("to", "csv")
    message = say(command, f"{given}/walk.c3d", f"{option}={given}/{FIGURE}/table.{end}", "replace=true")
    assert (message.status, "must not be a path inside a published folder" in message.err) == (1, True)
    if command == "export":
        source = tmp_path / "walk.c3d"
        shutil.copy(given / "walk.c3d", source)
        message = say(command, str(source), f"to={source}", "replace=true")
        assert (message.status, "it is an input of this command" in message.err) == (1, True)
        assert source.read_bytes() == before["walk.c3d"]
    assert contents(given) == before


@pytest.mark.parametrize("empty", ["results=", "results=''"])
@pytest.mark.parametrize("command", [[], ["-m"], ["figures"], ["report"], ["archive"]])
def test_an_empty_results_folder_is_refused(
    command: list[str], empty: str, tmp_path: Path, say: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    preset = [] if command in (["report"], ["archive"]) else ["experiment=zhang2007_fig2"]
    message = say(*command, *preset, "scale=smoke", empty)
    assert (message.status, message.err) == (1, "results must name a folder for the results (got nothing)\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not CAN_FORK, reason="needs forks")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("failing", range(1, 12))
def test_a_model_is_whole_wherever_its_training_is_killed(failing: int, tmp_path: Path) -> None:
    folder = tmp_path / "model"
    model_file.save(model_file.load(), folder)
    (folder / "CARD.md").write_text("mine")
    calls = itertools.count(1)

    def dying(real: Callable) -> Callable:
        def call(*arguments: Any, **options: Any) -> Any:
            if next(calls) == failing:
                os._exit(9)
            return real(*arguments, **options)

        return call

    def save() -> None:
        for name in ("mkdir", "fsync", "replace", "rename", "open"):
            setattr(os, name, dying(getattr(os, name)))
        model_file.save(trained, folder)

    trained = model_file.load()
    process = multiprocessing.get_context("fork").Process(target=save)
    process.start()
    process.join()
    assert process.exitcode in (0, 9)
    assert model_file.load(folder).compact.components.shape == model_file.load().compact.components.shape
    model_file.save(model_file.load(), folder)
    assert (folder / "CARD.md").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["model"]


WRITES = {
    "figures": "publication", "status": "", "fetch": "recordings", "reconstruct": "publication", "model": "publication",
    "report": "page", "claims": "page", "sensitivity": "page", "equations": "",
    "readme": "this clone", "view": "", "archive": "archive", "verify": "", "inspect": "file", "export": "file",
    "pointlight": "file",
}  # fmt: skip
"""Kind of output of each command, or an empty string if it writes nothing.

A *publication* is a folder that is replaced as a whole if it is ours; *files* are new, unless ``replace=true``; a
*page* is a table or page next to figures, which replaces only its like; *recordings* are those of a list, by digest; an
*archive* only grows; *this clone* are the tables and pictures of the README.
"""
