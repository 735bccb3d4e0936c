"""Tests of a data set's recordings: they are found, read once, and rejected if they are not the listed files."""

from __future__ import annotations

import hashlib
import os
import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.ingestion.corpus import (
    Clip,
    Listing,
    folder_clips,
    listed_clips,
)
from pipeline.ingestion.data import first_people, in_turn
from pipeline.ingestion.joints import read_clip
from tests.own_files import OWN_JOINTS, write_table
from tests.rejects import rejects

FIXTURES = Path(__file__).resolve().parent.parent / "fixtures"
FILES = {
    "cmu/02/02_01.amc": "amc_by_hand.amc",
    "cmu/02/02.asf": "asf_by_hand.asf",
    "zoo/a.c3d": "c3d_intel_reals.c3d",
}
"""Fixture from which each listed file is copied."""


@pytest.fixture
def listing(tmp_path: Path) -> Listing:
    """Table that lists `FILES` before these files exist."""
    contents = {name: (FIXTURES / fixture).read_bytes() for name, fixture in FILES.items()}
    table = write_table(tmp_path / "sources.csv", contents)
    return Listing(table, tmp_path / "raw", [tmp_path / "mirror"], {"walker15": OWN_JOINTS})


def lay_out(folder: Path) -> None:
    """Copy the listed files to their paths below a folder."""
    for name, fixture in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(FIXTURES / fixture, folder / name)


def spoil(path: Path) -> str:
    """Change one byte of a file without changing its size, and return its new sha256."""
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    changed = path.stat().st_mtime_ns + 1_000_000_000
    path.write_bytes(content)
    os.utime(path, ns=(changed, changed))
    return hashlib.sha256(content).hexdigest()


def present(listing: Listing) -> dict[str, Clip]:
    return {clip.name: clip for clip in listed_clips(listing, ["here"], "walk")[0]}


def test_recordings_are_hashed_once_and_the_absent_ones_are_told_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = [f"{trial}.trc" for trial in ("gone_b", "second", "gone_a", "first")]
    table = write_table(tmp_path / "sources.csv", {name: name.encode() for name in names})
    raw = tmp_path / "raw"
    raw.mkdir()
    for name in ("second.trc", "first.trc"):
        (raw / name).write_text(name)
    read: list[str] = []
    really_read = Path.read_bytes

    def noted(path: Path) -> bytes:
        if path.suffix == ".trc":
            read.append(path.name)
        return really_read(path)

    monkeypatch.setattr(Path, "read_bytes", noted)
    for _ in range(3):
        start, gone = listed_clips(Listing(table, raw, [], {"walker15": OWN_JOINTS}), ["here"], "walk")
        assert [clip.name for clip in start] == ["first.trc", "second.trc"]
        assert [clip.name for clip in gone] == ["gone_b.trc", "gone_a.trc"]
        assert {clip.mismatch for clip in start} == {""}
    assert sorted(read) == ["first.trc", "second.trc"]


@pytest.mark.parametrize("place", ["raw", "mirror"])
@pytest.mark.parametrize(
    ("file", "trial"),
    [
        ("cmu/02/02_01.amc", "cmu/02/02_01.amc"),
        ("cmu/02/02.asf", "cmu/02/02_01.amc"),
        ("zoo/a.c3d", "zoo/a.c3d"),
    ],
)
def test_a_changed_file_of_the_same_size_is_refused_by_name(
    tmp_path: Path, listing: Listing, place: str, file: str, trial: str
) -> None:
    lay_out(tmp_path / place)
    before = present(listing)
    assert {clip.mismatch for clip in before.values()} == {""}
    received = spoil(tmp_path / place / file)
    after = present(listing)
    for name, clip in after.items():
        assert bool(clip.mismatch) == (name == trial)
        assert (clip.identity == before[name].identity) == (name != trial)
    with rejects("another_file") as caught:
        read_clip(after[trial])
    assert str(caught.value).startswith(f"{file}: ")
    assert f"{received[:12]}…" in str(caught.value)


def test_a_changed_file_is_refused_though_a_mirror_has_the_right_one(
    tmp_path: Path, listing: Listing
) -> None:
    for position in ("raw", "mirror"):
        lay_out(tmp_path / position)
    spoil(tmp_path / "raw/zoo/a.c3d")
    assert "zoo/a.c3d" in present(listing)["zoo/a.c3d"].mismatch


@pytest.mark.parametrize("place", ["cmu/02/other.asf", "cmu/other.asf", "../other.asf"])
def test_a_skeleton_that_is_not_listed_is_refused(tmp_path: Path, place: str) -> None:
    name = "02_01.amc" if place.startswith("..") else "cmu/02/02_01.amc"
    table = write_table(tmp_path / "sources.csv", {name: (FIXTURES / "amc_by_hand.amc").read_bytes()})
    for file, fixture in ((name, "amc_by_hand.amc"), (place, "asf_by_hand.asf")):
        (tmp_path / "raw" / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(FIXTURES / fixture, tmp_path / "raw" / file)
    listing = Listing(table, tmp_path / "raw", [], {"walker15": OWN_JOINTS})
    with rejects("another_file") as caught:
        read_clip(present(listing)[name])
    assert str(caught.value).startswith(f"{place}: ")


def test_a_file_that_changes_between_listing_and_reading_is_refused(tmp_path: Path, listing: Listing) -> None:
    lay_out(tmp_path / "raw")
    listed = present(listing)["zoo/a.c3d"]
    reference = folder_clips(
        str(tmp_path / "raw"), "zoo/*", "", skeleton=OWN_JOINTS, frame_rate_hz=0.0, units=""
    )[0]
    spoil(tmp_path / "raw/zoo/a.c3d")
    for clip in (listed, reference):
        with rejects("file_changed", clip.name):
            read_clip(clip)


def test_a_table_without_digests_is_refused(tmp_path: Path, listing: Listing) -> None:
    listing.table.write_text("path,source,bytes\nzoo/a.c3d,here,1\n", encoding="utf-8")
    with rejects("no_column", column="sha256"):
        present(listing)


# --- which of many ----------------------------------------------------------------------------------------

PEOPLE = st.lists(st.sampled_from("abc"), max_size=12)


def clips_of(people: list[str]) -> list[Clip]:
    """Return one numbered clip for each person's name in the list."""
    return [Clip(str(n), who, "folder", "", None, "", OWN_JOINTS, 0.0, "") for n, who in enumerate(people)]


@given(PEOPLE, st.integers(0, 14))
def test_people_take_turns_until_the_limit(people: list[str], limit: int) -> None:
    clips = clips_of(people)
    chosen = in_turn(clips, limit)
    assert [c.name for c in chosen] == [c.name for c in clips if c in chosen], "in the order given"
    assert len(chosen) == (min(limit, len(clips)) if limit else len(clips))
    counts = [sum(c.person == who for c in chosen) for who in set(people)]
    have = [people.count(who) for who in set(people)]
    for mine, all_mine in zip(counts, have, strict=True):
        assert mine == all_mine or mine >= max(counts) - 1, "no person waits while another has two more"


@given(PEOPLE, st.integers(0, 4))
def test_a_limit_of_people_keeps_all_clips_of_the_first(people: list[str], limit: int) -> None:
    chosen = first_people(clips_of(people), limit)
    first = list(dict.fromkeys(people))[: limit or None]
    assert [int(c.name) for c in chosen] == [n for n, who in enumerate(people) if who in first]


def test_a_file_in_whose_name_nobody_is_found_is_no_person_of_its_own(tmp_path: Path) -> None:
    for name in ("anna_1.trc", "trial2.trc"):
        (tmp_path / name).write_bytes(b"x")
    clips = folder_clips(str(tmp_path), "*", "^([^_]+)_", skeleton=None, frame_rate_hz=0.0, units="")
    assert [clip.mismatch.code for clip in clips] == ["", "unclear_person"]


def test_a_folder_may_be_a_person(tmp_path: Path) -> None:
    for who in ("sub-01", "sub-02"):
        (tmp_path / who / "ses-01").mkdir(parents=True)
        (tmp_path / who / "ses-01" / "walk_1.trc").write_bytes(b"x")
    assert [clip.person for clip in folder_clips(str(tmp_path), "**/*", "^(.+?)/")] == ["sub-01", "sub-02"]
    assert {clip.person for clip in folder_clips(str(tmp_path), "**/*", "^([^_.]+)")} == {"walk"}


@pytest.mark.parametrize("name", [b"b\xff.trc", b"b\nc.trc"])
def test_a_name_that_is_no_text_refuses_that_clip_only(tmp_path: Path, name: bytes) -> None:
    for each in (b"anna.trc", name):
        (tmp_path / os.fsdecode(each)).write_bytes(b"x")
    clips = folder_clips(str(tmp_path), "*", "^([^_.]+)", skeleton=None, frame_rate_hz=0.0, units="")
    good, bad = sorted(clips, key=lambda clip: bool(clip.mismatch))
    assert (good.name, good.mismatch) == ("anna.trc", "")
    assert bad.name.isprintable()
    bad.name.encode()
    with rejects("unprintable_name"):
        read_clip(bad)
