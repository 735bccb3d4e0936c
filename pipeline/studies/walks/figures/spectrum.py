"""Cumulative variance of eigenwalkers and variance of each harmonic: zhang2007 figure 2, zhang2004 figure 2."""

from __future__ import annotations

import numpy as np

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.core import fourier
from pipeline.core.linear_model import unflatten
from pipeline.palette import Style
from pipeline.scenes import Bars, Columns, Notes, Rows, Space3D
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, lift, tidy
from pipeline.studies.study import Figure, NoResult, Recorder, Tables, Traits

EIGENWALKERS_SHOWN = 3

MIN_LEFT_PERCENT = 1e-3
"""Lower limit, per cent, of the axis that shows the variance not explained by the first components."""

PUBLISHED = {
    "zhang2004": Reference(
        x=28.0, y="zhang2004_twenty_eight_components", left_of=100.0, label="published: 28, 95 %"
    ),
    "zhang2007": Reference(
        x=30.0, y="zhang2007_thirty_components", left_of=100.0, label="published: 30, 95.5 %"
    ),
}

Inputs = FigureInputs[FourierSamples, Eigenwalkers, NoResult]


class Spectrum(Figure):
    """Figure of the cumulative variance of the eigenwalkers and of the variance of each harmonic."""

    model = EigenwalkersModel
    traits = Traits(
        over_people=("table", "table_harmonics"),
        ranked_by=("table", "cumulative_fraction"),
        abscissa="component",
    )

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table`` with the variance of each component, and ``table_harmonics`` with that of each harmonic."""
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
                    "legs_apart_periods": _ankle_phase(data.coefficients)[:, None],
                },
                by=["walker", "harmonic"],
            ),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return a chart of the variance that is not explained, against the number of components."""
        count, table = inputs.model.kept, tables["table"]
        reached = 100 * table["cumulative_fraction"][count - 1]
        reference = Reference(x=float(count), label=f"{count}: {reached:.1f} %")
        fractions = {
            "": "cumulative_fraction",
            "_low": "cumulative_fraction_high",
            "_high": "cumulative_fraction_low",
        }
        left = {
            f"variance_left_percent{end}": np.maximum(
                100.0 * (1.0 - table[name].to_numpy()), MIN_LEFT_PERCENT
            )
            for end, name in fractions.items()
            if name in table
        }
        some = left["variance_left_percent"] > MIN_LEFT_PERCENT
        chart = Chart(
            table={
                name: part[some]
                for name, part in {"component": table["component"].to_numpy(), **left}.items()
            },
            x="component",
            abscissa=Axis(label="number of components", limits=(0.0, max(32.0, float(len(table))))),
            y="variance_left_percent",
            label="variance that is left",
            log_y=True,
            styles=Style("", "black"),
            references=[reference, PUBLISHED[inputs.experiment.paper]],
        )
        return Sheet(charts=[chart], caption=f"Band: {inputs.banded}." * (len(left) > 1))

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record the average walker and the first eigenwalkers as moving skeletons, with a chart of their variances."""
        table, model = tables["table"], inputs.model
        frequency = inputs.dataset.frequency_hz.mean()
        times = np.arange(0, 1.0 / frequency, 1.0 / 60.0)
        with begin(at=times) as rec:
            average = fourier.synthesise(unflatten(model.mean), frequency, times)
            ground = lift(average)
            rec.skeleton("world/average", average + ground)
            for n in range(min(EIGENWALKERS_SHOWN, len(model.components))):
                reach = 2.0 * np.sqrt(model.eigenvalues[n])
                for sign, word, colour in ((-1, "minus", "orange"), (1, "plus", "blue")):
                    walker = unflatten(model.mean + sign * reach * model.components[n])
                    rec.skeleton(
                        f"world/eigenwalker_{n + 1}/{word}_2_sd",
                        fourier.synthesise(walker, frequency, times) + ground,
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
                Columns(
                    Space3D(
                        name="average walker and eigenwalker 1 at ±2 sd",
                        focus=("world/average", "world/eigenwalker_1"),
                    ),
                    Rows(
                        Bars(name="variance of each component (%)", origin="spectrum"),
                        Bars(name="cumulative variance (%)", origin="cumulative"),
                        Notes(),
                    ),
                    shares=(3, 2),
                ),
                playing=True,
            )


def _ankle_phase(coefficients: np.ndarray) -> np.ndarray:
    """Phase difference (R,) between left and right ankle at the stride frequency, in periods from 0 to 0.5."""
    ankles = [WALKER15.index(f"{side}_ankle") for side in ("left", "right")]
    left, right = (coefficients[:, 2, ankle, 1] + 1j * coefficients[:, 1, ankle, 1] for ankle in ankles)
    return np.abs(np.angle(left * right.conj())) / (2.0 * np.pi)
