"""Registry of all studies, from the package itself and from plug-ins."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipeline import plugins
from pipeline.studies import actions, evaluation, limbs, measures, walks
from pipeline.studies.study import NoSweep, Study
from pipeline.validation import InvalidInput

STUDIES: tuple[Study, ...] = (walks.STUDY, actions.STUDY, limbs.STUDY)
"""Studies that the package itself defines."""

GROUPS = ("dataset", "model", "sweep", "figure")
"""Stages of an experiment for which studies define option classes: dataset, model, sweep and figure."""


def studies() -> tuple[Study, ...]:
    """Return the studies of the package, followed by the studies of plug-ins."""
    added = plugins.contributions("studies")
    for origin, study in added:
        if not isinstance(study, Study):
            raise InvalidInput(
                "studies must be values of the class Study",
                origin.name,
                received=type(study).__name__,
                code="wrong_type",
            )
    return (*STUDIES, *(study for _, study in added))


def all_measures() -> evaluation.Registry:
    """Return the measures of all studies, by name."""
    return evaluation.registry(measures, *(study.measures for study in studies() if study.measures))


def options(group: str) -> Mapping[str, type[Any]]:
    """Return all option classes of one stage, from all studies, by their command-line names.

    Raises
    ------
    InvalidInput
        If two studies use the same name.
    """
    classes: dict[str, type[Any]] = {"none": NoSweep} if group == "sweep" else {}
    for study in studies():
        for word, kind in getattr(study, f"{group}s").items():
            if word in classes:
                raise InvalidInput(
                    f"two studies define the {group} {word!r}", study.name, code="duplicate_name"
                )
            classes[word] = kind
    return classes
