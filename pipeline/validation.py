"""Invalid input, reported in one sentence: what is wrong, where, what was expected, what was received.

Everything that a person can get wrong (a file, a value, a clip) raises `InvalidInput`.  The command line prints its
sentence and exits with status 1; a stage that handles many clips lists it beside the clip and goes on.  The
``require_*`` functions are the checks that everyone shares; each returns the value it was given.  An option says its
bounds in its annotation, ``trials: Count``, which `require_bounds` reads.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, fields, is_dataclass
from functools import partial
from itertools import pairwise
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


_LONGEST, _LONGEST_SENTENCE = 300, 3000
"""Characters of a file's or user's own text in a sentence, and of a whole sentence."""


def _short(text: str, longest: int = _LONGEST) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"


def printable(text: str) -> str:
    """Return a text of one line in which nothing can steer a terminal."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


class InvalidInput(ValueError):
    """Input that cannot be used, in one sentence.

    Parameters
    ----------
    what : str
        What is wrong, e.g. ``"the file is truncated"``; or, of an option, what it must be, e.g.
        ``"must be at least 1"``.
    where : object
        The file, option or clip, e.g. ``"walk.c3d, byte 512"``.
    expected, received : object
        What would have been right, and what came instead.  All three are optional, and shown as text.
    code : str
        Name of the fault for other code and for tests, which never read the sentence: ``"truncated"``.
    **values
        Numbers and names in the sentence, for other code and for tests.

    Examples
    --------
    >>> print(InvalidInput("the rate is not positive", where="a.trc", expected="hertz > 0", received="-1"))
    a.trc: the rate is not positive (expected hertz > 0, received -1)
    >>> print(InvalidInput("must be at least 1", where="sweep.trials", received="0"))
    sweep.trials must be at least 1 (got 0)
    """

    def __init__(
        self,
        what: str,
        where: object = "",
        expected: object = "",
        received: object = "",
        *,
        code: str = "",
        **values: Any,
    ) -> None:
        where, expected, received = _short(str(where)), str(expected), _short(str(received))
        if where and what.startswith("must "):
            sentence, got = f"{where} {what}", "got"
        else:
            sentence, got = f"{where}: {what}" if where else what, "received"
        details = ", ".join(
            f"{label} {value}" for label, value in (("expected", expected), (got, received)) if value
        )
        super().__init__(
            printable(_short(f"{sentence} ({details})" if details else sentence, _LONGEST_SENTENCE))
        )
        self.what = what
        self.where = where
        self.expected = expected
        self.received = received
        self.code, self.values = code, values

    def __reduce__(self) -> tuple:
        again = partial(InvalidInput, code=self.code, **self.values)
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
    """Return a finite number that lies within the bounds given.

    Parameters
    ----------
    name : str
        Full name of the option or argument, e.g. ``"sweep.trials"``.
    value : float
    at_least, above, at_most, below : float, optional
        Bounds, closed and open.
    whole : bool
        Refuse numbers with a fraction.
    unit : str
        Written after the bounds.

    Raises
    ------
    InvalidInput
        If the value is not a finite number, not whole though it must be, or outside the bounds.

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
    """Return a whole number of things, within the bounds of `require_range`.

    Raises
    ------
    InvalidInput
        If it is not whole, or out of range.

    Examples
    --------
    >>> require_count("frames", 2.5)
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: frames must be a whole number at least 1 (got 2.5)
    """
    return int(require_range(name, value, at_least=at_least, whole=True, **bounds))  # type: ignore[arg-type]


def listed(names: Sequence[str]) -> str:
    """Return the first eight names, for a sentence."""
    return ", ".join(names[:8]) + (", …" if len(names) > 8 else "")


def told_apart(value: float, bound: float, decimals: int) -> str:
    """Return a number with as many decimals as show on which side of a bound it is, and at least so many.

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
    """Return values of which there are some, and that increase, each within the bounds of `require_range`.

    Raises
    ------
    InvalidInput
        If there are none, one is out of range, or they do not increase.

    Examples
    --------
    >>> require_increasing("sweep.ratios", [0.2, 0.1], at_least=0)
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: sweep.ratios must hold some values that increase (got 0.2, 0.1)
    """
    for number, value in enumerate(values):
        require_range(f"{name}[{number}]", value, **bounds)  # type: ignore[arg-type]
    if not values or any(later <= earlier for earlier, later in pairwise(values)):
        received = ", ".join(f"{value:g}" for value in values) or "none"
        raise InvalidInput(
            "must hold some values that increase", name, received=received, code="not_increasing"
        )
    return values


def require_choice(name: str, value: Value, choices: Iterable[Value]) -> Value:
    """Return a value that is one of a few.

    Raises
    ------
    InvalidInput
        If it is none of them.

    Examples
    --------
    >>> require_choice("penalty", "printed", ("change", "as_printed"))
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: penalty must be change or as_printed (got printed)
    """
    allowed = list(choices)
    if value not in allowed:
        words = [str(choice) for choice in allowed]
        listed = " or ".join(words) if len(words) < 3 else f"one of {', '.join(words)}"
        raise InvalidInput(f"must be {listed}", name, received=value, code="unknown_choice", value=value)
    return value


def require_distinct(name: str, values: Sequence[Value]) -> Sequence[Value]:
    """Return values of which there are some, and none stands twice.

    Raises
    ------
    InvalidInput
        If there are none, or one stands twice.

    Examples
    --------
    >>> require_distinct("sweep.frames", [10, 10])
    Traceback (most recent call last):
        ...
    pipeline.validation.InvalidInput: sweep.frames must hold some values, each once (got 10, 10)
    """
    if not values or len(set(values)) < len(values):
        received = ", ".join(map(str, values)) or "none"
        raise InvalidInput("must hold some values, each once", name, received=received, code="not_distinct")
    return values


def bounded(**bounds: Any) -> partial[Any]:
    """Return a check for the annotation of an option, within the bounds of `require_range`."""
    return partial(require_range, **bounds)


Finite = Annotated[float, bounded()]
NonNegative = Annotated[float, bounded(at_least=0)]
Positive = Annotated[float, bounded(above=0)]
Share = Annotated[float, bounded(at_least=0, at_most=1)]
Count = Annotated[int, bounded(at_least=1)]
Several = Annotated[int, bounded(at_least=2)]
CountOrAll = Annotated[int, bounded(at_least=0)]
"""0: all, or none."""
Increasing = Annotated[list[Value], require_increasing]
Distinct = Annotated[list[Value], require_distinct]


@dataclass_transform(kw_only_default=True, field_specifiers=(field,))
class Options:
    """Options of one kind; a subclass is a dataclass whose fields are given by name.

    A default that is a list, or itself options, is copied for each instance.

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
                    f"{cls.__name__}.{name} needs a type: without one it is no default of the option"
                )
            if isinstance(default, list | Options) and "ClassVar" not in str(kinds.get(name, "ClassVar")):
                setattr(cls, name, field(default_factory=partial(deepcopy, default)))
        dataclass(kw_only=True)(cls)


def require_bounds(name: str, options: Any) -> None:
    """Validate the options of a dataclass, and of those in it, by the checks in their annotations.

    A check is called with the full name and the value of what it annotates; None is not checked.  Options without a
    name are called by those of their fields alone.

    Raises
    ------
    InvalidInput
        By the checks.

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
    for part in (hint, *get_args(hint)):  # of ``X | None`` the checks of X
        if value is None or get_origin(part) is not Annotated:
            continue
        inner, *checks = get_args(part)
        if isinstance(value, list):
            for number, item in enumerate(value):
                _require(f"{name}[{number}]", item, *get_args(inner))
        for check in checks:
            check(name, value)


def required(hint: Any) -> Any:
    """Return ``X`` of a type ``X | None``, and any other as it is.

    Examples
    --------
    >>> required(int | None), required(list[int])
    (<class 'int'>, list[int])
    """
    parts = get_args(hint)
    return next(part for part in parts if part is not type(None)) if type(None) in parts else hint


def require_name(name: str, value: str) -> str:
    """Return a value that names one folder and cannot lead out of the folder above it.

    Raises
    ------
    InvalidInput
        If it is empty, begins with a dot, or holds a separator, a blank at an end or a control character.

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
    """Return a text that no spreadsheet takes for a formula: one that may be a formula gets an apostrophe in front.

    Examples
    --------
    >>> harmless("LKNE"), harmless("=1+1"), harmless("-1.5"), harmless("-1 to 2")
    ('LKNE', "'=1+1", '-1.5', "'-1 to 2")
    """
    formula = text.lstrip()[:1] in ("=", "+", "-", "@") and not _PLAIN_NUMBER.fullmatch(text)
    return f"'{text}" if formula else text


def is_relative(name: object) -> bool:
    """Return whether a value is a plain relative path below its folder: no root, drive, ``..``, ``.`` or backslash.

    Examples
    --------
    >>> is_relative("fig5/table.csv"), is_relative("../table.csv"), is_relative("a//b"), is_relative("C:/a")
    (True, False, False, False)
    """
    if not isinstance(name, str) or re.search(r"[\\:\x00-\x1f\x7f]", name):
        return False
    return not {"", ".", ".."} & {*name.split("/")}


def fits(value: Any, kind: Any) -> bool:
    """Return whether a value that comes from JSON fits a type hint; a whole number fits float, a list fits tuple.

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
    """Return values as an array; those under a mask would count again."""
    if np.ma.is_masked(values):
        raise InvalidInput("must have no masked values", name, code="masked")
    return np.asarray(values)


def require_shape(name: str, array: Any, shape: Sequence[int | str | None]) -> np.ndarray:
    """Return an array whose shape fits a pattern, as `numpy.ndarray`.

    Parameters
    ----------
    name : str
        What the array is, e.g. ``"positions"``.
    array : array_like
    shape : sequence of int, str or None
        A size for each axis; a letter stands for any size, the same for the same letter, `None` for any.

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
    for actual, wanted in zip(array.shape, shape, strict=False):
        if isinstance(wanted, str):
            fits = fits and sizes.setdefault(wanted, actual) == actual
        elif wanted is not None:
            fits = fits and actual == wanted
    if not fits:
        pattern = ", ".join("any" if size is None else str(size) for size in shape)
        pattern += "," if len(shape) == 1 else ""
        raise InvalidInput(
            f"must have shape ({pattern})", name, received=array.shape, code="wrong_shape", shape=array.shape
        )
    return array


def require_finite(name: str, array: Any) -> np.ndarray:
    """Return an array of finite numbers, as `numpy.ndarray`.

    Raises
    ------
    InvalidInput
        If a number is NaN or infinite, and the sentence gives the index of the first, or masked.

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
