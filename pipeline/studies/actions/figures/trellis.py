"""Disparity space image of two performances and the optimal path through its trellis: mozerov2006 figure 2.

"The sum of the cost values along this path plus the weighted length of the path is minimal among all other possible
paths": dynamic programming proves this.  As a test, the path is compared with paths that differ from it at one sample
and with many random paths.

Symbols: ``p`` sample of the median sequence, ``d`` disparity, ``E`` squared distance of the postures matched.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Lines, Sheet
from pipeline.core import synchronization
from pipeline.core.synchronization import Trellis, allowed_disparities
from pipeline.palette import Style, name_on_dark
from pipeline.scenes import Columns, HeatMap, Matrix, Notes, Rows
from pipeline.seeding import derive_generator
from pipeline.studies.actions.figures.alignments import STYLES, Inputs, options_of
from pipeline.studies.actions.figures.other_paths import distances_so_far, random_paths, single_corner_changes
from pipeline.studies.actions.model import ActionSpaceModel
from pipeline.studies.figure_inputs import tidy
from pipeline.studies.study import Figure, Picture, Recorder, Tables
from pipeline.validation import InvalidInput, bounded

OUTLINE_COLOUR = "grey"

RANDOM_PATHS = 10_000

DIMENSION = 1
"""Dimension of the posture space (aSpace) that the charts show before and after synchronization."""

COMPARED = {"linear": "before", "synchronized": "after"}


class OptimalPath(Figure):
    """Figure of the disparity space image of two performances, with the optimal path."""

    model = ActionSpaceModel

    performance: Annotated[int, bounded(at_least=-1)] = -1  # synchronized performance; -1: largest disparity

    def tables(self, inputs: Inputs) -> Tables:
        """Return the cost of each trellis node in ``table``, and further tables of the path and its distances."""
        (n, m), nodes, names = self._pair(inputs), _nodes(inputs), inputs.samples
        x_n, x_m = (inputs.model.linear[k] for k in (n, m))
        path = np.asarray(inputs.model.disparity[m], int)
        band = int(max(nodes.high.max(), -nodes.low.min()))
        image = synchronization.disparity_space_image(x_n, x_m, max_disparity=band)
        disparities = np.arange(-band, band + 1)
        inside = (disparities >= nodes.low[:, None]) & (disparities <= nodes.high[:, None])
        p, column = np.nonzero(inside)
        drawn = random_paths(nodes, RANDOM_PATHS, derive_generator(inputs.experiment.seed, "report"))
        others = np.concatenate([single_corner_changes(nodes, path), drawn])
        others = others[(others != path).any(axis=1)]
        costs = distances_so_far(nodes, image, path)
        node_columns = {
            "sample": p,
            "disparity": disparities[column],
            "cost": image[p, column],
            "on_path": path[p] == disparities[column],
        }
        path_columns = {
            "sample": np.arange(len(path)),
            "disparity": path,
            "rate_to_rate": synchronization.rate_to_rate(path),
            "accumulated_cost": costs[0],
        }
        pair = {
            "pattern": names[n],
            "performance": names[m],
            "distance": costs[0, -1],
            "distance_linear": distances_so_far(nodes, image, np.zeros_like(path))[0, -1],
            "least_other_distance": distances_so_far(nodes, image, others)[:, -1].min(initial=np.inf),
            "other_paths": len(others),
            "smoothness": nodes.smoothness,
        }
        return {
            "table": tidy(node_columns, by=["sample", "disparity"]),
            "table_path": tidy(path_columns, by=["sample"]),
            "table_pair": pd.DataFrame([pair]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of two sequences before and after synchronization, and of disparity and distance along the path."""
        path, facts = tables["table_path"], tables["table_pair"].iloc[0]
        charts = []
        for letter, (alignment, word) in zip("bc", COMPARED.items(), strict=True):
            pattern, other = self._dimension(inputs, alignment)
            columns = {"sample": path["sample"].to_numpy(), "pattern": pattern, "performance": other}
            charts.append(
                Chart(
                    table=columns,
                    x="sample",
                    y="pattern",
                    styles={"pattern": Style("median sequence", "original")},
                    also=[Lines(table=columns, y="performance",
                                styles={"performance": Style(facts["performance"], "blue")})],
                    title=f"({letter}) {word}: {STYLES[alignment].label}",
                    name=f"dimension_{DIMENSION}/{alignment}",
                    label=f"dimension {DIMENSION}",
                )
            )  # fmt: skip
        of_path = partial(
            Chart,
            table="table_path",
            x="sample",
            styles={"path": Style("", "optimal_path")},
            picture=False,
        )
        return Sheet(
            charts=[
                *charts,
                of_path(y="disparity", unit="samples"),
                of_path(y="accumulated_cost", label="distance along the path so far", page=False),
            ],
            letters=False,
            caption=f"{facts['performance']} is brought to the rate of {facts['pattern']}, the median sequence."
            f" Distance"
            f" along the path {facts['distance']:.7g}, along zero disparity {facts['distance_linear']:.7g}, the"
            f" least of"
            f" {facts['other_paths']} other admissible paths {facts['least_other_distance']:.7g}.",
        )

    def draw(self, inputs: Inputs, tables: Tables, picture: Picture) -> None:
        """Draw the disparity space image with the outline of the trellis and the optimal path."""
        values, disparities = _image(tables["table"])
        path = tables["table_path"]
        picture.heat_map(
            HeatMap(
                values=values,
                x=path["sample"].to_numpy(),
                y=disparities,
                path=path["disparity"].to_numpy(),
                outline=_outline(inputs),
                title="(a) disparity space image",
                xlabel="sample p",
                ylabel="disparity d (samples)",
                bar="squared distance E(p, d)",
                path_label="optimal path",
                outline_label="trellis",
            ),
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record the disparity space image with its path, and curves of disparity, distance and both sequences."""
        values, disparities = _image(tables["table"])
        path, facts, top = tables["table_path"], tables["table_pair"].iloc[0], disparities[-1]
        samples, disparity = path["sample"].to_numpy(), path["disparity"].to_numpy()
        outline = _outline(inputs)
        corners = np.concatenate([outline, outline[:1]])
        with begin(
            f"\n{facts['performance']} is brought to the rate of {facts['pattern']}, the median sequence. The image: "
            f"samples of the median sequence to the right, disparity from {top} at the top to {-top}; root of the "
            "squared distance of the postures, dark where they are alike, brightest outside of the trellis "
            f"({OUTLINE_COLOUR} outline). {name_on_dark('optimal_path').capitalize()}: the optimal path.\n",
            timeline="sample",
        ) as rec:
            rec.matrix(  # rows are counted from the top, which is the largest disparity
                "matrices/disparity_space_image",
                np.sqrt(np.where(np.isnan(values), np.nanmax(values), values))[::-1],
                paths={
                    "trellis": (np.column_stack([top - corners[:, 1], corners[:, 0]]), OUTLINE_COLOUR),
                    "optimal_path": (np.column_stack([top - disparity, samples]), "optimal_path"),
                },
            )
            image = Matrix(name="disparity space image, optimal path")
            left = Rows(image, Notes(), shares=(3, 1))
            rec.blueprint(Columns(left, Rows(*rec.plots)))

    def _pair(self, inputs: Inputs) -> tuple[int, int]:
        """Indices of the median sequence and of the performance that is synchronized to the median sequence."""
        median, count = inputs.model.median, len(inputs.samples)
        performance = inputs.model.farthest if self.performance == -1 else self.performance
        if performance >= count or performance == median:
            raise InvalidInput(
                "this performance does not exist, or it is the median sequence itself",
                "figure.performance",
                f"0 to {count - 1} except {median}, or -1 for the farthest performance",
                self.performance,
                code="unknown_performance",
                typed=True,
            )
        return median, performance

    def _dimension(self, inputs: Inputs, alignment: str) -> tuple[np.ndarray, np.ndarray]:
        """Values (P,) of one dimension of the posture space, for the median sequence and for one performance."""
        n, m = self._pair(inputs)
        x_m = inputs.model.sequences(alignment)[m]
        return inputs.model.linear[n][:, DIMENSION - 1], x_m[:, DIMENSION - 1]


def _nodes(inputs: Inputs) -> Trellis:
    """Trellis of admissible disparities in which the model searched for the optimal path."""
    options = options_of(inputs)
    return allowed_disparities(options.samples, smoothness=inputs.model.smoothness, **options.path_options)


def _outline(inputs: Inputs) -> np.ndarray:
    """Corners (K, 2) of the outline of the trellis, each as (sample, disparity), in order along the outline."""
    nodes = _nodes(inputs)
    samples = np.arange(len(nodes.low))
    lower, upper = (np.column_stack([samples, side]) for side in (nodes.low, nodes.high))
    return np.concatenate([lower, upper[::-1]]).astype(float)


def _image(table: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Disparity space image (2D + 1, P) from the table, NaN outside the trellis, and the disparities from -D to D."""
    band = table["disparity"].abs().max()
    disparities = np.arange(-band, band + 1)
    image = table.pivot(index="disparity", columns="sample", values="cost").reindex(disparities)
    return image.to_numpy(), disparities
