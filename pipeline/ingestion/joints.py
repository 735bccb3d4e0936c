"""From a file to joints: the file is read, a person and a mapping are chosen, labels repaired, joints made and checked.

Markers that the file lacks come from a static trial first, see `static_trial`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline import formats, mappings
from pipeline.core import walking
from pipeline.ingestion import static_trial
from pipeline.ingestion.corpus import Clip, digest
from pipeline.skeleton import WALKER15
from pipeline.skeleton.complaint import Complaint, Remark
from pipeline.skeleton.mapped_joints import MappedPoints, map_joints, up_axis
from pipeline.skeleton.point_names import plain_name
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from pipeline.validation import InvalidInput, listed

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


def read_clip(clip: Clip) -> tuple[MotionCapture, np.ndarray, np.ndarray]:
    """Return the content of the file, its joints' positions (T, 15, 3), mm, and where they are valid (T, 15).

    Joints above the legs that the file does not give are never valid.

    Raises
    ------
    InvalidInput
        If the file is missing, differs from the table, changed since it was found, cannot be read, or gives no legs.
    """
    if clip.path is None:
        raise InvalidInput("not on this machine", expected="`make data` to fetch it", code="not_fetched")
    if clip.mismatch:
        raise InvalidInput(clip.mismatch, code=clip.mismatch.code)
    if digest(clip.path) != clip.sha256:
        raise InvalidInput("the file changed during this run", clip.name, code="file_changed")
    stated: dict[str, Any] = {"frame_rate_hz": clip.frame_rate_hz or None, "units": clip.units or None}
    motion = formats.read(clip.path, **stated, up=clip.up)
    known = [clip.mapping] if clip.mapping else list(mappings.shipped().values())
    motion = static_trial.completed(motion, known, clip.statics, **stated) if clip.statics else motion
    return joints_of(motion, clip.mapping, clip.subject)


def joints_of(
    motion: MotionCapture, mapping: SourceMapping | None, subject: str = ""
) -> tuple[MotionCapture, np.ndarray, np.ndarray]:
    """Return a recording with notes on what was decided, its joints (T, 15, 3), mm, and where they are valid.

    Parameters
    ----------
    motion : MotionCapture
    mapping : SourceMapping or None
        None: the one that ships and fits best.
    subject : str
        Who, in a file of several people.

    Raises
    ------
    InvalidInput
        If nothing was measured, none fits, the mapping does not give legs and pelvis, or nobody of several people is
        chosen.
    """
    if not motion.valid.any():
        raise InvalidInput("no sample of any point was measured", code="nothing_measured")
    known = list(mappings.shipped().values()) if mapping is None else [mapping]
    motion = mappings.of_one_person(motion, known, subject)
    notes = list(motion.notes)
    if mapping is None:
        fit = mappings.suggest(motion, known)
        if not fit.usable:
            lacking = listed(fit.lacking)
            raise InvalidInput(
                "no mapping that ships gives legs and pelvis of this recording",
                expected="`python -m pipeline inspect FILE write=my_lab.yaml`, then skeleton=my_lab.yaml",
                received=f"nearest {fit.mapping.name}, without {lacking}",
                code="no_mapping",
                mapping=fit.mapping.name,
            )
        mapping = fit.mapping
        notes.append(f"Recognised as {mapping.name}.")
    points = MappedPoints(motion, mapping)
    used = {point for joint in WALKER15.joints for point in points.weights(joint)}
    motion = exchanged_back(replace(motion, notes=tuple(notes)), used)
    complaints = mappings.check(motion, mapping)
    positions, valid = map_joints(motion, mapping)
    if motion.up == UpAxis.auto and mapping.up not in (UpAxis.auto, up := up_axis(motion, mapping)):
        sentence = (
            f"{mapping.name} says that {mapping.up} points up, but the body stands along {up}, which is used"
        )
        complaints.append(Complaint("axis", sentence))
    notes = [*motion.notes, *(complaint.sentence for complaint in complaints)]
    factor, sentence = mappings.rescaled(motion, mapping, walking.leg_length(positions))
    notes += [sentence] if sentence else []
    return replace(motion, notes=tuple(notes), complaints=tuple(complaints)), positions * factor, valid


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
