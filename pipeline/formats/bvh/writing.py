"""Writing BVH files: every joint with channels of position, so that no position is lost to rotations."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.points.cells import positions_to_write


def write(
    path: str | Path,
    names: Sequence[str],
    positions_mm: np.ndarray,
    frame_rate_hz: float,
    parents: Sequence[int] | None = None,
) -> None:
    """Write positions as BVH in centimetres; each joint's channels are its position relative to its parent.

    Parameters
    ----------
    path : str or Path
    names : sequence of str
        P names; blanks in them become underlines.
    positions_mm : (T, P, 3) array
        Millimetres; the format has no way to leave a sample out.
    frame_rate_hz : float
    parents : sequence of int, optional
        Index of each point's parent, -1 for a root; by default every point is a root.

    Raises
    ------
    InvalidInput
        If the shapes do not fit each other, a sample is missing, or a name or a coordinate cannot be written.
    """
    where = Path(path).name
    names = [re.sub(r"\s+", "_", name) for name in names]
    positions = positions_to_write(names, positions_mm, frame_rate_hz, where, distinct=True) / 10.0
    if np.isnan(positions).any():
        frame, point = np.argwhere(np.isnan(positions))[0][:2]
        what = "BVH cannot leave a sample out: choose another format"
        raise damaged(what, where, received=f"{names[point]} missing in frame {frame}")
    above = [-1] * len(names) if parents is None else list(parents)
    children = {p: [k for k, parent in enumerate(above) if parent == p] for p in range(-1, len(names))}
    lines, order = ["HIERARCHY"], []

    def joint(k: int, depth: int) -> None:
        order.append(k)
        blank = "\t" * depth
        offset = positions[:, k].mean(axis=0) - (positions[:, above[k]].mean(axis=0) if above[k] >= 0 else 0)
        lines.append(f"{blank}{'ROOT' if above[k] < 0 else 'JOINT'} {names[k]}")
        lines.append(blank + "{")
        lines.append(f"{blank}\tOFFSET " + " ".join(f"{value:.6f}" for value in offset))
        lines.append(f"{blank}\tCHANNELS 3 Xposition Yposition Zposition")
        for child in children[k]:
            joint(child, depth + 1)
        if not children[k]:
            lines.extend([f"{blank}\tEnd Site", blank + "\t{", f"{blank}\t\tOFFSET 0 0 0", blank + "\t}"])
        lines.append(blank + "}")

    for root in children[-1]:
        joint(root, 0)
    lines += ["MOTION", f"Frames: {len(positions)}", f"Frame Time: {1.0 / frame_rate_hz!r}"]
    relative = np.stack(
        [positions[:, k] - (positions[:, above[k]] if above[k] >= 0 else 0.0) for k in order], axis=1
    )
    lines += [" ".join(map(repr, row)) for row in relative.reshape(len(positions), -1).tolist()]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
