"""Errors and missing variance against view angle: zhang2007 figure 5, zhang2004 figure 4."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.core import camera, errors, fourier
from pipeline.core.reconstruction import from_known_views
from pipeline.palette import Style
from pipeline.scenes import Columns, Image2D, Notes, Rows, Space3D
from pipeline.seeding import derive_generator
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.presentation import lift
from pipeline.studies.replicated import interval_over_people
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_method import AnatomicalApproach
from pipeline.studies.walks.figures.presentation import CURVES, METHODS, VIEW
from pipeline.studies.walks.known_view import KnownView, KnownViewErrors

if TYPE_CHECKING:
    from pipeline.recordings import Recorder

THIRTY_PERCENT = Reference(
    below="least_squares", percent="zhang2007_map_thirty_percent", label="30 % below I (published)"
)

_INSTANT = 0.25
"""Fraction of the cycle at which the recording shows the walker: the left ankle is farthest ahead of the right."""


Inputs = FigureInputs[FourierSamples, Eigenwalkers, KnownViewErrors]


@dataclass(kw_only=True)
class ViewErrors(Figure):
    """Errors and missing variance against view angle."""

    model = EigenwalkersModel
    sweep = KnownView
    over_people = ("table", "table_walkers", "table_coefficients")
    sequence = "view_angle_deg"

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``, per method and view, and the tables beside it.

        ``table_people``: the same of every walker; ``table_walkers``: per walker and method, mean over views;
        ``table_summary``: mean, median and worst walker; ``table_joints``: per joint; ``table_coefficients``: how often
        they leave the range of training; ``table_sources``, of data from several sources: learnt from people of the
        others.  The nulls are methods like the approaches.
        """
        sweep = inputs.sweep
        names = [*sweep.methods.tolist(), *sweep.nulls.tolist()]
        per_joint = np.concatenate([sweep.absolute_error_mm2, sweep.null_error_mm2])
        absolute = errors.walker_error(per_joint)
        relative = errors.walker_error(np.concatenate([sweep.relative_error, sweep.null_relative_error]))
        variance = np.tile(sweep.missing_variance_mm2, (len(names), 1, 1))
        averaged = {
            "absolute_error_mm2": absolute,
            "rms_error_mm": np.sqrt(absolute),
            "relative_error": relative,
            "missing_variance_mm2": variance,
            **_sides_at_random(inputs, absolute_error_mm2=absolute, missing_variance_mm2=variance),
        }
        walks = absolute.mean(axis=2)
        made = {
            "table": _over_walkers(inputs, names, averaged),
            "table_people": _every_walker(inputs, names, averaged),
            "table_walkers": _walkers(inputs, names, walks, relative.mean(axis=2)),
            "table_summary": tidy(
                {"method": names, **summary_over_walkers(inputs.dataset.person, walks)}, by=["method"]
            ),
            "table_coefficients": _coefficients(inputs),
            "table_joints": _joints(inputs, names, per_joint),
        }
        if sweep.other_source_error_mm2 is not None:
            made["table_sources"] = _sources(inputs, sweep.other_source_error_mm2, walks)
        return made

    def arrays(self, inputs: Inputs) -> dict[str, np.ndarray]:
        """Return the walkers themselves: the report makes each fold of them, and reconstructs from any view."""
        data = inputs.dataset
        return {
            "samples": inputs.model.samples,
            "residual_covariance_mm2": data.residual_covariance,
            "temporal_covariance_mm2": data.temporal_covariance,
            "walker_frequency_hz": data.frequency_hz,
            "person": data.person,
        }

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """Absolute error, relative error, variance of the missing dimension."""
        first = str(inputs.sweep.methods[0])
        view = partial(Chart, **VIEW, zero=True)
        shown = {name: CURVES[name] for name in (*map(str, inputs.sweep.methods), "average_walker")}
        error = partial(view, by="method", styles=shown)
        absolute = error(
            y="absolute_error_mm2",
            band="absolute_error_sd_mm2",
            label="mean square error",
            references=[THIRTY_PERCENT] if {*METHODS} <= {*inputs.sweep.methods.tolist()} else [],
        )
        relative = error(y="relative_error", band="relative_error_sd")
        variance = view(
            y="missing_variance_mm2",
            band="missing_variance_sd_mm2",
            label="missing variance",
            where={"method": first},  # the same for every method
            styles={"truth": Style("", "green")},
        )
        return Sheet(
            charts=[absolute, relative, variance],
            caption="Light bands: ±1 standard deviation over walkers, as far as the axes go; bands: 95 %"
            " interval of the"
            " mean over people. Average walker: its depth, the image kept.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], begin: Recorder) -> None:
        """The curves over view angle; one walker, seen and reconstructed from the angle at the cursor."""
        sweep, data, model = inputs.sweep, inputs.dataset, inputs.model
        views, angles = np.rint(sweep.view_angle_deg).astype(int), np.radians(sweep.view_angle_deg)
        absolute = errors.walker_error(sweep.absolute_error_mm2)
        walker = int(np.argsort(absolute[0].mean(axis=1))[absolute.shape[1] // 2])  # the median one
        fold = model.fold(walker)
        truth = data.coefficients[walker]
        index = {"view_angle_deg": views}
        instant = np.array([_INSTANT])
        posture = fourier.synthesise(truth, 1.0, instant)[0]
        ground = lift(posture)
        with begin(
            f"\nThe walker shown is {inputs.samples[walker]}, the one of median error. Drag the cursor: the image "
            "is what the camera at that angle sees, the coloured skeletons what each approach makes of it.\n",
            timeline="view_angle_deg",
        ) as rec:
            for method in sweep.methods.tolist():
                if method == "anatomical":
                    found = AnatomicalApproach(data).reconstruct(walker, angles, fold).missing
                else:
                    noise = sweep.noise_variance_mm2 if method == "map" else None
                    found = from_known_views(
                        fold, model.samples[walker], angles, noise_variance=noise
                    ).missing
                again = [
                    fourier.synthesise(camera.combine(camera.project(truth, a), missing, a), 1.0, instant)[0]
                    for a, missing in zip(angles, found, strict=True)
                ]
                rec.skeleton(
                    f"world/reconstructed/{method}",
                    np.stack(again) + ground,
                    WALKER15.bones,
                    index=index,
                    colour=CURVES[method].colour,
                )
            rec.skeleton(
                "world/original",
                np.repeat(posture[None] + ground, len(views), axis=0),
                WALKER15.bones,
                index=index,
            )
            seen = np.stack([camera.project(posture, a) for a in angles])
            rec.image_points("image/observed", seen, WALKER15.bones, index=index)
            space = Space3D(name="original and reconstructed")
            scene = Columns(space, Image2D(name="observed", beside=space), shares=(3, 2))
            rec.blueprint(Columns(Rows(*rec.plots), Rows(scene, Notes(), shares=(3, 1))))


def summary_over_walkers(person: np.ndarray, values: np.ndarray) -> dict[str, np.ndarray]:
    """Return mean with interval, median and worst (M,) over walkers of errors (M, R), mm²."""
    low, high = interval_over_people(person, values.T)
    return {
        "mean_mm2": values.mean(axis=1),
        "mean_mm2_low": low,
        "mean_mm2_high": high,
        "median_mm2": np.median(values, axis=1),
        "worst_mm2": values.max(axis=1),
    }


def _over_walkers(inputs: Inputs, names: list[str], averaged: dict[str, np.ndarray]) -> pd.DataFrame:
    """Mean over walkers of each quantity (M, R, A), with its interval, and standard deviations."""
    columns: dict[str, np.ndarray] = {
        "method": np.array(names)[:, None],
        "view_angle_deg": inputs.sweep.view_angle_deg,
    }
    deviations = {
        "absolute_error_mm2": "absolute_error_sd_mm2",
        "relative_error": "relative_error_sd",
        "missing_variance_mm2": "missing_variance_sd_mm2",
    }
    for name, values in averaged.items():
        columns[name] = values.mean(axis=1)
        if name in deviations:
            columns[deviations[name]] = sd(values, 1)
        if not name.endswith(SIDES_AT_RANDOM):
            low, high = interval_over_people(inputs.dataset.person, np.swapaxes(values, 0, 1))
            columns |= {f"{name}_low": low, f"{name}_high": high}
    return tidy(columns, by=["method", "view_angle_deg"])


def _every_walker(inputs: Inputs, names: list[str], averaged: dict[str, np.ndarray]) -> pd.DataFrame:
    """Each quantity (M, R, A) of every walker."""
    return tidy(
        {
            "person": inputs.dataset.person[:, None],
            "walker": np.array(inputs.samples)[:, None],
            "method": np.array(names)[:, None, None],
            "view_angle_deg": inputs.sweep.view_angle_deg,
            **averaged,
        },
        by=["walker", "method", "view_angle_deg"],
    )


SIDES_AT_RANDOM = "_sides_at_random"


def _sides_at_random(inputs: Inputs, **curves: np.ndarray) -> dict[str, np.ndarray]:
    """Curves (M, R, A) over view angle, left and right exchanged for half of the people: symmetric but for chance.

    None if the view angles are not symmetric.
    """
    views = inputs.sweep.view_angle_deg
    if not np.allclose(views, -views[::-1]):
        return {}
    people, person = np.unique(inputs.dataset.person, return_inverse=True)
    generator = derive_generator(inputs.experiment.seed, f"sides of {people[0]} to {people[-1]}")
    exchanged = (generator.random(len(people)) < 0.5)[person]
    return {
        name + SIDES_AT_RANDOM: np.where(exchanged[:, None], values[..., ::-1], values)
        for name, values in curves.items()
    }


def _walkers(inputs: Inputs, names: list[str], absolute: np.ndarray, relative: np.ndarray) -> pd.DataFrame:
    """Mean over views of the errors (M, R) of every walker."""
    return tidy(
        {
            "person": inputs.dataset.person,
            "walker": inputs.samples,
            "method": np.array(names)[:, None],
            "absolute_error_mm2": absolute,
            "relative_error": relative,
        },
        by=["walker", "method"],
    )


def _coefficients(inputs: Inputs) -> pd.DataFrame:
    """How often coefficients leave the range of training: those found, and those of the walker seen whole."""
    sweep = inputs.sweep
    return tidy(
        {
            "person": inputs.dataset.person,
            "walker": inputs.samples,
            "method": sweep.methods[:, None],
            "coefficients_beyond": sweep.coefficients_beyond,
            "own_coefficients_beyond": sweep.own_coefficients_beyond,
            "views_far_beyond": sweep.views_far_beyond,
            "own_far_beyond": sweep.own_far_beyond,
        },
        by=["walker", "method"],
    )


def _joints(inputs: Inputs, names: list[str], per_joint: np.ndarray) -> pd.DataFrame:
    """Mean over walkers and views of the errors (M, R, A, 15) of every joint, with its interval over people."""
    values = per_joint.mean(axis=2)
    low, high = interval_over_people(inputs.dataset.person, np.swapaxes(values, 0, 1))
    return tidy(
        {
            "method": np.array(names)[:, None],
            "joint": WALKER15.joints,
            "absolute_error_mm2": values.mean(axis=1),
            "absolute_error_mm2_low": low,
            "absolute_error_mm2_high": high,
            "absolute_error_median_mm2": np.median(values, axis=1),
            "absolute_error_worst_mm2": values.max(axis=1),
        },
        by=["method", "joint"],
    )


def _sources(inputs: Inputs, others: np.ndarray, own: np.ndarray) -> pd.DataFrame:
    """Errors of the people of each source, learnt from other sources (M + 1, R) and from all (M + K, R)."""
    methods = [*inputs.sweep.methods.tolist(), "average_walker"]
    rows = []
    for source in np.unique(inputs.dataset.source):
        here = inputs.dataset.source == source
        for learnt_from, values in (("other sources", others), ("all", own)):
            summary = summary_over_walkers(inputs.dataset.person[here], values[: len(methods), here])
            for number, method in enumerate(methods):
                rows.append(
                    {
                        "source": source,
                        "learnt_from": learnt_from,
                        "method": method,
                        "walkers": int(here.sum()),
                        **{name: column[number] for name, column in summary.items()},
                    }
                )
    return pd.DataFrame(rows)
