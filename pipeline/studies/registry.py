"""The list of studies: the only file that names them all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipeline.studies import actions, evaluation, keypoints, limbs, measures, walks
from pipeline.studies.study import NoSweep, Study

STUDIES: tuple[Study, ...] = (walks.STUDY, actions.STUDY, limbs.STUDY, keypoints.STUDY)

GROUPS = ("dataset", "model", "sweep", "figure")
"""Groups of options that the studies fill."""


MEASURES = evaluation.registry(measures, *(study.measures for study in STUDIES if study.measures))
"""The measures of all studies, by name."""


def options(group: str) -> Mapping[str, type[Any]]:
    """Return the option classes of a group by the word that chooses them, over all studies."""
    found: dict[str, type[Any]] = {"none": NoSweep} if group == "sweep" else {}
    for study in STUDIES:
        found |= getattr(study, f"{group}s")
    return found
