"""Candidates and a basis become a programme, or are refused: park2011 section 3.2.

Symbols are those of `sign_programme`.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.binary_quadratic.programme import RELAXED, Programme
from pipeline.validation import InvalidInput

_ORTHONORMAL = 1e-12
"""Entries of G below this are rounding: the basis is hard."""

_NORM = 1e-9
"""How far the squared spectral norm of a basis may be above one."""


def programme_of(
    basis: np.ndarray,
    middle: np.ndarray,
    half_chord: np.ndarray,
    *,
    forced: np.ndarray | None = None,
    relax_below: float = 0.0,
    linear: np.ndarray | None = None,
) -> Programme:
    """The programme of these candidates, with all arrays copied and checked.

    Parameters
    ----------
    basis : (F, K)
        B.
    middle, half_chord : (F, 3)
        m and u, mm.
    forced : (F,) int, optional
        -1 or +1 where the sign is known, 0 elsewhere.
    relax_below : float
        Frames whose half chord is shorter, mm, are relaxed.
    linear : (F,), optional
        Added cost of the sign +1, and gain of -1, mm².

    Raises
    ------
    InvalidInput
        If it is not one.
    """
    basis = np.array(basis, dtype=float, order="C")
    if basis.ndim != 2 or 0 in basis.shape:
        raise InvalidInput(
            "the basis is not one of frames by components", expected="shape (F, K)", received=str(basis.shape)
        )
    frames = len(basis)
    if frames < basis.shape[1]:
        raise InvalidInput(
            "the basis has more components than there are frames",
            expected=f"at most {frames}",
            received=str(basis.shape[1]),
        )
    if not np.isfinite(basis).all():
        raise InvalidInput(
            "the basis is not finite", where=f"frame {_first(~np.isfinite(basis).all(axis=1))}"
        )
    given = {"middle": middle, "half_chord": half_chord}
    for name, value in given.items():
        given[name] = array = np.array(value, dtype=float, order="C")
        if array.shape != (frames, 3):
            raise InvalidInput(
                f"{name} does not fit the basis", expected=f"shape {(frames, 3)}", received=str(array.shape)
            )
        missing = ~np.isfinite(array).all(axis=1)
        if missing.all():
            raise InvalidInput(f"{name} is missing in all frames", expected="finite numbers")
        if missing.any():
            raise InvalidInput(
                f"{name} is missing",
                where=f"frame {_first(missing)}",
                expected="finite numbers: leave missing frames out, and their rows of the basis",
            )
    excess = np.eye(basis.shape[1]) - basis.T @ basis
    norm = 1.0 - float(np.linalg.eigvalsh(excess)[0])
    if norm > 1.0 + _NORM:
        raise InvalidInput(
            "the basis is not orthonormal, nor softer than that",
            expected="columns of spectral norm at most 1",
            received=f"{np.sqrt(norm):.6g}",
        )
    if np.abs(excess).max() < _ORTHONORMAL:
        excess = np.zeros_like(excess)
    kind = np.zeros(frames, dtype=np.int8)
    lengths = np.linalg.norm(given["half_chord"], axis=1)
    if not relax_below >= 0:
        raise InvalidInput(
            "the half chord to relax below cannot be so", expected="0 mm or more", received=str(relax_below)
        )
    kind[lengths < relax_below] = RELAXED
    if forced is not None:
        wanted = np.asarray(forced)
        if wanted.shape != (frames,) or not np.isin(wanted, (-1, 0, 1)).all():
            raise InvalidInput(
                "the forced signs cannot be so", expected=f"{frames} numbers, each -1, 0 or +1"
            )
        kind[wanted != 0] = wanted[wanted != 0]
    cost = np.zeros(frames) if linear is None else np.array(linear, dtype=float)
    if cost.shape != (frames,) or not np.isfinite(cost).all():
        raise InvalidInput("the linear cost cannot be so", expected=f"{frames} finite numbers, mm²")
    # Where both candidates are one point the sign is +1, unless the linear cost would have it otherwise.
    tangent = (lengths == 0) & (np.abs(kind) != 1)
    kind[tangent] = np.where(cost[tangent] > 0, -1, 1)
    return Programme(basis, excess, given["middle"], given["half_chord"], cost, kind)


def _first(frames: np.ndarray) -> int:
    """The first frame that is so."""
    return int(np.argmax(frames))
