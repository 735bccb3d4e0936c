"""Reader of Acclaim skeletons (ASF): sections, bones, and bone positions from joint angles.

Conventions
-----------
- A point is the *distal* end of a bone and has the bone's name; ``root`` is the root itself.
- A bone rotates about the end of its parent by ``C L C⁻¹``: C from the ``axis`` line, L from the motion.  Both apply
  their rotations in the listed order about fixed axes (``XYZ``: first x, hence Rz·Ry·Rx).
- ``:units length 0.45`` means lengths in inches / 0.45, so one unit is 25.4 / 0.45 = 56.444 mm.
- Names of bones are not case-sensitive, as the format specifies.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.formats.contract import damaged, require_joints
from pipeline.formats.kinematics import turn
from pipeline.formats.text import millimetres_in, read_text, read_vector

TURNS = ("rx", "ry", "rz")
SHIFTS = ("tx", "ty", "tz")


@dataclass(frozen=True)
class AsfSkeleton:
    """Skeleton of an ASF file, with lengths in millimetres.

    Attributes
    ----------
    names : tuple of str
        P points: ``root``, then the bones in the file's order.
    parents : tuple of int
        Index of each point's parent; -1 for the root.
    order : tuple of int
        Indices of the points, parents before children.
    offsets_mm : (P, 3) float64
        Vector from the proximal to the distal end of each bone in the base pose; zero for the root.
    axes : (P, 3, 3) float64
        C of each bone: its rotation axes.
    freedoms : tuple of tuple of str
        Channels of each point in the order of the motion file: ``tx ty tz`` (root only), ``rx ry rz``.
    position_mm : (3,) float64
        Offset of the root, added to its position in every frame.
    units : str
        Unit of length: ``"in/0.45"`` for ``length 0.45``, or the unit that the caller gave.
    millimetres : float
        Millimetres in one unit of length.
    radians : float
        Radians in one unit of angle, as the skeleton declares it.
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
    def channels(self) -> list[tuple[str, str]]:
        """Bone and degree of freedom of each of the C channels, sorted by bone, e.g. ``("lfemur", "rx")``."""
        of_points = zip(self.names, self.freedoms, strict=True)
        return [(name, freedom) for name, freedoms in of_points for freedom in freedoms]


def read_skeleton(path: Path, *, units: str | None = None) -> AsfSkeleton:
    """Read the skeleton of an ASF file.

    Parameters
    ----------
    path : Path
    units : str, optional
        Unit of length to use in place of the file's own, e.g. ``"cm"`` or ``"in/0.45"``.

    Raises
    ------
    InvalidInput
        If the file is missing, incomplete or contradicts itself, a bone has a variable length, or the root has a
        preset orientation (programs interpret it differently).
    """
    where = path.name
    declared, root, bones, hierarchy = read_sections(path)
    if units is None:
        if "length" not in declared:
            raise damaged(
                "the unit of length is unknown",
                where,
                "`length` under :units, or the option units",
                code="unknown_unit",
                unit="",
            )
        units = "in/" + " ".join(declared["length"])
    millimetres = millimetres_in(units, where)
    angle = " ".join(declared.get("angle", [])).lower()
    if angle not in ("deg", "rad"):
        raise damaged(
            "the file does not state a known unit of angle",
            f"{where}, :units",
            "deg or rad",
            f"{angle!r:.40}",
            code="unknown_angle",
            unit=angle,
        )
    radians = np.pi / 180 if angle == "deg" else 1.0
    orientation = read_vector(root.get("orientation", ["0"] * 3), 3, f"{where}, :root, orientation")
    if np.any(orientation):
        message = "the root has a preset orientation, which is not supported"
        raise damaged(message, f"{where}, :root", "0 0 0", code="preset_orientation")
    position = read_vector(root.get("position", ["0"] * 3), 3, f"{where}, :root, position")
    names = ["root"]
    offsets, axes = [np.zeros(3)], [np.eye(3)]
    freedoms = [_freedoms(root.get("order", []), f"{where}, :root, order", root=True)]
    require_joints(len(bones), where)
    for bone in bones:
        name = " ".join(bone.get("name", []))
        if not name or " " in name or name.lower() in (n.lower() for n in names):
            raise damaged(
                "the name of a bone is missing or repeated",
                f"{where}, bone {len(names)} of :bonedata",
                "one word, different for each bone",
                f"{name!r:.40}",
                code="no_own_name",
                name=name,
            )
        location = f"{where}, bone {name}"
        direction = read_vector(bone.get("direction", []), 3, f"{location}, direction")
        length = float(read_vector(bone.get("length", []), 1, f"{location}, length")[0])
        norm = float(np.linalg.norm(direction))
        if length < 0 or (length > 0 and norm == 0):
            raise damaged(
                "the bone has a negative length, or a length but no direction",
                location,
                received=f"{length:g}",
                code="no_direction",
                length=length,
            )
        axis = bone.get("axis", ["0", "0", "0", "XYZ"])
        turn = read_vector(axis[:3], 3, f"{location}, axis") * radians
        offsets.append(direction * (length / norm if norm else 0.0) * millimetres)
        axes.append(_rotation(turn, axis[3:], f"{location}, axis"))
        freedoms.append(_freedoms(bone.get("dof", []), f"{location}, dof"))
        names.append(name)
    parents, order = _tree(hierarchy, names, where)
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


def forward_kinematics(skeleton: AsfSkeleton, values: np.ndarray) -> np.ndarray:
    """Return the positions of the root and of the distal ends of the bones, computed from joint angles.

    Parameters
    ----------
    skeleton : AsfSkeleton
    values : (T, C) float64
        Angles in radians and shifts in millimetres, in the order of `skeleton.channels`.

    Returns
    -------
    (T, P, 3) float64
        Millimetres, in the order of `skeleton.names`.
    """
    frames = len(values)
    positions = np.zeros((frames, len(skeleton.names), 3))
    rotations = np.empty((len(skeleton.names), frames, 3, 3))
    first = np.cumsum([0, *map(len, skeleton.freedoms)])
    for p in skeleton.order:
        axes, parent = skeleton.axes[p], skeleton.parents[p]
        inverse = np.repeat(axes[None], frames, axis=0)  # of L C⁻¹
        for column, freedom in enumerate(skeleton.freedoms[p], start=first[p]):
            if freedom in SHIFTS:
                positions[:, p, SHIFTS.index(freedom)] = values[:, column]
            else:
                turn(inverse, freedom[1], -values[:, column])
        local = np.swapaxes(inverse, 1, 2)
        if parent < 0:
            rotations[p] = axes @ local
            positions[:, p] += skeleton.position_mm
        else:
            still = not skeleton.freedoms[p]
            rotations[p] = rotations[parent] if still else (rotations[parent] @ axes) @ local
            positions[:, p] = positions[:, parent] + rotations[p] @ skeleton.offsets_mm[p]
    return positions


def _tree(
    hierarchy: list[list[str]], names: list[str], where: str
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the index of each point's parent, and the indices of all points sorted so that parents come first."""
    location = f"{where}, :hierarchy"
    index = {name.lower(): p for p, name in enumerate(names)}
    parents = [-1] * len(names)
    children: dict[int, list[int]] = {}
    for words in hierarchy:
        unknown = [word for word in words if word.lower() not in index]
        if unknown:
            raise damaged(
                "a bone of the hierarchy is not in :bonedata",
                location,
                received=f"{unknown[0]!r:.40}",
                code="unknown_joint",
                joint=unknown[0],
            )
        parent, *below = (index[word.lower()] for word in words)
        for child in below:
            if child == 0 or parents[child] >= 0:
                raise damaged(
                    "a bone has two parents, or the root has a parent",
                    location,
                    received=names[child],
                    code="two_parents",
                    joint=names[child],
                )
            parents[child] = parent
        children.setdefault(parent, []).extend(below)
    order = [0]
    for p in order:  # the list grows during the loop: breadth first
        order.extend(children.get(p, []))
    if len(order) != len(names):
        raise damaged(
            "a bone is not connected to the root",
            location,
            received=next(name for p, name in enumerate(names) if p not in order),
            code="no_path_to_root",
            joint=next(name for p, name in enumerate(names) if p not in order),
        )
    return tuple(parents), tuple(order)


def _freedoms(words: list[str], where: str, *, root: bool = False) -> tuple[str, ...]:
    """Return the degrees of freedom of a bone or the root in the order of the file, after validation."""
    freedoms = tuple(word.lower() for word in words)
    allowed = TURNS + SHIFTS if root else TURNS
    if len(set(freedoms) & set(allowed)) != len(freedoms):
        raise damaged(
            "the degrees of freedom cannot be used",
            where,
            f"each of {' '.join(allowed)} at most once" + ("" if root else ", at a constant length"),
            " ".join(words)[:60],
            code="wrong_channels",
            channels=" ".join(words),
        )
    return freedoms


def _rotation(angles_rad: np.ndarray, words: list[str], where: str) -> np.ndarray:
    """Return the rotation matrix (3, 3) of an ``axis`` line, which contains three angles and the order of the axes."""
    order = "".join(words).lower()
    if sorted(order) != ["x", "y", "z"]:
        raise damaged(
            "the order of axes is unknown",
            where,
            "e.g. XYZ",
            f"{order!r:.40}",
            code="unknown_axes",
            axes=order,
        )
    inverse = np.eye(3)[None]
    for letter in order:
        turn(inverse, letter, -angles_rad["xyz".index(letter), None])
    return inverse[0].T


_COMMENT = re.compile(r"#(?<!\S#)[^\n]*")  # not inside a word: `-1.#IND` is a broken number
_KEYS = ["name", "direction", "length", "axis", "dof", "order", "position", "orientation", "angle"]

_Words = dict[str, list[str]]
"""Lines of a section of an ASF file, split into words: the first word is the key, the others are the value."""


def read_sections(path: Path) -> tuple[_Words, _Words, list[_Words], list[list[str]]]:
    """Split an ASF file into words: the sections of units and root, each bone, and each line of the hierarchy.

    Raises
    ------
    InvalidInput
        If the file cannot be read, its ``begin`` and ``end`` do not match, or it has no bones or no hierarchy.
    """
    where, (text, _) = path.name, text_without_comments(path)
    plain: dict[str, _Words] = {":units": {}, ":root": {}}
    bones: list[_Words] = []
    hierarchy: list[list[str]] = []
    section, is_open = "", False
    # Commas and brackets count as blanks in this format.
    for number, line in enumerate(text.translate(str.maketrans(",()", "   ")).split("\n"), start=1):
        words = line.split()
        if not words:
            continue
        key, location = words[0].lower(), f"{where}, line {number}"
        if key.startswith(":"):
            if is_open:
                raise damaged("a `begin` line has no `end` line", location, received=key, code="unclosed")
            section = key
        elif section in (":bonedata", ":hierarchy") and key in ("begin", "end"):
            if is_open == (key == "begin"):
                raise damaged("`begin` and `end` do not alternate", location, code="unbalanced")
            is_open = key == "begin"
            if is_open and section == ":bonedata":
                bones.append({})
        elif section == ":hierarchy" and is_open:
            hierarchy.append(words)
        elif section == ":bonedata" or section in plain:
            if section == ":bonedata" and not is_open:
                raise damaged("a line is outside `begin` and `end`", location, code="outside_block")
            entries = bones[-1] if section == ":bonedata" else plain[section]
            if key in entries and key in _KEYS:
                raise damaged(f"`{key}` is given twice", f"{location}, {section}", code="key_twice", key=key)
            entries[key] = words[1:]
    if is_open:
        raise damaged("the file is truncated: a `begin` has no `end`", where, code="truncated")
    if not bones or not hierarchy:
        raise damaged(
            "the file has no bones or no hierarchy", where, ":bonedata and :hierarchy", code="no_joints"
        )
    return plain[":units"], plain[":root"], bones, hierarchy


def text_without_comments(path: Path) -> tuple[str, list[str]]:
    """Return the text of an ASF or AMC file without comments, and the notes of `read_text`."""
    text, notes = read_text(path)
    return _COMMENT.sub("", text), notes
