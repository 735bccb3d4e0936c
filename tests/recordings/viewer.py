"""Functions that verify a recording with the viewer's program, and save a picture of the viewer."""

from __future__ import annotations

import os
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import rerun
from rerun.experimental import ViewerClient

from pipeline.validation import InvalidInput

PROGRAM = Path(rerun.__file__).parents[1] / "rerun_cli" / ("rerun.exe" if os.name == "nt" else "rerun")
"""Path of the viewer's executable, used because stopping its Python wrapper would leave it running."""

TIMEOUT_S = 60.0

FADE_S = 3.5
"""Seconds from the first view to the picture, until the viewer's start-up notices have disappeared."""


def verify(path: Path) -> None:
    """Verify with the viewer's command line that a recording is complete and readable.

    Raises
    ------
    InvalidInput
        If it is not; with the last line of the command's output.
    """
    command = [str(PROGRAM), "rrd", "verify", str(path)]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired as error:
        raise InvalidInput(
            "the viewer did not verify the recording within the time limit", where=str(path), code="too_slow"
        ) from error
    if run.returncode:
        message = (run.stderr or run.stdout).strip().splitlines() or ["no reason given"]
        raise InvalidInput(
            "the recording is damaged", where=str(path), received=message[-1].strip(), code="damaged"
        )


def screenshot(
    path: Path,
    png: Path,
    *,
    size: tuple[int, int] = (1600, 1000),
    timeline: str | None = None,
    value: float | None = None,
) -> tuple[str, ...]:
    """Save a picture of the view with which the viewer opens, and return the viewer's warnings.

    Runs the viewer without a screen, listening on this machine only, and stops it.

    Parameters
    ----------
    path, png : Path
        The recording, and the picture to write.
    size : (int, int)
        Width and height in points; the picture may have more pixels.
    timeline : str, optional
    value : float, optional
        Where on `timeline` to go first: seconds for ``time``, else an integer.

    Raises
    ------
    InvalidInput
        If there is no Vulkan driver (``mesa-vulkan-drivers`` draws without a graphics card), the viewer
        stops, or time runs out.
    """
    if not Path(path).is_file():
        raise InvalidInput("no such recording", where=str(path), code="no_recording")
    deadline = time.monotonic() + TIMEOUT_S
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    options = f"--headless --hide-welcome-screen --bind 127.0.0.1 --port {port}"
    with tempfile.TemporaryFile("w+") as message:
        viewer = subprocess.Popen(
            [str(PROGRAM), *options.split(), "--window-size", f"{size[0]}x{size[1]}"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=message,
            # Fewer notices over the picture.
            env={**os.environ, "RERUN_APP_ONLY": "true", "RUST_LOG": "error"},
        )
        try:
            _until(lambda: viewer.poll() is not None or _answers(port), deadline)
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.open(str(Path(path).resolve()))
            _until(lambda: not (state := client.get_state()).loading and bool(state.views), deadline)
            if timeline == "time" and value is not None:
                client.set_time(timeline, duration=float(value), play_state="paused")
            elif timeline is not None and value is not None:
                client.set_time(timeline, sequence=int(value), play_state="paused")
            time.sleep(FADE_S)
            complaints = tuple(str(report) for view in client.get_state().views for report in view.reports)
            Path(png).write_bytes(client.take_screenshot())
            return complaints
        except (OSError, RuntimeError) as error:
            message.seek(0)
            words = [line.strip() for line in message if "panicked" in line]
            raise InvalidInput(
                "the viewer stopped or did not answer",
                where=str(path),
                expected="a Vulkan driver, such as the package mesa-vulkan-drivers",
                received=(words or [str(error)])[0],
                code="viewer_stopped",
                panicked=bool(words),
            ) from error
        finally:
            viewer.kill()
            viewer.wait()


def _until(ready: Callable[[], bool], deadline: float) -> None:
    while not ready():
        if time.monotonic() > deadline:
            raise TimeoutError("no answer in time")
        time.sleep(0.05)


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(0.5)
        return probe.connect_ex(("127.0.0.1", port)) == 0
