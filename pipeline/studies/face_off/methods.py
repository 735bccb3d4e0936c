"""One walk before one perspective camera, by eigenwalkers and by baselines.

They are given what articulated trajectories are, the image, the camera and the true trajectory of the pelvis, but not
the true lengths of the limbs; eigenwalkers get their model, learnt without this walker.

Eigenwalkers know only parallel projections of a direction that stays [zhang2007 3.5].  A still camera's image is read
as one (weak perspective): offsets from the pelvis in px, times the pelvis's depth over the focal length, are offsets
in mm along the image.  With the pelvis known, they are what `pipeline.core.camera.project` gives, up to perspective.
Frequency and phase come from that view alone.  A moving camera has no such reading.
The anatomical prior stands beside the eigenwalkers, with the phase that approach II finds.
The model also has to be told where the walker heads; a wrong heading turns it about the vertical, not the camera.

Baselines are given frequency and phase: the average walker; and the image as it is, with the depth that
the average walker has.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pipeline.core import anatomical, fourier, reconstruction
from pipeline.core import camera as parallel
from pipeline.core.anatomical import Prior
from pipeline.core.limb_chain import WALKER14
from pipeline.core.linear_model import LinearModel, unflatten
from pipeline.core.pinhole import Pinhole
from pipeline.skeleton import WALKER15

PELVIS = WALKER14.joints.index(WALKER14.root)


@dataclass(frozen=True)
class SeenWalk:
    """What the methods are given.

    Attributes
    ----------
    images : (F, 15, 2)
        px, NaN where a joint is hidden.
    camera : Pinhole
    root : (F, 3)
        Trajectory of the pelvis, mm, about its mean.
    frame_rate_hz : float
    harmonics : int
        Of a walk.
    view_angle_rad : float
        Of a still camera, or of a moving one in the middle of its path.
    heading_error_rad : float
        By how much the view angle is taken for too large, because the walker's heading is known no better.
    """

    images: np.ndarray
    camera: Pinhole
    root: np.ndarray
    frame_rate_hz: float
    harmonics: int
    view_angle_rad: float
    heading_error_rad: float = 0.0

    @property
    def times_s(self) -> np.ndarray:
        """Times (F,) of the frames, the first at zero."""
        return np.arange(len(self.images)) / self.frame_rate_hz

    def weak_perspective(self) -> np.ndarray:
        """Return horizontal and vertical (F, 15, 2) of every joint, mm, as a parallel projection would show them."""
        depth = self.camera.in_camera(self.root)[:, 2]
        focal_px = self.camera.intrinsics[..., 0, 0]
        offsets = (self.images - self.camera.project(self.root)[:, None]) * (depth / focal_px)[:, None, None]
        seen = parallel.project(self.root, self.view_angle_rad)[:, None] + offsets * [1.0, -1.0]
        seen[:, PELVIS] = parallel.project(self.root, self.view_angle_rad)
        return seen

    @cached_property
    def series(self) -> tuple[np.ndarray, np.ndarray, float]:
        """The image (F, 15, 2), mm, hidden joints filled by their series; its coefficients and its frequency."""
        image, rate_hz, harmonics = self.weak_perspective(), self.frame_rate_hz, self.harmonics
        filled, frequency_hz = _bridged(image), np.nan
        for _ in range(2):  # the second time with gaps filled by the series itself
            apart = (filled - filled[:, list(WALKER15.mirror)]).reshape(len(filled), -1)
            frequency_hz = fourier.fundamental_frequency(filled, rate_hz, harmonics=harmonics, apart=apart)
            coefficients = series_of_seen(image, rate_hz, frequency_hz, harmonics=harmonics)
            series = fourier.synthesise(coefficients, frequency_hz, self.times_s)
            filled = np.where(np.isfinite(image), image, series)
        return filled, coefficients, frequency_hz


def series_of_seen(
    image: np.ndarray, frame_rate_hz: float, frequency_hz: float, *, harmonics: int
) -> np.ndarray:
    """Return the Fourier coefficients (1 + 2H, J, 2) of an image, each joint fitted to the frames in which it was seen.

    Parameters
    ----------
    image : (F, J, 2)
        mm; NaN where a joint was not seen.
    frame_rate_hz, frequency_hz : float
    harmonics : int

    Notes
    -----
    Least squares with weight one where the joint was seen and zero elsewhere [zhang2007 3.1], time zero at the first
    frame.  Where too little was seen the solution of least norm about the mean is taken.
    """
    matrix = fourier.design(frequency_hz, np.arange(len(image)) / frame_rate_hz, harmonics)
    coefficients = np.zeros((matrix.shape[1], *image.shape[1:]))
    for joint in range(image.shape[1]):
        seen = np.isfinite(image[:, joint]).all(axis=1)
        if not seen.any():
            continue
        middle = image[seen, joint].mean(axis=0)
        coefficients[:, joint] = np.linalg.lstsq(matrix[seen], image[seen, joint] - middle, rcond=1e-6)[0]
        coefficients[0, joint] += middle
    return coefficients


def _bridged(image: np.ndarray) -> np.ndarray:
    """An image (F, J, 2) with gaps filled linearly in time: enough for a first guess of the frequency."""
    frames = np.arange(len(image))
    filled = np.zeros_like(image)
    for joint in range(image.shape[1]):
        seen = np.isfinite(image[:, joint]).all(axis=1)
        if seen.any():
            for axis in range(2):
                filled[:, joint, axis] = np.interp(frames, frames[seen], image[seen, joint, axis])
    return filled


def by_eigenwalkers(
    model: LinearModel, walk: SeenWalk, noise_variances: list[float | None]
) -> list[np.ndarray]:
    """Return motions (F, 15, 3), mm, one for each noise variance; None is approach I [zhang2007 3.9, 3.15, 3.16].

    Parameters
    ----------
    model : LinearModel
        Learnt without this walker.
    walk : SeenWalk
        Of a still camera.
    noise_variances : list of float or None
        sigma² of approach II, mm², or None for least squares.

    Raises
    ------
    InvalidInput
        If the clip shows no cycle, or the model has another size.

    Notes
    -----
    Observed coordinates are kept as they are [zhang2007 3.16]; where a joint was not seen its own series stands in.
    """
    angle = walk.view_angle_rad
    filled, coefficients, frequency_hz = walk.series
    motions = []
    for noise_variance in noise_variances:
        found = reconstruction.from_known_view_unknown_phase(
            model,
            coefficients,
            angle + walk.heading_error_rad,
            noise_variance=noise_variance,
            frequency_hz=frequency_hz,
        )
        missing = fourier.synthesise(found.missing[..., None], frequency_hz, walk.times_s)[..., 0]
        motions.append(parallel.combine(filled, missing, angle))
    return motions


def by_anatomy(prior: Prior, model: LinearModel, walk: SeenWalk, noise_variance: float) -> np.ndarray:
    """Return the motion (F, 15, 3), mm, with the depth of the anatomical reconstruction [`pipeline.core.anatomical`].

    Parameters
    ----------
    prior : Prior
        Learnt without this walker.
    model : LinearModel
        Learnt without this walker, for the phase: it is that of approach II.
    walk : SeenWalk
        Of a still camera.
    noise_variance : float
        sigma² of approach II, mm².

    Notes
    -----
    A parallel projection is off by (offset along the image) * (offset along the axis) / (distance of the pelvis); how
    much that is for the average walker is told to the noise and to the tolerances of the bones.
    """
    filled, coefficients, frequency_hz = walk.series
    view = np.array([walk.view_angle_rad + walk.heading_error_rad])
    phase = reconstruction.from_known_view_unknown_phase(
        model, coefficients, view[0], noise_variance=noise_variance, frequency_hz=frequency_hz
    ).phase_rad
    seen = anatomical.by_joint(fourier.shift(coefficients, phase))
    distance = walk.camera.in_camera(walk.root)[:, 2].mean()
    noise = replace(anatomical.Noise(), **_perspective(prior, view, distance))
    given = anatomical.condition(prior, view, noise=noise)
    limits = anatomical.tolerances(prior, bias=noise.bias, slow=noise.slow)
    found = anatomical.fit_lengths(given, seen.reshape(1, 1, -1), limits).unknown.reshape(seen.shape[0], -1)
    missing = fourier.shift(found.T[..., None], -phase)
    away = fourier.synthesise(missing, frequency_hz, walk.times_s)[..., 0]
    return parallel.combine(filled, away, walk.view_angle_rad)


def _perspective(prior: Prior, view_rad: np.ndarray, distance: float) -> dict[str, float]:
    """What a parallel projection of the average walker is off by, root mean square over joints, mm."""
    walker = np.einsum("ij,kjb->kib", anatomical.image_axes(view_rad)[0], prior.mean)
    offsets = anatomical.at_instants(walker - walker[PELVIS], anatomical.PHASES)
    off = offsets[:, :2] * offsets[:, 2:] / distance
    return {
        "bias": np.sqrt((off.mean(axis=-1) ** 2).mean()),
        "slow": np.sqrt(off.var(axis=-1).mean()),
    }


def by_image_and_average(walk: SeenWalk, average: np.ndarray) -> np.ndarray:
    """Return the motion (F, 15, 3), mm, that keeps the image and has the depth of the average walker (F, 15, 3).

    Parameters
    ----------
    walk : SeenWalk
        Of a still camera.
    average : (F, 15, 3)
        Turned by the error of the heading, as of `mean_walker`, mm.
    """
    missing = parallel.missing_dimension(average, walk.view_angle_rad)
    return parallel.combine(walk.series[0], missing, walk.view_angle_rad)


def mean_walker(
    model: LinearModel,
    times_s: np.ndarray,
    frequency_hz: float,
    phase_rad: float,
    *,
    heading_error_rad: float = 0.0,
) -> np.ndarray:
    """Return the average walker (F, 15, 3), mm, walking with a known frequency and phase [zhang2007 3.3].

    Parameters
    ----------
    model : LinearModel
    times_s : (F,)
    frequency_hz, phase_rad : float
        Of the walk, the phase at time zero.
    heading_error_rad : float
        As of `SeenWalk`: turns the walker about the vertical.
    """
    average = unflatten(model.mean)
    motion = fourier.synthesise(fourier.shift(average, -phase_rad), frequency_hz, times_s)
    cos, sin = np.cos(heading_error_rad), np.sin(heading_error_rad)
    return motion @ np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
