"""List of all studies: those of the package and those that plug-ins add."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipeline import plugins
from pipeline.studies import actions, evaluation, limbs, measures, walks
from pipeline.studies.study import NoSweep, Study
from pipeline.validation import InvalidInput

STUDIES: tuple[Study, ...] = (walks.STUDY, actions.STUDY, limbs.STUDY)
"""Studies of the package."""

GROUPS = ("dataset", "model", "sweep", "figure")
"""Groups of options that the studies fill."""


def studies() -> tuple[Study, ...]:
    """Return the studies of the package, then those of plug-ins."""
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
    """Return the option classes of a group from all studies, by their names on the command line.

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
