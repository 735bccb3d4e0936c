"""An experiment from presets and overrides, kept in the user's cache, since composing takes long."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_type_hints

from pipeline import mappings
from pipeline.ingestion.data import FolderData, RecordedData, SyntheticData
from pipeline.processes import processes_for, usable_cores
from pipeline.storage import user_cache
from pipeline.storage.sealed_folders import TYPE, canonical
from pipeline.studies import registry
from pipeline.studies.experiment import Experiment
from pipeline.validation import InvalidInput, require_name


def compose(overrides: Sequence[str]) -> Experiment:
    """Return the experiment that these overrides name, as on the command line.

    Raises
    ------
    InvalidInput
        If an override names no option.  Hydra's own errors are put into words by `composition.in_words`.
    """
    made: list[Experiment] = []

    def plain() -> Any:
        from pipeline.cli import composition

        made.append(composition.composed(overrides))
        with suppress(InvalidInput):  # of what cannot be kept, such as a number that is not finite
            kept = canonical(made[0])
            return kept if _whole(kept) == made[0] else None
        return None

    said = ("experiment", *overrides, os.environ.get("MOCAP_MIRROR"), usable_cores())
    kept = user_cache.remembered(said, plain)
    return on_this_machine(made[0] if made else _whole(kept))


@cache
def _named(hint: Any) -> tuple[type[Any], ...]:
    """Return the classes that a type hint names."""
    return (
        (hint,) if isinstance(hint, type) else tuple(kind for part in get_args(hint) for kind in _named(part))
    )


@cache
def _classes() -> dict[type[Any], dict[str, Any]]:
    """Return the classes of all options, with the types of their fields."""
    found: dict[type[Any], dict[str, Any]] = {}
    options = [kind for group in registry.GROUPS for kind in registry.options(group).values()]
    waiting: list[type[Any]] = [Experiment, SyntheticData, RecordedData, FolderData, *options]
    while waiting:
        if (kind := waiting.pop()) not in found:
            found[kind] = get_type_hints(kind) if is_dataclass(kind) else {}
            waiting += [inner for hint in found[kind].values() for inner in _named(hint)]
    return found


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
    fields = _classes()[kind]
    return kind(**{name: _whole(item, fields[name]) for name, item in value.items() if name != TYPE})


def on_this_machine(experiment: Experiment) -> Experiment:
    """Return a composed experiment with the number of its processes and the names of its folders, validated."""
    mappings.chosen(experiment.skeleton.mapping)  # refuses one that does not exist
    data = experiment.data
    if isinstance(data, FolderData) and data.name == "folder" and data.path:
        # Named after the user's folder, so that two do not share results.
        data.name = "folder_" + re.sub(r"[^\w.-]+", "_", Path(data.path).resolve().name)
    experiment.workers = processes_for(experiment.workers)
    if not experiment.results.strip():
        raise InvalidInput("must name a folder", where="results", received="nothing")
    # The folder of a figure is made of these three.
    require_name("name", experiment.name)
    require_name("data.name", data.name)
    require_name("scale.name", experiment.scale.name)
    return experiment
