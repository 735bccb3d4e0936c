"""The disparity space image of one pair and the optimal path through its trellis: mozerov2006 figure 2.

"The sum of the cost values along this path plus the weighted length of the path is minimal among all other possible
paths": besides the proof, which is dynamic programming, other paths are tried, those that turn at one sample another
way and many drawn at random.

Symbols: ``p`` sample of the median sequence, ``d`` disparity, ``E`` squared distance of the postures matched.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.core import synchronization
from pipeline.core.synchronization import Trellis, allowed_disparities
from pipeline.storage.store import derive_generator
from pipeline.studies.actions.figures.other_paths import distances_so_far, random_paths, single_corner_changes
from pipeline.studies.actions.figures.synchronizations import STAGE_COLOURS, farthest, options_of
from pipeline.studies.figure_inputs import Made, Tables
from pipeline.studies.options import TrellisReport
from pipeline.validation import InvalidInput

RANDOM_PATHS = 10_000

DIMENSION = 1
"""Of the aSpace, shown before and after."""


def pair(made: Made) -> tuple[int, int]:
    """The median sequence, and the performance that is brought to its rate."""
    report = made.config.report
    if not isinstance(report, TrellisReport):
        raise TypeError(f"a trellis is not made by {type(report).__name__}")
    median, count = int(made.model.notes["median"]), len(made.walkers)
    chosen = farthest(made) if report.performance == -1 else report.performance
    if not 0 <= chosen < count or chosen == median:
        raise InvalidInput(
            "there is no such performance to synchronize",
            where="report.performance",
            expected=f"0 to {count - 1} but for {median}, the median sequence, or -1",
            received=str(report.performance),
        )
    return median, chosen


def nodes_of(made: Made) -> Trellis:
    """The trellis that the model stage searched."""
    options = options_of(made)
    return allowed_disparities(
        options.samples,
        max_disparity=options.max_disparity,
        smoothness=float(made.model.notes["smoothness"]),
        penalty=options.penalty,
        start=options.start,
        steps=options.steps,
    )


def tables(made: Made) -> Tables:
    """``table``: E of every node; ``table_path``: the optimal path; ``table_pair``: its distance and that of others."""
    (n, m), nodes = pair(made), nodes_of(made)
    x_n, x_m = (made.model.arrays["linear"][k] for k in (n, m))
    path = np.asarray(made.model.arrays["disparity"][m], dtype=int)
    samples = np.arange(len(path))
    band = int(max(nodes.high.max(), -nodes.low.min()))
    image = synchronization.disparity_space_image(x_n, x_m, max_disparity=band)
    disparities = np.arange(-band, band + 1)
    inside = (disparities >= nodes.low[:, None]) & (disparities <= nodes.high[:, None])
    p, column = np.nonzero(inside)
    others = np.concatenate(
        [
            single_corner_changes(nodes, path),
            random_paths(nodes, RANDOM_PATHS, derive_generator(made.config.seed, "report")),
        ]
    )
    others = others[(others != path).any(axis=1)]
    costs = distances_so_far(nodes, image, path)
    none = np.zeros((1, len(path)), dtype=int)
    return {
        "table": (
            {
                "sample": p,
                "disparity": disparities[column],
                "cost": image[p, column],
                "on_path": path[p] == disparities[column],
            },
            ["sample", "disparity"],
        ),
        "table_path": (
            {
                "sample": samples,
                "disparity": path,
                "rate_to_rate": synchronization.rate_to_rate(path),
                "accumulated_cost": costs[0],
            },
            ["sample"],
        ),
        "table_pair": (
            {
                "pattern": np.array([made.walkers[n]]),
                "performance": np.array([made.walkers[m]]),
                "distance": costs[:, -1],
                "distance_linear": distances_so_far(nodes, image, none)[:, -1],
                "least_other_distance": distances_so_far(nodes, image, others)[:, -1].min()[None],
                "other_paths": np.array([len(others)]),
                "smoothness": np.array([nodes.smoothness]),
            },
            ["performance"],
        ),
    }


def outline(nodes: Trellis) -> np.ndarray:
    """Corners (K, 2) of the admissible region as (sample, disparity), once around."""
    samples = np.arange(len(nodes.low))
    lower, upper = (np.stack([samples, side], axis=-1) for side in (nodes.low, nodes.high))
    return np.concatenate([lower, upper[::-1]]).astype(float)


def _image(columns: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """E (disparities, P) out of the table, NaN outside of the trellis, and the disparities from -D to D."""
    band = int(np.abs(columns["disparity"]).max())
    values = np.full((2 * band + 1, int(columns["sample"].max()) + 1), np.nan)
    values[columns["disparity"] + band, columns["sample"]] = columns["cost"]
    return values, np.arange(-band, band + 1)


def _dimension(made: Made) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """One dimension of both performances (P,) before and after."""
    n, m = pair(made)
    arrays = made.model.arrays
    return {
        stage: (arrays["linear"][n][:, DIMENSION - 1], arrays[stage][m][:, DIMENSION - 1])
        for stage in ("linear", "synchronized")
    }


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """The image with the rhombus and the path; beside it both sequences, before and after."""
    from pipeline import pictures

    columns, path = made_tables["table"][0], made_tables["table_path"][0]
    values, disparities = _image(columns)
    (n, m), samples = pair(made), path["sample"]
    panels = []
    for letter, (stage, (pattern, other)) in zip("bc", _dimension(made).items(), strict=True):
        words = "before" if stage == "linear" else "after"
        panels.append(
            pictures.Panel(
                series=[
                    pictures.Series(x=samples, y=pattern, colour="original", label="median sequence"),
                    pictures.Series(x=samples, y=other, colour="blue", label=made.walkers[m]),
                ],
                title=f"({letter}) {words}",
                xlabel="Sample" if stage == "synchronized" else "",
                ylabel=f"Dimension {DIMENSION}",
            )
        )
    facts = {name: values[0] for name, values in made_tables["table_pair"][0].items()}
    pictures.draw_heat_map(
        stem,
        pictures.HeatMap(
            values=values,
            x=samples,
            y=disparities,
            path=path["disparity"],
            outline=outline(nodes_of(made)),
            title="(a) disparity space image",
            xlabel="Sample $p$",
            ylabel="Disparity $d$ (samples)",
            bar="Squared distance $E(p, d)$",
            path_label="optimal path",
            outline_label="trellis",
        ),
        panels,
        caption=f"{made.caption} {made.walkers[m]} is brought to the rate of {made.walkers[n]}, the median sequence. "
        f"Distance along the path {facts['distance']:.7g}, along zero disparity {facts['distance_linear']:.7g}, "
        f"the least of {facts['other_paths']} other admissible paths {facts['least_other_distance']:.7g}.",
    )


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The image with the path; over samples, the disparity, its distance so far, and both sequences."""
    from pipeline import recordings as recording

    columns, path = made_tables["table"][0], made_tables["table_path"][0]
    values, disparities = _image(columns)
    (n, m), samples, top = pair(made), path["sample"], int(disparities[-1])

    def drawn(disparity: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Rows, the largest disparity at the top, and columns of the image."""
        return np.stack([top - disparity, at], axis=-1)

    corners = outline(nodes_of(made))
    closed = np.concatenate([corners, corners[:1]])
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + f"\n{made.walkers[m]} is brought to the rate of {made.walkers[n]}, the median sequence. The image: samples "
        f"of the median sequence to the right, disparity from {top} at the top to {-top}; root of the squared distance "
        "of the postures, dark where they are alike, brightest outside of the trellis (grey outline). Orange: the "
        "optimal path.\n",
        timeline="sample",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        rec.matrix(
            "matrices/disparity_space_image",
            np.sqrt(np.where(np.isnan(values), np.nanmax(values), values))[::-1],
            paths={
                "trellis": (drawn(closed[:, 1], closed[:, 0]), "grey"),
                "optimal_path": (drawn(path["disparity"], samples), "optimal_path"),
            },
        )
        colour = STAGE_COLOURS["synchronized"]
        rec.curve(
            "curves/disparity/path", samples, path["disparity"], label="disparity", colour="optimal_path"
        )
        rec.curve(
            "curves/accumulated_cost/path",
            samples,
            path["accumulated_cost"],
            label="distance so far",
            colour="optimal_path",
        )
        for stage, (pattern, other) in _dimension(made).items():
            where = f"curves/dimension_{DIMENSION}/{stage}"
            rec.curve(f"{where}/pattern", samples, pattern, label="median sequence", colour="original")
            rec.curve(f"{where}/performance", samples, other, label=made.walkers[m], colour=colour)
        rec.blueprint(
            recording.Columns(
                recording.Rows(
                    recording.Matrix(name="disparity space image, optimal path"),
                    recording.Notes(),
                    shares=(3, 1),
                ),
                recording.Rows(
                    recording.Plot(name="disparity (samples)", origin="curves/disparity"),
                    recording.Plot(
                        name=f"dimension {DIMENSION}, before: linearly synchronized",
                        origin=f"curves/dimension_{DIMENSION}/linear",
                    ),
                    recording.Plot(
                        name=f"dimension {DIMENSION}, after: synchronized automatically",
                        origin=f"curves/dimension_{DIMENSION}/synchronized",
                    ),
                    recording.Plot(name="distance along the path so far", origin="curves/accumulated_cost"),
                ),
                shares=(1, 1),
            )
        )
