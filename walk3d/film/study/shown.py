"""Recording of one simulated clip: image and reprojection, ground truth, reconstruction and average walker."""

from __future__ import annotations

import numpy as np

from pipeline.palette import Style, name_on_dark
from pipeline.scenes import Columns, Image2D, Notes, Plot, Rows, Space3D
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.study import Figure, Recorder, Tables
from walk3d.film.study.dataset import FilmedWalkers
from walk3d.film.study.measured import FilmedErrors
from walk3d.film.study.model import KeypointWalkers, KeypointWalkersModel

Inputs = FigureInputs[FilmedWalkers, KeypointWalkers, FilmedErrors]

METHODS = {
    "keypoint_walk": Style("from keypoints", "map"),
    "image_kept": Style("image kept, average walker's depth", "amber", line="dashed"),
    "average_walker": Style("average walker", "baseline", line="dotted"),
}


class KeypointFigure(Figure):
    """Figure of simulated clips that also records one of the clips for the viewer."""

    model = KeypointWalkersModel

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Log the clip with the median error: image, reprojection, ground truth, reconstruction and average walker."""
        sweep = inputs.sweep
        T = len(sweep.shown_true_mm)
        times = np.arange(T) / sweep.shown_rate_hz
        clip = sweep.clips.iloc[sweep.shown]
        words = (
            f"\nA clip of `{clip['person']}`, heading {clip['heading_deg']:g}°, of median error."
            " Image: keypoints (dots), reprojection (lines). 3D about the pelvis: "
            f"{name_on_dark('original')}: truth, {name_on_dark('map')}: reconstruction, {name_on_dark('baseline')}: "
            "average walker with the heading and phase that were found.\n"
        )
        bodies = {
            "original": (sweep.shown_true_mm, "original"),
            "reconstructed/keypoint_walk": (sweep.shown_estimate_mm, "map"),
            "reconstructed/average_walker": (sweep.shown_average_mm, "baseline"),
        }
        ground = sweep.shown_true_mm[..., 1].max()
        flip = np.array([1.0, -1.0])
        with begin(words, at=times) as rec:
            rec.image_points("image/observed", sweep.shown_image_px * flip, [(0, 0)], thickness_mm=4.0)
            rec.image_points(
                "image/reprojection", sweep.shown_reprojection_px * flip, colour="map",
                thickness_mm=2.5,
            )  # fmt: skip
            for entity, (level, colour) in bodies.items():
                upright = np.stack([level[..., 0], level[..., 2], ground - level[..., 1]], axis=-1)
                rec.skeleton(f"world/{entity}", upright, colour=colour)
                if name := entity.partition("/")[2]:
                    off = np.linalg.norm(level - sweep.shown_true_mm, axis=-1).mean(axis=1)
                    rec.curve(f"curves/error_mm/{name}", times, off, label=METHODS[name].label, colour=colour)
            half = sweep.shown_half_mm.mean(axis=1)
            for axis, (name, colour) in enumerate((("right", "sky"), ("down", "green"), ("away", "orange"))):
                rec.curve(
                    f"curves/half_width_95_mm/{name}",
                    times,
                    half[:, axis],
                    label=f"95 % bars, {name}",
                    colour=colour,
                )
            rec.blueprint(
                Columns(
                    Image2D(name="image: keypoints, reprojection"),
                    Space3D(name="truth, reconstruction, average walker", eye_mm=(1800.0, -2200.0, 1400.0)),
                    Rows(
                        Plot(name="error (mm)", origin="curves/error_mm"),
                        Plot(name="half width of 95 % bars (mm)", origin="curves/half_width_95_mm"),
                        Notes(),
                    ),
                    shares=(3, 3, 3),
                ),
                playing=True,
            )
