"""Tests of data sets: the requested clips of each kind, missing recordings, and the inputs that clips depend on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pipeline.clips.kinds import PERFORMANCES, VARIED, WALKS, Corpus, Request
from pipeline.clips.options import Skeleton, SyntheticClips, SyntheticPerformances
from pipeline.ingestion.data import FolderData, NamedClips, RecordedData, RecordedPerformances, SyntheticData
from pipeline.storage.sealed_folders import canonical
from tests.own_files import write_table
from tests.rejects import rejects

CORPORA = (WALKS, PERFORMANCES, VARIED)
HERE = ("second", "first")


@pytest.fixture
def listed(tmp_path: Path) -> RecordedData:
    """Data set with four listed recordings, two of which exist on this machine."""
    names = [f"{trial}.trc" for trial in ("gone_b", "second", "gone_a", "first")]
    (tmp_path / "raw").mkdir()
    for trial in HERE:
        (tmp_path / "raw" / f"{trial}.trc").write_text(f"{trial}.trc")
    return RecordedData(
        name="recorded",
        sources=["here"],
        table=str(write_table(tmp_path / "sources.csv", {name: name.encode() for name in names})),
        raw=str(tmp_path / "raw"),
        skeletons=["walker15"],
        performances=RecordedPerformances(sources=["here"], action="walk", limit=1),
    )


def request(data: Any, corpus: Corpus, *, seed: int = 1, workers: int = 1) -> Request:
    output: Request = data.request(corpus, Skeleton(), seed, workers)
    return output


def names(made: Request) -> list[str]:
    """Return the names of the requested clips."""
    return [clip["name"].removesuffix(".trc") for clip in made.options["clips"]]


def test_a_limit_counts_the_recordings_that_are_here_and_the_absent_ones_come_last(
    listed: RecordedData,
) -> None:
    assert names(request(listed, WALKS)) == ["first", "second", "gone_b", "gone_a"]
    assert names(request(listed, PERFORMANCES)) == ["first", "gone_b", "gone_a"]
    listed.walkers = 1
    assert names(request(listed, WALKS)) == ["first", "gone_b", "gone_a"]


def test_own_folders_are_further_sources_of_walks(listed: RecordedData, tmp_path: Path) -> None:
    for folder in ("Lab A", "Lab B"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "anna_01.trc").write_text(folder)
    listed.folders = [str(tmp_path / "Lab A"), str(tmp_path / "Lab B")]
    clips = request(listed, WALKS).options["clips"]
    reference = [clip for clip in clips if clip["source"].startswith("Lab")]
    assert [(clip["source"], clip["person"], clip["name"]) for clip in reference] == [
        ("Lab A", "Lab A/anna", "Lab A/anna_01.trc"),
        ("Lab B", "Lab B/anna", "Lab B/anna_01.trc"),
    ]
    assert len(clips) == 4 + len(reference)
    assert len(request(listed, PERFORMANCES).options["clips"]) == 3
    listed.folders = [str(tmp_path / "nowhere")]
    with rejects("no_folder", "data.path"):
        request(listed, WALKS)


def test_a_star_names_every_source(listed: RecordedData) -> None:
    listed.sources = ["*"]
    assert names(request(listed, WALKS)) == ["first", "second", "gone_b", "gone_a"]


@pytest.mark.parametrize("corpus", [WALKS, PERFORMANCES, VARIED])
def test_a_data_set_without_clips_of_a_kind_is_refused_by_name(corpus: Corpus) -> None:
    empty = RecordedData(name="hdm05", sources=[])
    for ask in (lambda: empty.require(corpus), lambda: request(empty, corpus)):
        with rejects("no_clips_of_this_kind", "data", data="hdm05", kind=corpus.name):
            ask()
    SyntheticData(name="synthetic").require(corpus)
    FolderData(name="folder").require(corpus)
    named = RecordedData(
        name="recorded",
        sources=["here"],
        performances=RecordedPerformances(sources=["here"]),
        clips=NamedClips(sources=["here"]),
    )
    named.require(corpus)


@pytest.mark.parametrize(
    ("changed", "corpus"),
    [
        (SyntheticData(name="synthetic", marker_noise_mm=1.0), WALKS),
        (SyntheticData(name="synthetic", performances=SyntheticPerformances(subjects=3)), PERFORMANCES),
        (SyntheticData(name="synthetic", clips=SyntheticClips(bandwidth=5)), VARIED),
    ],
)
def test_clips_of_a_kind_depend_on_the_options_of_that_kind_alone(
    changed: SyntheticData, corpus: Corpus
) -> None:
    plain = SyntheticData(name="synthetic")
    depends = {
        other: canonical(request(changed, other).options) != canonical(request(plain, other).options)
        for other in CORPORA
    }
    assert depends == {other: other is corpus for other in CORPORA}


@pytest.mark.parametrize("corpus", CORPORA)
def test_another_seed_is_another_request_and_another_number_of_threads_is_not(corpus: Corpus) -> None:
    plain = SyntheticData(name="synthetic")
    options = [request(plain, corpus, seed=s, workers=w).options for s, w in ((1, 1), (1, 3), (2, 1))]
    first, threads, seed = map(canonical, options)
    assert first == threads
    assert first != seed


def test_where_a_recording_lies_is_no_part_of_the_request(listed: RecordedData, tmp_path: Path) -> None:
    before = canonical(request(listed, WALKS).options)
    assert str(tmp_path) not in str(before)
    (tmp_path / "raw").rename(tmp_path / "elsewhere")
    listed.raw = str(tmp_path / "elsewhere")
    assert canonical(request(listed, WALKS).options) == before
    (tmp_path / "elsewhere" / "first.trc").write_text("other.trc")
    assert canonical(request(listed, WALKS).options) != before


@pytest.mark.parametrize(
    ("options", "where", "value"),
    [
        ({"walkers": -1}, "data.walkers", -1),
        ({"population": 0}, "data.population", 0),
        ({"clips": SyntheticClips(clips=0)}, "data.clips.clips", 0),
    ],
)
def test_a_data_set_of_nobody_is_refused(options: dict[str, Any], where: str, value: int) -> None:
    SyntheticData(name="synthetic").validate()
    with rejects("out_of_range", where, value=value):
        SyntheticData(name="synthetic", **options).validate()


def test_files_of_one_name_in_several_folders_are_asked_about(tmp_path: Path) -> None:
    for folder in ("day1", "day2"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "anna_1.trc").write_text(folder)
    data = FolderData(name="own", path=str(tmp_path))
    with rejects("unclear_person", "data.person", clips=["day1/anna_1.trc", "day2/anna_1.trc"]):
        request(data, WALKS)
    for person, people in (("^(.+?)/", ["day1", "day2"]), ("([^/_.]+)[^/]*$", ["anna", "anna"])):
        data.person = person
        assert [clip["person"] for clip in request(data, WALKS).options["clips"]] == people
