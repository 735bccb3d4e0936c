"""What experiments do to point-light walkers: turned upside down, scrambled, short-lived, hidden in noise."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum

import numpy as np

from pipeline.validation import InvalidInput, require_count, require_range
from walk3d.pointlight.dots import PointLights

MOST_DOTS = 2000


class Noise(StrEnum):
    """What noise dots do."""

    scrambled_walker = "scrambled_walker"
    """Each moves as some dot of the walker does, elsewhere and at another time."""
    uniform = "uniform"
    """Each stands somewhere."""


def inverted(lights: PointLights) -> PointLights:
    """Return the display upside down, about its middle."""
    return _flipped(lights, 1)


def mirrored(lights: PointLights) -> PointLights:
    """Return the display with left and right exchanged, about its middle."""
    return _flipped(lights, 0)


def _flipped(lights: PointLights, axis: int) -> PointLights:
    low, high = lights.bounds
    positions = lights.positions.copy()
    positions[..., axis] = (low + high)[axis] - positions[..., axis]
    return replace(lights, positions=positions)


def scrambled(lights: PointLights, generator: np.random.Generator) -> PointLights:
    """Return the display with each dot's trajectory moved to a place of its own inside the walker's rectangle.

    What each dot does stays as it is; where it does it says nothing any more.
    """
    low, high = lights.bounds
    return replace(lights, positions=_placed(lights.positions, low, high, generator))


def _placed(
    trajectories: np.ndarray, low: np.ndarray, high: np.ndarray, generator: np.random.Generator
) -> np.ndarray:
    """Trajectories (T, P, 2), each moved so that all of it lies somewhere inside a rectangle."""
    least, most = low - trajectories.min(axis=0), high - trajectories.max(axis=0)
    middle = (least + most) / 2  # one that does not fit in is put in the middle
    least, most = np.minimum(least, middle), np.maximum(most, middle)
    return trajectories + generator.uniform(least, most)


def phase_scrambled(lights: PointLights, generator: np.random.Generator) -> PointLights:
    """Return the display with each dot's trajectory beginning at a frame of its own.

    Raises
    ------
    InvalidInput
        If the display does not loop: dots would jump.
    """
    if not lights.loops:
        raise InvalidInput(
            "phases are scrambled in a display that loops",
            expected="a whole number of cycles on the spot",
            code="looping_display",
        )
    frames, dots = lights.positions.shape[:2]
    first = np.asarray(generator.integers(frames, size=dots))
    return replace(lights, positions=_begun_at(lights.positions, first))


def _begun_at(trajectories: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Trajectories (T, P, 2) of a loop, each from a frame (P,) on."""
    frames, dots = trajectories.shape[:2]
    return trajectories[(np.arange(frames)[:, None] + first) % frames, np.arange(dots)]


def limited_lifetime(
    lights: PointLights, generator: np.random.Generator, *, lifetime_frames: int, shown: int
) -> PointLights:
    """Return a display of fewer dots, each of which leaves its joint for another after some frames.

    Every dot is at a joint in every frame, no two at the same one; changes are staggered evenly over the lifetime.

    Parameters
    ----------
    lights : PointLights
        A walker without noise.
    generator : numpy.random.Generator
    lifetime_frames : int
        Frames that a dot stays at a joint; only a dot's first stay may be shorter.
    shown : int
        Dots at a time, fewer than the walker has.

    Raises
    ------
    InvalidInput
        If the lifetime is not positive or there are too many dots.
    """
    frames, joints = lights.positions.shape[:2]
    require_count("lifetime_frames", lifetime_frames)
    require_count("dots that are shown at a time", shown, at_most=joints - 1)
    at = generator.permutation(joints)[:shown]
    chosen = np.empty((frames, shown), int)
    for frame in range(frames):
        for dot in range(shown) if frame else ():
            if (frame + dot * lifetime_frames // shown) % lifetime_frames == 0:
                at[dot] = generator.choice(np.setdiff1d(np.arange(joints), at))
        chosen[frame] = at
    return PointLights(
        names=tuple(f"dot_{dot + 1}" for dot in range(shown)),
        positions=np.take_along_axis(lights.positions, chosen[..., None], axis=1),
        frame_rate_hz=lights.frame_rate_hz,
        of_walker=np.ones(shown, bool),
        loops=lights.loops,
    )


def with_noise(
    lights: PointLights,
    generator: np.random.Generator,
    *,
    dots: int,
    kind: Noise = Noise.scrambled_walker,
    like: PointLights | None = None,
    field: float = 1.5,
    lifetime_frames: int = 0,
) -> PointLights:
    """Return the display among noise dots.

    Parameters
    ----------
    lights : PointLights
    generator : numpy.random.Generator
    dots : int
        Noise dots.
    kind : Noise
    like : PointLights, optional
        The walker whose dots scrambled noise moves like; `lights` itself by default.
    field : float
        Sides of the noise's rectangle over those of the walker's.
    lifetime_frames : int
        Frames after which a noise dot is put elsewhere, staggered over dots; 0: never.

    Raises
    ------
    InvalidInput
        If a number is out of range.
    """
    require_count("noise dots", dots, at_least=0, at_most=MOST_DOTS)
    require_range("field", field, at_least=1, at_most=20)
    require_count("lifetime_frames", lifetime_frames, at_least=0)
    if not dots:
        return lights
    model = like or lights
    frames = len(lights.positions)
    low, high = model.bounds
    middle, half = (low + high) / 2, field * (high - low) / 2
    stays = [np.zeros(frames, int)] * dots
    if lifetime_frames:
        stagger = np.arange(dots) * lifetime_frames // dots
        stays = [(np.arange(frames) + start) // lifetime_frames for start in stagger]
    noise = np.empty((frames, dots, 2))
    for stay in range(1 + max(int(s[-1]) for s in stays)):
        drawn = _noise_dots(model, dots, kind, middle - half, middle + half, generator)
        for dot, when in enumerate(stays):
            noise[when == stay, dot] = drawn[when == stay, dot]
    return PointLights(
        names=(*lights.names, *(f"noise_{dot + 1}" for dot in range(dots))),
        positions=np.concatenate([lights.positions, noise], axis=1),
        frame_rate_hz=lights.frame_rate_hz,
        of_walker=np.concatenate([lights.of_walker, np.zeros(dots, bool)]),
        loops=lights.loops,
    )


def _noise_dots(
    model: PointLights,
    dots: int,
    kind: Noise,
    low: np.ndarray,
    high: np.ndarray,
    generator: np.random.Generator,
) -> np.ndarray:
    """Trajectories (T, dots, 2) of noise inside a rectangle."""
    frames, joints = model.positions.shape[:2]
    if kind is Noise.uniform:
        return np.broadcast_to(generator.uniform(low, high, size=(dots, 2)), (frames, dots, 2))
    # Every joint lends its trajectory about equally often.
    lent = np.concatenate([generator.permutation(joints) for _ in range(-(-dots // joints))])[:dots]
    trajectories = model.positions[:, lent]
    if model.loops:
        trajectories = _begun_at(trajectories, generator.integers(frames, size=dots))
    return _placed(trajectories, low, high, generator)
