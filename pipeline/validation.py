"""Errors for invalid input, in one sentence: what is wrong, where, what was expected, what was found.

Every input that a user can correct (a file, a value, a clip) raises `InvalidInput`.  The command line prints the
message and exits with status 1.  A stage that handles many clips lists the message in the row of the clip and
continues.  The ``require_*`` functions are the shared checks; each returns the value that it checked.  The annotation
of an option states its bounds, as in ``trials: Count``; `require_bounds` reads them.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, fields, is_dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
    is_typeddict,
)

import numpy as np

Value = TypeVar("Value")


_MAX_QUOTE, _MAX_SENTENCE, _MAX_NAME = 300, 3000, 120
"""Maximum numbers of characters: of a quotation in a message, of a message, and of a name in a message."""


def _short(text: str, longest: int = _MAX_QUOTE) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"


def _with_short_names(text: str) -> str:
    """Return a text in which the middle of very long words is left out, except in paths."""
    word = rf"[^\s/\\]{{{_MAX_NAME + 1},}}"
    return re.sub(word, lambda match: f"{match[0][: _MAX_NAME // 2]}…{match[0][-_MAX_NAME // 2 :]}", text)


def printable(text: str) -> str:
    """Return a text in one line, with control characters replaced by escape sequences."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


_UNKNOWN = ("unknown_choice", "unknown_option", "unknown_command")
"""Codes of errors whose message names the nearest valid name."""
_SIMILAR = 0.75
"""Smallest similarity, as measured by `difflib`, of a name that is suggested."""


class InvalidInput(ValueError):
    """Error for input that cannot be used; its message is one sentence.

    The message says *found* for the content of a file and *got* for what a user typed.

    Parameters
    ----------
    what : str
        The fault, e.g. ``"the file is truncated"``; for an option the requirement, e.g. ``"must be at least 1"``.
    where : object, optional
        The file, option or clip, e.g. ``"walk.c3d, byte 512"``.
    expected, received : object, optional
        The valid value and the actual one; both are shown as text.
    code : str
        Name of the fault, e.g. ``"truncated"``.  Code and tests compare it, never the message.
    typed : bool, optional
        Whether a user typed the received value.  By default this is so where `what` begins with ``must`` and `where` is
        not a path.
    **values
        Numbers and names in the message, for code and tests.

    Examples
    --------
    >>> print(InvalidInput("the rate is not positive", where="a.trc", expected="hertz > 0", received="-1"))
    a.trc: the rate is not positive (expected hertz > 0, found -1)
    >>> print(InvalidInput("must be at least 1", where="sweep.trials", received="0"))
    sweep.trials must be at least 1 (got 0)
    >>> print(InvalidInput("this option does not exist", "sweep.trails", received="5", typed=True))
    sweep.trails: this option does not exist (got 5)
    """

    def __init__(
        self,
        what: str,
        where: object = "",
        expected: object = "",
        received: object = "",
        *,
        code: str = "",
        typed: bool | None = None,
        **values: Any,
    ) -> None:
        requirement = what.startswith("must ") and bool(str(where))
        self.typed = (requirement and not isinstance(where, Path)) if typed is None else typed
        where, expected, received = _short(str(where)), str(expected), _short(str(received))
        sentence = f"{where} {what}" if requirement else f"{where}: {what}" if where else what
        if code in _UNKNOWN:
            from difflib import get_close_matches  # slow to import

            names = re.findall(r"[\w.-]+", expected or what)
            near = get_close_matches(received or where.rpartition(".")[2], names, 1, _SIMILAR)
            sentence += f": did you mean {near[0]}?" if near and near[0] != expected else ""
        labelled = (("expected", expected), ("got" if self.typed else "found", received))
        details = ", ".join(f"{label} {value}" for label, value in labelled if value)
        whole = _with_short_names(f"{sentence} ({details})" if details else sentence)
        super().__init__(printable(_short(whole, _MAX_SENTENCE)))
        self.what = what
        self.where = where
        self.expected = expected
        self.received = received
        self.code, self.values = code, values

    def __reduce__(self) -> tuple:
        again = partial(InvalidInput, code=self.code, typed=self.typed, **self.values)
        return (again, (self.what, self.where, self.expected, self.received))


def require_range(
    name: str,
    value: float,
    *,
    at_least: float | None = None,
    above: float | None = None,
    at_most: float | None = None,
    below: float | None = None,
    whole: bool = False,
    unit: str = "",
) -> Any:
    """Return a number after checking that it is finite and within bounds.

    Parameters
    ----------
    name : str
        Full name of the option or argument, e.g. ``"sweep.trials"``.
    value : float
    at_least, above, at_most, below : float, optional
        Bounds: `at_least` and `at_most` are closed, `above` and `below` open.
    whole : bool
        Whether the value must be an integer.
    unit : str
        Unit in the message.

    Raises
    ------
    InvalidInput
        If the value is not a finite number, not an integer where `whole` is set, or outside the bounds.

    Examples
    --------
    >>> require_range("sweep.trials", 3, at_least=1)
    3
    >>> require_range("sweep.trials", 0, at_least=1)
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: sweep.trials must be at least 1 (got 0)
    """
    number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    bounds = {
        word: (bound, holds)
        for word, bound, holds in (
            ("at least", at_least, operator.ge),
            ("above", above, operator.gt),
            ("at most", at_most, operator.le),
            ("below", below, operator.lt),
        )
        if bound is not None
    }
    fits = number and np.isfinite(value) and not (whole and value % 1)
    if not fits or not all(holds(value, bound) for bound, holds in bounds.values()):
        limits = " and ".join(f"{word} {bound:g}" for word, (bound, _) in bounds.items())
        words = ("a whole number " if whole else "") + limits + (f" {unit}" if unit else "")
        received = f"{value:g}" if number else repr(value)
        if number and any(float(received) == bound != value for bound, _ in bounds.values()):
            received = repr(float(value))
        wrong = f"must be {words.strip() or 'a finite number'}"
        raise InvalidInput(wrong, name, received=received, code="out_of_range", value=value)
    return value


def require_count(name: str, value: float, at_least: int = 1, **bounds: float) -> int:
    """Return a count, after checking that it is an integer (1 or more by default) and within bounds.

    Raises
    ------
    InvalidInput
        If the value is not an integer or is out of range.

    Examples
    --------
    >>> require_count("frames", 2.5)
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: frames must be a whole number at least 1 (got 2.5)
    """
    return int(require_range(name, value, at_least=at_least, whole=True, **bounds))  # type: ignore[arg-type]


def listed(names: Sequence[str]) -> str:
    """Return names as text for a message; after the first eight, an ellipsis replaces further names."""
    return ", ".join(names[:8]) + (", …" if len(names) > 8 else "")


def told_apart(value: float, bound: float, decimals: int) -> str:
    """Return a number as text, with enough decimals to show whether it is above or below a bound.

    Examples
    --------
    >>> told_apart(0.18, 0.15, 2), told_apart(0.1503, 0.15, 2), told_apart(59.98, 60, 0)
    ('0.18', '0.1503', '59.98')
    """
    places = range(decimals, decimals + 15)
    texts = (f"{value:.{n}f}" for n in places)
    return next(
        (t for t in texts if (float(t) > bound, float(t) < bound) == (value > bound, value < bound)),
        repr(value),
    )


def require_increasing(name: str, values: Sequence[float], **bounds: float | bool) -> Sequence[float]:
    """Return a sequence after checking that it is not empty, strictly increasing and within bounds.

    The bounds are the keywords of `require_range`.

    Raises
    ------
    InvalidInput
        If the sequence is empty, a value is out of range, or the values do not increase.

    Examples
    --------
    >>> require_increasing("sweep.ratios", [0.2, 0.1], at_least=0)
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: sweep.ratios must be non-empty and strictly increasing (got 0.2, 0.1)
    """
    for number, value in enumerate(values):
        require_range(f"{name}[{number}]", value, **bounds)  # type: ignore[arg-type]
    if not values or any(later <= earlier for earlier, later in pairwise(values)):
        received = ", ".join(f"{value:g}" for value in values) or "none"
        raise InvalidInput(
            "must be non-empty and strictly increasing", name, received=received, code="not_increasing"
        )
    return values


def require_choice(name: str, value: Value, choices: Iterable[Value]) -> Value:
    """Return a value after checking that it is one of the choices.

    Raises
    ------
    InvalidInput
        If the value is not among the choices.

    Examples
    --------
    >>> require_choice("penalty", "printed", ("change", "as_printed"))
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: penalty must be change or as_printed: did you mean as_printed? (got printed)
    """
    allowed = list(choices)
    if value not in allowed:
        words = [str(choice) for choice in allowed]
        listed = " or ".join(words) if len(words) < 3 else f"one of {', '.join(words)}"
        raise InvalidInput(f"must be {listed}", name, received=value, code="unknown_choice", value=value)
    return value


def require_distinct(name: str, values: Sequence[Value]) -> Sequence[Value]:
    """Return a sequence after checking that it is not empty and contains no duplicates.

    Raises
    ------
    InvalidInput
        If the sequence is empty or a value occurs twice.

    Examples
    --------
    >>> require_distinct("sweep.frames", [10, 10])
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: sweep.frames must be non-empty, without duplicates (got 10, 10)
    """
    if not values or len(set(values)) < len(values):
        received = ", ".join(map(str, values)) or "none"
        raise InvalidInput(
            "must be non-empty, without duplicates", name, received=received, code="not_distinct"
        )
    return values


def bounded(**bounds: Any) -> partial[Any]:
    """Return a function that checks the bounds of an option, for the option's annotation.

    The bounds are the keywords of `require_range`.
    """
    return partial(require_range, **bounds)


Finite = Annotated[float, bounded()]
NonNegative = Annotated[float, bounded(at_least=0)]
Positive = Annotated[float, bounded(above=0)]
Share = Annotated[float, bounded(at_least=0, at_most=1)]
Count = Annotated[int, bounded(at_least=1)]
Several = Annotated[int, bounded(at_least=2)]
CountOrAll = Annotated[int, bounded(at_least=0)]
"""Type of a count for which 0 has a special meaning, such as all."""
Increasing = Annotated[list[Value], require_increasing]
Distinct = Annotated[list[Value], require_distinct]


@dataclass_transform(kw_only_default=True, field_specifiers=(field,))
class Options:
    """Base class of options; each subclass becomes a dataclass with keyword-only fields.

    A default that is a list or an `Options` instance is copied for each new instance.

    Examples
    --------
    >>> class Sweep(Options):
    ...     views_deg: list[float] = [0.0, 90.0]
    >>> Sweep().views_deg is Sweep().views_deg
    False
    """

    def __init_subclass__(cls) -> None:
        kinds = vars(cls).get("__annotations__", {})
        for name, default in list(vars(cls).items()):
            if name not in kinds and name in getattr(cls.__init__, "__annotations__", ()):
                raise TypeError(
                    f"{cls.__name__}.{name} needs a type annotation: without one its value is not the option's default"
                )
            if isinstance(default, list | Options) and "ClassVar" not in str(kinds.get(name, "ClassVar")):
                setattr(cls, name, field(default_factory=partial(deepcopy, default)))
        dataclass(kw_only=True)(cls)


def require_bounds(name: str, options: Any) -> None:
    """Validate the options of a dataclass, and of dataclasses in it, with the checks in their annotations.

    A check is called with the full name and the value of the option; None is not checked.  With an empty `name`, the
    full name of an option is its field's name.

    Raises
    ------
    InvalidInput
        If a check rejects a value.

    Examples
    --------
    >>> class Sweep(Options):
    ...     trials: Count
    >>> require_bounds("sweep", Sweep(trials=0))
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: sweep.trials must be at least 1 (got 0)
    """
    hints = get_type_hints(type(options), include_extras=True)
    for option in fields(options):
        _require(f"{name}.{option.name}".lstrip("."), getattr(options, option.name), hints[option.name])


def _require(name: str, value: Any, hint: Any) -> None:
    if is_dataclass(value):
        require_bounds(name, value)
    for part in (hint, *get_args(hint)):  # the checks of X in ``X | None``
        if value is None or get_origin(part) is not Annotated:
            continue
        inner, *checks = get_args(part)
        if isinstance(value, list):
            for number, item in enumerate(value):
                _require(f"{name}[{number}]", item, *get_args(inner))
        for check in checks:
            check(name, value)


def required(hint: Any) -> Any:
    """Return the type ``X`` for the type hint ``X | None``, and any other type hint unchanged.

    Examples
    --------
    >>> required(int | None), required(list[int])
    (<class 'int'>, list[int])
    """
    parts = get_args(hint)
    return next(part for part in parts if part is not type(None)) if type(None) in parts else hint


def require_name(name: str, value: str) -> str:
    """Return a name after checking that it can be the name of a folder inside its parent folder.

    Raises
    ------
    InvalidInput
        If the name is empty, begins with a dot, contains a separator or control character, or has a blank at an end.

    Examples
    --------
    >>> require_name("figure", "zhang2007_fig5")
    'zhang2007_fig5'
    >>> require_name("figure", "../elsewhere")
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: figure must be a plain name, not a path (got '../elsewhere')
    """
    plain = isinstance(value, str) and value == value.strip() and not value.startswith(".")
    if not plain or not value or re.search(r"[/\\\x00-\x1f\x7f]", value):
        raise InvalidInput(
            "must be a plain name, not a path", name, received=repr(value), code="not_plain_name"
        )
    return value


_PLAIN_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|-inf", re.IGNORECASE)


def harmless(text: str) -> str:
    """Return a text that no spreadsheet interprets as a formula: a possible formula gets an apostrophe in front.

    Examples
    --------
    >>> harmless("LKNE"), harmless("=1+1"), harmless("-1.5"), harmless("-1 to 2")
    ('LKNE', "'=1+1", '-1.5', "'-1 to 2")
    """
    formula = text.lstrip()[:1] in ("=", "+", "-", "@") and not _PLAIN_NUMBER.fullmatch(text)
    return f"'{text}" if formula else text


def is_relative(name: object) -> bool:
    """Return True if a value is a relative path that stays in its folder.

    Such a path has no root, drive, ``..``, ``.`` or backslash.

    Examples
    --------
    >>> is_relative("fig5/table.csv"), is_relative("../table.csv"), is_relative("a//b"), is_relative("C:/a")
    (True, False, False, False)
    """
    if not isinstance(name, str) or re.search(r"[\\:\x00-\x1f\x7f]", name):
        return False
    return not {"", ".", ".."} & {*name.split("/")}


def fits(value: Any, kind: Any) -> bool:
    """Return True if a value from JSON fits a type hint; integers are accepted as float, lists as tuple.

    Examples
    --------
    >>> fits({"a": [1, 2.5]}, dict[str, list[float]]), fits({"a": 1}, dict[str, str]), fits(None, int | None)
    (True, False, True)
    """
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if origin is Any or isinstance(origin, TypeVar):
        return True
    if origin is Annotated:
        return fits(value, inner[0])
    if origin in (Union, UnionType):
        return any(fits(value, part) for part in inner)
    if origin is Literal:
        return value in inner
    if is_typeddict(origin):
        hints = get_type_hints(origin)
        entries = isinstance(value, dict) and value.keys() >= origin.__required_keys__
        return entries and all(fits(value[name], hints[name]) for name in hints.keys() & value.keys())
    if origin is tuple and isinstance(value, list | tuple) and inner and inner[-1] is not Ellipsis:
        return len(value) == len(inner) and all(map(fits, value, inner))
    if origin in (list, tuple, Sequence):
        return isinstance(value, list | tuple) and all(
            fits(item, part) for part in inner[:1] for item in value
        )
    if origin in (dict, Mapping):
        return isinstance(value, dict) and all(
            fits(item, part) for part in inner[1:] for item in value.values()
        )
    if origin is float:
        origin = int | float
    return isinstance(value, origin) and (origin in (bool, object) or not isinstance(value, bool))


def _array(name: str, values: Any) -> np.ndarray:
    """Return values as an array; masked values are rejected, because a plain array would include them."""
    if np.ma.is_masked(values):
        raise InvalidInput("must have no masked values", name, code="masked")
    return np.asarray(values)


def require_shape(name: str, array: Any, shape: Sequence[int | str | None]) -> np.ndarray:
    """Return an array as `numpy.ndarray`, after checking that its shape matches a pattern.

    Parameters
    ----------
    name : str
        Name of the array, e.g. ``"positions"``.
    array : array_like
    shape : sequence of int, str or None
        Size of each axis.  Equal letters stand for equal sizes; `None` stands for any size.

    Raises
    ------
    InvalidInput
        If the number of axes or a size differs, or values are masked.

    Examples
    --------
    >>> require_shape("positions", np.zeros((4, 15, 2)), ("T", 15, 3))
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: positions must have shape (T, 15, 3) (got (4, 15, 2))
    """
    array = _array(name, array)
    sizes: dict[str, int] = {}
    fits = array.ndim == len(shape)
    for actual, required_size in zip(array.shape, shape, strict=False):
        if isinstance(required_size, str):
            fits = fits and sizes.setdefault(required_size, actual) == actual
        elif required_size is not None:
            fits = fits and actual == required_size
    if not fits:
        pattern = ", ".join("any" if size is None else str(size) for size in shape)
        pattern += "," if len(shape) == 1 else ""
        raise InvalidInput(
            f"must have shape ({pattern})", name, received=array.shape, code="wrong_shape", shape=array.shape
        )
    return array


def require_finite(name: str, array: Any) -> np.ndarray:
    """Return an array as `numpy.ndarray`, after checking that all its numbers are finite.

    Raises
    ------
    InvalidInput
        If a number is masked, NaN or infinite.  The message gives the index of the first that is not finite.

    Examples
    --------
    >>> require_finite("weights", [1.0, float("nan")])
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: weights must be finite (got nan at index 1)
    """
    array = _array(name, array)
    bad = ~np.isfinite(array)
    if bad.any():
        at = tuple(np.argwhere(bad)[0].tolist())
        where = str(at[0]) if len(at) == 1 else str(at)
        received = f"{array[at]} at index {where}"
        raise InvalidInput("must be finite", name, received=received, code="not_finite", index=at)
    return array
