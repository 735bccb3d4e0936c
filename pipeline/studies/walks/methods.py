"""Methods that reconstruct a walk from one view: the papers' two approaches, baselines and plug-ins.

A method is a value with a name, a style and a function ``reconstruct(fold, walk, views)``.  Options name methods; an
unregistered name is an error.  Sweeps, tables, pictures and recordings loop over the chosen methods.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from pipeline import plugins
from pipeline.charts import Axis
from pipeline.core import camera, linear_model, reconstruction
from pipeline.core.linear_model import LinearModel, unflatten
from pipeline.palette import CYCLE, NAMES, Style
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Grid
from pipeline.validation import InvalidInput, require_choice, require_distinct


@dataclass(frozen=True)
class Reconstruction:
    """Reconstructions of one walk from A view angles, one reconstruction for each view angle.

    Attributes
    ----------
    missing : (A, 5, 15)
        Reconstructed missing dimension, at phase zero, mm.
    delta : (A, 5, 15)
        True less reconstructed missing dimension, mm.
    coefficients : (A, N)
        Coefficients of the eigenwalkers, mm.
    """

    missing: np.ndarray
    delta: np.ndarray
    coefficients: np.ndarray


@dataclass(frozen=True)
class Walk:
    """Walk of a held-out person, which is observed from known views.

    Attributes
    ----------
    number : int
        Row number in the data set.
    sample : (D,)
        Fourier representation, flattened; 0 at joints that were not measured.
    measured : (15,) bool
    """

    number: int
    sample: np.ndarray
    measured: np.ndarray

    def observed(self, views: np.ndarray) -> np.ndarray:
        """Return the images (A, 5, 15, 2), mm, of the walk from views (A,), rad; the last axis is (right, up)."""
        return camera.project(unflatten(self.sample), np.asarray(views)[:, None, None])


@dataclass(frozen=True)
class Fold:
    """Training data of a method: the walks of all people except the held-out person.

    Attributes
    ----------
    model : LinearModel
        Average walker and eigenwalkers, learnt without the person.
    data : FourierSamples
        Whole data set; `training` contains only the walks of the other people.
    person : str
        Held-out person.
    noise_variance_mm2 : float
        sigma² of approach II.
    prepared : Any
        Result of the method's `prepare`.
    """

    model: LinearModel
    data: FourierSamples
    person: str
    noise_variance_mm2: float
    prepared: Any = None

    @cached_property
    def training(self) -> np.ndarray:
        """Fourier representations (n, 5, 15, 3), mm, of other people's walks in which all joints are measured."""
        return self.data.coefficients[(self.data.person != self.person) & ~self.data.unmeasured.any(axis=1)]

    @cached_property
    def with_one_eigenwalker(self) -> Fold:
        """Copy of the training data whose model has the first eigenwalker only."""
        return replace(self, model=linear_model.truncated(self.model, 1))


def held_out(
    data: FourierSamples, model: Eigenwalkers, number: int, noise_variance_mm2: float
) -> tuple[Fold, Walk]:
    """Return the training data without the person of a walk, and this walk as the one to reconstruct."""
    measured = ~data.unmeasured[number]
    fold = Fold(model.fold(number), data, str(data.person[number]), noise_variance_mm2)
    return fold, Walk(number, linear_model.without_joints(model.samples[number], measured), measured)


@dataclass(frozen=True)
class Method:
    """Method that reconstructs a walk from one view.

    Attributes
    ----------
    name : str
        Name in options, tables and recordings.
    style : Style
        Label, colour and line in pictures and recordings.
    reconstruct : callable
        Takes the `Fold`, the `Walk` and views (A,) in rad; returns the missing dimension (A, 5, 15) in mm at phase
        zero, or a `Reconstruction`.
    estimate : callable, optional
        Takes the `Fold`, the `Walk` and views (A,) in rad, which it may use only through `Walk.observed`; returns a
        `ViewEstimate`.  A method without this function needs a known view.
    title : str
        Short title of panels; the style's label by default.
    baseline : str
        Name of the baseline that claims compare the method with; empty for none.
    prepare : callable, optional
        Takes the data set; returns the data that all folds share, before the folds are divided among processes.
    files : sequence of Path
        Files that the method reads; results are recomputed if they change.
    of_other_people : bool
        True if the method brings a model of people outside the data: ``model.prior=NAME`` adds it.
    source : str
        Module of the plug-in with the method; results are recomputed if the module changes.
    """

    name: str
    style: Style
    reconstruct: Callable[[Fold, Walk, np.ndarray], np.ndarray | Reconstruction]
    estimate: Callable[[Fold, Walk, np.ndarray], Any] | None = None
    title: str = ""
    baseline: str = ""
    prepare: Callable[[FourierSamples], Any] | None = None
    files: Sequence[Path] = ()
    of_other_people: bool = False
    source: str = ""

    @property
    def modules(self) -> list[str]:
        """Names of the modules whose source code affects the results of the method."""
        parts = (self.reconstruct, self.estimate, getattr(self.prepare, "func", self.prepare))
        return [*filter(None, (self.source, *(getattr(part, "__module__", "") for part in parts)))]

    def prepared(self, data: FourierSamples) -> Any:
        """Return data that the method computes once from a data set, for the walks of all held-out people."""
        return self.prepare(data) if self.prepare else None

    def apply(self, fold: Fold, walk: Walk, views: np.ndarray) -> Reconstruction:
        """Return the reconstructions of a walk from views (A,), rad.

        Raises
        ------
        InvalidInput
            If the method returns another shape than (A, 5, 15), or numbers that are not finite.
        """
        result = self.reconstruct(fold, walk, views)
        walker = unflatten(walk.sample)
        shape = (len(views), *walker.shape[:2])
        try:
            missing = np.asarray(result.missing if isinstance(result, Reconstruction) else result, float)
        except (TypeError, ValueError):
            missing = np.empty(0)
        if missing.shape != shape or not np.isfinite(missing[..., walk.measured]).all():
            raise InvalidInput(
                "the method must return an array (views, harmonics, joints) of finite numbers",
                self.name,
                shape,
                missing.shape or type(result).__name__,
                code="wrong_result",
            )
        if isinstance(result, Reconstruction):
            return result
        turned = np.asarray(views)[:, None, None]
        full = camera.combine(camera.project(walker, turned), missing, turned)
        return Reconstruction(
            missing=missing,
            delta=camera.missing_dimension(walker, turned) - missing,
            coefficients=linear_model.coefficients(
                fold.model, linear_model.flatten(full), measured=walk.measured
            ),
        )


# --- the papers' approaches and their baselines -----------------------------------------------------------


def _from_image(fold: Fold, walk: Walk, views: np.ndarray, noise_variance: float | None) -> Reconstruction:
    """Return the estimate of an approach [zhang2007 3.5, 3.6].

    Joints that were not measured have the position that the estimated model expects.
    """
    measured_model = linear_model.of_measured(fold.model, walk.measured)
    estimate = reconstruction.from_known_views(
        measured_model, walk.sample, views, noise_variance=noise_variance
    )
    missing = estimate.missing
    if not walk.measured.all():
        walkers = unflatten(fold.model.mean + estimate.coefficients @ fold.model.components)
        expected = camera.missing_dimension(walkers, views[:, None, None])
        missing = np.where(walk.measured, missing, expected)
    return Reconstruction(missing, estimate.delta, estimate.coefficients)


def _least_squares(fold: Fold, walk: Walk, views: np.ndarray) -> Reconstruction:
    return _from_image(fold, walk, views, None)


def _map(fold: Fold, walk: Walk, views: np.ndarray) -> Reconstruction:
    return _from_image(fold, walk, views, fold.noise_variance_mm2)


def _average_walker(fold: Fold, walk: Walk, views: np.ndarray) -> Reconstruction:
    """Return the depth of the average walker, a baseline that does not depend on the image [zhang2007 3.16]."""
    turned = views[:, None, None]
    measured_model = linear_model.of_measured(fold.model, walk.measured)
    return Reconstruction(
        missing=camera.missing_dimension(unflatten(fold.model.mean), turned),
        delta=camera.missing_dimension(unflatten(walk.sample - measured_model.mean), turned),
        coefficients=np.empty((len(views), 0)),
    )


LEAST_SQUARES = Method(
    "least_squares",
    Style("approach I (least squares)", "least_squares"),
    _least_squares,
    title="Approach I",
    baseline="least_squares_1",
)
MAP = Method(
    "map",
    Style("approach II (MAP)", "map", line="dashed"),
    _map,
    title="Approach II",
    baseline="map_1",
)
PUBLISHED = {method.name: method for method in (LEAST_SQUARES, MAP)}
"""The two approaches of the papers, with which every sweep runs by default."""


def _with_one_eigenwalker(method: Method, label: str, colour: str) -> Method:
    """Return the baseline of an approach, which is the same estimator with the first eigenwalker only."""
    return Method(
        method.baseline,
        Style(label, colour, line="dotted", banded=False, interval=False),
        lambda fold, *arguments: method.reconstruct(fold.with_one_eigenwalker, *arguments),
    )


AVERAGE_WALKER = Method(
    "average_walker",
    Style("average walker", "baseline", line="dotted", banded=False, interval=False),
    _average_walker,
)
BASELINES = {
    method.name: method
    for method in (
        AVERAGE_WALKER,
        _with_one_eigenwalker(LEAST_SQUARES, "one eigenwalker, least squares", "amber"),
        _with_one_eigenwalker(MAP, "one eigenwalker, MAP", "sky"),
    )
}
"""Baseline methods, which every sweep evaluates in addition to the methods that it compares."""


# --- the registry -----------------------------------------------------------------------------------------

_FREE_COLOURS = [colour for colour in CYCLE if colour not in ("black", "orange", "blue", "green")]
"""Colours for methods whose style names no colour, in the order in which they are assigned."""


def registered() -> dict[str, Method]:
    """Return all methods that options can name: the papers' approaches, and the methods of plug-ins.

    Raises
    ------
    InvalidInput
        If a plug-in's method has the name of another, is not a `Method`, or has an unknown colour.
    """
    methods = dict(PUBLISHED)
    for origin, method in plugins.contributions("methods"):
        if not isinstance(method, Method):
            raise InvalidInput(
                "methods must be values of the class Method",
                origin.name,
                received=type(method).__name__,
                code="wrong_type",
            )
        if method.name in methods or method.name in BASELINES:
            raise InvalidInput(
                f"a method named {method.name!r} exists already",
                origin.name,
                "another name",
                code="duplicate_name",
            )
        colour = method.style.colour or _FREE_COLOURS[(len(methods) - len(PUBLISHED)) % len(_FREE_COLOURS)]
        require_choice(f"the colour of {method.name}", colour, NAMES)
        style = replace(method.style, colour=colour)
        methods[method.name] = replace(method, style=style, source=origin.module)
    return methods


def chosen(names: Sequence[str], name: str = "sweep.methods") -> list[Method]:
    """Return the methods with the given names. Raises InvalidInput, with all valid names, for an unknown name."""
    methods = registered()
    if plugins.failures() and (unknown := [each for each in names if each not in methods]):
        lacking = ", ".join(plugins.failures())
        raise InvalidInput(
            f"must be the name of a method; the plug-in {lacking} could not be loaded",
            name,
            received=unknown[0],
            code="unknown_choice",
            value=unknown[0],
        )
    return [methods[require_choice(name, each, methods)] for each in names]


def with_baselines(methods: Sequence[Method]) -> list[Method]:
    """Return the given methods, followed by the average walker and the baseline of each method."""
    return [*methods, AVERAGE_WALKER, *(BASELINES[each.baseline] for each in methods if each.baseline)]


def modules(names: Sequence[str]) -> list[str]:
    """Return the names of the modules that implement the methods with these names."""
    return [module for method in chosen(names) for module in method.modules]


def files(names: Sequence[str]) -> dict[str, Path]:
    """Return the data files that the methods read, by the names of method and file."""
    return {f"{method.name} {path.name}": path for method in chosen(names) for path in method.files}


def styles(names: Sequence[str]) -> dict[str, Style]:
    """Return the chart styles of the named methods and of all baselines, by name."""
    compared = chosen([name for name in names if name not in BASELINES])
    return {each.name: each.style for each in (*compared, *BASELINES.values())}


def _require_registered(name: str, names: Sequence[str]) -> None:
    require_distinct(name, names)
    chosen(names, name)


Methods = Annotated[list[str], _require_registered]
"""Type of an option that lists names of registered methods, without duplicates."""


VIEW: dict[str, Any] = {"x": "view_angle_deg", "abscissa": Axis(ticks=30)}
"""Table column and axis label of charts that show a quantity against view angle."""

STRIP_DEG = 10.0
"""Width of the ranges into which the view angles are divided, degrees.

The bands of frontal, oblique and profile views end at multiples of this width.
"""


def middles_of_strips(views: Grid) -> Grid:
    """Divide a grid of view angles into ranges of equal width, and return the midpoint of each range.

    The grid itself is returned if its step is at least as wide as a strip.

    All strips have the same weight, as in the whole grid, so that means over the middles estimate means over all views.

    Examples
    --------
    >>> middles_of_strips(Grid(start=-20, stop=20, step=1)).values("views")
    array([-15.,  -5.,   5.,  15.])
    """
    if views.step >= STRIP_DEG or views.stop - views.start < STRIP_DEG:
        return views
    return Grid(start=views.start + STRIP_DEG / 2, stop=views.stop - STRIP_DEG / 2, step=STRIP_DEG)
