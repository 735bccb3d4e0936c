"""Cumulative variance of the eigenwalkers and share of each harmonic: zhang2007 figure 2, zhang2004 figure 2."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline import pictures, recordings
from pipeline.core import fourier
from pipeline.core.linear_model import unflatten
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.presentation import lift
from pipeline.studies.study import Figure, Nothing

EIGENWALKERS_SHOWN = 3

Inputs = FigureInputs[FourierSamples, Eigenwalkers, Nothing]


@dataclass(kw_only=True)
class Spectrum(Figure):
    """Cumulative variance and share of each harmonic."""

    model = EigenwalkersModel
    over_people = ("table", "table_harmonics")

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: variance of each component; ``table_harmonics``: share of each harmonic per walker."""
        model, data = inputs.model, inputs.dataset
        share = model.eigenvalues / model.total_variance
        return {
            "table": tidy(
                {
                    "component": np.arange(1, len(share) + 1),
                    "eigenvalue_mm2": model.eigenvalues,
                    "variance_fraction": share,
                    "cumulative_fraction": np.cumsum(share),
                },
                by=["component"],
            ),
            "table_harmonics": tidy(
                {
                    "person": data.person[:, None],
                    "walker": np.array(inputs.samples)[:, None],
                    "harmonic": np.arange(1, data.variance_fractions.shape[1] + 1),
                    "variance_fraction": data.variance_fractions,
                    "residual_fraction": data.residual_fraction[:, None],
                    "frequency_hz": data.frequency_hz[:, None],
                    "legs_apart_periods": _legs_apart(data.coefficients)[:, None],
                },
                by=["walker", "harmonic"],
            ),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Draw the cumulative variance against the number of components."""
        table = tables["table"]
        kept = inputs.model.kept
        reached = 100 * table["cumulative_fraction"][kept - 1]
        line = pictures.Series(
            x=np.concatenate([[0], table["component"]]),
            y=np.concatenate([[0.0], 100 * table["cumulative_fraction"]]),
        )
        panel = pictures.Panel(
            series=[line],
            xlabel="Number of principal components",
            ylabel="Cumulative variance (%)",
            xlim=(0, float(table["component"].iloc[-1])),
            ylim=(0, 100),
            references=[("x", kept, f"{kept}: {reached:.1f} %")],
        )
        pictures.draw_lines(stem, [panel], caption=inputs.caption)

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log the average walker and the first eigenwalkers, walking, beside the spectrum."""
        table, model = tables["table"], inputs.model
        frequency = float(inputs.dataset.frequency_hz.mean())
        times = np.arange(0, 1.0 / frequency, 1.0 / 60.0)
        with inputs.recording(folder) as rec:
            index = {"time": times}
            average = fourier.synthesise(unflatten(model.mean), frequency, times)
            ground = lift(average)
            rec.skeleton("world/average", average + ground, WALKER15.bones, index=index)
            for n in range(min(EIGENWALKERS_SHOWN, len(model.components))):
                reach = 2.0 * np.sqrt(model.eigenvalues[n])
                for sign, word, colour in ((-1, "minus", "orange"), (1, "plus", "blue")):
                    walker = unflatten(model.mean + sign * reach * model.components[n])
                    rec.skeleton(
                        f"world/eigenwalker_{n + 1}/{word}_2_sd",
                        fourier.synthesise(walker, frequency, times) + ground,
                        WALKER15.bones,
                        index=index,
                        colour=colour,
                    )
            components = table["component"].to_numpy()
            rec.bars("spectrum/variance_percent", 100 * table["variance_fraction"].to_numpy(), components)
            rec.bars(
                "cumulative/variance_percent",
                100 * table["cumulative_fraction"].to_numpy(),
                components,
                colour="green",
            )
            rec.blueprint(
                recordings.Columns(
                    recordings.Space3D(
                        name="average walker and eigenwalker 1 at ±2 sd",
                        shown=("world/average", "world/eigenwalker_1"),
                    ),
                    recordings.Rows(
                        recordings.Bars(name="variance of each component (%)", origin="spectrum"),
                        recordings.Bars(name="cumulative variance (%)", origin="cumulative"),
                        recordings.Notes(),
                    ),
                    shares=(3, 2),
                ),
                playing=True,
            )


def _legs_apart(coefficients: np.ndarray) -> np.ndarray:
    """Phase (R,) between the fundamentals of left and right ankle along the walk, in periods, 0 to 0.5."""
    ankles = [WALKER15.index(f"{side}_ankle") for side in ("left", "right")]
    left, right = (coefficients[:, 2, ankle, 1] + 1j * coefficients[:, 1, ankle, 1] for ankle in ankles)
    return np.asarray(np.abs(np.angle(left * right.conj())) / (2.0 * np.pi))
