"""``python -m pipeline``: see `pipeline.cli.main`, whose docstring is the help."""

from __future__ import annotations

import os
import signal
import sys


def _leave(*_: object) -> None:
    """End at once: nothing has begun yet."""
    os.write(2, b"interrupted before anything began\n")
    os._exit(130)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, _leave)  # until the command line takes over

from pipeline.cli.main import script

if __name__ == "__main__":
    sys.exit(script())
