"""Good signs within milliseconds, without a certificate: park2011 section 3.2.

Symbols are those of `sign_programme`.  Smooth paths through the candidates are found by dynamic programming, on
first and on second differences and on both; they and their mirrors -s are then improved by flipping single frames
and windows of frames, which is how a path that took a wrong turn, and another one back, is put right.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.binary_quadratic.programme import TO_FIND, Programme, compiled, gradient, project

DIFFERENCES = ((1.0, 0.0), (0.0, 1.0), (0.1, 1.0))
"""Weights of squared first and second differences for the paths to start from."""

LONGEST = 60
"""Frames of the longest window that is flipped; windows that reach the first or last frame may have any length."""

MARGIN = 1e-9
"""Fraction of J by which signs have to be better to replace others."""

NEARLY = 1.5
"""Starts whose J, after flips of single frames, is up to this times the least are improved by windows too."""


def smooth_paths(programme: Programme) -> list[np.ndarray]:
    """Signs (F,) of the smoothest paths through the candidates, by each of `DIFFERENCES`.

    Parameters
    ----------
    programme : Programme
    """
    middle, half_chord, kind = programme.middle, programme.half_chord, programme.kind
    return [_path(middle, half_chord, kind, first, second) for first, second in DIFFERENCES]


def mirrored(programme: Programme, values: np.ndarray) -> np.ndarray:
    """-s where the sign is to be found, s elsewhere, (F,).

    Parameters
    ----------
    programme : Programme
    values : (F,)
        s.
    """
    return np.where(programme.kind == TO_FIND, -values, values)


def descend(
    programme: Programme, values: np.ndarray, *, longest: int, away_from: np.ndarray | None = None
) -> tuple[np.ndarray, float]:
    """Signs (F,) that no flip of a frame or window improves, and their J in mm².

    Parameters
    ----------
    programme : Programme
    values : (F,)
        Where the descent starts.
    longest : int
        Frames of the longest window, at least one.
    away_from : (F,), optional
        Signs that the descent must not come near: the squared half chords of the frames that agree with them may
        never be more than those of the frames that do not.  The start has to be so.
    """
    found = np.array(values, dtype=float)
    bounded = away_from is not None
    other = found if away_from is None else np.asarray(away_from, dtype=float)
    allowance = programme.allowance(0.0)
    best = _descend(*programme.arrays, found, longest, other, programme.weight, bounded, allowance)
    return found, float(best)


def search(programme: Programme) -> tuple[np.ndarray, float]:
    """The best signs (F,) from all starts, and their J in mm².

    A later start counts only if it is better by `MARGIN`, so that rounding does not choose between equals.

    Parameters
    ----------
    programme : Programme
    """
    starts: dict[bytes, tuple[np.ndarray, float]] = {}
    for path in smooth_paths(programme):
        for start in (path, mirrored(programme, path)):
            found, best = descend(programme, start, longest=1)
            starts.setdefault(found.astype(np.int8).tobytes(), (found, best))
    least = min(best for _, best in starts.values())
    enough = max(NEARLY * least, least + programme.allowance(least))
    ends = [descend(programme, found, longest=LONGEST) for found, best in starts.values() if best <= enough]
    found, best = ends[0]
    for end in ends[1:]:
        found, best = _better(programme, (found, best), end)
    return _better(programme, (found, best), descend(programme, mirrored(programme, found), longest=LONGEST))


def _better(
    programme: Programme, first: tuple[np.ndarray, float], second: tuple[np.ndarray, float]
) -> tuple[np.ndarray, float]:
    """Of two results the second if it is better by the margin, else the first."""
    margin = MARGIN * abs(first[1]) + programme.allowance(first[1])
    return second if second[1] < first[1] - margin else first


@compiled
def _path(middle, half_chord, kind, first, second):  # type: ignore[no-untyped-def]
    """Viterbi over pairs of signs; of equals the far candidate, +1."""
    frames = len(middle)
    point = np.empty((frames, 2, 3))
    barred = np.zeros((frames, 2))
    for i in range(frames):
        for a in range(2):
            for d in range(3):
                point[i, a, d] = middle[i, d] + (1.0 - 2.0 * a) * half_chord[i, d]
            if (kind[i] == -1 and a == 0) or (kind[i] == 1 and a == 1):
                barred[i, a] = np.inf
    spent = np.zeros((2, 2))  # by the signs of the last two frames
    origin = np.zeros((frames, 2, 2), dtype=np.int8)
    for i in range(1, frames):
        after = np.full((2, 2), np.inf)
        for b in range(2):
            for c in range(2):
                step = barred[i - 1, b] + barred[i, c]
                for d in range(3):
                    step += first * (point[i, c, d] - point[i - 1, b, d]) ** 2
                for a in range(2):
                    turn = spent[a, b] + step
                    if i > 1:
                        for d in range(3):
                            turn += (
                                second * (point[i, c, d] - 2.0 * point[i - 1, b, d] + point[i - 2, a, d]) ** 2
                            )
                    if turn < after[b, c] * (1.0 - MARGIN):
                        after[b, c] = turn
                        origin[i, b, c] = a
        spent = after
    values = np.empty(frames)
    b = c = 0
    for j in range(2):
        for k in range(2):
            if spent[j, k] < spent[b, c] * (1.0 - MARGIN):
                b, c = j, k
    if frames == 1:
        c = 1 if kind[0] == -1 else 0
    for i in range(frames - 1, 0, -1):
        values[i] = 1.0 - 2.0 * c
        b, c = origin[i, b, c], b
    values[0] = 1.0 - 2.0 * c
    return values


@compiled
def _descend(  # type: ignore[no-untyped-def]
    basis, excess, middle, half_chord, linear, kind, values, longest, other, weight, bounded, allowance
):  # fmt: skip
    """Takes the best window from each first frame in turn, if it is an improvement, until none is."""
    frames, components = basis.shape
    z = np.empty((3, components))
    window = np.empty((3, components))
    half = np.empty(frames)
    project(basis, middle, half_chord, values, z)
    here = gradient(basis, excess, middle, half_chord, linear, values, z, half)
    near = 0.0
    for i in range(frames):
        near += weight[i] * values[i] * other[i]
    idle = 0
    turn = 0
    turns = frames + 1 if longest > 1 else frames
    while idle < turns:
        # Windows forwards from each frame in turn, of any length from the first; then backwards from the last.
        first = turn if turn < frames else frames - 1
        onwards = 1 if turn < frames else -1
        longer = longest > 1 and (turn == 0 or turn == frames)
        reach = frames if longer else min(longest, frames - first)
        # Flipping the window W changes J by the sum of 4 |s_i u_i|² - 4 s_i half_i, less 4 |sum of s_i B_i u_i^T|².
        least = 0.0
        margin = MARGIN * abs(here) + allowance
        size = 0
        window[:] = 0.0
        change = 0.0
        nearer = near
        for n in range(reach):
            i = first + onwards * n
            if kind[i] == -1 or kind[i] == 1:
                continue
            nearer -= 2.0 * weight[i] * values[i] * other[i]
            square = 0.0
            for d in range(3):
                u = values[i] * half_chord[i, d]
                square += u * u
                for k in range(components):
                    window[d, k] += u * basis[i, k]
            change += 4.0 * square - 4.0 * values[i] * half[i]
            inside = 0.0
            for d in range(3):
                for k in range(components):
                    inside += window[d, k] * window[d, k]
            if change - 4.0 * inside < least - margin and not (bounded and nearer > 0.0):
                least = change - 4.0 * inside
                size = n + 1
        if size > 0:
            for n in range(size):
                i = first + onwards * n
                if kind[i] != -1 and kind[i] != 1:
                    near -= 2.0 * weight[i] * values[i] * other[i]
                    values[i] = -values[i]
            project(basis, middle, half_chord, values, z)
            here = gradient(basis, excess, middle, half_chord, linear, values, z, half)
            idle = 0
        else:
            idle += 1
        turn = (turn + 1) % turns
    return here
