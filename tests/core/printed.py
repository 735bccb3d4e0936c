"""Estimators as the papers print them, which serve as references for the fast implementations."""

from __future__ import annotations

import numpy as np

from pipeline.core import camera, fourier, reconstruction
from pipeline.core.linear_model import LinearModel, unflatten


def printed(
    model: LinearModel, sample: np.ndarray, angle: float, noise_variance: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return coefficients (N,), missing dimension (5, 15) and its error (5, 15), computed as the papers write it.

    Build C, project the model, subtract, solve, and take the missing dimension of the sum of eigenwalkers.
    """
    trailing = sample.size - 225
    scaled = np.append(sample[:225], model.last_scale * sample[225:])
    C = camera.projection_matrix(angle, trailing=trailing)
    E_hat, d = C @ model.components.T, C @ scaled - C @ model.mean
    if noise_variance is None:
        k = np.zeros(len(model.eigenvalues))
        varying = np.sqrt(model.eigenvalues) > 1e-12 * np.sqrt(model.eigenvalues.max())
        k[varying] = reconstruction.least_squares(E_hat[:, varying], d)
    else:
        k = reconstruction.maximum_a_posteriori(E_hat, d, model.eigenvalues, noise_variance=noise_variance)
    whole = unflatten(model.mean + k @ model.components)
    missing = camera.missing_dimension(whole, angle)
    return k, missing, camera.missing_dimension(unflatten(sample), angle) - missing


def printed_cost(
    model: LinearModel, image: np.ndarray, frequency_hz: float, view: float, phase: float, noise: float | None
) -> float:
    """Return the printed cost of an observation at a view angle and phase, [zhang2007 4.5] or [zhang2007 4.6]."""
    trailing = model.mean.size - 225
    C = camera.projection_matrix(view, trailing=trailing)
    w_hat = fourier.shift(image, phase).ravel()
    if trailing:
        w_hat = np.append(w_hat, model.last_scale * 2 * np.pi * frequency_hz)
    d, E = w_hat - C @ model.mean, C @ model.components.T
    retained = model.eigenvalues > 1e-20 * model.eigenvalues.max()
    E, eigenvalues = E[:, retained], model.eigenvalues[retained]
    if noise is None:
        return float(((d - E @ reconstruction.least_squares(E, d)) ** 2).sum())
    k = reconstruction.maximum_a_posteriori(E, d, eigenvalues, noise_variance=noise)
    return float(((d - E @ k) ** 2).sum() + noise * (k**2 / eigenvalues).sum())
