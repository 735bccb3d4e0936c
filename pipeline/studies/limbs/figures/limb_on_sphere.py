"""Recording of what is swept over one limb: the error as curves, and the limb as a path on its sphere."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline import recordings
from pipeline.palette import Style
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.figures.presentation import EYE_MM, OUTSIDE, RADIUS_MM, path_bones, sphere
from pipeline.studies.limbs.model import BasisFit
from pipeline.studies.limbs.swept_errors import SweptErrors


def record_on_sphere(
    inputs: FigureInputs[LimbStretches, BasisFit, SweptErrors],
    folder: Path,
    table: Mapping[str, pd.Series],
    *,
    by: str,
    styles: Mapping[str, Style],
    plot: str,
) -> None:
    """Log the second column of a table over the first, which is the timeline, and the limb that is shown.

    Parameters
    ----------
    inputs : FigureInputs
    folder : Path
        Of the figure.
    table : mapping of str to Series
        Column of the timeline, column of the ordinate, ``<ordinate>_low`` and ``_high``, name of the series.
    by : str
        Column that names the series.
    styles : mapping of str to Style
    plot : str
        What the plot is called.
    """
    sweep = inputs.sweep
    timeline, y, *_ = table
    shown = sweep.rows[sweep.rows["trial"] == sweep.shown].iloc[0]
    truth, found = RADIUS_MM * sweep.paths[:, 0], RADIUS_MM * OUTSIDE * sweep.paths[:, 1]
    globe, wires = sphere()
    at = np.unique(table[timeline])
    bones, index = path_bones(truth.shape[1]), {timeline: at}
    with inputs.recording(
        folder,
        f"\nThe limb shown is `{shown['limb']}` of `{shown['clip']}`, {Camera(shown['camera']).words}: the trial "
        "whose errors are nearest to the medians. Its end moves on the sphere of the limb, drawn with a radius of one "
        "metre: green "
        "the truth, orange the estimate at the value at the cursor, drawn "
        f"{100 * (OUTSIDE - 1):.0f} % outside. Drag the cursor.\n",
        timeline=timeline,
    ) as rec:
        rec.curves(dict(table), x=timeline, y=y, by=by, styles=styles)
        rec.skeleton("world/truth", truth, bones, index=index, colour="green", thickness_mm=6.0)
        rec.skeleton("world/estimate", found, bones, index=index, colour="orange", thickness_mm=6.0)
        rec.skeleton("world/sphere", globe, wires, index={timeline: at[:1]}, thickness_mm=1.0)
        rec.blueprint(
            recordings.Columns(
                recordings.Space3D(name="truth and estimate", eye_mm=EYE_MM, target_mm=(0.0, 0.0, 0.0)),
                recordings.Rows(recordings.Plot(name=plot, headroom=0.3), recordings.Notes(), shares=(3, 2)),
                shares=(1, 1),
            )
        )
