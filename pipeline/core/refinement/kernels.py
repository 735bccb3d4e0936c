"""Compiled loops of the refinement: sums over joints in each frame, and the solution along the tree (park2011 3.1).

All in one file, as those of `binary_quadratic`: what numba keeps on disk goes by the file of the kernel.  Symbols are
those of `equations` and `reprojection`; others:

``seen_by``  what a camera saw: images (L, F, 2), visible (L, F), projection (F, 3, 3), centre (F, 3), root (F, 3)
``tree``     parents (L,), lengths (L,) mm, charts (L, 3, 3)
``lines``    (L, M): each limb itself and the limbs that carry it, the nearest first, then -1
"""

from __future__ import annotations

import numpy as np

from pipeline.compilation import compiled_with_free_sums

STRIDE = 7
"""Increment of the point index in the search for hull faces; distant points come first.
"""


@compiled_with_free_sums
def squared_distances(seen_by, tree, theta, phi):  # type: ignore[no-untyped-def]
    """Return the sum of squared distances, px², between reprojected and observed joints.

    Infinite if a joint is behind its camera.
    """
    images, visible, projection, centre, root = seen_by
    parents, lengths, charts = tree
    limbs, frames = theta.shape
    positions = np.empty((limbs, frames, 3))
    total = 0.0
    for limb in range(limbs):
        parent = parents[limb]
        for f in range(frames):
            across = lengths[limb] * np.sin(theta[limb, f])
            x = across * np.cos(phi[limb, f])
            y = across * np.sin(phi[limb, f])
            z = lengths[limb] * np.cos(theta[limb, f])
            for d in range(3):
                begin = root[f, d] if parent < 0 else positions[parent, f, d]
                positions[limb, f, d] = (
                    begin + x * charts[limb, 0, d] + y * charts[limb, 1, d] + z * charts[limb, 2, d]
                )
            if visible[limb, f]:
                right = down = depth = 0.0
                for d in range(3):
                    off = positions[limb, f, d] - centre[f, d]
                    right += projection[f, 0, d] * off
                    down += projection[f, 1, d] * off
                    depth += projection[f, 2, d] * off
                if not depth > 0.0:
                    return np.inf
                total += (right / depth - images[limb, f, 0]) ** 2 + (down / depth - images[limb, f, 1]) ** 2
    return total


@compiled_with_free_sums
def frame_by_frame(seen_by, tree, lines, theta, phi, free, exact, sums):  # type: ignore[no-untyped-def]
    """Compute the terms of the normal equations in each frame, for the unknowns of each limb: theta, phi and its
    length.

    Added to the three arrays of `sums`: the gradient (L, C, F), the diagonal of the curvature after Gauss and Newton
    (L, C, F), and the curvature between a limb and those of its line, exact or after Gauss and Newton (L, M, C, C, F).
    """
    images, visible, projection, centre, root = seen_by
    parents, lengths, charts = tree
    along, diagonal, couplings = sums
    limbs, frames = theta.shape
    numbers = 3 if free else 2
    positions = np.empty((limbs, frames, 3))
    movement = np.zeros((limbs, frames, 3, 3))
    turning = np.zeros((limbs, frames, 3, 3))  # by theta twice, by both, by phi twice
    pull = np.zeros((limbs, frames, 3))
    square = np.zeros((limbs, frames, 3, 3))
    bend = np.zeros((limbs, frames, 3, 3))
    local = np.empty((6, 3))
    world = np.empty(6)
    by_position = np.empty((2, 3))
    carried = np.empty((3, 3))
    for limb in range(limbs):
        parent = parents[limb]
        for f in range(frames):
            st, ct, sp, cp = (
                np.sin(theta[limb, f]), np.cos(theta[limb, f]), np.sin(phi[limb, f]), np.cos(phi[limb, f]),
            )  # fmt: skip
            local[0, 0], local[0, 1], local[0, 2] = st * cp, st * sp, ct
            local[1, 0], local[1, 1], local[1, 2] = ct * cp, ct * sp, -st
            local[2, 0], local[2, 1], local[2, 2] = -st * sp, st * cp, 0.0
            local[3, 0], local[3, 1], local[3, 2] = -st * cp, -st * sp, -ct
            local[4, 0], local[4, 1], local[4, 2] = -ct * sp, ct * cp, 0.0
            local[5, 0], local[5, 1], local[5, 2] = -st * cp, -st * sp, 0.0
            for d in range(3):
                for n in range(6 if exact else 3):
                    world[n] = lengths[limb] * (
                        local[n, 0] * charts[limb, 0, d]
                        + local[n, 1] * charts[limb, 1, d]
                        + local[n, 2] * charts[limb, 2, d]
                    )
                begin = root[f, d] if parent < 0 else positions[parent, f, d]
                positions[limb, f, d] = begin + world[0]
                movement[limb, f, 0, d] = world[1]
                movement[limb, f, 1, d] = world[2]
                movement[limb, f, 2, d] = world[0]  # by the logarithm of the length
                if exact:
                    for n in range(3):
                        turning[limb, f, n, d] = world[3 + n]
            if not visible[limb, f]:
                continue
            right = down = depth = 0.0
            for d in range(3):
                off = positions[limb, f, d] - centre[f, d]
                right += projection[f, 0, d] * off
                down += projection[f, 1, d] * off
                depth += projection[f, 2, d] * off
            right, down = right / depth, down / depth
            for d in range(3):
                across = (projection[f, 0, d] - right * projection[f, 2, d]) / depth
                below = (projection[f, 1, d] - down * projection[f, 2, d]) / depth
                by_position[0, d], by_position[1, d] = across, below
                pull[limb, f, d] = across * (right - images[limb, f, 0]) + below * (down - images[limb, f, 1])
            for d in range(3):
                for e in range(3):
                    square[limb, f, d, e] = (
                        by_position[0, d] * by_position[0, e] + by_position[1, d] * by_position[1, e]
                    )
                    if exact:
                        # The reprojection's own second derivative is -(A p^T + p A^T) / depth, p the third row.
                        bend[limb, f, d, e] = (
                            square[limb, f, d, e]
                            - pull[limb, f, d] * (projection[f, 2, e] / depth)
                            - pull[limb, f, e] * (projection[f, 2, d] / depth)
                        )
    for limb in range(limbs - 1, -1, -1):
        parent = parents[limb]
        if parent >= 0:
            for f in range(frames):
                for d in range(3):
                    pull[parent, f, d] += pull[limb, f, d]
                    for e in range(3):
                        square[parent, f, d, e] += square[limb, f, d, e]
                        if exact:
                            bend[parent, f, d, e] += bend[limb, f, d, e]
    for limb in range(limbs):
        for f in range(frames):
            for a in range(numbers):
                gradient = scale = 0.0
                for d in range(3):
                    inner = outer = 0.0
                    for e in range(3):
                        inner += square[limb, f, d, e] * movement[limb, f, a, e]
                        if exact:
                            outer += bend[limb, f, d, e] * movement[limb, f, a, e]
                    gradient += movement[limb, f, a, d] * pull[limb, f, d]
                    scale += movement[limb, f, a, d] * inner
                    carried[a, d] = outer if exact else inner
                along[limb, a, f] = gradient
                diagonal[limb, a, f] = scale
            for m in range(lines.shape[1]):
                other = lines[limb, m]
                if other < 0:
                    break
                for a in range(numbers):
                    for b in range(numbers):
                        total = 0.0
                        for d in range(3):
                            total += carried[a, d] * movement[other, f, b, d]
                        if exact and m == 0:
                            angular = a < 2 and b < 2
                            for d in range(3):
                                # By the logarithm of the length every derivative is what was to be derived.
                                second = (
                                    turning[limb, f, a + b, d] if angular else movement[limb, f, min(a, b), d]
                                )
                                total += second * pull[limb, f, d]
                        couplings[limb, m, a, b, f] = total


@compiled_with_free_sums
def fill_gradient(along, own, gradient, scale):  # type: ignore[no-untyped-def]
    """Add the sums over frames from `frame_by_frame` to the gradient and to the diagonal of the curvature (L, N)."""
    components = along.shape[2] - 1
    for limb in range(len(gradient)):
        for a in range(2):
            for k in range(components):
                gradient[limb, a * components + k] += along[limb, a, k]
                scale[limb, a * components + k] += own[limb, a, k]
        if along.shape[1] > 2:
            gradient[limb, 2 * components] += along[limb, 2, components]
            scale[limb, 2 * components] += own[limb, 2, components]


@compiled_with_free_sums
def fill_rows(sums, first, second, scale, lines, penalty, rows):  # type: ignore[no-untyped-def]
    """Write all blocks of the second derivative matrix H into `rows` (L, N, M, N), from sums over frames.

    Between angles they are sums of products. If lengths are free, sums of the basis and of one follow.
    """
    components = len(scale)
    size = 2 * components
    for limb in range(len(rows)):
        for m in range(lines.shape[1]):
            if lines[limb, m] < 0:
                break
            for a in range(2):
                for b in range(2):
                    for k in range(components):
                        for j in range(components):
                            rows[limb, a * components + k, m, b * components + j] = scale[k, j] * (
                                sums[limb, m, a, b, first[k, j]] + sums[limb, m, a, b, second[k, j]]
                            )
            if rows.shape[1] > size:
                before = sums.shape[4] - components - 1
                for a in range(2):
                    for k in range(components):
                        rows[limb, a * components + k, m, size] = sums[limb, m, a, 2, before + k]
                        rows[limb, size, m, a * components + k] = sums[limb, m, 2, a, before + k]
                rows[limb, size, m, size] = sums[limb, m, 2, 2, before + components]
        for n in range(rows.shape[1]):
            rows[limb, n, 0, n] += penalty[limb, n]


@compiled_with_free_sums
def curvature_along(rows, lines, step):  # type: ignore[no-untyped-def]
    """Return the quadratic form step^T H step, where H contains the second derivatives of the refinement's cost."""
    total = 0.0
    for limb in range(len(rows)):
        for m in range(lines.shape[1]):
            other = lines[limb, m]
            if other < 0:
                break
            for a in range(step.shape[1]):
                inner = 0.0
                for b in range(step.shape[1]):
                    inner += rows[limb, a, m, b] * step[other, b]
                total += (1.0 if m == 0 else 2.0) * step[limb, a] * inner
    return total


@compiled_with_free_sums
def solve_along_tree(rows, lines, gradient, damping, step):  # type: ignore[no-untyped-def]
    """Write the solution of (H + diag(damping)) step = -gradient into `step` (L, N).

    Return False if the matrix is not positive definite.

    `rows` (L, N, M, N) are overwritten.  Limbs are eliminated from the ends of the tree towards the root.
    """
    limbs, size = gradient.shape
    depth = rows.shape[2]
    right = -gradient
    others = np.empty((limbs, size, (depth - 1) * size))
    for limb in range(limbs - 1, -1, -1):
        carriers = 0
        while carriers + 1 < depth and lines[limb, carriers + 1] >= 0:
            carriers += 1
        wide = carriers * size
        solved = others[limb]
        for a in range(size):
            rows[limb, a, 0, a] += damping[limb, a]
            for level in range(carriers):
                for b in range(size):
                    solved[a, level * size + b] = rows[limb, a, level + 1, b]
        # Cholesky's factor takes the lower triangle of the limb's own block; right sides are solved along.
        for a in range(size):
            for b in range(a):
                inner = rows[limb, a, 0, b]
                for c in range(b):
                    inner -= rows[limb, a, 0, c] * rows[limb, b, 0, c]
                inner /= rows[limb, b, 0, b]
                rows[limb, a, 0, b] = inner
                right[limb, a] -= inner * right[limb, b]
                for c in range(wide):
                    solved[a, c] -= inner * solved[b, c]
            pivot = rows[limb, a, 0, a]
            for c in range(a):
                pivot -= rows[limb, a, 0, c] ** 2
            if not pivot > 0.0:
                return False
            pivot = np.sqrt(pivot)
            rows[limb, a, 0, a] = pivot
            right[limb, a] /= pivot
            for c in range(wide):
                solved[a, c] /= pivot
        if carriers == 0:
            continue
        narrow = solved[:, :wide].copy()
        fill = np.dot(narrow.T, narrow)
        for level in range(carriers):
            carrier = lines[limb, level + 1]
            for a in range(size):
                row = level * size + a
                for c in range(size):
                    right[carrier, a] -= narrow[c, row] * right[limb, c]
                for further in range(level, carriers):
                    for b in range(size):
                        rows[carrier, a, further - level, b] -= fill[row, further * size + b]
    for limb in range(limbs):
        for m in range(1, depth):
            carrier = lines[limb, m]
            if carrier < 0:
                break
            for a in range(size):
                inner = 0.0
                for b in range(size):
                    inner += others[limb, a, (m - 1) * size + b] * step[carrier, b]
                right[limb, a] -= inner
        for a in range(size - 1, -1, -1):
            step[limb, a] = right[limb, a] / rows[limb, a, 0, a]
            for b in range(a):
                right[limb, b] -= rows[limb, a, 0, b] * step[limb, a]
    return True


@compiled_with_free_sums
def clip(corners, left, across, room, cut):  # type: ignore[no-untyped-def]
    """Clip a convex polygon (n, 2) by the half plane ``across . x <= room``; write it into `cut`, return its corner
    count.
    """
    corner_count = 0
    for k in range(left):
        after = k + 1 if k + 1 < left else 0
        inside = room - across[0] * corners[k, 0] - across[1] * corners[k, 1]
        inside_after = room - across[0] * corners[after, 0] - across[1] * corners[after, 1]
        if inside >= 0.0:
            cut[corner_count, 0], cut[corner_count, 1] = corners[k, 0], corners[k, 1]
            corner_count += 1
        if (inside >= 0.0) != (inside_after >= 0.0):
            share = inside / (inside - inside_after)
            for d in range(2):
                cut[corner_count, d] = corners[k, d] + share * (corners[after, d] - corners[k, d])
            corner_count += 1
    return corner_count


@compiled_with_free_sums
def nearest_faces(white, whitening, flat, normals):  # type: ignore[no-untyped-def]
    """Write the normals of those convex hull faces that are nearest to the origin into `normals`; return their number.

    A normal may occur twice.

    The hull is that of points and their opposites, given as `white` (P, 3), points times `whitening`^T, of spread one
    in all directions.  Of the plane of all q with ``q . w = 1`` for one point w, those with ``|q . w'| <= 1`` for all
    others are a polygon, whose corners are the faces that hold w, at the distance 1 / |q|.  A polygon is left as soon
    as it reaches no farther out than the best corner so far, less `flat` in that distance.
    """
    count = len(white)
    corners, cut = np.empty((2 * count + 8, 2)), np.empty((2 * count + 8, 2))
    axes = np.empty((3, 3))  # the point over its square, and two unit vectors across it
    outward = np.empty((3, 3))  # the same as normals of the points that are not whitened
    least = np.inf
    face_count = 0
    for i in range(count):
        lowest = 0
        square = 0.0
        for d in range(3):
            square += white[i, d] ** 2
            lowest = d if abs(white[i, d]) < abs(white[i, lowest]) else lowest
        e, f = (lowest + 1) % 3, (lowest + 2) % 3
        size = np.sqrt(white[i, e] ** 2 + white[i, f] ** 2)
        axes[1, lowest], axes[1, e], axes[1, f] = 0.0, white[i, f] / size, -white[i, e] / size
        for d in range(3):
            e, f = (d + 1) % 3, (d + 2) % 3
            axes[0, d] = white[i, d] / square
            axes[2, d] = (white[i, e] * axes[1, f] - white[i, f] * axes[1, e]) / np.sqrt(square)
        outward[:] = 0.0
        for n in range(3):
            for d in range(3):
                for e in range(3):
                    outward[n, e] += axes[n, d] * whitening[d, e]
        # No face is nearer than the root mean square of the points' distances along its normal.
        reach = 2.0 * np.sqrt(count)
        for k in range(4):
            corners[k, 0] = reach if 1 <= k <= 2 else -reach
            corners[k, 1] = reach if k >= 2 else -reach
        left, farthest = 4, np.inf
        for step in range(STRIDE * (count // STRIDE + 1)):
            # Every STRIDE-th point, then their neighbours.
            j = (step * STRIDE) % (STRIDE * (count // STRIDE + 1)) + step // (count // STRIDE + 1)
            if j >= count or left == 0 or (least + flat) * np.sqrt(farthest) < 1.0:
                continue
            j = (i + j) % count
            ahead = g0 = g1 = 0.0
            for d in range(3):
                ahead += axes[0, d] * white[j, d]
                g0 += axes[1, d] * white[j, d]
                g1 += axes[2, d] * white[j, d]
            if g0 * g0 + g1 * g1 <= 1e-24 * square:
                continue
            for side in (1.0, -1.0):
                outside = False
                for k in range(left):
                    outside = outside or side * (ahead + g0 * corners[k, 0] + g1 * corners[k, 1]) > 1.0
                if outside:
                    left = clip(corners, left, (side * g0, side * g1), 1.0 - side * ahead, cut)
                    corners, cut = cut, corners
                    farthest = 0.0
                    for k in range(left):
                        reached = 0.0
                        for d in range(3):
                            q = outward[0, d] + corners[k, 0] * outward[1, d] + corners[k, 1] * outward[2, d]
                            reached += q * q
                        farthest = max(farthest, reached)
        if left == 0 or (least + flat) * np.sqrt(farthest) < 1.0:
            continue
        if (least - flat) * np.sqrt(farthest) > 1.0:
            face_count = 0
        least = min(least, 1.0 / np.sqrt(farthest))
        for k in range(left):
            reached = 0.0
            for d in range(3):
                q = outward[0, d] + corners[k, 0] * outward[1, d] + corners[k, 1] * outward[2, d]
                reached += q * q
                if face_count < len(normals):
                    normals[face_count, d] = q
            if face_count < len(normals) and (least + flat) * np.sqrt(reached) >= 1.0:
                face_count += 1
    return face_count
