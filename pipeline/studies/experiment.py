"""Options of an experiment, which a preset in ``conf/experiment`` sets."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path

from pipeline.clips.options import Data, Skeleton
from pipeline.processes import usable_cores
from pipeline.studies.study import Dataset, Figure, Model, Sweep
from pipeline.validation import InvalidInput, Options, require_range


class Scale(Options):
    """Sample sizes and grid steps that differ between a small run and a full run of an experiment."""

    name: str  # `smoke` or `full`
    walkers: int  # largest number of people; 0: all
    view_step_deg: float  # step between views of walkers
    sigma2_step_mm2: float  # step between noise variances
    performances: int  # largest number of performances of an action; 0: all
    tracked: int  # performances that are held out and tracked; 0: all
    particles: list[int]  # particles of a filter; one track for each number
    clips: int  # largest number of clips of varied motion; 0: all
    populations: int  # further synthetic populations for intervals; 0: none
    trials: int  # trials for every value of a sweep over limbs


class Experiment(Options):
    """Options of one figure of a paper, and of all stages that compute the figure."""

    name: str  # name of the figure, of its Make target and of its results folder
    paper: str  # key of the paper in `conf/paper`
    title: str  # title in captions
    expect: str  # text on the expected result, a template of `captions.filled_caption`
    scale: Scale
    data: Data
    dataset: Dataset
    model: Model
    sweep: Sweep
    figure: Figure
    cost_s: float  # approximate processor time at full scale, for the order of jobs and the time left
    skeleton: Skeleton = Skeleton()
    seed: int = 2007  # seed of all random numbers
    workers: int = field(default_factory=usable_cores)  # parallel processes, at most one for each core
    results: str = "results"  # folder of results
    plugins: list[str] = []  # Python files that add methods, studies or claims

    @property
    def published_in(self) -> Path:
        """Folder of published figures for this data set and scale."""
        return Path(self.results) / self.data.name / self.scale.name

    def validate(self) -> None:
        """Validate all options of the experiment.

        Raises
        ------
        InvalidInput
            If an option is out of range or options do not fit together; if the data set has no clips for this
            experiment (`code` is ``"no_clips_of_this_kind"`` or ``"truth_not_known"``); if a further file of the
            sweep is not on this machine (``"not_fetched"``).
        """
        require_range("workers", self.workers, at_least=1)
        require_range("cost_s", self.cost_s, above=0)
        for group, option, required in (
            ("model", self.model, self.figure.model),
            ("sweep", self.sweep, self.figure.sweep),
            ("dataset", self.dataset, self.model.dataset),
        ):
            if not isinstance(option, required):
                raise InvalidInput(
                    f"the figure {type(self.figure).__name__} cannot use {type(option).__name__} as {group}",
                    group,
                    required.__name__,
                    code="cannot_combine",
                    option=type(option).__name__,
                    wanted=required.__name__,
                )
        self.data.require(self.dataset.corpus)
        self.data.validate()
        self.dataset.validate()
        self.model.validate()
        self.sweep.validate()
        self.sweep.further_files(self.data)
        self.figure.validate(self)
        self.figure.check_sequence(self.sweep)
