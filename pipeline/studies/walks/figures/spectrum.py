"""Cumulative variance of the eigenwalkers and share of each harmonic: zhang2007 figure 2, zhang2004 figure 2."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.core import fourier
from pipeline.core.linear_model import unflatten
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import Made, Tables, lift

EIGENWALKERS_SHOWN = 3


def tables(made: Made) -> Tables:
    """``table``: variance of each component; ``table_harmonics``: share of each harmonic per walker."""
    eigenvalues = made.model.arrays["eigenvalues"]
    share = eigenvalues / made.model.notes["total_variance"]
    data = made.dataset.arrays
    walks, harmonics = data["variance_fractions"].shape
    return {
        "table": (
            {
                "component": np.arange(1, len(eigenvalues) + 1),
                "eigenvalue_mm2": eigenvalues,
                "variance_fraction": share,
                "cumulative_fraction": np.cumsum(share),
            },
            ["component"],
        ),
        "table_harmonics": (
            {
                "walker": np.repeat(made.walkers, harmonics),
                "harmonic": np.tile(np.arange(1, harmonics + 1), walks),
                "variance_fraction": data["variance_fractions"].ravel(),
                "residual_fraction": np.repeat(data["residual_fraction"], harmonics),
                "frequency_hz": np.repeat(data["frequency_hz"], harmonics),
            },
            ["walker", "harmonic"],
        ),
    }


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """The cumulative variance against the number of components."""
    from pipeline.pictures import curves as pictures  # drawing is slow to import, and not always wanted

    columns = made_tables["table"][0]
    kept = made.model.notes["components"]
    reached = 100 * columns["cumulative_fraction"][kept - 1]
    line = pictures.Series(
        x=np.concatenate([[0], columns["component"]]),
        y=np.concatenate([[0.0], 100 * columns["cumulative_fraction"]]),
    )
    panel = pictures.Panel(
        series=[line],
        xlabel="Number of principal components",
        ylabel="Cumulative variance (%)",
        xlim=(0, float(columns["component"][-1])),
        ylim=(0, 100),
        references=[("x", kept, f"{kept}: {reached:.1f} %")],
    )
    pictures.curves(stem, [panel], caption=made.caption)


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The average walker and the first eigenwalkers, walking, beside the spectrum."""
    from pipeline.recordings import recording  # drawing is slow to import, and not always wanted

    columns = made_tables["table"][0]
    model = made.model.arrays
    frequency = float(made.dataset.arrays["frequency_hz"].mean())
    times = np.arange(0, 1.0 / frequency, 1.0 / 60.0)
    with recording.Recording(
        folder / "recording.rrd", name=made.config.figure, about=made.about, edition=_edition(made)
    ) as rec:
        index = {"time": times}
        average = fourier.synthesise(unflatten(model["mean"]), frequency, times)
        ground = lift(average)
        rec.skeleton("world/average", average + ground, WALKER15.bones, index=index, colour="grey")
        for n in range(min(EIGENWALKERS_SHOWN, len(model["components"]))):
            reach = 2.0 * np.sqrt(model["eigenvalues"][n])
            for sign, word, colour in ((-1, "minus", "orange"), (1, "plus", "blue")):
                walker = unflatten(model["mean"] + sign * reach * model["components"][n])
                rec.skeleton(
                    f"world/eigenwalker_{n + 1}/{word}_2_sd",
                    fourier.synthesise(walker, frequency, times) + ground,
                    WALKER15.bones,
                    index=index,
                    colour=colour,
                )
        rec.bars("spectrum/variance_percent", 100 * columns["variance_fraction"], columns["component"])
        rec.bars(
            "cumulative/variance_percent",
            100 * columns["cumulative_fraction"],
            columns["component"],
            colour="green",
        )
        rec.blueprint(
            recording.Split(
                "columns",
                [
                    recording.Space3D(
                        name="average walker and eigenwalker 1 at ±2 sd",
                        shown=("world/average", "world/eigenwalker_1"),
                    ),
                    recording.Split(
                        "rows",
                        [
                            recording.Bars(name="variance of each component (%)", origin="spectrum"),
                            recording.Bars(name="cumulative variance (%)", origin="cumulative"),
                            recording.Notes(),
                        ],
                    ),
                ],
                [3, 2],
            ),
            playing=True,
        )


def _edition(made: Made) -> str:
    return f"{made.config.data.name} {made.config.scale.name}"
