"""Base classes for the options of a study, whose methods compute the stages of an experiment.

A study (walks, actions, limbs, …) is a folder next to this file.  Its options are plain dataclasses:
``sweep.trials=10`` on the command line sets the field `trials` of the `Sweep`.  The stage of the same name calls the
option's method:

=========  ======================  ==========================================================
stage      option                  method
=========  ======================  ==========================================================
dataset    `Dataset`               ``build(clips, workers)``
model      `Model`                 ``learn(dataset, workers)``
sweep      `Sweep`                 ``measure(inputs)``
figure     `Figure`                ``tables(inputs)``, ``charts``, then ``draw`` and ``record``
=========  ======================  ==========================================================

Each method returns a frozen dataclass of arrays (a figure: DataFrames), whose type the store takes from the return
annotation.  Options are validated by ``validate`` before anything runs.  Options use degrees, with units in the names.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import StrEnum
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic, Protocol, TypeAlias, TypeVar

import numpy as np

from pipeline.charts import Sheet
from pipeline.clips.kinds import Corpus, Reducer
from pipeline.clips.options import Data
from pipeline.scenes import Columns, Notes, Rows
from pipeline.seeding import derive_generator
from pipeline.validation import (
    Distinct,
    Finite,
    InvalidInput,
    Options,
    Positive,
    bounded,
    require_bounds,
    require_range,
)

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.pictures.picture import Picture as Picture
    from pipeline.recordings import Recording

    # Begins the recording of a figure; takes further text of its description, and a timeline other than time.
    Recorder = Callable[..., Recording]
else:  # only annotations name matplotlib and rerun, so figures do not import them
    Picture = Recorder = Any

ClipsT = TypeVar("ClipsT")
DatasetT = TypeVar("DatasetT")
ModelT = TypeVar("ModelT")
Tables: TypeAlias = "dict[str, pd.DataFrame]"
"""Tables of a figure, by file name without extension."""

MAX_VALUES = 100_000
"""Largest number of values in an equally spaced grid."""


class Grid(Options):
    """Equally spaced values from `start` to at most `stop`, at a distance of `step`.

    Examples
    --------
    >>> Grid(start=-90, stop=90, step=45).values("view")
    array([-90., -45.,   0.,  45.,  90.])
    """

    start: Finite  # first value
    stop: Finite  # last value, if a whole number of steps reaches it
    step: Positive  # distance between values

    def values(self, name: str) -> np.ndarray:
        """Return the values (N,) of the grid. Raises InvalidInput if `start`, `stop` or `step` is out of range."""
        require_bounds(name, self)
        require_range(f"{name}.stop", self.stop, above=self.start)
        count = np.floor((self.stop - self.start) / self.step + 1e-9) + 1
        require_range(f"the number of values of {name}", count, at_most=MAX_VALUES)
        return self.start + self.step * np.arange(int(count), dtype=float)


Swept = Annotated[Grid, lambda name, grid: grid.values(name)]
"""Option type of a grid, which is validated by computing its values."""


def scaled(**fields: str | float | Mapping[str, float]) -> Any:
    """Return a dataclass field whose default value depends on the scale of the run.

    Parameters
    ----------
    **fields : str, number or mapping of str to number
        ``value="trials"``: the option is ``scale.trials``.  ``value={"full": 16, "smoke": 2}``: the option has a
        size for each scale.  Otherwise the option is a `Grid`, and the keywords are its fields: each a number, the
        name of a field of the scale, or a size for each scale.

    Examples
    --------
    ``trials: int = scaled(value="trials")``, ``partners: int = scaled(value={"full": 16, "smoke": 2})`` and
    ``view_angle_deg: Grid = scaled(start=-90, stop=90, step="view_step_deg")``.
    """
    return field(metadata={"scale": fields})


class Represents(Protocol):
    """Dataset options with which clips are represented one by one, so that joint positions need not be stored."""

    def represent(self, streaming: Callable[[Reducer], tuple[Any, list[Any]]], /) -> Any:
        """Return the clips with their samples but without their joint positions."""


class Dataset(Options, ABC):
    """Options of the dataset stage, which computes samples from clips."""

    corpus: ClassVar[Corpus]
    """Kind of clips from which the samples are computed."""

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_bounds("dataset", self)

    def shared(self) -> Represents | None:
        """Return dataset options with which clips are represented one by one; None if clips must be stored."""
        return None

    @abstractmethod
    def build(self, clips: Any, *, workers: int) -> Any:
        """Return the samples as a frozen dataclass, with clip names, data sources and a description in words."""


class Model(Options, ABC):
    """Options of the model stage, which learns from the samples."""

    dataset: ClassVar[type[Dataset]]
    """Class of the dataset options from whose samples the model is learnt."""
    published: ClassVar[bool] = False
    """True if the model is published in ``arrays.npz``, next to the results of the sweep."""

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_bounds("model", self)

    @abstractmethod
    def learn(self, dataset: Any, *, workers: int) -> Any:
        """Return the model as a frozen dataclass, with a description in words."""


@dataclass(frozen=True)
class SweepInputs(Generic[ClipsT, DatasetT, ModelT]):
    """Inputs from which a sweep is computed: clips, dataset, model, options and seed.

    Attributes
    ----------
    clips, dataset, model : dataclass
        Results of the earlier stages.
    model_options : Model
        Options of the model, for sweeps that learn it again from fewer samples.
    workers : int
        Number of threads.
    seed : int
    files : mapping of str to Path
        Further files, by the names of `Sweep.further_files`.
    """

    clips: ClipsT
    dataset: DatasetT
    model: ModelT
    model_options: Any
    workers: int
    seed: int
    files: Mapping[str, Path] = field(default_factory=dict)

    def generator(self, purpose: str = "sweep") -> np.random.Generator:
        """Return the random generator for a sweep, or for one purpose within the sweep."""
        return derive_generator(self.seed, purpose)


class Sweep(Options, ABC):
    """Options of the sweep stage, which measures results for each value of a varied quantity."""

    draws_random_numbers: ClassVar[bool] = False
    """True if the result of the sweep depends on the random seed."""

    @property
    def reads_clips(self) -> bool:
        """True if the sweep reads the clips, in addition to the dataset and the model."""
        return False

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_bounds("sweep", self)

    def modules(self) -> list[str]:
        """Return the names of further modules on which the result depends, such as those of selected methods."""
        return []

    def further_files(self, data: Data) -> dict[str, Path]:
        """Return the data files that the sweep reads, by name; their contents are part of the cache key.

        Raises
        ------
        InvalidInput
            If a file is not on this machine.  Its `code` is ``"not_fetched"``: a run of all figures skips this figure.
        """
        return {}

    def with_methods(self, names: Sequence[str]) -> Sweep:
        """Return a copy of the sweep in which the named methods are compared too, if the sweep compares methods."""
        return self

    def of_populations(self) -> Sweep:
        """Return the sweep for additional synthetic populations, which may measure less than this sweep."""
        return self

    def population_parts(self) -> list[Sweep]:
        """Return the sweeps that together measure one additional synthetic population.

        Figures that need fewer measurements run only the first sweeps.
        """
        return [self.of_populations()]

    def joined(self, parts: Sequence[Any]) -> Any:
        """Return the measurements of one additional synthetic population, joined from those of its parts."""
        return parts[0]

    @abstractmethod
    def measure(self, inputs: SweepInputs) -> Any:
        """Return the measurements of the sweep as a frozen dataclass."""


def stack(parts: Sequence[Any]) -> Any:
    """Return a dataclass with the arrays of several dataclasses, stacked along a new first axis."""
    kind = type(parts[0])
    return kind(**{f.name: np.stack([getattr(part, f.name) for part in parts]) for f in fields(kind)})


def part(stacked: Any, number: int) -> Any:
    """Return a dataclass with the arrays at one index of the first axis, the inverse of `stack`."""
    return type(stacked)(**{f.name: getattr(stacked, f.name)[number] for f in fields(stacked)})


@dataclass(frozen=True)
class NoResult:
    """Empty result of the sweep stage, for a figure that has no sweep."""


class NoSweep(Sweep):
    """Options of a figure that shows the model itself and has no sweep."""

    def measure(self, inputs: SweepInputs) -> NoResult:
        """Return an empty result, because the figure has no sweep."""
        return NoResult()


@dataclass(frozen=True)
class Traits:
    """Properties of a figure that other stages read, such as the timeline of its recording.

    Attributes
    ----------
    over_people : tuple of str
        Tables that are computed again for every further population.
    ranked_by : (str, str)
        Table and column whose mean absolute value, for the first method, ranks populations; the median one is shown.
    abscissa : str
        Column of ``table`` that is the abscissa of ranges over populations; required if `over_people` has ``table``.
    rows_of : mapping of str to str
        Column of ``table`` → column of the populations' rows that it averages, if the names differ.
    sequence : str
        Name of the sweep's grid that is the recording's timeline, in whole numbers; empty for none.
    timeline : str
        Timeline of a recording that has only charts.
    population_parts : int
        Number of parts of the sweep (`Sweep.population_parts`) that tables of further populations read.
    in_light_archives : bool
        False for a figure that shows a motion whose terms do not allow copies.
    """

    over_people: tuple[str, ...] = ()
    ranked_by: tuple[str, str] = ("table", "absolute_error_mm2")
    abscissa: str = ""
    rows_of: Mapping[str, str] = field(default_factory=dict)
    sequence: str = ""
    timeline: str = ""
    population_parts: int = 1
    in_light_archives: bool = True


class Format(StrEnum):
    """File formats in which a picture can be written."""

    svg = "svg"
    png = "png"
    pdf = "pdf"


class Figure(Options, ABC):
    """Options of the figure stage, which makes tables, a picture and recordings.

    `validate` takes the `Experiment`; the other methods take its `FigureInputs`.
    """

    model: ClassVar[type[Model]]
    """Class of the model options that the figure requires."""
    sweep: ClassVar[Any] = Sweep
    """Class of the sweep options that the figure requires."""
    traits: ClassVar[Traits] = Traits()
    """Properties of the figure that other stages read."""

    picture: bool = True  # draw the picture
    recording: bool = True  # write the Rerun recording
    formats: Distinct[Format] = [Format.svg, Format.png]  # files of the picture
    width_mm: Annotated[float, bounded(at_least=0, at_most=1000)] = (
        0.0  # width of the picture; 0: that of its panels
    )
    dpi: Annotated[int, bounded(at_least=50, at_most=2400)] = 200  # resolution of the PNG
    references: bool | None = (
        None  # marks of values that the paper prints; null: except on the user's own files
    )
    panels: list[str] = []  # letters of the panels that are drawn; empty: all

    def marks(self, experiment: Any) -> bool:
        """Return True if the charts show the values that the paper published."""
        return not experiment.data.of_user if self.references is None else self.references

    @property
    def printed(self) -> dict[str, Any]:
        """Options for writing the files of the picture."""
        formats = [str(each) for each in self.formats]
        return {"formats": formats, "width_mm": self.width_mm, "dpi": self.dpi, "panels": self.panels}

    def validate(self, experiment: Any) -> None:
        """Validate the options, alone and with those of other stages. Raises InvalidInput if one does not fit."""
        require_bounds("figure", self)
        if self.panels and type(self).draw is not Figure.draw:
            raise InvalidInput(
                "the picture of this figure has no panels that can be selected",
                "figure.panels",
                code="no_panels",
            )

    @abstractmethod
    def tables(self, inputs: Any) -> Tables:
        """Return the tables of the figure by file name: ``table`` and ``table_…``, with sorted rows."""

    def arrays(self, inputs: Any) -> dict[str, np.ndarray]:
        """Return arrays that the report needs in ``arrays.npz``, in addition to the results; by default none."""
        return {}

    def charts(self, inputs: Any, tables: Tables) -> Sheet:
        """Return the charts of the figure for the picture, the recording and the page; by default none."""
        return Sheet()

    def draw(self, inputs: Any, tables: Tables, picture: Picture) -> None:
        """Draw the picture of the figure; by default, it contains the charts."""
        picture.charts()

    def draws_more_than(self, sheet: Sheet) -> bool:
        """Return True if the picture shows something that the charts on the page do not show."""
        overrides = type(self).draw is not Figure.draw
        return overrides or any(chart.picture and not chart.page for chart in sheet.charts)

    def record(self, inputs: Any, tables: Tables, begin: Recorder) -> None:
        """Write the recording of the figure; by default, it shows the charts."""
        with begin(timeline=self.traits.timeline) as recording:
            recording.blueprint(Columns(Rows(*recording.plots), Notes(), shares=(2, 1)))

    def check_sequence(self, sweep: Sweep) -> None:
        """Raise InvalidInput if the grid that is the recording's timeline has values that are not whole numbers."""
        name = self.traits.sequence
        grid = getattr(sweep, name, None) if name else None
        if self.recording and isinstance(grid, Grid) and (grid.start % 1 or grid.step % 1):
            raise InvalidInput(
                "start and step must be whole numbers, because the values are the timeline of the recording;"
                " figure.recording=false omits the recording",
                f"sweep.{name}",
                received=f"start {grid.start:g}, step {grid.step:g}",
                code="not_whole",
                start=grid.start,
                step=grid.step,
            )


def stacked(parts: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return one table with the rows of several mappings from column names to entries.

    A column of a part is an array, or a single value for all rows of the part.

    Examples
    --------
    >>> stacked([{"walker": "a", "view": [0, 90]}, {"walker": "b", "view": 45}])
      walker  view
    0      a     0
    1      a    90
    2      b    45
    """
    import pandas as pd

    columns: dict[str, list[np.ndarray]] = defaultdict(list)
    for part in parts:
        # Texts as objects: a column then stores each text once.
        cells = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(c, object) if isinstance(c, str) else c) for c in part.values())
        )
        for name, column in zip(part, cells, strict=True):
            columns[name].append(column)
    return pd.DataFrame({name: np.concatenate(column) for name, column in columns.items()})


@dataclass(frozen=True)
class Study:
    """Study: option classes for datasets, models, sweeps and figures, by their command-line names.

    Attributes
    ----------
    name : str
        Name of the folder.
    datasets, models, sweeps, figures : dict
        Option classes by name: ``sweep=known_view`` chooses ``sweeps["known_view"]``.
    measures : module, optional
        Measures that the claims of its papers use.
    """

    name: str
    datasets: dict[str, type[Dataset]] = field(default_factory=dict)
    models: dict[str, type[Model]] = field(default_factory=dict)
    sweeps: dict[str, type[Sweep]] = field(default_factory=dict)
    figures: dict[str, type[Figure]] = field(default_factory=dict)
    measures: ModuleType | None = None
