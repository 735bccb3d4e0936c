"""Joints of a recording: read the file, add markers of a static trial, select person and mapping, repair labels.

In a static trial, a person stands still with markers on knees and ankles.  Laboratories that track segments by
technical clusters record such a trial.  Each of these markers is rigid with the segment above its joint, and so with
the cluster on that segment, from which its position in a walk is computed.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Iterator, Sequence
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
"""Largest motion of a person who stands still (upper quartile over points of the rms motion), relative to body size."""

SLACK = 0.012
"""Largest rms change of the distances between points on a rigid segment, relative to leg length (about 10 mm)."""

AT_JOINT = 0.12
"""Largest distance of a marker from the joint that it marks, relative to leg length (about 100 mm)."""

_SIDES = {"l": "left", "r": "right"}
_SEGMENTS = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
"""Segments, each with its upper and its lower joint."""

_AT_A_JOINT = re.compile(r"kne|(?<!sh)ank|hip|hjc|troch|condy|asi|ias|elb|wri|sho|acr|foot|heel|calc|hand")
"""Pattern of words in the names of markers at joints; such markers do not belong to a technical cluster."""

EXCHANGED = "labels_exchanged"
"""Code of a remark on exchanged left and right labels."""

EXCHANGE_RATIO = 1.5
"""Ratio of path lengths, with recorded to exchanged labels, above which labels are assumed to be exchanged."""

MIN_JUMP = 0.05
"""Shortest jump that counts as an exchange of labels, relative to the rms distance of the points from their centre."""

MAX_GAP_S = 0.25
"""Longest gap, s, across which an exchange of labels is detected."""

MAX_EXCHANGED = 0.25
"""Largest fraction of frames in which exchanged labels are repaired; above it, the correct labels are unknown."""


def read_clip(clip: Clip) -> tuple[MotionCapture, np.ndarray, np.ndarray]:
    """Read a recording; return it with its joints (T, 15, 3), mm, and the mask (T, 15) of valid joints.

    Joints above the legs that the recording lacks are never valid.

    Raises
    ------
    InvalidInput
        If the file is missing, differs from the table, changed during the run, cannot be read, or has no legs.
    """
    if clip.path is None:
        raise InvalidInput(
            "the recording is not available on this machine: run `make data` to fetch it",
            code="not_fetched",
        )
    if clip.mismatch:
        raise InvalidInput(clip.mismatch, code=clip.mismatch.code)
    if digest(clip.path) != clip.sha256:
        raise InvalidInput(
            "the file of the recording changed during this run", clip.name, code="file_changed"
        )
    stated: dict[str, Any] = {"frame_rate_hz": clip.frame_rate_hz or None, "units": clip.units or None}
    motion = formats.read(clip.path, **stated, up=clip.up)
    candidates = [clip.mapping] if clip.mapping else list(mappings.shipped().values())
    motion = completed(motion, candidates, clip.statics, **stated) if clip.statics else motion
    return joints_of(motion, clip.mapping, clip.subject)


def completed(
    motion: MotionCapture,
    candidates: Sequence[SourceMapping],
    files: Sequence[Path],
    *,
    units: str | None = None,
    frame_rate_hz: float | None = None,
) -> MotionCapture:
    """Add the markers of the first suitable static trial to a recording.

    If no static trial is suitable, only notes with the reasons are added.
    """
    if mappings.suggest(motion, candidates).usable:
        return motion
    notes = [*motion.notes]
    for path in files:
        try:
            posture = standing(path, units=units, frame_rate_hz=frame_rate_hz)
            added = carry(motion, posture, path.name, candidates)
        except InvalidInput as refusal:
            notes += [str(refusal)] * (refusal.code != "not_still")  # another walk is not a static trial
            continue
        if mappings.suggest(added, candidates).usable:
            return added
        notes += added.notes[len(motion.notes) :]
    return replace(motion, notes=tuple(notes))


def standing(path: Path, *, units: str | None = None, frame_rate_hz: float | None = None) -> MotionCapture:
    """Return the posture of a static trial as one frame that contains the measured points.

    Raises
    ------
    InvalidInput
        If the file cannot be read, or the person moves.
    """
    try:
        stamp = path.stat().st_mtime_ns
    except OSError as error:
        raise InvalidInput(
            "the file of the static trial cannot be read",
            path.name,
            received=error.strerror or "",
            code="unreadable",
        ) from None
    posture, share = _posture(path, stamp, units, frame_rate_hz)
    if share > MAX_MOTION:
        raise InvalidInput(
            "the person does not stand still in the static trial",
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
    """Return the posture of a static trial (median positions), and the person's motion relative to body size."""
    motion = formats.read(path, units=units, frame_rate_hz=frame_rate_hz)
    measured = np.flatnonzero(motion.valid.any(axis=0))
    median = np.nanmedian(motion.positions_mm[:, measured], axis=0)
    names = tuple(motion.names[k] for k in measured)
    posture = replace(motion, names=names, positions_mm=median[None], valid=np.ones((1, len(measured)), bool))
    return posture, moves(motion.positions_mm)


def moves(positions: np.ndarray) -> float:
    """Return the upper quartile over the points (T, P, 3) of their rms motion, relative to body size."""
    positions = positions[:, np.isfinite(positions).all(axis=-1).any(axis=0)]
    if not positions.size:
        return np.inf
    off = ((positions - np.nanmedian(positions, axis=0)) ** 2).sum(axis=-1)
    return float(np.quantile(np.sqrt(np.nanmean(off, axis=0)), 0.75)) / max(
        _size(positions), np.finfo(float).tiny
    )


def _size(positions: np.ndarray) -> float:
    """Return the largest extent of the points (T, P, 3) along an axis, in the frame with most points."""
    fullest = positions[np.isfinite(positions).all(axis=-1).sum(axis=1).argmax()]
    return float(np.ptp(fullest[np.isfinite(fullest).all(axis=-1)], axis=0).max())


def carry(
    motion: MotionCapture, posture: MotionCapture, name: str, candidates: Sequence[SourceMapping]
) -> MotionCapture:
    """Add to a recording the markers that only the static trial has, moved rigidly with clusters of points.

    Parameters
    ----------
    motion : MotionCapture
    posture : MotionCapture
        Posture of the static trial: one frame, in any axes.
    name : str
        Name of the static trial, for a note with the markers, the clusters and their residuals.
    candidates : sequence of SourceMapping
        Mappings; one of them must give legs and pelvis of the static trial.

    Raises
    ------
    InvalidInput
        If no mapping gives legs and pelvis, or no cluster moves with a missing marker.
    """
    fit = mappings.suggest(posture, candidates)
    if not fit.usable:
        lacking = listed(fit.lacking)
        raise InvalidInput(
            "the static trial lacks markers of the legs or the pelvis",
            name,
            received=f"no {lacking}",
            code="no_legs",
        )
    standing_points = with_z_up(posture.positions_mm[0], up_axis(posture, fit.mapping))
    mapped, _ = map_joints(posture, fit.mapping)
    joints = dict(zip(WALKER15.joints, mapped[0], strict=True))
    leg = walking.leg_length(mapped)  # in the unit of both files
    factor, _ = mappings.rescaled(posture, fit.mapping, leg)
    source = MappedPoints(posture, fit.mapping)
    measured = np.asarray(motion.valid.any(axis=0))
    static_index = {plain_name(point): k for k, point in enumerate(posture.names)}
    moving_index = {plain_name(point): k for k, point in enumerate(motion.names) if measured[k]}
    names, positions, sentences = [], [], []
    loose: list[str] = []
    for side, other in ("lr", "rl"):
        shared = [
            point
            for point in static_index
            if point[0] == side and other + point[1:] in static_index and point in moving_index
        ]
        pairs = [[static_index[point], moving_index[point]] for point in shared]
        static, moving = np.array(pairs, int).reshape(-1, 2).T
        ends = np.array([[joints[f"{_SIDES[side]}_{end}"] for end in pair] for pair in _SEGMENTS])
        groups: dict[int, list[int]] = {}
        for group in rigid_clusters(motion.positions_mm[:, moving], SLACK * leg, standing_points[static]):
            groups.setdefault(_segment_of(standing_points[static[group]].mean(axis=0), ends), group)
        for n, (_, lower) in enumerate(_SEGMENTS):
            joint = f"{_SIDES[side]}_{lower}"
            points = [
                k
                for k in source.weights(joint)
                if plain_name(posture.names[k]) not in moving_index
                and np.linalg.norm(standing_points[k] - joints[joint]) <= AT_JOINT * leg
            ]
            if points and n not in groups:
                loose += _loose_clusters(motion, static_index, standing_points, ends, n, factor)
            if not points or n not in groups:
                continue
            group = groups[n]
            rigid = fit_rigid_motion(standing_points[static[group]], motion.positions_mm[:, moving[group]])
            residual = rigid.residual_mm[np.isfinite(rigid.residual_mm)]
            if len(residual):
                positions.append(rigid.carry(standing_points[points]))
                names += [posture.names[k] for k in points]
                cluster = ", ".join(motion.names[k] for k in moving[group])
                rms = factor * np.sqrt(np.mean(residual**2))
                sentences.append(f"{', '.join(names[-len(points) :])} by {cluster} (residual {rms:.1f} mm)")
    if not names:
        raise InvalidInput(
            "a marker of the static trial is missing in the walk, and no cluster of markers can replace it",
            name,
            f"three points of a thigh or shank in both trials that fit to {factor * SLACK * leg:.0f} mm",
            "; ".join(loose),
            code="no_cluster",
        )
    retained = [k for k, point in enumerate(motion.names) if measured[k] or point not in names]
    together = np.concatenate([motion.positions_mm[:, retained], *positions], axis=1)
    return replace(
        motion,
        names=(*(motion.names[k] for k in retained), *names),
        positions_mm=together,
        valid=np.isfinite(together).all(axis=-1),
        notes=(*motion.notes, f"Added from the static trial {name}: {'; '.join([*sentences, *loose])}."),
    )


def _loose_clusters(
    motion: MotionCapture,
    static_index: dict[str, int],
    standing: np.ndarray,
    ends: np.ndarray,
    segment: int,
    factor: float,
) -> Iterator[str]:
    """Yield a text for each cluster of a segment that does not fit the static trial, with the residual in mm."""
    for group in technical_clusters(motion):
        shared = [k for k in group if plain_name(motion.names[k]) in static_index]
        static = standing[[static_index[plain_name(motion.names[k])] for k in shared]]
        if len(shared) >= 3 and _segment_of(static.mean(axis=0), ends) == segment:
            residual = fit_rigid_motion(static, motion.positions_mm[:, shared]).residual_mm
            names = ", ".join(motion.names[k] for k in shared)
            yield f"{names} only fit to {factor * np.sqrt(np.nanmean(residual**2)):.0f} mm"


def _segment_of(point: np.ndarray, ends: np.ndarray) -> int:
    """Return the index of the nearest segment (S, 2, 3) onto which a point projects; -1 if there is no such segment."""
    along = ends[:, 1] - ends[:, 0]
    share = ((point - ends[:, 0]) * along).sum(axis=-1) / (along**2).sum(axis=-1)
    away = np.linalg.norm(point - ends[:, 0] - share[:, None] * along, axis=-1)
    away = np.where((share > 0) & (share < 1), away, np.inf)  # NaN compares false
    return int(away.argmin()) if np.isfinite(away).any() else -1


def joints_of(
    motion: MotionCapture, mapping: SourceMapping | None, subject: str = ""
) -> tuple[MotionCapture, np.ndarray, np.ndarray]:
    """Map a recording to joints; return it with notes, joints (T, 15, 3), mm, and the mask (T, 15) of valid joints.

    Parameters
    ----------
    motion : MotionCapture
    mapping : SourceMapping or None
        Mapping of the points; None for the best shipped one.
    subject : str
        Person to read, in a file with several people.

    Raises
    ------
    InvalidInput
        If nothing was measured, no mapping fits, the mapping lacks legs or pelvis, or `subject` does not select one
        of several people.
    """
    if not motion.valid.any():
        raise InvalidInput("the recording has no measured samples", code="nothing_measured")
    candidates = list(mappings.shipped().values()) if mapping is None else [mapping]
    motion = mappings.of_one_person(motion, candidates, subject)
    notes = list(motion.notes)
    if mapping is None:
        fit = mappings.suggest(motion, candidates)
        if not fit.usable:
            lacking = listed(fit.lacking)
            raise InvalidInput(
                "no shipped mapping gives legs and pelvis of this recording: write a mapping with"
                " `python -m pipeline inspect FILE write=my_lab.yaml`, then use skeleton=my_lab.yaml",
                received=f"best fit {fit.mapping.name}, which lacks {lacking}",
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
        sentence = f"{mapping.name} declares that {mapping.up} points up, but the body stands along {up}, which is used"
        complaints.append(Complaint("axis", sentence))
    notes = [*motion.notes, *(complaint.sentence for complaint in complaints)]
    factor, sentence = mappings.rescaled(motion, mapping, walking.leg_length(positions))
    notes += [sentence] if sentence else []
    return replace(motion, notes=tuple(notes), complaints=tuple(complaints)), positions * factor, valid


def exchanged_back(motion: MotionCapture, points: Iterable[int]) -> MotionCapture:
    """Repair exchanged left and right labels, and add a remark on each repair.

    The labels that most frames have are assumed to be correct.

    Parameters
    ----------
    motion : MotionCapture
    points : iterable of int
        Indices of the points to check; points whose names differ only by the side are pairs.
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
        measured = np.flatnonzero(motion.valid[:, pair].all(axis=1))
        steps = np.diff(positions[measured][:, pair], axis=0)
        crossed_steps = positions[measured][1:, pair] - positions[measured][:-1, pair[::-1]]
        straight, crossed = (np.linalg.norm(step, axis=-1).sum(axis=-1) for step in (steps, crossed_steps))
        near = np.diff(measured) <= MAX_GAP_S * motion.frame_rate_hz
        changes = near & (straight > EXCHANGE_RATIO * crossed) & (straight > MIN_JUMP * size)
        if not changes.any():
            continue
        other = np.concatenate([[False], np.cumsum(changes) % 2 == 1])
        frames = measured[other if other.mean() <= 0.5 else ~other]
        remark = f"{motion.names[pair[0]]} and {motion.names[pair[1]]} have exchanged labels: "
        if len(frames) > MAX_EXCHANGED * len(measured):
            remark += (
                f"the labels change at frame {measured[1:][changes][0]}, and the correct ones are unknown."
            )
            notes.append(Remark(remark, EXCHANGED))
            continue
        positions[np.ix_(frames, pair)] = positions[np.ix_(frames, pair[::-1])]
        remark += f"{len(frames)} frames from {frames[0]} to {frames[-1]} were exchanged back."
        notes.append(Remark(remark, EXCHANGED))
    return replace(motion, positions_mm=positions, notes=tuple(notes))


def technical_clusters(motion: MotionCapture) -> list[list[int]]:
    """Return groups of points that move rigidly together, lie on the same side and have similar names.

    Examples are R.Thigh.Upper, R.Thigh.Front, R.Thigh.Rear, or LSK1, LSK2, LSK3.  No point of a group marks a joint.
    """
    alike: dict[str, list[int]] = {}
    plain = [plain_name(name) for name in motion.names]
    for k in np.flatnonzero(motion.valid.any(axis=0)):
        if plain[k][:1] in ("l", "r") and not _AT_A_JOINT.search(plain[k]):
            alike.setdefault(plain[k][:3], []).append(int(k))
    slack = SLACK / 2 * _size(motion.positions_mm) if alike else 0.0  # body height is about two leg lengths
    groups = [
        [points[n] for n in group]
        for points in alike.values()
        for group in rigid_clusters(motion.positions_mm[:, points], slack)
    ]
    # A name that begins all the others may be a joint: LeftLeg, LeftLegTwist1, …
    return [g for g in groups if not any(all(plain[j].startswith(plain[k]) for j in g) for k in g)]
