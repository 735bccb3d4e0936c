"""The experiment that a preset in ``conf/experiment`` composes."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path

from pipeline.clips.options import Data, Skeleton
from pipeline.processes import usable_cores
from pipeline.studies.study import Dataset, Figure, Model, Sweep
from pipeline.validation import InvalidInput, Options, require_range


class Scale(Options):
    """Sizes of a run, from which any preset takes those that it uses."""

    name: str  # `smoke` or `full`
    walkers: int  # most people; 0: all
    view_step_deg: float  # between views of walkers
    sigma2_step_mm2: float  # between noise variances
    performances: int  # most performances of an action; 0: all
    tracked: int  # performances that are held out and tracked; 0: all
    particles: list[int]  # of each filter, one track to each number
    clips: int  # most clips of varied motion; 0: all
    populations: int  # further synthetic populations for intervals; 0: none
    trials: int  # trials for every value of a sweep over limbs


class Experiment(Options):
    """A figure of a paper, with all options of the stages that make it."""

    name: str  # of the figure, of its Make target and of its folder of results
    paper: str  # its key, as in `conf/paper`
    title: str  # in captions
    expect: str  # what the reader should see, a template of `captions.filled_caption`
    scale: Scale
    data: Data
    dataset: Dataset
    model: Model
    sweep: Sweep
    figure: Figure
    cost_s: float  # processor time at full scale, about: short before long, and how long is left
    skeleton: Skeleton = Skeleton()
    seed: int = 2007  # of all random numbers
    workers: int = field(
        default_factory=usable_cores
    )  # processes at a time; more are as many as there are cores
    results: str = "results"  # folder of results
    plugins: list[str] = []  # Python files that add methods, studies or claims

    @property
    def published_in(self) -> Path:
        """Folder of the figures of this data set and scale, as their presets have them."""
        return Path(self.results) / self.data.name / self.scale.name

    def validate(self) -> None:
        """Validate all options.

        Raises
        ------
        InvalidInput
            If an option is out of range, options do not belong together, or the data set has no clips for this
            experiment (then `code` is ``"no_clips_of_this_kind"`` or ``"truth_not_known"``), or a further file of the
            sweep is not on this machine (``"not_fetched"``).
        """
        require_range("workers", self.workers, at_least=1)
        require_range("cost_s", self.cost_s, above=0)
        for group, option, wanted in (
            ("model", self.model, self.figure.model),
            ("sweep", self.sweep, self.figure.sweep),
            ("dataset", self.dataset, self.model.dataset),
        ):
            if not isinstance(option, wanted):
                raise InvalidInput(
                    f"{type(self.figure).__name__} cannot be made with {type(option).__name__}",
                    group,
                    wanted.__name__,
                    code="cannot_combine",
                    option=type(option).__name__,
                    wanted=wanted.__name__,
                )
        self.data.require(self.dataset.corpus)
        self.data.validate()
        self.dataset.validate()
        self.model.validate()
        self.sweep.validate()
        self.sweep.further_files(self.data)
        self.figure.validate(self)
        self.figure.check_sequence(self.sweep)
