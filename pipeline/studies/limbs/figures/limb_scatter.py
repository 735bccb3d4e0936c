"""Error of each trial against its reconstructibility: park2011 figure 3a."""

from __future__ import annotations

from functools import partial
from typing import Any, cast

import numpy as np
import pandas as pd

from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.core.bootstrap import weighted_medians
from pipeline.core.reconstructibility import GREEN_ABOVE, MARGIN_GREEN_ABOVE, Reading
from pipeline.core.statistics import rank_correlation
from pipeline.palette import CONFIDENCES, Style
from pipeline.scenes import Columns, Notes, Rows, Space3D
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.figures.limb_on_sphere import EYE_MM, OUTSIDE, RADIUS_MM, path_bones, sphere
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.reconstructibility import (
    LimbReconstructibilities,
    ReconstructibilitySweep,
)
from pipeline.studies.limbs.scores import MIN_DRAWN, SUCCESS
from pipeline.studies.replicated import interval_over_clusters, interval_words
from pipeline.studies.study import Figure, Recorder, Tables

MAX_RECONSTRUCTIBILITY = 1000.0
"""Upper limit of reconstructibility in tables; it is infinite if the basis contains the true trajectory."""

WINDOW = 8
"""Divisor of the number of trials; the quotient is the width of the running median's window, in trials."""

PUBLISHED = Reference(x="park2011_accuracy_is_high_above_one", label="η = 1")

RANGE = (1e-2, 1e3)
"""Range of reconstructibility that the axes of the charts show."""

PATHS = {"original": ("green", 1.0), "impostor": ("orange", 1.0), "reconstructed": ("amber", OUTSIDE)}
"""Colour and relative radius of each path on the sphere in the recording: true, mirrored and reconstructed."""

Inputs = FigureInputs[LimbStretches, BasisFit, LimbReconstructibilities]


DECIDED = CONFIDENCES["green"]


class LimbScatter(Figure):
    """Figure of the error of each trial against its reconstructibility."""

    model = TrajectoryBasisModel
    sweep = ReconstructibilitySweep

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table`` with every trial, and ``table_running`` with the running median of the errors.

        ``table_correlation``: rank correlation of the error with its predictors; ``table_refinement``: direct
        optimisation from other starts; ``table_starts``: its trials.
        """
        rows, starts = inputs.sweep.rows, inputs.sweep.starts
        eta = rows["reconstructibility"].clip(upper=MAX_RECONSTRUCTIBILITY).to_numpy()
        error = rows["limb_error"].to_numpy()
        refinement = starts.groupby("start", sort=False).agg(
            limb_error_median=("limb_error", "median"),
            reprojection_error_px_median=("reprojection_error_px", "median"),
            converged_share=("converged", "mean"),
            success=("limb_error", lambda errors: (errors < SUCCESS).mean()),
            trials=("limb_error", "size"),
        )
        return {
            "table": tidy(rows.drop(columns="reconstructibility_vector"), by=["camera", "trial"]),
            "table_starts": tidy(starts.drop(columns="reprojection_error_px"), by=["camera", "trial"]),
            "table_running": _running(eta, error, rows["clip"].to_numpy()),
            "table_correlation": _correlations(rows),
            "table_refinement": refinement.reset_index(),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the limb error against reconstructibility and mirror margin, and of its running median."""
        options = _options(inputs)
        table, correlation = tables["table"], tables["table_correlation"]
        cameras = options.cameras
        reading = "" if options.reading is Reading.vector else " of angles, as printed"
        overall = correlation[correlation["camera"] == "all"].iloc[0]
        error: dict[str, Any] = {"label": "3D error / limb length"}
        trial = partial(
            Chart, **error, y="limb_error", by="camera", log_y=True, least=MIN_DRAWN,
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
                x="reconstructibility", abscissa=Axis(label=eta, log=True, limits=RANGE), references=[PUBLISHED],
                also=[Lines(**running, y="limb_error_median", styles=median)],
            ),
            trial(
                x="mirror_margin", abscissa=Axis(label="margin of the mirror J(−s) / J(s)", log=True, limits=RANGE),
                references=[Reference(x=MARGIN_GREEN_ABOVE, label=f"{DECIDED} above")],
            ),
            Chart(
                **error, **running, y="limb_error_median", abscissa=Axis(label=eta, log=True), name="limb_error",
                log_y=True, least=MIN_DRAWN, styles=median,
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
            f" What can be known without the truth; above {MARGIN_GREEN_ABOVE:g} a limb counts as {DECIDED}{right}."
            f" {100 * table['proved'].mean():.1f} % of the programmes are proved to be solved.",
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record the running median of the error against log eta, and the paths of three limbs on spheres."""
        trials = inputs.sweep.rows
        eta = trials["reconstructibility"].clip(*RANGE).to_numpy()
        paths, error = RADIUS_MM * inputs.sweep.paths, trials["limb_error"].to_numpy()
        at, rows = increasing(1000.0 * np.log10(eta))
        bones = path_bones(paths.shape[2])
        # The good limb has the lowest error among the clearly reconstructible ones, or among the top tenth.
        clear = eta >= min(GREEN_ABOVE, np.quantile(eta, 0.9))
        examples = {
            "good": np.flatnonzero(clear)[np.argmin(error[clear])],
            "impostor": np.argmax(error),
        }

        def words(number: int) -> str:
            trial = trials.iloc[number]
            return (
                f"{trial['limb']} of {trial['clip']}, {Camera(trial['camera']).words}, eta {eta[number]:.2f}, error "
                f"{error[number]:.2f}, margin {trial['mirror_margin']:.2f} ({CONFIDENCES[trial['confidence']]})"
            )

        with begin(
            "\nRelative trajectories on the sphere of their limb, which is drawn with a radius of "
            f"{RADIUS_MM / 1000.0:g} m: {PATHS['original'][0]} the truth, {PATHS['impostor'][0]} the impostor, "
            f"{PATHS['reconstructed'][0]} the estimate, drawn "
            f"{100 * (OUTSIDE - 1):.0f} % outside.\n\n- good: {words(examples['good'])}\n- impostor: "
            f"{words(examples['impostor'])}\n- at the cursor: the trial with that reconstructibility.\n\n"
            "The cursor counts thousandths of log10 of eta: "
            f"{1000.0 * np.log10(GREEN_ABOVE):.0f} is {GREEN_ABOVE:g}.\n",
            timeline="log10_eta_per_mille",
        ) as rec:
            globe, wires = sphere()
            for where, selected in {
                **{k: np.array([v]) for k, v in examples.items()},
                "cursor": rows,
            }.items():
                for part, (name, (colour, scale)) in enumerate(PATHS.items()):
                    rec.skeleton(
                        f"world/{where}/{name}",
                        scale * paths[selected, part],
                        bones,
                        at=at if where == "cursor" else at[:1],
                        colour=colour,
                        thickness_mm=6.0,
                    )
                rec.skeleton(f"world/{where}/sphere", globe, wires, at=at[:1], thickness_mm=1.0)
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


def _running(values: np.ndarray, error: np.ndarray, clip: np.ndarray) -> pd.DataFrame:
    """Running median and quartiles of the error, over a moving window of trials sorted by reconstructibility.

    The interval of the median is over the clips of these trials.
    """
    order = np.argsort(values, kind="stable")
    count = len(values)
    width = min(count, max(5, count // WINDOW))
    starts = np.clip(np.arange(count) - width // 2, 0, count - width)
    rows = order[starts[:, None] + np.arange(width)]
    low, middle, high = np.quantile(error[rows], [0.25, 0.5, 0.75], axis=1)
    # Trials near either end have the same window.
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


def _correlations(rows: pd.DataFrame) -> pd.DataFrame:
    """Table of rank correlations and shares of successful trials, with a row for each camera and for all."""
    predictors = {
        "spearman_vector": "reconstructibility_vector",
        "spearman_angle": "reconstructibility_angle",
        "spearman_margin": "mirror_margin",
    }
    return pd.DataFrame(
        {
            "camera": camera,
            **{
                name: rank_correlation(trials[by].to_numpy(), trials["limb_error"].to_numpy())
                for name, by in predictors.items()
            },
            "success": (trials["limb_error"] < SUCCESS).mean(),
            "success_up_to_mirror": (trials["error_up_to_mirror"] < SUCCESS).mean(),
            "trials": len(trials),
        }
        for camera, trials in sorted([("all", rows), *rows.groupby("camera")], key=lambda pair: pair[0])
    )


def increasing(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct rounded values in increasing order, and for each the index of its first occurrence."""
    order = np.argsort(values, kind="stable")
    rounded, first = np.unique(np.rint(values[order]).astype(int), return_index=True)
    return rounded, order[first]
