"""Synchronization of all pairs of performances, and the choice of their median sequence (mozerov2006 section 3).

Symbols
-------
``M``    performances, ``P`` samples of each, ``b`` dimensions of the aSpace
``n``    base: the sequence whose rate is kept; ``m`` the one that is brought to it
``E``    ``|x_n(p)|² + |x_m(p + d)|² - 2 x_n(p)·x_m(p + d)``, for a tile of pairs by one matrix product per sample

Why computed differently from how it is printed: [mozerov2006 14] as a matrix product costs a tenth of the
differences squared one by one.  What cancellation adds is taken out again: postures are written relative to one
near their mean, and E is rounded to multiples of a power of two just above what is uncertain (some 1e-14 of the
largest squared norm), so that equal postures have E = 0 exactly, and whole numbers their exact ties.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from pipeline.core.choice import first_lowest
from pipeline.core.synchronization.trellis import (
    STEPS,
    Trellis,
    accumulate,
    allocate_costs,
    allowed_disparities,
    backtrack,
)
from pipeline.validation import InvalidInput, require_range, require_shape

_TILE_BYTES = 2**20
"""Size, in bytes, of the arrays for one sample of a tile (a block of pairs), so that they fit into a processor cache.
"""

_KEPT_BYTES = 2**27
"""Size, in bytes, of the accumulated costs that a tile (a block of pairs) stores for backtracking."""

_LARGEST = 1e140
"""Magnitude of a coordinate above which sums of squares may overflow."""


@dataclass(frozen=True)
class AllPairs:
    """Synchronization of all ordered pairs of M sequences, each of P samples.

    Attributes
    ----------
    disparity : (M, M, P) int16 or int32
        ``disparity[n, m]`` brings m to the rate of n.
    cost : (M, M) float64
        C(n, m), not symmetric; zero on the diagonal.
    """

    disparity: np.ndarray
    cost: np.ndarray


def same_size(sequences: Sequence[np.ndarray] | np.ndarray, names: Sequence[str] | None = None) -> np.ndarray:
    """Return the sequences as one array (M, P, b), after checking that they have equal sizes and finite values.

    Parameters
    ----------
    sequences : M arrays (P, b), or one (M, P, b)
    names : sequence of str, optional
        What each is called in an error; ``sequence 0`` … by default.

    Raises
    ------
    InvalidInput
        If one is not an array of frames and coordinates, has no frames, differs from the first in frames or
        dimension, or holds a value that is not finite or too large to be squared.
    """
    arrays = [np.asarray(sequence, float) for sequence in sequences]
    called = names or [f"sequence {n}" for n in range(len(arrays))]
    for name, array in zip(called, arrays, strict=True):
        if array.ndim != 2 or array.size == 0:
            raise InvalidInput(
                "the array is not a sequence of postures",
                name,
                "(frames, dimensions), one or more of each",
                array.shape,
                code="wrong_shape",
                shape=array.shape,
            )
        if array.shape[1] != arrays[0].shape[1]:
            raise InvalidInput(
                f"its postures differ in dimension from those of {called[0]}",
                name,
                arrays[0].shape[1],
                array.shape[1],
                code="other_dimension",
                dimension=array.shape[1],
            )
        if len(array) != len(arrays[0]):
            raise InvalidInput(
                f"its length differs from that of {called[0]}; normalise the time of all sequences first",
                name,
                f"{len(arrays[0])} frames",
                len(array),
                code="other_length",
                frames=len(array),
            )
        # A comparison with NaN is false.
        usable = np.abs(array) < _LARGEST
        if not usable.all():
            frame, coordinate = np.argwhere(~usable)[0]
            value = array[frame, coordinate]
            what = "too large to be squared" if np.isfinite(value) else "not finite"
            raise InvalidInput(
                f"coordinate {coordinate} of frame {frame} is {what}",
                name,
                received=f"{value:g}",
                code="too_large" if np.isfinite(value) else "not_finite",
                index=(frame, coordinate),
            )
    return np.stack(arrays) if arrays else np.empty((0, 0, 0))


def synchronize_all(
    sequences: Sequence[np.ndarray] | np.ndarray,
    *,
    max_disparity: int,
    smoothness: float,
    penalty: str = "change",
    start: str = "fixed",
    steps: Sequence[int] = STEPS,
) -> AllPairs:
    """Synchronize every ordered pair of M sequences.

    Parameters
    ----------
    sequences : (M, P, b), or M arrays (P, b)
        At least two, with linearly normalised time.
    max_disparity, smoothness, penalty, start, steps
        As for `synchronize`.

    Raises
    ------
    InvalidInput
        If there are fewer than two sequences, they differ in length or dimension, a value is not finite (the
        sequence and the frame are named), or a switch is none.

    Notes
    -----
    The disparities take M² P numbers of two bytes. All other memory does not grow with M.
    """
    rows = same_size(sequences)
    if len(rows) < 2:
        raise InvalidInput(
            "synchronization needs at least two sequences",
            expected="two or more sequences",
            received=len(rows),
            code="too_few_performances",
            count=len(rows),
        )
    count, frames, dimension = rows.shape
    nodes = allowed_disparities(
        frames,
        max_disparity=max_disparity,
        smoothness=smoothness,
        penalty=penalty,
        start=start,
        steps=steps,
    )
    # Relative to a posture that there is, and not the mean itself: whole numbers stay whole, and their ties exact.
    postures = rows.reshape(-1, dimension)
    rows = rows - postures[np.abs(postures - postures.mean(axis=0)).sum(axis=1).argmin()]
    dtype = np.int16 if frames <= np.iinfo(np.int16).max else np.int32
    result = AllPairs(np.empty((count, count, frames), dtype), np.empty((count, count)))
    for n, m, cost, S in _tiles(rows, nodes):
        result.cost[n, m] = cost.T
        result.disparity[n, m] = backtrack(nodes, S).reshape(frames, *cost.shape).T
    return result


def distances(
    sequences: Sequence[np.ndarray] | np.ndarray,
    *,
    max_disparity: int,
    smoothness: float,
    penalty: str = "change",
    start: str = "fixed",
    steps: Sequence[int] = STEPS,
) -> np.ndarray:
    """Return the synchronization distances C(n, m), (M, M), of every ordered pair of M sequences.

    Parameters
    ----------
    sequences, max_disparity, smoothness, penalty, start, steps
        As for `synchronize_all`, which also says what it raises.
    """
    return synchronize_all(
        sequences,
        max_disparity=max_disparity,
        smoothness=smoothness,
        penalty=penalty,
        start=start,
        steps=steps,
    ).cost


def _tiles(rows: np.ndarray, nodes: Trellis) -> Iterator[tuple[slice, slice, np.ndarray, list[np.ndarray]]]:
    """Yield tiles of the table of pairs: index ranges of n and m, costs (m, n), and accumulated costs S.

    The memory of S is reused for the next tile.
    """
    count, _, dimension = rows.shape
    squared = np.einsum("mpb,mpb->mp", rows, rows)[..., None]
    # E is a sum of b + 2 products after two of b, of terms that are at most four of the largest norm together:
    # wrong by less than half of this.
    uncertain = 8.0 * (dimension + 2) * np.finfo(float).eps * squared.max()
    # A number that is added and taken off again, and whose last digit is the next power of two.
    rounding = 1.5 * 2.0 ** (52 + np.frexp(uncertain)[1])
    ones = np.ones_like(squared)
    base = np.concatenate([-2.0 * rows, squared, ones], axis=2).transpose(1, 2, 0)
    moved = np.concatenate([rows, ones, squared], axis=2).transpose(1, 0, 2)
    bases, others = _tile_size(count, nodes)
    memory, S = np.empty((0, 0)), [np.empty((0, 0))]
    for first_m in range(0, count, others):
        right = np.ascontiguousarray(moved[:, first_m : first_m + others])
        for first_n in range(0, count, bases):
            left = np.ascontiguousarray(base[:, :, first_n : first_n + bases])
            size = right.shape[1], left.shape[2]
            if S[0].shape[1] != size[0] * size[1]:
                # Memory that is new to the process costs more than all that is done in it.
                memory = np.empty(int(nodes.widths.max()) * size[0] * size[1])
                S = allocate_costs(nodes, size[0] * size[1])
            misfit = partial(_misfit, left, right, rounding, memory)
            cost = accumulate(nodes, misfit, S).reshape(size)
            yield slice(first_n, first_n + size[1]), slice(first_m, first_m + size[0]), cost, S


def _misfit(
    left: np.ndarray, right: np.ndarray, rounding: float, memory: np.ndarray, p: int, low: int, high: int
) -> np.ndarray:
    """Return the squared distances E (high - low + 1, pairs) between matched postures, for disparities low to high.

    The extended postures are left (P, b + 2, n) and right (P, m, b + 2).
    """
    window = right[p + low : p + high + 1].reshape(-1, right.shape[2])
    shape = len(window), left.shape[2]
    E = np.matmul(window, left[p], out=memory[: shape[0] * shape[1]].reshape(shape))
    E += rounding
    E -= rounding
    return E.reshape(high - low + 1, -1)


def _tile_size(count: int, nodes: Trellis) -> tuple[int, int]:
    """Return the size of a tile of pairs: the number of base sequences n, and of sequences m synchronized to them."""
    cached, stored = 3 * 8 * int(nodes.widths.max()), 8 * int(nodes.widths.sum())
    pairs = min(_TILE_BYTES // cached, _KEPT_BYTES // stored)
    bases = max(1, min(count, pairs, 40))
    return bases, max(1, min(count, pairs // bases))


def median_sequence(distances: np.ndarray) -> int:
    """Return the index of the median sequence, whose distances C(n, m) have the smallest sum over m [mozerov2006 19].

    Parameters
    ----------
    distances : (M, M)
        C(n, m); row n has sequence n as the pattern.

    Raises
    ------
    InvalidInput
        If the distances are no square matrix of numbers from zero up.

    Notes
    -----
    The first on ties, and global distances are tied where they differ by rounding alone.

    Examples
    --------
    >>> median_sequence(np.array([[0.0, 4.0, 9.0], [4.0, 0.0, 1.0], [9.0, 1.0, 0.0]]))
    1
    """
    distances = np.asarray(distances, float)
    require_range("sequences", len(require_shape("distances", distances, ("M", "M"))), at_least=1)
    if not (np.isfinite(distances).all() and (distances >= 0).all()):
        n, m = np.argwhere(~(np.isfinite(distances) & (distances >= 0)))[0]
        raise InvalidInput(
            f"the synchronization distance of sequences {n} and {m} is invalid",
            expected="0 or more",
            received=f"{distances[n, m]:g}",
            code="invalid_distance",
            index=(n, m),
        )
    return int(first_lowest(distances.sum(axis=1), margin=1e-12))
