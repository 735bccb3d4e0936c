"""Figure on the errors of joint angles against the view angle, in the style of zhang2007 figure 5."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from pipeline.charts import Axis, Chart, Sheet
from pipeline.palette import Style
from pipeline.scenes import Columns, Notes, Plot, Rows, Space3D
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, lift, tidy
from pipeline.studies.replicated import OVER_PEOPLE, SD, aggregate
from pipeline.studies.study import Figure, Recorder, Tables, Traits
from pipeline.studies.walks import methods
from pipeline.studies.walks.methods import VIEW
from walk3d.anatomy.joint_angles import JOINT_ANGLES, SIDES
from walk3d.anatomy.study.joint_angles import JointAngleErrors, JointAngles

Inputs = FigureInputs[FourierSamples, Eigenwalkers, JointAngleErrors]


class JointAngleFigure(Figure):
    """Errors of hip, knee, shoulder and elbow flexion against the view angle."""

    model = EigenwalkersModel
    sweep = JointAngles
    traits = Traits(over_people=("table_walkers",), ranked_by=("table_walkers", "rmse_deg"))

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of the errors of joint angles, by view and by walker.

        ``table`` has means over walkers for each method, angle and view; ``table_walkers`` has means over views for
        each walker.

        Walkers with an unmeasured joint of an angle are left out of it.  ``table_summary`` has mean, median and worst
        walker, over all views.
        """
        rows, which = inputs.sweep.rows, ["method", "angle"]
        errors = ["rmse_deg", "offset_free_rmse_deg"]
        walkers = rows.groupby([*which, "person", "walker"], sort=False)[errors].mean().reset_index()

        def over(table: pd.DataFrame, by: list[str], count: str = "", **further: Any) -> pd.DataFrame:
            columns = {
                name.replace("_deg", f"{end}_deg"): (name, how)
                for name in errors
                for end, how in {"": "mean", **further}.items()
            }
            return aggregate(table, by, columns, errors, cluster="person", count=count)

        return {
            "table": over(rows, [*which, "view_angle_deg"], _sd=SD),
            "table_walkers": tidy(walkers, by=["walker", *which]),
            "table_summary": over(walkers, which, "walkers", _median="median", _worst="max"),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return two charts of the error of each joint angle, with and without the constant offset."""
        angles = [angle for angle in JOINT_ANGLES if (tables["table"]["angle"] == angle).any()]
        styles = methods.styles(inputs.sweep.methods.tolist())
        view = VIEW | {"abscissa": Axis(ticks=45)}
        charts = [
            Chart(
                **view, y=column, by="method", styles=styles, where={"angle": angle}, title=angle,
                label=label, zero=True, name=f"{angle}_{column}", page=column == "rmse_deg",
            )
            for column, label in (("rmse_deg", "error"), ("offset_free_rmse_deg", "error without offset"))
            for angle in angles
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=len(angles),
            share_y=True,
            letters=False,
            panel_size=(1.9, 1.8),
            caption="Root mean square over a cycle, mean of left and right and over walkers; bands:"
            f" {OVER_PEOPLE}. Average walker: its depth, the image kept.",
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record one walker over a cycle, original and reconstructed, with the joint angles."""
        sweep, names = inputs.sweep, inputs.sweep.methods.tolist()
        styles = methods.styles(names)
        count = len(sweep.shown_angle_rad[0])
        seconds = np.arange(count) / (count * sweep.stride_hz)
        ground = lift(sweep.shown_joints_mm[0])
        looks = {
            "original": Style("original", "original"),
            **{f"reconstructed/{name}": styles[name] for name in names},
        }
        with begin(
            f"\nThe walker of median error, {inputs.samples[sweep.shown[0]]}, over one cycle: original and "
            "reconstructed from the frontal view. Curves: flexion of the left "
            "side in degrees.\n",
            at=seconds,
        ) as rec:
            for number, (name, style) in enumerate(looks.items()):
                rec.skeleton(
                    f"world/{name}",
                    sweep.shown_joints_mm[number] + ground,
                    colour=style.colour,
                )
                for k, angle in enumerate(JOINT_ANGLES):
                    left = np.degrees(sweep.shown_angle_rad[number, :, k, SIDES.index("left")])
                    entity = f"curves/{angle}_deg/{name.rpartition('/')[2]}"
                    rec.curve(entity, seconds, left, label=style.label, colour=style.colour)
            plots = [
                Plot(name=f"{angle} flexion (degree)", origin=f"curves/{angle}_deg") for angle in JOINT_ANGLES
            ]
            rec.blueprint(
                Columns(
                    Rows(
                        Space3D(name="original and reconstructed"),
                        Notes(),
                        shares=(2, 1),
                    ),
                    Rows(*plots),
                ),
                playing=True,
            )
