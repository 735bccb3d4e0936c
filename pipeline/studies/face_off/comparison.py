"""Eigenwalkers against articulated trajectories on the same projections of walks: of no paper, ours.

Each of some walkers is left out of the model and seen by a perspective camera, still, walking around or shaking,
from several views; then with more noise, with more joints hidden, and with a wrong heading, from one view.  All methods
are scored in the same frames against the recorded motion (residual included), relative to the pelvis.

The camera stands at azimuth view angle + 180 degrees of `pipeline.core.camera_paths`: far away its image is then just
the horizontal of [zhang2007 B.2].  At 0 degrees it therefore stands behind the walker, at +90 on the right side; a
parallel projection cannot tell the back from the front seen in a mirror.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Annotated

import numpy as np
import pandas as pd

from pipeline.clips.kinds import Walks
from pipeline.core.anatomical import Prior
from pipeline.core.articulated_trajectory import Options, TrajectoryBasis, prepared
from pipeline.core.choice import evenly
from pipeline.core.limb_chain import WALKER14, true_lengths
from pipeline.core.resampling import interpolate
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.face_off.methods import (
    PELVIS,
    SeenWalk,
    by_anatomy,
    by_eigenwalkers,
    by_image_and_average,
    mean_walker,
)
from pipeline.studies.limbs.cameras import Camera, CameraSweep
from pipeline.studies.occlusion import occlusion, require_occlusion
from pipeline.studies.study import SweepInputs, scaled
from pipeline.validation import (
    Count,
    CountOrAll,
    Finite,
    Increasing,
    InvalidInput,
    NonNegative,
    Positive,
    ViewAngle,
    bounded,
    require_choice,
)
from walk3d.anatomy.method import AnatomicalApproach

EIGENWALKERS = ("least_squares", "map")
ARTICULATED = {
    "articulated": (False, False),
    "articulated_hinges": (True, False),
    "articulated_mirrors": (True, True),
}
"""Whether hinges are used, and mirrors tried."""

KEEP_THE_IMAGE = (*EIGENWALKERS, "anatomical", "image_and_average")
"""For a still camera alone."""

METHODS = (*KEEP_THE_IMAGE, "mean_walker", *ARTICULATED)

CHILDREN = np.delete(np.arange(15), PELVIS)
"""All joints but the pelvis, whose place is given."""

LEAST_FRAMES = 10

WalkInputs = SweepInputs[Walks, FourierSamples, Eigenwalkers]


@dataclass(frozen=True, order=True)
class Condition:
    """What a walk is seen under."""

    view_angle_deg: float
    noise_px: float
    occluded: float
    heading_error_deg: float = 0.0


@dataclass(frozen=True)
class MethodErrors:
    """Errors of M methods before C cameras, and one walker to look at.

    Attributes
    ----------
    rows : DataFrame
        A row to each walker, condition (by what is varied: ``none``, ``noise``, ``occlusion`` or ``heading``), camera
        and method that it can be given to: mean over frames and joints of the distance from the truth about the pelvis,
        and of that along the camera's axis.
    joints : DataFrame
        A row to each joint but the pelvis, where nothing is varied.
    methods : (M,) text
    walkers : (W,) int
        Of the data set.
    shown : (1,) int
        Index of a walker in the data set: the one whose error by the articulated method, hinges kept, is the median
        one of the condition shown.
    shown_true : (F, 15, 3)
        mm.
    shown_positions : (C, M, F, 15, 3)
        mm.
    shown_images : (C, F, 15, 2)
        px.
    shown_view_angle_deg, shown_noise_px : float
    """

    rows: pd.DataFrame
    joints: pd.DataFrame
    methods: np.ndarray
    walkers: np.ndarray
    shown: np.ndarray
    shown_true: np.ndarray
    shown_positions: np.ndarray
    shown_images: np.ndarray
    shown_view_angle_deg: float
    shown_noise_px: float


class FaceOffSweep(CameraSweep):
    """Walks reconstructed by eigenwalkers and by articulated trajectories from the same projections."""

    view_angle_deg: Increasing[ViewAngle] = [0.0, 30.0, 60.0, 90.0]  # true views
    walkers: CountOrAll = scaled(value="faced")  # evenly over all; 0: all
    frames: Annotated[int, bounded(at_least=LEAST_FRAMES)] = 100  # of each walk; fewer where shorter
    frame_rate_hz: Annotated[float, bounded(at_least=1)] = 30.0  # at which walks are resampled
    noise_px: Increasing[NonNegative] = [0.0, 1.0, 3.0]  # of the image
    occluded: Increasing[Finite] = [0.0, 0.1, 0.3]  # share of joints unseen, in runs
    occlusion_frames: float = 10.0  # mean length of such a run
    heading_error_deg: Increasing[Annotated[float, bounded(at_least=0, at_most=180)]] = [  # of what was learnt
        0.0, 5.0, 10.0, 20.0,
    ]  # fmt: skip
    varied_view_deg: ViewAngle = 30.0  # one of them, where noise, occlusion and heading are varied
    components: Count = 20  # of the trajectory basis
    softness: NonNegative = 30.0  # of the trajectory basis; 0: a hard one, which long gaps leave undetermined
    noise_variance_mm2: Positive = 70.0  # of approach II

    @property
    def reads_clips(self) -> bool:
        """The truth is the motion itself."""
        return True

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_occlusion(self.occluded, self.occlusion_frames)
        require_choice("sweep.varied_view_deg", self.varied_view_deg, self.view_angle_deg)

    def conditions(self) -> list[tuple[str, Condition]]:
        """Return what is varied, and the condition: every view undisturbed, then one thing varied at one view."""
        view, noise, hidden = self.varied_view_deg, self.noise_px, self.occluded
        return [
            *(("none", Condition(v, noise[0], hidden[0])) for v in self.view_angle_deg),
            *(("noise", Condition(view, v, hidden[0])) for v in noise),
            *(("occlusion", Condition(view, noise[0], v)) for v in hidden),
            *(("heading", Condition(view, noise[0], hidden[0], v)) for v in self.heading_error_deg),
        ]

    def measure(self, inputs: WalkInputs) -> MethodErrors:
        """Return the errors of all methods.

        Every walker has generators of its own: noise grows and hidden runs lengthen from one condition to the next.
        """
        wanted = self.conditions()
        whole = np.flatnonzero(~inputs.dataset.unmeasured.any(axis=1))
        if not len(whole):
            raise InvalidInput(
                "limbs need walks of which every joint was measured", received="an estimated joint in each"
            )
        chosen = whole[evenly(self.walkers, len(whole))]
        distinct = sorted({condition for _, condition in wanted})
        noise_px = self.noise_px[len(self.noise_px) // 2]
        shown = Condition(self.varied_view_deg, noise_px, self.occluded[0])
        anatomy = AnatomicalApproach(replace(inputs.dataset, frequency=False))  # which it makes no use of
        found = map_processes(
            lambda r: _Walk(self, inputs, int(r), anatomy.prior(int(r))).scores(distinct, shown),
            chosen,
            inputs.workers,
        )
        conditions = pd.DataFrame({"varied": varied, **asdict(condition)} for varied, condition in wanted)
        joints = conditions.merge(pd.concat([scores.joints for scores in found]))
        of = ["varied", *asdict(shown), "person", "walker", "camera", "method", "frames"]
        errors = ["error_mm", "missing_dimension_error_mm"]
        of_shown = [
            np.linalg.norm(
                _about_pelvis(walk.positions[0, METHODS.index("articulated_hinges")] - walk.true), axis=-1
            )
            for walk in found
        ]
        middle = np.argsort([off[:, CHILDREN].mean() for off in of_shown], kind="stable")[len(found) // 2]
        picked = found[middle]
        return MethodErrors(
            rows=joints.groupby(of, as_index=False)[errors].mean(),
            joints=joints[joints["varied"] == "none"],
            methods=np.array(METHODS),
            walkers=chosen,
            shown=chosen[[middle]],
            shown_true=picked.true,
            shown_positions=picked.positions,
            shown_images=picked.images,
            shown_view_angle_deg=shown.view_angle_deg,
            shown_noise_px=shown.noise_px,
        )


@dataclass(frozen=True)
class _Scores:
    """Errors of one walker, a row to each condition, camera, method and joint; and what is shown of it.

    Attributes
    ----------
    joints : DataFrame
    true, positions, images : (F, 15, 3), (C, M, F, 15, 3), (C, F, 15, 2)
        Of the condition shown: mm, mm, px.
    """

    joints: pd.DataFrame
    true: np.ndarray
    positions: np.ndarray
    images: np.ndarray


class _Walk:
    """One walker, left out, before every camera."""

    def __init__(self, options: FaceOffSweep, inputs: WalkInputs, r: int, prior: Prior) -> None:
        data, clips = inputs.dataset, inputs.clips
        walk = int(data.walk[r])
        rate_hz = clips.frame_rate_hz[walk]
        motion = data.scale[r] * (clips.motion(walk) - data.origin_mm[r])
        at_s = _middle(len(motion), rate_hz, options, str(data.clip[r]))
        self.options, self.model, self.prior = options, inputs.model.fold(r), prior
        self.truth = interpolate(motion, at_s * rate_hz)
        self.harmonics = data.coefficients.shape[1] // 2
        self.frequency_hz = data.frequency_hz[r]
        self.phase = data.phase_rad[r] + 2 * np.pi * self.frequency_hz * at_s[0]
        self.basis = TrajectoryBasis(min(options.components, len(self.truth)), options.softness or None)
        self._articulated: dict[tuple[Condition, Camera], list[np.ndarray]] = {}
        self.walker = {"person": data.person[r], "walker": data.clip[r], "frames": len(self.truth)}
        self._place = (inputs.seed, f"sweep:face_off:{data.source[r]}:{data.clip[r]}")

    def _generator(self, what: str) -> np.random.Generator:
        seed, place = self._place
        return derive_generator(seed, f"{place}:{what}")

    def seen(self, condition: Condition, kind: Camera) -> SeenWalk:
        """Return the walk as a camera shows it."""
        options, root = self.options, self.truth[:, PELVIS]
        angle = np.radians(condition.view_angle_deg)
        camera = options.camera(kind, root, self._generator("camera"), azimuth_rad=angle + np.pi)
        images = camera.project(self.truth)
        images += condition.noise_px * self._generator("noise").standard_normal(images.shape)
        frames, joints = images.shape[:2]
        hides = self._generator("hidden")
        hidden = occlusion(frames, joints, condition.occluded, options.occlusion_frames, hides)
        hidden[:, PELVIS] = False  # its trajectory is given
        images[hidden] = np.nan
        off = np.radians(condition.heading_error_deg)
        return SeenWalk(images, camera, root, options.frame_rate_hz, self.harmonics, angle, off)

    def motions(self, walk: SeenWalk, kind: Camera, condition: Condition) -> np.ndarray:
        """Return what each method makes of it (M, F, 15, 3), mm; NaN where it cannot be used."""
        options = self.options
        made = np.full((len(METHODS), *self.truth.shape), np.nan)
        average = mean_walker(
            self.model,
            walk.times_s,
            self.frequency_hz,
            self.phase,
            heading_error_rad=walk.heading_error_rad,
        )
        made[METHODS.index("mean_walker")] = average
        if kind is Camera.still:
            noise = options.noise_variance_mm2
            made[: len(KEEP_THE_IMAGE)] = [
                *by_eigenwalkers(self.model, walk, [None, noise]),
                by_anatomy(self.prior, self.model, walk, noise),
                by_image_and_average(walk, average),
            ]
        same = replace(condition, heading_error_deg=0.0), kind  # they know of no heading
        if same not in self._articulated:
            self._articulated[same] = self._by_articulation(walk, condition)
        made[-len(ARTICULATED) :] = self._articulated[same]
        return made

    def _by_articulation(self, walk: SeenWalk, condition: Condition) -> list[np.ndarray]:
        """Return what articulated trajectories make of it, each (F, 15, 3), mm [park2011 5, 6].

        They are told the noise of the image, as of a detector that has been tried, and the lengths of the limbs.
        """
        ways = [
            Options(
                self.basis,
                noise_px=condition.noise_px,
                use_hinges=use_hinges,
                try_mirrors=try_mirrors,
                refine=False,  # in the end, it would move errors by 3 %
                time_limit_s=0.0,
            )
            for use_hinges, try_mirrors in ARTICULATED.values()
        ]
        lengths = true_lengths(WALKER14, self.truth)
        skeleton = prepared(walk.images, walk.camera, walk.root, lengths, ways[0])
        return [skeleton.under(each).whole().positions for each in ways]

    def scores(self, wanted: list[Condition], shown: Condition) -> _Scores:
        """Return the errors under all conditions before all cameras."""
        rows, positions, images = [], [], []
        for condition in wanted:
            for kind in self.options.cameras:
                walk = self.seen(condition, kind)
                made = self.motions(walk, kind, condition)
                off = _about_pelvis(made - self.truth)[:, :, CHILDREN]
                axis = np.broadcast_to(walk.camera.rotation[..., 2, :], (len(self.truth), 3))
                error = np.linalg.norm(off, axis=-1).mean(axis=1)
                missing = np.abs(np.einsum("mtjc,tc->mtj", off, axis)).mean(axis=1)
                rows += [
                    pd.DataFrame(
                        {
                            **self.walker,
                            **asdict(condition),
                            "camera": str(kind),
                            "method": method,
                            "joint": np.array(WALKER15.joints)[CHILDREN],
                            "error_mm": error[m],
                            "missing_dimension_error_mm": missing[m],
                        }
                    )
                    for m, method in enumerate(METHODS)
                    if np.isfinite(error[m]).all()
                ]
                if condition == shown:
                    positions.append(made)
                    images.append(walk.images)
        return _Scores(pd.concat(rows), self.truth, np.stack(positions), np.stack(images))


def _about_pelvis(joints: np.ndarray) -> np.ndarray:
    return joints - joints[..., [PELVIS], :]


def _middle(frames: int, rate_hz: float, options: FaceOffSweep, clip: str) -> np.ndarray:
    """Times (F,), s, of the frames that are used: out of the middle of the walk, at their own rate."""
    count = min(options.frames, 1 + int(np.floor((frames - 1) / rate_hz * options.frame_rate_hz + 1e-9)))
    if count < LEAST_FRAMES:
        raise InvalidInput("a walk is too short", clip, f"{LEAST_FRAMES} frames", count)
    return (frames - 1) / (2 * rate_hz) + (np.arange(count) - (count - 1) / 2) / options.frame_rate_hz
