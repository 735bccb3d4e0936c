"""Separation of people in a recording by a prefix or suffix of point names, such as ``anna:LANK``."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from pipeline.mappings.fitting import suggest
from pipeline.skeleton.mapped_joints import map_joints
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping
from pipeline.validation import InvalidInput

OTHERS = "unnamed"
"""Name of the person whose points have no prefix or suffix, in a recording of several people."""

_MIN_POINTS = 7
"""Smallest number of points from which the legs and the pelvis of a person can be computed."""

SAME_POINT_MM = 50.0
"""Median distance, mm, below which points with the same name are of one person, e.g. raw and filtered."""

SAME_BODY_MM = 150.0
"""Median distance, mm, below which joints from two sets of points are of one person."""

_SIDES = {"l", "r", "left", "right", "lt", "rt"}
_PERSON = (
    r"(.*):",
    *(rf"((?:[^\W_]+[\W_]+){{{more}}}[^\W_]+)[\W_]+(?=[^\W_])" for more in (0, 1)),
    r".*?\D(\d+)\W*$|.*?[^\n][\W_]+([^\W_]+)[\W_]*$",
)
"""Patterns that find the name of a person in a point name, in order of reliability.

They are: before a colon, the first word, the first two words, the number at the end, the last word."""


def people(motion: MotionCapture, mappings: Iterable[SourceMapping]) -> dict[str, MotionCapture]:
    """Split a recording by point names into one recording for each person; empty for a single person.

    Parameters
    ----------
    motion : MotionCapture
    mappings : iterable of SourceMapping
        Candidate mappings; a group of points is a person if one of them gives its legs and pelvis.

    Notes
    -----
    The person in a point name is the text before a colon, else the first one or two words, else the last word or
    number.  If the file repeats all names once per person, the people are called ``1``, ``2``….
    """
    mappings = list(mappings)
    for groups in _groupings(motion.names):
        usable = {
            name: person
            for name, points in groups.items()
            if len(points) >= _MIN_POINTS and suggest(person := _only(motion, points, name), mappings).usable
        }
        assigned = {k for name in usable for k in groups[name]}
        rest = [k for k in range(len(motion.names)) if k not in assigned]
        if usable and len(rest) >= _MIN_POINTS:
            others = _only(motion, rest, "")
            if suggest(others, mappings).usable:
                usable[OTHERS] = others
        if len(usable) > 1 and not any(
            _same_person(*pair, mappings) for pair in itertools.combinations(usable.values(), 2)
        ):
            return usable
    return {}


def of_one_person(
    motion: MotionCapture, mappings: Iterable[SourceMapping], subject: str = ""
) -> MotionCapture:
    """Return the recording of one person from a recording of several people.

    Parameters
    ----------
    motion : MotionCapture
    mappings : iterable of SourceMapping
    subject : str
        Name of the person, or the number in the order of the file from 1; for files with several people.

    Raises
    ------
    InvalidInput
        If the recording has several people and `subject` does not select one of them.
    """
    by_person = people(motion, mappings)
    if not by_person:
        if not subject:
            return motion
        return replace(
            motion, notes=(*motion.notes, f"The file has one person; the option {subject!r} is not needed.")
        )
    by_name = {name.lower(): name for name in by_person}
    numbered = {str(k): name for k, name in enumerate(by_person, start=1)}
    selected = by_name.get(subject.lower()) or numbered.get(subject)
    if selected is None:
        names = list(by_person)
        raise InvalidInput(
            f"the file has {len(by_person)} people: select one with subject= (in runs data.subject=)",
            expected=" or ".join(names[:10]),
            received=subject or "none",
            typed=True,
            code="several_people",
            people=list(names),
            subject=subject,
        )
    note = f"The file has {len(by_person)} people; this is {selected}."
    return replace(by_person[selected], notes=(*motion.notes, note))


def _same_person(first: MotionCapture, second: MotionCapture, mappings: Sequence[SourceMapping]) -> bool:
    """Return True if the points that have the same names in two recordings coincide.

    Without shared names, the joints are compared instead.
    """
    both = (first, second)
    shared = [name for name in first.names if name in second.names]
    positions = [motion.positions_mm[:, [motion.names.index(name) for name in shared]] for motion in both]
    tolerance = SAME_POINT_MM
    if not shared:  # keypoints and markers of one person, as OpenCap writes them
        positions = [map_joints(motion, suggest(motion, mappings).mapping)[0] for motion in both]
        tolerance = SAME_BODY_MM
    distance = np.linalg.norm(positions[0] - positions[1], axis=-1)
    distance = distance[np.isfinite(distance)]
    return bool(distance.size) and np.median(distance) < tolerance


def _only(motion: MotionCapture, points: Sequence[int], person: str) -> MotionCapture:
    """Select some points of a recording, and remove the name of the person from their names."""
    k = list(points)
    affix = re.compile(rf"{re.escape(person)}[\W_]+|[\W_]*{re.escape(person)}[\W_]*$" if person else "(?!)")
    names = (motion.names[i] for i in k)
    return replace(
        motion,
        names=tuple(
            name[match.end() :] if (match := affix.match(name)) else affix.sub("", name, count=1)
            for name in names
        ),
        positions_mm=motion.positions_mm[:, k],
        valid=motion.valid[:, k],
    )


def _groupings(names: Sequence[str]) -> Iterator[dict[str, list[int]]]:
    """Yield possible divisions of the points into people, in order of reliability."""
    for pattern in _PERSON:
        groups: dict[str, list[int]] = {}
        for k, name in enumerate(names):
            match = re.match(pattern, name, re.DOTALL)
            if match and (person := "".join(match.groups(""))) and person.lower() not in _SIDES:
                groups.setdefault(person, []).append(k)
        yield groups
    count = names.count(names[0]) if names else 0
    if count > 1 and all(names.count(name) == count for name in set(names)):
        occurrences: Counter[str] = Counter()
        groups = {}
        for k, name in enumerate(names):
            occurrences[name] += 1
            groups.setdefault(str(occurrences[name]), []).append(k)
        yield groups
