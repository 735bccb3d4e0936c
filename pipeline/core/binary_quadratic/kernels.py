"""Compiled loops of the binary quadratic programme: local search, relaxation and two exact searches (park2011 3.2).

All in one file, because what numba keeps on disk goes by the file of the kernel: with callees elsewhere an edited one
would leave a stale copy in its callers.  A kernel takes the problem `p`, a `candidates.Programme`, and what it may
write to.  The symbols are those of `candidates`; others:

``values``  s (F,), as numbers from -1 to +1
``held``    signs (F,) that a search has fixed, 0 where it has not
``half``    half the derivative of J by each value (F,), ``u_i · r_i``
``z``       B^T (m + s u), one row for each coordinate (3, K)

Arrays are taken out of `p` before a loop, and innermost loops stand where they are used: to hand an array over, or to
read one of `p`, costs as much as a hundred products.

The compiler may take the terms of a sum in another order, which `Programme.allowance` covers; it may not assume
anything about NaN or infinity.
"""

from __future__ import annotations

import numpy as np

from pipeline.compilation import compiled_with_free_sums

FORCED, RELAXED = 1, 2
"""Codes for frames without a free sign: fixed at +1 (forced), or any value between -1 and +1 (relaxed)."""

MARGIN = 1e-9
"""Relative reduction of the cost J, beyond rounding error, that is needed to replace the best signs so far."""

FEWEST_SWEEPS, MOST_SWEEPS = 2, 20
"""Minimum and maximum number of coordinate-descent sweeps in a node of the branch-and-bound search.

The fewest are for a node that can no longer be pruned, the most for a node that may still be pruned.
"""

EPS = float(np.finfo(float).eps)

REFRESH = 8
"""Number of search nodes after which derivatives are recomputed instead of updated, to limit rounding errors."""

LAST_SWEEPS = 2000
"""Maximum number of coordinate-descent sweeps if all signs are fixed and only relaxed frames remain."""

STEP = 3
"""Distance, in frames, between the start frames for which the suffix search computes a least cost.

For start frames in between, S_t of the next computed start is a lower bound.
"""

LOOSE = 1e-3
"""Largest relative error by which the computed least cost of the last frames may be too low."""

PATIENCE = 30_000
"""Number of nodes after which the search for the least cost of the last frames is abandoned."""

OVER_RELAXATION = 1.3
"""Over-relaxation factor of coordinate descent; above 1 because neighbouring frames share basis coefficients."""

DEPTH, STATE, TRAIL, NODES = range(4)
"""Indices into the array of counters of the branch-and-bound search."""

ENTER, LEAVE, DONE = range(3)
"""States of the branch-and-bound search: enter a node, leave a node, search finished."""

START, LEVEL, PREPARED, ENTERED, FINISHED, TRIED = range(6)
"""Indices into the array of counters of the depth-first search."""

FIRST, SEARCHED = 1, 2
"""Stages of the search from a start frame: the best known signs are evaluated (1), or the tree is searched (2).

Stage 0 is a start frame that is not prepared.
"""


@compiled_with_free_sums
def allowance_of(numbers, size, objective):  # type: ignore[no-untyped-def]
    """Return the rounding error of a cost J, as `Programme.allowance` does; `numbers` is F + K."""
    return 8.0 * numbers * EPS * np.sqrt(max(objective, 0.0) * size) + 64.0 * EPS * size


@compiled_with_free_sums
def copy(numbers, into):  # type: ignore[no-untyped-def]
    """Copy an array element by element, because whole-array assignment takes seconds to compile."""
    for i in range(len(numbers)):
        into[i] = numbers[i]


# --- the cost and its derivative ---------------------------------------------------------------------------


@compiled_with_free_sums
def project(p, values, z):  # type: ignore[no-untyped-def]
    """Compute the basis coefficients B^T (m + s u) of the points that signs s select, and write them into `z`."""
    basis, middle, half_chord = p.basis, p.middle, p.half_chord
    z[:] = 0.0
    for i in range(len(basis)):
        x = middle[i, 0] + values[i] * half_chord[i, 0]
        y = middle[i, 1] + values[i] * half_chord[i, 1]
        w = middle[i, 2] + values[i] * half_chord[i, 2]
        for k in range(basis.shape[1]):
            z[0, k] += basis[i, k] * x
            z[1, k] += basis[i, k] * y
            z[2, k] += basis[i, k] * w


@compiled_with_free_sums
def slope(basis, middle, half_chord, i, value, z):  # type: ignore[no-untyped-def]
    """Return half the derivative of J with respect to the sign of frame `i`, and the squared residual of this frame."""
    x = y = w = 0.0
    for k in range(basis.shape[1]):
        x += basis[i, k] * z[0, k]
        y += basis[i, k] * z[1, k]
        w += basis[i, k] * z[2, k]
    x = middle[i, 0] + value * half_chord[i, 0] - x
    y = middle[i, 1] + value * half_chord[i, 1] - y
    w = middle[i, 2] + value * half_chord[i, 2] - w
    return half_chord[i, 0] * x + half_chord[i, 1] * y + half_chord[i, 2] * w, x * x + y * y + w * w


@compiled_with_free_sums
def gradient(p, values, z, half):  # type: ignore[no-untyped-def]
    """Return the cost J of signs or relaxed values whose basis coefficients `z` are known.

    Half the derivative with respect to each value is written into `half`.
    """
    basis, excess, middle, half_chord = p.basis, p.excess, p.middle, p.half_chord
    total = 0.0
    if excess.any():
        for d in range(3):
            for k in range(len(excess)):
                inner = 0.0
                for j in range(len(excess)):
                    inner += excess[k, j] * z[d, j]
                total += inner * z[d, k]
    for i in range(len(basis)):
        half[i], square = slope(basis, middle, half_chord, i, values[i], z)
        total += square
    return total


@compiled_with_free_sums
def cost(p, values, z):  # type: ignore[no-untyped-def]
    """Return the cost J of signs or relaxed values; their basis coefficients are written into `z`."""
    project(p, values, z)
    return gradient(p, values, z, np.empty(len(p.basis)))


@compiled_with_free_sums
def slopes(p, values, z, half):  # type: ignore[no-untyped-def]
    """Return the cost J, and write half of its derivatives into `half`; use the stored matrix if there is one.

    Without a table, `z` is computed and overwritten.
    """
    table, pull = p.table, p.pull
    if len(table) == 0:
        project(p, values, z)
        return gradient(p, values, z, half)
    copy(pull, half)
    for j in range(len(table)):
        value = values[j]
        if value != 0.0:
            for i in range(len(half)):
                half[i] += value * table[j, i]
    total = p.still
    for i in range(len(half)):
        total += values[i] * (pull[i] + half[i])
    return max(total, 0.0)


@compiled_with_free_sums
def move(p, i, change, z, half):  # type: ignore[no-untyped-def]
    """Change the value of frame `i`, and return the change of the cost J; 0 without a stored matrix.

    Updates `half` or, without a table, `z`.
    """
    basis, half_chord, table = p.basis, p.half_chord, p.table
    if len(table) > 0:
        added = change * (2.0 * half[i] + change * table[i, i])
        for j in range(len(half)):
            half[j] += change * table[i, j]
        return added
    x, y, w = change * half_chord[i, 0], change * half_chord[i, 1], change * half_chord[i, 2]
    for k in range(basis.shape[1]):
        z[0, k] += basis[i, k] * x
        z[1, k] += basis[i, k] * y
        z[2, k] += basis[i, k] * w
    return 0.0


@compiled_with_free_sums
def curvature(basis, half_chord):  # type: ignore[no-untyped-def]
    """Return half the second derivative (F,) of the cost J with respect to the sign of each frame."""
    bent = np.empty(len(basis))
    for i in range(len(basis)):
        leverage = 0.0
        for k in range(basis.shape[1]):
            leverage += basis[i, k] * basis[i, k]
        square = half_chord[i, 0] ** 2 + half_chord[i, 1] ** 2 + half_chord[i, 2] ** 2
        bent[i] = square * max(1.0 - leverage, 0.0)
    return bent


@compiled_with_free_sums
def relax(p, held, point, known, cutoff, sweeps_allowed, allowance, trail, length):  # type: ignore[no-untyped-def]
    """Minimise J approximately over a box of values; return lower bound, J, number of sweeps, and number of fixed
    signs.

    The trail lists the frames whose sign has been fixed because of a bound.

    Frames whose `held` is 0 range over -1 … +1, the others stay.  Coordinate descent from the values of `point`, which
    is (values, z, half) and is overwritten; `known` is J of the values, or NaN where it and half are to be computed.
    J is convex: from any point, converged or not, ``J(t) >= J(s) - 2 sum(|half_i| + half_i s_i)`` over the box, and
    ``4 |half_i|`` more where t_i has the sign of half_i.  A sign that this lifts to `cutoff` is held at the other
    one, and put on the trail.

    It ends when the bound reaches `cutoff`; after the fewest sweeps, when J is below it, so that no bound can reach
    it; when nothing moves; or after the most sweeps.  `sweeps_allowed` is (fewest, most).
    """
    basis, middle, half_chord, kind, bent, table = p.basis, p.middle, p.half_chord, p.kind, p.bent, p.table
    values, z, half = point
    fewest, most = sweeps_allowed
    following = slopes(p, values, z, half) if np.isnan(known) else known
    sweeps = 0
    while True:
        lower_bound = following
        slack = 0.0
        for i in range(len(half)):
            if held[i] == 0:
                slack += abs(half[i]) + half[i] * values[i]
        bound = lower_bound - 2.0 * slack - allowance
        if bound >= cutoff or sweeps >= most or 2.0 * slack <= 0.1 * allowance:
            return bound, following, sweeps, length
        first = length
        for i in range(len(half)):
            if held[i] == 0 and kind[i] != RELAXED and bound + 4.0 * abs(half[i]) >= cutoff:
                held[i] = -1 if half[i] > 0.0 else 1
                trail[length] = i
                length += 1
        for n in range(first, length):
            i = trail[n]
            following += move(p, i, held[i] - values[i], z, half)
            values[i] = held[i]
        if sweeps >= fewest and lower_bound < cutoff:
            return bound, following, sweeps, length
        for i in range(len(half)):
            if held[i] != 0:
                continue
            steep = half[i] if len(table) > 0 else slope(basis, middle, half_chord, i, values[i], z)[0]
            if bent[i] > 0.0:
                target = min(max(values[i] - OVER_RELAXATION * steep / bent[i], -1.0), 1.0)
            else:
                target = -1.0 if steep > 0.0 else 1.0 if steep < 0.0 else values[i]
            change = target - values[i]
            if change != 0.0:
                values[i] = target
                if len(table) > 0:  # as `move`
                    following += change * (2.0 * steep + change * table[i, i])
                    for j in range(len(half)):
                        half[j] += change * table[i, j]
                else:
                    move(p, i, change, z, half)
        if len(table) == 0:
            following = gradient(p, values, z, half)
        sweeps += 1


# --- signs without a certificate ---------------------------------------------------------------------------


@compiled_with_free_sums
def smooth_path(p, first, second):  # type: ignore[no-untyped-def]
    """Return the signs (F,) of the smoothest trajectory, by weighted squared first and second differences.

    If two paths are equal, the one with the far candidate (+1) is taken.

    Viterbi's algorithm over pairs of signs.
    """
    middle, half_chord, kind = p.middle, p.half_chord, p.kind
    frames = len(middle)
    point = np.empty((frames, 2, 3))
    barred = np.zeros((frames, 2))
    for i in range(frames):
        for a in range(2):
            for d in range(3):
                point[i, a, d] = middle[i, d] + (1.0 - 2.0 * a) * half_chord[i, d]
        if kind[i] == FORCED:
            barred[i, 1] = np.inf
    spent = np.zeros((2, 2))  # by the signs of the last two frames
    origin = np.zeros((frames, 2, 2), np.int8)
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
        c = 0
    for i in range(frames - 1, 0, -1):
        values[i] = 1.0 - 2.0 * c
        b, c = origin[i, b, c], b
    values[0] = 1.0 - 2.0 * c
    return values


@compiled_with_free_sums
def descend(p, values, longest, other, weight, bounded, allowance):  # type: ignore[no-untyped-def]
    """Flip the signs of windows of frames until no flip reduces the cost J; return J.

    Each first frame is tried in turn, with the best window that begins there.

    Where it is `bounded`, the values may not come nearer to the `other` ones than half of the weights (F,).
    """
    basis, half_chord, kind, table, pull = p.basis, p.half_chord, p.kind, p.table, p.pull
    frames, components = basis.shape
    z = np.empty((3, components))
    window = np.empty((3, components))
    half = np.empty(frames)
    # Products of each frame with those before it, summed from the first on: a window is a difference of two.
    sums = np.zeros((len(table) + 1, len(table)))
    diagonal = np.empty(frames)
    objective = 0.0
    near = 0.0
    for i in range(frames):
        near += weight[i] * values[i] * other[i]
    # Of single frames the derivatives go along, and no window is summed.
    alone = longest == 1 and len(table) > 0
    idle = 0
    turn = 0
    turns = frames + 1 if longest > 1 else frames
    size = -1
    changed = 0
    while idle < turns:
        if (size < 0 and alone) or (size != 0 and len(table) == 0):
            objective = slopes(p, values, z, half)
        elif size != 0 and not alone:
            for j in range(changed, frames):
                for i in range(frames):
                    sums[j + 1, i] = sums[j, i] + table[j, i] * values[j]
                diagonal[j] = sums[j + 1, j]
            objective = p.still
            for i in range(frames):
                half[i] = pull[i] + sums[frames, i]
                objective += values[i] * (pull[i] + half[i])
            objective = max(objective, 0.0)
        # Windows forwards from each frame in turn, of any length from the first; then backwards from the last.
        first = turn if turn < frames else frames - 1
        onwards = 1 if turn < frames else -1
        longer = longest > 1 and (turn == 0 or turn == frames)
        reach = frames if longer else min(longest, frames - first)
        # Flipping the window W changes J by the sum of 4 |s_i u_i|² - 4 s_i half_i, less 4 |sum of s_i B_i u_i^T|².
        least = 0.0
        margin = MARGIN * abs(objective) + allowance
        size = 0
        window[:] = 0.0
        change = 0.0
        inside = 0.0
        nearer = near
        for n in range(reach):
            i = first + onwards * n
            if kind[i] == FORCED:
                continue
            nearer -= 2.0 * weight[i] * values[i] * other[i]
            if len(table) > 0:
                # All its products with the frames before it in the window, twice, and with itself.
                itself = values[i] * table[i, i]
                inner = itself
                if not alone:
                    inner = (
                        diagonal[i] - sums[first, i]
                        if onwards > 0
                        else sums[frames, i] - diagonal[i] + itself
                    )
                change += values[i] * (8.0 * inner - 4.0 * itself - 4.0 * half[i])
            else:
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
        idle = idle + 1 if size == 0 else 0
        for n in range(size):
            i = first + onwards * n
            if kind[i] != FORCED:
                near -= 2.0 * weight[i] * values[i] * other[i]
                if alone:
                    objective += move(p, i, -2.0 * values[i], z, half)
                values[i] = -values[i]
        changed = min(first, first + onwards * (size - 1))
        turn = (turn + 1) % turns
    return cost(p, values, z)


@compiled_with_free_sums
def better(frames_and_components, size, first, second):  # type: ignore[no-untyped-def]
    """Return True if the second cost J is lower than the first by more than margin and rounding error."""
    return second < first - MARGIN * abs(first) - allowance_of(frames_and_components, size, first)


@compiled_with_free_sums
def first_signs(p, weight, differences, longest, nearly, size):  # type: ignore[no-untyped-def]
    """Return the cheapest signs (F,) that local search finds from several smooth initial trajectories, and their cost
    J.

    The starts are the smooth paths for the weights `differences` (D, 2), and their mirrors.

    Starts whose J, after flips of single frames, is up to `nearly` times the least are improved by windows of up to
    `longest` frames too; of what is found, and its mirror, the best.
    """
    kind = p.kind
    frames = len(kind)
    numbers = frames + p.basis.shape[1]
    allowance = allowance_of(numbers, size, 0.0)
    starts = np.empty((2 * len(differences) + 1, frames))
    costs = np.empty(len(starts))
    count = 0
    single = min(longest, 1)  # not a constant, for which `descend` would be compiled once more
    for d in range(len(differences)):
        path = smooth_path(p, differences[d, 0], differences[d, 1])
        for mirror in range(2):
            start = starts[count]
            for i in range(frames):
                start[i] = -path[i] if mirror and kind[i] == 0 else path[i]
            costs[count] = descend(p, start, single, start, weight, False, allowance)
            duplicate = False
            for other in range(count):
                same = True
                for i in range(frames):
                    same = same and starts[other, i] == start[i]
                duplicate = duplicate or same
            if not duplicate:
                count += 1
    least = costs[:count].min()
    enough = max(nearly * least, least + allowance_of(numbers, size, least))
    chosen = -1
    for n in range(count + 1):
        if n == count:
            for i in range(frames):
                starts[n, i] = -starts[chosen, i] if kind[i] == 0 else starts[chosen, i]
        elif costs[n] > enough:
            continue
        costs[n] = descend(p, starts[n], longest, starts[n], weight, False, allowance)
        if chosen < 0 or better(numbers, size, costs[chosen], costs[n]):
            chosen = n
    return starts[chosen].copy(), costs[chosen]


# --- branch and bound over boxes ---------------------------------------------------------------------------


@compiled_with_free_sums
def may_gain(p, values, trial, half, wanted):  # type: ignore[no-untyped-def]
    """Return True unless the cost of `trial` exceeds the cost of `values` by `wanted` or more.

    `half` belongs to `values`.  Without a table the answer is always True.
    """
    table = p.table
    if len(table) == 0:
        return True
    change = 0.0
    for i in range(len(half)):
        off = trial[i] - values[i]
        if off != 0.0:
            inner = 2.0 * half[i]
            for j in range(len(half)):
                inner += table[i, j] * (trial[j] - values[j])
            change += off * inner
    return change < wanted


@compiled_with_free_sums
def search_boxes(p, tree, best, found, gap, allowance, budget):  # type: ignore[no-untyped-def]
    """Continue branch and bound for about `budget` sweeps; write better signs into `found`, their cost into `best`."""
    fixed, values, z, half, trail, levels, bounds, counts = (
        tree.fixed, tree.values, tree.z, tree.half, tree.trail, tree.levels, tree.bounds, tree.counts,
    )  # fmt: skip
    kind, bent = p.kind, p.bent
    frames = len(kind)
    trial = np.empty(frames)
    relaxed = np.nan
    carried = 0
    while budget > 0 and counts[STATE] != DONE:
        depth = counts[DEPTH]
        if counts[STATE] == LEAVE:
            if depth == 0:
                counts[STATE] = DONE
                continue
            depth -= 1
            chosen = levels[depth, 0]
            for j in range(levels[depth, 2], counts[TRAIL]):
                fixed[trail[j]] = 0
            counts[TRAIL] = levels[depth, 2]
            if levels[depth, 1] == 0:
                levels[depth, 1] = 1
                fixed[chosen] = -fixed[chosen]
                counts[STATE] = ENTER
            else:
                fixed[chosen] = 0
                counts[DEPTH] = depth
            continue
        counts[NODES] += 1
        cutoff = best[0] - max(gap * abs(best[0]), 2.0 * allowance)
        left = False
        carried += 1
        if carried >= REFRESH or len(p.table) == 0:
            relaxed = np.nan
            carried = 0
        for i in range(frames):
            if fixed[i] == 0:
                left = left or kind[i] != RELAXED
            elif values[i] != fixed[i]:
                if carried > 0:
                    relaxed += move(p, i, fixed[i] - values[i], z, half)
                values[i] = fixed[i]
        bound, relaxed, sweeps, counts[TRAIL] = relax(
            p, fixed, (values, z, half), relaxed, cutoff,
            (FEWEST_SWEEPS if left else LAST_SWEEPS, MOST_SWEEPS if left else LAST_SWEEPS),
            allowance, trail, counts[TRAIL],
        )  # fmt: skip
        budget -= sweeps + 1
        if depth > 0:
            bound = max(bound, bounds[depth - 1])
        counts[STATE] = LEAVE
        if bound >= cutoff:
            continue
        for i in range(frames):
            trial[i] = values[i] if kind[i] == RELAXED else -1.0 if values[i] < 0.0 else 1.0
        # Half of what is not looked for: what is better by less may be rounding.
        enough = 0.5 * (best[0] + cutoff)
        if (
            may_gain(p, values, trial, half, enough + 0.5 * allowance - relaxed)
            and cost(p, trial, z) < enough
        ):
            best[0] = cost(p, trial, z)
            copy(trial, found)
            cutoff = best[0] - max(gap * abs(best[0]), 2.0 * allowance)
            if bound >= cutoff:
                continue
        chosen = -1
        most = -1.0
        for i in range(frames):
            if fixed[i] == 0 and kind[i] != RELAXED:
                score = bent[i] * (1.0 - values[i] * values[i] + 1e-9)
                if score > most:
                    most = score
                    chosen = i
        if chosen < 0:
            if left:
                counts[STATE] = ENTER  # all the rest was held on the way: once more, to the end
            else:
                bounds[-1] = min(bounds[-1], bound)
            continue
        levels[depth, 0] = chosen
        levels[depth, 1] = 0
        levels[depth, 2] = counts[TRAIL]
        bounds[depth] = bound
        fixed[chosen] = -1 if values[chosen] < 0.0 else 1
        counts[DEPTH] = depth + 1
        counts[STATE] = ENTER


# --- depth first in time -----------------------------------------------------------------------------------


@compiled_with_free_sums
def prepare(rows, kind, kappa, start, gains, worth, links):  # type: ignore[no-untyped-def]
    """Compute the gains of recursive least squares for the frames from `start` on, which do not depend on the signs.

    A relaxed frame is left out, by a gain of zero and a worth of zero: it could only add.
    """
    components = rows.shape[2]
    spread = np.zeros((components, components))
    along = np.empty(components)
    for k in range(components):
        spread[k, k] = 1.0 / kappa
    for i in range(start, len(kind)):
        for row in range(2):
            along[:] = 0.0
            if row == 1 or kind[i] != RELAXED:
                for j in range(components):
                    share = rows[row, i, j]
                    if share != 0.0:
                        for k in range(components):
                            along[k] += share * spread[j, k]
            norm = 1.0
            for k in range(components):
                norm += along[k] * rows[row, i, k]
            worth[row, i] = 0.0 if row == 0 and kind[i] == RELAXED else 1.0 / norm
            for k in range(components):
                gains[row, i, k] = along[k] / norm
            if norm > 1.0:
                for k in range(components):
                    share = gains[row, i, k]
                    for j in range(components):
                        spread[k, j] -= share * along[j]
        for row in range(2):
            links[i, 2, row] = 0.0
            for other in range(2):
                links[i, row, other] = 0.0
                for k in range(components):
                    links[i, row, other] += rows[row, i + 1, k] * gains[other, i, k]
        for k in range(components):
            links[i, 2, 0] += rows[1, i, k] * gains[0, i, k]


@compiled_with_free_sums
def search_suffixes(p, tree, best, found, gap, allowance, budget):  # type: ignore[no-untyped-def]
    """Continue the suffix search for about `budget` nodes; write better signs into `found`, their cost into `best`."""
    rows, gains, worth, links, state, ahead, predicted, off, spent, signs, rest, ends, counts = (
        tree.rows, tree.gains, tree.worth, tree.links, tree.state, tree.ahead, tree.predicted, tree.off,
        tree.spent, tree.signs, tree.rest, tree.ends, tree.counts,
    )  # fmt: skip
    middle, half_chord, kind = p.middle, p.half_chord, p.kind
    frames, components = p.basis.shape
    lost = tree.lost
    leaf = (
        np.empty(frames, np.int8),
        np.empty(frames),
        np.empty(frames),
        np.empty(frames, np.int64),
    )
    parent_bound = np.nan
    leaves = 0
    while (budget > 0 or counts[PREPARED] == FIRST) and counts[FINISHED] == 0:
        start = counts[START]
        if counts[PREPARED] == 0:
            prepare(rows, kind, tree.kappa, start, gains, worth, links)
            budget -= 1 + (frames - start) * components // 4
            spent[start] = 0.0
            state[start] = 0.0
            predicted[start] = 0.0
            signs[start, 2] = 0
            counts[LEVEL] = start
            counts[PREPARED] = FIRST
        cutoff = best[0] - max(gap * abs(best[0]), 2.0 * allowance)
        limit = cutoff if start == 0 else ends[0] * (1.0 - LOOSE)
        i = counts[LEVEL]
        if counts[PREPARED] == FIRST:  # the best known, for what it costs from `start` on
            sign = -1.0 if found[i] < 0.0 else 1.0
        else:
            given_up = start > 0 and counts[TRIED] >= PATIENCE
            if i < start or given_up or (start > 0 and rest[start + 1] >= limit):
                # Everything from `start` on costs at least as much as was looked for, unless that was given up.
                if start > 0:
                    rest[start] = rest[start + 1] if given_up else max(rest[start + 1], limit)
                else:
                    counts[FINISHED] = 1
                counts[START] = max(start - STEP, 0) if start > 0 else -1
                for j in range(counts[START] + 1, start):
                    rest[j] = rest[start]
                counts[PREPARED] = 0
                continue
            if signs[i, 1] == -1:  # first time here: the sign of the best known first
                if kind[i] == FORCED:
                    signs[i, 0] = 1
                    signs[i, 1] = 1
                else:
                    signs[i, 0] = -1 if found[i] < 0.0 else 1
                    signs[i, 1] = 1 if kind[i] == RELAXED else 2
            elif signs[i, 1] == 1 and kind[i] == 0:
                signs[i, 0] = -signs[i, 0]
            if signs[i, 1] == 0:
                counts[LEVEL] = i - 1
                continue
            signs[i, 1] -= 1
            budget -= 1
            counts[ENTERED] += 1
            counts[TRIED] += 1
            sign = float(signs[i, 0])
        # The frame's cost, given the coefficients before it, and those after it, unless that is too much already.
        points = shares = 0.0
        for d in range(3):
            x = middle[i, d] + sign * half_chord[i, d] - predicted[i, 0, d]
            w = -predicted[i, 1, d] - links[i, 2, 0] * x
            points += x * x
            shares += w * w
            off[i, 0, d] = x
            off[i, 1, d] = w
        spent[i + 1] = spent[i] + points * worth[0, i] + shares * worth[1, i]
        if counts[PREPARED] != FIRST:
            bound = max(spent[i + 1] - lost, 0.0) + rest[i + 1] - (allowance if start == 0 else 0.0)
            if bound >= limit:
                continue
        # The coefficients before a frame are found when one of its signs is not ruled out.
        if signs[i, 2] == 0:
            signs[i, 2] = 1
            for d in range(3):
                x = w = 0.0
                if i > start:
                    e, f = off[i - 1, 0, d], off[i - 1, 1, d]
                    for k in range(components):
                        value = state[i - 1, d, k] + gains[0, i - 1, k] * e + gains[1, i - 1, k] * f
                        state[i, d, k] = value
                        x += rows[0, i + 1, k] * value
                        w += rows[1, i + 1, k] * value
                ahead[i, 0, d] = x
                ahead[i, 1, d] = w
        if i + 1 < frames:
            for row in range(2):
                for d in range(3):
                    predicted[i + 1, row, d] = (
                        ahead[i, row, d] + links[i, row, 0] * off[i, 0, d] + links[i, row, 1] * off[i, 1, d]
                    )
            counts[LEVEL] = i + 1
            signs[i + 1, 1] = -1
            signs[i + 1, 2] = 0
        elif counts[PREPARED] == FIRST:
            ends[0] = max(spent[frames] - lost, 0.0)
            counts[LEVEL] = start
            counts[PREPARED] = SEARCHED
            counts[TRIED] = 0
            signs[start, 1] = -1
            budget = max(budget, 1)  # a start is not left before its first node
        elif start > 0:
            ends[0] = max(spent[frames] - lost, 0.0)
        else:
            leaves += 1
            if leaves % REFRESH == 0 or len(p.table) == 0:
                parent_bound = np.nan
            parent_bound = enter_leaf(p, signs, leaf, parent_bound, best, found, gap, allowance, ends)
            budget -= frames


@compiled_with_free_sums
def enter_leaf(p, signs, leaf, parent_bound, best, found, gap, allowance, ends):  # type: ignore[no-untyped-def]
    """Optimise the relaxed frames after all signs are chosen, and return the resulting cost J.

    `leaf` holds what is held, the values, half the derivatives by them and a trail, of the leaf before where its J is
    `known` and not NaN.
    """
    fixed, values, half, trail = leaf
    kind = p.kind
    z = np.empty((3, p.basis.shape[1]))
    relaxed = False
    for i in range(len(fixed)):
        relaxed = relaxed or kind[i] == RELAXED
        if np.isnan(parent_bound):
            fixed[i] = 0 if kind[i] == RELAXED else signs[i, 0]
            values[i] = found[i] if kind[i] == RELAXED else signs[i, 0]
        elif fixed[i] != 0 and fixed[i] != signs[i, 0]:
            fixed[i] = signs[i, 0]
            parent_bound += move(p, i, fixed[i] - values[i], z, half)
            values[i] = fixed[i]
    cutoff = best[0] - max(gap * abs(best[0]), 2.0 * allowance)
    bound, parent_bound, _, _ = relax(
        p, fixed, (values, z, half), parent_bound, cutoff, (LAST_SWEEPS, LAST_SWEEPS), allowance, trail, 0
    )
    # Half of what is not looked for: what is better by less may be rounding.
    enough = 0.5 * (best[0] + cutoff)
    if parent_bound < enough + allowance:
        objective = cost(p, values, z)
        if objective < enough:
            best[0] = objective
            copy(values, found)
    if relaxed and bound < best[0] - max(gap * abs(best[0]), 2.0 * allowance):
        ends[1] = min(ends[1], bound)
    return parent_bound
