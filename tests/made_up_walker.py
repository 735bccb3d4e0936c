"""Made-up average walker in the file layouts of the BioMotion Lab; the numbers are not from the laboratory.

python -m tests.made_up_walker
    Write ``tests/fixtures/js_made_up.js``, ``json_made_up.json`` and ``mm_made_up.mm`` again.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pipeline.formats.fourier_walks import AXES
from walk3d.pointlight import synthetic_walker

FIXTURES = Path(__file__).resolve().parent / "fixtures"
WALKER = FIXTURES / "mm_made_up.mm"
"""File with the walker that the tests pass to zhang2007_author in the variable AVERAGE_WALKER."""
PERIOD, SPEED = 118.5, 11.0
"""Gait period, frames at 120 Hz, and walking speed, mm per frame."""


def blocks(gender: float, period: float, size: float, speed: float) -> np.ndarray:
    """Return coefficients (5, 46) of a synthetic walker, a quarter stride later, with x forwards and y to the left."""
    p0, p1, q1, p2, q2 = synthetic_walker(gender)[0]
    later = np.stack([p0, -q1, p1, -p2, -q2])
    by_axis = np.stack([later[..., 1], -later[..., 0], later[..., 2]], axis=1).reshape(5, -1)
    last = np.array([period, size, speed, 0.0, 0.0])
    return np.column_stack([by_axis, last]).round(4)


def walker() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the mean walker (5, 46) and the axes of variation, all multiples of the difference between the sexes."""
    mean = blocks(0.5, PERIOD, 1.0, SPEED)
    difference = (blocks(1.5, PERIOD + 1.0, 1.0, SPEED + 0.5) - mean).round(4)
    shares = np.array([1.0, 0.5, -0.25, 0.2])
    return mean, {
        axis: (share * difference).round(4) for axis, share in zip(AXES, shares.tolist(), strict=True)
    }


def javascript() -> str:
    """Return the arrays as JavaScript in the layout of BMWalker.js, with one number per line."""
    mean, axes = walker()

    def array(name: str, values: np.ndarray) -> str:
        lines = ",\n".join(f"      {value}" for value in values.ravel().tolist())
        return f"    this.{name} = new Array(\n{lines}\n    );\n"

    return (
        "class BMWalker {\n  constructor() {\n    const walkerData = new BMWData();\n"
        "    this.meanwalker = walkerData.meanwalker;\n    this.weightaxis = walkerData.weightaxis;\n  }\n}\n\n"
        "class BMWData {\n  constructor() {\n    this.meanwalker = new Array();\n"
        + array("meanwalker[0]", mean)
        + array("meanwalker[1]", mean[:, :4])
        + "".join(array(AXES[axis], values) for axis, values in axes.items())
        + "  }\n}\n"
    )


def as_json() -> str:
    """Return the arrays as JSON text."""
    mean, axes = walker()
    content = {
        "source": "made up",
        "mean_walker": mean.ravel().tolist(),
        "axes": {axis: values.ravel().tolist() for axis, values in axes.items()},
    }
    return json.dumps(content, indent=0) + "\n"


def as_mm() -> str:
    """Return the mean walker as an mm file, with the columns mean, cosine 1, sine 1, cosine 2 and sine 2."""
    mean, _ = walker()
    rows = mean[[0, 2, 1, 4, 3]].T
    rows[-1] = mean[:, -1]
    return "\n".join(" ".join(f"{value:.4f}" for value in row) for row in rows.tolist()) + "\n"


MADE = {"js_made_up.js": javascript, "json_made_up.json": as_json, "mm_made_up.mm": as_mm}
"""Functions that return the text of each fixture, by file name."""

if __name__ == "__main__":
    for name, text in MADE.items():
        (FIXTURES / name).write_text(text(), encoding="utf-8")
