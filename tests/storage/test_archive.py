"""Tests that the archive accepts only finished full-scale results of a clean commit, and detects later changes."""

import errno
import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pipeline.storage import archive
from pipeline.storage.crate import bill_of_materials
from pipeline.storage.publishing import publish
from pipeline.storage.sealed_folders import complaints_about, digest, read_manifest
from tests.processes import finished
from tests.rejects import rejects

COMMIT = "0123456789abcdef" * 2 + "01234567"
FIGURES = ["zhang2007_fig5", "zhang2007_fig2"]
Make = Callable[..., Path]


@pytest.fixture
def lock(tmp_path: Path) -> Path:
    path = tmp_path / "requirements.lock"
    path.write_text("numpy==2.4.6\n")
    return path


@pytest.fixture
def make(tmp_path: Path, lock: Path) -> Make:
    """Function that publishes figures with the requested changes to the facts in the manifest."""

    def make(data: str = "synthetic", scale: str = "full", **changes: Any) -> Path:
        folder = tmp_path / "results" / data / scale
        for figure in FIGURES:
            with publish(folder / figure) as publication:
                for name in ("table.csv", "table_views.csv", "recording.rrd", "figure.svg", "config.yaml"):
                    (publication.folder / name).write_text(f"{name} of {figure} on {data}")
                output = {"commit": COMMIT, "dirty": False, "lock_sha256": digest(lock.read_bytes())}
                output |= {name: value for name, value in changes.items() if name in output}
                publication.facts = {"figure": figure, "scale": scale, "provenance": output}
        (folder / "claims.csv").write_text("claim,verdict\n")
        return folder

    return make


@pytest.fixture
def keep(tmp_path: Path, lock: Path) -> Make:
    def keep(source: Path, **changes: Any) -> Path:
        facts: dict[str, Any] = {
            "date": "2026-11-21",
            "commit": COMMIT,
            "dirty": False,
            "figures": FIGURES,
            "lock": lock,
            "data": source.parent.name,
        }
        facts |= changes
        return archive.keep(source, tmp_path / "archive", name=f"{facts['date']}-{COMMIT[:12]}", **facts)

    return keep


def snapshot(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_an_archive_holds_everything_and_verifies(tmp_path: Path, make: Make, keep: Make) -> None:
    source = make()
    (source / "zhang2007_fig5" / ".DS_Store").write_text("not ours")
    retained = keep(source)
    assert retained == tmp_path / "archive" / "2026-11-21-0123456789ab" / "synthetic"
    expected = {name: content for name, content in snapshot(source).items() if not name.endswith(".DS_Store")}
    expected["requirements.lock"] = b"numpy==2.4.6\n"
    expected["sbom.cdx.json"] = bill_of_materials(source.parents[2] / "requirements.lock", COMMIT)
    result = snapshot(retained)
    sums = result.pop("SHA256SUMS").decode()
    manifest = json.loads(result.pop("manifest.json"))
    facts = {
        "archive": "2026-11-21-0123456789ab",
        "data": "synthetic",
        "date": "2026-11-21",
        "commit": COMMIT,
    }
    assert facts.items() <= manifest.items()
    assert result == expected
    assert sums.splitlines() == [
        f"{hashlib.sha256(expected[name]).hexdigest()}  {name}" for name in sorted(expected)
    ]
    assert archive.verify(retained) == []


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="needs sha256sum")
def test_the_checksums_are_what_sha256sum_reads(make: Make, keep: Make) -> None:
    retained = keep(make())
    assert finished(["sha256sum", "-c", "--quiet", "SHA256SUMS"], cwd=retained).returncode == 0


def test_a_second_data_set_joins_and_the_first_stays(make: Make, keep: Make) -> None:
    retained = keep(make())
    before = snapshot(retained)
    other = keep(make("optical"))
    assert (other.parent, other.name) == (retained.parent, "optical")
    assert snapshot(retained) == before
    assert archive.verify(retained) == archive.verify(other) == []


def test_to_keep_the_same_again_changes_nothing(tmp_path: Path, make: Make, keep: Make) -> None:
    source = make()
    keep(source)
    before = snapshot(tmp_path / "archive")
    keep(source)
    assert snapshot(tmp_path / "archive") == before


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        (lambda a: (a / "zhang2007_fig5/table.csv").write_text("x"), "table.csv: changed"),
        (lambda a: (a / "zhang2007_fig5/table.csv").unlink(), "table.csv: missing"),
        (lambda a: (a / "zhang2007_fig5/more.csv").write_text(""), "more.csv: added"),
        (lambda a: (a / "zhang2007_fig5/.hidden").write_text(""), ".hidden: added"),
        (lambda a: (a / "requirements.lock").write_text(""), "requirements.lock: changed"),
        (lambda a: (a / "claims.csv").rename(a / "c.csv"), "claims.csv: missing"),
    ],
)
def test_verify_names_what_changed(
    make: Make, keep: Make, spoil: Callable[[Path], Any], problem: str
) -> None:
    retained = keep(make())
    spoil(retained)
    problems = archive.verify(retained)
    assert problems
    assert problems[0].endswith(problem)
    assert len(problems) == (2 if "claims" in problem else 1)


def test_verify_notices_any_flipped_byte(make: Make, keep: Make) -> None:
    retained = keep(make())
    for path in [
        p for p in retained.rglob("*") if (p.is_file() and p.parent != retained) or p.suffix == ".csv"
    ]:
        content = path.read_bytes()
        path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
        assert archive.verify(retained) == [f"{path.relative_to(retained).as_posix()}: changed"]
        path.write_bytes(content)
    assert archive.verify(retained) == []


def test_verify_notices_a_file_changed_together_with_its_checksum(make: Make, keep: Make) -> None:
    retained = keep(make())
    table = retained / "zhang2007_fig5" / "table.csv"
    before = digest(table.read_bytes())
    table.write_text("better numbers")
    sums = retained / "SHA256SUMS"
    sums.write_text(sums.read_text().replace(before, digest(table.read_bytes())))
    assert archive.verify(retained) == ["SHA256SUMS: differs from manifest.json"]


@pytest.mark.parametrize(
    ("changes", "code", "where", "values"),
    [
        ({"dirty": True}, "uncommitted_changes", "", {}),
        ({"dirty": "unknown"}, "uncommitted_changes", "", {}),
        ({"commit": "unknown"}, "not_a_commit", "", {"commit": "unknown"}),
        ({"commit": "f" * 40}, "other_origin", "synthetic/full/zhang2007_fig2", {"fact": "commit"}),
        ({"date": "today"}, "not_a_date", "", {}),
        ({"figures": []}, "no_figure", "", {}),
        ({"figures": [*FIGURES, "zhang2004_fig2"]}, "not_made", "zhang2004_fig2", {}),
        ({"lock": Path("no/such.lock")}, "no_file", "such.lock", {}),
    ],
)
def test_what_cannot_be_traced_is_refused(
    tmp_path: Path,
    make: Make,
    keep: Make,
    changes: dict[str, Any],
    code: str,
    where: str,
    values: dict[str, str],
) -> None:
    source = make()
    with rejects(code, where, **values):
        keep(source, **changes)
    assert not (tmp_path / "archive").exists()


@pytest.mark.parametrize(
    "changes", [{"scale": "smoke"}, {"commit": "f" * 40}, {"dirty": True}, {"lock_sha256": "absent"}]
)
def test_results_made_otherwise_are_refused(
    tmp_path: Path, make: Make, keep: Make, changes: dict[str, Any]
) -> None:
    source = make(**changes)
    ((fact, output),) = changes.items()
    with rejects("other_origin", fact=fact, made=output):
        keep(source)
    assert not (tmp_path / "archive").exists()


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (lambda f: (f / "manifest.json").unlink(), "manifest.json is missing"),
        (lambda f: (f / "figure.svg").unlink(), "figure.svg is missing"),
        (lambda f: (f / "table.csv").write_text(""), "table.csv has 0 bytes, not"),
        (lambda f: os.truncate(f / "recording.rrd", 3), "recording.rrd has 3 bytes, not"),
        (
            lambda f: (f / "table.csv").write_bytes((f / "table.csv").read_bytes()[::-1]),
            "the sha256 of table.csv differs",
        ),
    ],
)
def test_unfinished_results_are_refused(
    tmp_path: Path, make: Make, keep: Make, spoil: Callable[[Path], Any], complaint: str
) -> None:
    source = make()
    spoil(source / "zhang2007_fig5")
    assert complaints_about(source / "zhang2007_fig5")[0].startswith(complaint)
    with rejects("unfinished", "zhang2007_fig5"):
        keep(source)
    assert not (tmp_path / "archive").exists()


def test_an_archive_with_other_content_is_not_overwritten(tmp_path: Path, make: Make, keep: Make) -> None:
    source = make()
    keep(source)
    before = snapshot(tmp_path / "archive")
    (source / "claims.csv").write_text("claim,verdict\none,reproduced\n")
    with rejects("other_content"):
        keep(source)
    assert snapshot(tmp_path / "archive") == before


def test_a_lost_or_changed_archive_is_not_mended_in_silence(tmp_path: Path, make: Make, keep: Make) -> None:
    source = make()
    retained = keep(source)
    (retained / "claims.csv").unlink()
    with rejects("other_content"):
        keep(source)
    (retained / "SHA256SUMS").unlink()
    with rejects("other_content"):
        keep(source)


@pytest.mark.parametrize("operation", ["fsync", "replace", "mkdir"])
def test_whatever_operation_fails_the_next_time_finishes(
    tmp_path: Path, make: Make, keep: Make, monkeypatch: pytest.MonkeyPatch, operation: str
) -> None:
    source = make()
    keep(source)
    expected = snapshot(tmp_path / "archive")
    shutil.rmtree(tmp_path / "archive")
    real, calls, failing = getattr(os, operation), 0, 0

    def call(*arguments: Any) -> Any:
        nonlocal calls
        if operation == "mkdir" and Path(arguments[0]).exists():
            return real(*arguments)
        calls += 1
        if calls == failing:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(*arguments)

    monkeypatch.setattr(os, operation, call)
    keep(source)
    total = calls
    assert total >= 2
    for n in range(1, total + 1):
        failing = n
        shutil.rmtree(tmp_path / "archive")
        calls = 0
        with rejects("cannot_write", errno=errno.ENOSPC):
            keep(source)
        calls = -1000
        retained = keep(source)
        assert snapshot(tmp_path / "archive") == expected
        assert archive.verify(retained) == []


def test_a_folder_that_is_no_archive_is_refused(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "nowhere"):
        with rejects("no_archive"):
            archive.verify(folder)


@pytest.mark.parametrize("line", ["junk", "0" * 64 + "  ../x", "0" * 64 + "  /etc/x", "0" * 63 + "  x"])
def test_a_list_that_cannot_be_understood_is_refused(make: Make, keep: Make, line: str) -> None:
    retained = keep(make())
    with (retained / "SHA256SUMS").open("a") as stream:
        stream.write(line + "\n")
    with rejects("not_understood", "SHA256SUMS, line 16"):
        archive.verify(retained)


def test_a_manifest_cannot_reach_outside_its_folder(tmp_path: Path, make: Make, keep: Make) -> None:
    source = make()
    figure = source / "zhang2007_fig5"
    manifest = json.loads((figure / "manifest.json").read_bytes())
    del manifest["seal"]
    manifest["files"]["../claims.csv"] = {
        "bytes": (source / "claims.csv").stat().st_size,
        "sha256": digest((source / "claims.csv").read_bytes()),
    }
    compact = json.dumps(manifest, sort_keys=True, separators=(",", ":"))
    (figure / "manifest.json").write_text(json.dumps({**manifest, "seal": digest(compact.encode())}))
    with rejects("not_plain_path", name="../claims.csv"):
        read_manifest(figure)
    with rejects("unfinished", "zhang2007_fig5"):
        keep(source)
