"""Reconstruction errors and missing variance against view angle: zhang2007 figure 5, zhang2004 figure 4."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.clips.kinds import Walks
from pipeline.core import camera, fourier
from pipeline.palette import Style
from pipeline.scenes import Columns, Image2D, Notes, Rows, Space3D
from pipeline.seeding import derive_generator
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, lift, tidy
from pipeline.studies.replicated import SD, aggregate
from pipeline.studies.study import Figure, Recorder, Tables, Traits
from pipeline.studies.walks import methods
from pipeline.studies.walks.known_view import KnownView, KnownViewErrors
from pipeline.studies.walks.methods import AVERAGE_WALKER, PUBLISHED, VIEW
from pipeline.studies.walks.recomputed import recomputed
from pipeline.studies.walks.truth import along_table, truth_table

THIRTY_PERCENT = Reference(
    below="least_squares", percent="zhang2007_map_thirty_percent", label="30 % below I (published)"
)

_INSTANT = 0.25
"""Fraction of the gait cycle of the displayed posture, where the left ankle is farthest in front."""


RELATIVE = (0.01, 10.0)
"""Limits of the logarithmic axis of relative reconstruction errors."""

ERRORS = ["absolute_error_mm2", "relative_error"]
_SD = {
    "absolute_error_mm2": "absolute_error_sd_mm2",
    "relative_error": "relative_error_sd",
    "missing_variance_mm2": "missing_variance_sd_mm2",
}

Inputs = FigureInputs[FourierSamples, Eigenwalkers, KnownViewErrors]


class ViewErrors(Figure):
    """Figure of the reconstruction errors and the missing variance against view angle."""

    model = EigenwalkersModel
    sweep = KnownView
    traits = Traits(
        over_people=("table", "table_walkers", "table_coefficients"),
        abscissa="view_angle_deg",
        sequence="view_angle_deg",
    )

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table`` with errors by method and view, and further tables by walker, by joint, and with checks.

        ``table_people``: the same for every walker; ``table_walkers``: per walker and method, mean over views;
        ``table_summary``: mean, median and worst walker; ``table_joints``: per joint; ``table_coefficients``: how often
        they exceed the range of training; ``table_recomputed``: recomputed errors; ``table_truth``: checks of the
        walkers; ``table_along``: coefficients along the eigenvectors.  Baselines count as methods.
        """
        sweep, seed = inputs.sweep, inputs.experiment.seed
        people = _sides_at_random(sweep.rows, sweep.view_angle_deg, seed)
        walkers = people.groupby(["person", "walker", "method"], as_index=False)[ERRORS].mean()
        columns: dict[str, tuple[str, Any]] = {}
        for name in people.columns.difference(["person", "walker", "method", "view_angle_deg"], sort=False):
            columns |= {name: (name, "mean")} | ({_SD[name]: (name, SD)} if name in _SD else {})
        figure_tables = {
            "table": over_walkers(people, ["method", "view_angle_deg"], columns),
            "table_people": tidy(people, by=["walker", "method", "view_angle_deg"]),
            "table_walkers": tidy(walkers, by=["walker", "method"]),
            "table_summary": over_walkers(
                walkers,
                ["method"],
                {
                    f"{name}_mm2": ("absolute_error_mm2", how)
                    for name, how in {"mean": "mean", "median": "median", "worst": "max"}.items()
                },
            ),
            "table_coefficients": tidy(sweep.coefficients, by=["walker", "method"]),
            "table_joints": over_walkers(
                sweep.joints.dropna(),
                ["method", "joint"],
                {
                    "absolute_error_mm2": ("absolute_error_mm2", "mean"),
                    "absolute_error_median_mm2": ("absolute_error_mm2", "median"),
                    "absolute_error_worst_mm2": ("absolute_error_mm2", "max"),
                },
            ),
        }
        if inputs.model is not None:  # not for further populations
            model, options = (cast(Any, part) for part in (inputs.experiment.model, inputs.experiment.sweep))
            figure_tables["table_recomputed"] = recomputed(
                inputs.dataset, model, options, sweep.rows, inputs.model.kept
            )
            figure_tables["table_truth"] = truth_table(inputs.dataset, cast(Walks, inputs.clips))
            figure_tables["table_along"] = along_table(inputs.dataset, inputs.model)
        return figure_tables

    def arrays(self, inputs: Inputs) -> dict[str, np.ndarray]:
        """Return the Fourier representations of all walkers and the errors by joint, which the report reads.

        From the samples, the report computes every fold and reconstructs walks from any view.

        Errors by walker, method or baseline, and joint are included: means over views (R, M, 15), NaN if not measured.
        """
        data, joints = inputs.dataset, inputs.sweep.joints
        method_names = np.unique(joints["method"].to_numpy(dtype=str))
        return {
            "joint_error_methods": method_names,
            "joint_error_mm2": joints["absolute_error_mm2"]
            .to_numpy()
            .reshape(len(data.person), len(method_names), -1),
            "samples": inputs.model.samples,
            "residual_covariance_mm2": data.residual_covariance,
            "temporal_covariance_mm2": data.temporal_covariance,
            "walker_frequency_hz": data.frequency_hz,
            "person": data.person,
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the absolute error, relative error and variance of the missing dimension against view angle."""
        names = inputs.sweep.methods.tolist()
        view = partial(Chart, **VIEW, zero=True)
        styles = methods.styles(names)
        drawn_styles = {name: styles[name] for name in (*names, AVERAGE_WALKER.name)}
        error = partial(view, by="method", styles=drawn_styles)
        # The average walker scales the axes, which are then the same in both papers.
        average = tables["table"].query("method == 'average_walker'")["absolute_error_mm2"].max()
        absolute = error(
            limits=(0.0, 500.0 * np.ceil(1.5 * average / 500.0)),
            y="absolute_error_mm2",
            band="absolute_error_sd_mm2",
            label="mean square error",
            references=[THIRTY_PERCENT] if {*PUBLISHED} <= {*names} else [],
        )
        relative = error(y="relative_error", log_y=True, limits=RELATIVE, least=RELATIVE[0])
        variance = view(
            y="missing_variance_mm2",
            band="missing_variance_sd_mm2",
            where={"method": names[0]},  # the same for every method
            styles={"truth": Style("", "green")},
        )
        return Sheet(
            charts=[absolute, relative, variance],
            panel_size=(5.0, 2.0),
            caption="Light bands: ± standard deviation over walkers, as far as the axes go; bands:"
            f" {inputs.banded}. Average walker: its depth, the image kept.",
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record error curves over the view angle, and one walker, original and reconstructed, at each view angle."""
        sweep, data, model = inputs.sweep, inputs.dataset, inputs.model
        views, angles = np.rint(sweep.view_angle_deg).astype(int), np.radians(sweep.view_angle_deg)
        of_first = sweep.rows[sweep.rows["method"] == sweep.methods[0]]
        error = of_first.groupby("walker", sort=False)["absolute_error_mm2"].mean()
        walker = error.argsort().iloc[len(error) // 2]  # the median one
        options = inputs.experiment.sweep
        assert isinstance(options, KnownView)
        fold, walk = methods.held_out(data, model, int(walker), options.noise_variance_mm2)
        truth = data.coefficients[walker]
        instant = np.array([_INSTANT])
        posture = fourier.synthesise(truth, 1.0, instant)[0]
        ground = lift(posture)
        with begin(
            f"\nThe walker shown is {inputs.samples[walker]}, the one of median error. Drag the cursor: the image "
            "is what the camera at that angle sees, the coloured skeletons what each approach makes of it.\n",
            timeline="view_angle_deg",
            at=views,
        ) as rec:
            for method in methods.chosen(sweep.methods.tolist()):
                prepared_fold = replace(fold, prepared=method.prepared(data))
                postures = [
                    fourier.synthesise(camera.combine(camera.project(truth, a), missing, a), 1.0, instant)[0]
                    for a, missing in zip(
                        angles, method.apply(prepared_fold, walk, angles).missing, strict=True
                    )
                ]
                rec.skeleton(
                    f"world/reconstructed/{method.name}",
                    np.stack(postures) + ground,
                    colour=method.style.colour,
                )
            rec.skeleton(
                "world/original",
                np.repeat(posture[None] + ground, len(views), axis=0),
            )
            images = np.stack([camera.project(posture, a) for a in angles])
            rec.image_points("image/observed", images)
            space = Space3D(name="original and reconstructed")
            scene = Columns(space, Image2D(name="observed", next_to=space), shares=(3, 2))
            rec.blueprint(Columns(Rows(*rec.plots), Rows(scene, Notes(), shares=(8, 5))))


SIDES_AT_RANDOM = "_sides_at_random"


def over_walkers(rows: pd.DataFrame, by: list[str], columns: Mapping[str, tuple[str, Any]]) -> pd.DataFrame:
    """Return statistics over walkers for each group of table rows; means have confidence intervals over people."""
    banded = [
        name
        for name, (column, how) in columns.items()
        if how == "mean" and not column.endswith(SIDES_AT_RANDOM)
    ]
    return aggregate(rows, by, columns, banded, cluster="person", count="")


def _sides_at_random(rows: pd.DataFrame, views: np.ndarray, seed: int) -> pd.DataFrame:
    """Add columns of errors in which left and right views are exchanged for a random half of the people.

    Over view angle, these errors are symmetric except for chance.

    Nothing is added if the view angles are not symmetric.
    """
    if not np.allclose(views, -views[::-1]):
        return rows
    people, person = np.unique(rows["person"], return_inverse=True)
    generator = derive_generator(seed, f"sides of {people[0]} to {people[-1]}")
    exchanged = (generator.random(len(people)) < 0.5)[person]
    positions = np.arange(len(rows))
    mirrored = positions.reshape(-1, len(views))[:, ::-1].ravel()
    return rows.assign(
        **{
            name + SIDES_AT_RANDOM: rows[name].to_numpy()[np.where(exchanged, mirrored, positions)]
            for name in ("absolute_error_mm2", "missing_variance_mm2")
        }
    )
