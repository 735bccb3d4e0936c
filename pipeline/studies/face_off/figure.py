"""Error of eigenwalkers and of articulated trajectories against view, noise and occlusion: of no paper, ours."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from pipeline.charts import Chart, Lines, Sheet
from pipeline.palette import Style, name_on_dark
from pipeline.scenes import Columns, Image2D, Notes, Plot, Rows, Space3D
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.face_off.comparison import CHILDREN, FaceOffSweep, MethodErrors
from pipeline.studies.face_off.methods import PELVIS
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.presentation import lift
from pipeline.studies.replicated import aggregate, interval_words
from pipeline.studies.study import Figure, Recorder, Tables

METHODS = {
    "least_squares": Style("eigenwalkers (least squares)", "least_squares"),
    "map": Style("eigenwalkers (MAP)", "map", line="dashed"),
    "anatomical": Style("anatomical", "green"),
    "image_and_average": Style("image, average walker's depth", "baseline", line="dashed"),
    "mean_walker": Style("average walker", "baseline", line="dotted"),
    "articulated": Style("articulated", "purple", line="dashed"),
    "articulated_hinges": Style("articulated, hinges", "amber"),
    "articulated_mirrors": Style("articulated, mirrors tried", "sky"),
}
RECORDED = METHODS | {"mean_walker": Style("average walker", "yellow")}
"""In recordings the truth is light grey."""

DISTURBED = {
    "none": ("view_angle_deg", "undisturbed", "black"),
    "noise": ("noise_px", "most noise", "orange"),
    "occlusion": ("occluded", "most joints hidden", "purple"),
    "heading": ("heading_error_deg", "heading most wrong", "sky"),
}
"""What is varied: its column, the words for its largest value, and their colour."""

CONDITION = ["view_angle_deg", "camera", "method", "varied", "noise_px", "occluded", "heading_error_deg"]
ORDER = ["varied", "camera", "method", "view_angle_deg", "noise_px", "occluded", "heading_error_deg"]

Inputs = FigureInputs[FourierSamples, Eigenwalkers, MethodErrors]


class FaceOffFigure(Figure):
    """Both families against view, noise and occlusion."""

    model = EigenwalkersModel
    sweep = FaceOffSweep

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table``: each walker; ``table_joints``: each joint of undisturbed views; ``table_summary``: means.

        A method that a camera's images cannot be given to has no rows there.
        """
        rows, joints = inputs.sweep.rows, inputs.sweep.joints
        of_joint = joints.groupby(["camera", "method", "view_angle_deg", "joint"], sort=False)["error_mm"]
        by_joint = of_joint.agg(error_mm="mean", error_sd_mm=sd).reset_index()
        how = {
            "error_mm": ("error_mm", "mean"),
            "missing_dimension_error_mm": ("missing_dimension_error_mm", "mean"),
            "error_sd_mm": ("error_mm", sd),
            "people": ("person", "nunique"),
        }
        banded = ["error_mm", "missing_dimension_error_mm"]
        each = ["walker", *CONDITION, *banded, "frames"]
        return {
            "table": tidy(rows[each], by=["walker", *ORDER]),
            "table_joints": tidy(
                by_joint[["method", "camera", "view_angle_deg", "joint", "error_mm", "error_sd_mm"]],
                by=["camera", "method", "view_angle_deg"],
            ),
            "table_summary": aggregate(rows, ORDER, how, banded, cluster="person", count="walkers"),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """A panel to a camera: error of each method as it is and disturbed; on the page, against view, too."""
        options = cast(FaceOffSweep, inputs.experiment.sweep)
        table = tables["table_summary"]
        error: dict[str, Any] = {"table": "table_summary", "y": "error_mm"}
        ends = table[[name for name in ("error_mm", "error_mm_low", "error_mm_high") if name in table]]
        words = {name: style.label for name, style in METHODS.items()}

        def disturbed(camera: str, varied: str) -> dict[str, Any]:
            column, label, colour = DISTURBED[varied]
            most = options.varied_view_deg if varied == "none" else table[column].max()
            where = {"camera": camera, "varied": varied, column: most}
            return {**error, "where": where, "styles": {varied: Style(label, colour)}}

        dots = [
            Chart(
                **disturbed(camera, "none"), x="method", words=words, log_y=True,
                title=f"{camera} camera",
                limits=(0.9 * ends.min(axis=None), 1.1 * ends.max(axis=None)), ticks=(20, 50, 100, 200),
                name=f"error_{camera}_mm", also=[Lines(**disturbed(camera, varied)) for varied in list(DISTURBED)[1:]],
            )
            for camera in map(str, options.cameras)
        ]  # fmt: skip
        against_view = [
            Chart(
                **error, x="view_angle_deg", by="method", styles=METHODS,
                where={"camera": str(camera), "varied": "none"}, title=f"{camera} camera", zero=True, picture=False,
                name=f"error_{camera}_by_view_mm", ticks=30,
            )
            for camera in options.cameras
        ]  # fmt: skip
        return Sheet(
            charts=[*dots, *against_view],
            columns=len(dots),
            letters=False,
            panel_size=(2.5, 2.9),
            caption="Mean distance of the joints from the recorded motion, relative to the pelvis, over"
            f" {len(inputs.sweep.walkers)} walkers. {interval_words(table['people'][0])} Perspective camera at"
            f" {options.distance_mm:g} mm with a focal length of {options.focal_px:g} px, view of"
            f" {options.varied_view_deg:g}°: undisturbed, with noise of {table['noise_px'].max():g} px,"
            f" {100 * table['occluded'].max():g} % of the joints hidden, or a heading that is"
            f" {table['heading_error_deg'].max():g}° wrong. Eigenwalkers: the model learnt without the walker,"
            " frequency and phase from the still view alone, none where the camera moves. Anatomical: the same, with"
            " mirror images and bones of constant length. Articulated: no walk was learnt; true lengths of the limbs."
            " All are given the pelvis. Average walker: with the true frequency and phase, by itself and as the depth"
            " of the image as it is.",
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Log one walker: recorded, by every method from every camera; what the cameras saw; errors over time."""
        sweep, options = inputs.sweep, cast(FaceOffSweep, inputs.experiment.sweep)
        true = sweep.shown_true
        ground, times = lift(true), np.arange(len(true)) / options.frame_rate_hz
        methods = [str(method) for method in sweep.methods]
        with begin(
            f"\nWalker `{inputs.samples[sweep.shown[0]]}` from "
            f"{sweep.shown_view_angle_deg:g}°, noise {sweep.shown_noise_px:g} px; of all walkers the one whose error "
            "by the articulated method is the median. All bodies are laid on the recorded pelvis. "
            f"{name_on_dark('original').capitalize()}: recorded. "
            + ", ".join(f"{name_on_dark(RECORDED[m].colour)}: {RECORDED[m].label}" for m in methods)
            + ".\n",
            at=times,
        ) as rec:
            worst = 0.0
            rec.skeleton("world/original", true + ground)
            for c, camera in enumerate(options.cameras):
                image = options.upright_mm(sweep.shown_images[c])
                rec.image_points(f"image/observed/{camera}", image)
                for m, method in enumerate(methods):
                    body = sweep.shown_positions[c, m]
                    if np.isnan(body).all():
                        continue
                    moved = body - body[:, [PELVIS]] + true[:, [PELVIS]]
                    style = RECORDED[method]
                    entity = f"world/reconstructed/{camera}/{method}"
                    rec.skeleton(entity, moved + ground, colour=style.colour)
                    off = np.linalg.norm(moved - true, axis=-1)[:, CHILDREN].mean(axis=1)
                    worst = max(worst, off.max())
                    rec.curve(
                        f"curves/error_mm/{camera}/{method}",
                        times,
                        off,
                        label=style.label,
                        colour=style.colour,
                    )
            # From the side of a camera, what it does not show lies across.
            side = np.radians(sweep.shown_view_angle_deg) + np.pi / 3
            eye = (2600.0 * np.sin(side), -2600.0 * np.cos(side), 1400.0)
            columns = []
            for camera in options.cameras:
                open_on = (
                    ("map", "articulated_mirrors") if camera is Camera.still else ("articulated_mirrors",)
                )
                space = Space3D(
                    name=f"{camera.words}: recorded and reconstructed",
                    contents=("world/original", f"world/reconstructed/{camera}"),
                    shown=("world/original", *(f"world/reconstructed/{camera}/{m}" for m in open_on)),
                    eye_mm=eye,
                )
                image_view = Image2D(
                    name=f"image of the {camera.words}", origin=f"image/observed/{camera}", beside=space
                )
                curves = Plot(
                    name=f"error (mm) against time (s), {camera.words}",
                    origin=f"curves/error_mm/{camera}",
                    y_range=(0.0, 1.7 * worst),  # the legend takes the upper part
                )
                columns.append(Rows(space, image_view, curves, shares=(4, 4, 3)))
            layout = Columns(*columns, Notes(), shares=[3] * len(columns) + [2])
            rec.blueprint(layout, playing=True)
