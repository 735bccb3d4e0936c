"""Fourier representations of steady walks: zhang2007 3.1-3.4, zhang2004 section 2."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TypeAlias

import numpy as np

from pipeline.clips.kinds import WALKS, Reducer, Walks
from pipeline.core import fourier
from pipeline.core.walking.definitions import SHOULDERS, STERNUM, redefine, set_origin
from pipeline.processes import map_processes
from pipeline.studies.study import Dataset
from pipeline.validation import Count


class Origin(StrEnum):
    """Origin of the coordinates of a walk."""

    pelvis_mean = "pelvis_mean"
    floor = "floor"


class Size(StrEnum):
    """Normalisation of the body size of walkers."""

    absolute = "absolute"
    stature = "stature"


class Pelvis(StrEnum):
    """Definition of the pelvis point of a walker."""

    measured = "measured"
    """The pelvis point that the skeleton mapping computes."""
    hips = "hips"
    """Midpoint between the hips."""
    above = "above"
    """Point above the midpoint of the hips, at the height of the published average walker of zhang2007."""


class Sternum(StrEnum):
    """Definition of the sternum point of a walker."""

    measured = "measured"
    """The sternum point that the skeleton mapping computes."""
    below_shoulders = "below_shoulders"
    """Point below the midpoint of the shoulders, at the distance of the published average walker of zhang2007."""


class Selection(StrEnum):
    """Choice of the walks of each person that are used."""

    best = "best"
    """The walk of each person that has the smallest residual from a fit by two harmonics."""
    all = "all"


@dataclass(frozen=True)
class FourierSamples:
    """Fourier representations of the selected walks.

    Attributes
    ----------
    coefficients : (R, 1 + 2H, 15, 3)
        Millimetres, in the order p0, p1, q1, p2, q2, …
    frequency_hz, phase_rad : (R,)
    variance_fractions : (R, H)
    residual_fraction : (R,)
    residual_covariance, temporal_covariance : (R, 15, 3, 3)
        Square millimetres.
    walk : (R,) int
        Number of the clip of each sample.
    scale : (R,)
        Factor of the size normalisation.
    person, clip, source : (R,) text
    unmeasured : (R, 15) bool
        Joints that are estimated, or dropped for all walks; they have no error.
    frequency : bool
        True if the frequency is one of the numbers of a walker [zhang2004 2].
    words : str
        Number of samples in words, for captions.
    """

    coefficients: np.ndarray
    frequency_hz: np.ndarray
    phase_rad: np.ndarray
    variance_fractions: np.ndarray
    residual_fraction: np.ndarray
    residual_covariance: np.ndarray
    temporal_covariance: np.ndarray
    walk: np.ndarray
    scale: np.ndarray
    person: np.ndarray
    clip: np.ndarray
    source: np.ndarray
    unmeasured: np.ndarray
    frequency: bool
    words: str


@dataclass(frozen=True, kw_only=True)
class RepresentedWalks(Walks):
    """Walks with their Fourier representations but without their joint positions.

    Attributes
    ----------
    samples : FourierSamples
    """

    samples: FourierSamples


_Series: TypeAlias = fourier.FourierRepresentation


class FourierDataset(Dataset):
    """Options of the dataset with the Fourier representations of steady walks."""

    corpus = WALKS

    harmonics: Count = 2  # number of harmonics of the Fourier series
    frequency: bool = False  # zhang2004: the frequency is the 226th number
    origin: Origin = Origin.pelvis_mean
    size: Size = Size.absolute
    pelvis: Pelvis = Pelvis.measured
    sternum: Sternum = Sternum.measured
    walks: Selection = Selection.best

    def shared(self) -> FourierDataset:
        """Return a copy of the options with `frequency` turned off, so that both choices share one Fourier fit.

        Every sample contains the frequency, and the option only decides if it belongs to the vector.
        """
        return replace(self, frequency=False)

    def represent(self, streaming: Callable[[Reducer], tuple[Walks, list[_Series]]]) -> RepresentedWalks:
        """Return the walks without joint positions but with their Fourier representations."""
        clips, series = streaming(self._represented)
        return RepresentedWalks(**vars(clips), samples=self._samples(clips, series.__getitem__))

    def build(self, clips: Walks, *, workers: int) -> FourierSamples:
        """Return the Fourier representations of the selected walks."""
        if isinstance(clips, RepresentedWalks):
            return replace(clips.samples, frequency=self.frequency)

        def representation(walk: int) -> _Series:
            rate, frequency = clips.frame_rate_hz[walk], clips.frequency_hz[walk]
            return self._represented(clips.motion(walk), rate, frequency, self._unknown(clips.dropped))

        return self._samples(clips, representation, workers)

    def _represented(
        self,
        motion: np.ndarray,
        frame_rate_hz: float,
        frequency_hz: float,
        dropped: np.ndarray | slice = slice(0),
    ) -> _Series:
        """Return the Fourier representation of a walk in millimetres, before any normalisation of body size."""
        walk = redefine(motion, pelvis=self.pelvis.value, sternum=self.sternum.value)
        centred = set_origin(walk, origin=self.origin.value)
        # A dropped joint is a constant that is the same for all walks and so has no effect.
        centred[:, dropped] = 0.0
        known_frequency_hz = frequency_hz if self.harmonics == 2 else None
        return fourier.represent(
            centred, frame_rate_hz, harmonics=self.harmonics, frequency_hz=known_frequency_hz
        )

    def _unknown(self, unknown: np.ndarray) -> np.ndarray:
        """Return the mask (…, 15) of unmeasured joints; a sternum defined by the shoulders needs both shoulders."""
        if self.sternum is Sternum.measured:
            return unknown
        redefined = unknown.copy()
        redefined[..., STERNUM] = unknown[..., SHOULDERS].any(axis=-1)
        return redefined

    def _samples(
        self, clips: Walks, representation: Callable[[int], _Series], workers: int = 1
    ) -> FourierSamples:
        """Return the samples of the selected walks, each represented by a function of the index of the walk."""
        numbers = _choose(clips.person, clips.residual_share, self.walks)
        stature = clips.stature_mm
        normalised = self.size is Size.stature
        scale = stature[numbers].mean() / stature if normalised else np.ones(len(stature))
        series = map_processes(representation, numbers, workers)

        def stack(name: str, power: int = 0) -> np.ndarray:
            """Return one field of all representations as an array, times a power of each walk's scale factor."""
            return np.stack(
                [getattr(s, name) * scale[walk] ** power for walk, s in zip(numbers, series, strict=True)]
            )

        people = len(set(clips.person[numbers]))
        alone = people == len(numbers)
        return FourierSamples(
            coefficients=stack("coefficients", 1),
            frequency_hz=stack("frequency_hz"),
            phase_rad=stack("phase_rad"),
            variance_fractions=stack("variance_fractions"),
            residual_fraction=stack("residual_fraction"),
            residual_covariance=stack("residual_covariance", 2),
            temporal_covariance=stack("temporal_covariance", 2),
            walk=np.array(numbers),
            scale=scale[numbers],
            person=clips.person[numbers],
            clip=clips.clip[numbers],
            source=clips.source[numbers],
            unmeasured=self._unknown(clips.estimated[numbers] | clips.dropped),
            frequency=self.frequency,
            words=f"{people} walkers" if alone else f"{len(numbers)} walks of {people} walkers",
        )


def _choose(person: np.ndarray, residual_share: np.ndarray, walks: Selection) -> list[int]:
    """Indices of the selected walks: all walks, or one walk of each person, the one with the smallest residual."""
    if walks is Selection.all:
        return list(range(len(person)))
    best: dict[str, int] = {}
    for walk, who in enumerate(person):
        if who not in best or residual_share[walk] < residual_share[best[who]]:
            best[who] = walk
    return list(best.values())
