"""The pole that is farthest, up and down, from all directions of a path: a compiled search, exact to rounding.

Symbols
-------
``d``    unit vectors of the path (F, 3)
``p``    pole; ``h(p) = max over i of |p . d_i|``, the sine of its least distance from the great circles across them
``x``    ``p`` is along ``d_i + x``, x across d_i: of all poles to which d_i is nearest, h is ``1 / sqrt(1 + |x|²)``

Those poles are a convex polygon of x, cut out by ``+-d_j . (d_i + x) <= 1`` for all j, and h is least at its corner
farthest from the origin.  So corners are asked from the farthest on: one that a direction forbids is cut off by
that direction, one that none forbids is a face of the convex hull of all ``+-d``.  Most polygons shrink below the best
corner of another after a few cuts, and the hull is never built.
"""

from __future__ import annotations

import numpy as np

from pipeline.compilation import compiled_exactly

_NOT_FORBIDDEN = 1e-12
"""What a product with a direction may be above the largest allowed: rounding."""


@compiled_exactly
def farthest_pole(units, near, thinnest, margin):  # type: ignore[no-untyped-def]
    """The pole (3,) of least h; of several within the margin, or opposite, the first by six digits.

    Parameters
    ----------
    units : (F, 3)
        d, not all in a plane.
    near : (3,)
        A pole that may be about as far: the better it is, the sooner most others are ruled out.
    thinnest : float
        A number above zero that no h is below.
    margin : float
        Of h; directions that are nearer to each other, or to their opposites, are taken as one.
    """
    frames = len(units)
    across = np.empty((3, frames))
    for i in range(frames):
        for k in range(3):
            across[k, i] = units[i, k]
    pole, corner, opposite = near.copy(), np.empty(3), np.empty(3)
    least = 0.0
    for i in range(frames):
        least = max(least, abs(units[i, 0] * near[0] + units[i, 1] * near[1] + units[i, 2] * near[2]))
    bound = np.zeros(frames)  # of h where a direction is the nearest
    product, axes = np.empty(frames), np.empty((2, 3))
    # One corner for each cut at most, and for each side of the first square.
    most = 2 * frames + 4
    polygon, other, asked = np.empty((most, 2)), np.empty((most, 2)), np.empty(most, dtype=np.bool_)
    side, known = np.empty(most), np.empty(most, dtype=np.bool_)
    cutting, usual = np.empty((2, most), dtype=np.int64), np.zeros(2, dtype=np.int64)
    found = False
    # The first round finds the least h, the second one chooses among the corners within the margin of it.
    for slack in (0.0, margin):
        for i in range(frames):
            if bound[i] > least + slack:
                continue
            d = units[i]
            _axes_across(d, axes)
            for n in range(4):
                polygon[n, 0] = (-1.0 if n in (0, 3) else 1.0) / thinnest
                polygon[n, 1] = (-1.0 if n < 2 else 1.0) / thinnest
                asked[n] = False
            count = 4
            bound[i] = np.inf
            for n in range(usual[1]):
                cutting[0, n] = cutting[1, n]
            usual[0] = usual[1]
            usual[1] = 0
            for _ in range(8 * most):
                far = -1
                size = 0.0
                for n in range(count):
                    square = polygon[n, 0] ** 2 + polygon[n, 1] ** 2
                    if not asked[n] and (far < 0 or square > size):
                        far, size = n, square
                if far < 0:
                    break
                here = 1.0 / np.sqrt(1.0 + size)
                if here > least + slack:
                    bound[i] = min(bound[i], here)
                    break
                for k in range(3):
                    corner[k] = here * (d[k] + polygon[far, 0] * axes[0, k] + polygon[far, 1] * axes[1, k])
                # What cut the polygon before is the likeliest to cut this one: most frames are neighbours.
                by = -1
                worst = here + 2.0 * margin
                for n in range(usual[0]):
                    j = cutting[0, n]
                    value = abs(corner[0] * units[j, 0] + corner[1] * units[j, 1] + corner[2] * units[j, 2])
                    if value > worst:
                        by, worst = j, value
                if by < 0:
                    worst = here + _NOT_FORBIDDEN
                    for j in range(frames):
                        product[j] = abs(
                            corner[0] * across[0, j] + corner[1] * across[1, j] + corner[2] * across[2, j]
                        )
                    for j in range(frames):
                        if product[j] > worst:
                            by, worst = j, product[j]
                left = 0
                if by >= 0 and count < most and usual[1] < most:
                    left = _cut(
                        d, units[by], axes, corner, margin, polygon, asked, count, far, side, other, known
                    )
                if left > 0:
                    polygon, other, asked, known, count = other, polygon, known, asked, left
                    cutting[1, usual[1]] = by
                    usual[1] += 1
                    continue
                asked[far] = True
                bound[i] = min(bound[i], here)
                least = min(least, here)
                if slack > 0.0:
                    for k in range(3):
                        opposite[k] = -corner[k]
                    first = corner if _by_digits(corner, opposite) <= 0 else opposite
                    if not found or _by_digits(first, pole) < 0:
                        for k in range(3):
                            pole[k] = first[k]
                        found = True
    return pole


@compiled_exactly
def _axes_across(d, axes):  # type: ignore[no-untyped-def]
    """Two axes (2, 3) across a unit vector and each other, into `axes`."""
    least = 0
    for k in range(1, 3):
        if abs(d[k]) < abs(d[least]):
            least = k
    for k in range(3):
        axes[0, k] = (1.0 if k == least else 0.0) - d[least] * d[k]
    size = np.sqrt(axes[0, 0] ** 2 + axes[0, 1] ** 2 + axes[0, 2] ** 2)
    for k in range(3):
        axes[0, k] /= size
    for k in range(3):
        one, two = (k + 1) % 3, (k + 2) % 3
        axes[1, k] = d[one] * axes[0, two] - d[two] * axes[0, one]


@compiled_exactly
def _cut(d, by, axes, corner, margin, polygon, asked, count, far, side, other, known):  # type: ignore[no-untyped-def]
    """Cuts a corner and its like off a polygon, into `other` and `known`; corners left, 0 where the cut is rounding."""
    sign = 1.0 if corner[0] * by[0] + corner[1] * by[1] + corner[2] * by[2] > 0.0 else -1.0
    # The cut is a x + b y <= c, c without the difference of numbers that are nearly one.
    a = b = c = 0.0
    for k in range(3):
        a += sign * by[k] * axes[0, k]
        b += sign * by[k] * axes[1, k]
        c += 0.5 * (d[k] - sign * by[k]) ** 2
    if a * a + b * b <= margin * margin:
        return 0
    for n in range(count):
        side[n] = a * polygon[n, 0] + b * polygon[n, 1] - c
    # The corners that stay next to those that are cut off.
    before = behind = far
    for _ in range(count):
        if side[before] > 0.0:
            before = (before + count - 1) % count
        if side[behind] > 0.0:
            behind = (behind + 1) % count
    if before == far or side[before] > 0.0:
        return 0
    left = (before - behind) % count + 1
    for n in range(left):
        old = (behind + n) % count
        other[n, 0], other[n, 1] = polygon[old, 0], polygon[old, 1]
        known[n] = asked[old]
    for inside, step in ((before, 1), (behind, count - 1)):
        outside = (inside + step) % count
        part = side[inside] / (side[inside] - side[outside])
        for k in range(2):
            other[left, k] = polygon[inside, k] + part * (polygon[outside, k] - polygon[inside, k])
        known[left] = False
        left += 1
    return left


@compiled_exactly
def _by_digits(one, other):  # type: ignore[no-untyped-def]
    """-1, 0 or 1: which vector comes first by its coordinates to six digits."""
    for k in range(3):
        first, second = np.rint(1e6 * one[k]), np.rint(1e6 * other[k])
        if first != second:
            return -1 if first < second else 1
    return 0
