"""What a study consists of: options that do the work of each stage.

A study (walks, actions, limbs, …) is a folder beside this file.  Its options are plain dataclasses; what the user
writes as ``sweep.trials=10`` is the field `trials` of the chosen `Sweep`, and the stage of the same name calls the
option's method:

=========  ======================  ==========================================================
stage      option                  method
=========  ======================  ==========================================================
dataset    `Dataset`               ``build(clips, workers)``
model      `Model`                 ``learn(dataset, workers)``
sweep      `Sweep`                 ``measure(inputs)``
figure     `Figure`                ``tables(inputs)``, then ``draw`` and ``record``
=========  ======================  ==========================================================

Each method returns a frozen dataclass of arrays (a figure: DataFrames); its return annotation tells the store how
to read the dataclass back.  Options are checked by ``validate`` before anything runs.  Degrees, not radians, are
used in options: this is what people write.  Units stand in the names.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import numpy as np

from pipeline.clips.kinds import Corpus
from pipeline.seeding import derive_generator
from pipeline.validation import InvalidInput, require_range

if TYPE_CHECKING:
    import pandas as pd

ClipsT = TypeVar("ClipsT")
DatasetT = TypeVar("DatasetT")
ModelT = TypeVar("ModelT")

MOST_VALUES = 100_000
"""A finer grid is a slip of the pen: it would fill the memory."""


@dataclass(kw_only=True)
class Grid:
    """Equally spaced values, both ends included: the stop wherever whole steps reach it.

    Examples
    --------
    >>> Grid(start=-90, stop=90, step=45).values("view")
    array([-90., -45.,   0.,  45.,  90.])
    """

    start: float
    stop: float
    step: float

    def values(self, name: str) -> np.ndarray:
        """Return the values, float64.  Raises InvalidInput, with the option's `name`, if the grid is empty."""
        for end in ("start", "stop"):
            require_range(f"{name}.{end}", getattr(self, end))
        require_range(f"{name}.step", self.step, above=0)
        require_range(f"{name}.stop", self.stop, above=self.start)
        count = np.floor((self.stop - self.start) / self.step + 1e-9) + 1
        require_range(f"the number of values of {name}", count, at_most=MOST_VALUES)
        return self.start + self.step * np.arange(int(count), dtype=float)


def scaled(**fields: str | float) -> Any:
    """Return a field whose value, or parts of whose value, the scale sets unless the user does.

    Parameters
    ----------
    **fields : str
        ``value="trials"``: the option is ``scale.trials``.  Otherwise the option is a `Grid`, and the keywords are
        its fields: numbers, or the name of a field of the scale.

    Examples
    --------
    ``trials: int = scaled(value="trials")`` and
    ``view_angle_deg: Grid = scaled(start=-90, stop=90, step="view_step_deg")``.
    """
    return field(metadata={"scale": fields})


@dataclass(kw_only=True)
class Dataset(ABC):
    """How clips become samples."""

    corpus: ClassVar[Corpus]
    """Which of a data set's corpora the samples are made of."""

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""

    @abstractmethod
    def build(self, clips: Any, *, workers: int) -> Any:
        """Return the samples: a frozen dataclass with `clip`, `source` and `words` among its fields."""


@dataclass(kw_only=True)
class Model(ABC):
    """What is learnt."""

    dataset: ClassVar[type[Dataset]]
    """From which samples."""
    published: ClassVar[bool] = False
    """Whether ``arrays.npz`` holds what is learnt, beside what the sweep measured."""

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""

    @abstractmethod
    def learn(self, dataset: Any, *, workers: int) -> Any:
        """Return what is learnt: a frozen dataclass with `words` among its fields."""


@dataclass(frozen=True)
class SweepInputs(Generic[ClipsT, DatasetT, ModelT]):
    """What a sweep measures on.

    Attributes
    ----------
    clips, dataset, model : dataclass
        What the earlier stages made.
    dataset_options, model_options : Dataset, Model
        With which options, for sweeps that learn anew from fewer samples.
    workers : int
        Threads.
    seed : int
    """

    clips: ClipsT
    dataset: DatasetT
    model: ModelT
    dataset_options: Any
    model_options: Any
    workers: int
    seed: int

    def generator(self, purpose: str = "sweep") -> np.random.Generator:
        """Return the generator of random numbers of this sweep, or of a named part of it."""
        return derive_generator(self.seed, purpose)


@dataclass(kw_only=True)
class Sweep(ABC):
    """What is tried on every fold."""

    draws_random_numbers: ClassVar[bool] = False
    """Whether another seed gives another result."""

    @property
    def reads_clips(self) -> bool:
        """Whether the clips themselves are needed, beside what the dataset and the model made of them."""
        return False

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""

    @abstractmethod
    def measure(self, inputs: SweepInputs) -> Any:
        """Return what was measured: a frozen dataclass."""


@dataclass(frozen=True)
class Nothing:
    """What no sweep measures."""


@dataclass(kw_only=True)
class NoSweep(Sweep):
    """No sweep: the figure shows the model itself."""

    def measure(self, inputs: SweepInputs) -> Nothing:
        """Return nothing."""
        return Nothing()


@dataclass(kw_only=True)
class Figure(ABC):
    """What is tabulated, drawn and logged.

    `validate` is given the `Experiment`, the other methods its `FigureInputs`.
    """

    model: ClassVar[type[Model]]
    """The model that this figure shows."""
    sweep: ClassVar[Any] = Sweep
    """The sweep that it shows; by default whatever sweep there is."""
    sequence: ClassVar[str] = ""
    """The grid of the sweep that is the recording's timeline, if there is one: it counts in whole numbers."""

    picture: bool = True
    recording: bool = True

    def validate(self, experiment: Any) -> None:
        """Validate the options against the rest of the experiment.  Raises InvalidInput if they do not fit."""

    @abstractmethod
    def tables(self, inputs: Any) -> dict[str, pd.DataFrame]:
        """Return the tables by file name without suffix, ``table`` and ``table_…``, sorted."""

    @abstractmethod
    def draw(self, inputs: Any, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Write the picture as ``<stem>.svg`` and ``<stem>.png``, of what the tables hold."""

    @abstractmethod
    def record(self, inputs: Any, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Write ``recording.rrd``, and further recordings, into a folder."""

    def check_sequence(self, sweep: Sweep) -> None:
        """Refuse a grid that a recording cannot count in.  Raises InvalidInput."""
        grid = getattr(sweep, self.sequence, None) if self.sequence else None
        if self.recording and isinstance(grid, Grid) and (grid.start % 1 or grid.step % 1):
            raise InvalidInput(
                "a recording counts in whole numbers",
                where=f"sweep.{self.sequence}",
                expected="whole start and step, or figure.recording=false",
                received=f"start {grid.start:g}, step {grid.step:g}",
            )


@dataclass(frozen=True)
class Study:
    """One study: its options by the words that choose them on the command line.

    Attributes
    ----------
    name : str
        Of the folder.
    datasets, models, sweeps, figures : dict
        Option classes by name: ``sweep=known_view`` chooses ``sweeps["known_view"]``.
    measures : module, optional
        What the claims of its papers measure in its tables.
    """

    name: str
    datasets: dict[str, type[Dataset]] = field(default_factory=dict)
    models: dict[str, type[Model]] = field(default_factory=dict)
    sweeps: dict[str, type[Sweep]] = field(default_factory=dict)
    figures: dict[str, type[Figure]] = field(default_factory=dict)
    measures: ModuleType | None = None
