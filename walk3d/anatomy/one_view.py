"""Reconstruction of a walk from one view with error bars, by MAP or by the anatomical prior.

Symbols
-------
``E``        eigenwalkers, (N, 225); ``A`` and ``B`` are their visible and missing coordinates, as columns
``lambda_n`` eigenvalues; ``sigma²`` noise variance [zhang2007 3.12]
``Sigma``    ``B (A^T A / sigma² + Lambda^-1)^-1 B^T``, covariance of the missing coordinates [zhang2007 3.10, 3.13]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core import fourier, linear_model
from pipeline.core.linear_model import LinearModel
from pipeline.core.reconstruction.completed import complete_walk
from pipeline.shortened import shortened
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import GROUP_OF_JOINT, GROUPS, JOINTS, Prior

NORMAL_95 = 1.959963984540054
"""Half-width of the 95 % interval of a normal distribution, in standard deviations."""
PHASES = 8
"""Number of instants of the gait cycle at which error bars are compared with errors."""
MIN_CALIBRATORS, MAX_CALIBRATORS = 10, 60
"""Minimum number of walkers for a calibration of error bars, and maximum number of walkers that are left out for it."""
MIN_SD_MM = 1e-6
"""Standard deviation of a reconstructed coordinate, mm, below which the coordinate counts as visible in the image."""


@shortened
class Reconstruction:
    """Reconstruction of a walk from one view, with error bars.

    Attributes
    ----------
    coefficients : (5, 15, 3)
        Fourier coefficients, mm.
    covariance : (15, 3, 5, 3, 5)
        Covariance of each joint's coefficients, by axis and coefficient, mm²; zero along the visible axes.
    multipliers : (15,)
        Half widths of 95 % bars, in standard deviations.
    calibrated_on : int
        Number of walkers that were left out in turn to calibrate the multipliers; 0: multipliers of the normal
        distribution.
    """

    coefficients: np.ndarray
    covariance: np.ndarray
    multipliers: np.ndarray
    calibrated_on: int = 0

    @property
    def standard_deviation(self) -> np.ndarray:
        """Standard deviations (5, 15, 3) of the reconstructed Fourier coefficients, mm."""
        variance = np.diagonal(np.diagonal(self.covariance, axis1=1, axis2=3), axis1=1, axis2=2)  # (15, 3, 5)
        return np.sqrt(np.maximum(np.moveaxis(variance, -1, 0), 0.0))

    def at_instants(self, instants: int) -> tuple[np.ndarray, np.ndarray]:
        """Return joint positions and the half-widths of their 95 % error bars, each (K, 15, 3), mm, at K instants.

        The instants are equally spaced over the gait cycle.

        Parameters
        ----------
        instants : int
        """
        positions, deviation = _at_instants(self.coefficients, self.covariance, instants)
        return positions, self.multipliers[:, None] * deviation


def _at_instants(
    coefficients: np.ndarray, covariance: np.ndarray, instants: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint positions and their standard deviations, each (K, 15, 3), mm, at K equally spaced instants."""
    basis = fourier.cycle_basis(fourier.equal_phases(instants), len(coefficients))
    variance = np.einsum("kp,japaq,kq->kja", basis, covariance, basis)
    return np.einsum("kp,pja->kja", basis, coefficients), np.sqrt(np.maximum(variance, 0.0))


def covariance_of_map(
    model: LinearModel, view_angle_rad: float, hidden: np.ndarray, noise_variance: float
) -> np.ndarray:
    """Return the posterior covariance (15, 3, 5, 3, 5), mm², of each joint's unknown Fourier coefficients under MAP.

    Parameters
    ----------
    model : LinearModel
        Model of walks with 225 numbers.
    view_angle_rad : float
    hidden : (15,) bool
        Joints that are not visible in the image.
    noise_variance : float
        sigma², mm².
    """
    axes = anatomical.image_axes(np.array([view_angle_rad]))[0]
    scaled = np.sqrt(model.eigenvalues)[:, None] * model.components
    walkers = anatomical.by_joint(linear_model.unflatten(scaled))  # (N, 15, 3, 5)
    E = np.einsum("ij,nkjb->nkib", axes, walkers)
    unknown = anatomical.unknown_coefficients(hidden, E.shape[-1]).reshape(E.shape[1:])
    A = E[:, ~unknown]
    spread = np.linalg.inv(A @ A.T / noise_variance + np.eye(len(E)))
    B = np.where(unknown, E, 0.0)
    of_joints = np.einsum("nkib,nm,mkjc->kibjc", B, spread, B, optimize=True)
    return np.einsum("ix,kibjc,jy->kxbyc", axes, of_joints, axes, optimize=True)


def calibrated_multipliers(
    samples: np.ndarray, components: int, view_angle_rad: float, hidden: np.ndarray, noise_variance: float
) -> tuple[np.ndarray, int]:
    """Return the factors (15,) that scale the 95 % error bars of MAP, and the number of calibration walkers.

    Each walker is left out in turn and reconstructed from the same view.  The multiplier of a group of joints is the 95
    % quantile of error over standard deviation at `PHASES` instants, as for the ``calibrated`` bars of
    zhang2007_coverage. At most `MAX_CALIBRATORS` walkers are left out, evenly spaced.

    Parameters
    ----------
    samples : (R, 225)
        One walk for each of R people, mm.
    components : int
        Number of eigenwalkers of a fold's model.
    view_angle_rad : float
    hidden : (15,) bool
    noise_variance : float
        sigma², mm².
    """
    if len(samples) < MIN_CALIBRATORS:
        return np.full(JOINTS, NORMAL_95), 0
    left_out = np.unique(np.linspace(0, len(samples) - 1, MAX_CALIBRATORS).round().astype(int)).tolist()
    z = []
    for fold, r in linear_model.leave_one_out(samples, components, only=left_out):
        completed = complete_walk(fold, samples[r], view_angle_rad, ~hidden, noise_variance=noise_variance)
        covariance = covariance_of_map(fold, view_angle_rad, hidden, noise_variance)
        error, deviation = _at_instants(completed - linear_model.unflatten(samples[r]), covariance, PHASES)
        z.append(np.where(deviation > MIN_SD_MM, np.abs(error) / np.maximum(deviation, MIN_SD_MM), np.nan))
    of_group = [
        np.nanquantile(np.stack(z)[:, :, group == GROUP_OF_JOINT], 0.95) for group in range(len(GROUPS))
    ]
    return np.array(of_group)[GROUP_OF_JOINT], len(left_out)


def learnt_prior(samples: np.ndarray) -> Prior:
    """Return the anatomical prior learnt from samples (R, 225), mm: one walk for each of R people."""
    weights = np.full(len(samples), 1.0 / len(samples))
    return anatomical.fit(linear_model.unflatten(samples), weights, anatomical.Shrinkage())


def of_unknown_laboratory(
    learnt: Prior,
    walk: np.ndarray,
    view_angle_rad: float,
    hidden: np.ndarray,
    *,
    share: float = 1.0,
    known: Sequence[np.ndarray] = (),
) -> Reconstruction:
    """Reconstruct a walk from one view with a prior that was learnt in other laboratories.

    The covariance is Laplace's approximation at the most probable walk.

    Parameters
    ----------
    learnt : Prior
        Prior with two harmonics.
    walk : (5, 15, 3)
        Fourier coefficients, mm; only their image at the view angle is used.
    view_angle_rad : float
    hidden : (15,) bool
    share : float
        Share of the differences between laboratories that the prior does not cover, see `anatomical.unfamiliar`.
    known : sequence of (5, 15, 3)
        Walks of other people of the same laboratory, mm.
    """
    prior = anatomical.unfamiliar(learnt, anatomical.Differences(), share, known)
    view = np.array([view_angle_rad])
    conditional = anatomical.condition(prior, view, noise=anatomical.Noise(), hidden=hidden)
    axes, unknown = anatomical.image_axes(view)[0], conditional.unknown
    turned = np.einsum("ij,kjb->kib", axes, anatomical.by_joint(walk))
    coefficients = turned.ravel().copy()
    posterior = anatomical.fit_lengths(
        conditional, coefficients[None, None, ~unknown], anatomical.tolerances(prior), with_covariance=True
    )
    coefficients[unknown] = posterior.unknown[0, 0]
    covariance = np.zeros((len(coefficients), len(coefficients)))
    covariance[np.ix_(unknown, unknown)] = posterior.covariance[0, 0]
    split = covariance.reshape(*turned.shape, *turned.shape)
    of_joints = np.moveaxis(np.diagonal(split, axis1=0, axis2=3), -1, 0)  # (15, 3, 5, 3, 5)
    return Reconstruction(
        coefficients=anatomical.by_block(np.einsum("ij,kib->kjb", axes, coefficients.reshape(turned.shape))),
        covariance=np.einsum("ix,kibjc,jy->kxbyc", axes, of_joints, axes, optimize=True),
        multipliers=np.full(JOINTS, NORMAL_95),
    )
