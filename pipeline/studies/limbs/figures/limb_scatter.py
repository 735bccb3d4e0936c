"""Error of each trial against its reconstructibility: park2011 figure 3a."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Lines, Reference, Sheet
from pipeline.core.bootstrap import weighted_medians
from pipeline.core.limb_chain import WALKER14
from pipeline.core.reconstructibility import GREEN_ABOVE, MARGIN_GREEN_ABOVE, Reading
from pipeline.core.statistics import rank_correlation
from pipeline.palette import Style
from pipeline.scenes import Columns, Notes, Rows, Space3D
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.figures.presentation import (
    EYE_MM,
    LEAST,
    OUTSIDE,
    RADIUS_MM,
    increasing,
    path_bones,
    quartile_columns,
    sphere,
    trial_columns,
)
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.reconstructibility import (
    STARTS,
    LimbReconstructibilities,
    ReconstructibilitySweep,
)
from pipeline.studies.limbs.scores import SUCCESS
from pipeline.studies.presentation import interval_words
from pipeline.studies.replicated import interval_over_clusters
from pipeline.studies.study import Figure

if TYPE_CHECKING:
    from pipeline.recordings import Recorder

EDGES = (0.0, 0.8, 0.95, 1.05, 1.25, 2.0, 5.0, 1000.0)
"""Of the bins of reconstructibility; what is larger goes into the last one."""

WINDOW = 8
"""The running median is over the n / 8 trials that are nearest in rank, 5 at least."""

ROUNDING = 1e-8
"""Smallest to largest eigenvalue below which a matrix is singular: the root of the machine's precision, about."""

PUBLISHED = Reference(x="park2011_accuracy_is_high_above_one", label="η = 1")

RANGE = (1e-2, 1e3)
"""Of reconstructibility, as the recording shows it."""

PATHS = {"truth": ("green", 1.0), "impostor": ("orange", 1.0), "estimate": ("amber", OUTSIDE)}
"""Colour and scale of the paths in the recording, in the order of `LimbReconstructibilities.paths`."""

Inputs = FigureInputs[LimbStretches, BasisFit, LimbReconstructibilities]


@dataclass(kw_only=True)
class LimbScatter(Figure):
    """Error of each trial against reconstructibility."""

    model = TrajectoryBasisModel
    sweep = ReconstructibilitySweep

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: every trial; ``table_bins``, ``table_running``: of all cameras, over reconstructibility.

        ``table_correlation``: rank correlation of error and what might predict it; ``table_refinement``: of direct
        optimisation from other starts, ``table_starts``: its trials; ``table_matrices``: whether the programmes'
        matrices are positive definite.
        """
        sweep = inputs.sweep
        cameras, trials = sweep.limb_error.shape
        given = sweep.by(_options(inputs).reading).ravel()
        eta, error = np.minimum(given, EDGES[-1]), sweep.limb_error.ravel()
        scores = (
            "mirror_margin", "limb_error", "relative_error", "error_up_to_mirror", "proved", "objective",
            "lower_bound", "truth_objective", "impostor_objective", "confidence", "taken_impostor", "hanging_error",
            "mean_pose_error", "limb_error_shuffled", "positive_off_diagonal",
        )  # fmt: skip
        refined = sweep.refined_error.shape  # (C, R, 3)
        starts = {
            "start": STARTS,
            "limb_error_median": np.median(sweep.refined_error, axis=(0, 1)),
            "reprojection_error_px_median": np.median(sweep.refined_px, axis=(0, 1)),
            "converged_share": sweep.refined_converged.mean(axis=(0, 1)),
            "success": (sweep.refined_error < SUCCESS).mean(axis=(0, 1)),
            "trials": np.full(len(STARTS), sweep.refined_px[..., 0].size),
        }
        return {
            "table": tidy(
                {
                    **trial_columns(inputs.samples, sweep.stretch, sweep.limb, (cameras, trials)),
                    "camera": np.repeat(sweep.cameras, trials),
                    "reconstructibility": given,
                    "reconstructibility_angle": sweep.reconstructibility_angle.ravel(),
                    **{name: getattr(sweep, name).ravel() for name in scores},
                    "numerically_singular": (sweep.eigenvalue_ratio < ROUNDING).ravel(),
                },
                by=["camera", "trial"],
            ),
            "table_starts": tidy(
                {
                    "start": np.broadcast_to(STARTS, refined).ravel(),
                    "camera": np.broadcast_to(sweep.cameras[:, None, None], refined).ravel(),
                    "trial": np.broadcast_to(np.arange(refined[1])[:, None], refined).ravel(),
                    "clip": np.broadcast_to(
                        np.array(inputs.samples)[sweep.stretch[: refined[1]], None], refined
                    ).ravel(),
                    "limb_error": sweep.refined_error.ravel(),
                    "converged": sweep.refined_converged.ravel(),
                },
                by=["camera", "trial"],
            ),
            "table_bins": _bins(eta, error, sweep.taken_impostor.ravel()),
            "table_running": _running(eta, error, np.tile(np.array(inputs.samples)[sweep.stretch], cameras)),
            "table_correlation": _correlations(sweep),
            "table_refinement": pd.DataFrame(starts),
            "table_matrices": tidy(
                {
                    "camera": sweep.cameras,
                    "numerically_singular_share": (sweep.eigenvalue_ratio < ROUNDING).mean(axis=1),
                    "trials": np.full(cameras, trials),
                },
                by=["camera"],
            ),
        }

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """The error of every trial against reconstructibility and the mirror margin; the running median."""
        options = _options(inputs)
        table, correlation = tables["table"], tables["table_correlation"]
        cameras = [Camera(name) for name in inputs.sweep.cameras]
        reading = "" if options.reading is Reading.vector else " of angles, as printed"
        overall = correlation[correlation["camera"] == "all"].iloc[0]
        error: dict[str, Any] = {"label": "3D error / limb length", "log_x": True}
        trial = partial(
            Chart, **error, y="limb_error", by="camera", x_limits=RANGE, log_y=True, least=LEAST,
            styles={str(c): Style(c.words, c.colour, line="points") for c in cameras},
        )  # fmt: skip
        running: dict[str, Any] = {"table": "table_running", "x": "reconstructibility"}
        eta = f"reconstructibility η{reading}"
        quartiles = [
            Lines(
                **running, y=f"limb_error_{end}", styles={end: Style(f"{words} quartile", "grey", width=0.5)}
            )
            for end, words in (("low", "lower"), ("high", "upper"))
        ]
        median = {"median": Style("running median", "black", width=1.25)}
        charts = [
            trial(
                x="reconstructibility", x_label=eta, references=[PUBLISHED],
                also=[Lines(**running, y="limb_error_median", styles=median)],
            ),
            trial(
                x="mirror_margin", x_label="margin of the mirror J(−s) / J(s)",
                references=[Reference(x=MARGIN_GREEN_ABOVE, label="green above")],
            ),
            Chart(
                **error, **running, y="limb_error_median", x_label=eta, name="limb_error", zero=True, styles=median,
                also=quartiles, timeline="log10_eta_per_mille", picture=False, references=[PUBLISHED],
            ),
        ]  # fmt: skip
        green = table[table["confidence"] == "green"]
        right = (
            f": {100 * (green['limb_error'] < SUCCESS).mean():.0f} % of those {len(green)} err by less than {SUCCESS:g}"
            if len(green)
            else ""
        )
        words = interval_words(table["clip"].nunique(), of="running median", over="clips", bands="Band")
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"{options.trials} limbs, each before {len(cameras)} cameras at {options.distance_mm / 1000:g} m."
            f" Error: mean distance of relative trajectories over the limb's length. (a) {words} Rank correlation"
            f" {overall['spearman_vector']:.2f} (of angles, as printed: {overall['spearman_angle']:.2f}). (b)"
            f" What can be known without the truth; above {MARGIN_GREEN_ABOVE:g} a limb is called green{right}."
            f" {100 * table['proved'].mean():.1f} % of the programmes are proved to be solved.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], begin: Recorder) -> None:
        """Log the running median over log eta, and the limb at the cursor, a good and a bad one on their spheres."""
        sweep = inputs.sweep
        eta = np.clip(sweep.by(_options(inputs).reading), *RANGE).ravel()
        paths = RADIUS_MM * sweep.paths.reshape(eta.size, *sweep.paths.shape[2:])
        error = sweep.limb_error.ravel()
        at, rows = increasing(1000.0 * np.log10(eta))
        bones = path_bones(paths.shape[2])
        # The good one has the lowest error of those that are clearly reconstructible, or of all where none is.
        clear = eta >= min(GREEN_ABOVE, float(np.quantile(eta, 0.9)))
        shown = {
            "good": int(np.flatnonzero(clear)[np.argmin(error[clear])]),
            "impostor": int(np.argmax(error)),
        }

        def words(trial: int) -> str:
            camera, number = divmod(trial, sweep.limb_error.shape[1])
            return (
                f"{WALKER14.limbs[sweep.limb[number]]} of {inputs.samples[sweep.stretch[number]]}, "
                f"{Camera(sweep.cameras[camera]).words}, eta {eta[trial]:.2f}, error {error[trial]:.2f}, margin "
                f"{sweep.mirror_margin.ravel()[trial]:.2f} ({sweep.confidence.ravel()[trial]})"
            )

        with begin(
            "\nRelative trajectories on the sphere of their limb, which is drawn with a radius of one metre: "
            "green the truth, orange the impostor, amber the estimate, drawn "
            f"{100 * (OUTSIDE - 1):.0f} % outside.\n\n- good: {words(shown['good'])}\n- impostor: "
            f"{words(shown['impostor'])}\n- at the cursor: the trial with that reconstructibility.\n\n"
            "The cursor counts 1000 log10 of eta: 0 is eta = 1, 301 is 2, 1000 is 10.\n",
            timeline="log10_eta_per_mille",
        ) as rec:
            globe, wires = sphere()
            first = {"log10_eta_per_mille": at[:1]}
            for where, chosen in {**{k: np.array([v]) for k, v in shown.items()}, "cursor": rows}.items():
                index = {"log10_eta_per_mille": at} if where == "cursor" else first
                for part, (name, (colour, scale)) in enumerate(PATHS.items()):
                    rec.skeleton(
                        f"world/{where}/{name}",
                        scale * paths[chosen, part],
                        bones,
                        index=index,
                        colour=colour,
                        thickness_mm=6.0,
                    )
                rec.skeleton(f"world/{where}/sphere", globe, wires, index=first, thickness_mm=1.0)
            spaces = [
                Space3D(name=name, origin=f"world/{where}", eye_mm=EYE_MM, target_mm=(0.0, 0.0, 0.0))
                for where, name in (
                    ("good", "a good one"),
                    ("impostor", "the impostor taken"),
                    ("cursor", "at the cursor"),
                )
            ]
            below = Columns(*rec.plots, Notes(), shares=(2, 1))
            rec.blueprint(Rows(Columns(*spaces), below, shares=(3, 2)))


def _options(inputs: Inputs) -> ReconstructibilitySweep:
    return cast(ReconstructibilitySweep, inputs.experiment.sweep)


def _bins(eta: np.ndarray, error: np.ndarray, impostor: np.ndarray) -> pd.DataFrame:
    """One row to each bin that has trials."""
    number = np.minimum(np.searchsorted(EDGES, eta, side="right"), len(EDGES) - 1)
    edges = {
        "reconstructibility_from": np.take(EDGES, number - 1),
        "reconstructibility_to": np.take(EDGES, number),
    }
    trials = pd.DataFrame({**edges, "error": error, "found": error < SUCCESS, "impostor": impostor})
    bins = trials.groupby(list(edges)).agg(
        trials=("error", "size"),
        **quartile_columns("limb_error", "error"),
        success=("found", "mean"),
        taken_impostor=("impostor", "mean"),
    )
    return bins.reset_index()


def _running(values: np.ndarray, error: np.ndarray, clip: np.ndarray) -> pd.DataFrame:
    """Median and quartiles of the error of the trials that are nearest in rank, at every trial.

    The interval of the median is over the clips that these trials are of.
    """
    order = np.argsort(values, kind="stable")
    count = len(values)
    width = min(count, max(5, count // WINDOW))
    starts = np.clip(np.arange(count) - width // 2, 0, count - width)
    rows = order[starts[:, None] + np.arange(width)]
    low, middle, high = np.quantile(error[rows], [0.25, 0.5, 0.75], axis=1)
    # Neighbours share their trials at both ends.
    windows, window = np.unique(starts, return_inverse=True)
    ends = [
        interval_over_clusters(clip[at], error[at], weighted_medians)
        for at in (order[start : start + width] for start in windows)
    ]
    median_low, median_high = np.array(ends)[window].T
    return pd.DataFrame(
        {
            "reconstructibility": values[order],
            "limb_error_median": middle,
            "limb_error_low": low,
            "limb_error_high": high,
            "limb_error_median_low": median_low,
            "limb_error_median_high": median_high,
        }
    )


def _correlations(sweep: LimbReconstructibilities) -> pd.DataFrame:
    """One row to each camera, and one to all."""
    predictors = {
        "spearman_vector": sweep.reconstructibility_vector,
        "spearman_angle": sweep.reconstructibility_angle,
        "spearman_margin": sweep.mirror_margin,
    }
    rows: list[dict[str, Any]] = []
    for camera in [*map(str, sweep.cameras), "all"]:
        here = (sweep.cameras == camera) | (camera == "all")
        error = sweep.limb_error[here].ravel()
        rows.append(
            {
                "camera": camera,
                **{name: rank_correlation(by[here].ravel(), error) for name, by in predictors.items()},
                "success": (error < SUCCESS).mean(),
                "success_up_to_mirror": (sweep.error_up_to_mirror[here] < SUCCESS).mean(),
                "trials": error.size,
            }
        )
    return pd.DataFrame(rows).sort_values("camera", ignore_index=True)
