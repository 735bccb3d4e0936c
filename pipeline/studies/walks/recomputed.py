"""Independent computation of the errors from known views, directly from the equations of the papers.

Folds, projections and both estimators are computed again from the recorded walks.

This code does not use the model, the cameras and the solvers of the sweep.  An error in one of these, or a fold that
includes the held-out person, changes the numbers of the sweep but not these.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from pipeline.core.choice import evenly
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import tidy
from pipeline.studies.walks.known_view import KnownView, Truth
from pipeline.studies.walks.methods import MAP, PUBLISHED

VIEWS, MAX_WALKERS = 5, 200
"""Largest numbers of views and of walkers for which the errors are recomputed, selected at equal steps."""


def recomputed(
    data: FourierSamples, model: EigenwalkersModel, options: KnownView, rows: pd.DataFrame, count: int
) -> pd.DataFrame:
    """Return mean errors by method and view, from the sweep and from an independent computation.

    ``relative_difference`` is the largest over walkers, to nine decimals: smaller differences are rounding errors.  The
    table has no rows if mirrored walkers are in training, which the papers do not use.

    Parameters
    ----------
    data : FourierSamples
    model, options : EigenwalkersModel, KnownView
    rows : DataFrame
        Errors of the sweep of the same data.
    count : int
        Number of eigenwalkers of each fold.
    """
    angles = np.unique(rows["view_angle_deg"])
    views = angles[evenly(VIEWS, len(angles))]
    walkers = evenly(MAX_WALKERS, len(data.clip))
    methods = [m for m in PUBLISHED if m in options.methods and not model.mirror]
    learnt = {r: _learnt(data, model, r, count) for r in (walkers if methods else ())}
    compared = []
    for method in methods:
        noise = options.noise_variance_mm2 if method == MAP.name else None
        for view in views:
            of_sweep = rows[(rows["method"] == method) & (rows["view_angle_deg"] == view)]
            sweep_mm2 = of_sweep.set_index("walker")["absolute_error_mm2"].loc[data.clip[walkers]].to_numpy()
            residual, angle = options.truth is Truth.motion, np.radians(view)
            recomputed_mm2 = np.array(
                [_error(data, r, fold, angle, noise, residual=residual) for r, fold in learnt.items()]
            )
            compared.append(
                {
                    "method": method,
                    "view_angle_deg": view,
                    "absolute_error_mm2": sweep_mm2.mean(),
                    "recomputed_mm2": recomputed_mm2.mean(),
                    "relative_difference": round(float(np.abs(sweep_mm2 / recomputed_mm2 - 1.0).max()), 9),
                }
            )
    columns = ["method", "view_angle_deg", "absolute_error_mm2", "recomputed_mm2", "relative_difference"]
    return tidy(pd.DataFrame(compared, columns=columns), by=["method", "view_angle_deg"])


def _learnt(
    data: FourierSamples, model: EigenwalkersModel, r: int, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a walker minus the mean of other people, and the eigenwalkers and variances of other people."""
    rows = data.coefficients.reshape(len(data.coefficients), -1)
    if data.frequency:
        rows = np.column_stack([rows, 2.0 * np.pi * data.frequency_hz])
    others = rows[data.person != data.person[r]]
    if data.frequency:  # scaled to the mean variance of the other numbers, unless an option gives the scale
        varied = others.var(axis=0)
        scale = model.omega_scale_mm or np.sqrt(varied[:-1].mean() / varied[-1])
        others, rows = (np.column_stack([part[:, :-1], scale * part[:, -1]]) for part in (others, rows))
    mean = others.mean(axis=0)
    _, singular, axes = np.linalg.svd(others - mean, full_matrices=False)
    variances = singular[:count] ** 2 / (len(others) - (model.divisor.value == "R-1"))
    return rows[r : r + 1] - mean, axes[:count], variances


def _error(
    data: FourierSamples,
    r: int,
    learnt: tuple[np.ndarray, np.ndarray, np.ndarray],
    view: float,
    noise: float | None,
    *,
    residual: bool,
) -> float:
    """Return the mean square error, mm², of a walker's depth as reconstructed by a model of other people."""
    (walker, eigenwalkers, variances), (blocks, joints) = learnt, data.coefficients.shape[1:3]
    # Image: cos x + sin y, and z; depth: -sin x + cos y.
    image = np.array([[np.cos(view), np.sin(view), 0.0], [0.0, 0.0, 1.0]])
    depth = np.array([[-np.sin(view), np.cos(view), 0.0]])
    measured, numbers = ~data.unmeasured[r], 3 * blocks * joints

    def along(vectors: np.ndarray, axes: np.ndarray, *, complete: bool = False) -> np.ndarray:
        points = vectors[:, :numbers].reshape(-1, blocks, joints, 3)[:, :, measured] @ axes.T
        return np.column_stack(
            [points.reshape(len(vectors), -1), vectors[:, numbers:] if complete else vectors[:, :0]]
        )

    d, E = along(walker, image, complete=True)[0], along(eigenwalkers, image, complete=True)
    prior = np.diag(1.0 / variances)
    k = np.linalg.pinv(E.T) @ d if noise is None else np.linalg.solve(E @ E.T + noise * prior, E @ d)
    off = along(walker, depth)[0] - k @ along(eigenwalkers, depth)
    errors = np.array([1.0] + [0.5] * (blocks - 1)) @ np.square(off.reshape(blocks, -1))
    if residual:
        errors = errors + (depth @ data.residual_covariance[r][measured] @ depth.T).ravel()
    return errors.mean()
