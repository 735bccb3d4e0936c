"""Command that opens a recording in the viewer: ``python -m pipeline.recordings.viewing FILE``.

A layout cannot state the time at which the viewer starts, and the viewer starts at the first row.  Over view angles the
first row is the left profile.  Here the viewer is sent to 0 degrees once the file is loaded.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import rerun
from rerun.experimental import ViewerClient

TIMELINE = "view_angle_deg"
"""Timeline whose position the viewer sets to 0 when it opens."""
PROGRAM = Path(rerun.__file__).parents[1] / "rerun_cli" / ("rerun.exe" if os.name == "nt" else "rerun")
TIMEOUT_S = 60.0


def open_viewer(path: Path, *options: str) -> tuple[subprocess.Popen[bytes], Any]:
    """Start the viewer with a recording, and return the viewer's process and a client of the viewer.

    The client is None if the viewer does not answer.

    Parameters
    ----------
    path : Path
    *options : str
        Further options of the viewer's program.
    """
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [str(PROGRAM), "--bind", "127.0.0.1", "--port", str(port), *options, str(Path(path).resolve())]
    process = subprocess.Popen(command)
    deadline, client = time.monotonic() + TIMEOUT_S, None
    while process.poll() is None and time.monotonic() < deadline:
        try:
            client = client or ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            state = client.get_state()
        except (OSError, RuntimeError):  # not listening yet
            client = None
        else:
            if state.views and not state.loading:
                if any(recording.current_timeline == TIMELINE for recording in state.recordings):
                    client.set_time(TIMELINE, sequence=0)
                return process, client
        time.sleep(0.1)
    return process, None


if __name__ == "__main__":
    sys.exit(open_viewer(Path(sys.argv[1]))[0].wait())
