"""Tests of the project's own files after damage: each command reports the error in a sentence, and none hangs."""

from __future__ import annotations

import html
import json
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.cli.durations import durations
from pipeline.cli.main import main
from pipeline.report import document, players
from pipeline.report.light import keep_light
from pipeline.storage import archive, tables
from pipeline.storage.publishing import publish
from pipeline.storage.sealed_folders import MANIFEST, digest, read_manifest, write_manifest
from pipeline.storage.store import Store
from pipeline.studies.ledger import judge_folder
from pipeline.studies.published import COLUMNS, filled
from pipeline.studies.registry import all_measures
from tests.processes import WAIT_S
from tests.rejects import rejects
from tests.report.planted import CLAIM, plant
from walk3d.film.reconstruct import model_file

FIGURE = "zhang2007_fig5"


@pytest.fixture(autouse=True)
def _never_waits() -> Iterator[None]:
    """Fail a test that waits for input from a pipe."""

    def waited(*_: object) -> None:
        raise AssertionError("a file is waited for")

    before = signal.signal(signal.SIGALRM, waited)
    signal.alarm(int(WAIT_S))
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def sealed_with(**changes: Any) -> Callable[[Path], None]:
    """Return a function that changes or removes entries of a manifest, and seals the manifest again."""

    def spoil(folder: Path) -> None:
        facts = read_manifest(folder)
        del facts["files"]
        write_manifest(folder, {k: v for k, v in (facts | changes).items() if v is not None})

    return spoil


def _as_pipe(folder: Path) -> None:
    (folder / MANIFEST).unlink()
    os.mkfifo(folder / MANIFEST)


def listing(name: str) -> Callable[[Path], None]:
    """Return a function that adds a file name to a sealed manifest."""

    def spoil(folder: Path) -> None:
        manifest = json.loads((folder / MANIFEST).read_bytes())
        del manifest["seal"]
        manifest["files"][name] = {"bytes": 1, "sha256": digest(b"x")}
        content = json.dumps(manifest, sort_keys=True, separators=(",", ":"))
        (folder / MANIFEST).write_text(json.dumps({**manifest, "seal": digest(content.encode())}))

    return spoil


MANIFESTS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "deep": (lambda folder: (folder / MANIFEST).write_text("[" * 200_000), "nested more than 64 levels deep"),
    "pipe": (_as_pipe, "it is not a regular file"),
    "of another type": (sealed_with(stages=[3]), "manifest.json has missing or unexpected entries"),
    "of other stages": (sealed_with(stages={"sweep": 3}), "manifest.json has missing or unexpected entries"),
    "without options": (sealed_with(configuration=None), "has no entry 'configuration'"),
    "outside": (
        listing("../../../x.json"),
        "manifest.json lists a file whose path is not inside its folder: '../../../x.json'",
    ),
    "from the root": (
        listing("/tmp/x.json"),
        "manifest.json lists a file whose path is not inside its folder: '/tmp/x.json'",
    ),
}
"""Ways to damage the manifest of a figure, each with the expected message."""

CODES = {
    "deep": "too_deep",
    "pipe": "unreadable",
    "outside": "not_plain_path",
    "from the root": "not_plain_path",
}


@pytest.mark.parametrize("way", MANIFESTS)
def test_a_command_says_what_is_wrong_with_a_manifest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    # Composing every figure, for each command, takes seconds.
    monkeypatch.setattr("pipeline.cli.compose.built_figures", lambda: [FIGURE, "zhang2007_fig2"])
    spoil, complaint = MANIFESTS[way]
    folder = plant(tmp_path / "synthetic" / "smoke" / FIGURE, claims=CLAIM)
    plant(tmp_path / "synthetic" / "smoke" / "zhang2007_fig2", claims=CLAIM)
    spoil(folder)
    options = ["scale=smoke", f"results={tmp_path}"]

    def output_of(*arguments: str) -> str:
        main([*arguments, *options])
        return " ".join("".join(capsys.readouterr()).split())

    assert f"{FIGURE} missing" in output_of("status", f"experiment={FIGURE}")
    if way != "without options":
        for command in ("report", "claims"):
            assert output_of(command).endswith(complaint)
    document.write_page(folder.parent, [FIGURE, "zhang2007_fig2"])
    page = html.unescape((folder.parent / "index.html").read_text("utf-8"))
    assert f"unfinished or damaged: {MANIFEST}" in page
    assert complaint in page
    refused = (
        rejects("unfinished", FIGURE)
        if way != "without options"
        else rejects("other_origin", FIGURE, fact="lock_sha256")
    )
    with refused:
        archive.check_figure(folder, commit="f" * 40, lock=Path(__file__), scale="", current=False)


@pytest.mark.parametrize("way", ["deep", "pipe", "outside"])
def test_a_folder_with_such_a_manifest_is_not_replaced_and_nothing_is_written_outside(
    tmp_path: Path, way: str
) -> None:
    folder = plant(tmp_path / "results" / "synthetic" / "full" / FIGURE, scale="full")
    MANIFESTS[way][0](folder)
    with rejects("not_replaced", FIGURE, why=CODES[way]), publish(folder):
        raise AssertionError("nothing is written")
    before = set(tmp_path.rglob("*"))
    lock = tmp_path / "requirements.lock"
    facts: dict[str, Any] = {"date": "2026-11-22", "commit": "f" * 40, "dirty": False, "lock": lock}
    lock.write_text("numpy==2.4.6\n")
    for keep in (
        lambda: keep_light(folder.parent, tmp_path / "light" / "synthetic", [FIGURE], **facts),
        lambda: archive.keep(
            folder.parent, tmp_path / "archive", [FIGURE], name="a", data="synthetic", **facts
        ),
    ):
        with rejects("unfinished", FIGURE):
            keep()
    assert set(tmp_path.rglob("*")) == before | {lock}


@pytest.mark.parametrize("name", [MANIFEST, archive.CHECKSUMS, "table.csv"])
def test_an_archive_in_which_a_pipe_took_the_name_of_a_file_has_changed(tmp_path: Path, name: str) -> None:
    with publish(tmp_path / "kept", having="archive") as publication:
        (publication.folder / "table.csv").write_text("a\n1\n")
        archive.seal(publication, {"archive": "a"})
    retained = tmp_path / "kept"
    assert archive.verify(retained) == []
    (retained / name).unlink()
    os.mkfifo(retained / name)
    if name == archive.CHECKSUMS:
        with rejects("no_archive", "kept"):
            archive.verify(retained)
    else:
        assert any(complaint.startswith(name) for complaint in archive.verify(retained))


@pytest.mark.parametrize("way", ["deep", "pipe", "outside"])
def test_an_artefact_with_such_a_manifest_is_damaged_and_computed_again(tmp_path: Path, way: str) -> None:
    def asked() -> Any:
        return Store(tmp_path).artefact("model", {}, [], lambda: ({"x": np.arange(3)}, {}), code="0")

    folder = tmp_path / "cache" / asked().name
    MANIFESTS[way][0](folder)
    again = asked()
    assert again.why.startswith("artefact damaged: manifest.json ")
    assert MANIFESTS[way][1] in again.why
    assert not asked().computed


@pytest.mark.parametrize("way", ["deep", "pipe", "outside", "from the root"])
def test_a_model_of_walkers_with_such_a_manifest_is_not_read(tmp_path: Path, way: str) -> None:
    folder = tmp_path / "walkers"
    shutil.copytree(model_file.SHIPPED, folder)
    assert model_file.load(folder).compact.walkers > 0
    MANIFESTS[way][0](folder)
    with rejects("no_model" if way == "pipe" else CODES[way], "walkers"):
        model_file.load(folder)


PAGES: dict[str, tuple[dict[str, Any], str]] = {
    "arrays": ({"arrays": dict.fromkeys(players.WALKER_ARRAYS, np.zeros(3))}, FIGURE),
    "table": ({"more": {"table_people.csv": {"a": [1]}}}, FIGURE),
    "claims": ({"claims": {"a": [1]}}, "claims.csv"),
    "numbers": ({"claims": CLAIM | {"value": ["x"], "bounds": ["x"]}}, ""),
}


@pytest.mark.parametrize("way", PAGES)
def test_a_page_of_figures_with_other_content_is_a_sentence(tmp_path: Path, way: str) -> None:
    spoil, where = PAGES[way]
    options: dict[str, dict[str, Any]] = {"model": {}, "sweep": {}}
    for name, value in players._AS_COMPUTED.items():
        group, option = name.split(".")
        options.setdefault(group, {})[option] = value
    arrays = dict.fromkeys(players.WALKER_ARRAYS, np.zeros((2, 225)))
    people = {"table_people.csv": {"walker": ["a"], "view_angle_deg": [0]}}
    output: dict[str, Any] = {"arrays": arrays, "more": people, "claims": CLAIM, "configuration": options}
    folder = plant(tmp_path / "synthetic" / "smoke" / FIGURE, **output | spoil)
    with rejects("other_version", where):
        document.write_page(folder.parent, [FIGURE])


def test_claims_on_a_table_that_lacks_a_column_are_a_sentence(tmp_path: Path) -> None:
    folder = plant(tmp_path / "synthetic" / "smoke" / FIGURE)
    (folder / "table_ingest.csv").write_text("person,verdict,reason\na,kept,short\n")
    sealed_with()(folder)
    with rejects("other_version", "smoke") as refusal:
        judge_folder(folder.parent, "synthetic", [FIGURE], measures=all_measures())
    assert refusal.value.what.startswith("an entry is missing: 'clip'")


@pytest.mark.parametrize("header", ["command", "wall_s", "command,wall_s\na,x\n"])
def test_durations_of_another_form_are_a_sentence(tmp_path: Path, header: str) -> None:
    (tmp_path / "durations.csv").write_text(header)
    rows = tables.read_rows(tmp_path / "durations.csv") or [dict.fromkeys(header.split(","), "1")]
    with rejects("not_understood", "durations.csv"):
        durations(rows)


def test_published_numbers_without_a_column_are_a_sentence() -> None:
    with rejects("no_column", "published.csv", column="value"):
        filled({}, {name: np.zeros(1) for name in COLUMNS if name != "value"})


def test_a_picture_and_a_chart_that_are_none_are_sentences(tmp_path: Path) -> None:
    folder = plant(tmp_path / "synthetic" / "smoke" / FIGURE)
    (folder / "figure.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(99))
    sealed_with(charts=[])(folder)
    with rejects("unreadable", "figure.png"):
        document.write_page(folder.parent, [FIGURE])
    for chart in ({"y": 3}, {"y": "a", "styles": 3}, {"y": "a", "also": [3]}, {}):
        sealed_with(charts=[chart])(folder)
        with rejects("other_version", FIGURE):
            document.write_page(folder.parent, [FIGURE])
