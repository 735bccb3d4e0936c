"""Error bars against the truth: our figure of zhang2007, which gives none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy.special import ndtri

from pipeline.charts import Chart, Reference, Sheet
from pipeline.core import anatomical, camera, fourier
from pipeline.scenes import Columns, Image2D, Notes, Space3D
from pipeline.seeding import derive_generator
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.presentation import lift
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.presentation import VIEW
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.coverage import SAMPLE_VIEW_DEG, Bars, Coverage
from pipeline.studies.walks.sweeps.held_out import BARS
from pipeline.studies.walks.sweeps.ladder import STYLES

if TYPE_CHECKING:
    from pipeline.recordings import Recorder

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, Bars]

LEVELS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99])
LEVEL_95 = 10
_PLAYED_HZ = 25.0
_SHARP: dict[str, Any] = {
    "x": "covered_percent", "x_label": "covered by 95 % bars as computed",
    "y": "half_width_mm", "label": "half width, calibrated",
}  # fmt: skip


@dataclass(kw_only=True)
class BarCoverage(Figure):
    """Coverage and width of error bars."""

    model = AnatomicalModel
    sweep = Coverage

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: by method, bars and level; 95 % bars by view, joint group and walker beside it.

        ``table_walkers_views``, ``table_walkers_joints``: of every walker, anatomical and calibrated alone.
        """
        sweep, model = inputs.sweep, inputs.model
        people = PeopleResampled(len(model.people), derive_generator(inputs.experiment.seed, "people"))
        groups = list(anatomical.GROUPS)
        rows: dict[str, list[Mapping[str, object]]] = {
            "": [], "_views": [], "_joints": [], "_walkers": [], "_walkers_views": [], "_walkers_joints": [],
        }  # fmt: skip

        def add_walkers(name: str, covered: np.ndarray, **keys: object) -> None:
            """A row for each person, of the anatomical method, calibrated: from numbers (P, …)."""
            if keys["method"] == "anatomical" and keys["bars"] == BARS[1]:
                share = 100.0 * covered.reshape(len(covered), -1).mean(axis=1)
                rows[name] += [
                    {"person": who, "walker": who, **keys, "covered_percent": float(value)}
                    for who, value in zip(model.people, share, strict=True)
                ]

        def add(name: str, covered: np.ndarray, half: np.ndarray, **keys: object) -> None:
            """A row for numbers (P, …): per cent covered, and mean half width."""
            axes = tuple(range(1, covered.ndim))
            share = people.mean(100.0 * covered.mean(axis=axes)).columns("covered_percent")
            width = {"half_width_mm": float(half.mean())}
            rows[name].append({**keys, **{c: float(v[0]) for c, v in share.items()}, **width})

        for m, method in enumerate(sweep.methods.tolist()):
            error, sd = np.abs(sweep.error_mm[m]), sweep.sd_mm[m]  # (P, A, 15, K)
            z = np.moveaxis(error / sd, 2, -1)  # (P, A, K, 15)
            learnt = anatomical.multipliers_without(z, anatomical.GROUP_OF_JOINT, LEVELS)
            textbook = np.broadcast_to(ndtri(0.5 + LEVELS / 2.0), learnt.shape)
            for kind, multipliers in zip(BARS, (textbook, learnt), strict=True):
                of_joint = multipliers[:, anatomical.GROUP_OF_JOINT]  # (P, 15, L)
                keys = {"method": method, "bars": kind}
                for number, level in enumerate(LEVELS):
                    half = of_joint[:, None, :, None, number] * sd
                    add("", error <= half, half, **keys, level_percent=100.0 * float(level))
                half = of_joint[:, None, :, None, LEVEL_95] * sd
                covered = error <= half
                for a, view in enumerate(sweep.view_angle_deg):
                    add("_views", covered[:, a], half[:, a], **keys, view_angle_deg=float(view))
                    add_walkers("_walkers_views", covered[:, a], **keys, view_angle_deg=float(view))
                for g, group in enumerate(groups):
                    of = g == anatomical.GROUP_OF_JOINT
                    add("_joints", covered[:, :, of], half[:, :, of], **keys, joint_group=group)
                    add_walkers("_walkers_joints", covered[:, :, of], **keys, joint_group=group)
                rows["_walkers"] += [
                    {
                        "person": who,
                        "walker": who,
                        **keys,
                        "covered_percent": 100.0 * float(covered[p].mean()),
                        "half_width_mm": float(half[p].mean()),
                        "rms_error_mm": float(np.sqrt((error[p] ** 2).mean())),
                    }
                    for p, who in enumerate(model.people)
                ]
        by = {
            "": ["method", "bars", "level_percent"],
            "_views": ["method", "bars", "view_angle_deg"],
            "_joints": ["method", "bars", "joint_group"],
            "_walkers": ["walker", "method", "bars"],
            "_walkers_views": ["walker", "method", "bars", "view_angle_deg"],
            "_walkers_joints": ["walker", "method", "bars", "joint_group"],
        }
        return {f"table{end}": tidy(rows[end], by=by[end]) for end in rows}

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """Reliability as computed and calibrated; 95 % bars by view: what they cover and how wide they are."""
        styles = {name: STYLES[name] for name in inputs.sweep.methods.tolist()}
        of = partial(Chart, by="method", styles=styles)
        covered = partial(of, y="covered_percent", label="covered by 95 % bars")
        level = partial(
            of, x="level_percent", y="covered_percent", x_label="level of the bars", label="covered",
            x_limits=(0.0, 100.0), limits=(0.0, 100.0), ticks=20, references=[Reference(slope=1.0)],
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
            "x_label": "people, least covered first",
            "x_unit": "%",
        }
        ideal = [Reference(y=95.0)]
        table = tables["table"][np.isclose(tables["table"]["level_percent"], 100.0 * LEVELS[LEVEL_95])]
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
            of(**views, y="half_width_mm", label="half width of 95 % bars", zero=True),
            covered(**people, title="95 % bars, person by person", references=ideal),
            of(**{**_SHARP, "table": sharp}, zero=True),
        ]
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"Positions at {inputs.sweep.error_mm.shape[-1]} instants of the periodic walk; calibrated:"
            " multipliers by joint group, learnt from all other people. Bands: 95 % over people.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], begin: Recorder) -> None:
        """One walker as a cloud: the truth, the most probable walker and samples of the posterior."""
        sweep, data = inputs.sweep, inputs.dataset
        sample = int(inputs.model.tested[sweep.sample_person])
        walker = data.coefficients[sample]
        angle = np.radians(SAMPLE_VIEW_DEG)
        seen = camera.project(walker, angle)
        seconds = 1.0 / float(data.frequency_hz[sample])
        times = np.arange(0.0, seconds, 1.0 / _PLAYED_HZ)
        index = {"time": times}
        original = fourier.synthesise(walker, 1.0 / seconds, times)
        ground = lift(original)

        def motion(missing: np.ndarray) -> np.ndarray:
            return fourier.synthesise(camera.combine(seen, missing, angle), 1.0 / seconds, times) + ground

        who = inputs.model.people[sweep.sample_person]
        with begin(
            f"\nThe walker shown is {who}, the one of median error, seen from {SAMPLE_VIEW_DEG:g}°. Thin: "
            f"{len(sweep.samples)} walkers drawn from the posterior; where they part, the image does not tell.\n",
        ) as rec:
            rec.skeleton("world/original", original + ground, WALKER15.bones, index=index)
            rec.skeleton(
                "world/reconstructed/anatomical",
                motion(sweep.estimate),
                WALKER15.bones,
                index=index,
                colour=STYLES["anatomical"].colour,
            )
            for number, missing in enumerate(sweep.samples, start=1):
                rec.skeleton(
                    f"world/posterior/sample_{number:02d}",
                    motion(missing),
                    WALKER15.bones,
                    index=index,
                    colour="sky",
                    thickness_mm=1.5,
                )
            rec.image_points(
                "image/observed",
                fourier.synthesise(seen, 1.0 / seconds, times),
                WALKER15.bones,
                index=index,
            )
            space = Space3D(name="truth, reconstruction and samples of the posterior")
            rec.blueprint(
                Columns(
                    space,
                    Image2D(name=f"observed at {SAMPLE_VIEW_DEG:g}°", beside=space),
                    Notes(),
                    shares=(4, 3, 2),
                ),
                playing=True,
            )
