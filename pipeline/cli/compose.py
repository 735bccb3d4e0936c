"""Experiments from presets and overrides."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass, replace
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_type_hints

from pipeline import mappings, plugins
from pipeline.cli.composition import composed
from pipeline.cli.earlier_names import TEXT, earlier_names
from pipeline.cli.presets import presets
from pipeline.ingestion.data import DATA_SETS, FolderData
from pipeline.papers import all_papers
from pipeline.processes import processes_for
from pipeline.storage.provenance import FOLDERS
from pipeline.storage.sealed_folders import TYPE, canonical
from pipeline.studies import registry
from pipeline.studies.experiment import Experiment
from pipeline.validation import InvalidInput, require_choice, require_name


def compose(overrides: Sequence[str]) -> Experiment:
    """Return the experiment that these overrides name, as on the command line.

    Raises
    ------
    InvalidInput
        If an override names no option.  Hydra's own errors are put into words by `composition.in_words`.
    """
    return on_this_machine(composed(overrides))


def compose_figures(names: Sequence[str], common: Sequence[str]) -> list[Experiment]:
    """Return the experiments of figures, by default of all in the papers' order, with the same overrides."""
    return [compose([*common, f"experiment={name}"]) for name in names or built_figures()]


def built_figures() -> list[str]:
    """Return the presets that exist, in the papers' order."""
    existing = presets()
    every = (name for paper in all_papers().values() for name in (*paper.figures, *paper.beyond))
    return [name for name in dict.fromkeys([*every, *existing]) if name in existing]


_NOT_APPLICABLE = ("no_clips_of_this_kind", "truth_not_known", "not_fetched")
"""Codes of data sets that do not have what an experiment needs, and of a further file that is not here."""


def lacking(experiment: Experiment) -> str:
    """Return why the data set has no clips for this experiment, or a file of it is not here; empty otherwise."""
    try:
        experiment.validate()
    except InvalidInput as error:
        if error.code in _NOT_APPLICABLE:
            return str(error)
    return ""


def order(experiment: Experiment) -> list[Any]:
    """Return the place of a figure among others.

    Figures go by subject, on each those of the papers before our own, by paper, the short before the long.
    """
    known = all_papers()
    paper = known[experiment.paper]
    subject = min(one.order for one in known.values() if one.subject == paper.subject)
    return [subject, experiment.name in paper.beyond, paper.order, experiment.cost_s, experiment.name]


def _whole(value: Any, hint: Any = Experiment) -> Any:
    """Return the options whose canonical form this is, with names of this or an earlier version."""
    if isinstance(value, list):
        return [_whole(item, hint) for item in value]
    if not isinstance(value, dict):
        return value
    if TYPE not in value:
        return {name: _whole(item, hint) for name, item in value.items()}
    earlier = earlier_names()
    if (of := earlier.todays_class(value[TYPE])) == TEXT:
        return value["name"]
    named = (kind for kind in _classes() if kind.__name__ == of)
    kind = next(kind for kind in named if issubclass(kind, _named(hint)))
    if issubclass(kind, Enum):
        return kind[earlier.todays_choice(kind, value["name"])]
    hints = _classes()[kind]
    options = earlier.todays_options(kind, {name: item for name, item in value.items() if name != TYPE})
    return kind(**{name: _whole(item, hints[name]) for name, item in options.items()})


def with_options(experiment: Experiment, kept: Mapping[str, Any]) -> Experiment:
    """Return an experiment with the options that a published figure's manifest keeps, by today's names.

    Folders are as they are here, name and paper those of the preset.

    Raises
    ------
    InvalidInput
        If this version does not have one of the options.
    """
    try:
        found = _whole({**canonical(experiment), **kept})
    except InvalidInput:
        raise
    except (KeyError, StopIteration, TypeError, AttributeError, ValueError) as error:
        what = "options are not those of this version"
        raise InvalidInput(what, experiment.name, received=error, code="other_version") from error
    for name in FOLDERS & vars(found.data).keys():
        setattr(found.data, name, getattr(experiment.data, name))
    here = {name: getattr(experiment, name) for name in ("name", "paper", "results", "workers")}
    return replace(found, **here)


def _named(hint: Any) -> tuple[type[Any], ...]:
    """Return the classes that a type hint names."""
    return tuple(part for part in (hint, *get_args(hint)) if isinstance(part, type))


def _classes() -> dict[type[Any], dict[str, Any]]:
    return _classes_with(plugins.edition())


@cache
def _classes_with(_: object) -> dict[type[Any], dict[str, Any]]:
    """Return the classes of all options, with the types of their fields."""
    waiting: list[type[Any]] = [Experiment, *DATA_SETS.values()]
    waiting += [kind for group in registry.GROUPS for kind in registry.options(group).values()]
    found: dict[type[Any], dict[str, Any]] = {}
    for kind in waiting:  # which grows by the classes of the fields
        if kind not in found:
            found[kind] = get_type_hints(kind) if is_dataclass(kind) else {}
            waiting += [inner for hint in found[kind].values() for inner in _named(hint)]
    return found


def on_this_machine(experiment: Experiment) -> Experiment:
    """Return a composed experiment with the number of its processes and the names of its folders, validated."""
    mappings.chosen(experiment.skeleton.mapping)  # refuses one that does not exist
    require_choice("paper", experiment.paper, list(all_papers()))
    data = experiment.data
    if isinstance(data, FolderData):
        if data.name == "folder" and data.path:
            # Named after the user's folder, so that two do not share results.
            data.name = "folder_" + re.sub(r"[^\w.-]+", "_", Path(data.path).resolve().name)
        elif data.name != "folder" and data.name in plugins.conf_files("data"):
            raise InvalidInput(
                "must not be that of another data set",
                "data.name",
                received=data.name,
                code="name_of_other_data",
            )
    experiment.workers = processes_for(experiment.workers)
    if not experiment.results.strip() or experiment.results.startswith(
        "~"
    ):  # which a shell leaves in an option
        received = experiment.results.strip() or "nothing"
        raise InvalidInput("must name a folder", "results", received=received, code="no_folder_named")
    # The folder of a figure is made of these three.
    require_name("name", experiment.name)
    require_name("data.name", data.name)
    require_name("scale.name", experiment.scale.name)
    return experiment
