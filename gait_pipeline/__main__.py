"""Entry point of ``python -m gait_pipeline``, which does the same as ``python -m pipeline``."""

from __future__ import annotations

import sys

import gait_pipeline  # noqa: F401  # loads our pipeline, whatever else is called so
from pipeline.cli.main import script

if __name__ == "__main__":
    sys.exit(script())
