"""Figure on the coverage of error bars, which zhang2007 does not report."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.core import camera, fourier
from pipeline.scenes import Columns, Image2D, Notes, Space3D
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, lift, tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Figure, Recorder, Tables
from pipeline.studies.walks.methods import VIEW
from walk3d.anatomy.study.model import AnatomicalModel, AnatomicalWalkers
from walk3d.anatomy.study.people_intervals import PeopleResampled
from walk3d.anatomy.study.sweeps.coverage import METHODS, SAMPLE_VIEW_DEG, Bars, Coverage
from walk3d.anatomy.study.sweeps.held_out import BARS, PHASES
from walk3d.anatomy.study.sweeps.ladder import STYLES

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, Bars]

_PLAYED_HZ = 25.0
"""Frame rate of the recording, Hz."""
_SHARP: dict[str, Any] = {
    "x": "covered_percent", "abscissa": Axis(label="covered by 95 % bars as computed"),
    "y": "half_width_mm", "label": "half width, calibrated",
}  # fmt: skip


class BarCoverage(Figure):
    """Coverage and width of error bars."""

    model = AnatomicalModel
    sweep = Coverage

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of the coverage and width of error bars.

        ``table`` is by method, kind of error bar and level.  The further tables have the 95 % error bars by view, joint
        group and walker.

        ``table_walkers_views`` and ``table_walkers_joints`` have each walker, for the calibrated anatomical bars only.
        """
        sweep, which = inputs.sweep, ["method", "bars"]
        people = PeopleResampled(len(inputs.model.people), inputs.experiment.seed)
        level_95 = np.isclose(sweep.levels["level_percent"], 95.0)
        tables = {"table_walkers": sweep.levels[level_95].drop(columns="level_percent")}
        for end, rows in (("_views", sweep.views), ("_joints", sweep.joints)):
            best = (rows["method"] == "anatomical") & (rows["bars"] == BARS[1])
            tables[f"table_walkers{end}"] = rows[best].drop(columns="half_width_mm")
        for name, rows in tables.items():
            rows.insert(1, "walker", rows["person"])
            tables[name] = tidy(
                rows, by=["walker", *which, *[c for c in rows if c in ("view_angle_deg", "joint_group")]]
            )
        for end, rows, each in (
            ("", sweep.levels, "level_percent"),
            ("_views", sweep.views, "view_angle_deg"),
            ("_joints", sweep.joints, "joint_group"),
        ):
            tables[f"table{end}"] = people.means(rows, [*which, each], "covered_percent", ["half_width_mm"])
        return tables

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return charts of the reliability, coverage and width of error bars.

        Reliability is shown for error bars as computed and as calibrated; coverage and width for 95 % error bars.
        """
        styles = {name: STYLES[name] for name in METHODS}
        by_method = partial(Chart, by="method", styles=styles)
        covered = partial(by_method, y="covered_percent", label="covered by 95 % bars")
        level = partial(
            by_method, x="level_percent", y="covered_percent", label="covered",
            abscissa=Axis(label="level of the bars", limits=(0.0, 100.0), ticks=20),
            limits=(0.0, 100.0), references=[Reference(slope=1.0)],
        )  # fmt: skip
        views = {"table": "table_views", "where": {"bars": BARS[1]}, **VIEW}
        walkers = tables["table_walkers"]
        walkers = walkers[walkers["bars"] == BARS[1]].sort_values(["method", "covered_percent"])
        rank = walkers.groupby("method").cumcount() + 1
        ranked = walkers[["method", "covered_percent"]].assign(
            share=100.0 * (rank - 0.5) / len(inputs.model.people)
        )
        people = {
            "table": ranked.to_dict("list"),
            "x": "share",
            "abscissa": Axis(label="people, least covered first", unit="%"),
        }
        ideal = [Reference(y=95.0)]
        table = tables["table"][np.isclose(tables["table"]["level_percent"], 95.0)]
        wide = table.pivot(index="method", columns="bars", values=["covered_percent", "half_width_mm"])
        sharp = {
            "method": list(wide.index),
            "covered_percent": wide["covered_percent"][BARS[0]].tolist(),
            "half_width_mm": wide["half_width_mm"][BARS[1]].tolist(),
        }
        charts = [
            *(
                level(where={"bars": kind}, title=kind, name=f"covered_{kind.replace(' ', '_')}")
                for kind in BARS
            ),
            covered(**views, title="95 % bars, calibrated", limits=(85.0, 100.0), references=ideal),
            by_method(**views, y="half_width_mm", label="half width of 95 % bars", zero=True),
            covered(**people, title="95 % bars, person by person", references=ideal),
            by_method(**{**_SHARP, "table": sharp}, zero=True),
        ]
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"Positions at {PHASES} instants of the periodic walk; calibrated:"
            f" multipliers by joint group, learnt from all other people. Bands: {OVER_PEOPLE}.",
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record one walker: ground truth, most probable reconstruction and samples of the posterior."""
        sweep, data = inputs.sweep, inputs.dataset
        sample = inputs.model.tested[sweep.sample_person]
        walker = data.coefficients[sample]
        angle = np.radians(SAMPLE_VIEW_DEG)
        image = camera.project(walker, angle)
        seconds = 1.0 / data.frequency_hz[sample]
        times = np.arange(0.0, seconds, 1.0 / _PLAYED_HZ)
        original = fourier.synthesise(walker, 1.0 / seconds, times)
        ground = lift(original)

        def motion(missing: np.ndarray) -> np.ndarray:
            return fourier.synthesise(camera.combine(image, missing, angle), 1.0 / seconds, times) + ground

        who = inputs.model.people[sweep.sample_person]
        with begin(
            f"\nThe walker is {who}, who has the median error, seen from {SAMPLE_VIEW_DEG:g}°. Thin: "
            f"{len(sweep.samples)} samples of the posterior; they differ where the image leaves the depth open.\n",
            at=times,
        ) as rec:
            rec.skeleton("world/original", original + ground)
            rec.skeleton(
                "world/reconstructed/anatomical",
                motion(sweep.estimate),
                colour=STYLES["anatomical"].colour,
            )
            for number, missing in enumerate(sweep.samples, start=1):
                rec.skeleton(
                    f"world/posterior/sample_{number:02d}",
                    motion(missing),
                    colour="sky",
                    thickness_mm=1.5,
                )
            rec.image_points(
                "image/observed",
                fourier.synthesise(image, 1.0 / seconds, times),
            )
            space = Space3D(name="truth, reconstruction and samples of the posterior")
            rec.blueprint(
                Columns(
                    space,
                    Image2D(name=f"observed at {SAMPLE_VIEW_DEG:g}°", next_to=space),
                    Notes(),
                    shares=(4, 3, 2),
                ),
                playing=True,
            )
