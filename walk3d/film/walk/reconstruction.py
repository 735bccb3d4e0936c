"""From keypoints of one camera to a walk: starts, refinement, choice between candidates and labellings, error bars."""

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
    give_bias_back,
    posterior,
    relative_positions,
)
from walk3d.film.walk.prior import Prior
from walk3d.film.walk.refinement import Fit, Refinement, relabelled
from walk3d.film.walk.start import Place, Starts, alike, find_starts
from walk3d.film.walk.training import HEIGHT_MM, SIZE
from walk3d.film.walk.view import level_axes

_LEGS = [*LEFT_LEG[1:], *RIGHT_LEG[1:]]

SAME = (np.radians(4.0), np.radians(8.0), 0.015)
"""Candidates that differ by less in heading, phase and relative frequency are one."""
OUTLIER = 5.0
"""A keypoint is not counted as farther away than so many sigma, when the residual is judged."""
FOLLOWED_RESIDUAL = 1.3
"""Residual, per cent of the height, above which a wandering path is tried."""
FOLLOWED_GAIN = 0.8
"""A wandering path is believed if it leaves less than this share of the residual."""
SURER_GAIN = 0.9
"""The same, where what it leaves is no longer large."""
UNSHARED = 0.93
"""Share of the residual that no path takes away, above which none is tried: where one was believed, at most 0.87."""
SHAKEN_SHARE = 0.3
"""Share of the residual's square that all joints of a frame have in common, above which the camera shook."""
SHAKE_ROUNDS = 2
SLOWEST_WHITE_HZ = 20.0
"""Below this frame rate the next frame's residual is not nearly the same one, and none of it is called white."""
SURELY_TOGETHER = 0.5
"""Correlation of the two ankles, each about its hip, beyond which nobody walks, at whatever frame rate and camera."""
COSINES_PER_STRIDE = 0.8
"""Cosines for each stride of the clip: the fastest has a period of 2.5 strides."""
RACES = ((1, 800.0), (1, 1500.0), (1, 1500.0), (2, 400.0), (3, 200.0))
"""Steps of every start, and the difference of cost then beyond which it is given up: the best never was."""
LABELS_UNSURE = 100.0
"""A difference of cost between labellings below which both are returned."""


@dataclass(frozen=True)
class Candidate(Place):
    """One place to which a start led.

    Attributes
    ----------
    labels_exchanged : bool
        Whether left and right were exchanged throughout.
    cost_above_best : float
        Twice the negative logarithm of its probability relative to the best, uncalibrated.
    """

    labels_exchanged: bool
    cost_above_best: float


@shortened
class Reconstruction:
    """A walk from keypoints.

    Attributes
    ----------
    fit : Fit
    starts : Starts
    candidates : tuple of Candidate
        All of them, the chosen one first.
    labels_exchanged : bool
        Whether left and right of all keypoints were exchanged.
    labels_unsure : bool
        Whether the other labelling explains the keypoints about as well.
    keypoints : Keypoints
        As used: labels exchanged where the fit says so.
    rms_residual_px : float
        Root mean square of the residual along an image axis without its white part; a point counts at most as
        `OUTLIER` times sigma.
    shake_px : (T, 2)
        Taken out of all keypoints of each frame, for a camera that shook; 0 if it did not.
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
        """100 times the residual over the height in the image: g."""
        return 100.0 * self.rms_residual_px / self.height_px

    @property
    def leg_motion(self) -> float:
        """Motion of knees and ankles in the image over that of the average walker from the same side."""
        image = level_axes(self.fit.x[HEADING])[:2]
        average = image @ self.fit.objective.prior.model.mean[_LEGS, :, 1:]
        expected = 0.5 * (average**2).sum(axis=(1, 2))  # of a sine or cosine, half the square
        metric, seen = self.starts.path.metric, self.keypoints.weights > 0
        power = [
            (metric[seen[:, joint], joint].var(axis=0).sum(), expected[k])
            for k, joint in enumerate(_LEGS)
            if seen[:, joint].sum() > 1
        ]
        if not power:
            return 0.0
        moved, usual = np.sum(power, axis=0)
        return np.sqrt(moved / usual)

    @property
    def unshared_residual(self) -> float:
        """Share of the residual, 0 to 1, that is neither a shift nor a change of size of the whole body in a frame."""
        weights = (self.keypoints.weights > 0)[..., None].astype(float)
        count = np.maximum(weights.sum(axis=1, keepdims=True), 1.0)
        whole = weights * self.fit.objective.residual(self.fit.x, self.keypoints)
        residual, body = (
            weights * (values - (weights * values).sum(axis=1, keepdims=True) / count)
            for values in (whole, self.keypoints.pixels)
        )
        larger = (residual * body).sum(axis=(1, 2)) / np.maximum((body**2).sum(axis=(1, 2)), 1e-9)
        left = residual - larger[:, None, None] * body
        return np.sqrt((left**2).sum() / max((whole**2).sum(), 1e-9))

    @cached_property
    def posterior(self) -> Posterior:
        """The walk and its error bars; computed when it is asked for: most that is tried is not told."""
        return posterior(self.fit.objective.prior, self.fit, self.keypoints)

    @property
    def positions_mm(self) -> np.ndarray:
        """Positions (T, 15, 3) as `posterior` has them, without their error bars."""
        walker = give_bias_back(self.fit.objective.prior, self.fit.x[:SIZE])
        return relative_positions(walker, self.fit.x, self.fit.times)

    @property
    def focal_px(self) -> float:
        """Focal length: the one that is known, or the one that was found."""
        return self.fit.objective.focal_px(self.fit.x)

    @property
    def focal_found(self) -> bool:
        """Whether the focal length was an unknown."""
        return self.fit.objective.setting.focal_sd > 0

    @property
    def image_px(self) -> np.ndarray:
        """Image (T, 15, 2) of the walker as fitted, relative to the principal point, shaken as the camera was."""
        return self.fit.objective.image(self.fit.x) + self.shake_px[:, None]

    @property
    def filmed_px(self) -> np.ndarray:
        """Keypoints (T, 15, 2) as used, with the shake of the camera."""
        return self.keypoints.pixels + self.shake_px[:, None]

    @cached_property
    def cycle(self) -> GaitCycle:
        """Events and numbers of the average cycle."""
        return gait_cycle(self.posterior.walker, self.fit.frequency_hz, self.fit.objective.prior.belt)

    @property
    def event_times(self) -> list[list[tuple[np.ndarray, np.ndarray]]]:
        """Times at which each foot is set down and taken off in the clip, and their standard deviations, s."""
        fit = self.fit
        return event_times(self.cycle, self.posterior.covariance, fit.x[PHASE], fit.frequency_hz, fit.times)

    @property
    def strides(self) -> float:
        """Strides that the clip holds."""
        return (self.fit.times[-1] - self.fit.times[0]) * self.fit.frequency_hz


@dataclass(frozen=True, kw_only=True)
class Fitting:
    """How a walk is fitted to keypoints.

    Attributes
    ----------
    both_labellings : bool
        Whether to try left and right exchanged throughout, too.
    overground : bool, optional
        Whether the walker moves through space; None: decided by the path.  False: the path is not as fast as the feet
        say, even if the walker moves through space.
    relabel : bool
        Whether to look for frames with exchanged labels.
    most_starts : int
    cosines : int
        Number of cosines of a path that wanders, or of a camera that follows; 0 for a still camera and a nearly
        straight path.
    nu : float
        Degrees of freedom of the residuals' Student's t.
    focal_sd : float
        Standard deviation of the logarithm of the focal length, which is then an unknown of the fit; 0: it is known.
    most_distance, most_together : float
        `Starts.least_distance` and `Starts.ankles_together` beyond which nothing is refined.
    """

    both_labellings: bool = True
    overground: bool | None = None
    relabel: bool = True
    most_starts: int = 4
    cosines: int = 0
    nu: float = NU
    focal_sd: float = 0.0
    most_distance: float = np.inf
    most_together: float = np.inf


def reconstruct(
    pixels: np.ndarray,
    weights: np.ndarray,
    frame_rate_hz: float,
    focal_px: float,
    prior: Prior,
    fitting: Fitting = Fitting(),
) -> Reconstruction:
    """Reconstruct a straight walk.

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
        If the ankles move together (then `code` is ``"feet_together"``), the arrays do not fit, too little is seen,
        no person stands upright, or no walker looks like this.
    """
    pixels, weights = _seen(pixels, weights, prior)
    require_range("the frame rate", frame_rate_hz, above=0, unit="Hz")
    require_range("the focal length", focal_px, above=0, unit="px")
    times = (np.arange(len(pixels)) - (len(pixels) - 1) / 2.0) / frame_rate_hz

    def begin(pixels: np.ndarray, exchanged: dict[str, np.ndarray]) -> Iterator[_Begun]:
        for other in (False, True) if fitting.both_labellings else (False,):
            given = (exchange_all(pixels), exchange_all(weights)) if other else (pixels, weights)
            keypoints = Keypoints(*given)
            used = relabelled(keypoints, exchanged)
            starts = find_starts(used.pixels, used.weights, times, focal_px, prior, fitting.cosines)
            if fitting.overground is not None:
                starts = replace(starts, overground=fitting.overground)
            setting = Setting(
                times, focal_px, starts.overground, fitting.cosines, fitting.nu, fitting.focal_sd
            )
            refine = partial(Refinement, prior, setting, keypoints, path=starts.path, relabel=fitting.relabel)
            for start in starts.starts[: fitting.most_starts]:
                yield _Begun(other, starts, refine(start, exchanged=exchanged))

    def best_of(pixels: np.ndarray) -> tuple[_Begun, list[Candidate]]:
        none = np.zeros(len(times), bool)
        begun = list(begin(pixels, {"legs": none, "arms": none}))
        if (together := begun[0].starts.ankles_together) > fitting.most_together:
            raise InvalidInput(
                "the feet move together",
                expected=f"a correlation of {fitting.most_together:g} or less",
                received=f"{together:.2f}",
                code="feet_together",
            )
        if min(one.starts.least_distance for one in begun) > fitting.most_distance:
            raise InvalidInput("a walker looks like this from no side", code="no_view_fits")
        _race(begun)
        both = fitting.relabel and fitting.both_labellings
        if both and _at_odds(begun[np.argmin(_costs(begun))].fit()[0]):
            begun += (legs_exchanged := list(begin(pixels, {"legs": ~none, "arms": none})))
            _race(legs_exchanged)
        return _best_of(begun)

    best, candidates = best_of(pixels)
    shake = find_shake(best)
    if shake.any():
        best, candidates = best_of(pixels - shake[:, None])
    return _reconstruction(best, candidates, shake)


def _seen(pixels: np.ndarray, weights: np.ndarray, prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """Return keypoints and their weights, 0 where nothing is seen."""
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
    seen = np.isfinite(pixels).all(axis=-1) & (weights > 0)
    weights = require_finite("weights", np.where(seen, weights, 0.0))
    return np.where(seen[..., None], pixels, 0.0), weights * prior.detector.seen


class _Begun(NamedTuple):
    """A start: whether labels are exchanged throughout, where it comes from, and how far it is refined."""

    exchanged: bool
    starts: Starts
    on_its_way: Refinement

    def fit(self) -> tuple[Fit, bool]:
        """Return the walker so far, and whether labels are exchanged throughout.

        All limbs exchanged again in most frames are as they were given.
        """
        fit = self.on_its_way.fit()
        again = bool(sum(frames.mean() for frames in fit.exchanged.values()) > 1.0)
        if again:
            fit = replace(fit, exchanged={limb: ~frames for limb, frames in fit.exchanged.items()})
        return fit, self.exchanged != again


def _costs(begun: Sequence[_Begun]) -> np.ndarray:
    """Costs at one noise: that of the start with the smallest residual."""
    refined = [one.on_its_way for one in begun]
    noise = min((one.noise for one in refined), key=lambda noise: noise.sigma_px)
    return np.array([one.cost(noise) for one in refined])


def _race(begun: Sequence[_Begun]) -> None:
    """Refine starts; what falls far behind is given up."""
    racing = list(begun)
    for steps, behind in RACES:
        for one in racing:
            one.on_its_way.advance(steps)
        costs = _costs(racing)
        racing = [one for one, cost in zip(racing, costs, strict=True) if cost <= costs.min() + behind]
    for one in racing:
        one.on_its_way.advance()


def _at_odds(fit: Fit) -> bool:
    """Whether legs and arms seem to be labelled for other sides: they swing in step, or one is mostly exchanged."""
    ahead = fit.x[:SIZE].reshape(JOINTS, 3, -1)[:, 1, 1:3]
    legs, arms = (ahead[left] - ahead[right] for left, right in (LIMBS["legs"][-1], LIMBS["arms"][-1]))
    return legs.ravel() @ arms.ravel() > 0.0 or any(frames.mean() > 0.5 for frames in fit.exchanged.values())


def _best_of(begun: Sequence[_Begun]) -> tuple[_Begun, list[Candidate]]:
    """Return the start that led to the least cost, and all that differ, best first."""
    costs = _costs(begun)
    order = [int(number) for number in np.argsort(costs, kind="stable")]
    candidates: list[Candidate] = []
    for number in order:
        fit, exchanged = begun[number].fit()
        candidate = Candidate(
            fit.frequency_hz,
            fit.x[HEADING],
            fit.x[PHASE],
            exchanged,
            costs[number] - costs[order[0]],
        )
        if not any(alike(candidate, other, SAME) for other in candidates):
            candidates.append(candidate)
    return begun[order[0]], candidates


def find_shake(best: _Begun) -> np.ndarray:
    """What the residuals of a frame's joints have in common (T, 2), px, if that is much of them; else zeros."""
    fit, used = best.on_its_way.fit(), best.on_its_way.used
    shake = np.zeros((len(used.pixels), 2))
    for turn in range(SHAKE_ROUNDS):
        if turn:
            again = Refinement(
                fit.objective.prior, fit.objective.setting, used, fit.start, best.starts.path,
                relabel=False, unknowns=fit.x,
            )  # fmt: skip
            fit = again.advance().fit()
        seen = (used.weights > 0)[..., None]
        residual = np.where(seen, fit.objective.residual(fit.x, used), np.nan)
        some = seen.sum(axis=(1, 2)) >= 4
        common = np.zeros_like(shake)
        common[some] = -median_of_seen(residual[some].swapaxes(1, 2), seen[some].swapaxes(1, 2))
        squares = np.minimum(residual[some] ** 2, (OUTLIER * fit.noise.sigma_px) ** 2)
        if not shake.any() and (common[some] ** 2).mean() < SHAKEN_SHARE * np.nanmean(squares):
            break
        shake += common
        used = Keypoints(used.pixels - common[:, None], used.weights)
    return shake


def _reconstruction(best: _Begun, candidates: list[Candidate], shake: np.ndarray) -> Reconstruction:
    (fit, exchanged), used = best.fit(), best.on_its_way.used
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
    """Root mean square residual, px, less its white part: what two frames in succession have in common."""
    seen = used.weights > 0
    residual = fit.objective.residual(fit.x, used)
    size = np.sqrt((residual**2).sum(axis=-1))
    residual *= np.minimum(1.0, OUTLIER * fit.noise.sigma_px / np.maximum(size, 1e-9))[..., None]
    square = np.mean(residual[seen] ** 2)
    times, both = fit.times, seen[1:] & seen[:-1]
    if (times[1] - times[0]) * SLOWEST_WHITE_HZ > 1.0 or not both.any():
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
    most_distance: float = np.inf,
) -> Reconstruction:
    """Reconstruct a walk; if much is left, with a path that wanders, too, as before a camera that follows.

    Nothing is refined of somebody whose feet surely move together: no walk would come of it.

    Parameters
    ----------
    pixels, weights, frame_rate_hz, focal_px, prior, both_labellings, focal_sd, most_distance
        As `reconstruct` and `Fitting` have them.
    """
    given = pixels, weights, frame_rate_hz, focal_px, prior
    strides = (len(pixels) - 1) / frame_rate_hz * np.exp(prior.model.log_frequency[0])
    cosines = int(COSINES_PER_STRIDE * strides)
    fitting = partial(Fitting, both_labellings=both_labellings, most_distance=most_distance)
    still = reconstruct(*given, fitting(focal_sd=focal_sd, most_together=SURELY_TOGETHER))
    enough = still.relative_residual <= FOLLOWED_RESIDUAL or strides < 2.0
    if enough or still.unshared_residual > UNSHARED:
        return still
    # A camera that follows turns: where in the image somebody is says nothing of its focal length, which is held.
    followed = reconstruct(*given, fitting(cosines=cosines))
    surer = followed.relative_residual <= FOLLOWED_RESIDUAL
    gain = SURER_GAIN if surer else FOLLOWED_GAIN
    better = followed.relative_residual < gain * still.relative_residual
    return followed if better else still
