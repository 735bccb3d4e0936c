"""Tests of downloads from a mirror or a local server: files are checked, and written only inside the target folder."""

import csv
import errno
import hashlib
import os
import socket
import threading
import urllib.request
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.fetch import NEEDED_COLUMNS, FetchReport, Progress, fetch, open_http, read_sources, resolve
from pipeline.fetch import transfer as fetch_transfer
from tests.processes import WAIT_S
from tests.rejects import rejects

CONTENT = np.random.default_rng(0).bytes(200_000)
OTHER = b"Joint;x;y;z\n" * 100


class Server(ThreadingHTTPServer):
    """Web server for `files` that records the requests, and misbehaves for the paths in `manners`."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.files: dict[str, bytes] = {}
        self.manners: dict[str, str] = {}
        self.requests: list[str] = []

    def address(self, path: str) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}/{path}"


class Handler(BaseHTTPRequestHandler):
    server: Server

    def log_message(self, *_: Any) -> None:
        """Suppress the server's log messages."""

    def do_GET(self) -> None:
        path = self.path.lstrip("/")
        self.server.requests.append(path)
        manner = self.server.manners.get(path, "")
        if manner == "hang up":
            self.connection.shutdown(socket.SHUT_RDWR)
            return
        if manner == "ftp":
            self.send_response(302)
            self.send_header("Location", "ftp://127.0.0.1/x")
            self.end_headers()
            return
        if path not in self.server.files:
            self.send_error(404)
            return
        body = self.server.files[path]
        self.send_response(200)
        if not manner.endswith("no length"):
            self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if manner == "cut once":
            del self.server.manners[path]
        self.wfile.write(body[:70_000] if manner.startswith("cut") else body)


@pytest.fixture
def server() -> Iterator[Server]:
    with Server() as running:
        thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        try:
            yield running
        finally:
            running.shutdown()
            thread.join(timeout=WAIT_S)


@pytest.fixture(autouse=True)
def _no_proxy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("no_proxy", "*")


def direct(request: urllib.request.Request, *, timeout: float) -> Any:
    """Open an address with the project's own function and a longer time limit."""
    return open_http(request, timeout=max(timeout, WAIT_S))


def no_network(*_: Any, **__: Any) -> Any:
    pytest.fail("the network was asked")


class Case:
    """Table of files to fetch, with a mirror folder and a target folder."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.raw, self.mirror = folder, folder / "raw", folder / "mirror"
        self.rows: list[dict[str, str]] = []

    def add(self, path: str, content: bytes, *, address: str = "", origin: str = "", **more: str) -> Path:
        row = {
            "path": path,
            "source": path.split("/")[0],
            "bytes": str(len(content)),
            "sha256": hashlib.sha256(content).hexdigest(),
            "address": address,
            "origin": origin,
        }
        self.rows.append({**row, **more})
        return self.raw / path

    def mirrored(self, path: str, content: bytes) -> None:
        (self.mirror / path).parent.mkdir(parents=True, exist_ok=True)
        (self.mirror / path).write_bytes(content)

    def table(self) -> Path:
        path = self.folder / "sources.csv"
        with path.open("w", newline="") as stream:
            writer = csv.DictWriter(stream, self.rows[0])
            writer.writeheader()
            writer.writerows(self.rows)
        return path

    def fetch(self, opener: Callable[..., Any] = direct, **more: Any) -> FetchReport:
        return fetch(self.table(), self.raw, opener=opener, **more)

    def parts(self) -> list[str]:
        return [p.name for p in self.raw.rglob("*.part")]


@pytest.fixture
def case(tmp_path: Path) -> Case:
    return Case(tmp_path)


def test_a_file_is_fetched_once_and_then_present(case: Case, server: Server) -> None:
    server.files["a.c3d"] = CONTENT
    target = case.add("zoo/a.c3d", CONTENT, address=server.address("a.c3d"))
    assert case.fetch() == FetchReport(fetched=["zoo/a.c3d"])
    assert target.read_bytes() == CONTENT
    assert case.fetch(no_network) == FetchReport(present=["zoo/a.c3d"])
    assert case.parts() == []
    assert server.requests == ["a.c3d"]


def test_a_file_that_is_another_is_named_and_stays(case: Case, server: Server) -> None:
    server.files["a"] = CONTENT
    target = case.add("zoo/a", CONTENT, address=server.address("a"))
    target.parent.mkdir(parents=True)
    other = CONTENT[:-1] + bytes([CONTENT[-1] ^ 1])  # same size, and were it of the same time
    target.write_bytes(other)
    assert case.fetch().failed == [("zoo/a", "a different file has the same path: move it away")]
    assert target.read_bytes() == other
    target.unlink()
    assert case.fetch().fetched == ["zoo/a"]


def test_an_interrupted_run_leaves_nothing_that_is_not_whole(case: Case, server: Server) -> None:
    target = case.add("zoo/a", CONTENT, address=server.address("a"))
    server.files["a"] = CONTENT

    def interrupted(request: urllib.request.Request, *, timeout: float) -> Any:
        answer = direct(request, timeout=timeout)
        answer.read(1000)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        case.fetch(interrupted)
    assert not target.exists()
    (target.parent / "a.part").write_bytes(CONTENT[:1000])  # of a run that was killed while it wrote
    assert case.fetch().fetched == ["zoo/a"]
    assert target.read_bytes() == CONTENT
    assert case.parts() == []


@pytest.mark.parametrize("manner", ["cut once", "no length"])
def test_an_answer_cut_short_is_asked_for_again(case: Case, server: Server, manner: str) -> None:
    server.files["a"], server.manners["a"] = CONTENT, manner
    target = case.add("zoo/a", CONTENT, address=server.address("a"))
    assert case.fetch().fetched == ["zoo/a"]
    assert target.read_bytes() == CONTENT
    assert server.requests == ["a"] * (2 if manner == "cut once" else 1)


@pytest.mark.parametrize("manner", ["cut", "cut, no length"])
def test_answers_always_cut_short_fail_and_do_not_hold_up_the_others(
    case: Case, server: Server, manner: str
) -> None:
    for name in "abc":
        server.files[name] = CONTENT
        case.add(f"zoo/{name}", CONTENT, address=server.address(name))
    server.manners["a"] = manner
    report = case.fetch()
    ((path, why),) = report.failed
    assert path == "zoo/a"
    assert "no complete response" in why
    assert "70000" in why
    assert report.fetched == ["zoo/b", "zoo/c"]
    assert server.requests == ["a", "a", "b", "c"]


def test_a_wrong_file_is_removed_and_the_origin_asked(case: Case, server: Server) -> None:
    server.files |= {"a": CONTENT[::-1], "origin/a": CONTENT}
    case.add("zoo/a", CONTENT, address=server.address("a"), origin=server.address("origin/a"))
    assert case.fetch().fetched == ["zoo/a"]
    assert server.requests == ["a", "origin/a"]


def test_every_failure_is_listed_with_its_reasons(case: Case, server: Server) -> None:
    server.files |= {
        "wrong": CONTENT[::-1],
        "longer": CONTENT + b"1",
        "shorter": CONTENT[:-1],
        "empty": b"",
        "good": OTHER,
    }
    server.manners["moved"] = "ftp"
    for name in ("wrong", "longer", "shorter", "missing", "empty", "moved"):
        case.add(f"zoo/{name}", CONTENT, address=server.address(name))
    case.add("zoo/local", CONTENT, address="file:///etc/hostname")
    case.add("zoo/bare", CONTENT, address="somewhere", origin="http://[")
    case.add("zoo/nowhere", CONTENT)
    case.add("zoo/good", OTHER, address=server.address("good"))
    report = case.fetch()
    why = dict(report.failed)
    assert report.fetched == ["zoo/good"]
    assert report.without_address == ["zoo/nowhere"]
    assert why["zoo/wrong"] == f"{server.address('wrong')}: sha256 differs"
    assert why["zoo/longer"].endswith("longer than 200000 bytes")
    assert why["zoo/shorter"].endswith("no complete response (199999 of 200000 bytes)")
    assert why["zoo/missing"].endswith("HTTP 404 Not Found")
    assert "0 of 200000 bytes" in why["zoo/empty"]
    assert "ftp" in why["zoo/moved"]
    assert "errno" not in why["zoo/moved"].lower()  # not even tried
    assert why["zoo/local"] == "file:///etc/hostname: not an http(s) address"
    assert why["zoo/bare"] == "somewhere: not an http(s) address; http://[: not an address"
    assert len(why) == 8
    text = str(report)
    assert text.splitlines()[0] == "1 fetched, 0 present, 8 failed"
    assert "failed: zoo/missing: " in text
    assert text.splitlines()[-1] == "no public address, available only from a mirror: zoo/nowhere"
    assert case.parts() == []


def test_a_redirection_to_a_file_is_not_followed(case: Case) -> None:
    class Answer:
        def __enter__(self) -> "Answer":
            return self

        def __exit__(self, *_: object) -> None: ...

        def geturl(self) -> str:
            return "file:///etc/hostname"

    case.add("zoo/a", CONTENT, address="http://127.0.0.1:9/a")
    assert case.fetch(lambda *_, **__: Answer()).failed[0][1].endswith("redirected away from http(s)")


def test_a_host_that_never_answers_is_left_alone(case: Case, server: Server) -> None:
    requested = []

    def opener(request: urllib.request.Request, *, timeout: float) -> Any:
        requested.append(request.full_url)
        if "silent" in request.full_url:
            raise TimeoutError("timed out")
        return direct(request, timeout=timeout)

    for n in range(5):
        server.files[str(n)] = OTHER
        case.add(f"zoo/{n}", OTHER, address=f"http://silent.invalid/{n}", origin=server.address(str(n)))
    assert len(case.fetch(opener).fetched) == 5
    assert len([url for url in requested if "silent" in url]) == 2


def test_a_refused_connection_is_a_reason(case: Case) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    for n in range(3):
        case.add(f"zoo/{n}", CONTENT, address=f"http://127.0.0.1:{port}/a")
    reasons = [why for _, why in case.fetch().failed]
    assert "refused" in reasons[0]
    assert reasons[2].endswith("skipped, because this host did not respond before")


def test_a_server_that_hangs_up_is_a_reason(case: Case, server: Server) -> None:
    server.manners["a"] = "hang up"
    case.add("zoo/a", CONTENT, address=server.address("a"))
    assert "no complete response" in case.fetch().failed[0][1]


def test_the_mirror_is_asked_first(case: Case) -> None:
    case.mirrored("zoo/a", CONTENT)
    target = case.add("zoo/a", CONTENT, address="http://127.0.0.1:9/a")
    assert case.fetch(no_network, mirror=[case.mirror]).fetched == ["zoo/a"]
    assert target.read_bytes() == CONTENT
    assert (case.mirror / "zoo" / "a").read_bytes() == CONTENT
    assert target.stat().st_ino != (case.mirror / "zoo" / "a").stat().st_ino
    assert case.parts() == []


def test_a_wrong_file_in_the_mirror_is_not_taken(case: Case, server: Server) -> None:
    server.files["a"] = CONTENT
    case.mirrored("zoo/a", CONTENT[::-1])
    case.add("zoo/a", CONTENT, address=server.address("a"))
    assert case.fetch(mirror=[case.mirror]).fetched == ["zoo/a"]
    assert server.requests == ["a"]
    case.add("zoo/b", CONTENT[::-1], address="")
    case.mirrored("zoo/b", CONTENT)
    assert case.fetch(mirror=[case.mirror]).failed == [("zoo/b", "mirror: sha256 differs")]


def test_what_only_a_mirror_can_have(case: Case) -> None:
    case.add("zoo/a", CONTENT)
    case.mirror.mkdir()
    for mirror in ([], [case.mirror]):
        assert case.fetch(no_network, mirror=mirror).without_address == ["zoo/a"]
    case.mirrored("zoo/a", CONTENT)
    assert case.fetch(no_network, mirror=[case.mirror]).fetched == ["zoo/a"]


def test_a_mirror_that_is_not_there_is_refused(case: Case) -> None:
    case.add("zoo/a", CONTENT)
    with rejects("no_folder", "mirror"):
        case.fetch(no_network, mirror=[case.mirror])


@pytest.mark.parametrize(
    ("only", "expected"),
    [
        (None, ["cmu/02/a", "cmu/16/b", "zoo/a"]),
        (["zoo"], ["zoo/a"]),
        (["cmu/16/*", "zoo/a"], ["cmu/16/b", "zoo/a"]),
        ([], []),
    ],
)
def test_only_what_is_wanted(case: Case, only: list[str] | None, expected: list[str]) -> None:
    for path in ("cmu/02/a", "cmu/16/b", "zoo/a"):
        case.add(path, OTHER)
        case.mirrored(path, OTHER)
    assert case.fetch(no_network, mirror=[case.mirror], only=only).fetched == expected


def test_a_wish_for_nothing_is_refused(case: Case) -> None:
    case.add("zoo/a", OTHER)
    with rejects("nothing_listed", wanted="hdm05", sources=["zoo"]):
        case.fetch(no_network, only=["hdm05"])


@pytest.mark.parametrize(
    "path",
    [
        "../a",
        "zoo/../../a",
        "/etc/a",
        "",
        ".",
        "zoo\\..\\a",
        "C:/a",
        "zoo//a",
        "./zoo/a",
        "zoo/a/",
        "zoo/a.part",
    ],
)
def test_a_path_cannot_leave_the_folder(case: Case, path: str) -> None:
    case.add("zoo/first", OTHER)
    case.add(path, OTHER, address="http://127.0.0.1:9/a")
    with rejects("path_outside"):
        case.fetch(no_network)
    assert not case.raw.exists()
    with rejects("path_outside"):
        resolve(case.rows[1], raw=case.raw)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"sha256": "abc"}, "not_sha256"),
        ({"sha256": ""}, "not_sha256"),
        ({"bytes": "many"}, "not_size"),
        ({"bytes": "0"}, "not_size"),
        ({"path": "zoo/first"}, "path_twice"),
    ],
)
def test_a_table_that_says_nonsense_is_refused(case: Case, changes: dict[str, str], code: str) -> None:
    case.add("zoo/first", OTHER)
    case.add("zoo/a", OTHER)
    case.rows[1] |= changes
    with rejects(code):
        case.fetch(no_network)


@pytest.mark.parametrize(
    ("content", "code", "values"),
    [
        (b"", "no_column", {"column": "path"}),
        (b"path,source\n", "no_column", {"column": "bytes"}),
        (b"path,source,bytes,sha256,address,origin\nzoo/a,zoo\n", "wrong_count", {}),
        (b"path,source,bytes,sha256,address,origin\na,b,c,d,e,f,g\n", "wrong_count", {}),
        (b"\xff\xfe", "unreadable", {}),
    ],
)
def test_a_broken_table_is_refused(
    tmp_path: Path, content: bytes, code: str, values: dict[str, object]
) -> None:
    (tmp_path / "sources.csv").write_bytes(content)
    with rejects(code, **values):
        read_sources(tmp_path / "sources.csv")


def test_a_missing_table_is_refused(tmp_path: Path) -> None:
    with rejects("unreadable"):
        fetch(tmp_path / "sources.csv", tmp_path / "raw")


def test_a_full_disk_stops_the_run_in_one_sentence(
    case: Case, server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    server.files["a"] = CONTENT
    target = case.add("zoo/a", CONTENT, address=server.address("a"))

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with rejects("cannot_write", error=os.strerror(errno.ENOSPC)):
            case.fetch()
    assert not target.exists()
    assert case.fetch().fetched == ["zoo/a"]
    (case.folder / "file").write_text("in the way")
    case.raw = case.folder / "file"
    with rejects("cannot_write"):
        case.fetch(no_network)


def test_a_folder_in_the_place_of_a_file_is_a_reason(case: Case) -> None:
    case.add("zoo/a", CONTENT).mkdir(parents=True)
    assert case.fetch(no_network).failed == [("zoo/a", "a folder has the same path: move it away")]


def test_progress_counts_files_and_bytes(case: Case, server: Server) -> None:
    server.files |= {"a": CONTENT, "b": OTHER}
    case.add("zoo/a", CONTENT, address=server.address("a"))
    case.add("zoo/b", OTHER, address=server.address("b"))
    case.add("zoo/c", OTHER)
    described: list[Progress] = []
    case.fetch(progress=described.append)
    total = len(CONTENT) + 2 * len(OTHER)
    assert described == [
        Progress("zoo/a", 1, 3, len(CONTENT), total),
        Progress("zoo/b", 2, 3, len(CONTENT) + len(OTHER), total),
        Progress("zoo/c", 3, 3, total, total),
    ]


def test_a_recording_is_found_here_then_in_the_mirror(case: Case) -> None:
    target = case.add("zoo/a", CONTENT)
    (row,) = case.rows
    assert resolve(row, raw=case.raw, mirror=[case.mirror]) is None
    case.mirrored("zoo/a", CONTENT)
    assert resolve(row, raw=case.raw, mirror=[case.mirror]) == case.mirror / "zoo" / "a"
    assert resolve(row, raw=case.raw) is None
    target.parent.mkdir(parents=True)
    for wrong in (CONTENT[:10], CONTENT + b"more"):
        target.write_bytes(wrong)
        assert resolve(row, raw=case.raw, mirror=[case.mirror]) == case.mirror / "zoo" / "a"
    target.write_bytes(CONTENT)
    assert resolve(row, raw=case.raw, mirror=[case.mirror]) == target


def test_the_projects_own_table_is_sound() -> None:
    sources = Path(__file__).parents[2] / "data" / "sources.csv"
    rows = read_sources(sources)
    assert [row["path"] for row in rows] == sorted(row["path"] for row in rows)
    assert {row["source"] for row in rows} == {
        *("author", "cmu", "biomechzoo", "hdm05", "kinectgait"),
        *("qualisys", "c3drot", "llui"),
    }
    assert rows[0].keys() >= {
        *NEEDED_COLUMNS,
        "subject",
        "trial",
        "action",
        "frame_rate_hz",
        "skeleton",
        "terms",
    }
    for row in rows:
        assert row["terms"], row["path"]
        for address in filter(None, (row["address"], row["origin"])):
            assert address.startswith(("http://", "https://")), row["path"]
    without = ["author/bmwalker.json", "kinectgait/person-data.csv"]
    assert [row["path"] for row in rows if not row["address"]] == without


@pytest.mark.skipif(not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR")
def test_the_mirror_holds_every_recording(tmp_path: Path) -> None:
    sources, mirror = Path(__file__).parents[2] / "data" / "sources.csv", Path(os.environ["MOCAP_MIRROR"])
    listed = [row["path"] for row in read_sources(sources)]
    start = [path for path in listed if (mirror / Path(path).parts[0]).is_dir()]
    report = fetch(sources, tmp_path, mirror=[mirror], only=start, opener=no_network)
    assert (report.failed, report.without_address) == ([], [])
    assert report.fetched == start
    assert fetch(sources, tmp_path, only=start, opener=no_network).present == start


def test_several_mirrors_are_tried_in_turn(case: Case) -> None:
    case.add("zoo/a", CONTENT)
    other = case.folder / "other"
    (other / "zoo").mkdir(parents=True)
    (other / "zoo" / "a").write_bytes(CONTENT)
    (row,) = read_sources(case.table())
    empty = case.folder / "empty"
    empty.mkdir()
    assert resolve(row, raw=case.raw, mirror=[empty, other]) == other / "zoo" / "a"
    assert case.fetch(no_network, mirror=[empty, other]).fetched == ["zoo/a"]


def test_a_mirror_may_be_the_folder_of_one_source(case: Case) -> None:
    case.add("zoo/b/a", CONTENT)
    (case.folder / "shelf" / "zoo" / "b").mkdir(parents=True)
    (case.folder / "shelf" / "zoo" / "b" / "a").write_bytes(CONTENT)
    (row,) = read_sources(case.table())
    reference = case.folder / "shelf" / "zoo"
    assert resolve(row, raw=case.raw, mirror=[reference]) == reference / "b" / "a"
    assert resolve(row, raw=case.raw, mirror=[reference / "b"]) is None
    assert case.fetch(no_network, mirror=[reference]).fetched == ["zoo/b/a"]


def test_requests_wait_only_so_long(case: Case) -> None:
    waits: list[float] = []

    def opener(request: urllib.request.Request, *, timeout: float) -> Any:
        waits.append(timeout)
        raise TimeoutError("timed out")

    case.add("zoo/a", CONTENT, address="http://127.0.0.1:9/a")
    assert case.fetch(opener).failed[0][1] == (
        "http://127.0.0.1:9/a: no complete response (TimeoutError('timed out'))"
    )
    assert waits == [fetch_transfer.TIMEOUT_S]
