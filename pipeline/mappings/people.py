"""Several people in one recording, told apart by where their points' names begin or end: ``anna:LANK``, ``LANK_2``."""

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
"""The person whose points' names have no beginning or end of their own, beside others whose have."""

_FEWEST = 7
"""Points of somebody whose legs and pelvis are known."""

ONE_PLACE_MM = 50.0
"""Points of one name that are nearer in the median are one person's, raw and filtered perhaps."""

ONE_BODY_MM = 150.0
"""Joints from two sets of names that are nearer in the median are one person's: two bodies are farther apart."""

_SIDES = {"l", "r", "left", "right", "lt", "rt"}
_PERSON = (
    r"(.*):",
    *(rf"((?:[^\W_]+[\W_]+){{{more}}}[^\W_]+)[\W_]+(?=[^\W_])" for more in (0, 1)),
    r".*?\D(\d+)\W*$|.*?[^\n][\W_]+([^\W_]+)[\W_]*$",
)
"""Where in a name the person may be, the most certain first: in front of a colon, the first word, the first two, the
number that ends it or its last word."""


def people(motion: MotionCapture, mappings: Iterable[SourceMapping]) -> dict[str, MotionCapture]:
    """Return the people in a recording by name, each with the points of one; empty if it holds one person.

    Parameters
    ----------
    motion : MotionCapture
    mappings : iterable of SourceMapping
        A person is a group of points to which one of these gives legs and pelvis.

    Notes
    -----
    People are told apart by what stands before a colon, else by the first one or two words of their points' names, the
    last word or number, else by names that stand in the file once for each of them, who are called ``1``, ``2``….
    """
    mappings = list(mappings)
    for groups in _groupings(motion.names):
        usable = {
            name: one
            for name, points in groups.items()
            if len(points) >= _FEWEST and suggest(one := _only(motion, points, name), mappings).usable
        }
        taken = {k for name in usable for k in groups[name]}
        rest = [k for k in range(len(motion.names)) if k not in taken]
        if usable and len(rest) >= _FEWEST:
            others = _only(motion, rest, "")
            if suggest(others, mappings).usable:
                usable[OTHERS] = others
        if len(usable) > 1 and not any(
            _in_one_place(*pair, mappings) for pair in itertools.combinations(usable.values(), 2)
        ):
            return usable
    return {}


def of_one_person(
    motion: MotionCapture, mappings: Iterable[SourceMapping], subject: str = ""
) -> MotionCapture:
    """Return the points of one person.

    Parameters
    ----------
    motion : MotionCapture
    mappings : iterable of SourceMapping
    subject : str
        Name of the person, or the number in the order of the file, from 1; for files of several people.

    Raises
    ------
    InvalidInput
        If the recording holds several people and none of them is chosen.
    """
    found = people(motion, mappings)
    if not found:
        if not subject:
            return motion
        return replace(
            motion, notes=(*motion.notes, f"The file holds one person; {subject!r} is not needed.")
        )
    by_name = {name.lower(): name for name in found}
    numbered = {str(k): name for k, name in enumerate(found, start=1)}
    chosen = by_name.get(subject.lower()) or numbered.get(subject)
    if chosen is None:
        listed = list(found)
        raise InvalidInput(
            f"the file holds {len(found)} people: choose one by subject= (in runs data.subject=)",
            expected=" or ".join(listed[:10]),
            received=subject or "none",
            typed=True,
            code="several_people",
            people=list(listed),
            subject=subject,
        )
    note = f"The file holds {len(found)} people; this is {chosen}."
    return replace(found[chosen], notes=(*motion.notes, note))


def _in_one_place(one: MotionCapture, other: MotionCapture, mappings: Sequence[SourceMapping]) -> bool:
    """Whether points of the same names, or without any the joints, lie in the same places."""
    both = (one, other)
    shared = [name for name in one.names if name in other.names]
    places = [who.positions_mm[:, [who.names.index(name) for name in shared]] for who in both]
    nearest = ONE_PLACE_MM
    if not shared:  # keypoints and markers of one person, as OpenCap writes them
        places = [map_joints(who, suggest(who, mappings).mapping)[0] for who in both]
        nearest = ONE_BODY_MM
    apart = np.linalg.norm(places[0] - places[1], axis=-1)
    apart = apart[np.isfinite(apart)]
    return bool(apart.size) and np.median(apart) < nearest


def _only(motion: MotionCapture, points: Sequence[int], who: str) -> MotionCapture:
    """The recording with some of its points, their names without the person's that they begin or end with."""
    k = list(points)
    of_person = re.compile(rf"{re.escape(who)}[\W_]+|[\W_]*{re.escape(who)}[\W_]*$" if who else "(?!)")
    names = (motion.names[i] for i in k)
    return replace(
        motion,
        names=tuple(
            name[match.end() :] if (match := of_person.match(name)) else of_person.sub("", name, count=1)
            for name in names
        ),
        positions_mm=motion.positions_mm[:, k],
        valid=motion.valid[:, k],
    )


def _groupings(names: Sequence[str]) -> Iterator[dict[str, list[int]]]:
    """Ways to divide points into people, the most certain first."""
    for pattern in _PERSON:
        groups: dict[str, list[int]] = {}
        for k, name in enumerate(names):
            match = re.match(pattern, name, re.DOTALL)
            if match and (who := "".join(match.groups(""))) and who.lower() not in _SIDES:
                groups.setdefault(who, []).append(k)
        yield groups
    count = names.count(names[0]) if names else 0
    if count > 1 and all(names.count(name) == count for name in set(names)):
        seen: Counter[str] = Counter()
        groups = {}
        for k, name in enumerate(names):
            seen[name] += 1
            groups.setdefault(str(seen[name]), []).append(k)
        yield groups
