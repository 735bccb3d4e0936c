"""One experiment, whole: what a preset in ``conf/experiment`` composes."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.clips.options import Data
from pipeline.skeleton import SourceMapping
from pipeline.studies.study import Dataset, Figure, Model, Sweep
from pipeline.validation import InvalidInput, require_range


@dataclass(kw_only=True)
class Scale:
    """How large a run is.  Presets take their sizes from here, so any preset can wear any scale."""

    name: str
    walkers: int  # at most so many people; 0: all
    view_step_deg: float
    sigma2_step_mm2: float
    performances: int  # of an action, at most; 0: all
    tracked: int  # performances that are held out and tracked; 0: all
    particles: list[int]
    clips: int  # of varied motion, at most; 0: all
    trials: int  # of every point of a sweep over limbs


@dataclass(kw_only=True)
class Experiment:
    """One figure of a paper with everything that it is made from."""

    name: str
    paper: str
    title: str
    expect: str  # what the reader should see
    scale: Scale
    data: Data
    skeleton: SourceMapping
    dataset: Dataset
    model: Model
    sweep: Sweep
    figure: Figure
    seed: int = 2007
    workers: int = 2
    results: str = "results"

    def validate(self) -> None:
        """Validate all options, before anything is computed.

        Raises
        ------
        InvalidInput
            If an option is out of range, options of different studies are mixed, or the data set holds nothing for
            this experiment (then `where` is ``"data"``).
        """
        require_range("workers", self.workers, at_least=1)
        for group, option, wanted in (
            ("model", self.model, self.figure.model),
            ("sweep", self.sweep, self.figure.sweep),
            ("dataset", self.dataset, self.model.dataset),
        ):
            if not isinstance(option, wanted):
                raise InvalidInput(
                    f"{type(self.figure).__name__} cannot be made with {type(option).__name__}",
                    where=group,
                    expected=wanted.__name__,
                )
        self.data.require(self.dataset.corpus)
        self.data.validate()
        self.dataset.validate()
        self.model.validate()
        self.sweep.validate()
        self.figure.validate(self)
        self.figure.check_sequence(self.sweep)
