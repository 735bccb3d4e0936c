"""Error bars against the truth: our figure of zhang2007, which gives none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import ndtri

from pipeline import pictures, recordings
from pipeline.core import anatomical, camera, fourier
from pipeline.seeding import derive_generator
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.presentation import lift
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.presentation import VIEW_AXIS
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.coverage import SAMPLE_VIEW_DEG, Bars, Coverage
from pipeline.studies.walks.sweeps.held_out import BARS
from pipeline.studies.walks.sweeps.ladder import STYLES

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, Bars]

LEVELS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99])
LEVEL_95 = 10
_PLAYED_HZ = 25.0


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

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Reliability as computed and calibrated; 95 % bars by view: what they cover and how wide they are."""
        styles = {name: STYLES[name] for name in inputs.sweep.methods.tolist()}
        diagonal = pictures.Series(
            x=np.array([0.0, 100.0]), y=np.array([0.0, 100.0]), colour="reference", width=0.6
        )
        reliability = [
            pictures.Panel(
                y="covered_percent",
                band=("covered_percent_low", "covered_percent_high"),
                x="level_percent",
                where={"bars": kind},
                series=[diagonal],
                title=kind,
                xlabel="Nominal (%)",
                ylabel="Covered (%)",
                xlim=(0.0, 100.0),
                xticks=20,
                ylim=(0.0, 100.0),
            )
            for kind in BARS
        ]
        views = tables["table_views"]
        views = views[views["bars"] == "calibrated"]
        walkers = tables["table_walkers"]
        walkers = walkers[walkers["bars"] == "calibrated"].sort_values(["method", "covered_percent"])
        rank = walkers.groupby("method").cumcount() + 1
        share = 100.0 * (rank - 0.5) / len(inputs.model.people)

        def of(table: pd.DataFrame, x: str, y: str) -> list[pictures.Series]:
            return pictures.series(table, x=x, y=y, by="method", styles=styles)

        panels = [
            *reliability,
            pictures.Panel(
                series=of(views, "view_angle_deg", "covered_percent"),
                title="95 % bars, calibrated",
                xlabel=VIEW_AXIS,
                ylabel="Covered (%)",
                xticks=30,
                ylim=(85.0, 100.0),
                references=[("y", 95.0, "")],
            ),
            pictures.Panel(
                series=of(views, "view_angle_deg", "half_width_mm"),
                title="95 % bars, calibrated",
                xlabel=VIEW_AXIS,
                ylabel="Half width (mm)",
                xticks=30,
                from_zero=True,
            ),
            pictures.Panel(
                series=of(walkers.assign(share=share), "share", "covered_percent"),
                title="95 % bars, person by person",
                xlabel="People, least covered first (%)",
                ylabel="Covered (%)",
                xlim=(0.0, 100.0),
                references=[("y", 95.0, "")],
            ),
            pictures.Panel(
                series=self._sharpness(tables, styles),
                title="Coverage and width",
                xlabel="Covered by 95 % bars as computed (%)",
                ylabel="Half width, calibrated (mm)",
                from_zero=True,
            ),
        ]
        pictures.draw_lines(
            stem,
            panels,
            tables["table"],
            by="method",
            styles=styles,
            columns=2,
            legend="figure",
            caption=f"{inputs.caption} Positions at {inputs.sweep.error_mm.shape[-1]} instants of the periodic walk;"
            " calibrated: multipliers by joint group, learnt from all other people. Bands: 95 % over people.",
        )

    @staticmethod
    def _sharpness(
        tables: dict[str, pd.DataFrame], styles: Mapping[str, pictures.Style]
    ) -> list[pictures.Series]:
        """A point to each method: what its bars as computed cover, and how wide they must be to be right."""
        table = tables["table"]
        at = table[np.isclose(table["level_percent"], 95.0)].set_index(["method", "bars"])
        return [
            pictures.Series(
                x=np.array([float(at.at[(name, BARS[0]), "covered_percent"])]),
                y=np.array([float(at.at[(name, BARS[1]), "half_width_mm"])]),
                colour=style.colour,
                line="points",
            )
            for name, style in styles.items()
        ]

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
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
        with inputs.recording(
            folder,
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
            space = recordings.Space3D(name="truth, reconstruction and samples of the posterior")
            rec.blueprint(
                recordings.Columns(
                    space,
                    recordings.Image2D(name=f"observed at {SAMPLE_VIEW_DEG:g}°", beside=space),
                    recordings.Notes(),
                    shares=(4, 3, 2),
                ),
                playing=True,
            )
