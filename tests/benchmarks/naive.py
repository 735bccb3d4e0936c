"""Simple implementation of the papers' equations with scikit-learn and plain loops, for comparison."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from sklearn.decomposition import PCA


@dataclass(frozen=True)
class Eigenwalkers:
    """Average walker (225,), eigenwalkers as columns (225, N), and eigenvalues (N,)."""

    average: np.ndarray
    walkers: np.ndarray
    eigenvalues: np.ndarray


def leave_one_out(samples: np.ndarray, components: int, folds: Iterable[int]) -> Iterator[Eigenwalkers]:
    """Yield the model without each of the walkers with the indices `folds`."""
    for r in folds:
        fitted = PCA(n_components=components, svd_solver="full").fit(np.delete(samples, r, axis=0))
        yield Eigenwalkers(fitted.mean_, fitted.components_.T, fitted.explained_variance_)


def projected(rows: np.ndarray, angle: float) -> np.ndarray:
    """Return the image coordinates (150, …) of walkers (225, …) at a view angle."""
    x, y, z = rows[0::3], rows[1::3], rows[2::3]
    return np.concatenate([np.cos(angle) * x + np.sin(angle) * y, z])


def missing(rows: np.ndarray, angle: float) -> np.ndarray:
    """Return the depths (75, …) of walkers (225, …) at a view angle."""
    return -np.sin(angle) * rows[0::3] + np.cos(angle) * rows[1::3]


def coefficients(model: Eigenwalkers, walker: np.ndarray, angle: float, sigma2: float | None) -> np.ndarray:
    """Return the coefficients k by least squares, or by MAP for a given sigma²: equations 3.9 and 3.15 of zhang2007."""
    observed = projected(model.walkers, angle)
    difference = projected(walker - model.average, angle)
    if sigma2 is None:
        return np.linalg.lstsq(observed, difference, rcond=None)[0]
    return np.linalg.solve(
        observed.T @ observed + np.diag(sigma2 / model.eigenvalues), observed.T @ difference
    )


def error(model: Eigenwalkers, walker: np.ndarray, angle: float, sigma2: float | None) -> float:
    """Return E_a, mm², of one walker at one view: the squared depth error, averaged over the cycle and over joints."""
    reconstructed = model.average + model.walkers @ coefficients(model, walker, angle, sigma2)
    squares = (missing(walker - reconstructed, angle) ** 2).reshape(5, 15).mean(axis=1)
    return float(squares[0] + squares[1:].sum() / 2.0)


def view_angle(model: Eigenwalkers, walker: np.ndarray, angle: float) -> OptimizeResult:
    """Estimate view angle and k from one initial value, with a numerical Jacobian: equation 4.5 of zhang2007."""
    observed = projected(walker, angle)

    def differences(unknowns: np.ndarray) -> np.ndarray:
        return observed - projected(model.average + model.walkers @ unknowns[1:], unknowns[0])

    start = np.zeros(1 + len(model.eigenvalues))
    scale = np.concatenate([[1.0], np.sqrt(model.eigenvalues)])
    return least_squares(differences, start, method="trf", x_scale=scale)
