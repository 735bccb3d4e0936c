"""The options by name, from an index of the user's cache: a slip is refused before any library is loaded.

It is written where experiments are composed, for the sources and options as they are; without one, or with other
sources, the same slip is refused by the composition.  What the index cannot judge passes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import partial
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from pipeline.cli.presets import CONF, presets
from pipeline.storage import user_cache
from pipeline.validation import InvalidInput, require_range, required

_SIMPLE = re.compile(r"([a-z_][\w.]*)=([\w./-]*)")
"""Overrides that are judged: no list, mapping, quotes, addition or deletion."""
_NO_NUMBER = re.compile(r"(?!(inf|nan|null|none|true|false)$)[a-z_]+", re.IGNORECASE)
_CHOSEN = re.compile(r"^ *- (?:override /)?(\w+): (\w+)$", re.MULTILINE)
_EXTENDS = re.compile(r"^defaults:[\s\[-]*(\w+)", re.MULTILINE)


FROM_FILES = ("data", "scale")


_INDEX = ("options",)


def write_index() -> None:
    """Keep the index, if it is not there."""
    user_cache.remembered(_INDEX, _index)


def _index() -> dict[str, Any]:
    """Return the options of an experiment, and of those that each choice of a group has."""
    from pipeline.ingestion.data import DATA_SETS
    from pipeline.studies import registry
    from pipeline.studies.experiment import Experiment, Scale

    groups: dict[str, Mapping[str, type[Any]]] = {"scale": {"scale": Scale}, "data": DATA_SETS}
    groups |= {group: registry.options(group) for group in registry.GROUPS}
    trees: dict[str, dict[str, Any]] = {}
    for group, classes in groups.items():
        known = {name: _tree(kind) for name, kind in classes.items()}
        files = {path.stem: path.read_text("utf-8") for path in (CONF / group).glob("*.yaml")}
        for name, text in files.items():
            while name not in known and (base := _EXTENDS.search(text)):
                above = base[1].removeprefix("base_")
                known |= {name: known[above]} if above in known else {}
                text = files.get(above, "")
        # Of data sets and scales the classes are no choices, only what files make of them.
        trees[group] = {
            name: tree for name, tree in known.items() if group not in FROM_FILES or name in files
        }
    return {"options": _tree(Experiment), "groups": trees}


def _tree(kind: type[Any]) -> dict[str, Any]:
    """Return what is known of each option of a class: its options in turn, or words or bounds of its values."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: _values(hints[field.name]) for field in fields(kind)}


def _values(hint: Any) -> Any:
    hint = required(hint)
    bounds: dict[str, Any] = {}
    if get_origin(hint) is Annotated:
        hint, *checks = get_args(hint)
        bounds = {name: value for check in checks if isinstance(check, partial) and check.func is require_range
                  for name, value in check.keywords.items()}  # fmt: skip
    if is_dataclass(hint) and isinstance(hint, type):
        return _tree(hint)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return list(hint.__members__)
    return {"": hint.__name__, "bounds": bounds} if hint in (int, float) else None


def refuse_slips(arguments: Sequence[str]) -> None:
    """Refuse overrides that name no option, or give it a value that it cannot have, if the index is there.

    Raises
    ------
    InvalidInput
        Names the option.
    """
    several = {"-m", "--multirun"} & set(arguments)
    given = [(match[1], match[2]) for item in arguments if (match := _SIMPLE.fullmatch(item))]
    given = [(key, value) for key, value in given if not key.startswith("hydra")]
    if several or not given:
        return
    if (index := user_cache.remembered(_INDEX, lambda: None)) is None:
        return
    chosen = dict(_CHOSEN.findall((CONF / "config.yaml").read_text("utf-8")))
    for key, value in given:
        if key == "experiment":
            _require(key, value, presets())
            preset = (CONF / "experiment" / f"{value}.yaml").read_text("utf-8", errors="replace")
            chosen |= dict(_CHOSEN.findall(preset))
    for key, value in given:
        if key in index["groups"]:
            _require(key, value, index["groups"][key])
            chosen[key] = value
    known = index["options"] | {group: of.get(chosen.get(group)) for group, of in index["groups"].items()}
    for key, value in given:
        if key not in index["groups"] and key not in ("experiment", "skeleton"):
            _judge(key, value, known)


def _require(key: str, value: str, names: Iterable[str]) -> None:
    if value not in names:
        raise InvalidInput("there is no such option", key, " or ".join(sorted(names)), value)


def _judge(key: str, value: str, known: Any) -> None:
    """Refuse one override; what is not known of an option is not judged."""
    above: list[str] = []
    for name in key.split("."):
        above.append(name)
        if not isinstance(known, dict):
            return
        if name not in known or "" in known:
            names = ", ".join(known) if "" not in known else ""
            expected = f"one of {names}" if names else "none: there are no options here"
            raise InvalidInput("there is no such option", ".".join(above), expected)
        known = known[name]
    if isinstance(known, list):
        if re.fullmatch(r"[A-Za-z]\w*", value) and value not in known and value.lower() != "null":
            raise InvalidInput("must be " + " or ".join(known), key, received=value)
    elif isinstance(known, dict) and "" in known:
        if _NO_NUMBER.fullmatch(value):
            whole = "a whole number" if known[""] == "int" else "a number"
            raise InvalidInput(f"must be {whole}", key, received=value)
        if re.fullmatch(r"-?\d+(\.\d+)?", value):
            require_range(key, float(value), **known["bounds"])
