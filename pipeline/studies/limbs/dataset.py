"""Motion stretches of equal length, cut from clips, for the reconstruction of limbs: park2011 section 3."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pipeline.clips.kinds import VARIED, VariedClips
from pipeline.core.limb_chain import WALKER14, relative_trajectories
from pipeline.core.resampling import frames_at_rate, interpolate
from pipeline.studies.study import Dataset
from pipeline.validation import Count, InvalidInput, Positive, bounded


@dataclass(frozen=True)
class LimbStretches:
    """Motion stretches with equal numbers of frames, cut from clips.

    Attributes
    ----------
    positions : (N, F, 15, 3)
        Joint positions, mm.
    lengths_mm : (N, 14)
        Mean lengths of the limbs over frames, in the order of `limb_chain.WALKER14`.
    start_s : (N,)
        Start of each stretch in its clip.
    person, clip, action, source : (N,) text
    frame_rate_hz : float
    words : str
        Number of stretches in words, for captions.
    remarks : list of str
    """

    positions: np.ndarray
    lengths_mm: np.ndarray
    start_s: np.ndarray
    person: np.ndarray
    clip: np.ndarray
    action: np.ndarray
    source: np.ndarray
    frame_rate_hz: float
    words: str
    remarks: list[str]

    def seed_label(self, number: int) -> str:
        """Return a text that identifies a motion stretch, for the seed of a random generator."""
        return f"{self.source[number]}:{self.clip[number]}:{self.start_s[number]:g}"


class LimbDataset(Dataset):
    """Options for cutting clips into stretches of equal length."""

    corpus = VARIED

    frames: Annotated[int, bounded(at_least=3)] = 100  # number of frames of each stretch
    frame_rate_hz: Positive = 30.0  # rate at which clips are resampled
    stretches: Count = 2  # number of stretches of each clip, spread evenly; fewer if it is too short

    def build(self, clips: VariedClips, *, workers: int) -> LimbStretches:
        """Return the stretches of all clips that have enough frames."""
        stretches, clip_of, starts, short, longest = [], [], [], [], 0
        for number in range(len(clips)):
            motion = clips.motion(number)
            rate = min(clips.frame_rate_hz[number], self.frame_rate_hz)
            at = frames_at_rate(len(motion), clips.frame_rate_hz[number], rate)
            positions = interpolate(motion, at)
            longest = max(longest, len(positions))
            spare = len(positions) - self.frames
            if spare < 0:
                short.append(str(clips.clip[number]))
                continue
            count = min(self.stretches, 1 + spare // (self.frames // 2))
            for start in np.unique(np.linspace(0, spare, count).round().astype(int)):
                stretches.append(positions[start : start + self.frames])
                clip_of.append(number)
                starts.append(start / rate)
        if not stretches:
            raise InvalidInput(
                "no clip is long enough",
                "dataset.frames",
                f"{self.frames} frames at {self.frame_rate_hz:g} Hz",
                f"{longest} at most",
                code="too_short",
                frames=longest,
            )
        relative = [relative_trajectories(WALKER14, positions) for positions in stretches]
        lengths = np.linalg.norm(np.stack(relative), axis=-1)
        slow = clips.clip[clips.frame_rate_hz < self.frame_rate_hz]
        remarks = [
            f"{len(names)} clips are {problem} (e.g. {names[0]})"
            for names, problem in (
                (short, f"shorter than {self.frames} frames"),
                (slow, f"slower than {self.frame_rate_hz:g} Hz, so that their stretches last longer"),
            )
            if len(names)
        ]
        return LimbStretches(
            positions=np.stack(stretches),
            lengths_mm=lengths.mean(axis=1),
            start_s=np.array(starts),
            person=clips.person[clip_of],
            clip=clips.clip[clip_of],
            action=clips.action[clip_of],
            source=clips.source[clip_of],
            frame_rate_hz=self.frame_rate_hz,
            words=f"{len(stretches)} stretches of {self.frames} frames out of {len(set(clip_of))} clips",
            remarks=remarks,
        )
