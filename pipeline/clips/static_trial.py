"""Static trials: markers of knees and ankles that somebody wore while standing, carried along by clusters in a walk.

Laboratories that track segments by technical clusters stick markers on knees and ankles for a standing trial alone.
Each of these markers is rigid with the segment above it: with the nearest cluster of its side whose middle is higher.
"""

from __future__ import annotations

import functools
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline import formats, mappings
from pipeline.core.rigid import fit_rigid_motion, rigid_clusters
from pipeline.mappings.proposal import PART_NAMES
from pipeline.skeleton import MotionCapture, SourceMapping, plain_name, up_axis
from pipeline.validation import InvalidInput

STILL_MM = 25.0
"""Root mean square motion of the median point, up to which somebody stands still."""

SLACK_MM = 10.0
"""Root mean square change of the distances of points that are taken to be rigid with one segment."""

REACH_MM = 400.0
"""Distance of a marker from the middle of the cluster that carries it: no longer than an adult's thigh."""

MOST_TRIED = 10
"""Other recordings of a person that are tried where none is named a static trial."""

_NAMED = re.compile(r"static|standing|calib|(?<![a-z])(stand|stat|cal|neutral|[tna][-_ ]?pose)(?![a-z])", re.IGNORECASE)
_SEGMENTS = ("thigh", "upleg", "upperleg", "shin", "shank", "lowerleg")
_JOINT_WORDS = {word for words in PART_NAMES.values() for word in words}.difference(_SEGMENTS)


def candidates(files: Mapping[Path, str]) -> dict[Path, tuple[Path, ...]]:
    """Return for each recording those that may be its static trial.

    Parameters
    ----------
    files : mapping of Path to str
        Recordings, and whom each shows.

    Returns
    -------
    dict
        Files of the same person that are named so, and those of the same folder that name nobody (``static.c3d``);
        without any, the first `MOST_TRIED` others of the person.
    """
    of_person: dict[str, list[Path]] = {}
    of_folder: dict[Path, list[Path]] = {}
    for path, who in files.items():
        of_person.setdefault(who, []).append(path)
        if _NAMED.match(who):
            of_folder.setdefault(path.parent, []).append(path)
    found = {}
    for path, who in files.items():
        others = [other for other in of_person[who] if other != path]
        named = [other for other in others if _NAMED.search(other.stem)]
        named += [other for other in of_folder.get(path.parent, []) if other not in (path, *named)]
        found[path] = tuple(named or others[:MOST_TRIED])
    return found


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
            added = carry(motion, read(path, units=units, frame_rate_hz=frame_rate_hz), path.name, known)
        except InvalidInput:  # another trial, which has a line of its own in every report
            continue
        if mappings.suggest(added, known).usable:
            return added
    return motion


def read(path: Path, *, units: str | None = None, frame_rate_hz: float | None = None) -> MotionCapture:
    """Return the posture of a static trial, one frame of the points that were seen.

    Raises
    ------
    InvalidInput
        If the file cannot be read or somebody moves in it.
    """
    try:
        stamp = path.stat().st_mtime_ns
    except OSError as error:
        raise InvalidInput("cannot be read", where=path.name, received=error.strerror or "") from None
    posture, moved = _posture(path, stamp, units, frame_rate_hz)
    if moved > STILL_MM:
        expected, received = f"points within {STILL_MM:g} mm", f"{moved:.0f} mm"
        raise InvalidInput("nobody stands still in the static trial", where=path.name, expected=expected, received=received)
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
    posture = replace(motion, names=names, positions_mm=place[None], valid=np.ones((1, len(seen)), dtype=bool))
    return posture, moves_mm(motion)


def moves_mm(motion: MotionCapture) -> float:
    """Return how far the median point moves about its median place, rms, mm; infinity if nothing was seen."""
    positions = motion.positions_mm[:, motion.valid.any(axis=0)]
    if not positions.size:
        return np.inf
    off = ((positions - np.nanmedian(positions, axis=0)) ** 2).sum(axis=-1)
    return float(np.median(np.sqrt(np.nanmean(off, axis=0))))


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
        lacking = ", ".join(fit.lacking[:4])
        raise InvalidInput("the static trial gives no legs and pelvis", where=name, received=f"no {lacking}")
    up = str(up_axis(posture, fit.mapping))
    place = posture.positions_mm[0]
    height = place[:, "xyz".index(up[-1])] * (-1.0 if up[0] == "-" else 1.0)
    seen = motion.valid.any(axis=0)
    there = {plain_name(point): k for k, point in enumerate(posture.names)}
    here = {plain_name(point): k for k, point in enumerate(motion.names) if seen[k]}
    names, positions, told = [], [], []
    for side, other in ("lr", "rl"):
        ours = [point for point in there if point[0] == side and other + point[1:] in there]
        shared = [point for point in ours if point in here]
        static, moving = [there[point] for point in shared], [here[point] for point in shared]
        groups = rigid_clusters(motion.positions_mm[:, moving], SLACK_MM, place[static])
        carried: dict[int, list[int]] = {}
        for k in (there[point] for point in ours if point not in here):
            away = [
                np.linalg.norm(place[members].mean(axis=0) - place[k])
                if height[members].mean() > height[k]
                else np.inf
                for members in (np.array(static)[group] for group in groups)
            ]
            if away and min(away) <= REACH_MM:
                carried.setdefault(int(np.argmin(away)), []).append(k)
        for g, points in carried.items():
            members = [moving[n] for n in groups[g]]
            found = fit_rigid_motion(place[[static[n] for n in groups[g]]], motion.positions_mm[:, members])
            residual = found.residual_mm[np.isfinite(found.residual_mm)]
            if len(residual):
                positions.append(found.carry(place[points]))
                names += [posture.names[k] for k in points]
                listed = (", ".join(of[k] for k in ks) for of, ks in ((posture.names, points), (motion.names, members)))
                told.append("{} by {} (residual {:.1f} mm)".format(*listed, np.sqrt(np.mean(residual**2))))
    if not names:
        expected = "three points of a thigh or shank that are in both trials"
        raise InvalidInput("no cluster of the walk carries a marker of the static trial", where=name, expected=expected)
    kept = [k for k, point in enumerate(motion.names) if seen[k] or point not in names]
    together = np.concatenate([motion.positions_mm[:, kept], *positions], axis=1)
    return replace(
        motion,
        names=(*(motion.names[k] for k in kept), *names),
        positions_mm=together,
        valid=np.isfinite(together).all(axis=-1),
        notes=(*motion.notes, f"Carried along from the static trial {name}: {'; '.join(told)}."),
    )


def technical_clusters(motion: MotionCapture) -> list[list[int]]:
    """Return groups of points that are stuck on a segment between joints: rigid, of one side, numbered or by place.

    Such are R.Thigh.Upper, R.Thigh.Front, R.Thigh.Rear, or LSK1, LSK2, LSK3; none marks a joint.
    """
    alike: dict[str, list[int]] = {}
    for k, name in enumerate(map(plain_name, motion.names)):
        if name[:1] in ("l", "r") and motion.valid[:, k].any():
            alike.setdefault(name[:3], []).append(k)
    found = []
    for points in alike.values():
        for group in rigid_clusters(motion.positions_mm[:, points], SLACK_MM):
            members = [points[n] for n in group]
            plain = [plain_name(motion.names[k]) for k in members]
            stem = os.path.commonprefix(plain)
            between = re.sub("|".join(_SEGMENTS), "", stem)  # an ankle stands in every shank
            if len(set(plain)) == len(plain) and stem not in plain and not any(w in between for w in _JOINT_WORDS):
                found.append(members)
    return found
