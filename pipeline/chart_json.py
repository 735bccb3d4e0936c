"""Conversion of charts to JSON and back, for the manifests of figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, get_type_hints

import numpy as np

from pipeline.charts import Axis, Chart, Lines, Reference
from pipeline.palette import Style
from pipeline.validation import InvalidInput, fits

_FLAT = {
    "label": "x_label",
    "unit": "x_unit",
    "log": "log_x",
    "limits": "x_limits",
    "ticks": "ticks",
    "words": "words",
}
"""Name in JSON of each field of a chart's abscissa."""


def to_json(chart: Chart) -> dict[str, Any]:
    """Return the JSON form of a chart, without default values; mappings whose order matters become lists of pairs."""
    plain = _plain(chart)
    abscissa = {_FLAT[name]: value for name, value in plain.pop("abscissa").items()}
    plain.pop("page", None)
    return plain | abscissa


def _plain(value: Any) -> Any:
    if isinstance(value, Lines | Axis | Reference | Style):
        usual = {f.name: f.default for f in fields(value)}
        pairs = ((name, getattr(value, name)) for name in usual)
        return {name: _plain(part) for name, part in pairs if not _is_usual(part, usual[name])}
    if isinstance(value, Mapping):
        inner = [[str(name), _plain(part)] for name, part in value.items()]
        ordered = all(isinstance(part, Style | str) for part in value.values())
        return inner if ordered else dict(inner)
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, str):
        return str(value)  # the name of a choice
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _is_usual(value: Any, usual: Any) -> bool:
    if isinstance(value, Mapping | list | tuple):
        return not value
    return value is None or (isinstance(value, str | float | bool) and value == usual)


def from_json(plain: Mapping[str, Any], where: str = "") -> Chart:
    """Return a chart from its JSON form; `where` is the figure's name in messages.

    Raises
    ------
    InvalidInput
        If another version of this software wrote the values, or a value has the wrong type.
    """
    try:
        values = dict(plain)
        values["also"] = [Lines(**_restored(part)) for part in values.get("also", [])]
        values["references"] = [Reference(**part) for part in values.get("references", [])]
        abscissa = {name: values.pop(flat) for name, flat in _FLAT.items() if flat in values}
        if "words" in abscissa:
            abscissa["words"] = dict(abscissa["words"])
        chart = Chart(**_restored(values), abscissa=Axis(**abscissa))
        for part in (chart, chart.abscissa, *chart.also, *chart.references):
            hints = get_type_hints(type(part))
            if wrong := [name for name, value in vars(part).items() if not fits(value, hints[name])]:
                raise TypeError(f"{wrong[0]} has the wrong type")
        return chart
    except (
        TypeError,
        ValueError,
        AttributeError,
    ) as error:  # a field or value that this version does not have
        raise InvalidInput(
            "another version of this software wrote the charts: make the figure again",
            where,
            received=error,
            code="other_version",
        ) from None


def _restored(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a chart's lines, with mappings and styles restored from their JSON form."""
    restored = dict(values)
    if "where" in restored:
        restored["where"] = dict(restored["where"])
    styles = restored.get("styles")
    if isinstance(styles, list):
        restored["styles"] = {key: Style(**style) for key, style in styles}
    elif styles is not None:
        restored["styles"] = Style(**styles)
    return restored
