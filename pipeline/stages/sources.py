"""Source code that a figure depends on: modules of the package, of plug-ins and of users' files."""

from __future__ import annotations

import shutil
from pathlib import Path

from pipeline.plugins import modules_of_files
from pipeline.storage import provenance
from pipeline.storage.source_code import sources_digest
from pipeline.studies.experiment import Experiment


def used_plugins(experiment: Experiment, folder: Path) -> list[dict[str, str]]:
    """Return the plug-ins that a figure used, and copy the users' files into the figure's folder."""
    options = (experiment.dataset, experiment.model, experiment.sweep, experiment.figure)
    modules = [*(type(option).__module__ for option in options), *experiment.sweep.modules()]
    for file in experiment.plugins:
        shutil.copyfile(file, folder / f"plugin_{Path(file).name}")
    return provenance.used_plugins(modules, experiment.plugins)


def figure_code(experiment: Experiment) -> str:
    """Return the digest of the source code that computes the tables, picture and recording of a figure."""
    drawing = ("pipeline.pictures.picture", "pipeline.recordings.recording")
    modules = (*experiment.sweep.modules(), *modules_of_files(experiment.plugins))
    return sources_digest([type(experiment.figure).__module__, *modules, *drawing])
