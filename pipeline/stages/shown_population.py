"""The synthetic population that a figure shows: the one whose error is the median one, within the range of all."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from pipeline.stages import populations
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.replicated import POPULATION
from pipeline.studies.study import Figure, Tables

Inputs = FigureInputs[Any, Any, Any]


def shown(inputs: Inputs, store: Store) -> tuple[Inputs, Tables]:
    """Return the inputs of what a figure shows, and its tables; the inputs as they are if there is one population."""
    experiment, figure = inputs.experiment, inputs.experiment.figure
    further = populations.tables(experiment, store)
    if further:
        number = _in_the_middle(experiment, further) - 1
        inputs = populations.inputs_of(experiment, number, store, shown=True)
    made = {**figure.tables(inputs), **further}
    if "table_populations" in further:
        made["table"] = _with_range(figure, made["table"], further["table_populations"], inputs.population)
    return inputs, made


def _in_the_middle(experiment: Experiment, made: Tables) -> int:
    """Return the population whose error is the median one, the lower of two, by `Traits.ranked_by`."""
    name, column = experiment.figure.traits.ranked_by
    rows = made[f"{name}_populations"]
    if "method" in rows:  # of the first one
        rows = rows[rows["method"] == str(getattr(experiment.sweep, "methods")[0])]  # noqa: B009 - of every such sweep
    error = rows[column].abs().groupby(rows[POPULATION]).mean().sort_values(kind="stable")
    return int(error.index[(len(error) - 1) // 2])


def _with_range(figure: Figure, table: pd.DataFrame, each: pd.DataFrame, population: int) -> pd.DataFrame:
    """Return the table of one population whose intervals, and one of the ranked column, reach over all populations.

    Between places of the abscissa that were not computed of all, what they are above and below of this one is
    interpolated.
    """
    traits = figure.traits
    x = traits.abscissa
    series = ["method"] if "method" in table else []
    names = [traits.ranked_by[1], *(str(n).removesuffix("_low") for n in table if str(n).endswith("_low"))]
    made = table.copy()
    for name in dict.fromkeys(name for name in names if name in table):
        column = traits.rows_of.get(name, name)
        curves = each.groupby([POPULATION, *series, x])[column].mean().unstack(POPULATION)
        for end, ends in (("low", curves.min(axis=1)), ("high", curves.max(axis=1))):
            away = ends - curves[population]
            for key, rows in table.groupby("method") if series else [(None, table)]:
                off = away if key is None else away.loc[key]
                made.loc[rows.index, f"{name}_{end}"] = rows[name] + np.interp(rows[x], off.index, off)
    return made
