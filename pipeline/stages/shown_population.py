"""Choice of the synthetic population that a figure shows: the population with the median error."""

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


def displayed_population(inputs: Inputs, store: Store) -> tuple[Inputs, Tables]:
    """Return inputs and tables of the population that a figure shows; a single population is returned unchanged."""
    experiment, figure = inputs.experiment, inputs.experiment.figure
    further = populations.tables(experiment, store)
    if further:
        number = _median_population(experiment, further) - 1
        inputs = populations.inputs_of(experiment, number, store, shown=True)
    figure_tables = {**figure.tables(inputs), **further}
    if "table_populations" in further:
        figure_tables["table"] = _with_range(
            figure, figure_tables["table"], further["table_populations"], inputs.population
        )
    return inputs, figure_tables


def _median_population(experiment: Experiment, all_tables: Tables) -> int:
    """Return the number of the population whose error (`Traits.ranked_by`) is the median, or the lower median."""
    name, column = experiment.figure.traits.ranked_by
    rows = all_tables[f"{name}_populations"]
    if "method" in rows:  # the first method ranks
        rows = rows[rows["method"] == str(getattr(experiment.sweep, "methods")[0])]  # noqa: B009 - every such sweep has it
    error = rows[column].abs().groupby(rows[POPULATION]).mean().sort_values(kind="stable")
    return int(error.index[(len(error) - 1) // 2])


def _with_range(figure: Figure, table: pd.DataFrame, each: pd.DataFrame, population: int) -> pd.DataFrame:
    """Return the table of one population, with the ranges over all populations as intervals.

    The ranked column gets an interval too.  The other populations may have fewer values of the abscissa: distances of
    the ends from this population's curve are interpolated between these.
    """
    traits = figure.traits
    x = traits.abscissa
    series = ["method"] if "method" in table else []
    names = [traits.ranked_by[1], *(str(n).removesuffix("_low") for n in table if str(n).endswith("_low"))]
    ranged = table.copy()
    for name in dict.fromkeys(name for name in names if name in table):
        column = traits.rows_of.get(name, name)
        curves = each.groupby([POPULATION, *series, x])[column].mean().unstack(POPULATION)
        for end, ends in (("low", curves.min(axis=1)), ("high", curves.max(axis=1))):
            offsets = ends - curves[population]
            for key, rows in table.groupby("method") if series else [(None, table)]:
                offset = offsets if key is None else offsets.loc[key]
                ranged.loc[rows.index, f"{name}_{end}"] = rows[name] + np.interp(
                    rows[x], offset.index, offset
                )
    return ranged
