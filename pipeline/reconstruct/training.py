"""Training of the model that reconstructs walks: eigenwalkers, and error bars learnt on people who were left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pipeline.clips.walks import Walks
from pipeline.core import walking
from pipeline.core.anatomical import stance_rows
from pipeline.core.keypoint_walk import (
    HEIGHT_MM,
    Detector,
    Reconstruction,
    TrainingWalk,
    compact,
    expand,
    joint_angles,
    model_of,
    moments,
    prepare,
    reconstruct,
    training_walk,
)  # fmt: skip
from pipeline.core.keypoint_walk.calibration import LEVELS, Calibration, learn
from pipeline.reconstruct.model_file import TrainedModel
from pipeline.seeding import derive_generator
from pipeline.synthetic.keypoints import DetectorError, Filming, SimulatedKeypoints, simulate_keypoints
from pipeline.validation import require_range

HEADINGS_DEG = (0, 30, -30, 60, -60, 90, -90, 180)
_DOWN = np.array([0.0, 1.0, 0.0])


@dataclass(kw_only=True)
class Training:
    """Options of training.

    Attributes
    ----------
    components : int
        Eigenwalkers that are kept.
    seed : int
        Of the simulated clips on which error bars are learnt.
    """

    components: int = 14
    seed: int = 2007


@dataclass(frozen=True)
class LeftOutClip:
    """A simulated clip of somebody whom the model does not know, reconstructed.

    Attributes
    ----------
    person : str
    walk : int
    overground : bool
    simulated : SimulatedKeypoints
    found : Reconstruction
    """

    person: str
    walk: int
    overground: bool
    simulated: SimulatedKeypoints
    found: Reconstruction

    @property
    def scale(self) -> float:
        """Least-squares scale of the reconstruction to the truth."""
        estimate = self.found.posterior.positions_mm
        return float((estimate * self.simulated.positions_mm).sum() / (estimate**2).sum())

    @property
    def joint_errors(self) -> np.ndarray:
        """Errors (T, 15, 3) over standard deviations; 0 for the pelvis."""
        s, posterior = self.scale, self.found.posterior
        off = s * posterior.positions_mm - self.simulated.positions_mm
        return np.asarray(off / np.maximum(s * posterior.sd_mm, 1e-9))

    @property
    def angle_errors(self) -> np.ndarray:
        """Errors (T, 8) over standard deviations."""
        posterior = self.found.posterior
        truth = joint_angles(self.simulated.positions_mm, _DOWN)
        return np.asarray((posterior.angles_rad - truth) / posterior.angles_sd_rad)


def training_walks(walks: Walks) -> list[TrainingWalk]:
    """Walks of a corpus as the model is trained on them."""
    motions = [about_pelvis(walks, k) for k in range(len(walks))]
    return [
        training_walk(motion, float(rate), walking.stature(motion))
        for motion, rate in zip(motions, walks.frame_rate_hz, strict=True)
    ]


def about_pelvis(walks: Walks, number: int) -> np.ndarray:
    """Positions (T, 15, 3) of one walk about the mean pelvis, mm."""
    return walking.set_origin(walks.motion(number), origin="pelvis_mean")


def belt_speed_mm_s(walk: TrainingWalk) -> float:
    """Speed of the ground under a walker, by his own feet, in his own size."""
    _, belt = stance_rows(walk.walker)
    return float(2 * np.pi * walk.frequency_hz * (belt @ walk.walker.ravel()) * walk.height_mm / HEIGHT_MM)


def left_out_clips(
    walks: Walks, options: Training, error: DetectorError, *, headings_deg: tuple[int, ...] = HEADINGS_DEG
) -> Iterator[LeftOutClip]:
    """Reconstruct simulated clips of each person by a model that was trained without him.

    Parameters
    ----------
    walks : Walks
    options : Training
    error : DetectorError
    headings_deg : tuple of int
        Overground and on a treadmill each; a person's walks take turns.
    """
    trained = training_walks(walks)
    people = list(dict.fromkeys(walks.person.tolist()))
    for number, person in enumerate(people):
        others = walks.person != person
        rest = [walk for walk, other in zip(trained, others, strict=True) if other]
        without = moments(rest, walks.person[others])
        model = model_of(expand(compact(without, options.components)))
        prior = prepare(model, Detector(floor_mm=np.full(15, error.bias_mm)))
        mine = np.flatnonzero(~others)
        cases = [(overground, heading) for overground in (True, False) for heading in headings_deg]
        for case, (overground, heading) in enumerate(cases):
            k = int(mine[case % len(mine)])
            generator = derive_generator(options.seed, f"{number} {case}")
            speed = belt_speed_mm_s(trained[k]) if overground else 0.0
            filming = Filming(heading_rad=float(np.radians(heading)), speed_mm_s=speed)
            sim = simulate_keypoints(
                generator, about_pelvis(walks, k), float(walks.frame_rate_hz[k]), filming, error
            )
            seen = np.ones(sim.pixels.shape[:2])
            found = reconstruct(
                sim.pixels, seen, sim.frame_rate_hz, sim.focal_px, prior, both_labellings=False
            )
            yield LeftOutClip(person, k, overground, sim, found)


def train(walks: Walks, options: Training, tell: Callable[[str], None] = lambda _: None) -> TrainedModel:
    """Train a model and learn its error bars.

    Parameters
    ----------
    walks : Walks
    options : Training
    tell : callable
        Told of progress.
    """
    require_range("training.components", options.components, at_least=1, whole=True)
    whole = moments(training_walks(walks), walks.person)
    small = compact(whole, options.components)
    joints, angles = [], []
    people: list[str] = []
    for clip in left_out_clips(walks, options, DetectorError()):
        joints.append(clip.joint_errors)
        angles.append(clip.angle_errors)
        if clip.person not in people:
            people.append(clip.person)
            tell(f"error bars: {len(people)} of {whole.walkers} people left out")
    calibration = learn(np.concatenate(joints), np.concatenate(angles))
    sources = Counter(dict(zip(walks.person.tolist(), walks.source.tolist(), strict=True)).values())
    about = {
        "people_by_source": dict(sorted(sources.items())),
        "walks": len(walks),
        "components": options.components,
        "variance_kept": round(float(small.eigenvalues.sum() / np.trace(whole.covariance)), 4),
        "calibration": {"clips": len(joints), "levels": list(LEVELS), "seed": options.seed},
    }
    return TrainedModel(small, Calibration(calibration.joints, calibration.angles), about)
