"""Tests of how the command line ends: output that cannot be written, Ctrl-C, and control characters in texts."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import pytest

from pipeline.cli import pool
from pipeline.cli.inspect import inspect
from pipeline.cli.main import commands, main
from pipeline.processes import CAN_FORK, die_with_parent
from pipeline.storage import sealed_folders
from pipeline.validation import InvalidInput
from tests.rejects import rejects

ROOT = Path(__file__).resolve().parents[2]


def run(arguments: Sequence[str], shell_end: str) -> tuple[int, str]:
    """Return the exit status and the errors of the command line with redirected output."""
    command = f"exec {sys.executable} -m pipeline {' '.join(arguments)} {shell_end}"
    done = subprocess.run(
        ["bash", "-c", command], cwd=ROOT, stderr=subprocess.PIPE, text=True, timeout=60, check=False
    )
    return done.returncode, done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", [[], ["equations"]])
def test_a_full_disk_under_the_output_ends_in_a_sentence(arguments: list[str]) -> None:
    assert run(arguments, "> /dev/full") == (1, "output cannot be written: No space left on device\n")


def test_a_closed_output_ends_in_a_sentence() -> None:
    status, words = run(["--version"], ">&-")
    assert status == 1
    assert words.startswith("standard output or standard error is closed")


def test_a_reader_who_leaves_is_told_in_a_sentence() -> None:
    """The command line prints one sentence if the reader of its output pipe closes the pipe."""
    process = subprocess.Popen(
        [sys.executable, "-m", "pipeline", "equations"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    words = process.stderr.read()
    process.stderr.close()
    assert (process.wait(60), words) == (1, b"output cannot be written: Broken pipe\n")


def test_an_early_interrupt_ends_in_a_sentence(tmp_path: Path) -> None:
    arguments = ["experiment=zhang2007_fig2", "scale=smoke"]
    process = subprocess.Popen(
        [sys.executable, "-X", "importtime", "-m", "pipeline", *arguments, f"results={tmp_path}"],
        cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    message = []
    for line in process.stderr:  # until numpy is being loaded: the command line is there, its work is not
        message.append(line)
        if "numpy" in line:
            process.send_signal(signal.SIGINT)
            break
    words = process.stderr.read()
    process.stderr.close()
    assert process.wait(60) == 130, "".join(message[-3:]) + words
    assert "Traceback" not in words
    assert "interrupted" in words


def test_texts_of_others_cannot_steer_the_terminal_or_fill_it() -> None:
    error = InvalidInput("is unknown", where="a\x1b[2J\nb", received="x" * 10_000)
    assert str(error).isprintable()
    assert "\\x1b[2J\\nb" in str(error)
    assert len(str(error)) < 400
    assert len(str(InvalidInput("y" * 10_000))) < 4000
    assert str(InvalidInput("é → Müller", where="ü")) == "ü: é → Müller"


def test_every_command_has_help(capsys: pytest.CaptureFixture[str]) -> None:
    for name in commands():
        assert main([name, "--help"]) == 0
        text = capsys.readouterr().out
        assert len(text.splitlines()[0]) > 20, name
        assert not any(line.startswith("    ") and not line.strip() for line in text.splitlines())


@pytest.mark.parametrize(
    ("rate", "code"),
    [("abc", "not_a_number"), *((rate, "out_of_range") for rate in ("-5", "0", "nan", "1e400"))],
)
def test_inspect_refuses_bad_frame_rates(rate: str, code: str, tmp_path: Path) -> None:
    with rejects(code, "frame_rate_hz"):
        list(inspect([str(tmp_path), f"frame_rate_hz={rate}"]))


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("data.clips.seconds=1e9", "data.clips.seconds must be"),
        ("data.performances.frames_mean=1e9", "data.performances.frames_mean must be"),
        ("data.performances.performances=1000000000", "data.performances.performances must be"),
        ("data.duration_s=1e9", "data.duration_s must be"),
        ("sweep.view_angle_deg.step=1e-308", "sweep.view_angle_deg must be at most"),
    ],
)
def test_absurd_sizes_are_refused_by_bounds(
    option: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["figures", "experiment=zhang2007_fig5", "scale=smoke", f"results={tmp_path}", option]) == 1
    assert words in " ".join("".join(capsys.readouterr()).split())


def test_another_container_of_the_same_host_name_is_another_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Recent temporary folders of another container are kept, even if the container has the same host name."""
    start = sealed_folders._process_space()
    assert start == sealed_folders._HERE
    monkeypatch.setattr(Path, "readlink", lambda self: Path("pid:[1]"))
    other = sealed_folders._process_space()
    assert other != start
    monkeypatch.undo()
    process = subprocess.run(
        [sys.executable, "-c", "import os; print(os.getpid())"], check=True, capture_output=True, text=True
    )
    ended = int(process.stdout)
    for position in (start, other):
        (tmp_path / f".tmp-{ended}-{position}01234567").mkdir()
    sealed_folders.remove_stale(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [f".tmp-{ended}-{other}01234567"]


@pytest.mark.skipif(not CAN_FORK, reason="needs forks")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_what_workers_leave_that_have_to_be_killed_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = tmp_path / "figures", tmp_path / "cache"
    context = multiprocessing.get_context("fork")
    ready = context.Event()

    us = os.getpid()
    monkeypatch.setattr(pool, "MAX_SIGNALS", 1)
    monkeypatch.setattr(pool, "SIGNAL_INTERVAL_S", 0.0)

    def deaf() -> None:
        die_with_parent(us)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        with sealed_folders.temporary_folder(folders[0]), sealed_folders.temporary_folder(folders[1]):
            ready.set()
            signal.pause()

    for folder in folders:
        folder.mkdir()
    worker = context.Process(target=deaf)
    worker.start()
    ready.wait()
    assert [len(list(folder.iterdir())) for folder in folders] == [1, 1]
    experiment = SimpleNamespace(results=str(tmp_path))
    pool._end([SimpleNamespace(process=worker)], [(experiment, folders[0] / "zhang2007_fig5")])  # type: ignore[list-item]
    assert worker.exitcode == -signal.SIGKILL
    assert [list(folder.iterdir()) for folder in folders] == [[], []]
