"""``python -m pipeline``: see `pipeline.cli.main`, whose docstring is the help."""

from __future__ import annotations

import os
import sys

# Many small solves: BLAS threads would wait for each other.  Before numpy is loaded; the user's own wish wins.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

from pipeline.cli.main import main

if __name__ == "__main__":
    for _stream in (sys.stdout, sys.stderr):
        _stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # σ² and ° on a terminal without them
    sys.exit(main(sys.argv[1:]))
