"""An experiment from presets and overrides, kept in the user's cache, since composing takes long."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, fields, is_dataclass, replace
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_type_hints

from pipeline import mappings
from pipeline.cli.index import write_index
from pipeline.ingestion.data import DATA_SETS, FolderData
from pipeline.processes import processes_for, usable_cores
from pipeline.resources import CONF, PACKAGE
from pipeline.storage import user_cache
from pipeline.storage.provenance import FOLDERS, versions
from pipeline.storage.sealed_folders import TYPE, canonical, digest
from pipeline.studies import registry
from pipeline.studies.experiment import Experiment
from pipeline.validation import InvalidInput, require_choice, require_name

_RESULTS = re.compile(r"results=(?!null$)[\w./-]+")
"""A folder on which nothing else in an experiment depends."""


def compose(overrides: Sequence[str]) -> Experiment:
    """Return the experiment that these overrides name, as on the command line.

    Raises
    ------
    InvalidInput
        If an override names no option.  Hydra's own errors are put into words by `composition.in_words`.
    """

    _indexed()
    results = [item for item in overrides if item.startswith("results=")]
    if results := [item for item in results[-1:] if _RESULTS.fullmatch(item)]:
        overrides = [item for item in overrides if not item.startswith("results=")]
    made: list[Experiment] = []

    def plain() -> Any:
        from pipeline.cli import composition

        made.append(composition.composed(overrides))
        with suppress(InvalidInput):  # of what cannot be kept, such as a number that is not finite
            kept = canonical(made[0])
            return kept if _whole(kept) == made[0] else None
        return None

    key = ("experiment", *overrides, os.environ.get("MOCAP_MIRROR"), usable_cores())
    kept = user_cache.remembered(key, plain, of=_rests_on)
    experiment = made[0] if made else _whole(kept)
    if results:
        experiment.results = results[-1].partition("=")[2]
    return on_this_machine(experiment)


_indexed = cache(write_index)
"""Keep the index of options, once: their classes are loaded now."""


def _whole(value: Any, hint: Any = Experiment) -> Any:
    """Return the options whose canonical form this is."""
    if isinstance(value, list):
        return [_whole(item, hint) for item in value]
    if not isinstance(value, dict):
        return value
    if TYPE not in value:
        return {name: _whole(item, hint) for name, item in value.items()}
    named = (kind for kind in _classes() if kind.__name__ == value[TYPE])
    kind = next(kind for kind in named if issubclass(kind, _named(hint)))
    if issubclass(kind, Enum):
        return kind[value["name"]]
    hints = _classes()[kind]
    return kind(**{name: _whole(item, hints[name]) for name, item in value.items() if name != TYPE})


def with_options(experiment: Experiment, kept: Mapping[str, Any]) -> Experiment:
    """Return an experiment with the options that a published figure's manifest keeps, folders as they are here.

    Raises
    ------
    InvalidInput
        If this version does not have one of the options.
    """
    try:
        found = _whole({**canonical(experiment), **kept})
    except (KeyError, StopIteration, TypeError, AttributeError, ValueError) as error:
        what = "options are not those of this version"
        raise InvalidInput(what, experiment.name, received=error) from error
    for name in FOLDERS & vars(found.data).keys():
        setattr(found.data, name, getattr(experiment.data, name))
    return replace(found, results=experiment.results, workers=experiment.workers)


def _named(hint: Any) -> tuple[type[Any], ...]:
    """Return the classes that a type hint names."""
    return tuple(part for part in (hint, *get_args(hint)) if isinstance(part, type))


def _rests_on() -> str:
    """Return a digest of what a composition follows from: the option classes as loaded, and the files of options.

    What the options are for may be edited without composing anew.
    """
    composers = [PACKAGE / "cli" / f"{name}.py" for name in ("composition", "overrides")]
    files = [path for path in sorted(CONF.rglob("*.yaml")) if path.parent.name != "paper"]
    names = [path.relative_to(CONF).as_posix() for path in files]
    contents = [digest(path.read_bytes()) for path in (*composers, *files)]
    return digest(repr((_schema(), names, contents)).encode())[:32]


@cache
def _classes() -> dict[type[Any], dict[str, Any]]:
    """Return the classes of all options, with the types of their fields."""
    waiting: list[type[Any]] = [Experiment, *DATA_SETS.values()]
    waiting += [kind for group in registry.GROUPS for kind in registry.options(group).values()]
    found: dict[type[Any], dict[str, Any]] = {}
    for kind in waiting:  # which grows by the classes of the fields
        if kind not in found:
            found[kind] = get_type_hints(kind) if is_dataclass(kind) else {}
            waiting += [inner for hint in found[kind].values() for inner in _named(hint)]
    return found


@cache
def _schema() -> str:
    """Return the option classes, with the type, default and sizes of each field, as text."""
    groups = {group: registry.options(group) for group in registry.GROUPS}
    lines = [repr((versions(("hydra-core", "omegaconf")), groups))]
    for kind, hints in _classes().items():
        lines.append(f"{kind} {list(kind) if issubclass(kind, Enum) else ''}")
        for field in fields(kind) if is_dataclass(kind) else ():
            default = field.default if field.default_factory is MISSING else field.default_factory()
            words = "" if default is MISSING else repr(default)
            lines.append(f"{field.name} {hints[field.name]} {words} {dict(field.metadata)}")
    return "\n".join(lines)


def on_this_machine(experiment: Experiment) -> Experiment:
    """Return a composed experiment with the number of its processes and the names of its folders, validated."""
    mappings.chosen(experiment.skeleton.mapping)  # refuses one that does not exist
    known = sorted(path.stem for path in (CONF / "paper").glob("*.yaml") if path.stem != "baselines")
    require_choice("paper", experiment.paper, known)
    data = experiment.data
    if isinstance(data, FolderData):
        if data.name == "folder" and data.path:
            # Named after the user's folder, so that two do not share results.
            data.name = "folder_" + re.sub(r"[^\w.-]+", "_", Path(data.path).resolve().name)
        elif data.name != "folder" and (CONF / "data" / f"{data.name}.yaml").is_file():
            raise InvalidInput("must not be that of another data set", "data.name", received=data.name)
    experiment.workers = processes_for(experiment.workers)
    if not experiment.results.strip() or experiment.results.startswith(
        "~"
    ):  # which a shell leaves in an option
        received = experiment.results.strip() or "nothing"
        raise InvalidInput("must name a folder", "results", received=received)
    # The folder of a figure is made of these three.
    require_name("name", experiment.name)
    require_name("data.name", data.name)
    require_name("scale.name", experiment.scale.name)
    return experiment
