"""Reconstruction of a walk from one camera's keypoints, by refinement of several initial estimates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from pipeline.shortened import shortened
from pipeline.skeleton import LEFT_LEG, RIGHT_LEG
from pipeline.validation import InvalidInput, require_finite, require_range, require_shape
from walk3d.anatomy.prior import JOINTS
from walk3d.film.walk.cycle import GaitCycle, event_times, gait_cycle
from walk3d.film.walk.exchanged import LIMBS, exchange_all
from walk3d.film.walk.objective import HEADING, NU, PHASE, Keypoints, Setting
from walk3d.film.walk.path import median_of_seen
from walk3d.film.walk.posterior import (
    Posterior,
    posterior,
    relative_positions,
    remove_bias,
)
from walk3d.film.walk.prior import Prior
from walk3d.film.walk.refinement import Fit, Refinement, relabelled
from walk3d.film.walk.start import SearchPoint, Starts, find_starts, within_tolerance
from walk3d.film.walk.training import HEIGHT_MM, SIZE
from walk3d.film.walk.view import level_axes

_LEGS = [*LEFT_LEG[1:], *RIGHT_LEG[1:]]

DUPLICATE_TOLERANCE = (np.radians(4.0), np.radians(8.0), 0.015)
"""Differences in heading, phase and relative frequency below which two candidates count as duplicates."""
OUTLIER = 5.0
"""Limit of a keypoint's residual, in multiples of sigma, to which it is clamped before averaging."""
FOLLOWED_RESIDUAL = 1.3
"""Residual, per cent of the walker's height, above which a wandering path is tried."""
FOLLOWED_GAIN = 0.8
"""Ratio of the residuals with and without a wandering path, below which the wandering path is accepted."""
SMALL_RESIDUAL_GAIN = 0.9
"""Ratio of the residuals with and without a wandering path that suffices if the residual with this path is small."""
MAX_UNSHARED_SHARE = 0.93
"""Share of the residual that no path can explain, above which a wandering path is not tried.

The share is up to 0.87 in clips in which a wandering path was accepted.
"""
SHAKEN_SHARE = 0.3
"""Share of the squared residual that all joints of a frame have in common, above which the camera counts as shaken."""
SHAKE_ROUNDS = 2
MIN_WHITE_HZ = 20.0
"""Frame rate, Hz, below which the uncorrelated part of the residuals cannot be estimated from successive frames."""
MAX_ANKLE_CORRELATION = 0.5
"""Correlation of the ankles' motions relative to the hips above which the clip is not a walk.

Such a clip is not refined.
"""
COSINES_PER_STRIDE = 0.8
"""Number of cosines of a wandering path per stride of the clip.

The fastest cosine has a period of 2.5 strides.
"""
PRUNING_ROUNDS = ((1, 800.0), (1, 1500.0), (1, 1500.0), (2, 400.0), (3, 200.0))
"""Number of refinement steps in each round of pruning, and cost gap to the best start above which a start is dropped.

In our tests, the best start was never dropped.
"""
LABELS_UNSURE = 100.0
"""Difference of cost between detected and exchanged labels, below which left and right count as unsure."""


@dataclass(frozen=True)
class Candidate(SearchPoint):
    """Candidate for the reconstructed walk, at a local minimum of the cost.

    Attributes
    ----------
    labels_exchanged : bool
        True if left and right were exchanged throughout.
    cost_above_best : float
        Twice the negative log probability relative to the best candidate, uncalibrated.
    """

    labels_exchanged: bool
    cost_above_best: float


@shortened
class Reconstruction:
    """Reconstructed walk, with all other candidates and with the keypoints used in the fit.

    Attributes
    ----------
    fit : Fit
    starts : Starts
    candidates : tuple of Candidate
        All distinct candidates, the best first.
    labels_exchanged : bool
        True if left and right of all keypoints were exchanged.
    labels_unsure : bool
        True if the other labelling explains the keypoints about as well.
    keypoints : Keypoints
        Keypoints that were used, with labels exchanged as in the fit.
    rms_residual_px : float
        Root mean square of the residual along an image axis without its white part, clamped at `OUTLIER` times sigma.
    shake_px : (T, 2)
        Shake of the camera, subtracted from all keypoints of each frame; 0 if it did not shake.
    height_px : float
        Mean height of the walker (head above ankles) in the image.
    """

    fit: Fit
    starts: Starts
    candidates: tuple[Candidate, ...]
    labels_exchanged: bool
    labels_unsure: bool
    keypoints: Keypoints
    rms_residual_px: float
    shake_px: np.ndarray
    height_px: float

    @property
    def relative_residual(self) -> float:
        """Residual g, in per cent of the walker's height in the image."""
        return 100.0 * self.rms_residual_px / self.height_px

    @property
    def leg_motion(self) -> float:
        """Motion of knees and ankles in the image, relative to the average walker's motion in the same view."""
        image = level_axes(self.fit.x[HEADING])[:2]
        average = image @ self.fit.objective.prior.model.mean[_LEGS, :, 1:]
        expected = 0.5 * (average**2).sum(axis=(1, 2))  # of a sine or cosine, half the square
        metric, visible = self.starts.path.metric, self.keypoints.weights > 0
        power = [
            (metric[visible[:, joint], joint].var(axis=0).sum(), expected[k])
            for k, joint in enumerate(_LEGS)
            if visible[:, joint].sum() > 1
        ]
        if not power:
            return 0.0
        moved, usual = np.sum(power, axis=0)
        return np.sqrt(moved / usual)

    @property
    def unshared_residual(self) -> float:
        """Share of the residual, 0 to 1, that a shift and a scaling of the body in each frame do not explain."""
        weights = (self.keypoints.weights > 0)[..., None].astype(float)
        count = np.maximum(weights.sum(axis=1, keepdims=True), 1.0)
        full = weights * self.fit.objective.residual(self.fit.x, self.keypoints)
        residual, body = (
            weights * (values - (weights * values).sum(axis=1, keepdims=True) / count)
            for values in (full, self.keypoints.pixels)
        )
        larger = (residual * body).sum(axis=(1, 2)) / np.maximum((body**2).sum(axis=(1, 2)), 1e-9)
        left = residual - larger[:, None, None] * body
        return np.sqrt((left**2).sum() / max((full**2).sum(), 1e-9))

    @cached_property
    def posterior(self) -> Posterior:
        """Estimated walk with error bars.

        It is computed at its first use, because most candidates are discarded.
        """
        return posterior(self.fit.objective.prior, self.fit, self.keypoints)

    @property
    def positions_mm(self) -> np.ndarray:
        """Positions (T, 15, 3), mm, of the estimated walk, computed without error bars."""
        walker = remove_bias(self.fit.objective.prior, self.fit.x[:SIZE])
        return relative_positions(walker, self.fit.x, self.fit.times)

    @property
    def focal_px(self) -> float:
        """Known or estimated focal length, px."""
        return self.fit.objective.focal_px(self.fit.x)

    @property
    def focal_estimated(self) -> bool:
        """True if the focal length was estimated."""
        return self.fit.objective.setting.focal_sd > 0

    @property
    def image_px(self) -> np.ndarray:
        """Projection (T, 15, 2) of the fitted walker, px from the principal point, including the camera's shake."""
        return self.fit.objective.image(self.fit.x) + self.shake_px[:, None]

    @property
    def filmed_px(self) -> np.ndarray:
        """Keypoints (T, 15, 2) used in the fit, px from the principal point, including the camera's shake."""
        return self.keypoints.pixels + self.shake_px[:, None]

    @cached_property
    def cycle(self) -> GaitCycle:
        """Events and numbers of the average gait cycle of the walk."""
        return gait_cycle(self.posterior.walker, self.fit.frequency_hz, self.fit.objective.prior.belt)

    @property
    def event_times(self) -> list[list[tuple[np.ndarray, np.ndarray]]]:
        """Contact and toe-off times of each foot in the clip, s, and the standard deviations of these times."""
        fit = self.fit
        return event_times(self.cycle, self.posterior.covariance, fit.x[PHASE], fit.frequency_hz, fit.times)

    @property
    def strides(self) -> float:
        """Number of strides in the clip."""
        return (self.fit.times[-1] - self.fit.times[0]) * self.fit.frequency_hz


@dataclass(frozen=True, kw_only=True)
class Fitting:
    """Options of the fit of a walk to keypoints.

    Attributes
    ----------
    both_labellings : bool
        Try left and right exchanged throughout as well.
    overground : bool, optional
        True: the walker moves through space as fast as the feet imply.  False: the path is independent of the feet.
        None: decided by the path.
    relabel : bool
        Search for frames with exchanged labels.
    max_starts : int
    cosines : int
        Number of cosines of a wandering path or of a following camera; 0 for a still camera and a nearly straight path.
    nu : float
        Degrees of freedom of the residuals' Student's t.
    focal_sd : float
        Standard deviation of the logarithm of an unknown focal length; 0 if it is known.
    max_distance, max_ankle_correlation : float
        `Starts.least_distance` and `Starts.ankles_together` above which nothing is refined.
    """

    both_labellings: bool = True
    overground: bool | None = None
    relabel: bool = True
    max_starts: int = 4
    cosines: int = 0
    nu: float = NU
    focal_sd: float = 0.0
    max_distance: float = np.inf
    max_ankle_correlation: float = np.inf


def reconstruct(
    pixels: np.ndarray,
    weights: np.ndarray,
    frame_rate_hz: float,
    focal_px: float,
    prior: Prior,
    fitting: Fitting = Fitting(),
) -> Reconstruction:
    """Reconstruct a straight walk from the keypoints of one camera.

    Parameters
    ----------
    pixels : (T, 15, 2)
        Keypoints of WALKER15 relative to the principal point, rows counted downwards; NaN where missing.
    weights : (T, 15)
        0 where missing.
    frame_rate_hz, focal_px : float
    prior : Prior
    fitting : Fitting

    Raises
    ------
    InvalidInput
        If the ankles move together (`code` ``"feet_together"``), the arrays do not fit together, too little is seen, no
        person is upright, or no view of the walker model fits the keypoints.
    """
    pixels, weights = _visible_keypoints(pixels, weights, prior)
    require_range("the frame rate", frame_rate_hz, above=0, unit="Hz")
    require_range("the focal length", focal_px, above=0, unit="px")
    times = (np.arange(len(pixels)) - (len(pixels) - 1) / 2.0) / frame_rate_hz

    def attempts_from(pixels: np.ndarray, exchanged: dict[str, np.ndarray]) -> Iterator[_Attempt]:
        for other in (False, True) if fitting.both_labellings else (False,):
            labelled = (exchange_all(pixels), exchange_all(weights)) if other else (pixels, weights)
            keypoints = Keypoints(*labelled)
            used = relabelled(keypoints, exchanged)
            starts = find_starts(used.pixels, used.weights, times, focal_px, prior, fitting.cosines)
            if fitting.overground is not None:
                starts = replace(starts, overground=fitting.overground)
            setting = Setting(
                times, focal_px, starts.overground, fitting.cosines, fitting.nu, fitting.focal_sd
            )
            refine = partial(Refinement, prior, setting, keypoints, path=starts.path, relabel=fitting.relabel)
            for start in starts.starts[: fitting.max_starts]:
                yield _Attempt(other, starts, refine(start, exchanged=exchanged))

    def best_of(pixels: np.ndarray) -> tuple[_Attempt, list[Candidate]]:
        none = np.zeros(len(times), bool)
        attempts = list(attempts_from(pixels, {"legs": none, "arms": none}))
        if (together := attempts[0].starts.ankles_together) > fitting.max_ankle_correlation:
            raise InvalidInput(
                "both feet move together in the image, so the clip is not a walk",
                expected=f"a correlation between the ankles of {fitting.max_ankle_correlation:g} or less",
                received=f"{together:.2f}",
                code="feet_together",
            )
        if min(attempt.starts.least_distance for attempt in attempts) > fitting.max_distance:
            raise InvalidInput("no view of the walker model fits these keypoints", code="no_view_fits")
        _prune(attempts)
        both = fitting.relabel and fitting.both_labellings
        if both and _labels_disagree(attempts[np.argmin(_costs(attempts))].fit()[0]):
            attempts += (legs_exchanged := list(attempts_from(pixels, {"legs": ~none, "arms": none})))
            _prune(legs_exchanged)
        return _best_of(attempts)

    best, candidates = best_of(pixels)
    shake = find_shake(best)
    if shake.any():
        best, candidates = best_of(pixels - shake[:, None])
    return _reconstruction(best, candidates, shake)


def _visible_keypoints(
    pixels: np.ndarray, weights: np.ndarray, prior: Prior
) -> tuple[np.ndarray, np.ndarray]:
    """Return the checked keypoints and weights, with 0 for joints that are not visible."""
    pixels = require_shape("pixels", np.asarray(pixels, float), ("T", JOINTS, 2))
    weights = require_shape("weights", np.asarray(weights, float), (len(pixels), JOINTS))
    if len(pixels) < 8:
        raise InvalidInput(
            "the clip is too short",
            expected="8 frames or more",
            received=len(pixels),
            code="too_short",
            frames=len(pixels),
        )
    visible = np.isfinite(pixels).all(axis=-1) & (weights > 0)
    weights = require_finite("weights", np.where(visible, weights, 0.0))
    return np.where(visible[..., None], pixels, 0.0), weights * prior.detector.visible


class _Attempt(NamedTuple):
    """Attempt at a reconstruction: one labelling of left and right, its starts, and the refinement of one start."""

    exchanged: bool
    starts: Starts
    refinement: Refinement

    def fit(self) -> tuple[Fit, bool]:
        """Return the current fit, and True if left and right are exchanged in the whole clip.

        Limbs that are exchanged once more in most frames are as detected.
        """
        fit = self.refinement.fit()
        again = bool(sum(frames.mean() for frames in fit.exchanged.values()) > 1.0)
        if again:
            fit = replace(fit, exchanged={limb: ~frames for limb, frames in fit.exchanged.items()})
        return fit, self.exchanged != again


def _costs(attempts: Sequence[_Attempt]) -> np.ndarray:
    """Return the costs of all attempts, computed with the same noise so that they can be compared.

    The noise is estimated by the attempt with the smallest residual.
    """
    refined = [attempt.refinement for attempt in attempts]
    noise = min((attempt.noise for attempt in refined), key=lambda noise: noise.sigma_px)
    return np.array([attempt.cost(noise) for attempt in refined])


def _prune(attempts: Sequence[_Attempt]) -> None:
    """Refine all attempts in rounds, and drop attempts whose cost is far above the smallest cost."""
    remaining = list(attempts)
    for steps, max_gap in PRUNING_ROUNDS:
        for attempt in remaining:
            attempt.refinement.advance(steps)
        costs = _costs(remaining)
        remaining = [
            attempt for attempt, cost in zip(remaining, costs, strict=True) if cost <= costs.min() + max_gap
        ]
    for attempt in remaining:
        attempt.refinement.advance()


def _labels_disagree(fit: Fit) -> bool:
    """Return True if the left-right labels of the legs contradict those of the arms.

    They contradict each other if legs and arms of one side swing in step, or if either is exchanged in most frames.
    """
    ahead = fit.x[:SIZE].reshape(JOINTS, 3, -1)[:, 1, 1:3]
    legs, arms = (ahead[left] - ahead[right] for left, right in (LIMBS["legs"][-1], LIMBS["arms"][-1]))
    return legs.ravel() @ arms.ravel() > 0.0 or any(frames.mean() > 0.5 for frames in fit.exchanged.values())


def _best_of(attempts: Sequence[_Attempt]) -> tuple[_Attempt, list[Candidate]]:
    """Return the attempt with the smallest cost, and all distinct candidates, the best first."""
    costs = _costs(attempts)
    order = [int(number) for number in np.argsort(costs, kind="stable")]
    candidates: list[Candidate] = []
    for number in order:
        fit, exchanged = attempts[number].fit()
        candidate = Candidate(
            fit.frequency_hz,
            fit.x[HEADING],
            fit.x[PHASE],
            exchanged,
            costs[number] - costs[order[0]],
        )
        if not any(within_tolerance(candidate, other, DUPLICATE_TOLERANCE) for other in candidates):
            candidates.append(candidate)
    return attempts[order[0]], candidates


def find_shake(best: _Attempt) -> np.ndarray:
    """Return the shake of the camera (T, 2), px, from the residual that all joints of a frame have in common.

    A small shake is set to zero.
    """
    fit, used = best.refinement.fit(), best.refinement.used
    shake = np.zeros((len(used.pixels), 2))
    for turn in range(SHAKE_ROUNDS):
        if turn:
            again = Refinement(
                fit.objective.prior, fit.objective.setting, used, fit.start, best.starts.path,
                relabel=False, unknowns=fit.x,
            )  # fmt: skip
            fit = again.advance().fit()
        visible = (used.weights > 0)[..., None]
        residual = np.where(visible, fit.objective.residual(fit.x, used), np.nan)
        some = visible.sum(axis=(1, 2)) >= 4
        common = np.zeros_like(shake)
        common[some] = -median_of_seen(residual[some].swapaxes(1, 2), visible[some].swapaxes(1, 2))
        squares = np.minimum(residual[some] ** 2, (OUTLIER * fit.noise.sigma_px) ** 2)
        if not shake.any() and (common[some] ** 2).mean() < SHAKEN_SHARE * np.nanmean(squares):
            break
        shake += common
        used = Keypoints(used.pixels - common[:, None], used.weights)
    return shake


def _reconstruction(best: _Attempt, candidates: list[Candidate], shake: np.ndarray) -> Reconstruction:
    (fit, exchanged), used = best.fit(), best.refinement.used
    depth = fit.objective.camera_points(fit.x)[..., 2].mean()
    return Reconstruction(
        fit=fit,
        starts=best.starts,
        candidates=tuple(candidates),
        labels_exchanged=exchanged,
        labels_unsure=any(
            c.labels_exchanged != exchanged and c.cost_above_best < LABELS_UNSURE for c in candidates
        ),
        keypoints=used,
        rms_residual_px=_slow_residual(fit, used),
        shake_px=shake,
        height_px=fit.objective.focal_px(fit.x) * HEIGHT_MM / float(depth),
    )


def _slow_residual(fit: Fit, used: Keypoints) -> float:
    """Return the root mean square, px, of the slow part of the residual, which successive frames have in common."""
    visible = used.weights > 0
    residual = fit.objective.residual(fit.x, used)
    size = np.sqrt((residual**2).sum(axis=-1))
    residual *= np.minimum(1.0, OUTLIER * fit.noise.sigma_px / np.maximum(size, 1e-9))[..., None]
    square = np.mean(residual[visible] ** 2)
    times, both = fit.times, visible[1:] & visible[:-1]
    if (times[1] - times[0]) * MIN_WHITE_HZ > 1.0 or not both.any():
        return np.sqrt(square)
    white = 0.5 * np.mean((residual[1:] - residual[:-1])[both] ** 2)
    return np.sqrt(max(square - white, 0.0))


def reconstruct_followed(
    pixels: np.ndarray,
    weights: np.ndarray,
    frame_rate_hz: float,
    focal_px: float,
    prior: Prior,
    *,
    both_labellings: bool = True,
    focal_sd: float = 0.0,
    max_distance: float = np.inf,
) -> Reconstruction:
    """Reconstruct a walk with a straight path or, if its residual is large, with a wandering path.

    A wandering path allows for a camera that follows the walker.

    Nothing is refined if the feet clearly move together, because this is not a walk.

    Parameters
    ----------
    pixels, weights, frame_rate_hz, focal_px, prior, both_labellings, focal_sd, max_distance
        Parameters of `reconstruct` and options of `Fitting`.
    """
    clip = pixels, weights, frame_rate_hz, focal_px, prior
    strides = (len(pixels) - 1) / frame_rate_hz * np.exp(prior.model.log_frequency[0])
    cosines = int(COSINES_PER_STRIDE * strides)
    fitting = partial(Fitting, both_labellings=both_labellings, max_distance=max_distance)
    still = reconstruct(*clip, fitting(focal_sd=focal_sd, max_ankle_correlation=MAX_ANKLE_CORRELATION))
    enough = still.relative_residual <= FOLLOWED_RESIDUAL or strides < 2.0
    if enough or still.unshared_residual > MAX_UNSHARED_SHARE:
        return still
    # A following camera turns: positions in the image do not determine its focal length, which stays fixed.
    followed = reconstruct(*clip, fitting(cosines=cosines))
    surer = followed.relative_residual <= FOLLOWED_RESIDUAL
    gain = SMALL_RESIDUAL_GAIN if surer else FOLLOWED_GAIN
    better = followed.relative_residual < gain * still.relative_residual
    return followed if better else still
