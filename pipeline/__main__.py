"""Entry point of ``python -m pipeline``; the docstring of `pipeline.cli.main` is the help."""

from __future__ import annotations

import os
import signal
import sys


def _leave(*_: object) -> None:
    """Exit on Ctrl-C at once, because no work has begun yet."""
    os.write(2, b"interrupted before the work began\n")
    os._exit(130)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, _leave)  # until the command line takes over

from pipeline.cli.main import script

if __name__ == "__main__":
    sys.exit(script())
