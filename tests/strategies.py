"""Hypothesis strategies for property tests; hypothesis chooses seeds, sizes and a style, numpy draws the numbers.

Styles: *generic* numbers in general position; *tied*, the same walkers or equal spreads again; *degenerate*,
joints that stand still, coordinates that are zero, fewer directions of variation than walkers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from pipeline.core.linear_model import LinearModel, fit
from pipeline.skeleton import WALKER15

STYLES = ("generic", "tied", "degenerate")

_STANDING_MM = {
    "head": (0, 0, 700),
    "sternum": (0, 0, 450),
    "shoulder": (180, 0, 400),
    "elbow": (220, -20, 120),
    "wrist": (230, 30, -120),
    "pelvis": (0, 0, 0),
    "hip": (90, 0, 0),
    "knee": (95, 20, -420),
    "ankle": (90, -30, -830),
}
"""Positions, mm, of the right-side joints of a standing person who faces +y, relative to the pelvis."""

_SWING_MM = {"wrist": -170, "elbow": -80, "shoulder": -15, "hip": 12, "knee": 130, "ankle": 260}
"""Amplitude, mm, of the fundamental along the walking direction for each joint, in phase with the leg of that side."""

seeds = st.integers(min_value=0, max_value=2**32 - 1)
angles = st.floats(min_value=-np.pi, max_value=np.pi, allow_nan=False)


def walker(generator: np.random.Generator, *, individual: float = 1.0) -> np.ndarray:
    """Return the Fourier representation (5, 15, 3), mm, of a random person who walks along +y, at phase zero.

    `individual` scales how far the walker is from the one that all have in common.
    """
    w = np.zeros((5, 15, 3))
    for j, name in enumerate(WALKER15.joints):
        side, part = name.split("_") if "_" in name else ("", name)
        w[0, j] = _STANDING_MM[part]
        if side == "left":
            w[0, j, 0] *= -1
        # The left ankle goes ahead first: A sin wt with A > 0 in left less right.
        w[1, j, 1] = _SWING_MM.get(part, 0) * {"left": 1, "right": -1, "": 0}[side]
        w[2, j, 0] = 20.0  # sway
        w[3, j, 2] = 15.0  # bob
    w *= 1.0 + 0.08 * individual * generator.standard_normal()
    spread = np.array([25.0, 12.0, 12.0, 5.0, 5.0])[:, None, None] * individual
    w += spread * generator.standard_normal(w.shape)
    w[0, 8] = 0.0
    # Phase zero exactly: left and right ankle share the cosine along the walk.
    left, right = WALKER15.index("left_ankle"), WALKER15.index("right_ankle")
    w[2, [left, right], 1] = w[2, [left, right], 1].mean()
    return w


def walkers(generator: np.random.Generator, count: int, style: str = "generic") -> np.ndarray:
    """Return Fourier representations (R, 5, 15, 3), mm, of a population of the given style."""
    people = np.stack([walker(generator) for _ in range(count)])
    if style == "tied":
        people[count // 2 :] = people[: count - count // 2]
    elif style == "degenerate":
        mean = people.mean(axis=0)
        directions = generator.standard_normal((max(count // 3, 1), 5, 15, 3)) * 20.0
        directions[:, :, generator.integers(15)] = 0.0
        directions[..., generator.integers(3)] = 0.0
        weights = generator.standard_normal((count, len(directions)))
        people = mean + np.tensordot(weights, directions, axes=1)
    return people


@dataclass(frozen=True)
class Fold:
    """Linear model of walkers, and the data of a walker who is not in its training set."""

    model: LinearModel
    sample: np.ndarray
    generator: np.random.Generator
    drawn: str

    def __repr__(self) -> str:
        return f"Fold({self.drawn})"


@st.composite
def folds(draw: st.DrawFn, *, styles: tuple[str, ...] = STYLES, trailing: int | None = None) -> Fold:
    """Draw a linear model of 3 to 40 walkers with 225 or 226 dimensions, and another walker of the same population."""
    seed, count, style = (
        draw(seeds),
        draw(st.integers(min_value=3, max_value=40)),
        draw(st.sampled_from(styles)),
    )
    generator = np.random.default_rng(seed)
    people = walkers(generator, count + 1, style).reshape(count + 1, -1)
    scale: float | None = 1.0
    if draw(st.booleans()) if trailing is None else trailing:
        people = np.column_stack([people, 2 * np.pi * generator.normal(0.9, 0.08, count + 1)])
        scale = draw(st.sampled_from([1.0, 30.0, None]))
    components = draw(st.integers(min_value=1, max_value=35))
    drawn = (
        f"seed={seed} count={count} {style} numbers={people.shape[1]} scale={scale} components={components}"
    )
    return Fold(fit(people[1:], components, scale_last=scale), people[0], generator, drawn)
