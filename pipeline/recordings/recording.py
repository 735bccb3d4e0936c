"""Recordings for the rerun viewer: skeletons, curves, spectra and matrices, with a layout and a description.

A `Recording` is a view of results, never their record: it can always be made again from the tables.
The library underneath lets many mistakes pass in silence, so everything is checked here first.

Conventions
-----------
Callers speak millimetres; the file holds metres, which is what the viewer's grid and camera assume.
World: right-handed, x right, y forward, z up: the viewer's own default, so nothing has to say so.
Images: the viewer's vertical axis points down, so the file holds minus the vertical coordinate.
A timeline called ``time`` is a duration in seconds; every other one is a sequence of integers
(``view_angle_deg``, ``sigma2_mm2``, ``frame``).  The viewer plots against the timeline that is open and
shows nothing that has no row on it, hence one recording per abscissa: all that moves has rows on the
recording's own timeline.  Reading back, checking and looking: `pipeline.recording_check`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import rerun as rr

from pipeline.recordings import layout as recording_layout
from pipeline.recordings.columns import COLOURS, body, finite, partitioned, require, rgb, time_column
from pipeline.recordings.layout import (
    METRES,
    Bars,
    Extent,
    Image2D,
    Matrix,
    Notes,
    Plot,
    Space3D,
    Split,
    View,
)

__all__ = ["COLOURS", "Bars", "Image2D", "Matrix", "Notes", "Plot", "Recording", "Space3D", "Split", "View"]

_LAST_WORDS = b"RRF2FOOT"
"""Before the version at the end of every whole file."""


class Recording:
    """A recording being written: on leaving ``with`` it stands complete under its name, or not at all.

    Parameters
    ----------
    path : Path
        Where the ``.rrd`` goes; the folder must exist.
    name : str
        Letters, digits and underscores; recordings of one name share a layout in the viewer.
    about : str
        Description in Markdown, shown by `Notes`.
    timeline : str
        The abscissa: the timeline on which everything that moves has rows.
    edition : str
        Tells apart recordings of one name that may be open together (data set, scale).

    Raises
    ------
    InvalidInput
        If a name is not safe, the folder is missing or, on leaving, there is no layout.
    """

    def __init__(
        self, path: Path, *, name: str, about: str, timeline: str = "time", edition: str = ""
    ) -> None:
        for what, word in (("recording", name), ("timeline", timeline)):
            safe = re.fullmatch(r"[A-Za-z0-9_]{1,120}", word) is not None
            require(safe, f"the name of the {what} is not safe", "", "letters, digits, _", repr(word))
        self.path, self.name, self.timeline = Path(path), name, timeline
        folder = self.path.parent
        require(folder.is_dir(), "the folder of the recording does not exist", str(folder))
        require(bool(about.strip()), "the recording has no description", name)
        self._partial = self.path.with_name(f".{self.path.stem}.{os.getpid()}.part.rrd")
        self._about, self._edition = about, edition
        self._extents: dict[str, Extent | None] = {}  # every entity, with the box around what it draws
        self._layout = False

    def __enter__(self) -> Recording:
        # Fixed ids and no properties: a clock or a random id would make equal recordings differ.
        identity = f"{self.name} {self._edition}".strip()
        self._stream = rr.RecordingStream(self.name, recording_id=identity, send_properties=False)
        self._stream.set_log_time_enabled(False)
        self._stream.save(self._partial)
        self._stream.send_recording_name(identity)
        self._claim("about")
        self._static("about", rr.TextDocument(self._about, media_type=rr.MediaType.MARKDOWN))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._stream.disconnect()  # writes the footer; a flush would leave the file without one
            if kind is None:
                require(self._layout, "the recording has no layout", self.name, "a call of blueprint")
                with self._partial.open("rb") as written:
                    os.fsync(written.fileno())
                    written.seek(-min(self._partial.stat().st_size, len(_LAST_WORDS) + 4), os.SEEK_END)
                    # The library's writer only logs what a full disk does to it.
                    whole = _LAST_WORDS in written.read()
                require(
                    whole, "cannot write results: the recording was cut short", self.path.name, "room for it"
                )
                self._partial.replace(self.path)
        finally:
            self._partial.unlink(missing_ok=True)

    def skeleton(
        self,
        entity: str,
        positions_mm: np.ndarray,
        bones: Sequence[tuple[int, int]],
        *,
        index: Mapping[str, np.ndarray],
        colour: str = "grey",
        thickness_mm: float = 7.0,
    ) -> None:
        """Add a moving skeleton in space: joints as points and bones as line strips, on one entity.

        Parameters
        ----------
        entity : str
            E.g. ``"world/original/walker_07"``.
        positions_mm : (T, J, 3) float
            Millimetres; NaN hides a joint and its bones.
        bones : sequence of (int, int)
            Pairs of joints.
        index : mapping of str to (T,) array
            Timeline → strictly increasing values: seconds for ``time``, integers for any other.
        colour : str
            One of `COLOURS`; there are no dashed lines in space, so colour alone tells methods apart.
        thickness_mm : float
            Radius of the bones; the joints' is half as large again.

        Raises
        ------
        InvalidInput
            If shapes, bones or timelines do not fit, or the entity has been used.
        """
        self._body(entity, positions_mm, bones, index, colour, thickness_mm, (rr.Points3D, rr.LineStrips3D))

    def image_points(
        self,
        entity: str,
        points_mm: np.ndarray,
        bones: Sequence[tuple[int, int]],
        *,
        index: Mapping[str, np.ndarray],
        colour: str = "grey",
        thickness_mm: float = 7.0,
    ) -> None:
        """Add a moving skeleton in an image, `points_mm` (T, J, 2) right and up; the rest as `skeleton`."""
        self._body(entity, points_mm, bones, index, colour, thickness_mm, (rr.Points2D, rr.LineStrips2D))

    def _body(
        self,
        entity: str,
        positions_mm: np.ndarray,
        bones: Sequence[tuple[int, int]],
        index: Mapping[str, np.ndarray],
        colour: str,
        thickness_mm: float,
        archetypes: tuple[Any, Any],
    ) -> None:
        points, strips = archetypes
        space = 3 if points is rr.Points3D else 2
        joints, ends, extent = body(entity, positions_mm, bones, space)
        columns = self._claim(entity, extent, index, len(joints))
        colours, radius = rgb(colour), thickness_mm * METRES
        self._static(entity, points.from_fields(colors=colours, radii=1.5 * radius))
        self._static(entity, strips.from_fields(colors=colours, radii=radius))
        dots = partitioned(points.columns(positions=joints.reshape(-1, space)), *joints.shape[:2])
        lines = partitioned(strips.columns(strips=ends.reshape(-1, 2, space)), *ends.shape[:2])
        self._stream.send_columns(entity, indexes=columns, columns=[*dots, *lines])

    def curve(
        self,
        entity: str,
        x: np.ndarray,
        y: np.ndarray,
        *,
        label: str,
        sd: np.ndarray | None = None,
        colour: str = "blue",
        width: float = 2.0,
    ) -> None:
        """Add a curve over the recording's timeline.

        Parameters
        ----------
        entity : str
            E.g. ``"curves/absolute_error_mm2/map"``.
        x : (N,) array
            Strictly increasing; integers unless the timeline is ``time`` (seconds).
        y : (N,) array
        label : str
            What the legend says.
        sd : (N,) array, optional
            Standard deviation, drawn as a band of one on either side.
        colour : str
            One of `COLOURS`.
        width : float
            Of the line, in points of the screen.

        Raises
        ------
        InvalidInput
            If lengths differ, numbers are not finite, or the entity has been used.
        """
        values = finite(entity, y)
        spread = np.zeros(len(values)) if sd is None else finite(entity, sd)
        fits = spread.shape == values.shape and spread.min() >= 0
        require(fits, "a spread that does not fit", entity, f"{len(values)} numbers ≥ 0", str(len(spread)))
        places = finite(entity, x)
        low, high = float((values - spread).min()), float((values + spread).max())
        extent = Extent((float(places[0]), low), (float(places[-1]), high))
        columns = self._claim(entity, extent, {self.timeline: places}, len(values))
        style: dict[str, Any] = {"names": label, "colors": rgb(colour), "widths": width}
        if sd is None:
            self._static(entity, rr.SeriesLines.from_fields(**style))
            data = rr.Scalars.columns(scalars=values)
        else:
            self._static(entity, rr.Measurements.from_fields(**style))
            data = rr.Measurements.columns(values=values, variances=spread**2)
        self._stream.send_columns(entity, indexes=columns, columns=partitioned(data, len(values), 1))

    def bars(self, entity: str, values: np.ndarray, abscissa: np.ndarray, *, colour: str = "blue") -> None:
        """Add a bar chart of `values` (N,) over `abscissa` (N,)."""
        heights, places = finite(entity, values), finite(entity, abscissa)
        fits = heights.shape == places.shape
        require(fits, "not as many bars as places", entity, str(len(places)), str(len(heights)))
        self._claim(entity)
        self._static(entity, rr.BarChart(heights, abscissa=places, color=rgb(colour)))

    def matrix(
        self, entity: str, array: np.ndarray, *, paths: Mapping[str, tuple[np.ndarray, str]] | None = None
    ) -> None:
        """Add a matrix as a coloured image, dark low and bright high, with paths drawn over it.

        Parameters
        ----------
        entity : str
            E.g. ``"matrices/distances"``.
        array : (R, C) float
            Row 0 is shown at the top; finite, since the viewer draws NaN like the lowest number.
        paths : mapping of str to ((N, 2) array, colour), optional
            Name → (row, column) of each point of a line, and one of `COLOURS`.

        Raises
        ------
        InvalidInput
            If shapes do not fit or the entity has been used.
        """
        a = np.asarray(array, dtype=np.float32)
        fits = a.ndim == 2 and 0 not in a.shape and bool(np.isfinite(a).all())
        require(fits, "not a matrix of finite numbers", entity, "(R, C)", f"shape {a.shape}")
        self._claim(entity)
        span = (float(a.min()), float(a.max()))
        self._static(entity, rr.DepthImage(a, colormap="viridis", depth_range=span))
        for name, (path, colour) in (paths or {}).items():
            line = np.asarray(path, dtype=np.float32)
            fits = line.ndim == 2 and line.shape[1] == 2 and bool(np.isfinite(line).all())
            require(fits, "a path of the wrong shape", f"{entity}/{name}", "(N, 2)", str(line.shape))
            self._claim(f"{entity}/{name}")
            middle = line[:, ::-1] + 0.5  # (column, row) of the middle of a cell
            self._static(f"{entity}/{name}", rr.LineStrips2D([middle], colors=rgb(colour), radii=0.15))

    def blueprint(self, layout: View | Split, *, playing: bool = False) -> None:
        """Say what the viewer opens on; call once, after everything has been added.

        Parameters
        ----------
        layout : View or Split
        playing : bool
            Start by playing in a loop (a walker that walks), not paused at the first row.

        Raises
        ------
        InvalidInput
            If a view would be empty, or the recording has a layout already.
        """
        require(not self._layout, "the recording has a layout already", self.name)
        self._stream.send_blueprint(
            recording_layout.blueprint(layout, timeline=self.timeline, extents=self._extents, playing=playing)
        )
        self._layout = True

    def _static(self, entity: str, archetype: Any) -> None:
        self._stream.log(entity, archetype, static=True)

    def _claim(
        self,
        entity: str,
        extent: Extent | None = None,
        index: Mapping[str, np.ndarray] | None = None,
        rows: int = 0,
    ) -> list[rr.TimeColumn]:
        """Time columns of an entity, which can be taken once: static data would hide what moves."""
        safe = re.fullmatch(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*", entity) is not None
        require(safe, "the path of an entity is not safe", repr(entity), "words with / between")
        require(entity not in self._extents, "the entity has been used already", entity)
        if index is not None:
            reason = "nothing would be shown without rows on the recording's timeline"
            require(self.timeline in index, reason, entity, self.timeline, ", ".join(index))
        columns = [time_column(entity, timeline, v, rows) for timeline, v in (index or {}).items()]
        self._extents[entity] = extent
        return columns
