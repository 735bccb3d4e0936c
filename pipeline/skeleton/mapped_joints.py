"""Joints from the points of a recording, with z up: names of points, rules of a mapping, joints."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from pipeline.skeleton.joints import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import Lowering, Rule, SourceMapping, UpAxis
from pipeline.skeleton.upright import axis_up
from pipeline.validation import InvalidInput, listed

_SEPARATORS = re.compile(r"[\W_]+")
_SIDE_FIRST = re.compile(
    r"(left|right|lt|rt|l|r)[\W_]+(?=.)|(left|right)(?=[a-z0-9])|(?-i:([LR])x(?=[A-Z]))", re.IGNORECASE
)
_SIDE_LAST = re.compile(r"(?<=.)[\W_]+(left|right|lt|rt|l|r)$|(?<=[A-Za-z0-9])(Left|Right)$", re.IGNORECASE)

_ENGLISH = {
    word: english
    for english, *words in map(
        str.split,
        """\
Left gauche izquierda izquierdo izq izda esquerda esquerdo esq sinistra sinistro links linke linker linkes
Right droite droit derecha derecho dcha direita direito destra destro rechts rechte rechter rechtes
Hip hanche cadera hüfte huefte hufte hüftgelenk hueftgelenk anca quadril heup
Knee genou rodilla knie kniegelenk ginocchio joelho
Ankle cheville tobillo knöchel knoechel sprunggelenk caviglia tornozelo enkel
Shoulder épaule epaule hombro schulter schultergelenk spalla ombro schouder
Elbow coude codo ellbogen ellenbogen gomito cotovelo elleboog
Wrist poignet muñeca muneca handgelenk polso pulso punho pols
Head tête tete cabeza kopf testa cabeça cabeca hoofd
Neck cou cuello hals nacken collo pescoço pescoco nek
Nose nez nariz nase naso neus
Ear oreille oreja ohr orecchio orelha oor
Eye œil oeil ojo auge occhio olho oog
Pelvis bassin becken bacino bekken
Heel talon talón ferse tallone calcanhar hiel""".splitlines(),
    )
    for word in words
}
"""English words for those of French, Spanish, German, Italian, Portuguese and Dutch that mean nothing else."""
_FOREIGN = re.compile(
    rf"(?:(?<![^\W\d_])|(?<=[a-zß-ÿ])(?=[A-ZÀ-Þ])|(?<=^[LRlr])(?=[A-ZÀ-Þ]))(?i:{'|'.join(_ENGLISH)})"
    r"(?:(?![^\W\d_])|(?<=[a-zß-ÿ])(?=[A-ZÀ-Þ]))"
)
_SHORT_SIDE = re.compile(r"(?<![^\W_])(?:(g|iz|li|sx)|d|dr|der|dir|dx|re)(?![^\W_])", re.IGNORECASE)
"""Sides beside such a word, those in a group left ones."""

_TO_Z_UP = {
    UpAxis.x: np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    UpAxis.y: np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    UpAxis.z: np.eye(3),
    UpAxis("-x"): np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]]),
    UpAxis("-y"): np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    UpAxis("-z"): np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}
"""Rotations (which keep handedness) that bring the named axis to z."""

LOWER_BODY = ("pelvis", "left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle")
"""Joints without which there is no walk: they are never estimated."""


def in_english(name: str) -> str:
    """Return a name with words of other languages for sides and joints in English.

    Examples
    --------
    >>> [in_english(name) for name in ("genou_g", "CHEVILLE droite", "rodillaIzq", "LKnie", "link_d")]
    ['Knee_Left', 'Ankle Right', 'KneeLeft', 'LKnee', 'link_d']
    """
    name, found = _FOREIGN.subn(lambda word: _ENGLISH[word[0].lower()], name)
    return _SHORT_SIDE.sub(lambda side: "Left" if side[1] else "Right", name) if found else name


def plain_name(name: str) -> str:
    """Return a name without prefix, separators and case, in English, its side as one letter in front.

    Examples
    --------
    >>> [plain_name(n) for n in ("anna:L_Ank", "Ank.L", "LeftAnk", "LANK", "l ank", "LxAnk", "Ball")]
    ['lank', 'lank', 'lank', 'lank', 'lank', 'lank', 'ball']
    """
    name = in_english(name.rsplit(":", 1)[-1].strip())
    if match := _SIDE_FIRST.match(name) or _SIDE_LAST.search(name):
        side = match[match.lastindex or 0][0]
        name = side + name[: match.start()] + name[match.end() :]
    return _SEPARATORS.sub("", name).lower()


def bare_names(names: Sequence[str]) -> list[str]:
    """Return names without what precedes a colon, and without the beginning and end that most of them share.

    Examples
    --------
    >>> bare_names([f"p{side}{part}" for side in ("Left", "Right") for part in ("ASI", "Knee", "Toe", "Heel")])[:5]
    ['LeftASI', 'LeftKnee', 'LeftToe', 'LeftHeel', 'RightASI']
    """
    after = [name.rsplit(":", 1)[-1] for name in names]
    begin = _usual_beginning(after)
    end = _usual_beginning([name[::-1] for name in after])[::-1]
    return [name.removeprefix(begin).removesuffix(end) for name in after]


class MappedPoints:
    """The points of a recording as the rules of a mapping name them.

    Parameters
    ----------
    motion : MotionCapture
    mapping : SourceMapping
    """

    def __init__(self, motion: MotionCapture, mapping: SourceMapping) -> None:
        self._motion, self._mapping = motion, mapping
        self._seen = np.asarray(motion.valid.any(axis=0))
        names = motion.names
        ways: tuple[Callable[[str], str], ...] = (str, str.lower, _without_prefix, plain_name)
        self._ways = [(way, _places(map(way, names))) for way in ways]
        bare = bare_names(names)
        if any(short != name.rsplit(":", 1)[-1] for short, name in zip(bare, names, strict=True)):
            self._ways.append((plain_name, _places(map(plain_name, bare))))
        self._found: dict[str, int | None] = {}

    def find(self, wanted: str) -> int | None:
        """Return the index of a point by its name or a synonym; None if it is not there."""
        if wanted not in self._found:
            candidates = (self._by_name(name) for name in (wanted, *self._mapping.points.get(wanted, ())))
            self._found[wanted] = next((index for index in candidates if index is not None), None)
        return self._found[wanted]

    def index(self, wanted: str) -> int:
        """Return the index of a point that is there."""
        index = self.find(wanted)
        assert index is not None
        return index

    def _by_name(self, wanted: str) -> int | None:
        for normalise, places in self._ways:
            found = places.get(normalise(wanted), [])
            if len(found) > 1:  # a second one that was never seen is no second person
                found = [i for i in found if self._seen[i]] or found[:1]
            if len(found) > 1:
                found = self._one_of(found, wanted)
            if found:
                return found[0]
        return None

    def _one_of(self, found: list[int], wanted: str) -> list[int]:
        """One of several points of a name: they must be spelled alike, and equal wherever both were seen."""
        positions = self._motion.positions_mm[:, found]
        off = np.asarray(np.abs(positions - positions[:, :1]))
        spellings = {self._motion.names[i] for i in found}
        if len(spellings) > 1 or (off[np.isfinite(off)] > 1.0).any() or not np.isfinite(off[:, 1:]).any():
            raise InvalidInput(
                f"{len(found)} points are called {wanted!r}",
                expected="one person to a file",
                received=", ".join(self._motion.names[i] for i in found[:3]),
                code="point_twice",
                point=wanted,
                count=len(found),
            )
        return [max(found, key=lambda i: int(self._motion.valid[:, i].sum()))]

    def rule_of(self, joint: str) -> tuple[Rule, Lowering | None] | None:
        """Return the first rule of a joint whose points, lowering included, are in the file, those ever seen first."""
        there = [
            (rule, lowering)
            for rule, lowering in self._mapping.rules(joint)
            if all(self.find(point) is not None for point in _points_of(rule, lowering))
        ]
        seen = [pair for pair in there if self.sees(pair[0])]
        return next(iter(seen or there), None)

    def weights(self, joint: str) -> dict[int, float]:
        """Return the weight of each point, by its index, that makes a joint; none if the file does not give it."""
        weights: dict[int, float] = {}
        rule = self.rule_of(joint)
        for point, weight in rule[0].items() if rule else ():
            weights[self.index(point)] = weights.get(self.index(point), 0.0) + weight
        return weights

    def sees(self, rule: Rule) -> bool:
        """Return whether all points of a rule are in the file and were ever seen."""
        return all((index := self.find(point)) is not None and self._seen[index] for point in rule)

    def lacking(self, joint: str) -> InvalidInput:
        """Return the refusal of a file from which a joint cannot be made."""
        mapping, rules = self._mapping, self._mapping.rules(joint)
        if not rules:
            return InvalidInput(f"no rule for the joint {joint!r}", mapping.name, code="no_rule", joint=joint)
        lacked = next(point for point in _points_of(*rules[-1]) if self.find(point) is None)
        what = f"the joint {joint!r} needs the point {lacked!r}, which the file does not have"
        received = f"points {listed(self._motion.names)}"
        return InvalidInput(
            what,
            mapping.name,
            "skeleton=auto, or a mapping of these points",
            received,
            code="missing_point",
            joint=joint,
            point=lacked,
        )

    def distance(self, joint: str, lowering: Lowering) -> float:
        """Return the mean distance, mm, of the two points by which a joint is lowered."""
        pair = [self.index(point) for point in lowering.between]
        ends = self._motion.positions_mm[:, pair]
        apart = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1)
        if not np.isfinite(apart).any():
            raise InvalidInput(
                f"the two points by which {joint!r} is lowered were never seen together",
                self._mapping.name,
                received=lowering.between,
                code="never_together",
                joint=joint,
            )
        return float(np.nanmean(apart))

    def joints(self) -> np.ndarray:
        """Return joints (T, 15, 3), mm, in the file's axes, none lowered; NaN where the file does not give one.

        Raises
        ------
        InvalidInput
            If it does not give one of the legs or the pelvis.
        """
        positions = np.full((len(self._motion.positions_mm), len(WALKER15.joints), 3), np.nan)
        found = {joint: self.weights(joint) for joint in WALKER15.joints}
        for j, (joint, weights) in enumerate(found.items()):
            if weights:
                source = self._motion.positions_mm[:, list(weights)]
                positions[:, j] = np.einsum("tpk,p->tk", source, np.array(list(weights.values()), float))
            elif joint in LOWER_BODY:
                raise self.lacking(joint)
        return positions


def map_joints(motion: MotionCapture, mapping: SourceMapping) -> tuple[np.ndarray, np.ndarray]:
    """Compute joint positions from source points, with z up.

    Joints other than legs and pelvis may be missing: they are NaN and not valid throughout.

    Parameters
    ----------
    motion : MotionCapture
        Positions (T, P, 3) in mm in the file's axes.
    mapping : SourceMapping
        As `pipeline.mappings` reads or proposes it: weights of a joint of WALKER15 sum to one.

    Returns
    -------
    positions : (T, 15, 3) float64
        Millimetres, z up, NaN where a source point is missing.
    valid : (T, 15) bool

    Raises
    ------
    InvalidInput
        If a joint of legs or pelvis has no rule or its rules name points that the file lacks, or a point stands
        twice in the file (two people).
    """
    points = MappedPoints(motion, mapping)
    positions = points.joints()
    positions = with_z_up(positions, _up_of(positions, motion, mapping))
    for j, joint in enumerate(WALKER15.joints):
        rule = points.rule_of(joint)
        if rule and rule[1]:
            positions[:, j, 2] -= rule[1].by * points.distance(joint, rule[1])
    return positions, np.all(np.isfinite(positions), axis=-1)


def with_z_up(positions: np.ndarray, up: UpAxis) -> np.ndarray:
    """Return positions (…, 3), turned so that the axis that pointed up is z."""
    return positions @ _TO_Z_UP[up].T


def up_axis(motion: MotionCapture, mapping: SourceMapping) -> UpAxis:
    """Return the axis of a file that points up: the one stated, or the one along which its joints stand.

    Raises
    ------
    InvalidInput
        As `map_joints`.
    """
    return _up_of(MappedPoints(motion, mapping).joints(), motion, mapping)


def _up_of(positions: np.ndarray, motion: MotionCapture, mapping: SourceMapping) -> UpAxis:
    """The axis that the caller stated, or along which joints (T, 15, 3) stand; a mapping's own breaks ties."""
    return axis_up(positions, mapping.up)[0] if motion.up == UpAxis.auto else motion.up


def _points_of(rule: Rule, lowering: Lowering | None) -> tuple[str, ...]:
    return (*rule, *(lowering.between if lowering else ()))


def _without_prefix(name: str) -> str:
    return name.rsplit(":", 1)[-1].lower()


def _places(names: Iterable[str]) -> dict[str, list[int]]:
    places: dict[str, list[int]] = {}
    for index, name in enumerate(names):
        places.setdefault(name, []).append(index)
    return places


def _usual_beginning(names: list[str]) -> str:
    """The beginning that most names have in common, such as ``mixamorig`` but of a root; empty if it is no prefix.

    One or two letters are a prefix if they are small ones in front of a capital, as in ``pRightASI``.
    """
    middle = sorted(names)[len(names) // 2] if len(names) >= 7 else ""
    length = 0
    while 3 * sum(name.startswith(middle[: length + 1]) for name in names) > 2 * len(names):
        if (length := length + 1) >= len(middle):
            return ""
    short = middle[:length].islower() and middle[length].isupper()
    return middle[:length] if length >= 3 or short or middle[length - 1 : length] in set("_-. ") else ""
