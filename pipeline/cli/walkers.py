"""Walkers that commands take from outside: of a figure's folder, of a recording, of reconstructed keypoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import formats, mappings
from pipeline.cli.options import Options, filled
from pipeline.cli.output import tell
from pipeline.clips.options import Locomotion
from pipeline.clips.walks import walk_in
from pipeline.core import camera, fourier, linear_model, reconstruction
from pipeline.formats.budget import read_one
from pipeline.ingestion.joints import joints_of
from pipeline.reading import as_written, read_arrays, read_json
from pipeline.skeleton import WALKER15
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.storage import tables
from pipeline.storage.publishing import require_new
from pipeline.storage.sealed_folders import FIGURE, read_manifest
from pipeline.validation import InvalidInput, require_choice, require_range

SUMMARY = "summary.json"
"""What a folder of `reconstruct` holds, also where nobody walks."""
FIGURES = "a folder of zhang2007_fig4, zhang2007_fig5, zhang2004_fig3 or zhang2004_fig4, made anew"


@dataclass(frozen=True)
class Walk:
    """One walker as a Fourier representation.

    Attributes
    ----------
    name : str
        Who, and how reconstructed, for captions.
    coefficients : (1 + 2H, 15, 3)
        mm, z up.
    stride_hz : float
    unmeasured : (15,) bool
        Joints that were estimated from the others or dropped.
    speed_mm_s : float
        Over the ground; 0: not known.
    """

    name: str
    coefficients: np.ndarray
    stride_hz: float
    unmeasured: np.ndarray
    speed_mm_s: float = 0.0


def options_of(arguments: Sequence[str], kind: type[Options], *, usage: str) -> tuple[str, Options]:
    """Return the one source that is named and the options of a command, with their defaults.

    Raises
    ------
    InvalidInput
        If an option is unknown or of another type, or none or several sources are named.
    """
    sources = [item for item in arguments if "=" not in item or Path(item).exists()]
    options = filled(kind, [item for item in arguments if item not in sources])
    if len(sources) != 1:
        raise InvalidInput(
            "one source is needed",
            expected=usage,
            received=" ".join(arguments)[:80] or "nothing",
            code="no_source",
        )
    return sources[0], options


def kind_of(source: str, arguments: Sequence[str], of: Mapping[str, str]) -> str:
    """Return the kind of a source, with options that change something; refuse those that would not.

    Parameters
    ----------
    source : str
    arguments : sequence of str
    of : mapping of str to str
        Which kinds of source have an option: figure, film (a folder of `reconstruct`), recording, synthetic, author.
    """
    path, kind = Path(source), source
    if path.exists() or source not in ("synthetic", "author"):
        kind = "film" if (path / SUMMARY).is_file() else "figure" if path.is_dir() else "recording"
    for name in (item.partition("=")[0] for item in arguments):
        if kind not in of.get(name, kind):
            raise InvalidInput("would change nothing here", name, of[name], kind, code="no_effect")
    return kind


def target_file(to: str, suffixes: Sequence[str], usage: str, source: str, *, replace: bool) -> Path:
    """Return the file ``to=`` that is to be written, whose suffix says the format."""
    if not to:
        raise InvalidInput("to=FILE is needed", expected=usage, code="no_target")
    target = Path(to)
    if target.suffix.lower() not in suffixes:
        expected = f"one that ends in {', '.join(suffixes[:-1])} or {suffixes[-1]}"
        raise InvalidInput("the format is unknown", "to", expected, target.name, code="unknown_format")
    require_new(target, replace=replace, sources=[source])
    return target


class FigureWalkers:
    """The walkers of a figure's folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    InvalidInput
        If the folder holds no reconstructed motion.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        path = folder / "arrays.npz"
        needed = {
            "walker",
            "methods",
            "demonstration_view_deg",
            "missing",
            "original",
            "stride_hz",
            "unmeasured",
        }
        if not path.is_file():
            raise InvalidInput("this is no folder of a figure", folder, "arrays.npz in it", code="no_figure")
        try:
            self._arrays = read_arrays(path)
        except InvalidInput:
            raise InvalidInput("is damaged", path, "the figure, made anew", code="unreadable") from None
        if lacking := needed - set(self._arrays):
            received = f"arrays.npz without {', '.join(sorted(lacking))}"
            what = "this figure holds no reconstructed motion"
            raise InvalidInput(what, folder, FIGURES, received, code="no_motion")

    def original(self, name: str) -> Walk:
        """Return a walker as recorded; the first if none is named."""
        with as_written(self._folder):
            r, facts = self._index(name), ("walker", "original", "stride_hz", "unmeasured")
            return Walk(*(self._arrays[fact][r] for fact in facts))

    def reconstructed(self, name: str, method: str, view_angle_deg: float | None) -> Walk:
        """Return a walker as reconstructed from a view: from any, where the figure holds what the model learns from.

        Parameters
        ----------
        name, method : str
        view_angle_deg : float, optional
            By default the figure's first demonstration.
        """
        walk = self.original(name)
        with as_written(self._folder):
            views, methods = self._arrays["demonstration_view_deg"], self._arrays["methods"].tolist()
            m = methods.index(require_choice("method", method, methods))
            wanted = views[0] if view_angle_deg is None else view_angle_deg
            near = np.flatnonzero(np.abs(views - wanted) < 1e-6)
            missing = (
                self._arrays["missing"][m, self._index(name), near[0]]
                if near.size
                else self._from_view(self._index(name), methods[m], wanted)
            )
            angle = np.radians(wanted)
            again = camera.combine(camera.project(walk.coefficients, angle), missing, angle)
        return replace(walk, name=f"{walk.name}, {method} from {wanted:g}°", coefficients=again)

    def _index(self, name: str) -> int:
        walkers = self._arrays["walker"].tolist()
        return walkers.index(require_choice("walker", name or walkers[0], walkers))

    def _from_view(self, r: int, method: str, view_angle_deg: float) -> np.ndarray:
        """The missing dimension (5, 15) from a view that the figure does not demonstrate, by the fold's own model."""
        require_range("view_angle_deg", view_angle_deg, at_least=-180, at_most=180)
        shown = ", ".join(f"{view:g}" for view in self._arrays["demonstration_view_deg"])
        stored = {"samples", "person", "residual_covariance_mm2"} <= set(self._arrays)
        options = read_manifest(self._folder, FIGURE)["configuration"] if stored else {}
        model, sweep = options.get("model", {}), options.get("sweep", {})
        as_computed = stored and self._arrays["samples"].shape[1] == 225 and model.get("mirror") is False
        if not as_computed:
            expected = (
                f"{shown}; or make the figure with sweep.demonstration_views_deg; or any, of zhang2007_fig5"
            )
            raise InvalidInput("the figure holds no reconstruction from this view", "view_angle_deg",
                               expected, f"{view_angle_deg:g}", code="no_such_view")  # fmt: skip
        samples, person = self._arrays["samples"], self._arrays["person"]
        fold = linear_model.fit(
            samples[person != person[r]], model["components"], divisor=model["divisor"]["name"]
        )
        measured, angle = ~self._arrays["unmeasured"][r], np.radians([view_angle_deg])
        views = reconstruction.from_known_views(
            linear_model.of_measured(fold, measured),
            linear_model.without_joints(samples[r], measured),
            angle,
            noise_variance=None if method == "least_squares" else float(sweep["noise_variance_mm2"]),
        )
        # Of joints that nobody measured, what the eigenwalkers expect.
        of_model = linear_model.unflatten(fold.mean + views.coefficients[0] @ fold.components)
        return np.where(measured, views.missing[0], camera.missing_dimension(of_model, angle[0]))


def recorded_walk(
    path: Path, *, skeleton: str, units: str, subject: str = "", up: UpAxis = UpAxis.auto, harmonics: int = 2
) -> Walk:
    """Return the steady walk of a recording.

    Parameters
    ----------
    path : Path
    skeleton, units : str
        As ``skeleton=`` and ``data.units=``; empty: recognised, and the file's own.
    subject : str
        Who, in a file of several people.
    up : UpAxis
        Axis of the file that points up; ``auto``: the one along which its joints stand.
    harmonics : int

    Raises
    ------
    InvalidInput
        If the file cannot be read or nobody walks steadily in it.
    """
    read = formats.read(path, units=units or None, up=up)
    read, positions, valid = joints_of(read, mappings.chosen(skeleton or mappings.AUTO), subject)
    for complaint in read.complaints:
        tell(complaint.sentence)
    return steady(path.name, positions, read.frame_rate_hz, valid, harmonics=harmonics, up=up)


def keypoint_walk(folder: Path, *, harmonics: int = 2) -> Walk:
    """Return the walk in the ``joints.csv`` that ``reconstruct`` wrote; the longest stretch of several.

    Raises
    ------
    InvalidInput
        If there is none, it lasts for less than a stride, or the files are not those of ``reconstruct``.
    """
    stretches = read_one(folder / SUMMARY, _stretches)
    positions, rate, (strides, locomotion) = read_one(folder / "joints.csv", _longest, stretches=stretches)
    if strides < 1:
        what = "the film holds less than a stride, of which no cycle is made: its motion is in walk.c3d, .trc and .csv"
        raise InvalidInput(
            what, folder.name, "1 stride", f"{strides:g}", code="too_few_strides", strides=strides
        )
    # Who walks on a belt, or is followed by the camera, drifts on it and does not walk there.
    ground = Locomotion.auto if locomotion == "overground" else Locomotion.treadmill
    return steady(folder.name, positions, rate, None, harmonics=harmonics, locomotion=ground)


def _stretches(path: Path) -> list[tuple[float, str]]:
    """Strides and locomotion of each stretch in a ``summary.json``; 0 strides of one that is no walk."""
    summary = read_json(path, dict[str, Any])
    if summary["verdict"] == "not_a_walk":
        what = "`reconstruct` found no walk, so that there is no motion"
        raise InvalidInput(
            what, path.parent.name, received="; ".join(map(str, summary["why"])), code="no_walk"
        )
    return [
        (float(stretch.get("strides", 0)), stretch.get("locomotion", "")) for stretch in summary["stretches"]
    ]


def _longest(
    path: Path, stretches: Sequence[tuple[float, str]]
) -> tuple[np.ndarray, float, tuple[float, str]]:
    """Joints (T, 15, 3) of the longest stretch in a ``joints.csv``, frames per second, and what is said of it."""
    table = tables.read(path)
    if lacking := {"stretch", "time_s", "x", "y", "z"} - set(table):
        received = f"no column {sorted(lacking)[0]}"
        raise InvalidInput("is no table of `reconstruct`", path, received=received, code="no_column")
    numbers, counts = np.unique(table["stretch"], return_counts=True)
    rows = table["stretch"] == numbers[counts.argmax()]
    count = rows.sum()
    if count % len(WALKER15.joints) or count < 2 * len(WALKER15.joints):
        raise InvalidInput("a frame is incomplete", path, received=f"{count} rows", code="incomplete_frame")
    positions = np.column_stack([table[axis][rows] for axis in "xyz"]).reshape(-1, len(WALKER15.joints), 3)
    times = table["time_s"][rows][:: len(WALKER15.joints)]
    rate = (len(times) - 1) / float(times[-1] - times[0])
    return positions.astype(float), rate, stretches[int(numbers[counts.argmax()])]


def steady(
    name: str,
    positions: np.ndarray,
    frame_rate_hz: float,
    valid: np.ndarray | None,
    *,
    harmonics: int,
    locomotion: Locomotion = Locomotion.auto,
    up: UpAxis = UpAxis.auto,
) -> Walk:
    """Return the Fourier representation of the steady part of joints (T, 15, 3), mm, and print remarks on it."""
    prepared = walk_in(name, positions, frame_rate_hz, valid, up, locomotion=locomotion)
    if prepared.positions is None:
        code, values = prepared.row["code"], prepared.row["values"]
        raise InvalidInput(f"no walk: {prepared.row['reason']}", name, code=code, **values)
    if remarks := prepared.row["reason"]:
        tell(remarks)
    series = fourier.represent(
        prepared.positions,
        frame_rate_hz,
        harmonics=harmonics,
        frequency_hz=prepared.row["frequency_hz"] if harmonics == 2 else None,
    )
    estimated = prepared.row["missing_joints"].split(", ")
    return Walk(
        name,
        series.coefficients,
        series.frequency_hz,
        np.array([joint in estimated for joint in WALKER15.joints]),
        prepared.row["speed_mm_s"],
    )
