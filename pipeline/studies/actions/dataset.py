"""Performances of an action as sequences of postures; a posture is a vector of 37 numbers [mozerov2006 section 2]."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from pipeline.clips.kinds import PERFORMANCES, Performances
from pipeline.core import posture
from pipeline.core.posture import LimbLengths
from pipeline.core.resampling import frames_at_rate, interpolate
from pipeline.processes import map_processes
from pipeline.studies.study import Dataset
from pipeline.synthetic.bending import correspondence
from pipeline.validation import InvalidInput, NonNegative


class Frame(StrEnum):
    """Reference frame of the direction cosines."""

    parent = "parent"
    hip = "hip"


class Heading(StrEnum):
    """Removal of the heading from postures: by the yaw of the first frame, by the yaw of every frame, or not at all."""

    first = "first"
    """The yaw of the first frame is subtracted from the hip direction in all frames."""
    every = "every"
    none = "none"


def require_true_course(is_known: bool) -> None:
    """Raise InvalidInput unless the true phase of the performances in each frame is known."""
    if not is_known:
        raise InvalidInput(
            "the true phase in each frame is known only for synthetic performances",
            "data",
            "data=synthetic",
            code="truth_not_known",
        )


@dataclass(frozen=True)
class Postures:
    """Postures of M performances, concatenated along the time axis.

    Attributes
    ----------
    postures : (sum of F, 37)
        Height of the pelvis in leg lengths, and direction cosines of twelve limbs [mozerov2006 1].
    positions : (sum of F, 15, 3)
        Joint positions, mm, from which the postures were computed.
    first : (M + 1,) int
        First row of each performance.
    frame_rate_hz : (M,)
    floor_mm : (M,)
        Height from which the pelvis is measured.
    limbs_mm, pelvis_mm, shoulders_mm : (M, 12), (M, 3), (M, 3)
        Lengths, mm, as in `LimbLengths`.
    phase : (sum of F,), optional
        True course of the action, if known.
    moving_phase : (2,), optional
        Values of the course between which the actor moves.
    person, clip, source : (M,) text
    frame : str
        Reference frame of the direction cosines.
    words : str
        Number of performances and frames in words, for captions.
    """

    postures: np.ndarray
    positions: np.ndarray
    first: np.ndarray
    frame_rate_hz: np.ndarray
    floor_mm: np.ndarray
    limbs_mm: np.ndarray
    pelvis_mm: np.ndarray
    shoulders_mm: np.ndarray
    phase: np.ndarray | None
    moving_phase: np.ndarray | None
    person: np.ndarray
    clip: np.ndarray
    source: np.ndarray
    frame: str
    words: str

    @property
    def duration_s(self) -> np.ndarray:
        """Duration (M,), s, of each performance, from its first to its last frame."""
        return (np.diff(self.first) - 1) / self.frame_rate_hz

    def split(self, values: np.ndarray) -> list[np.ndarray]:
        """Split an array with a row for each frame of all performances into one array for each performance."""
        return [values[a:b] for a, b in pairwise(self.first)]

    def body(self, performance: int) -> LimbLengths:
        """Return the limb lengths of the performer of one performance."""
        return LimbLengths(
            self.limbs_mm[performance], self.pelvis_mm[performance], self.shoulders_mm[performance]
        )

    def mean_body(self) -> LimbLengths:
        """Return the limb lengths averaged over all performances."""
        return LimbLengths(*(x.mean(axis=0) for x in (self.limbs_mm, self.pelvis_mm, self.shoulders_mm)))

    def true_course(self, pattern: int, samples: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the true frame of every performance at each sample of a pattern, and a mask of the pattern's movement.

        Parameters
        ----------
        pattern : int
            Number of the performance that is the pattern.
        samples : int
            P, spread evenly over the pattern.

        Returns
        -------
        frames : (M, P)
            Fractional frame of each performance.
        moving : (P,) bool

        Raises
        ------
        InvalidInput
            If the true course is not known.
        """
        require_true_course(self.phase is not None)
        assert self.phase is not None
        assert self.moving_phase is not None
        phases = self.split(self.phase)
        length = len(phases[pattern])
        course = np.interp(np.linspace(0.0, length - 1.0, samples), np.arange(length), phases[pattern])
        begins, ends = self.moving_phase
        return np.stack([correspondence(course, p) for p in phases]), (course >= begins) & (course <= ends)


class PostureDataset(Dataset):
    """Options of the dataset with the postures of every performance of an action."""

    corpus = PERFORMANCES

    frame: Frame = Frame.parent
    heading: Heading = Heading.first
    frame_rate_hz: NonNegative = 30.0  # faster recordings are resampled; 0: as recorded

    def build(self, clips: Performances, *, workers: int) -> Postures:
        """Return the postures of all performances."""

        def represented(m: int) -> tuple[np.ndarray, np.ndarray, float, LimbLengths, np.ndarray]:
            motion, rate = clips.motion(m), clips.frame_rate_hz[m]
            at = frames_at_rate(len(motion), rate, self.frame_rate_hz)
            positions = interpolate(motion, at)
            floor = posture.floor_level(positions)
            postures = posture.postures(
                positions, frame=self.frame.value, heading=self.heading.value, floor_mm=floor
            )
            return postures, positions, floor, posture.limb_lengths(positions), at

        postures, positions, floors, bodies, at = zip(
            *map_processes(represented, range(len(clips)), workers), strict=True
        )
        frames = [len(p) for p in postures]
        phase = None
        if clips.phase is not None:
            courses = [clips.phase[a:b] for a, b in pairwise(clips.first)]
            phase = np.concatenate([interpolate(p, t) for p, t in zip(courses, at, strict=True)])
        people = len(set(clips.person))
        return Postures(
            postures=np.concatenate(postures),
            positions=np.concatenate(positions),
            first=np.concatenate([[0], np.cumsum(frames)]),
            frame_rate_hz=np.minimum(clips.frame_rate_hz, self.frame_rate_hz or np.inf),
            floor_mm=np.array(floors),
            limbs_mm=np.stack([b.limbs_mm for b in bodies]),
            pelvis_mm=np.stack([b.pelvis_mm for b in bodies]),
            shoulders_mm=np.stack([b.shoulders_mm for b in bodies]),
            phase=phase,
            moving_phase=clips.moving_phase,
            person=clips.person,
            clip=clips.clip,
            source=clips.source,
            frame=self.frame.value,
            words=f"{len(frames)} performances of {people} {'person' if people == 1 else 'people'}, "
            f"{np.mean(frames):.0f} frames on average",
        )
