"""Methods that reconstruct a walk from one view: the papers' two approaches, baselines, and those of plug-ins.

A method is a value with a name, its words and style, and ``reconstruct(fold, walk, views)``.  Sweeps, tables, pictures
and recordings loop over the chosen ones; options name them, and a name that is not registered is an error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
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
    """One walk reconstructed from A views.

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
    """A held-out walk, seen from known views.

    Attributes
    ----------
    number : int
        Row of the data set.
    sample : (D,)
        Fourier representation, flattened; 0 at joints that were not measured.
    measured : (15,) bool
    """

    number: int
    sample: np.ndarray
    measured: np.ndarray

    def observed(self, views: np.ndarray) -> np.ndarray:
        """Return the image (A, 5, 15, 2) of the walk from A views (A,) in rad: horizontal and vertical, mm."""
        return camera.project(unflatten(self.sample), np.asarray(views)[:, None, None])


@dataclass(frozen=True)
class Fold:
    """What a method may learn from: the walks of all people but the one whose walk is held out.

    Attributes
    ----------
    model : LinearModel
        Average walker and eigenwalkers, learnt without the person.
    data : FourierSamples
        Data set; `training` has the walks of the other people.
    person : str
        Person who is held out.
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
        """Fourier representations (n, 5, 15, 3) of the other people's walks of which every joint was measured, mm."""
        return self.data.coefficients[(self.data.person != self.person) & ~self.data.unmeasured.any(axis=1)]

    @cached_property
    def with_one_eigenwalker(self) -> Fold:
        """The fold with the first eigenwalker alone."""
        return replace(self, model=linear_model.truncated(self.model, 1))


def held_out(
    data: FourierSamples, model: Eigenwalkers, number: int, noise_variance_mm2: float
) -> tuple[Fold, Walk]:
    """Return the fold without the person of a walk, and the walk."""
    measured = ~data.unmeasured[number]
    fold = Fold(model.fold(number), data, str(data.person[number]), noise_variance_mm2)
    return fold, Walk(number, linear_model.without_joints(model.samples[number], measured), measured)


@dataclass(frozen=True)
class Method:
    """A method that reconstructs a walk from one view.

    Attributes
    ----------
    name : str
        Name in options, tables and recordings.
    style : Style
        Label, colour and line in pictures and recordings.
    reconstruct : callable
        Given the `Fold`, the `Walk` and views (A,) in rad, returns the missing dimension (A, 5, 15) in mm at phase
        zero, or a `Reconstruction`.
    estimate : callable, optional
        Given the `Fold`, the `Walk` and views (A,) in rad that it must not read from its arguments except through
        `Walk.observed`, returns a `ViewEstimate`; without it the method needs a known view.
    title : str
        Short title of panels; the style's label by default.
    baseline : str
        Name of the baseline that replaces it in claims; empty for none.
    prepare : callable, optional
        Given the data set, returns what all folds share, before they are divided among processes.
    source : str
        Module of the plug-in that brings the method: results are computed again if it changes.
    """

    name: str
    style: Style
    reconstruct: Callable[[Fold, Walk, np.ndarray], np.ndarray | Reconstruction]
    estimate: Callable[[Fold, Walk, np.ndarray], Any] | None = None
    title: str = ""
    baseline: str = ""
    prepare: Callable[[FourierSamples], Any] | None = None
    source: str = ""

    @property
    def modules(self) -> list[str]:
        """Modules whose sources compute the method."""
        parts = (self.reconstruct, self.estimate, self.prepare)
        return [*filter(None, (self.source, *(getattr(part, "__module__", "") for part in parts)))]

    def prepared(self, data: FourierSamples) -> Any:
        """Return what all folds of a data set share."""
        return self.prepare(data) if self.prepare else None

    def apply(self, fold: Fold, walk: Walk, views: np.ndarray) -> Reconstruction:
        """Return the reconstruction of a walk from A views (A,) in rad.

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
                "the method must return finite numbers (views, harmonics, joints)",
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
    """Return the estimate [zhang2007 3.5, 3.6], with the model's expectation at joints that were not measured."""
    seen = linear_model.of_measured(fold.model, walk.measured)
    estimate = reconstruction.from_known_views(seen, walk.sample, views, noise_variance=noise_variance)
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
    """Return the depth of the average walker: the mean alone, without an estimator [zhang2007 3.16]."""
    turned = views[:, None, None]
    seen = linear_model.of_measured(fold.model, walk.measured)
    return Reconstruction(
        missing=camera.missing_dimension(unflatten(fold.model.mean), turned),
        delta=camera.missing_dimension(unflatten(walk.sample - seen.mean), turned),
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
"""The papers' own approaches: the default of every sweep."""


def _with_one_eigenwalker(method: Method, label: str, colour: str) -> Method:
    """Return the baseline of an approach: the same estimator with one eigenwalker."""
    return Method(
        method.baseline,
        Style(label, colour, line="dotted", banded=False, interval=False),
        lambda fold, *seen: method.reconstruct(fold.with_one_eigenwalker, *seen),
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
"""Baselines: they are evaluated with the methods that they are compared with."""


# --- the registry -----------------------------------------------------------------------------------------

_FREE_COLOURS = [colour for colour in CYCLE if colour not in ("black", "orange", "blue", "green")]
"""Colours of methods whose style names none, in this order."""


def registered() -> dict[str, Method]:
    """Return all methods that options can name: the papers' approaches, then those of plug-ins.

    Raises
    ------
    InvalidInput
        If a plug-in's method has the name of another, is not a `Method`, or has a colour that there is not.
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
                f"there is another method {method.name!r}",
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
    """Return the methods of these names.  Raises InvalidInput if one is not registered; the sentence lists them."""
    methods = registered()
    if plugins.failures() and (unknown := [each for each in names if each not in methods]):
        lacking = ", ".join(plugins.failures())
        raise InvalidInput(
            f"must be a method that is loaded; the plug-in {lacking} is not",
            name,
            received=unknown[0],
            code="unknown_choice",
            value=unknown[0],
        )
    return [methods[require_choice(name, each, methods)] for each in names]


def with_baselines(methods: Sequence[Method]) -> list[Method]:
    """Return methods, the average walker, and the baseline of each that has one."""
    return [*methods, AVERAGE_WALKER, *(BASELINES[each.baseline] for each in methods if each.baseline)]


def modules(names: Sequence[str]) -> list[str]:
    """Return the modules that compute these methods."""
    return [module for method in chosen(names) for module in method.modules]


def styles(names: Sequence[str]) -> dict[str, Style]:
    """Return the styles of methods and then of all baselines, by name."""
    tried = chosen([name for name in names if name not in BASELINES])
    return {each.name: each.style for each in (*tried, *BASELINES.values())}


def _require_registered(name: str, names: Sequence[str]) -> None:
    require_distinct(name, names)
    chosen(names, name)


Methods = Annotated[list[str], _require_registered]
"""Names of methods, each once."""


VIEW: dict[str, Any] = {"x": "view_angle_deg", "abscissa": Axis(ticks=30)}
"""Abscissa of charts over the view angle."""

STRIP_DEG = 10.0
"""Width of a strip of view angles; the bands of frontal, oblique and profile views end on it."""


def middles_of_strips(views: Grid) -> Grid:
    """Return the middles of strips of a grid of view angles, or itself if its steps are as wide.

    Each strip weighs the same, as in the whole grid: a mean over its views and one over the middles are one quantity.

    Examples
    --------
    >>> middles_of_strips(Grid(start=-20, stop=20, step=1)).values("views")
    array([-15.,  -5.,   5.,  15.])
    """
    if views.step >= STRIP_DEG or views.stop - views.start < STRIP_DEG:
        return views
    return Grid(start=views.start + STRIP_DEG / 2, stop=views.stop - STRIP_DEG / 2, step=STRIP_DEG)
