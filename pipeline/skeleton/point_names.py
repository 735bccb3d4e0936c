"""Names of points, however they are spelled: prefix, side, language."""

from __future__ import annotations

import re
from collections.abc import Sequence

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
