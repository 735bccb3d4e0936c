"""Left and right points whose labels were exchanged in some frames, as after a gap: found, and exchanged back."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from pipeline.skeleton.complaint import Remark
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_points import plain_name

JUMP = 1.5
"""Ratio of the way of two points from frame to frame to that with labels exchanged from which they were exchanged."""
LEAST = 0.05
"""That way at least, over the root mean square distance of points from their middle: some 25 mm of a body."""
LONGEST_GAP_S = 0.25
"""Gaps over which a way is followed."""
MOST = 0.25
"""Share of the frames in which labels are exchanged back; of more it is not known which are the right ones."""

EXCHANGED = "labels_exchanged"
"""Code of a remark on labels that change places."""


def exchanged_back(motion: MotionCapture, points: Iterable[int]) -> MotionCapture:
    """Return a recording with left and right labels as in most of its frames, and a note on each pair that is not.

    Parameters
    ----------
    motion : MotionCapture
    points : iterable of int
        Which points are looked at; those whose names differ by the side alone are pairs.
    """
    named = {plain_name(motion.names[k]): k for k in points}
    pairs = [
        (k, named["r" + name[1:]]) for name, k in named.items() if name[:1] == "l" and "r" + name[1:] in named
    ]
    if not pairs:
        return motion
    positions, notes = motion.positions_mm.copy(), list(motion.notes)
    body = positions[:, list(named.values())]
    size = float(
        np.sqrt(np.nanmedian(np.nanvar(body[np.isfinite(body).any(axis=(1, 2))], axis=1).sum(axis=-1)))
    )
    for pair in pairs:
        seen = np.flatnonzero(motion.valid[:, pair].all(axis=1))
        steps = np.diff(positions[seen][:, pair], axis=0)
        across = positions[seen][1:, pair] - positions[seen][:-1, pair[::-1]]
        kept, exchanged = (np.linalg.norm(way, axis=-1).sum(axis=-1) for way in (steps, across))
        near = np.diff(seen) <= LONGEST_GAP_S * motion.frame_rate_hz
        changes = near & (kept > JUMP * exchanged) & (kept > LEAST * size)
        if not changes.any():
            continue
        other = np.concatenate([[False], np.cumsum(changes) % 2 == 1])
        frames = seen[other if other.mean() <= 0.5 else ~other]
        remark = f"{motion.names[pair[0]]} and {motion.names[pair[1]]} change places: "
        if len(frames) > MOST * len(seen):
            remark += f"from frame {seen[1:][changes][0]} on their labels differ from those before."
            notes.append(Remark(remark, EXCHANGED))
            continue
        positions[np.ix_(frames, pair)] = positions[np.ix_(frames, pair[::-1])]
        remark += f"{len(frames)} frames from {frames[0]} to {frames[-1]} were exchanged back."
        notes.append(Remark(remark, EXCHANGED))
    return replace(motion, positions_mm=positions, notes=tuple(notes))
