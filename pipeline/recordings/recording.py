"""Recordings for the Rerun viewer: skeletons, curves, bar charts and matrices, a layout and a description."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import rerun as rr

from pipeline.charts import Chart, lines_of, on_timeline
from pipeline.recordings.columns import (
    band,
    body,
    camera_pose,
    partitioned,
    pinhole,
    rgb,
    time_column,
    vector,
)
from pipeline.recordings.hollow import RING, hollow_joints
from pipeline.recordings.layout import METRES, Extent, blueprint
from pipeline.scenes import Plot, Split, View
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput, require_finite, require_shape

_FOOTER = b"RRF2FOOT"
"""Bytes near the end of every complete recording file, in front of the version number."""

_FRUSTUM = 0.3
"""Length of a camera's frustum, relative to the distance from the camera to its image plane."""

_LINE_WIDTH = 2.0
"""Width of curves, points of the screen."""


class Recording:
    """Writer of a Rerun recording. The file is published when the recording is complete.

    Parameters
    ----------
    path : Path
        Path of the ``.rrd``; the folder must exist.
    words : str
        Text after `about`.
    name : str
        Letters, digits and underscores; recordings of the same name share a layout in the viewer.
    about : str
        Description in Markdown, shown by `Notes`.
    timeline : str
        Timeline of everything that moves: the abscissa.
    at : (T,) array
        Values of the timeline for skeletons that have none.
    edition : str
        Text that distinguishes recordings of the same name (data set, scale).
    charts : sequence of Chart
        Charts; those whose abscissa is `timeline` are added as curves, and their plots are in `plots`.
    tables : mapping of str to table
        Tables of the charts, by name.

    Raises
    ------
    InvalidInput
        When the context ends, if there is no layout or the file is truncated.
    """

    def __init__(
        self,
        path: Path,
        words: str = "",
        *,
        name: str,
        about: str,
        timeline: str = "time",
        at: Sequence[float] | np.ndarray = (),
        edition: str = "",
        charts: Sequence[Chart] = (),
        tables: Mapping[str, Any] | None = None,
    ) -> None:
        self.path, self.name, self.timeline, self._at = path, name, timeline, at
        self._about, self._edition = about + words, edition
        self._extents: dict[str, Extent | None] = {}  # box around each entity
        self._charts, self._tables = charts, tables or {}
        self.plots: list[Plot] = []
        self._layout = False

    def __enter__(self) -> Recording:
        # Fixed ids and no properties, since a time or a random id would make equal recordings differ.
        identity = f"{self.name} {self._edition}".strip()
        self._stream = rr.RecordingStream(self.name, recording_id=identity, send_properties=False)
        self._stream.set_log_time_enabled(False)
        self._stream.save(self.path)
        self._stream.send_recording_name(identity)
        self._add("about", rr.TextDocument(self._about, media_type=rr.MediaType.MARKDOWN))
        try:
            for chart in self._charts:
                if (chart.timeline or chart.x) == self.timeline:
                    self._chart(chart, self._tables)
        except BaseException as error:
            self.__exit__(type(error), error, error.__traceback__)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.disconnect()  # writes the footer; a flush would leave the file without one
        if kind is not None:
            return
        if not self._layout:
            raise InvalidInput(
                "the recording has no layout because blueprint() was not called",
                self.name,
                "a call of blueprint()",
                code="no_layout",
            )
        with self.path.open("rb") as written:
            written.seek(-min(self.path.stat().st_size, len(_FOOTER) + 4), os.SEEK_END)
            # If the disk is full, the library only logs it.
            if _FOOTER not in written.read():
                what = "cannot write results: the recording is truncated"
                raise InvalidInput(what, self.path.name, "enough space on the disk", code="truncated")

    def skeleton(
        self,
        entity: str,
        positions_mm: np.ndarray,
        bones: Sequence[tuple[int, int]] = WALKER15.bones,
        *,
        at: Sequence[float] | np.ndarray | None = None,
        colour: str = "original",
        thickness_mm: float = 7.0,
        estimated: np.ndarray | None = None,
    ) -> None:
        """Add a moving skeleton, in space or in an image, as one entity: joints as points, bones as lines.

        Parameters
        ----------
        entity : str
            E.g. ``"world/original/walker_07"``.
        positions_mm : (T, J, 3) or, in an image, right and up, (T, J, 2) float
            Millimetres; NaN hides a joint and its bones.
        bones : sequence of (int, int)
            Pairs of joints.
        at : (T,) array, optional
            Strictly increasing values of the timeline: seconds for ``time``, integers for any other.  By default
            those of the recording.
        colour : str
            Name or role of `pipeline.palette`; lines in space cannot be dashed, so only colour distinguishes methods.
        thickness_mm : float
            Radius of the bones; joints are half as large again.
        estimated : (J,) bool, optional
            Unmeasured joints, drawn hollow on the entity ``<entity>/estimated``: wire spheres in space, rings in an
            image.

        Raises
        ------
        InvalidInput
            If shapes, bones or timelines do not fit, or the entity exists already.
        """
        space = 2 if np.shape(positions_mm)[-1:] == (2,) else 3
        points: Any = rr.Points2D if space == 2 else rr.Points3D
        strips: Any = rr.LineStrips2D if space == 2 else rr.LineStrips3D
        joints, ends, extent = body(entity, positions_mm, bones, space)
        at = self._at if at is None else at
        colours, radius = rgb(entity, colour), thickness_mm * METRES
        radii: float | np.ndarray = 1.5 * radius
        if estimated is not None:  # in space, unmeasured joints have no point under their wire sphere
            flags = require_shape(f"{entity}, estimated", estimated, (joints.shape[1],)).astype(bool)
            radii = np.where(flags, 0.0 if space == 3 else RING * radius, radii)
        looks = (
            points.from_fields(colors=colours, radii=radii),
            strips.from_fields(colors=colours, radii=radius),
        )
        dots = partitioned(points.columns(positions=joints.reshape(-1, space)), *joints.shape[:2])
        lines = partitioned(strips.columns(strips=ends.reshape(-1, 2, space)), *ends.shape[:2])
        self._add(entity, *looks, extent=extent, at=at, columns=[*dots, *lines], rows=len(joints))
        if estimated is not None and flags.any():
            part = f"{entity}/estimated"
            style, columns, extent = hollow_joints(part, positions_mm[:, flags], colour, thickness_mm)
            self._add(part, style, extent=extent, at=at, columns=columns, rows=len(joints))

    image_points = skeleton
    """Alias of `skeleton` for points in an image."""

    def camera(
        self,
        entity: str,
        matrix: np.ndarray,
        image_mm: np.ndarray,
        *,
        distance_mm: float,
    ) -> None:
        """Add a moving camera at `entity`, and the skeleton projected into its image at ``<entity>/seen``.

        Parameters
        ----------
        entity : str
        matrix : (T, 3, 4) float
            Matrix from a homogeneous point of the world, mm, to one of the image; the image's origin is its middle.
        image_mm : (T, J, 2) float
            Skeleton in the image, right and up, measured at `distance_mm`.
        distance_mm : float
            Distance at which the image is measured.
        """
        half = 1.1 * np.nanmax(np.abs(image_mm), axis=(0, 1))
        self.skeleton(f"{entity}/seen", image_mm + half * [1.0, -1.0])
        require_shape(entity, matrix, (len(image_mm), 3, 4))
        centre, axes, extent = camera_pose(entity, matrix)
        focal, half = distance_mm * METRES, half * METRES
        image = pinhole((focal, focal), half, 2.0 * half, _FRUSTUM * focal)
        placed = rr.Transform3D.columns(translation=centre, mat3x3=axes)
        self._add(entity, image, extent=extent, at=self._at, columns=placed, rows=len(centre))

    def film(
        self,
        entity: str,
        matrix: np.ndarray,
        size_px: np.ndarray,
        *,
        frustum_mm: float,
        content: bytes = b"",
        at: Sequence[float] | np.ndarray = (),
    ) -> None:
        """Add a fixed camera with its image plane, px, at `entity` and its film at ``<entity>/film``.

        Parameters
        ----------
        entity : str
        matrix : (3, 4) float
            Matrix from a homogeneous point of the world, mm, to the image, px; its origin is the upper left corner.
        size_px : (2,) float
            Width and height of the image.
        frustum_mm : float
            Distance from the camera at which the viewer draws the image in space.
        content : bytes
            MP4 film; empty for a camera without a film.
        at : (P,) array
            Values of the timeline of the film's pictures.
        """
        (centre,), (axes,), extent = camera_pose(entity, matrix[None])
        inner = matrix[:, :3] @ axes
        inner = inner / inner[2, 2]
        image = pinhole(np.diag(inner)[:2], inner[:2, 2], size_px, frustum_mm * METRES)
        self._add(entity, image, rr.Transform3D(translation=centre, mat3x3=axes), extent=extent)
        if content:
            film = rr.AssetVideo(contents=content, media_type=rr.components.MediaType.MP4)
            pictures = film.read_frame_timestamps_nanos()
            references = rr.VideoFrameReference.columns_nanos(pictures)
            self._add(f"{entity}/film", film, at=at, columns=references, rows=len(pictures))

    def curve(
        self,
        entity: str,
        x: np.ndarray,
        y: np.ndarray,
        *,
        label: str,
        sd: np.ndarray | None = None,
        interval: Sequence[np.ndarray] | None = None,
        colour: str = "blue",
        width: float = 1.0,
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
            Name in the legend.
        sd : (N,) array, optional
            Standard deviation, drawn as a band of ±1 standard deviation.
        interval : ((N,) array, (N,) array), optional
            Lower and upper ends, drawn as a band on the entity ``<entity>/interval`` where both are finite.
        colour : str
            Name or role of `pipeline.palette`.
        width : float
            Factor on the usual width.

        Raises
        ------
        InvalidInput
            If lengths differ, numbers are not finite, or the entity exists already.
        """
        values, places = vector(entity, y), vector(entity, x)
        half = np.zeros(len(values)) if sd is None else vector(f"{entity}, sd", sd)
        if half.shape != values.shape or half.min() < 0:
            expected = f"{len(values)} numbers of at least 0"
            raise InvalidInput(
                "the standard deviations must be one non-negative number for each value",
                entity,
                expected,
                code="invalid_deviation",
            )
        low, high = (values - half).min(), (values + half).max()
        extent = Extent((places[0], low), (places[-1], high))
        style: dict[str, Any] = {"names": label, "colors": rgb(entity, colour), "widths": width * _LINE_WIDTH}
        if sd is None:
            look: Any = rr.SeriesLines.from_fields(**style)
            data = rr.Scalars.columns(scalars=values)
        else:
            look = rr.Measurements.from_fields(**style)
            data = rr.Measurements.columns(values=values, variances=half**2)
        columns = partitioned(data, len(values), 1)
        self._add(entity, look, extent=extent, at=places, columns=columns, rows=len(values))
        if interval is not None:
            where = f"{entity}/interval"
            drawn = band(where, places, *interval)
            if drawn is not None:
                finite, extent, parts = drawn
                look = rr.Measurements.from_fields(**{**style, "widths": 0.0})
                self._add(where, look, extent=extent, at=places[finite], columns=parts, rows=finite.sum())

    def _chart(self, chart: Chart, tables: Mapping[str, Any]) -> None:
        """Add the lines of a chart as ``curves/<quantity>/<series>``, and its plot to `plots`.

        Lines and plots that exist already are skipped.
        """
        top = f"curves/{'log10_' if chart.log_y else ''}{chart.quantity}"
        abscissa: np.ndarray | None = None
        for line in lines_of(chart, tables):
            entity = f"{top}/{_path(line.key)}"
            at, rows = np.unique(on_timeline(self.timeline, line.x), return_index=True)
            if entity in self._extents or line.strands is not None:
                continue
            y = _ordinate(chart, line.y[rows])
            band, interval = (
                ends and [_ordinate(chart, end[rows]) for end in ends] for ends in (line.band, line.interval)
            )
            self.curve(
                entity,
                at,
                y,
                label=line.style.label or line.key,
                sd=0.5 * (band[1] - band[0]) if band and np.allclose(band[0] + band[1], 2.0 * y) else None,
                interval=interval,
                colour=line.style.colour,
                width=line.style.width,
            )
            abscissa = at if abscissa is None else np.union1d(abscissa, at)
        if abscissa is None:
            return
        for reference in chart.references:
            entity = f"{top}/{_path(reference.label)}"
            if (
                reference.x is None
                and reference.y is not None
                and reference.label
                and entity not in self._extents
            ):
                level = _ordinate(chart, np.full(len(abscissa), reference.y))
                self.curve(entity, abscissa, level, label=reference.label, colour="reference", width=0.5)
        name = ": ".join(filter(None, [chart.title, chart.axes[1]]))
        plot = Plot(name=f"log10 of {name}" if chart.log_y else name, origin=top)
        if plot not in self.plots:
            self.plots.append(plot)

    def bars(self, entity: str, values: np.ndarray, abscissa: np.ndarray, *, colour: str = "blue") -> None:
        """Add a bar chart with the heights `values` (N,) at the positions `abscissa` (N,)."""
        heights, places = vector(entity, values), vector(entity, abscissa)
        require_shape(f"{entity}, abscissa", places, heights.shape)
        self._add(entity, rr.BarChart(heights, abscissa=places, color=rgb(entity, colour)))

    def matrix(
        self, entity: str, array: np.ndarray, *, paths: Mapping[str, tuple[np.ndarray, str]] | None = None
    ) -> None:
        """Add a matrix as a coloured image, with dark low values, bright high values and paths drawn over it.

        Parameters
        ----------
        entity : str
            E.g. ``"matrices/distances"``.
        array : (R, C) float
            Finite values, since the viewer draws NaN like the lowest number; row 0 is at the top.
        paths : mapping of str to ((N, 2) array, colour), optional
            Name → (row, column) of each point of a line, and its colour.

        Raises
        ------
        InvalidInput
            If shapes do not fit or the entity exists already.
        """
        a = require_finite(entity, require_shape(entity, array, ("R", "C"))).astype(np.float32)
        if not a.size:
            raise InvalidInput(
                "the matrix has no numbers", entity, received=f"shape {a.shape}", code="no_values"
            )
        span = (float(a.min()), float(a.max()))
        self._add(entity, rr.DepthImage(a, colormap="viridis", depth_range=span))
        for name, (path, colour) in (paths or {}).items():
            where = f"{entity}/{name}"
            line = require_finite(where, require_shape(where, path, ("N", 2))).astype(np.float32)
            middle = line[:, ::-1] + 0.5  # (column, row) of the middle of a cell
            self._add(where, rr.LineStrips2D([middle], colors=rgb(where, colour), radii=0.15))

    def blueprint(self, layout: View | Split, *, playing: bool = False) -> None:
        """Set the layout with which the viewer opens; call this once, after all entities have been added.

        Parameters
        ----------
        layout : View or Split
        playing : bool
            Start by playing in a loop, instead of paused at the first row.

        Raises
        ------
        InvalidInput
            If a view would be empty.
        """
        viewer_blueprint = blueprint(layout, timeline=self.timeline, extents=self._extents, playing=playing)
        self._stream.send_blueprint(viewer_blueprint)
        self._layout = True

    def _add(
        self,
        entity: str,
        *looks: Any,
        extent: Extent | None = None,
        at: Sequence[float] | np.ndarray = (),
        columns: Iterable[Any] = (),
        rows: int = 0,
    ) -> None:
        """Add an entity. A path may be used only once, because static data would hide later rows."""
        if not re.fullmatch(r"[\w.-]+(/[\w.-]+)*", entity, re.ASCII):
            expected = "letters, digits, '_', '-' and '.', with / between the parts"
            raise InvalidInput(
                "the path of an entity has characters that are not allowed",
                repr(entity),
                expected,
                code="unsafe_path",
            )
        if entity in self._extents:
            raise InvalidInput(
                "the recording already has an entity with this path", entity, code="duplicate_name"
            )
        times = [time_column(entity, self.timeline, at, rows)] if rows else []
        self._extents[entity] = extent
        for look in looks:
            self._stream.log(entity, look, static=True)
        if rows:
            self._stream.send_columns(entity, indexes=times, columns=columns)


def _path(words: str) -> str:
    """Convert words to the form of one part of an entity's path, such as ``minus_30``."""
    words = re.sub(r"-(?=[0-9])", "minus_", words.replace("µ", "mu"))
    return re.sub(r"[^A-Za-z0-9]+", "_", words).strip("_")


def _ordinate(chart: Chart, values: np.ndarray) -> np.ndarray:
    """Return the values as shown in the recording: their log10 if the ordinate of the chart is logarithmic."""
    return np.log10(values) if chart.log_y else values
