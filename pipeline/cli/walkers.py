"""Walkers that commands read from a figure's folder, a recording, or reconstructed keypoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import formats, mappings
from pipeline.cli.options import Options, filled
from pipeline.cli.output import exists, tell
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
"""Name of the file that every output folder of `reconstruct` contains, even without a walk."""
FIGURES = "a newly made folder of zhang2007_fig4, zhang2007_fig5, zhang2004_fig3 or zhang2004_fig4"


@dataclass(frozen=True)
class Walk:
    """Walk of one person as a Fourier representation.

    Attributes
    ----------
    name : str
        Name of the walker and method of reconstruction, for captions.
    coefficients : (1 + 2H, 15, 3)
        Fourier coefficients in mm, z up.
    stride_hz : float
    unmeasured : (15,) bool
        Joints that were estimated from the others or dropped.
    speed_mm_s : float
        Speed over the ground; 0 if unknown.
    """

    name: str
    coefficients: np.ndarray
    stride_hz: float
    unmeasured: np.ndarray
    speed_mm_s: float = 0.0


def options_of(arguments: Sequence[str], kind: type[Options], *, usage: str) -> tuple[str, Options]:
    """Return the walker's source (a file, a folder or a name) from the arguments, and the options of the command.

    Raises
    ------
    InvalidInput
        If an option is unknown or has the wrong type, or the arguments do not name exactly one source.
    """
    sources = [item for item in arguments if "=" not in item or exists(item)]
    options = filled(kind, [item for item in arguments if item not in sources])
    if len(sources) != 1:
        raise InvalidInput(
            "name exactly one source: a file, a folder or a known name",
            expected=usage,
            received=" ".join(arguments)[:80] or "nothing",
            code="no_source",
            typed=True,
        )
    return sources[0], options


def kind_of(source: str, arguments: Sequence[str], of: Mapping[str, str]) -> str:
    """Return the kind of a walker's source, such as a recording; reject options without effect on this kind.

    Parameters
    ----------
    source : str
    arguments : sequence of str
    of : mapping of str to str
        Kinds of sources by option: figure, film (a folder of `reconstruct`), recording, synthetic, author.
    """
    path, kind = Path(source), source
    if path.exists() or source not in ("synthetic", "author"):
        kind = "film" if (path / SUMMARY).is_file() else "figure" if path.is_dir() else "recording"
    for name in (item.partition("=")[0] for item in arguments):
        if kind not in of.get(name, kind):
            raise InvalidInput(
                "the option has no effect on walkers from this kind of source",
                name,
                of[name],
                kind,
                code="no_effect",
                typed=True,
            )
    return kind


def target_file(to: str, suffixes: Sequence[str], usage: str, source: str, *, replace: bool) -> Path:
    """Return the path in ``to=``, after checking that its suffix is supported and that the file may be written."""
    if not to:
        raise InvalidInput("name the output file by to=FILE", expected=usage, code="no_target")
    target = Path(to)
    if target.suffix.lower() not in suffixes:
        expected = f"end in {', '.join(suffixes[:-1])} or {suffixes[-1]}"
        raise InvalidInput(f"must {expected}", "to", received=target.name, code="unknown_format")
    require_new(target, replace=replace, sources=[source])
    return target


class FigureWalkers:
    """Recorded and reconstructed walkers in a figure's folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    InvalidInput
        If the folder contains no reconstructed motion.
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
            raise InvalidInput(
                "the folder does not contain a figure: arrays.npz is missing", folder, code="no_figure"
            )
        try:
            self._arrays = read_arrays(path)
        except InvalidInput:
            raise InvalidInput(
                "the figure's file of arrays is damaged: make the figure again", path, code="unreadable"
            ) from None
        if lacking := needed - set(self._arrays):
            received = f"arrays.npz without {', '.join(sorted(lacking))}"
            what = "this figure contains no reconstructed motion"
            raise InvalidInput(what, folder, FIGURES, received, code="no_motion")

    def original(self, name: str) -> Walk:
        """Return the recorded walker with a given name; by default the first walker."""
        with as_written(self._folder):
            r, facts = self._index(name), ("walker", "original", "stride_hz", "unmeasured")
            return Walk(*(self._arrays[fact][r] for fact in facts))

    def reconstructed(self, name: str, method: str, view_angle_deg: float | None) -> Walk:
        """Return a walker that a method reconstructed from one view.

        If the figure contains the training data of its model, every view is available, else only the demonstrated ones.

        Parameters
        ----------
        name, method : str
        view_angle_deg : float, optional
            View angle; by default the first demonstrated view of the figure.
        """
        walk = self.original(name)
        with as_written(self._folder):
            views, methods = self._arrays["demonstration_view_deg"], self._arrays["methods"].tolist()
            m = methods.index(require_choice("method", method, methods))
            view = views[0] if view_angle_deg is None else view_angle_deg
            near = np.flatnonzero(np.abs(views - view) < 1e-6)
            missing = (
                self._arrays["missing"][m, self._index(name), near[0]]
                if near.size
                else self._from_view(self._index(name), methods[m], view)
            )
            angle = np.radians(view)
            again = camera.combine(camera.project(walk.coefficients, angle), missing, angle)
        return replace(walk, name=f"{walk.name}, {method} from {view:g}°", coefficients=again)

    def _index(self, name: str) -> int:
        walkers = self._arrays["walker"].tolist()
        return walkers.index(require_choice("walker", name or walkers[0], walkers))

    def _from_view(self, r: int, method: str, view_angle_deg: float) -> np.ndarray:
        """Return the missing dimension (5, 15), mm, of a walker for any view, by a model learnt from other people."""
        require_range("view_angle_deg", view_angle_deg, at_least=-180, at_most=180)
        listed_views = ", ".join(f"{view:g}" for view in self._arrays["demonstration_view_deg"])
        stored = {"samples", "person", "residual_covariance_mm2"} <= set(self._arrays)
        options = read_manifest(self._folder, FIGURE)["configuration"] if stored else {}
        model, sweep = options.get("model", {}), options.get("sweep", {})
        as_computed = stored and self._arrays["samples"].shape[1] == 225 and model.get("mirror") is False
        if not as_computed:
            expected = f"{listed_views}; for others make the figure with sweep.demonstration_views_deg"
            raise InvalidInput("the figure has no reconstruction from this view", "view_angle_deg",
                               expected, f"{view_angle_deg:g}", code="no_such_view", typed=True)  # fmt: skip
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
        # Joints that were not measured take the expectation of the eigenwalkers.
        of_model = linear_model.unflatten(fold.mean + views.coefficients[0] @ fold.components)
        return np.where(measured, views.missing[0], camera.missing_dimension(of_model, angle[0]))


def recorded_walk(
    path: Path, *, skeleton: str, units: str, subject: str = "", up: UpAxis = UpAxis.auto, harmonics: int = 2
) -> Walk:
    """Return the steady walk in a recording.

    Parameters
    ----------
    path : Path
    skeleton, units : str
        Mapping and unit, as for ``skeleton=`` and ``data.units=``; empty: recognised, and as stated in the file.
    subject : str
        Name of the person, for a file of several people.
    up : UpAxis
        Axis of the file that points up; ``auto``: found from the joints.
    harmonics : int

    Raises
    ------
    InvalidInput
        If the file cannot be read or contains no steady walk.
    """
    read = formats.read(path, units=units or None, up=up)
    read, positions, valid = joints_of(read, mappings.chosen(skeleton or mappings.AUTO), subject)
    for complaint in read.complaints:
        tell(complaint.sentence)
    return steady(path.name, positions, read.frame_rate_hz, valid, harmonics=harmonics, up=up)


def keypoint_walk(folder: Path, *, harmonics: int = 2) -> Walk:
    """Return the walk in the longest stretch of frames in a ``joints.csv`` that ``reconstruct`` wrote.

    Raises
    ------
    InvalidInput
        If the folder has no walk, or it is shorter than a stride, or the files do not come from ``reconstruct``.
    """
    stretches = read_one(folder / SUMMARY, _stretches)
    positions, rate, (strides, locomotion) = read_one(folder / "joints.csv", _longest, stretches=stretches)
    if strides < 1:
        what = "the film is too short for a walking cycle: use its motion in walk.c3d, .trc or .csv"
        raise InvalidInput(
            what, folder.name, "1 stride", f"{strides:g}", code="too_few_strides", strides=strides
        )
    # On a treadmill, or with a following camera, displacement is drift, not walking.
    ground = Locomotion.auto if locomotion == "overground" else Locomotion.treadmill
    return steady(folder.name, positions, rate, None, harmonics=harmonics, locomotion=ground)


def _stretches(path: Path) -> list[tuple[float, str]]:
    """Return the number of strides and the type of locomotion for each stretch of frames in ``summary.json``."""
    summary = read_json(path, dict[str, Any])
    if summary["verdict"] == "not_a_walk":
        reasons = "; ".join(map(str, summary["why"]))
        what = f"`reconstruct` wrote no motion, since the film shows no walk ({reasons:.200})"
        raise InvalidInput(what, path.parent.name, code="no_walk")
    return [
        (float(stretch.get("strides", 0)), stretch.get("locomotion", "")) for stretch in summary["stretches"]
    ]


def _longest(
    path: Path, stretches: Sequence[tuple[float, str]]
) -> tuple[np.ndarray, float, tuple[float, str]]:
    """Return joints (T, 15, 3), mm, rate, Hz, strides and locomotion of the longest stretch in ``joints.csv``."""
    table = tables.read(path)
    if lacking := {"stretch", "time_s", "x", "y", "z"} - set(table):
        what = f"the table is not from `reconstruct`: it has no column {sorted(lacking)[0]!r}"
        raise InvalidInput(what, path, code="no_column")
    numbers, counts = np.unique(table["stretch"], return_counts=True)
    rows = table["stretch"] == numbers[counts.argmax()]
    count = rows.sum()
    if count % len(WALKER15.joints) or count < 2 * len(WALKER15.joints):
        raise InvalidInput(
            "the longest stretch of frames lacks the rows of some joints",
            path,
            received=f"{count} rows",
            code="incomplete_frame",
        )
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
    """Return the Fourier representation of the steady walk in joints (T, 15, 3), mm, and print remarks on the walk."""
    prepared = walk_in(name, positions, frame_rate_hz, valid, up, locomotion=locomotion)
    if prepared.positions is None:
        code, values = prepared.row["code"], prepared.row["values"]
        raise InvalidInput(
            f"the motion is not a usable walk: {prepared.row['reason']}", name, code=code, **values
        )
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
