"""Eigenwalkers against articulated trajectories on the same projections of walks: of no paper, ours.

Each of some walkers is left out of the model and seen by a perspective camera, still, walking around or shaking,
from several views; then with more noise, and with more joints hidden, from one view.  All methods are scored in the
same frames against the recorded motion (residual included), relative to the pelvis.

The camera stands at azimuth view angle + 180 degrees of `pipeline.core.camera_paths`: far away its image is then just
the horizontal of [zhang2007 B.2].  At 0 degrees it therefore stands behind the walker, at +90 on the right side; a
parallel projection cannot tell the back from the front seen in a mirror.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory.limb_choice import Smoothness, SmoothnessByRule
from pipeline.core.reconstruction import require_noise_variance
from pipeline.core.resampling import interpolate
from pipeline.storage.store import Artefact, derive_generator
from pipeline.studies.actions.observed_joints import occlusion
from pipeline.studies.actions.tracking_conditions import tracked
from pipeline.studies.face_off.methods import PELVIS, SeenWalk, by_articulation, by_eigenwalkers, mean_walker
from pipeline.studies.limbs.trials import camera_on
from pipeline.studies.options import FaceOffSweep
from pipeline.studies.sweep_checks import CAMERAS, check_names, check_values
from pipeline.studies.walks.phase_sources import fold
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput

EIGENWALKERS = ("least_squares", "map")
ARTICULATED = {
    "articulated": (False, False),
    "articulated_hinges": (True, False),
    "articulated_mirrors": (True, True),
}
"""Whether hinges are used, and mirrors tried."""

METHODS = (*EIGENWALKERS, "mean_walker", *ARTICULATED)
HUNG = np.delete(np.arange(15), PELVIS)
"""All joints but the pelvis, whose place is given."""


@dataclass(frozen=True, order=True)
class Condition:
    """What a walk is seen under."""

    view_angle_deg: float
    noise_px: float
    occluded: float


def conditions(options: FaceOffSweep) -> list[tuple[str, Condition]]:
    """What is varied, and the condition: every view undisturbed, then noise and occlusion each alone at one view.

    Raises
    ------
    InvalidInput
        If values are none, out of range, or do not increase.
    """
    for name in ("view_angle_deg", "noise_px", "occluded"):
        least, most = {"view_angle_deg": (-180.0, 180.0), "occluded": (0.0, 0.9)}.get(name, (0.0, np.inf))
        check_values(name, getattr(options, name), least, most)
    view, noise, hidden = options.varied_view_deg, options.noise_px, options.occluded
    return [
        *(("none", Condition(v, noise[0], hidden[0])) for v in options.view_angle_deg),
        *(("noise", Condition(view, v, hidden[0])) for v in noise),
        *(("occlusion", Condition(view, noise[0], v)) for v in hidden),
    ]


def measure(
    options: FaceOffSweep, ingest: Artefact, dataset: Artefact, model: Artefact, workers: int, seed: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors of both families, of W walkers under D conditions before C cameras, and one walker to look at.

    Parameters
    ----------
    options : FaceOffSweep
    ingest, dataset, model : Artefact
        Walks, their Fourier representations, and eigenwalkers learnt without each walker.
    workers, seed : int
        Every walker has its own generators: noise grows and hidden runs lengthen from one condition to the next.

    Returns
    -------
    arrays : dict
        ``methods`` (M,), ``cameras`` (C,), ``walkers`` (W,) indices into the data set, ``frames`` (W,);
        ``varied``, ``view_angle_deg``, ``noise_px``, ``occluded`` (D,); ``error_mm`` (W, D, C, M, 15) mean over
        frames, NaN where a method cannot be used; ``missing_dimension_error_mm`` (W, D, C, M) along the camera's
        axis; ``shown`` (1,) index of a walker, ``shown_true`` (F, 15, 3), ``shown_positions`` (C, M, F, 15, 3),
        ``shown_images`` (C, F, 15, 2) px.
    notes : dict

    Raises
    ------
    InvalidInput
        If an option is unknown or out of range, or a walk is too short.
    """
    wanted = conditions(options)
    _check(options)
    chosen = tracked(options.walkers, len(dataset.arrays["clip"]))
    distinct = sorted({condition for _, condition in wanted})
    noise_px = options.noise_px[len(options.noise_px) // 2]
    shown = Condition(options.varied_view_deg, noise_px, options.occluded[0])

    def one(r: int) -> _Scores:
        return _Walk(options, ingest, dataset, model, r, seed).scores(distinct, shown)

    found = map_threads(one, [int(r) for r in chosen], workers)
    rows = [distinct.index(condition) for _, condition in wanted]
    # The walker whose error by the articulated method, hinges kept, is the median one of the condition shown.
    error = np.stack([f.error for f in found])[:, rows]
    of_shown = error[:, rows.index(distinct.index(shown)), 0, METHODS.index("articulated_hinges")]
    middle = int(np.argsort(of_shown[:, HUNG].mean(axis=-1), kind="stable")[len(found) // 2])
    picked = found[middle]
    return {
        "methods": np.array(METHODS),
        "cameras": np.array(options.cameras),
        "walkers": chosen,
        "frames": np.array([f.frames for f in found]),
        "varied": np.array([varied for varied, _ in wanted]),
        **{
            name: np.array([getattr(condition, name) for _, condition in wanted])
            for name in ("view_angle_deg", "noise_px", "occluded")
        },
        "error_mm": error,
        "missing_dimension_error_mm": np.stack([f.missing for f in found])[:, rows],
        "shown": chosen[[middle]],
        "shown_true": picked.shown["true"],
        "shown_positions": picked.shown["positions"],
        "shown_images": picked.shown["images"],
    }, {
        "shown_view_angle_deg": shown.view_angle_deg,
        "shown_noise_px": shown.noise_px,
        "phase_source": "observed2d",
    }


def _check(options: FaceOffSweep) -> None:
    check_names("cameras", options.cameras, CAMERAS)
    require_noise_variance(options.noise_variance_mm2)
    for name, value, least in (
        ("frames", options.frames, 10),
        ("frame_rate_hz", options.frame_rate_hz, 1.0),
        ("components", options.components, 0),
        ("softness", options.softness, 0.0),
        ("distance_mm", options.distance_mm, 1.0),
        ("focal_px", options.focal_px, 1.0),
        ("time_limit_s", options.time_limit_s, 0.0),
    ):
        check_values(name, [value], least)


@dataclass(frozen=True)
class _Scores:
    """Errors (D, C, M, 15) and along the camera's axis (D, C, M) of one walker, mm; what is shown of it."""

    frames: int
    error: np.ndarray
    missing: np.ndarray
    shown: dict[str, np.ndarray] = field(default_factory=dict)


class _Walk:
    """One walker, left out, before every camera."""

    def __init__(
        self, options: FaceOffSweep, ingest: Artefact, dataset: Artefact, model: Artefact, r: int, seed: int
    ) -> None:
        data, first = dataset.arrays, ingest.arrays["first"]
        walk = int(data["walk"][r])
        motion = ingest.arrays["positions"][first[walk] : first[walk + 1]]
        rate_hz = float(ingest.arrays["frame_rate_hz"][walk])
        motion = data["scale"][r] * (motion - data["origin_mm"][r])
        at_s = _middle(len(motion), rate_hz, options, str(data["clip"][r]))
        self.options, self.model = options, fold(model, r)
        self.truth = interpolate(motion, at_s * rate_hz)
        self.harmonics = data["coefficients"].shape[1] // 2
        self.frequency_hz = float(data["frequency_hz"][r])
        self.phase = float(data["phase_rad"][r]) + 2 * np.pi * self.frequency_hz * float(at_s[0])
        cutoff, most = options.softness or None, min(options.components, len(self.truth))
        self.smoothness = Smoothness(most, cutoff) if most else SmoothnessByRule(cutoff)
        self._place = (seed, f"sweep:face_off:{data['source'][r]}:{data['clip'][r]}")

    def _generator(self, what: str) -> np.random.Generator:
        seed, place = self._place
        return derive_generator(seed, f"{place}:{what}")

    def seen(self, condition: Condition, kind: str) -> SeenWalk:
        """The walk as a camera shows it."""
        angle, root = float(np.radians(condition.view_angle_deg)), self.truth[:, PELVIS]
        camera = camera_on(
            kind,
            root,
            self._generator("camera"),
            distance_mm=self.options.distance_mm,
            focal_px=self.options.focal_px,
            around_deg=self.options.around_deg,
            azimuth_rad=angle + np.pi,
        )
        images = camera.project(self.truth)
        images += condition.noise_px * self._generator("noise").standard_normal(images.shape)
        frames, joints = images.shape[:2]
        hides = self._generator("hidden")
        hidden = occlusion(frames, joints, condition.occluded, self.options.occlusion_frames, hides)
        hidden[:, PELVIS] = False  # its trajectory is given
        images[hidden] = np.nan
        return SeenWalk(images, camera, root, self.options.frame_rate_hz, angle)

    def motions(self, walk: SeenWalk, kind: str, condition: Condition) -> np.ndarray:
        """What each method makes of it (M, F, 15, 3), mm; NaN where it cannot be used."""
        options = self.options
        made = np.full((len(METHODS), *self.truth.shape), np.nan)
        if kind == "still":
            variances = [None, options.noise_variance_mm2]
            made[:2] = by_eigenwalkers(self.model, walk, variances, harmonics=self.harmonics)
        made[2] = mean_walker(self.model, walk.times_s, self.frequency_hz, self.phase)
        for method, (use_hinges, try_mirrors) in ARTICULATED.items():
            made[METHODS.index(method)] = by_articulation(
                walk,
                self.truth,
                self.smoothness,
                noise_px=condition.noise_px,
                use_hinges=use_hinges,
                try_mirrors=try_mirrors,
                refine=options.refine,
                time_limit_s=options.time_limit_s,
            )
        return made

    def scores(self, wanted: list[Condition], shown: Condition) -> _Scores:
        """Errors under all conditions before all cameras."""
        true = self.truth - self.truth[:, [PELVIS]]
        error = np.empty((len(wanted), len(self.options.cameras), len(METHODS), 15))
        missing = np.empty(error.shape[:-1])
        kept: dict[str, list[np.ndarray]] = {"positions": [], "images": []}
        for d, condition in enumerate(wanted):
            for c, kind in enumerate(self.options.cameras):
                walk = self.seen(condition, kind)
                made = self.motions(walk, kind, condition)
                off = made - made[:, :, [PELVIS]] - true
                error[d, c] = np.linalg.norm(off, axis=-1).mean(axis=1)
                axis = np.broadcast_to(walk.camera.rotation[..., 2, :], (len(true), 3))
                missing[d, c] = np.abs(np.einsum("mtjc,tc->mtj", off[:, :, HUNG], axis)).mean(axis=(1, 2))
                if condition == shown:
                    kept["positions"].append(made)
                    kept["images"].append(walk.images)
        return _Scores(
            len(true), error, missing, {"true": self.truth, **{k: np.stack(v) for k, v in kept.items()}}
        )


def _middle(frames: int, rate_hz: float, options: FaceOffSweep, clip: str) -> np.ndarray:
    """Times (F,), s, of the frames that are used: out of the middle of the walk, at their own rate."""
    count = min(options.frames, 1 + int(np.floor((frames - 1) / rate_hz * options.frame_rate_hz + 1e-9)))
    if count < 10:
        raise InvalidInput("a walk is too short", where=clip, expected="10 frames", received=str(count))
    return (frames - 1) / (2 * rate_hz) + (np.arange(count) - (count - 1) / 2) / options.frame_rate_hz
