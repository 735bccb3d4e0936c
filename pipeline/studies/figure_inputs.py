"""Results from which a figure is drawn, with the texts for its captions and recordings."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
import pandas as pd

from pipeline.clips.kinds import Clips
from pipeline.storage.typed import pack
from pipeline.studies.experiment import Experiment

DatasetT = TypeVar("DatasetT")
ModelT = TypeVar("ModelT")
SweepT = TypeVar("SweepT")

ANKLE_HEIGHT_MM = 80.0
"""Approximate height of the ankle joint above the sole, mm, used only to display people on the ground."""


@dataclass(frozen=True)
class FigureInputs(Generic[DatasetT, ModelT, SweepT]):
    """Results of all stages of an experiment, from which its figure is drawn.

    Attributes
    ----------
    experiment : Experiment
    clips : Clips
    dataset, model, sweep : dataclass
        Results of the stages of these names.
    population : int
        Number of the synthetic population; 0 for the data of the preset.
    """

    experiment: Experiment
    clips: Clips
    dataset: DatasetT
    model: ModelT
    sweep: SweepT
    population: int = 0

    @property
    def samples(self) -> list[str]:
        """Names of the samples of the data set, which are the names of their clips."""
        return [str(name) for name in getattr(self.dataset, "clip")]  # noqa: B009 - every dataset has it

    @property
    def summary(self) -> str:
        """Description of the data set, the samples and the model in one line, for captions."""
        dataset: Any = self.dataset
        model: Any = self.model
        sources = ", ".join(sorted(set(map(str, dataset.source)) - {self.experiment.data.name}))
        name = self.experiment.data.name + (f" ({sources})" if sources else "")
        return f"{name}, {dataset.words}, {model.words}{self._drawn}"

    @property
    def _drawn(self) -> str:
        """Text that names the displayed synthetic population and the reason for its choice; empty for other data."""
        if not self.population:
            return ""
        error = re.sub("_(mm2?|deg)$", "", self.experiment.figure.traits.ranked_by[1]).replace("_", " ")
        count = self.experiment.scale.populations
        return f"; of {count} populations, number {self.population}, whose {error} is the median"

    @property
    def banded(self) -> str:
        """Meaning of the bands around the curves of a chart, as a phrase for captions."""
        return "range of all populations" if self.population else "95 % interval of the mean over people"

    @property
    def caption(self) -> str:
        """First sentences of the figure's caption, with title, data and credit."""
        return " ".join(
            filter(None, (f"{self.experiment.title}. Data: {self.summary}.", self.experiment.data.credit))
        )

    def about(self, expect: str) -> str:
        """Return the description of the recording in Markdown; `expect` is its text on the expected result."""
        return "\n".join(
            [
                f"# {self.experiment.name}",
                "",
                f"**{self.experiment.title}**",
                "",
                expect,
                "",
                # A list, since the viewer cuts the cells of a table at the edge of its view.
                f"- **data**: {self.summary}",
                *([f"- **source and terms**: {credit}"] if (credit := self.experiment.data.credit) else []),
                f"- **scale**: {self.experiment.scale.name}",
                f"- **seed**: {self.experiment.seed}",
                "",
                self.experiment.dataset.corpus.world,
                "",
            ]
        )

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays of ``arrays.npz``: results of the sweep, the model if it is published, and the sample names.

        Data frames of the sweep are left out, because the tables contain them.
        """
        learnt = pack(self.model)[0] if self.experiment.model.published else {}
        names = {self.experiment.dataset.corpus.sample: np.array(self.samples)}
        measured = {
            name: part for name, part in vars(self.sweep).items() if not isinstance(part, pd.DataFrame)
        }
        return {**learnt, **pack(measured)[0], **names}


def tidy(columns: pd.DataFrame | list[Any] | Mapping[str, Any], *, by: Sequence[str]) -> pd.DataFrame:
    """Return a table whose rows are sorted by some of the columns.

    Parameters
    ----------
    columns : DataFrame, list of rows, or mapping of str to array-like
        Values of a mapping are broadcast to one shape and flattened.
    by : sequence of str
        Columns by which the rows are sorted, stably.
    """
    if isinstance(columns, Mapping):
        cells = np.broadcast_arrays(*map(np.asarray, columns.values()))
        columns = {name: values.ravel() for name, values in zip(columns, cells, strict=True)}
    frame = pd.DataFrame(columns)
    # Sorted rows are not copied: there may be millions.
    if not by or (
        frame.index.equals(pd.RangeIndex(len(frame)))
        and pd.MultiIndex.from_frame(frame[list(by)]).is_monotonic_increasing
    ):
        return frame
    return frame.sort_values(list(by), kind="stable", na_position="last", ignore_index=True)


def columns_of(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return the columns of a table as arrays."""
    return {str(name): table[name].to_numpy() for name in table}


def sd(values: Any) -> Any:
    """Return the standard deviation of an array (n,) or Series, divisor n - 1 (0 for a single value)."""
    return values.std(ddof=1) if len(values) > 1 else 0.0 * values.mean()


def entity_name(name: str) -> str:
    """Return the name of a clip, with underscores for characters that are not allowed in paths of a recording."""
    return re.sub(r"\W", "_", name)


def lift(motion: np.ndarray) -> np.ndarray:
    """Return the offset (3,), mm, that moves the lowest joint of a motion (T, 15, 3) to the ankle's height."""
    return np.array([0.0, 0.0, ANKLE_HEIGHT_MM - motion[..., 2].min()])
