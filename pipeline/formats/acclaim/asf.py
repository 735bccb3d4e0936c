"""Acclaim skeletons (ASF): bones, and the positions of their ends from joint angles.

Conventions
-----------
- A point is the *distal* end of a bone and carries the bone's name; ``root`` is the root itself.
- A bone turns about its parent's end by ``C L C⁻¹``: C from the ``axis`` line, L from the motion.  Both apply
  their rotations in the order in which they are listed, about fixed axes (``XYZ``: first x, so Rz·Ry·Rx).
- ``:units length 0.45`` means lengths in inches / 0.45, so one unit is 25.4 / 0.45 = 56.444 mm.
- Names of bones are the same whatever their case, as the format says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.formats.acclaim.sections import read_sections
from pipeline.formats.text import LARGEST, millimetres_in, parse_numbers
from pipeline.validation import InvalidInput

TURNS = ("rx", "ry", "rz")
SHIFTS = ("tx", "ty", "tz")


@dataclass(frozen=True)
class AsfSkeleton:
    """Bones of an ASF file, in millimetres.

    Attributes
    ----------
    names : tuple of str
        P points: ``root``, then the bones in the file's order.
    parents : tuple of int
        Index of each point's parent; -1 for the root.
    order : tuple of int
        The points again, parents before children.
    offsets_mm : (P, 3) float64
        From the proximal to the distal end of each bone in the base pose; zero for the root.
    axes : (P, 3, 3) float64
        C of each bone: the frame in which its angles are counted.
    freedoms : tuple of tuple of str
        What the motion gives for each point, in its order: ``tx ty tz`` (root only), ``rx ry rz``.
    position_mm : (3,) float64
        Added to every position of the root.
    units : str
        ``"in/0.45"`` for ``length 0.45``, or what the caller gave.
    millimetres : float
        In one unit of length.
    radians : float
        In one unit of angle, as the skeleton declares it.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    order: tuple[int, ...]
    offsets_mm: np.ndarray
    axes: np.ndarray
    freedoms: tuple[tuple[str, ...], ...]
    position_mm: np.ndarray
    units: str
    millimetres: float
    radians: float

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the C angles, point by point, e.g. ``"lfemur.rx"``."""
        return tuple(
            f"{name}.{freedom}"
            for name, freedoms in zip(self.names, self.freedoms, strict=True)
            for freedom in freedoms
            if freedom in TURNS
        )


def read_skeleton(path: str | Path, *, units: str | None = None) -> AsfSkeleton:
    """Bones of an ASF file, in millimetres.

    Parameters
    ----------
    path : str or Path
    units : str, optional
        Unit of length to use in place of the file's own, e.g. ``"cm"`` or ``"in/0.45"``.

    Raises
    ------
    InvalidInput
        If the file is missing, incomplete or contradicts itself, has a bone that changes its length or its
        place, or turns the root before the motion does (a preset that programs read differently).
    """
    path = Path(path)
    where = path.name
    sections = read_sections(path)
    if units is None:
        units = _declared_unit(sections.units.get("length"), where)
    millimetres = millimetres_in(units, where)
    angle = " ".join(sections.units.get("angle", [])).lower()
    if angle not in ("deg", "rad"):
        raise InvalidInput("the unit of angle is unknown", where=where, expected="deg or rad", received=angle)
    radians = np.pi / 180 if angle == "deg" else 1.0

    root = sections.root
    orientation = _floats(root.get("orientation", ["0"] * 3), 3, f"{where}, :root, orientation")
    if np.any(orientation):
        raise InvalidInput("the root has a preset orientation", where=f"{where}, :root", expected="0 0 0")
    position = _floats(root.get("position", ["0"] * 3), 3, f"{where}, :root, position")
    names = ["root"]
    offsets, axes = [np.zeros(3)], [np.eye(3)]
    freedoms = [_freedoms(root.get("order", []), f"{where}, :root, order", root=True)]
    for bone in sections.bones:
        name = " ".join(bone.get("name", []))
        if not name or " " in name or name.lower() in (n.lower() for n in names):
            raise InvalidInput(
                "a bone has no name of its own",
                where=f"{where}, bone {len(names)} of :bonedata",
                expected="one word that no other bone has",
                received=name or "nothing",
            )
        place = f"{where}, bone {name}"
        direction = _floats(bone.get("direction", []), 3, f"{place}, direction")
        length = float(_floats(bone.get("length", []), 1, f"{place}, length")[0])
        norm = float(np.linalg.norm(direction))
        if length < 0 or (length > 0 and norm == 0):
            raise InvalidInput(
                "the bone has no direction or a negative length", where=place, received=f"{length:g}"
            )
        axis = bone.get("axis", ["0", "0", "0", "XYZ"])
        turn = _floats(axis[:3], 3, f"{place}, axis") * radians
        offsets.append(direction * (length / norm if norm else 0.0) * millimetres)
        axes.append(_rotation(turn, axis[3:], f"{place}, axis"))
        freedoms.append(_freedoms(bone.get("dof", []), f"{place}, dof"))
        names.append(name)
    parents, order = _tree(sections.hierarchy, names, where)
    return AsfSkeleton(
        names=tuple(names),
        parents=parents,
        order=order,
        offsets_mm=np.array(offsets),
        axes=np.array(axes),
        freedoms=tuple(freedoms),
        position_mm=position * millimetres,
        units=units,
        millimetres=millimetres,
        radians=radians,
    )


def forward_kinematics(
    skeleton: AsfSkeleton, angles_rad: np.ndarray, root_position_mm: np.ndarray
) -> np.ndarray:
    """Positions of the root and of the distal ends of the bones.

    Parameters
    ----------
    skeleton : AsfSkeleton
    angles_rad : (T, C) float64
        In the order of `skeleton.channels`.
    root_position_mm : (T, 3) float64

    Returns
    -------
    (T, P, 3) float64
        Millimetres, in the order of `skeleton.names`.
    """
    frames = len(angles_rad)
    cosines, sines = np.cos(angles_rad), np.sin(angles_rad)
    widths = [sum(freedom in TURNS for freedom in freedoms) for freedoms in skeleton.freedoms]
    first = np.concatenate([[0], np.cumsum(widths)])
    positions = np.empty((frames, len(skeleton.names), 3))
    rotations = np.empty((len(skeleton.names), frames, 3, 3))
    for p in skeleton.order:
        local = np.repeat(skeleton.axes[p].T[None], frames, axis=0)
        turns = [freedom for freedom in skeleton.freedoms[p] if freedom in TURNS]
        for c, turn in enumerate(turns, start=first[p]):
            # A rotation from the left about x mixes rows y and z, and so on in a cycle.
            i, j = ((1, 2), (2, 0), (0, 1))[TURNS.index(turn)]
            cosine, sine = cosines[:, c, None], sines[:, c, None]
            row_i, row_j = local[:, i].copy(), local[:, j].copy()
            local[:, i] = cosine * row_i - sine * row_j
            local[:, j] = sine * row_i + cosine * row_j
        parent = skeleton.parents[p]
        if parent < 0:
            rotations[p] = skeleton.axes[p] @ local
            positions[:, p] = root_position_mm + skeleton.position_mm
        else:
            rotations[p] = (rotations[parent] @ skeleton.axes[p]) @ local if turns else rotations[parent]
            positions[:, p] = positions[:, parent] + rotations[p] @ skeleton.offsets_mm[p]
    return positions


def _tree(
    hierarchy: list[list[str]], names: list[str], where: str
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Parent of each point, and the points with parents before children."""
    place = f"{where}, :hierarchy"
    index = {name.lower(): p for p, name in enumerate(names)}
    parents = [-1] * len(names)
    children: dict[int, list[int]] = {}
    for words in hierarchy:
        unknown = [word for word in words if word.lower() not in index]
        if unknown:
            raise InvalidInput("a bone is not in :bonedata", where=place, received=unknown[0])
        parent, *below = (index[word.lower()] for word in words)
        for child in below:
            if child == 0 or parents[child] >= 0:
                raise InvalidInput(
                    "a bone has two parents, or the root has one", where=place, received=names[child]
                )
            parents[child] = parent
        children.setdefault(parent, []).extend(below)
    order = [0]
    for p in order:  # grows while it is walked: breadth first
        order.extend(children.get(p, []))
    if len(order) != len(names):
        lost = next(name for p, name in enumerate(names) if p not in order)
        raise InvalidInput("a bone does not hang on the root", where=place, received=lost)
    return tuple(parents), tuple(order)


def _freedoms(words: list[str], where: str, *, root: bool = False) -> tuple[str, ...]:
    """Degrees of freedom in the order of the file, checked."""
    freedoms = tuple(word.lower() for word in words)
    allowed = TURNS + SHIFTS if root else TURNS
    for freedom in freedoms:
        if freedom not in allowed or freedoms.count(freedom) > 1:
            raise InvalidInput(
                "a degree of freedom cannot be used",
                where=where,
                expected=f"each of {' '.join(allowed)} at most once"
                + ("" if root else " (a bone keeps its length and its place on its parent)"),
                received=" ".join(words),
            )
    return freedoms


def _rotation(angles_rad: np.ndarray, words: list[str], where: str) -> np.ndarray:
    """The (3, 3) rotation of an ``axis`` line: three angles for x, y, z and the order in which they apply."""
    order = "".join(words).lower()
    if sorted(order) != ["x", "y", "z"]:
        raise InvalidInput("the order of axes is unknown", where=where, expected="e.g. XYZ", received=order)
    rotation = np.eye(3)
    for letter in order:
        axis = "xyz".index(letter)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[[i, j], [i, j]] = np.cos(angles_rad[axis])
        turn[j, i] = np.sin(angles_rad[axis])
        turn[i, j] = -turn[j, i]
        rotation = turn @ rotation
    return rotation


def _declared_unit(words: list[str] | None, where: str) -> str:
    """Name of the unit of length that the :units section declares."""
    if words is None:
        raise InvalidInput(
            "the unit of length is unknown", where=where, expected="`length` under :units, or `units`"
        )
    return f"in/{' '.join(words)}"


def _floats(words: Sequence[str], count: int, where: str) -> np.ndarray:
    """(count,) finite numbers of a line of the skeleton."""
    try:
        numbers = np.array(parse_numbers(words))
    except ValueError:
        numbers = np.full(1, np.nan)
    if len(numbers) != count or not np.all(np.abs(numbers) <= LARGEST):
        raise InvalidInput(
            "the line cannot be used",
            where=where,
            expected=f"{count} numbers" if count > 1 else "one number",
            received=" ".join(words)[:60] or "nothing",
        )
    return numbers
