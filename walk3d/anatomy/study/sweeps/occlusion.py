"""Reconstruction of joints that are hidden in the image, together with the depth of the visible joints.

The letter mentions this as an outlook: "the same approach could recover occluded markers" (zhang2007, section 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.core import errors
from pipeline.processes import map_processes
from pipeline.skeleton import WALKER15
from pipeline.studies.study import Sweep, Swept, scaled
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.study.model import AnatomicalInputs
from walk3d.anatomy.study.sweeps.held_out import (
    BARS,
    NOISE_VARIANCES_MM2,
    NORMAL_95,
    PARTNERS,
    PHASES,
    Choosers,
    People,
)
from walk3d.anatomy.study.sweeps.setting import anatomical_setting

HIDDEN = {
    "pelvis": ("pelvis",),
    "head": ("head",),
    "feet": ("left_ankle", "right_ankle"),
    "far_arm": ("left_elbow", "left_wrist"),
    "far_leg": ("left_knee", "left_ankle"),
    "far_side": ("left_elbow", "left_wrist", "left_knee", "left_ankle"),
}
"""Sets of joints that are hidden in the image, one set at a time.

Views are from the right, so the left side is the far one.  The centre of the pelvis is inside the body.
"""

METHODS = ("average_walker", "map_tuned", "anatomical")
WITH_BARS = METHODS[1:]
AXES = ("across", "up", "away")
"""Names of the image axes.

Only hidden joints are unknown along the axes across and up.
"""
LEVEL = 0.95


@dataclass(frozen=True)
class HiddenJoints:
    """Errors of hidden joints in 3D, errors of visible joints in the missing dimension, and error bars.

    Attributes
    ----------
    rows : DataFrame
        Root mean square distance of the hidden joints over the cycle, and E_abs of the visible joints, by set of hidden
        joints, method, person and view.
    bars : DataFrame
        Coverage and mean half width of 95 % bars of the hidden joints' coordinates, by set, method, kind of bars,
        person and axis, over all views.
    """

    rows: pd.DataFrame
    bars: pd.DataFrame


class Occlusion(Sweep):
    """Sweep over known view angles that reconstructs walks with hidden joints."""

    seen_from_deg: Swept = scaled(start=0, stop=90, step={"full": 30, "smoke": 90})  # true views
    partners: Choosers = scaled(value=PARTNERS)  # number of other people for the selection of sigma² of MAP

    def measure(self, inputs: AnatomicalInputs) -> HiddenJoints:
        """Return the errors and the coverage of error bars of every method, for each set of hidden joints."""
        view_deg = self.seen_from_deg.values("sweep.seen_from_deg")
        view = np.radians(view_deg)
        people = People(inputs.dataset, inputs.model)
        whole = anatomical_setting(inputs.model_options, people.harmonics)
        tuned = people.tuned_map(NOISE_VARIANCES_MM2[1:-1], self.partners, inputs.workers)
        masks = [np.isin(WALKER15.joints, names) for names in HIDDEN.values()]
        weights = errors.parseval_weights(1 + 2 * people.harmonics)

        def person_errors(person: int) -> list[tuple[np.ndarray, np.ndarray]]:
            fold = people.fold(person)
            walker = people.walker(person)
            settings = (tuned[person], tuned[person], whole)
            results = []
            for hidden in masks:
                square, bars = [], []
                for method, setting in zip(METHODS, settings, strict=True):
                    (estimate,) = fold.reconstruct(
                        [setting], walker[None], view, hidden=hidden, with_covariance=method in WITH_BARS
                    )
                    off = np.zeros((len(view), anatomical.JOINTS, 3, 1 + 2 * setting.harmonics))
                    flat = off.reshape(len(view), -1)
                    estimated = estimate.estimated[:, 0]
                    if method == "average_walker":
                        conditional = fold.conditional(setting, view, hidden)
                        estimated = conditional.mean[:, conditional.unknown]
                    flat[:, estimate.unknown] = estimate.true[:, 0] - estimated
                    more = people.in_image_axes(person, view)[..., off.shape[-1] :].copy()
                    more[:, ~hidden, :2] = 0.0
                    error = np.concatenate([off, more], axis=-1)
                    power = (error**2) @ weights + people.beyond_in_space(person, view)  # (A, 15, 3)
                    square.append(
                        [power[:, hidden].sum(axis=-1).mean(axis=1), power[:, ~hidden, 2].mean(axis=1)]
                    )
                    if method in WITH_BARS:
                        sd = np.zeros((len(view), off[0, ..., 0].size, PHASES))
                        rows = estimate.unknown.reshape(-1, off.shape[-1])[:, 0]
                        sd[:, rows] = anatomical.deviation_at_instants(
                            estimate.covariance[:, 0], off.shape[-1], PHASES
                        )
                        sd = sd.reshape(*off.shape[:3], PHASES)[:, hidden]
                        bars.append(np.stack([np.abs(anatomical.at_instants(error[:, hidden], PHASES)), sd]))
                results.append((np.array(square), np.stack(bars)))
            return results

        folds = map_processes(person_errors, range(people.count), inputs.workers)
        square = np.stack([np.stack([square for square, _ in fold]) for fold in folds])  # (P, S, M, 2, A)
        rows, bars = [], []
        for s, hidden in enumerate(HIDDEN):
            rows += [
                {
                    "person": who,
                    "hidden": hidden,
                    "method": method,
                    "view_angle_deg": angle,
                    "hidden_error_mm": np.sqrt(square[p, s, m, 0, a]),
                    "seen_error_mm2": square[p, s, m, 1, a],
                }
                for m, method in enumerate(METHODS)
                for p, who in enumerate(inputs.model.people)
                for a, angle in enumerate(view_deg)
            ]
            together = np.stack([fold[s][1] for fold in folds])  # (P, M', 2, A, hidden, 3, K)
            for m, method in enumerate(WITH_BARS):
                covered, half = (part.mean(axis=2) for part in covered_by_bars(together[:, m]))  # (2, P, 3)
                bars += [
                    {
                        "person": who,
                        "hidden": hidden,
                        "method": method,
                        "bars": kind,
                        "axis": axis,
                        "covered_percent": 100.0 * covered[k, p, x],
                        "half_width_mm": half[k, p, x],
                    }
                    for k, kind in enumerate(BARS)
                    for p, who in enumerate(inputs.model.people)
                    for x, axis in enumerate(AXES)
                ]
        return HiddenJoints(pd.DataFrame(rows), pd.DataFrame(bars))


def covered_by_bars(bars: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the coverage and mean half-width (2, P, A, 3) of 95 % error bars, without and with calibration.

    The calibration uses the errors of other people.

    `bars` is (P, 2, A, joint, 3, K): |error| and standard deviation.
    """
    error, sd = bars[:, 0], np.maximum(bars[:, 1], 1e-6)
    z = np.moveaxis(error / sd, 3, -1)
    axes = np.arange(3)
    learnt = anatomical.multipliers_without(z, axes, np.array([LEVEL]))[..., 0]  # (P, 3)
    textbook = np.full_like(learnt, NORMAL_95)
    halves = [multiplier[:, None, None, :, None] * sd for multiplier in (textbook, learnt)]
    covered = np.stack([(error <= half).mean(axis=(2, 4)) for half in halves])
    return covered, np.stack([half.mean(axis=(2, 4)) for half in halves])
