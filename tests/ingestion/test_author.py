"""Tests of the walkers of zhang2007's second author: their files are verified by sha256 and used as clips."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterator, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from pipeline import fetch, formats
from pipeline.cli.commands import keep
from pipeline.clips.kinds import PERFORMANCES, VARIED, WALKS
from pipeline.clips.options import Skeleton
from pipeline.core import walking
from pipeline.formats import fourier_walks
from pipeline.ingestion.author import AVERAGE, MEANS, AuthorData, find, find_here
from pipeline.ingestion.data import RecordedData, SyntheticData
from pipeline.skeleton import WALKER15
from tests import made_up_walker
from tests.formats.test_fourier_walks import author_file, matrix
from tests.rejects import rejects


@pytest.fixture(scope="module")
def contents(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Made-up contents of the author's files, by the paths in the table of sources."""
    path = tmp_path_factory.mktemp("mat") / "walkers.mat"
    savemat(path, {"F": matrix(-1.0), "M": matrix(1.0)})
    texts = (made_up_walker.javascript(), made_up_walker.as_json())
    return {
        **{name: text.encode() for name, text in zip(AVERAGE, texts, strict=True)},
        MEANS[0]: path.read_bytes(),
    }


def table(folder: Path, contents: Mapping[str, bytes], address: str = "") -> str:
    """Write a table of sources that lists the files, with an address for download; return its path."""
    rows = ["path,source,bytes,sha256,address,origin,terms"]
    for path, content in contents.items():
        sha256 = hashlib.sha256(content).hexdigest()
        rows.append(f"{path},author,{len(content)},{sha256},{address and address + path},,made up")
    (folder / "sources.csv").write_text("\n".join(rows) + "\n", "utf-8")
    return str(folder / "sources.csv")


def put(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write the given files into a folder."""
    for path, content in contents.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)


@pytest.fixture
def served(contents: dict[str, bytes]) -> Iterator[str]:
    """Address of a local web server that offers the files."""

    class Handler(BaseHTTPRequestHandler):
        def log_message(self, *_: Any) -> None:
            """Suppress the server's log messages."""

        def do_GET(self) -> None:
            body = contents.get(self.path.lstrip("/"), b"")
            self.send_response(200 if body else 404)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/"
        server.shutdown()


def test_the_files_come_from_their_addresses_with_their_sha256(
    served: str, contents: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("no_proxy", "*")
    listed = table(tmp_path, contents, served)
    with rejects("not_fetched", AVERAGE[0]):
        find(AVERAGE, table=listed, raw=str(tmp_path / "raw"))
    report = fetch.fetch(Path(listed), tmp_path / "raw", only=["author"])
    assert (report.fetched, report.failed) == ([*contents], [])
    result = find(AVERAGE, table=listed, raw=str(tmp_path / "raw"))
    assert result.path == tmp_path / "raw" / AVERAGE[0]
    assert result.terms == "made up"
    np.testing.assert_array_equal(fourier_walks.average_walker(result.path).mean, made_up_walker.walker()[0])
    monkeypatch.setitem(contents, AVERAGE[0], contents[AVERAGE[0]].replace(b"1", b"2"))
    (tmp_path / "other").mkdir()
    (reason,) = fetch.fetch(Path(listed), tmp_path / "other", only=[AVERAGE[0]]).failed
    assert "sha256 differs" in reason[1]


def test_a_mirror_has_json_and_a_file_that_is_another_is_refused(
    contents: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    listed = table(tmp_path, contents)
    put(tmp_path / "shelf", {AVERAGE[1]: contents[AVERAGE[1]]})
    for mirror in ("shelf", "shelf/author"):
        result = find(AVERAGE, table=listed, raw="nowhere", mirror=f"nowhere:{tmp_path / mirror}")
        assert result.path == tmp_path / "shelf" / AVERAGE[1]
    changed = contents[AVERAGE[1]].replace(b"made up", b"MADE UP")
    put(tmp_path / "shelf", {AVERAGE[1]: changed})
    with rejects("another_file", AVERAGE[1]):
        find(AVERAGE, table=listed, raw="nowhere", mirror=str(tmp_path / "shelf"))
    monkeypatch.delenv("MOCAP_MIRROR", raising=False)
    with rejects("not_fetched", AVERAGE[0]):
        find_here(AVERAGE, SyntheticData(name="synthetic"))


def test_a_data_set_with_a_mirror_is_asked_and_the_environment_otherwise(
    contents: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    listed = table(tmp_path, contents)
    monkeypatch.setattr("pipeline.ingestion.author.listing_table", lambda _: Path(listed))
    put(tmp_path / "shelf", contents)
    named = RecordedData(name="optical", sources=["cmu"], raw="nowhere", mirror=str(tmp_path / "shelf"))
    monkeypatch.delenv("MOCAP_MIRROR", raising=False)
    assert find_here(AVERAGE, named).path == tmp_path / "shelf" / AVERAGE[0]
    monkeypatch.chdir(tmp_path)
    with rejects("not_fetched", AVERAGE[0]):
        find_here(AVERAGE, SyntheticData(name="synthetic"))
    monkeypatch.setenv("MOCAP_MIRROR", str(tmp_path / "shelf"))
    assert find_here(AVERAGE, SyntheticData(name="synthetic")).path == tmp_path / "shelf" / AVERAGE[0]


@pytest.fixture
def data(contents: dict[str, bytes], tmp_path: Path) -> AuthorData:
    put(tmp_path / "raw", contents)
    return AuthorData(name="author", table=table(tmp_path, contents), raw=str(tmp_path / "raw"))


def test_walkers_as_clips(data: AuthorData, contents: dict[str, bytes]) -> None:
    request = data.request(VARIED, Skeleton(), 1, 1)
    clips = request.make()
    axes = ("gender", "weight", "nervous", "happy")
    along = [f"{axis}{value:+d}" for axis in axes for value in (3, -3)]
    assert clips.clip.tolist() == ["average", "mean_woman", "mean_man", *along]
    assert set(clips.person) == {"average", "mean_woman", "mean_man"}
    assert clips.inputs["weight+3"] == hashlib.sha256(contents[AVERAGE[0]]).hexdigest()
    assert clips.inputs["mean_man"] == hashlib.sha256(contents[MEANS[0]]).hexdigest()
    mean, values = made_up_walker.walker()
    heavy = clips.motion(clips.clip.tolist().index("weight+3"))
    head = WALKER15.index("head")
    blocks = mean + 3.0 * values["weight"]
    assert heavy[:, head, 2].mean() == pytest.approx(blocks[0, 30 + head], abs=2.0)
    ankles = [WALKER15.index(f"{side}_ankle") for side in ("left", "right")]
    for number in range(len(clips)):
        motion = clips.motion(number)
        assert motion[:, ankles[0], 0].mean() < motion[:, ankles[1], 0].mean(), (
            "the left ankle is on the left"
        )
        lifted = motion[:, ankles[0], 2].argmax()
        assert np.gradient(motion[:, ankles[0], 1])[lifted] > 0, "walks along +y"
    data.axis_value, data.limit = 1.5, 5
    fewer = data.request(VARIED, Skeleton(), 1, 1)
    assert fewer.make().clip.tolist()[-2:] == ["gender+1.5", "gender-1.5"]
    assert fewer.options != request.options
    assert walking.stature(fewer.make().motion(0)) > 1000


@pytest.mark.parametrize("corpus", [WALKS, PERFORMANCES])
def test_figures_of_many_people_are_left_out_and_say_so(data: AuthorData, corpus: Any) -> None:
    for ask in (lambda: data.require(corpus), lambda: data.request(corpus, Skeleton(), 1, 1)):
        with rejects("no_clips_of_this_kind", "data", data="author", kind=corpus.name) as refused:
            ask()
        assert "many people" in str(refused.value)


def test_the_authors_files_are_those_that_are_listed() -> None:
    """The author's files in the folder of public recordings have the listed sizes and sha256."""
    for name in ("bmwalker.json", "walkers.mat"):
        path = author_file(name)
        listed = AVERAGE[1] if name.endswith("json") else MEANS[0]
        assert find((listed,), mirror=str(path.parent)).path.samefile(path)
        assert formats.read(path).valid.all()


def test_light_archives_have_no_figure_of_the_authors_walkers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    retained: list[list[str]] = []

    def keep_light(folder: Path, target: Path, figures: list[str], **_: Any) -> dict[str, int]:
        retained.append(list(figures))
        return {}

    monkeypatch.setattr("pipeline.report.light.keep_light", keep_light)
    assert keep(["data=synthetic", "light=1", f"results={tmp_path}"]) == 0
    assert "zhang2007_structure" in retained[0]
    assert "zhang2007_author" not in retained[0]
    with rejects("no_copies", "author"):
        keep(["data=author", "light=1", f"results={tmp_path}"])
    with rejects("no_copies", "zhang2007_author"):
        keep(["data=synthetic", "light=1", "only=zhang2007_author", f"results={tmp_path}"])
    assert len(retained) == 1
