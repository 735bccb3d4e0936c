"""Independent BVH reader for comparison, which computes postures with quaternions and one point at a time.

It shares nothing with the reader of the package.  As BVH is described by its users: a joint stands at its offset, or
where its channels of position put it, in the frame of its parent; its rotations apply in the order of its channels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def read(path: Path, *, rotations_only: bool = False) -> tuple[dict[str, list[Vector]], float]:
    """Return the positions of each joint in every frame, in the file's unit, and the seconds between frames.

    With `rotations_only`, channels of position below the root are passed over, as many programs do.
    """
    words = iter(path.read_text(encoding="utf-8").replace("Frame Time:", "FrameTime").split())
    assert next(words) == "HIERARCHY"
    roots = []
    while (word := next(words)) == "ROOT":
        roots.append(_joint(words))
    assert (word, next(words)) == ("MOTION", "Frames:")
    frames = int(next(words))
    assert next(words) == "FrameTime"
    seconds = float(next(words))
    result: dict[str, list[Vector]] = {}
    for _ in range(frames):
        for root in roots:
            _place(root, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), words, result, rotations_only)
    assert next(words, None) is None
    return result, seconds


def _joint(words: Iterator[str]) -> dict:
    joint: dict = {"name": next(words), "channels": [], "children": []}
    assert next(words) == "{"
    while (word := next(words)) != "}":
        if word == "OFFSET":
            joint["offset"] = [float(next(words)) for _ in range(3)]
        elif word == "CHANNELS":
            joint["channels"] = [next(words) for _ in range(int(next(words)))]
        else:
            joint["children"].append(_joint(words) | {"end": word == "End"})
    return joint


def _place(
    joint: dict,
    parent_at: Vector,
    parent_turn: Quaternion,
    words: Iterator[str],
    found: dict[str, list[Vector]],
    rotations_only: bool,
) -> None:
    local, turn = list(joint["offset"]), parent_turn
    for channel in joint["channels"]:
        value, axis = float(next(words)), "xyz".index(channel[0].lower())
        if channel.lower().endswith("rotation"):
            half = math.radians(value) / 2
            about = [0.0, 0.0, 0.0]
            about[axis] = math.sin(half)
            turn = _product(turn, (math.cos(half), *about))
        elif not rotations_only or "end" not in joint:
            local[axis] = value
    moved = _product(_product(parent_turn, (0.0, *local)), (parent_turn[0], *(-x for x in parent_turn[1:])))
    at = (parent_at[0] + moved[1], parent_at[1] + moved[2], parent_at[2] + moved[3])
    if not joint.get("end"):
        found.setdefault(joint["name"], []).append(at)
    for child in joint["children"]:
        _place(child, at, turn, words, found, rotations_only)


def _product(p: tuple[float, ...], q: tuple[float, ...]) -> Quaternion:
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )
