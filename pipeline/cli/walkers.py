"""Walkers that commands take from outside: of a figure's folder, of a recording, of reconstructed keypoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipeline import formats, mappings
from pipeline.cli.options import Options, filled
from pipeline.clips.options import Steady
from pipeline.clips.usable import RawClip, report_row
from pipeline.clips.walks import REPORT_COLUMNS, steady_walk
from pipeline.core import camera, fourier
from pipeline.ingestion.corpus import joints_of
from pipeline.skeleton import WALKER15
from pipeline.storage import tables
from pipeline.storage.publishing import require_new
from pipeline.validation import InvalidInput, require_choice

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
            "one source is needed", expected=usage, received=" ".join(arguments)[:80] or "nothing"
        )
    return sources[0], options


def target_file(to: str, suffixes: Sequence[str], usage: str, source: str, *, replace: bool) -> Path:
    """Return the file ``to=`` that is to be written, whose suffix says the format."""
    if not to:
        raise InvalidInput("to=FILE is needed", expected=usage)
    target = Path(to)
    if target.suffix.lower() not in suffixes:
        expected = f"one that ends in {', '.join(suffixes[:-1])} or {suffixes[-1]}"
        raise InvalidInput("the format is unknown", where="to", expected=expected, received=target.name)
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
                "this is no folder of a figure", where=str(folder), expected="arrays.npz in it"
            )
        try:
            with np.load(path, allow_pickle=False) as stored:
                self._arrays = {name: stored[name] for name in stored.files}
        except (ValueError, OSError, KeyError):
            raise InvalidInput("is damaged", where=str(path), expected="the figure, made anew") from None
        if lacking := needed - set(self._arrays):
            received = f"arrays.npz without {', '.join(sorted(lacking))}"
            what = "this figure holds no reconstructed motion"
            raise InvalidInput(what, where=str(folder), expected=FIGURES, received=received)

    def original(self, name: str) -> Walk:
        """Return a walker as recorded; the first if none is named."""
        r = self._index(name)
        return Walk(
            str(self._arrays["walker"][r]),
            self._arrays["original"][r],
            float(self._arrays["stride_hz"][r]),
            self._arrays["unmeasured"][r],
        )

    def reconstructed(self, name: str, method: str, view_angle_deg: float | None) -> Walk:
        """Return a walker as reconstructed from one of the views that the figure demonstrates.

        Parameters
        ----------
        name, method : str
        view_angle_deg : float, optional
            By default the first.

        Raises
        ------
        InvalidInput
            If there is no such walker, method or view.
        """
        walk, views = self.original(name), self._arrays["demonstration_view_deg"]
        methods = self._arrays["methods"].tolist()
        m = methods.index(require_choice("method", method, methods))
        wanted = float(views[0]) if view_angle_deg is None else view_angle_deg
        near = np.flatnonzero(np.abs(views - wanted) < 1e-6)
        if not near.size:
            shown = ", ".join(f"{view:g}" for view in views)
            raise InvalidInput(
                "the figure holds no reconstruction from this view",
                where="view_angle_deg",
                expected=f"{shown}; or make the figure with sweep.demonstration_views_deg",
                received=f"{wanted:g}",
            )
        missing = self._arrays["missing"][m, self._index(name), int(near[0])]
        angle = np.radians(wanted)
        again = camera.combine(camera.project(walk.coefficients, angle), missing, angle)
        return replace(walk, name=f"{walk.name}, {method} from {wanted:g}°", coefficients=again)

    def _index(self, name: str) -> int:
        walkers = self._arrays["walker"].tolist()
        return walkers.index(require_choice("walker", name or walkers[0], walkers))


def recorded_walk(path: Path, *, skeleton: str, units: str, subject: str = "", harmonics: int = 2) -> Walk:
    """Return the steady walk of a recording.

    Parameters
    ----------
    path : Path
    skeleton, units : str
        As ``skeleton=`` and ``data.units=``; empty: recognised, and the file's own.
    subject : str
        Who, in a file of several people.
    harmonics : int

    Raises
    ------
    InvalidInput
        If the file cannot be read or nobody walks steadily in it.
    """
    read = formats.read(path, units=units or None)
    read, positions, valid = joints_of(read, mappings.chosen(skeleton or mappings.AUTO), subject)
    return steady(path.name, positions, read.frame_rate_hz, valid, harmonics=harmonics)


def keypoint_walk(folder: Path, *, harmonics: int = 2) -> Walk:
    """Return the walk in the ``joints.csv`` that ``reconstruct`` wrote; the longest stretch of several."""
    table = tables.read(folder / "joints.csv")
    if lacking := {"stretch", "frame", "time_s", "joint", "x", "y", "z"} - set(table):
        received = f"no column {sorted(lacking)[0]}"
        raise InvalidInput(
            "is no table of `reconstruct`", where=str(folder / "joints.csv"), received=received
        )
    stretches, counts = np.unique(table["stretch"], return_counts=True)
    rows = table["stretch"] == stretches[counts.argmax()]
    count = int(rows.sum())
    if count % len(WALKER15.joints) or count < 2 * len(WALKER15.joints):
        raise InvalidInput(
            "a frame is incomplete", where=str(folder / "joints.csv"), received=f"{count} rows"
        )
    positions = np.column_stack([table[axis][rows] for axis in "xyz"]).reshape(-1, len(WALKER15.joints), 3)
    times = table["time_s"][rows][:: len(WALKER15.joints)]
    rate = (len(times) - 1) / float(times[-1] - times[0])
    return steady(folder.name, positions.astype(float), rate, None, harmonics=harmonics)


def steady(
    name: str, positions: np.ndarray, frame_rate_hz: float, valid: np.ndarray | None, *, harmonics: int
) -> Walk:
    """Return the Fourier representation of the steady part of joints (T, 15, 3), mm."""
    row = report_row(REPORT_COLUMNS, clip=name)
    prepared = steady_walk(RawClip(row, positions, frame_rate_hz, valid), Steady())
    if prepared.positions is None:
        raise InvalidInput(f"no walk: {prepared.row['reason']}", where=name)
    series = fourier.represent(
        prepared.positions,
        frame_rate_hz,
        harmonics=harmonics,
        frequency_hz=float(prepared.row["frequency_hz"]) if harmonics == 2 else None,
    )
    estimated = prepared.row["missing_joints"].split(", ")
    return Walk(
        name,
        series.coefficients,
        series.frequency_hz,
        np.array([joint in estimated for joint in WALKER15.joints]),
        float(prepared.row["speed_mm_s"]),
    )
