"""From a file to joints: read, complete by a static trial, choose person and mapping, repair labels, map, check.

A static trial is a recording of somebody who stands still with markers on knees and ankles.  Laboratories that track
segments by technical clusters record one.  Each of these markers is rigid with the segment above its joint, and so
with the cluster beside that segment, which carries it along in a walk.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import formats, mappings
from pipeline.core import walking
from pipeline.core.rigid import fit_rigid_motion, rigid_clusters
from pipeline.ingestion.corpus import Clip, digest
from pipeline.skeleton import WALKER15
from pipeline.skeleton.complaint import Complaint, Remark
from pipeline.skeleton.mapped_joints import MappedPoints, map_joints, plain_name, up_axis, with_z_up
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from pipeline.validation import InvalidInput, listed, told_apart

MAX_MOTION = 0.02
"""Largest motion (root mean square) of three quarters of the points of a standing person, over the body's size."""

SLACK = 0.012
"""Largest root mean square change of distances within a segment, over the length of the legs: 10 mm."""

AT_JOINT = 0.12
"""Largest distance of a marker from the joint that it marks, over the length of the legs: 100 mm."""

_SIDES = {"l": "left", "r": "right"}
_SEGMENTS = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
"""Segments by their upper and lower joints."""

_AT_A_JOINT = re.compile(r"kne|(?<!sh)ank|hip|hjc|troch|condy|asi|ias|elb|wri|sho|acr|foot|heel|calc|hand")
"""Names of points at joints, which belong to no technical cluster."""

EXCHANGED = "labels_exchanged"
"""Code of a remark on labels that change places."""

EXCHANGE_RATIO = 1.5
"""Ratio of the paths of two points as labelled and with labels exchanged, above which the labels are exchanged."""

MIN_JUMP = 0.05
"""Shortest such path, over the root mean square distance of the points from their middle: 25 mm of a body."""

MAX_GAP_S = 0.25
"""Longest gap across which a path is followed."""

MAX_EXCHANGED = 0.25
"""Largest share of frames that are exchanged back; beyond it the right labels are unknown."""


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
    motion = completed(motion, known, clip.statics, **stated) if clip.statics else motion
    return joints_of(motion, clip.mapping, clip.subject)


def completed(
    motion: MotionCapture,
    known: Sequence[SourceMapping],
    files: Sequence[Path],
    *,
    units: str | None = None,
    frame_rate_hz: float | None = None,
) -> MotionCapture:
    """Return a recording with what the first fitting static trial adds; as it is, if it needs none or none fits."""
    if mappings.suggest(motion, known).usable:
        return motion
    for path in files:
        try:
            added = carry(motion, standing(path, units=units, frame_rate_hz=frame_rate_hz), path.name, known)
        except InvalidInput:  # another trial, which has a line of its own in every report
            continue
        if mappings.suggest(added, known).usable:
            return added
    return motion


def standing(path: Path, *, units: str | None = None, frame_rate_hz: float | None = None) -> MotionCapture:
    """Return the posture of a static trial, one frame of the points that were seen.

    Raises
    ------
    InvalidInput
        If the file cannot be read or somebody moves in it.
    """
    try:
        stamp = path.stat().st_mtime_ns
    except OSError as error:
        raise InvalidInput(
            "cannot be read", path.name, received=error.strerror or "", code="unreadable"
        ) from None
    posture, share = _posture(path, stamp, units, frame_rate_hz)
    if share > MAX_MOTION:
        raise InvalidInput(
            "nobody stands still in the static trial",
            path.name,
            f"points within {MAX_MOTION:.0%} of the body's size",
            f"{told_apart(100 * share, 100 * MAX_MOTION, 0)} %",
            code="not_still",
        )
    return posture


@functools.cache
def _posture(
    path: Path, stamp: int, units: str | None, frame_rate_hz: float | None
) -> tuple[MotionCapture, float]:
    """The median place of each point that was seen, and how far the median point moves about it, rms, mm."""
    motion = formats.read(path, units=units, frame_rate_hz=frame_rate_hz)
    seen = np.flatnonzero(motion.valid.any(axis=0))
    place = np.nanmedian(motion.positions_mm[:, seen], axis=0)
    names = tuple(motion.names[k] for k in seen)
    posture = replace(motion, names=names, positions_mm=place[None], valid=np.ones((1, len(seen)), bool))
    return posture, moves(motion.positions_mm)


def moves(positions: np.ndarray) -> float:
    """Return how far three quarters of points (T, P, 3) move at most, rms about their places, to the body's size."""
    positions = positions[:, np.isfinite(positions).all(axis=-1).any(axis=0)]
    if not positions.size:
        return np.inf
    off = ((positions - np.nanmedian(positions, axis=0)) ** 2).sum(axis=-1)
    return float(np.quantile(np.sqrt(np.nanmean(off, axis=0)), 0.75)) / max(
        _size(positions), np.finfo(float).tiny
    )


def _size(positions: np.ndarray) -> float:
    """Extent of a body along its longest axis, in the frame of (T, P, 3) that shows most of its points."""
    fullest = positions[np.isfinite(positions).all(axis=-1).sum(axis=1).argmax()]
    return float(np.ptp(fullest[np.isfinite(fullest).all(axis=-1)], axis=0).max())


def carry(
    motion: MotionCapture, posture: MotionCapture, name: str, known: Sequence[SourceMapping]
) -> MotionCapture:
    """Return a recording with the markers of a static trial that it lacks, carried along by clusters of points.

    Parameters
    ----------
    motion : MotionCapture
    posture : MotionCapture
        Of the static trial, one frame, in whatever axes.
    name : str
        Of the static trial, for the note on what was carried by what, with the residual of each cluster.
    known : sequence of SourceMapping
        Mappings of which one gives legs and pelvis of the static trial.

    Raises
    ------
    InvalidInput
        If none does, or no cluster carries anything.
    """
    fit = mappings.suggest(posture, known)
    if not fit.usable:
        lacking = listed(fit.lacking)
        raise InvalidInput(
            "the static trial gives no legs and pelvis", name, received=f"no {lacking}", code="no_legs"
        )
    place = with_z_up(posture.positions_mm[0], up_axis(posture, fit.mapping))
    mapped, _ = map_joints(posture, fit.mapping)
    joints = dict(zip(WALKER15.joints, mapped[0], strict=True))
    leg = walking.leg_length(mapped)  # in the unit of both files, whatever it is
    factor, _ = mappings.rescaled(posture, fit.mapping, leg)
    source = MappedPoints(posture, fit.mapping)
    seen = np.asarray(motion.valid.any(axis=0))
    there = {plain_name(point): k for k, point in enumerate(posture.names)}
    here = {plain_name(point): k for k, point in enumerate(motion.names) if seen[k]}
    names, positions, sentences = [], [], []
    for side, other in ("lr", "rl"):
        shared = [
            point for point in there if point[0] == side and other + point[1:] in there and point in here
        ]
        static, moving = np.array([[there[point], here[point]] for point in shared], int).reshape(-1, 2).T
        ends = np.array([[joints[f"{_SIDES[side]}_{end}"] for end in pair] for pair in _SEGMENTS])
        groups: dict[int, list[int]] = {}
        for group in rigid_clusters(motion.positions_mm[:, moving], SLACK * leg, place[static]):
            groups.setdefault(_beside(place[static[group]].mean(axis=0), ends), group)
        for n, (_, lower) in enumerate(_SEGMENTS):
            joint = f"{_SIDES[side]}_{lower}"
            points = [
                k
                for k in source.weights(joint)
                if plain_name(posture.names[k]) not in here
                and np.linalg.norm(place[k] - joints[joint]) <= AT_JOINT * leg
            ]
            if not points or n not in groups:
                continue
            group = groups[n]
            found = fit_rigid_motion(place[static[group]], motion.positions_mm[:, moving[group]])
            residual = found.residual_mm[np.isfinite(found.residual_mm)]
            if len(residual):
                positions.append(found.carry(place[points]))
                names += [posture.names[k] for k in points]
                by = ", ".join(motion.names[k] for k in moving[group])
                rms = factor * np.sqrt(np.mean(residual**2))
                sentences.append(f"{', '.join(names[-len(points) :])} by {by} (residual {rms:.1f} mm)")
    if not names:
        raise InvalidInput(
            "no cluster of the walk carries a marker of the static trial",
            name,
            "three points of a thigh or shank that are in both trials",
            code="no_cluster",
        )
    kept = [k for k, point in enumerate(motion.names) if seen[k] or point not in names]
    together = np.concatenate([motion.positions_mm[:, kept], *positions], axis=1)
    return replace(
        motion,
        names=(*(motion.names[k] for k in kept), *names),
        positions_mm=together,
        valid=np.isfinite(together).all(axis=-1),
        notes=(*motion.notes, f"Carried along from the static trial {name}: {'; '.join(sentences)}."),
    )


def _beside(point: np.ndarray, ends: np.ndarray) -> int:
    """Return the number of the segment (S, 2, 3) that a point lies beside, between its ends; -1 if it does of none."""
    along = ends[:, 1] - ends[:, 0]
    share = ((point - ends[:, 0]) * along).sum(axis=-1) / (along**2).sum(axis=-1)
    away = np.linalg.norm(point - ends[:, 0] - share[:, None] * along, axis=-1)
    away = np.where((share > 0) & (share < 1), away, np.inf)  # NaN lies between no ends
    return int(away.argmin()) if np.isfinite(away).any() else -1


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
        near = np.diff(seen) <= MAX_GAP_S * motion.frame_rate_hz
        changes = near & (kept > EXCHANGE_RATIO * exchanged) & (kept > MIN_JUMP * size)
        if not changes.any():
            continue
        other = np.concatenate([[False], np.cumsum(changes) % 2 == 1])
        frames = seen[other if other.mean() <= 0.5 else ~other]
        remark = f"{motion.names[pair[0]]} and {motion.names[pair[1]]} change places: "
        if len(frames) > MAX_EXCHANGED * len(seen):
            remark += f"from frame {seen[1:][changes][0]} on their labels differ from those before."
            notes.append(Remark(remark, EXCHANGED))
            continue
        positions[np.ix_(frames, pair)] = positions[np.ix_(frames, pair[::-1])]
        remark += f"{len(frames)} frames from {frames[0]} to {frames[-1]} were exchanged back."
        notes.append(Remark(remark, EXCHANGED))
    return replace(motion, positions_mm=positions, notes=tuple(notes))


def technical_clusters(motion: MotionCapture) -> list[list[int]]:
    """Return groups of points that are stuck on a segment between joints: rigid, of one side, numbered or by place.

    Such are R.Thigh.Upper, R.Thigh.Front, R.Thigh.Rear, or LSK1, LSK2, LSK3; none marks a joint.
    """
    alike: dict[str, list[int]] = {}
    plain = [plain_name(name) for name in motion.names]
    for k in np.flatnonzero(motion.valid.any(axis=0)):
        if plain[k][:1] in ("l", "r") and not _AT_A_JOINT.search(plain[k]):
            alike.setdefault(plain[k][:3], []).append(int(k))
    slack = SLACK / 2 * _size(motion.positions_mm) if alike else 0.0  # a body is two legs high
    groups = [
        [points[n] for n in group]
        for points in alike.values()
        for group in rigid_clusters(motion.positions_mm[:, points], slack)
    ]
    # Where one name begins all the others, it may be a joint: LeftLeg, LeftLegTwist1, …
    return [g for g in groups if not any(all(plain[j].startswith(plain[k]) for j in g) for k in g)]
