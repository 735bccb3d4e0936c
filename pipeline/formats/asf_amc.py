"""Acclaim skeletons (ASF) and motions (AMC): joint angles in, positions of bone ends out.

Conventions
-----------
- A point is the *distal* end of a bone and carries the bone's name; ``root`` is the root itself.
- A bone turns about its parent's end by ``C L C⁻¹``: C from the ``axis`` line, L from the motion.  Both apply
  their rotations in the order in which they are listed, about fixed axes (``XYZ``: first x, so Rz·Ry·Rx).
- ``:units length 0.45`` means lengths in inches / 0.45, so one unit is 25.4 / 0.45 = 56.444 mm.  The root's
  translation is in the same unit.
- Names of bones are the same whatever their case, as the format says.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.refusal import Refusal
from pipeline.skeleton import MILLIMETRES, MotionCapture

_LARGEST = 1e9
"""No length or angle of a recording is larger; a damaged file's may be, and would overflow later."""

_FRAME_NUMBER = re.compile(r"^[ \t]*(\d{1,9})[ \t]*$", re.MULTILINE)
_COMMENT = re.compile(r"#(?<!\S#)[^\n]*")  # not inside a word: `-1.#IND` is a broken number, not a comment
_KEYS = ["name", "direction", "length", "axis", "dof", "order", "position", "orientation", "angle"]
_TURNS = ("rx", "ry", "rz")
_SHIFTS = ("tx", "ty", "tz")


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
            if freedom in _TURNS
        )


def read(
    path: str | Path,
    *,
    skeleton_path: str | Path | None = None,
    frame_rate_hz: float = 120.0,
    units: str | None = None,
) -> MotionCapture:
    """Positions of the bone ends in an AMC file, in the file's axes.

    Parameters
    ----------
    path : str or Path
        The motion (.amc).
    skeleton_path : str or Path, optional
        The skeleton (.asf).  By default the one beside the motion: the only one, or the one whose name is
        the longest beginning of the motion's name (``16.asf`` for ``16_11.amc``).
    frame_rate_hz : float
        The format does not state it.
    units : str, optional
        Unit of length to use in place of the skeleton's own, e.g. ``"cm"`` or ``"in/0.45"``.

    Returns
    -------
    MotionCapture
        Points ``root`` and the bones as the skeleton lists them; `channels` in the order in which the motion
        lists them, angles as written (converted to degrees if in radians), root translation left out
        because it is the position of ``root``.  A NaN in the file makes the points that depend on it
        invalid, and is noted.

    Raises
    ------
    Refusal
        If either file is missing, cut short or contradicts itself or the other.
    """
    path = Path(path)
    if not (np.isfinite(frame_rate_hz) and frame_rate_hz > 0):
        raise Refusal(
            "the frame rate is not positive", where=path.name, expected="hertz", received=str(frame_rate_hz)
        )
    skeleton = read_skeleton(skeleton_path or _skeleton_beside(path), units=units)
    text = _text(path)
    first = _FRAME_NUMBER.search(text)
    if first is None:
        raise Refusal("no frame found", where=path.name, expected="an AMC motion with numbered frames")
    radians, notes = _header(text[: first.start()], skeleton.radians, path.name)
    body = text[first.start() :]
    layout = _layout(body, skeleton, path.name)
    found = _columns_at_fixed_places(body, layout) or _columns_by_line(body, layout, path.name)
    numbers, columns = found
    start = _check_numbering(numbers, path.name)
    values = _values(columns, layout, start, path.name)
    if start != 1:
        notes.append(f"Frames are numbered from {start}.")
    if not text.endswith("\n"):
        notes.append("The file does not end with a line break; its last number may have been cut short.")

    # The motion lists its bones in any order: its columns are put in the skeleton's order for the kinematics.
    written = [f"{name}.{freedom}" for name, freedoms in layout for freedom in freedoms]
    at = {channel: c for c, channel in enumerate(written)}
    angles = values[:, [at[channel] for channel in skeleton.channels]] * radians
    root_mm = np.zeros((len(values), 3))
    for axis, shift in enumerate(_SHIFTS):
        if f"root.{shift}" in at:
            root_mm[:, axis] = values[:, at[f"root.{shift}"]] * skeleton.millimetres
    positions = forward_kinematics(skeleton, angles, root_mm)
    valid = np.isfinite(positions).all(axis=-1)
    if not valid.all():
        gaps = int((~valid).any(axis=1).sum())
        notes.append(f"{gaps} of {len(values)} frames have NaN; the points that depend on them are invalid.")
    positions[~valid] = np.nan
    turns = [c for c, channel in enumerate(written) if channel[-2:] in _TURNS]
    return MotionCapture(
        names=skeleton.names,
        positions_mm=positions,
        valid=valid,
        frame_rate_hz=float(frame_rate_hz),
        units=skeleton.units,
        channels=tuple(written[c] for c in turns),
        angles_deg=values[:, turns] * (1.0 if radians == np.pi / 180 else np.degrees(radians)),
        notes=tuple(notes),
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
    widths = [sum(freedom in _TURNS for freedom in freedoms) for freedoms in skeleton.freedoms]
    first = np.concatenate([[0], np.cumsum(widths)])
    positions = np.empty((frames, len(skeleton.names), 3))
    rotations = np.empty((len(skeleton.names), frames, 3, 3))
    for p in skeleton.order:
        local = np.repeat(skeleton.axes[p].T[None], frames, axis=0)
        turns = [freedom for freedom in skeleton.freedoms[p] if freedom in _TURNS]
        for c, turn in enumerate(turns, start=first[p]):
            # A rotation from the left about x mixes rows y and z, and so on in a cycle.
            i, j = ((1, 2), (2, 0), (0, 1))[_TURNS.index(turn)]
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


def read_skeleton(path: str | Path, *, units: str | None = None) -> AsfSkeleton:
    """Bones of an ASF file, in millimetres.

    Parameters
    ----------
    path : str or Path
    units : str, optional
        Unit of length to use in place of the file's own, e.g. ``"cm"`` or ``"in/0.45"``.

    Raises
    ------
    Refusal
        If the file is missing, incomplete or contradicts itself, has a bone that changes its length or its
        place, or turns the root before the motion does (a preset that programs read differently).
    """
    path = Path(path)
    where = path.name
    sections = _sections(_text(path), where)
    units, millimetres = _unit_of_length(sections.units.get("length"), units, where)
    angle = " ".join(sections.units.get("angle", [])).lower()
    if angle not in ("deg", "rad"):
        raise Refusal("the unit of angle is unknown", where=where, expected="deg or rad", received=angle)
    radians = np.pi / 180 if angle == "deg" else 1.0

    root = sections.root
    orientation = _floats(root.get("orientation", ["0"] * 3), 3, f"{where}, :root, orientation")
    if np.any(orientation):
        raise Refusal("the root has a preset orientation", where=f"{where}, :root", expected="0 0 0")
    position = _floats(root.get("position", ["0"] * 3), 3, f"{where}, :root, position")
    names = ["root"]
    offsets, axes = [np.zeros(3)], [np.eye(3)]
    freedoms = [_freedoms(root.get("order", []), f"{where}, :root, order", root=True)]
    for bone in sections.bones:
        name = " ".join(bone.get("name", []))
        if not name or " " in name or name.lower() in (n.lower() for n in names):
            raise Refusal(
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
            raise Refusal(
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


@dataclass(frozen=True)
class _Sections:
    """The words of an ASF file by section; a line's first word is its key."""

    units: dict[str, list[str]]
    root: dict[str, list[str]]
    bones: list[dict[str, list[str]]]
    hierarchy: list[list[str]]


def _sections(text: str, where: str) -> _Sections:
    """The words of an ASF file by section."""
    found = _Sections({}, {}, [], [])
    section, is_open = "", False
    # Commas and brackets count as blanks in this format.
    for number, line in enumerate(text.translate(str.maketrans(",()", "   ")).split("\n"), start=1):
        words = line.split()
        if not words:
            continue
        key = words[0].lower()
        if key.startswith(":"):
            if is_open:
                raise Refusal("a `begin` has no `end`", where=f"{where}, line {number}", received=key)
            section = key
        elif section in (":bonedata", ":hierarchy") and key in ("begin", "end"):
            if is_open == (key == "begin"):
                raise Refusal("`begin` and `end` do not alternate", where=f"{where}, line {number}")
            is_open = key == "begin"
            if is_open and section == ":bonedata":
                found.bones.append({})
        elif section == ":hierarchy" and is_open:
            found.hierarchy.append(words)
        elif section in (":units", ":root", ":bonedata"):
            if section == ":bonedata" and not is_open:
                raise Refusal("a line stands outside `begin` and `end`", where=f"{where}, line {number}")
            entries = found.bones[-1] if section == ":bonedata" else getattr(found, section[1:])
            if key in entries and key in _KEYS:
                raise Refusal(f"`{key}` stands twice", where=f"{where}, line {number}, {section}")
            entries[key] = words[1:]
    if is_open:
        raise Refusal("the file is cut short: a `begin` has no `end`", where=where)
    if not found.bones or not found.hierarchy:
        raise Refusal("no bones or no hierarchy", where=where, expected=":bonedata and :hierarchy")
    return found


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
            raise Refusal("a bone is not in :bonedata", where=place, received=unknown[0])
        parent, *below = (index[word.lower()] for word in words)
        for child in below:
            if child == 0 or parents[child] >= 0:
                raise Refusal(
                    "a bone has two parents, or the root has one", where=place, received=names[child]
                )
            parents[child] = parent
        children.setdefault(parent, []).extend(below)
    order = [0]
    for p in order:  # grows while it is walked: breadth first
        order.extend(children.get(p, []))
    if len(order) != len(names):
        lost = next(name for p, name in enumerate(names) if p not in order)
        raise Refusal("a bone does not hang on the root", where=place, received=lost)
    return tuple(parents), tuple(order)


def _freedoms(words: list[str], where: str, *, root: bool = False) -> tuple[str, ...]:
    """Degrees of freedom in the order of the file, checked."""
    freedoms = tuple(word.lower() for word in words)
    allowed = _TURNS + _SHIFTS if root else _TURNS
    for freedom in freedoms:
        if freedom not in allowed or freedoms.count(freedom) > 1:
            raise Refusal(
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
        raise Refusal("the order of axes is unknown", where=where, expected="e.g. XYZ", received=order)
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


def _unit_of_length(declared: list[str] | None, given: str | None, where: str) -> tuple[str, float]:
    """Name of the unit of length, and its millimetres."""
    if given is None:
        if declared is None:
            raise Refusal(
                "the unit of length is unknown", where=where, expected="`length` under :units, or `units`"
            )
        given = f"in/{' '.join(declared)}"
    name, slash, divisor = given.partition("/")
    divided_by = float(divisor) if _is_number(divisor) else 0.0 if slash else 1.0
    millimetres = MILLIMETRES[name] / divided_by if name in MILLIMETRES and divided_by > 0 else np.nan
    if not 1e-6 < millimetres < 1e6:
        raise Refusal(
            "the unit of length is unknown",
            where=where,
            expected="one of " + ", ".join(MILLIMETRES) + ", or e.g. in/0.45",
            received=given,
        )
    return given, millimetres


def _skeleton_beside(path: Path) -> Path:
    """The skeleton in the motion's folder that belongs to it."""
    try:
        found = sorted(p for p in path.parent.iterdir() if p.suffix.lower() == ".asf")
    except OSError as error:
        raise Refusal("the folder cannot be read", where=str(path.parent), received=str(error)) from None
    if len(found) > 1:
        begins = [p for p in found if path.stem.lower().startswith(p.stem.lower())]
        longest = max((len(p.stem) for p in begins), default=0)
        found = [p for p in begins if len(p.stem) == longest] or found
    if len(found) != 1:
        raise Refusal(
            "the skeleton of this motion is not clear",
            where=path.name,
            expected="one .asf beside it, or `skeleton_path`",
            received=", ".join(p.name for p in found) or "none",
        )
    return found[0]


def _header(header: str, radians: float, where: str) -> tuple[float, list[str]]:
    """Radians in one unit of angle of the motion, and notes on lines that are not used."""
    notes = []
    for line in filter(None, map(str.strip, header.split("\n"))):
        if not line.startswith(":"):
            raise Refusal(
                "the header has a line that is no keyword",
                where=where,
                expected=":FULLY-SPECIFIED, :DEGREES, then the frame's number",
                received=repr(line[:40]),
            )
        keyword = line.upper()
        if keyword in (":DEGREES", ":RADIANS"):
            radians = np.pi / 180 if keyword == ":DEGREES" else 1.0
        elif keyword != ":FULLY-SPECIFIED":
            notes.append(f"The header line {line!r} is not used.")
    return radians, notes


_Layout = list[tuple[str, tuple[str, ...]]]


def _layout(body: str, skeleton: AsfSkeleton, where: str) -> _Layout:
    """Bones (as the skeleton spells them) and their degrees of freedom, in the order of the first frame."""
    start = _FRAME_NUMBER.match(body)
    assert start is not None  # `body` begins with the line that this expression found
    end = _FRAME_NUMBER.search(body, start.end())
    place = f"{where}, frame {start[1]}"
    known = {name.lower(): p for p, name in enumerate(skeleton.names)}
    layout: _Layout = []
    for line in body[start.end() : end.start() if end else len(body)].split("\n"):
        if words := line.split():
            p = known.get(words[0].lower())
            if p is None:
                raise Refusal("the skeleton has no such bone", where=place, received=repr(words[0][:40]))
            layout.append((skeleton.names[p], skeleton.freedoms[p]))
    names = [name for name, _ in layout]
    for name, freedoms in zip(skeleton.names, skeleton.freedoms, strict=True):
        if names.count(name) > 1 or (freedoms and name not in names):
            raise Refusal(
                "a bone is missing or stands twice",
                where=place,
                expected=f"one line for {name}",
                received=str(names.count(name)),
            )
    return layout


def _columns_at_fixed_places(body: str, layout: _Layout) -> tuple[list[str], list[list[str]]] | None:
    """Frame numbers and one column of words per channel, if every frame is built like the first; else None.

    The words of all frames are sliced by column, several times faster than a walk by line.
    """
    words = body.split()
    width = 1 + sum(1 + len(freedoms) for _, freedoms in layout)
    if len(words) % width:
        return None
    frames = len(words) // width
    numbers, at = words[::width], 1
    columns: list[list[str]] = []
    if not all(word.isdecimal() and len(word) <= 9 for word in numbers):
        return None
    for name, freedoms in layout:
        heads = words[at::width]
        if heads.count(heads[0]) != frames or heads[0].lower() != name.lower():
            return None
        columns.extend(words[at + k :: width] for k in range(1, 1 + len(freedoms)))
        at += 1 + len(freedoms)
    return numbers, columns


def _columns_by_line(body: str, layout: _Layout, where: str) -> tuple[list[str], list[list[str]]]:
    """Frame numbers and one column of words per channel, line by line: bones in any order, or a Refusal."""
    bones = {name.lower(): (name, len(freedoms)) for name, freedoms in layout}
    numbers: list[str] = []
    frames: list[dict[str, list[str]]] = []
    for line in body.split("\n"):
        words = line.split()
        if not words:
            continue
        if _FRAME_NUMBER.fullmatch(line):
            numbers.append(words[0])
            frames.append({})
            continue
        place = f"{where}, frame {numbers[-1]}"
        if words[0].lower() not in bones:
            raise Refusal("no such bone in the first frame", where=place, received=repr(words[0][:40]))
        name, width = bones[words[0].lower()]
        if name in frames[-1] or len(words) != 1 + width:
            raise Refusal(
                "a bone stands twice" if name in frames[-1] else "a bone has a wrong number of values",
                where=f"{place}, bone {name}",
                expected=str(width),
                received=str(len(words) - 1),
            )
        frames[-1][name] = words[1:]
    for number, frame in zip(numbers, frames, strict=True):
        missing = [name for name, _ in layout if name not in frame]
        if missing:
            is_last = frame is frames[-1]
            raise Refusal(
                "the file is cut short: the last frame is not whole" if is_last else "a bone is missing",
                where=f"{where}, frame {number}, bone {missing[0]}",
            )
    return numbers, [
        [frame[name][k] for frame in frames] for name, freedoms in layout for k in range(len(freedoms))
    ]


def _check_numbering(words: list[str], where: str) -> int:
    """The first frame's number; frames that are missing or repeated are refused, never closed up."""
    numbers = [int(word) for word in words]
    for before, after in itertools.pairwise(numbers):
        if after != before + 1:
            raise Refusal(
                "frames are missing or repeated",
                where=f"{where}, after frame {before}",
                expected=str(before + 1),
                received=str(after),
            )
    return numbers[0]


def _values(columns: list[list[str]], layout: _Layout, start: int, where: str) -> np.ndarray:
    """(T, C) float64 from columns of words; NaN stays."""
    labels = [(name, freedom) for name, freedoms in layout for freedom in freedoms]
    if not labels:
        raise Refusal("nothing moves: the skeleton has no degrees of freedom", where=where)
    values = np.empty((len(columns[0]), len(columns)))
    for c, column in enumerate(columns):
        try:
            values[:, c] = _parse(column)
            wrong = np.flatnonzero(np.abs(values[:, c]) > _LARGEST)
        except ValueError:
            wrong = np.array([t for t, word in enumerate(column) if not _is_number(word)])
        if wrong.size:
            name, freedom = labels[c]
            raise Refusal(
                "a value cannot be used",
                where=f"{where}, frame {start + wrong[0]}, bone {name}, {freedom}",
                expected=f"a number of at most {_LARGEST:g}",
                received=repr(column[wrong[0]][:40]),
            )
    return values


def _parse(words: Sequence[str]) -> list[float]:
    """Numbers as a data file writes them: not Python's ``1_000`` nor digits of other scripts."""
    joined = "".join(words)
    if "_" in joined or not joined.isascii():
        raise ValueError
    return list(map(float, words))


def _is_number(word: str) -> bool:
    """Whether `_parse` takes the word."""
    try:
        _parse([word])
    except ValueError:
        return False
    return True


def _floats(words: Sequence[str], count: int, where: str) -> np.ndarray:
    """(count,) finite numbers of a line of the skeleton."""
    try:
        numbers = np.array(_parse(words))
    except ValueError:
        numbers = np.full(1, np.nan)
    if len(numbers) != count or not np.all(np.abs(numbers) <= _LARGEST):
        raise Refusal(
            "the line cannot be used",
            where=where,
            expected=f"{count} numbers" if count > 1 else "one number",
            received=" ".join(words)[:60] or "nothing",
        )
    return numbers


def _text(path: Path) -> str:
    """The file's text without comments, lines ended by one character."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Refusal("the file cannot be read", where=path.name, received=error.strerror or "") from None
    if not data.strip():
        raise Refusal("the file is empty", where=path.name)
    text = data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    return _COMMENT.sub("", text) if "#" in text else text
