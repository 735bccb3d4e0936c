"""Manipulations of point-light walkers: inversion, scrambling, limited lifetime, noise dots."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum

import numpy as np

from pipeline.validation import InvalidInput, require_count, require_range
from walk3d.pointlight.dots import PointLights

MAX_DOTS = 2000
"""Largest number of noise dots."""


class Noise(StrEnum):
    """Kinds of motion of the noise dots."""

    scrambled_walker = "scrambled_walker"
    """Each noise dot moves like a dot of the walker, at a random position and phase."""
    uniform = "uniform"
    """Each noise dot stays at a random position."""


def inverted(lights: PointLights) -> PointLights:
    """Return the display turned upside down about the centre of its height."""
    return _flipped(lights, 1)


def mirrored(lights: PointLights) -> PointLights:
    """Return the display with left and right exchanged, mirrored about its vertical centre line."""
    return _flipped(lights, 0)


def _flipped(lights: PointLights, axis: int) -> PointLights:
    low, high = lights.bounds
    positions = lights.positions.copy()
    positions[..., axis] = (low + high)[axis] - positions[..., axis]
    return replace(lights, positions=positions)


def scrambled(lights: PointLights, generator: np.random.Generator) -> PointLights:
    """Return the display with each dot's trajectory shifted to a random position in the walker's bounding box.

    The motion of each dot does not change; its position is no longer informative.
    """
    low, high = lights.bounds
    return replace(lights, positions=_moved_into(lights.positions, low, high, generator))


def _moved_into(
    trajectories: np.ndarray, low: np.ndarray, high: np.ndarray, generator: np.random.Generator
) -> np.ndarray:
    """Return trajectories (T, P, 2), each shifted to a random position inside a rectangle."""
    low_shift, high_shift = low - trajectories.min(axis=0), high - trajectories.max(axis=0)
    middle = (low_shift + high_shift) / 2  # a trajectory that does not fit is centred
    low_shift, high_shift = np.minimum(low_shift, middle), np.maximum(high_shift, middle)
    return trajectories + generator.uniform(low_shift, high_shift)


def phase_scrambled(lights: PointLights, generator: np.random.Generator) -> PointLights:
    """Return the display with the trajectory of each dot starting at a random frame of the loop.

    Raises
    ------
    InvalidInput
        If the display does not loop, since dots would jump.
    """
    if not lights.loops:
        raise InvalidInput(
            "phase scrambling needs a display that loops",
            expected="a whole number of cycles on the spot",
            code="looping_display",
        )
    frames, dots = lights.positions.shape[:2]
    first = np.asarray(generator.integers(frames, size=dots))
    return replace(lights, positions=_starting_at(lights.positions, first))


def _starting_at(trajectories: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return looped trajectories (T, P, 2), each started at the frame that `first` (P,) contains for its dot."""
    frames, dots = trajectories.shape[:2]
    return trajectories[(np.arange(frames)[:, None] + first) % frames, np.arange(dots)]


def limited_lifetime(
    lights: PointLights, generator: np.random.Generator, *, lifetime_frames: int, shown: int
) -> PointLights:
    """Return a display with fewer dots than joints, in which each dot moves to another joint after its lifetime.

    In every frame each dot is at a different joint.  Changes are staggered evenly over the lifetime.

    Parameters
    ----------
    lights : PointLights
        Display of a walker without noise.
    generator : numpy.random.Generator
    lifetime_frames : int
        Number of frames that a dot stays at a joint; only its first stay may be shorter.
    shown : int
        Number of dots at a time, fewer than the walker has.

    Raises
    ------
    InvalidInput
        If the lifetime is not positive or there are too many dots.
    """
    frames, joints = lights.positions.shape[:2]
    require_count("lifetime_frames", lifetime_frames)
    require_count("dots that are shown at a time", shown, at_most=joints - 1)
    at = generator.permutation(joints)[:shown]
    joints_shown = np.empty((frames, shown), int)
    for frame in range(frames):
        for dot in range(shown) if frame else ():
            if (frame + dot * lifetime_frames // shown) % lifetime_frames == 0:
                at[dot] = generator.choice(np.setdiff1d(np.arange(joints), at))
        joints_shown[frame] = at
    return PointLights(
        names=tuple(f"dot_{dot + 1}" for dot in range(shown)),
        positions=np.take_along_axis(lights.positions, joints_shown[..., None], axis=1),
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
    """Return the display with noise dots added.

    Parameters
    ----------
    lights : PointLights
    generator : numpy.random.Generator
    dots : int
        Number of noise dots.
    kind : Noise
    like : PointLights, optional
        Walker whose motion scrambled noise dots copy; `lights` by default.
    field : float
        Sides of the noise's rectangle, relative to those of the walker's.
    lifetime_frames : int
        Number of frames after which a noise dot moves to a new position, staggered over dots; 0: never.

    Raises
    ------
    InvalidInput
        If a number is out of range.
    """
    require_count("noise dots", dots, at_least=0, at_most=MAX_DOTS)
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
    """Return the trajectories (T, n, 2) of n noise dots in a rectangle."""
    frames, joints = model.positions.shape[:2]
    if kind is Noise.uniform:
        return np.broadcast_to(generator.uniform(low, high, size=(dots, 2)), (frames, dots, 2))
    # Every joint's trajectory is used about equally often.
    source_joints = np.concatenate([generator.permutation(joints) for _ in range(-(-dots // joints))])[:dots]
    trajectories = model.positions[:, source_joints]
    if model.loops:
        trajectories = _starting_at(trajectories, generator.integers(frames, size=dots))
    return _moved_into(trajectories, low, high, generator)
