"""Recipes: what figures are made of, in the user's cache.

Composing experiments loads what every study stands on.  Whether figures are current, and which of them a data set has
clips for, is known from their recipes without it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.cli.presets import presets
from pipeline.storage import user_cache
from pipeline.storage.sealed_folders import canonical
from pipeline.storage.store import Plan
from pipeline.validation import InvalidInput

if TYPE_CHECKING:
    from pipeline.studies.experiment import Experiment


@dataclass(frozen=True)
class Recipe:
    """What a figure is made of.

    Attributes
    ----------
    name, results, data, scale : str
        Of the figure, its folder of results, its data set, its scale.
    place : list
        Its place among others: by subject, on each the figures of the papers before those of our own, by paper, the
        short before the long.
    lacking : str
        Why the data set has no clips for it; empty if it has.
    steps : list of dict, optional
        What its stages are made of, as `Plan` notes it, and options and sources of the figure; None if that depends
        on recordings, which may change, or is refused.
    """

    name: str
    results: str
    data: str
    scale: str
    place: list[Any]
    lacking: str
    steps: list[dict[str, Any]] | None

    @property
    def published_in(self) -> Path:
        """Folder of the figures of this data set and scale, as their presets have them."""
        return Path(self.results) / self.data / self.scale


def recipes(names: Sequence[str], common: Sequence[str], *, steps: bool = False) -> list[Recipe]:
    """Return the recipes of figures, by default of all in the papers' order.

    Parameters
    ----------
    names : sequence of str
    common : sequence of str
        Overrides.
    steps : bool
        Also of what depends on recordings: they are read.

    Raises
    ------
    InvalidInput
        If an override names no option, or with `steps` the data set has no clips for a figure.
    """
    made: list[Recipe] = []

    def composed(name: str) -> Experiment:
        from pipeline.cli.compose import compose

        return compose([*common, f"experiment={name}"])

    def plain() -> list[dict[str, Any]] | None:
        from pipeline.ingestion.data import FolderData

        experiments = [composed(name) for name in names or built_figures()]
        made.extend(recipe(one, steps=False) for one in experiments)
        # The user's folder is named as it is called here and now.
        return None if any(isinstance(one.data, FolderData) for one in experiments) else [*map(asdict, made)]

    key = ("recipes", *names, "of", *common, os.environ.get("MOCAP_MIRROR"))
    kept = user_cache.remembered(key, plain)
    found = made or [Recipe(**one) for one in kept]
    return [
        recipe(composed(one.name)) if steps and one.steps is None and (names or not one.lacking) else one
        for one in found
    ]


def built_figures() -> list[str]:
    """Return the presets that exist, in the papers' order."""
    from pipeline.papers import PAPERS

    there = set(presets())
    return [name for paper in PAPERS.values() for name in (*paper.figures, *paper.beyond) if name in there]


def recipe(experiment: Experiment, *, steps: bool = True) -> Recipe:
    """Return the recipe of an experiment; without `steps` that of its stages only if it depends on options alone.

    Raises
    ------
    InvalidInput
        With `steps`, if the data set has no clips for it, or an option cannot be kept.
    """
    from pipeline.clips.options import SyntheticPeople
    from pipeline.stages import chain
    from pipeline.stages.figure import figure_code

    found: list[dict[str, Any]] | None = None
    if steps or isinstance(experiment.data, SyntheticPeople):
        with nullcontext() if steps else suppress(InvalidInput):
            chain.run(experiment, plan := Plan(Path(experiment.results), {}))
            figure = {"options": canonical(experiment.figure), "code": figure_code(experiment)}
            found = [*plan.steps, figure]
    return Recipe(
        name=experiment.name,
        results=experiment.results,
        data=experiment.data.name,
        scale=experiment.scale.name,
        place=_place(experiment),
        lacking=lacking(experiment),
        steps=found,
    )


def lacking(experiment: Experiment) -> str:
    """Return why the data set has no clips for this experiment; empty if it has."""
    try:
        experiment.validate()
    except InvalidInput as error:
        if error.where == "data":
            return str(error)
    return ""


def _place(experiment: Experiment) -> list[Any]:
    from pipeline.papers import PAPERS

    if experiment.paper not in PAPERS:
        return [max(one.order for one in PAPERS.values()) + 1, True, 0, experiment.cost_s, experiment.name]
    of = PAPERS[experiment.paper]
    subject = min(one.order for one in PAPERS.values() if one.subject == of.subject)
    return [subject, experiment.name in of.beyond, of.order, experiment.cost_s, experiment.name]
