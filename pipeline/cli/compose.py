"""Composition of experiments from presets and overrides."""

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
from pipeline.reading import fault_of
from pipeline.storage.provenance import FOLDERS
from pipeline.storage.sealed_folders import TYPE, canonical
from pipeline.studies import registry
from pipeline.studies.experiment import Experiment
from pipeline.validation import InvalidInput, require_choice, require_name


def compose(overrides: Sequence[str]) -> Experiment:
    """Return the experiment that the command line's overrides define.

    Raises
    ------
    InvalidInput
        If an override names no option.  `composition.in_words` converts the errors of Hydra.
    """
    return on_this_machine(composed(overrides))


def compose_figures(names: Sequence[str], common: Sequence[str]) -> list[Experiment]:
    """Return the experiments of the named figures (by default of all figures), all with the same overrides."""
    return [compose([*common, f"experiment={name}"]) for name in names or built_figures()]


def built_figures() -> list[str]:
    """Return the names of all presets of figures, in the order of the papers."""
    existing = presets()
    every = (name for paper in all_papers().values() for name in (*paper.figures, *paper.beyond))
    return [name for name in dict.fromkeys([*every, *existing]) if name in existing]


_NOT_APPLICABLE = ("no_clips_of_this_kind", "truth_not_known", "not_fetched")
"""Codes of the errors that mean that a data set lacks suitable clips, or a file, for a figure."""


def reason_without_clips(experiment: Experiment) -> str:
    """Return the reason why the data set lacks clips or a file for an experiment; empty if nothing is missing."""
    try:
        experiment.validate()
    except InvalidInput as error:
        if error.code in _NOT_APPLICABLE:
            return str(error)
    return ""


def order(experiment: Experiment) -> list[Any]:
    """Return the sort key of a figure: its subject, its origin (a paper or this project), its paper, and its cost.

    Figures are sorted by subject; within a subject the papers' figures precede our own; then by paper and cost.
    """
    papers = all_papers()
    paper = papers[experiment.paper]
    subject = min(other.order for other in papers.values() if other.subject == paper.subject)
    return [subject, experiment.name in paper.beyond, paper.order, experiment.cost_s, experiment.name]


def _whole(value: Any, hint: Any = Experiment) -> Any:
    """Return options built from their canonical JSON form, which may contain option names of an earlier version."""
    if isinstance(value, list):
        return [_whole(item, hint) for item in value]
    if not isinstance(value, dict):
        return value
    if TYPE not in value:
        return {name: _whole(item, hint) for name, item in value.items()}
    earlier = earlier_names()
    if (class_name := earlier.todays_class(value[TYPE])) == TEXT:
        return value["name"]
    named = (kind for kind in _classes() if kind.__name__ == class_name)
    kind = next(kind for kind in named if issubclass(kind, _named(hint)))
    if issubclass(kind, Enum):
        return kind[earlier.todays_choice(kind, value["name"])]
    hints = _classes()[kind]
    options = earlier.todays_options(kind, {name: item for name, item in value.items() if name != TYPE})
    return kind(**{name: _whole(item, hints[name]) for name, item in options.items()})


def with_options(experiment: Experiment, kept: Mapping[str, Any]) -> Experiment:
    """Return an experiment with the options in a published figure's manifest, under their current names.

    Folders are those of this machine; name and paper are those of the preset.

    Raises
    ------
    InvalidInput
        If this version lacks one of the options.
    """
    try:
        restored = _whole({**canonical(experiment), **kept})
    except InvalidInput:
        raise
    except (KeyError, StopIteration, TypeError, AttributeError, ValueError) as error:
        what = "this version lacks options of the archive"
        raise InvalidInput(what, experiment.name, received=fault_of(error), code="other_version") from error
    for name in FOLDERS & vars(restored.data).keys():
        setattr(restored.data, name, getattr(experiment.data, name))
    local = {name: getattr(experiment, name) for name in ("name", "paper", "results", "workers")}
    return replace(restored, **local)


def _named(hint: Any) -> tuple[type[Any], ...]:
    """Return the classes that a type hint contains."""
    return tuple(part for part in (hint, *get_args(hint)) if isinstance(part, type))


def _classes() -> dict[type[Any], dict[str, Any]]:
    return _classes_with(plugins.edition())


@cache
def _classes_with(_: object) -> dict[type[Any], dict[str, Any]]:
    """Return all classes of options, with the types of their fields."""
    waiting: list[type[Any]] = [Experiment, *DATA_SETS.values()]
    waiting += [kind for group in registry.GROUPS for kind in registry.options(group).values()]
    classes: dict[type[Any], dict[str, Any]] = {}
    for kind in waiting:  # the list grows by the classes of the fields
        if kind not in classes:
            classes[kind] = get_type_hints(kind) if is_dataclass(kind) else {}
            waiting += [inner for hint in classes[kind].values() for inner in _named(hint)]
    return classes


def on_this_machine(experiment: Experiment) -> Experiment:
    """Return an experiment adapted to this machine, after validation of its paper, skeleton mapping and folder names.

    The number of processes is at most the number of cores.
    """
    mappings.chosen(experiment.skeleton.mapping)  # raises for an unknown mapping
    require_choice("paper", experiment.paper, list(all_papers()))
    data = experiment.data
    if isinstance(data, FolderData):
        if data.name == "folder" and data.path:
            # The name contains that of the user's folder, so that two folders do not share results.
            data.name = "folder_" + re.sub(r"[^\w.-]+", "_", Path(data.path).resolve().name)
        elif data.name != "folder" and data.name in plugins.conf_files("data"):
            raise InvalidInput(
                "must not be the name of another data set",
                "data.name",
                received=data.name,
                code="name_of_other_data",
            )
    experiment.workers = processes_for(experiment.workers)
    if not experiment.results.strip() or experiment.results.startswith(
        "~"
    ):  # which a shell leaves in an option
        received = experiment.results.strip() or "nothing"
        raise InvalidInput(
            "must name a folder for the results", "results", received=received, code="no_folder_named"
        )
    # These three names form the path of the figure's folder.
    require_name("name", experiment.name)
    require_name("data.name", data.name)
    require_name("scale.name", experiment.scale.name)
    return experiment
