"""Variance between performances left after each way of synchronizing, over samples; after mozerov2006, ours.

Figure 3 shows bundles of curves that are wide or narrow; this is their width.  Raw performances are compared frame by
frame, as long as two of them last.  Where the true course is known, so is what a perfect synchronization would leave:
people differ in their postures too.  Less than that is left where time bends to hide differences of posture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Sheet
from pipeline.core.resampling import interpolate
from pipeline.scenes import Columns, Notes, Rows, Space3D
from pipeline.studies.actions.figures.alignments import (
    STYLES,
    Inputs,
    mean_variance_left,
    skeleton,
    variances_left,
)
from pipeline.studies.actions.model import ALIGNMENTS, ActionSpaceModel
from pipeline.studies.presentation import entity_name
from pipeline.studies.study import Figure, Recorder

SHORT_NAMES = {
    "raw": "not synchronized",
    "linear": "linear",
    "keyframe": "key-frames",
    "synchronized": "automatic",
    "true_warp": "true course",
}

COMPARED = ("linear", "synchronized")
"""Shown as skeletons beside each other."""

_MOST_BODIES = 40
"""Performances shown as skeletons: more do not widen the bundle, but make a file that is too large to send."""


@dataclass(kw_only=True)
class VarianceLeft(Figure):
    """Variance between performances left after each way of synchronizing."""

    model = ActionSpaceModel

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: variance left at each sample; ``table_stages``: over all samples."""
        aligned = {alignment: inputs.model.sequences(alignment) for alignment in ALIGNMENTS}
        if inputs.dataset.phase is not None:
            frames, _ = inputs.dataset.true_course(inputs.model.median, inputs.model.linear.shape[1])
            aligned["true_warp"] = [interpolate(x, at) for x, at in zip(aligned["raw"], frames, strict=True)]
        blocks = []
        for alignment, performances in aligned.items():
            variance, lasting = variances_left(performances)
            blocks.append(
                pd.DataFrame(
                    {
                        "stage": alignment,
                        "sample": np.arange(len(variance)),
                        "variance_left": variance,
                        "performances": lasting,
                    }
                )
            )
        means = np.array([mean_variance_left(performances) for performances in aligned.values()])
        stages = pd.DataFrame({"stage": list(aligned), "variance_left": means})
        stages["variance_left_to_linear"] = means / means[list(aligned).index("linear")]
        return {"table": pd.concat(blocks, ignore_index=True), "table_stages": stages}

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """The variance left over samples, of raw performances over frames."""
        left = tables["table_stages"].set_index("stage")["variance_left_to_linear"]
        chart = Chart(
            x="sample",
            x_label="sample; frame, if not synchronized",
            y="variance_left",
            by="stage",
            styles={
                alignment: replace(
                    STYLES[alignment], label=f"{SHORT_NAMES[alignment]} ({left[alignment]:.2f})"
                )
                for alignment in left.index
            },
            label="variance left",
            zero=True,
        )
        caption = "In brackets: mean over samples, relative to linear synchronization."
        return Sheet(charts=[chart], panel_size=(5.5, 2.6), caption=caption)

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], begin: Recorder) -> None:
        """Log the variance left over samples, and performances at the sample at the cursor, before and after."""
        action, count = inputs.model, len(inputs.samples)
        shown = np.unique(np.linspace(0, count - 1, min(count, _MOST_BODIES)).round().astype(int))
        with begin(
            f"\nDrawn are {len(shown)} of {count} performances; the curves are of all. Samples are frames for "
            "performances that are not synchronized. Drag the cursor: the performances at that sample, on the spot, "
            "linearly synchronized on the left and automatically on the right; the wider the bundle, the larger the "
            "variance.\n",
            timeline="sample",
        ) as rec:
            for alignment in COMPARED:
                sequences = action.sequences(alignment)
                for m in shown:
                    x = sequences[m]
                    rec.skeleton(
                        f"world/{alignment}/{entity_name(inputs.samples[m])}",
                        # With the limbs of one person, so that what differs is posture.
                        skeleton(inputs, x, action.median),
                        index={"sample": np.arange(len(x))},
                        colour=STYLES[alignment].colour,
                        thickness_mm=3.0,
                    )
            bundles = [
                Space3D(
                    name=STYLES[alignment].label,
                    contents=(f"world/{alignment}",),
                    eye_mm=(2000.0, 700.0, 1200.0),
                    target_mm=(0.0, 100.0, 800.0),
                )
                for alignment in COMPARED
            ]
            below = Columns(*rec.plots, Notes(), shares=(2, 1))
            layout = Rows(Columns(*bundles), below, shares=(3, 2))
            rec.blueprint(layout, playing=True)
