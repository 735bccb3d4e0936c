"""Computation of joints, with z up, from the points of a recording by the rules of a mapping."""

from __future__ import annotations

import re
from collections import Counter
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
"""English translations of French, Spanish, German, Italian, Portuguese and Dutch words for joints and sides.

Ambiguous words are left out.
"""
_FOREIGN = re.compile(
    rf"(?:(?<![^\W\d_])|(?<=[a-zß-ÿ])(?=[A-ZÀ-Þ])|(?<=^[LRlr])(?=[A-ZÀ-Þ]))(?i:{'|'.join(_ENGLISH)})"
    r"(?:(?![^\W\d_])|(?<=[a-zß-ÿ])(?=[A-ZÀ-Þ]))"
)
_SHORT_SIDE = re.compile(r"(?<![^\W_])(?:(g|iz|li|sx)|d|dr|der|dir|dx|re)(?![^\W_])", re.IGNORECASE)
"""Pattern of foreign abbreviations for left and right in point names; its group matches left only."""

_TO_Z_UP = {
    UpAxis.x: np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    UpAxis.y: np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    UpAxis.z: np.eye(3),
    UpAxis("-x"): np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]]),
    UpAxis("-y"): np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    UpAxis("-z"): np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}
"""Rotation matrices that turn the named axis to z, without a reflection."""

LOWER_BODY = ("pelvis", "left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle")
"""Joints that each walk must contain, because they are not estimated."""


def in_english(name: str) -> str:
    """Translate words for sides and joints in the name of a point to English.

    Examples
    --------
    >>> [in_english(name) for name in ("genou_g", "CHEVILLE droite", "rodillaIzq", "LKnie", "link_d")]
    ['Knee_Left', 'Ankle Right', 'KneeLeft', 'LKnee', 'link_d']
    """
    name, count = _FOREIGN.subn(lambda word: _ENGLISH[word[0].lower()], name)
    return _SHORT_SIDE.sub(lambda side: "Left" if side[1] else "Right", name) if count else name


def plain_name(name: str) -> str:
    """Return a point name in a standard form, such as ``lank`` for ``anna:L_Ank``.

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
    """Return the names of points without a prefix or suffix that most of the names share.

    The parts are text before a colon, and a prefix and a suffix that most names have, or the first word of at least a
    third of the names.

    Examples
    --------
    >>> bare_names([f"p{side}{part}" for side in ("Left", "Right") for part in ("ASI", "Knee", "Toe", "Heel")])[:5]
    ['LeftASI', 'LeftKnee', 'LeftToe', 'LeftHeel', 'RightASI']
    """
    after = [name.rsplit(":", 1)[-1] for name in names]
    begin = _common_prefix(after) or _shared_word(after)
    end = _common_prefix([name[::-1] for name in after])[::-1]
    return [name.removeprefix(begin).removesuffix(end) for name in after]


class MappedPoints:
    """Lookup of the points of a recording by the point names in a mapping.

    Parameters
    ----------
    motion : MotionCapture
    mapping : SourceMapping
    """

    def __init__(self, motion: MotionCapture, mapping: SourceMapping) -> None:
        self._motion, self._mapping = motion, mapping
        self._measured = np.asarray(motion.valid.any(axis=0))
        names = motion.names
        normalisers: tuple[Callable[[str], str], ...] = (str, str.lower, _without_prefix, plain_name)
        self._indices = [(normalise, _index(map(normalise, names))) for normalise in normalisers]
        bare = bare_names(names)
        if any(short != name.rsplit(":", 1)[-1] for short, name in zip(bare, names, strict=True)):
            self._indices.append((plain_name, _index(map(plain_name, bare))))
        self._cached: dict[str, int | None] = {}

    def find(self, point: str) -> int | None:
        """Return the index of the point with a name or one of its alternative names; None without such a point."""
        if point not in self._cached:
            candidates = (self._by_name(name) for name in (point, *self._mapping.points.get(point, ())))
            self._cached[point] = next((index for index in candidates if index is not None), None)
        return self._cached[point]

    def index(self, point: str) -> int:
        """Return the index of a named point, which must exist in the recording."""
        index = self.find(point)
        assert index is not None
        return index

    def _by_name(self, name: str) -> int | None:
        for normalise, index in self._indices:
            matches = index.get(normalise(name), [])
            if len(matches) > 1:  # a point that was never measured does not count as a second person
                matches = [i for i in matches if self._measured[i]] or matches[:1]
            if len(matches) > 1:
                matches = self._unique(matches, name)
            if matches:
                return matches[0]
        return None

    def _unique(self, matches: list[int], name: str) -> list[int]:
        """Select one of several points that have the same name.

        The points must have the same spelling and equal positions.
        """
        positions = self._motion.positions_mm[:, matches]
        change = np.asarray(np.abs(positions - positions[:, :1]))
        finite = np.isfinite(change)
        spellings = {self._motion.names[i] for i in matches}
        if len(spellings) > 1 or (change[finite] > 1.0).any() or not finite[:, 1:].any():
            raise InvalidInput(
                f"{len(matches)} points are called {name!r}",
                expected="a single person per file",
                received=", ".join(self._motion.names[i] for i in matches[:3]),
                code="point_twice",
                point=name,
                count=len(matches),
            )
        return [max(matches, key=lambda i: int(self._motion.valid[:, i].sum()))]

    def rule_of(self, joint: str) -> tuple[Rule, Lowering | None] | None:
        """Return the first rule for a joint whose points are all in the file; None without such a rule.

        Rules whose points were measured have priority.
        """
        available = [
            (rule, lowering)
            for rule, lowering in self._mapping.rules(joint)
            if all(self.find(point) is not None for point in _points_of(rule, lowering))
        ]
        measured = [pair for pair in available if self.sees(pair[0])]
        return next(iter(measured or available), None)

    def weights(self, joint: str) -> dict[int, float]:
        """Return the weights of the points that define a joint, by point index; empty if a point is missing."""
        weights: dict[int, float] = {}
        rule = self.rule_of(joint)
        for point, weight in rule[0].items() if rule else ():
            weights[self.index(point)] = weights.get(self.index(point), 0.0) + weight
        return weights

    def sees(self, rule: Rule) -> bool:
        """Return True if all points of a rule are in the file and were measured."""
        return all((index := self.find(point)) is not None and self._measured[index] for point in rule)

    def lacking(self, joint: str) -> InvalidInput:
        """Return the error for a joint that cannot be computed from the points of the file."""
        mapping, rules = self._mapping, self._mapping.rules(joint)
        if not rules:
            return InvalidInput(
                f"the mapping has no rule for the joint {joint!r}", mapping.name, code="no_rule", joint=joint
            )
        missing = next(point for point in _points_of(*rules[-1]) if self.find(point) is None)
        message = f"the joint {joint!r} needs the point {missing!r}, which the file does not have"
        received = f"points {listed(self._motion.names)}"
        return InvalidInput(
            message,
            mapping.name,
            "skeleton=auto, or a mapping for these points",
            received,
            code="missing_point",
            joint=joint,
            point=missing,
        )

    def distance(self, joint: str, lowering: Lowering) -> float:
        """Return the mean distance, mm, between the two points that set how far a joint is shifted down."""
        pair = [self.index(point) for point in lowering.between]
        ends = self._motion.positions_mm[:, pair]
        distance = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1)
        if not np.isfinite(distance).any():
            raise InvalidInput(
                f"the two points that set the downward shift of {joint!r} were never measured in the same frame",
                self._mapping.name,
                received=lowering.between,
                code="never_together",
                joint=joint,
            )
        return float(np.nanmean(distance))

    def joints(self) -> np.ndarray:
        """Return joints (T, 15, 3), mm, in the axes of the file, without downward shifts; NaN where missing.

        Raises
        ------
        InvalidInput
            If a joint of the legs or the pelvis is missing.
        """
        positions = np.full((len(self._motion.positions_mm), len(WALKER15.joints), 3), np.nan)
        weights_of = {joint: self.weights(joint) for joint in WALKER15.joints}
        for j, (joint, weights) in enumerate(weights_of.items()):
            if weights:
                source = self._motion.positions_mm[:, list(weights)]
                positions[:, j] = np.einsum("tpk,p->tk", source, np.array(list(weights.values()), float))
            elif joint in LOWER_BODY:
                raise self.lacking(joint)
        return positions


def map_joints(motion: MotionCapture, mapping: SourceMapping) -> tuple[np.ndarray, np.ndarray]:
    """Compute joint positions from the points of a recording, and rotate them so that z points up.

    Joints other than legs and pelvis may be missing; they are NaN and invalid in all frames.

    Parameters
    ----------
    motion : MotionCapture
        Positions (T, P, 3) in mm in the file's axes.
    mapping : SourceMapping
        Mapping from `pipeline.mappings`; the weights of a joint of WALKER15 sum to one.

    Returns
    -------
    positions : (T, 15, 3) float64
        Millimetres, z up, NaN where a source point is missing.
    valid : (T, 15) bool

    Raises
    ------
    InvalidInput
        If a joint of legs or pelvis has no rule, its points are missing, or a point is repeated (two people).
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
    """Rotate positions (…, 3) so that the axis `up` becomes z."""
    return positions @ _TO_Z_UP[up].T


def up_axis(motion: MotionCapture, mapping: SourceMapping) -> UpAxis:
    """Return the axis of a recording that points up, stated by the user or inferred from the standing body.

    Raises
    ------
    InvalidInput
        In the cases of `map_joints`.
    """
    return _up_of(MappedPoints(motion, mapping).joints(), motion, mapping)


def _up_of(positions: np.ndarray, motion: MotionCapture, mapping: SourceMapping) -> UpAxis:
    """Return the upward axis that the user stated, or else the axis along which joints (T, 15, 3) stand.

    The mapping's axis decides between axes that are equally plausible.
    """
    return axis_up(positions, mapping.up)[0] if motion.up == UpAxis.auto else motion.up


def _points_of(rule: Rule, lowering: Lowering | None) -> tuple[str, ...]:
    return (*rule, *(lowering.between if lowering else ()))


def _without_prefix(name: str) -> str:
    return name.rsplit(":", 1)[-1].lower()


def _index(names: Iterable[str]) -> dict[str, list[int]]:
    indices: dict[str, list[int]] = {}
    for index, name in enumerate(names):
        indices.setdefault(name, []).append(index)
    return indices


def _shared_word(names: Sequence[str]) -> str:
    """Return the first word that a third of the names share, such as ``Character1_``; empty if it is a side."""
    words = Counter(name.partition("_")[0] for name in names if "_" in name)
    word, count = max(words.items(), key=lambda item: item[1], default=("", 0))
    side = _SIDE_FIRST.match(f"{word}_x")
    return f"{word}_" if word and not side and count >= max(7, len(names) / 3) else ""


def _common_prefix(names: list[str]) -> str:
    """Return the prefix that most of the names share, such as ``mixamorig``; empty without such a prefix.

    One or two letters are a prefix only if they are lower case in front of a capital, as in ``pRightASI``.
    """
    middle = sorted(names)[len(names) // 2] if len(names) >= 7 else ""
    length = 0
    while 3 * sum(name.startswith(middle[: length + 1]) for name in names) > 2 * len(names):
        if (length := length + 1) >= len(middle):
            return ""
    short = middle[:length].islower() and middle[length].isupper()
    return middle[:length] if length >= 3 or short or middle[length - 1 : length] in set("_-. ") else ""
