"""Reading back, checking and looking at recordings: entities, columns, digest, verification, screenshot.

The other half of the door to rerun; `pipeline.recording` writes.  Tests and the stages that check their
own output use this module; nothing here changes a recording.
"""

from __future__ import annotations

import hashlib
import os
import socket
import subprocess
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import rerun
from rerun.chunk import Chunk, RrdReader
from rerun.error_utils import RerunWarning
from rerun.experimental import ViewerClient

from pipeline.validation import InvalidInput

PROGRAM = Path(rerun.__file__).parents[1] / "rerun_cli" / ("rerun.exe" if os.name == "nt" else "rerun")
"""The viewer and its command line: the program itself, since stopping its wrapper would leave it running."""

SETTLE_S = 3.5
"""Seconds from the first view to the picture: the layout takes some frames, start-up notices must fade."""

NOT_CONTENT = "/__properties"
"""Holds the name of the recording, not its data."""


def entities(path: Path) -> tuple[str, ...]:
    """The entities of a recording, sorted, without the leading slash.

    Raises
    ------
    InvalidInput
        If the file is missing or is not a complete recording.
    """
    return tuple(sorted({chunk.entity_path.strip("/") for chunk in _chunks(path)}))


def views(path: Path) -> tuple[tuple[str, str], ...]:
    """The views that a recording opens on, sorted: (kind, title), e.g. ``("3D", "walkers")``."""
    reader, found = _reader(path), set()
    for layout in reader.blueprints():
        for chunk in reader.stream(store=layout).to_chunks():
            row = chunk.to_record_batch().to_pydict()
            if "ViewBlueprint:class_identifier" in row:
                kind, title = row["ViewBlueprint:class_identifier"], row["ViewBlueprint:display_name"]
                found.add((kind[0][0], title[0][0]))
    return tuple(sorted(found))


def read_column(
    path: Path, entity: str, component: str, index: str | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Index values and data of one component, ordered along the index.

    Parameters
    ----------
    path : Path
    entity : str
        E.g. ``"curves/error/map"``.
    component : str
        E.g. ``"Scalars:scalars"``, ``"Points3D:positions"``, ``"LineStrips3D:strips"``.
    index : str, optional
        The timeline; None for what does not change.

    Returns
    -------
    index : (T,) array
        Seconds for ``time``, else integers; empty for what does not change.
    values : (T, …) array
        As in the file: positions in metres, images with the vertical axis down.

    Raises
    ------
    InvalidInput
        If there is no such column, or its rows differ in length.
    """
    tables = []
    for chunk in _chunks(path):
        batch = chunk.to_record_batch()
        names = batch.schema.names
        if chunk.entity_path.strip("/") != entity.strip("/") or component not in names:
            continue
        if chunk.is_static == (index is None) and (index is None or index in names):
            keys = pa.array(range(len(batch))) if index is None else batch.column(index)
            tables.append(pa.table({"index": keys, "value": batch.column(component)}))
    if not tables:
        raise InvalidInput(f"no column {component} on {index or 'no timeline'}", where=f"{path}, {entity}")
    table = pa.concat_tables(tables).sort_by("index").combine_chunks()
    keys = table["index"].to_numpy()
    if keys.dtype.kind == "m":
        keys = keys.astype("timedelta64[ns]").astype(np.int64) / 1e9
    return (keys if index else keys[:0]), _dense(table["value"].chunk(0), f"{path}, {entity}")


def digest(path: Path) -> str:
    """Sha256 of what a recording says, to the last bit, whatever its ids, chunks and order of writing.

    Covers entity, component, timelines, their values and the data; not the name nor the layout.

    Raises
    ------
    InvalidInput
        If the file is missing or is not a complete recording.
    """
    columns: dict[tuple[str, str, str], list[tuple[bytes, bytes]]] = {}
    for chunk in _chunks(path):
        batch = chunk.to_record_batch()
        timelines = sorted(set(chunk.timeline_names) - {"log_time", "log_tick"})
        stamps = [np.ascontiguousarray(batch.column(t).cast(pa.int64()).to_numpy()) for t in timelines]
        kinds = [f"{t}:{batch.schema.field(t).type}" for t in timelines]
        for field in batch.schema:
            if (field.metadata or {}).get(b"rerun:kind") != b"data":
                continue
            key = (chunk.entity_path, field.name, ",".join(kinds))
            column = batch.column(field.name)
            rows = columns.setdefault(key, [])
            for i in range(len(batch)):
                if column[i].is_valid:
                    at = b"".join(int(s[i]).to_bytes(8, "big", signed=True) for s in stamps)
                    rows.append((at, _content(column.slice(i, 1))))
    total = hashlib.sha256()
    for key in sorted(columns):
        total.update(repr(key).encode())
        for at, content in sorted(columns[key]):
            total.update(at + content)
    return total.hexdigest()


def verify(path: Path, *, timeout_s: float = 60.0) -> None:
    """Nothing, if the viewer's own command line finds the recording complete and readable.

    Raises
    ------
    InvalidInput
        With the command line's last sentence, if it does not.
    """
    command = [str(PROGRAM), "rrd", "verify", str(path)]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)
    except subprocess.TimeoutExpired as error:
        raise InvalidInput("the check did not end in time", where=str(path)) from error
    if run.returncode:
        said = (run.stderr or run.stdout).strip().splitlines() or ["no reason given"]
        raise InvalidInput("the recording is damaged", where=str(path), received=said[-1].strip())


def screenshot(
    path: Path,
    png: Path,
    *,
    size: tuple[int, int] = (1600, 1000),
    timeline: str | None = None,
    value: float | None = None,
    timeout_s: float = 60.0,
) -> tuple[str, ...]:
    """What the viewer complained about, after writing a picture of what it opens on.

    Runs the viewer without a screen, listening on this machine only, and always stops it.

    Parameters
    ----------
    path, png : Path
        The recording, and the picture to write.
    size : (int, int)
        Width and height in points; the picture may have more pixels.
    timeline : str, optional
    value : float, optional
        Where on `timeline` to go first: seconds for ``time``, else an integer.
    timeout_s : float
        For everything.

    Raises
    ------
    InvalidInput
        If there is no Vulkan driver (``mesa-vulkan-drivers`` draws without a graphics card), the viewer
        stops, or time runs out.
    """
    if not Path(path).is_file():
        raise InvalidInput("no such recording", where=str(path))
    deadline = time.monotonic() + timeout_s
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    options = f"--headless --hide-welcome-screen --bind 127.0.0.1 --port {port}"
    with tempfile.TemporaryFile("w+") as said:
        viewer = subprocess.Popen(
            [str(PROGRAM), *options.split(), "--window-size", f"{size[0]}x{size[1]}"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
            env={
                **os.environ,
                "RERUN_APP_ONLY": "true",
                "RUST_LOG": "error",
            },  # fewer notices over the picture
        )
        try:
            _until(lambda: viewer.poll() is not None or _answers(port), deadline)
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.open(str(Path(path).resolve()))
            _until(lambda: not (state := client.get_state()).loading and bool(state.views), deadline)
            if timeline == "time" and value is not None:
                client.set_time(timeline, duration=float(value), play_state="paused")
            elif timeline is not None and value is not None:
                client.set_time(timeline, sequence=int(value), play_state="paused")
            time.sleep(SETTLE_S)
            complaints = tuple(str(report) for view in client.get_state().views for report in view.reports)
            Path(png).write_bytes(client.take_screenshot())
            return complaints
        except (OSError, RuntimeError) as error:
            said.seek(0)
            words = [line.strip() for line in said if "panicked" in line]
            raise InvalidInput(
                "the viewer stopped or did not answer",
                where=str(path),
                expected="a Vulkan driver, such as the package mesa-vulkan-drivers",
                received=(words or [str(error)])[0],
            ) from error
        finally:
            viewer.kill()
            viewer.wait()


def _until(ready: Callable[[], bool], deadline: float) -> None:
    while not ready():
        if time.monotonic() > deadline:
            raise TimeoutError("no answer in time")
        time.sleep(0.05)


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(0.5)
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _reader(path: Path) -> RrdReader:
    if not Path(path).is_file():
        raise InvalidInput("no such recording", where=str(path))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RerunWarning)
            reader = RrdReader(path)
            reader.store()  # needs the footer, which only a finished file has
    except (RerunWarning, ValueError, RuntimeError, OSError) as error:
        raise InvalidInput("not a complete recording", where=str(path), received=str(error)) from error
    return reader


def _chunks(path: Path) -> list[Chunk]:
    return [c for c in _reader(path).stream().to_chunks() if not c.entity_path.startswith(NOT_CONTENT)]


def _dense(array: pa.Array, where: str) -> np.ndarray:
    """Nested lists of equal lengths as one array."""
    shape: list[int] = []
    while pa.types.is_list(array.type) or pa.types.is_fixed_size_list(array.type):
        rows = len(array)
        flat = array.flatten()
        if not rows or len(flat) % rows or len(set(array.value_lengths().to_pylist())) != 1:
            raise InvalidInput("rows of different lengths", where=where)
        shape.append(rows if not shape else rows // int(np.prod(shape)))
        array = flat
    values = array.to_numpy(zero_copy_only=False)
    return values.reshape(*shape, -1) if shape else values


def _content(array: pa.Array) -> bytes:
    """Bytes that say what an array holds, whatever its offsets and buffers."""
    kind = array.type
    if pa.types.is_list(kind) or pa.types.is_large_list(kind):
        return array.value_lengths().to_numpy(zero_copy_only=False).tobytes() + _content(array.flatten())
    if pa.types.is_fixed_size_list(kind):
        return _content(array.flatten())
    if pa.types.is_struct(kind):
        return b"".join(
            kind.field(i).name.encode() + _content(array.field(i)) for i in range(kind.num_fields)
        )
    if (pa.types.is_integer(kind) or pa.types.is_floating(kind)) and not array.null_count:
        return str(kind).encode() + array.to_numpy().tobytes()
    return repr(array.to_pylist()).encode()
