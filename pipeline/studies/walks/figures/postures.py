"""Original and reconstructed postures over one gait cycle: zhang2007 figure 4, zhang2004 figure 3."""

from __future__ import annotations

from string import ascii_lowercase
from typing import Any

import numpy as np

from pipeline.charts import Axis, Chart, Lines, Sheet
from pipeline.core import camera, errors, fourier
from pipeline.core.choice import evenly
from pipeline.palette import name_on_dark
from pipeline.scenes import Columns, Image2D, Notes, PostureRow, Space3D, Tabs
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, columns_of, entity_name, lift, tidy
from pipeline.studies.study import Figure, Picture, Recorder, Tables, Traits
from pipeline.studies.walks import methods
from pipeline.studies.walks.figures.identification import identification_table, missing_dimensions
from pipeline.studies.walks.known_view import KnownView, KnownViewErrors
from pipeline.studies.walks.methods import AVERAGE_WALKER, LEAST_SQUARES, PUBLISHED
from pipeline.validation import Count, CountOrAll, require_range

_PLAYED_HZ = 30.0


Inputs = FigureInputs[FourierSamples, Eigenwalkers, KnownViewErrors]


def reconstructed(inputs: Inputs, method: int, walker: int, view: int) -> np.ndarray:
    """Return the reconstructed Fourier representation (5, 15, 3), mm, of a walker seen from one view.

    It combines the observed view with the estimated missing dimension.
    """
    truth = inputs.dataset.coefficients[walker]
    angle = np.radians(inputs.sweep.demonstration_view_deg[view])
    return camera.combine(camera.project(truth, angle), inputs.sweep.missing[method, walker, view], angle)


class Postures(Figure):
    """Figure of original and reconstructed postures over one gait cycle."""

    model = EigenwalkersModel
    sweep = KnownView
    traits = Traits(
        over_people=("table_demonstrations", "table_identification"),
        ranked_by=("table_demonstrations", "rms_error_least_squares_mm"),
    )

    walker: CountOrAll = 0  # number of the walker that is drawn
    instants: Count = 5  # number of instants of the cycle that are drawn
    recorded: Count = 24  # number of walkers in the recording, spread evenly; 80 would take 14 MB

    def tables(self, inputs: Inputs) -> Tables:
        """Return joints of one walker over the cycle in ``table``, and errors of all walkers in a second table.

        ``table_identification``: identification of a walker from one view among all walkers from another.
        """
        sweep, data = inputs.sweep, inputs.dataset
        names = inputs.sweep.methods.tolist()
        require_range("figure.walker", self.walker, at_most=len(inputs.samples) - 1)
        views = sweep.demonstration_view_deg
        times = np.arange(self.instants) / self.instants  # fractions of a cycle, at one hertz
        original = fourier.synthesise(data.coefficients[self.walker], 1.0, times)
        every = np.stack(
            [
                [
                    fourier.synthesise(reconstructed(inputs, m, self.walker, v), 1.0, times)
                    for v in range(len(views))
                ]
                for m in range(len(names))
            ]
        )  # (M, V, T, 15, 3)
        # Methods of the paper always have columns (empty if this run leaves a method out), so the ledger can say why.
        published = list(PUBLISHED) if inputs.experiment.paper == "zhang2007" else [LEAST_SQUARES.name]
        compared = dict.fromkeys([*PUBLISHED, *names])
        listed = [name for name in compared if name in names or name in published]
        missing, rows = missing_dimensions(sweep), dict(iter(sweep.demonstrations.groupby("method")))

        def rms_between(first: str, second: str) -> np.ndarray | float:
            if not {first, second} <= missing.keys():
                return np.nan
            return np.sqrt(
                errors.walker_error(errors.absolute_error(missing[first] - missing[second]))
            ).ravel()

        average = rows[AVERAGE_WALKER.name]
        demonstrations = {name: average[name] for name in ("person", "walker", "view_angle_deg")}
        for method in listed:
            error = rows[method]["rms_error_mm"].to_numpy() if method in rows else np.nan
            demonstrations[f"rms_error_{method}_mm"] = error
        if set(PUBLISHED) <= set(listed):
            demonstrations["rms_between_methods_mm"] = rms_between(*PUBLISHED)
        demonstrations["rms_error_average_walker_mm"] = average["rms_error_mm"]
        for method in listed:
            demonstrations[f"rms_{method}_from_average_walker_mm"] = rms_between(method, AVERAGE_WALKER.name)
        return {
            "table": tidy(
                {
                    "walker": inputs.samples[self.walker],
                    "view_angle_deg": views[:, None, None],
                    "method": np.array(names)[:, None, None, None],
                    "instant": np.arange(self.instants)[:, None],
                    "joint": WALKER15.joints,
                    **{
                        f"{which}_{axis}_mm": motion[..., number]
                        for which, motion in (("original", original), ("reconstructed", every))
                        for number, axis in enumerate("xyz")
                    },
                },
                by=["view_angle_deg", "method", "instant"],
            ),
            "table_demonstrations": tidy(demonstrations, by=["walker", "view_angle_deg"]),
            "table_identification": identification_table(inputs),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return a chart of the RMS error of each walker in the middle one of the demonstration views."""
        compared = methods.chosen(inputs.sweep.methods.tolist())
        views = inputs.sweep.demonstration_view_deg
        middle = views[len(views) // 2]
        lines: list[dict[str, Any]] = [
            {"table": "table_demonstrations", "y": f"rms_error_{m.name}_mm", "styles": {m.name: m.style},
             "where": {"view_angle_deg": middle}}
            for m in compared
        ]  # fmt: skip
        chart = Chart(
            **lines[0], x="walker",
            abscissa=Axis(label=f"walker, seen from {middle:g}°", words={name: name for name in inputs.samples}),
            label="RMS error", zero=True,
            also=[Lines(**line) for line in lines[1:]], picture=False,
        )  # fmt: skip
        return Sheet(
            charts=[chart],
            caption=f"Walker {inputs.samples[self.walker]}; across the page runs the dimension that the view did not"
            " show.",
        )

    def draw(self, inputs: Inputs, tables: Tables, picture: Picture) -> None:
        """Draw postures of a walker in rows, from a direction in which the missing dimension is horizontal."""
        columns = columns_of(tables["table"])
        compared = methods.chosen(inputs.sweep.methods.tolist())
        shape = (self.instants, len(WALKER15.joints))
        groups = []
        for m, method in enumerate(compared):
            rows = []
            for view in inputs.sweep.demonstration_view_deg:
                selected = (columns["method"] == method.name) & (columns["view_angle_deg"] == view)
                projections = []
                for which in ("original", "reconstructed"):
                    space = np.stack(
                        [columns[f"{which}_{a}_mm"][selected].reshape(shape) for a in "xyz"], axis=-1
                    )
                    across = camera.missing_dimension(space, np.radians(view))
                    projections.append(np.stack([across, space[..., 2]], axis=-1))
                rows.append(
                    PostureRow(
                        label=f"{view:g}°",
                        original=projections[0],
                        reconstructed=projections[1],
                        estimated=inputs.dataset.unmeasured[self.walker],
                    )
                )
            title = (
                f"({ascii_lowercase[m]}) {method.title or method.style.label}" if len(compared) > 1 else ""
            )
            groups.append((title, rows))
        picture.postures(groups, WALKER15.bones)

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record walkers on the spot, original and reconstructed, for every demonstration view."""
        data, views = inputs.dataset, inputs.sweep.demonstration_view_deg
        compared = methods.chosen(inputs.sweep.methods.tolist())
        displayed = entity_name(inputs.samples[self.walker])
        middle = 1 if len(views) > 1 else 0
        seconds = 1.0 / np.median(data.frequency_hz)
        times = np.arange(0.0, seconds, 1.0 / _PLAYED_HZ)
        recorded = sorted({self.walker, *evenly(self.recorded, len(inputs.samples)).tolist()})
        with begin(
            f"\n{len(recorded)} of {len(inputs.samples)} walkers are played at one common pace and can be switched on"
            " in the streams tree: "
            "`world/original/<walker>`, `world/reconstructed/<method>/view_<angle>/<walker>`. "
            f"{name_on_dark('original').capitalize()}: original; spheres of wire, and rings in the image: "
            "joints that no marker gave. "
            + ", ".join(f"{name_on_dark(m.style.colour)}: {m.style.label}" for m in compared)
            + ".\n",
            at=times,
        ) as rec:
            for r in recorded:
                word = entity_name(inputs.samples[r])
                truth, estimated = data.coefficients[r], data.unmeasured[r]
                original = fourier.synthesise(truth, 1.0 / seconds, times)
                ground = lift(original)
                rec.skeleton(
                    f"world/original/{word}",
                    original + ground,
                    estimated=estimated,
                )
                for v, view in enumerate(views):
                    rec.image_points(
                        f"image/observed/view_{view:g}/{word}",
                        fourier.synthesise(camera.project(truth, np.radians(view)), 1.0 / seconds, times),
                        estimated=estimated,
                    )
                    for m, method in enumerate(compared):
                        rec.skeleton(
                            f"world/reconstructed/{method.name}/view_{view:g}/{word}",
                            fourier.synthesise(reconstructed(inputs, m, r, v), 1.0 / seconds, times) + ground,
                            colour=method.style.colour,
                            estimated=estimated,
                        )
            spaces = [
                Space3D(
                    name=f"{view:g}°: original and reconstructions",
                    contents=(
                        "world/original",
                        *(f"world/reconstructed/{m.name}/view_{view:g}" for m in compared),
                    ),
                    focus=(
                        f"world/original/{displayed}",
                        *(f"world/reconstructed/{m.name}/view_{view:g}/{displayed}" for m in compared),
                    ),
                )
                for view in views
            ]
            rec.blueprint(
                Columns(
                    Tabs(spaces[middle], *spaces[:middle], *spaces[middle + 1 :]),
                    Image2D(
                        name=f"observed at {views[middle]:g}°",
                        contents=(f"image/observed/view_{views[middle]:g}",),
                        focus=(f"image/observed/view_{views[middle]:g}/{displayed}",),
                        next_to=spaces[middle],
                    ),
                    Notes(),
                    shares=(4, 3, 2),
                ),
                playing=True,
            )
