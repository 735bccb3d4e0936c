"""Tests of the light archive: its size, its completeness, its description, and the links of its page."""

from __future__ import annotations

import gzip
import json
import re
from pathlib import Path
from typing import Any

import pytest

from pipeline.report import document, light
from pipeline.report.light import keep_light
from pipeline.storage import archive, tables
from pipeline.storage.sealed_folders import digest, file_digest, write_manifest
from tests.rejects import rejects
from tests.report.planted import CLAIM, plant

FACTS: dict[str, Any] = {"date": "2026-11-22", "commit": "f" * 40, "dirty": False}
FIGURES = ["zhang2007_fig5", "mozerov2006_fig1"]


@pytest.fixture
def lock(tmp_path: Path) -> Path:
    path = tmp_path / "requirements.lock"
    path.write_text("numpy==2.4.6\n")
    return path


@pytest.fixture
def results(tmp_path: Path, lock: Path) -> Path:
    """Results of two figures at full scale, one with a large table and one with a large recording."""
    folder = tmp_path / "synthetic" / "full"
    output: dict[str, Any] = {"scale": "full", "lock_sha256": digest(lock.read_bytes())}
    large = {"table_many.csv": {"sample": list(range(40_000))}}
    plant(folder / "zhang2007_fig5", claims=CLAIM, more=large, recording=b"RRF2 small", **output)
    plant(folder / "mozerov2006_fig1", recording=b"RRF2" + bytes(2_500_000), **output)
    return folder


def test_it_holds_what_a_person_needs_and_verifies(
    results: Path, lock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    room = document.MAX_BYTES + light.METADATA_BYTES + light.RECORDINGS_BYTES + 400_000
    monkeypatch.setattr("pipeline.report.light.MAX_BYTES", room)
    (tmp_path / "tutorial" / "answer").mkdir(parents=True)
    (tmp_path / "tutorial" / "answer" / "answer.svg").write_text("<svg/>")
    target = tmp_path / "archive" / "light" / "synthetic"
    kinds = keep_light(results, target, FIGURES, lock=lock, **FACTS)
    assert archive.verify(target) == []
    names = {path.relative_to(target).as_posix() for path in target.rglob("*") if path.is_file()}
    assert {
        "index.html",
        "ro-crate-metadata.json",
        "SHA256SUMS",
        "manifest.json",
        "requirements.lock",
    } <= names
    assert {
        "table.csv",
        "table_many.csv.gz",
        "claims.csv",
        "figure.webp",
        "recording.rrd",
        "manifest.json",
    } <= {name.rpartition("/")[2] for name in names if name.startswith("zhang2007_fig5/")}
    assert "tutorial/answer.svg" in names
    left_out = tables.read_rows(target / "left_out.csv")
    assert "mozerov2006_fig1/recording.rrd" not in names  # too large
    assert ("mozerov2006_fig1", "recording.rrd") in {(row["figure"], row["file"]) for row in left_out}
    assert {row["file"] for row in left_out} == {"arrays.npz", "recording.rrd"}
    assert not [name for name in names if name.endswith((".npz", ".png"))]
    many = results / "zhang2007_fig5" / "table_many.csv"
    assert (
        gzip.decompress((target / "zhang2007_fig5" / "table_many.csv.gz").read_bytes()) == many.read_bytes()
    )
    assert sum(kinds.values()) < 10_000_000


def test_the_largest_tables_are_left_out_where_they_do_not_fit(
    results: Path, lock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.report.light.PLAIN_BYTES", 10)
    reserved = document.MAX_BYTES + light.METADATA_BYTES + light.RECORDINGS_BYTES
    monkeypatch.setattr("pipeline.report.light.MAX_BYTES", reserved + 40_000)
    target = tmp_path / "light" / "synthetic"
    keep_light(results, target, FIGURES, lock=lock, **FACTS)
    left_out = [(row["figure"], row["file"]) for row in tables.read_rows(target / "left_out.csv")]
    assert ("zhang2007_fig5", "table_many.csv") in left_out
    assert (target / "zhang2007_fig5" / "table.csv.gz").is_file()
    rule = {(row["figure"], row["table"]) for row in tables.read_rows(target / "digits.csv")}
    assert ("zhang2007_fig5", "table.csv") in rule
    assert ("zhang2007_fig5", "table_many.csv") not in rule
    assert archive.verify(target) == []


def test_of_recorded_people_it_gives_no_motion_on(lock: Path, tmp_path: Path) -> None:
    folder, target = tmp_path / "optical" / "full", tmp_path / "light" / "optical"
    output: dict[str, Any] = {"scale": "full", "lock_sha256": digest(lock.read_bytes())}
    plant(folder / "zhang2007_fig5", recording=b"RRF2 small", inputs={"07_01": "0" * 64}, **output)
    keep_light(folder, target, ["zhang2007_fig5"], lock=lock, **FACTS)
    assert {path.name for path in target.rglob("*")} >= {"table.csv", "figure.webp", "index.html"}
    assert not [path for path in target.rglob("*") if path.suffix in (".rrd", ".npz")]
    assert ("zhang2007_fig5", "recording.rrd") in {
        (row["figure"], row["file"]) for row in tables.read_rows(target / "left_out.csv")
    }
    assert "No player: this page may not pass recorded motion on" in (target / "index.html").read_text()
    assert archive.verify(target) == []


def test_the_links_of_its_page_work_in_it(results: Path, lock: Path, tmp_path: Path) -> None:
    target = tmp_path / "light" / "synthetic"
    keep_light(results, target, FIGURES, lock=lock, **FACTS)
    page = (target / "index.html").read_text(encoding="utf-8")
    links = [link for link in re.findall(r'href="([^"]*)"', page) if not link.startswith("#")]
    assert "zhang2007_fig5/table_many.csv.gz" in links
    assert "zhang2007_fig5/figure.webp" in links
    assert "zhang2007_fig5/recording.rrd" in links
    assert [link for link in links if not (target / link).is_file()] == []


def test_the_metadata_describe_every_file_and_every_run(results: Path, lock: Path, tmp_path: Path) -> None:
    target = tmp_path / "light" / "synthetic"
    keep_light(results, target, FIGURES, lock=lock, **FACTS)
    graph = json.loads((target / "ro-crate-metadata.json").read_text())["@graph"]
    entities = {entity["@id"]: entity for entity in graph}
    assert len(entities) == len(graph)
    root = entities["./"]
    assert entities["ro-crate-metadata.json"]["about"] == {"@id": "./"}
    assert {"name", "description", "datePublished", "license", "conformsTo"} <= root.keys()
    for part in root["hasPart"]:
        assert entities[part["@id"]]["sha256"] == file_digest(target / part["@id"])
        assert entities[part["@id"]]["contentSize"] == str((target / part["@id"]).stat().st_size)
    table = entities["zhang2007_fig5/table_many.csv.gz"]
    assert (table["name"], table["encodingFormat"]) == ("table_many.csv.gz", "application/gzip")
    assert entities["zhang2007_fig5/recording.rrd"]["encodingFormat"] == "application/octet-stream"
    runs = [entity for entity in graph if entity["@type"] == "CreateAction"]
    assert [run["@id"] for run in runs] == [f"#{name}" for name in FIGURES]
    assert root["mentions"] == [{"@id": run["@id"]} for run in runs]
    names = {part["@id"] for part in root["hasPart"]}
    for run, figure in zip(runs, FIGURES, strict=True):
        assert {item["@id"] for item in run["result"]} == {n for n in names if n.startswith(f"{figure}/")}
        assert run["instrument"] == {"@id": "#gait-pipeline"}
    assert entities["#gait-pipeline"]["softwareVersion"] == FACTS["commit"]
    # Whatever an entity refers to is there, or lies outside of the archive.
    for entity in graph:
        for value in entity.values():
            for item in value if isinstance(value, list) else [value]:
                if isinstance(item, dict):
                    assert item["@id"] in entities or item["@id"].startswith("http"), item


def test_it_is_written_again_but_never_over_something_else(results: Path, lock: Path, tmp_path: Path) -> None:
    target = tmp_path / "light" / "synthetic"
    keep_light(results, target, FIGURES, lock=lock, **FACTS)
    before = {path: path.read_bytes() for path in target.rglob("*") if path.is_file()}
    keep_light(results, target, FIGURES, lock=lock, **FACTS)
    assert {path: path.read_bytes() for path in target.rglob("*") if path.is_file()} == before
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    with rejects("not_replaced", "mine", why="no_file"):
        keep_light(results, tmp_path / "mine", FIGURES, lock=lock, **FACTS)
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["notes.txt"]


def test_a_changed_file_is_named(results: Path, lock: Path, tmp_path: Path) -> None:
    target = tmp_path / "light" / "synthetic"
    keep_light(results, target, FIGURES, lock=lock, **FACTS)
    (target / "zhang2007_fig5" / "table.csv").write_text("method\nmap\n")
    (target / "SHA256SUMS").write_text((target / "SHA256SUMS").read_text().replace("a", "b", 1))
    described = archive.verify(target)
    assert "zhang2007_fig5/table.csv: changed" in described
    assert any(sentence.startswith("SHA256SUMS") for sentence in described)


@pytest.mark.parametrize("change", ["", "{}", "facts", "resealed"])
def test_its_own_manifest_is_part_of_it(results: Path, lock: Path, tmp_path: Path, change: str) -> None:
    target = tmp_path / "light" / "synthetic"
    keep_light(results, target, FIGURES, lock=lock, **FACTS)
    path = target / "manifest.json"
    manifest = json.loads(path.read_text())
    if change == "":
        path.unlink()
    elif change == "facts":
        path.write_text(json.dumps({**manifest, "date": "2020-01-01"}))
    elif change == "resealed":
        (target / "zhang2007_fig5" / "table.csv").write_text("method\nmap\n")
        write_manifest(target, {"light": True})
    else:
        path.write_text(change)
    described = archive.verify(target)
    files = {"resealed": ["zhang2007_fig5/table.csv", "SHA256SUMS"]}.get(change, ["manifest.json"])
    assert [sentence.split()[0].rstrip(":") for sentence in described] == files


@pytest.mark.parametrize(
    ("facts", "code", "values"),
    [
        ({"dirty": True}, "uncommitted_changes", {}),
        ({"commit": "e" * 40}, "other_origin", {"fact": "commit"}),
    ],
)
def test_results_that_cannot_be_traced_are_refused(
    results: Path, lock: Path, tmp_path: Path, facts: dict[str, Any], code: str, values: dict[str, str]
) -> None:
    with rejects(code, **values):
        keep_light(results, tmp_path / "light", FIGURES, lock=lock, **{**FACTS, **facts})
    assert not (tmp_path / "light").exists()


def test_results_of_another_commit_with_the_same_sources_are_kept(
    results: Path, lock: Path, tmp_path: Path
) -> None:
    facts = {**FACTS, "commit": "e" * 40}
    with rejects("other_origin", "zhang2007_fig5", fact="commit"):
        keep_light(results, tmp_path / "light", FIGURES, lock=lock, current=["mozerov2006_fig1"], **facts)
    keep_light(results, tmp_path / "light", FIGURES, lock=lock, current=FIGURES, **facts)
    assert archive.verify(tmp_path / "light") == []
    manifest = json.loads((tmp_path / "light" / "zhang2007_fig5" / "manifest.json").read_text())
    assert manifest["provenance"]["commit"] == FACTS["commit"]  # the one that made it
    page = (tmp_path / "light" / "index.html").read_text(encoding="utf-8")
    assert f"commit <code>{FACTS['commit'][:12]}</code>" in page


def test_one_too_large_is_refused(
    results: Path, lock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.report.light.MAX_BYTES", 50_000)
    with rejects("file_too_large", "light"):
        keep_light(results, tmp_path / "light", FIGURES, lock=lock, **FACTS)
    assert not (tmp_path / "light").exists()


def test_a_run_with_changed_options_is_kept_under_its_name(tmp_path: Path, lock: Path) -> None:
    run = tmp_path / "scratch" / "2026-11-22_06-00"
    for variant in ("0_model.components=10", "1_model.components=20"):
        plant(run / variant / "zhang2007_fig5", lock_sha256=digest(lock.read_bytes()))
    data, figures = archive.figures_of_run(run)
    facts = {"data": data, "scale": "", "lock": lock, **FACTS}
    retained = archive.keep(run, tmp_path / "archive", figures, name="my_variant", **facts)
    assert retained == tmp_path / "archive" / "my_variant" / "synthetic"
    assert archive.verify(retained) == []
    assert (retained / "1_model.components=20" / "zhang2007_fig5" / "table.csv").is_file()
    with rejects("not_plain_name"):
        archive.keep(run, tmp_path / "archive", figures, name="../elsewhere", **facts)
    with rejects("no_figure", "nothing"):
        archive.figures_of_run(tmp_path / "nothing")


def test_a_table_that_would_be_too_large_unpacked_is_left_out(
    results: Path, lock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The archive omits a table that is larger than the limit for unpacked files."""
    size = (results / "zhang2007_fig5" / "table_many.csv").stat().st_size
    for bound, left_out in ((size, False), (size - 1, True)):
        monkeypatch.setattr(light, "MAX_UNPACKED_BYTES", bound)
        target = tmp_path / "light" / "synthetic"
        keep_light(results, target, FIGURES, lock=lock, **FACTS)
        assert (target / "zhang2007_fig5" / "table_many.csv.gz").is_file() is not left_out
        files = {row["file"] for row in tables.read_rows(target / "left_out.csv")}
        assert ("table_many.csv" in files) is left_out
