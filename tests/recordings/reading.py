"""Functions that read recordings: their entities, views, columns, and a digest of their content."""

from __future__ import annotations

import hashlib
import warnings
from pathlib import Path

import numpy as np
import pyarrow as pa
from rerun.chunk import Chunk, RrdReader
from rerun.error_utils import RerunWarning

from pipeline.validation import InvalidInput

_NOT_CONTENT = "/__properties"
"""Path of the entities that contain the recording's name instead of data."""


def entities(path: Path) -> tuple[str, ...]:
    """Return the entities of a recording, sorted, without the leading slash.

    Raises
    ------
    InvalidInput
        If the file is missing or is not a complete recording.
    """
    return tuple(sorted({chunk.entity_path.strip("/") for chunk in _chunks(path)}))


def views(path: Path) -> tuple[tuple[str, str], ...]:
    """Return the kind and title of each view in a recording's layout, sorted, e.g. ``("3D", "walkers")``."""
    reader, result = _reader(path), set()
    for layout in reader.blueprints():
        for chunk in reader.stream(store=layout).to_chunks():
            row = chunk.to_record_batch().to_pydict()
            if "ViewBlueprint:class_identifier" in row:
                kind, title = row["ViewBlueprint:class_identifier"], row["ViewBlueprint:display_name"]
                result.add((kind[0][0], title[0][0]))
    return tuple(sorted(result))


def read_column(
    path: Path, entity: str, component: str, index: str | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the timeline values and the data of one component of an entity, in the order of the timeline.

    Parameters
    ----------
    path : Path
    entity : str
        E.g. ``"curves/error/map"``.
    component : str
        E.g. ``"Scalars:scalars"``, ``"Points3D:positions"``, ``"LineStrips3D:strips"``.
    index : str, optional
        The timeline; None for static data.

    Returns
    -------
    index : (T,) array
        Seconds for ``time``, else integers; empty for static data.
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
        raise InvalidInput(
            f"the entity has no column {component} on {index or 'no timeline'}",
            where=f"{path}, {entity}",
            code="no_column",
        )
    table = pa.concat_tables(tables).sort_by("index").combine_chunks()
    keys = table["index"].to_numpy()
    if keys.dtype.kind == "m":
        keys = keys.astype("timedelta64[ns]").astype(np.int64) / 1e9
    return (keys if index else keys[:0]), _dense(table["value"].chunk(0), f"{path}, {entity}")


def digest(path: Path) -> str:
    """Return the sha256 of a recording's content, which does not depend on ids, chunks and the order of writing.

    Covers entities, components, timelines, their values and the data; not the name nor the layout.

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


def _reader(path: Path) -> RrdReader:
    if not Path(path).is_file():
        raise InvalidInput("no such recording", where=str(path), code="no_recording")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RerunWarning)
            reader = RrdReader(path)
            reader.store()  # needs the footer, which only a finished file has
    except (RerunWarning, ValueError, RuntimeError, OSError) as error:
        raise InvalidInput(
            "the file is not a complete recording", where=str(path), received=str(error), code="damaged"
        ) from error
    return reader


def _chunks(path: Path) -> list[Chunk]:
    return [c for c in _reader(path).stream().to_chunks() if not c.entity_path.startswith(_NOT_CONTENT)]


def _dense(array: pa.Array, where: str) -> np.ndarray:
    """Return nested lists of equal lengths as one NumPy array."""
    shape: list[int] = []
    while pa.types.is_list(array.type) or pa.types.is_fixed_size_list(array.type):
        rows = len(array)
        flat = array.flatten()
        if not rows or len(flat) % rows or len(set(array.value_lengths().to_pylist())) != 1:
            raise InvalidInput(
                "the rows of a column have different lengths", where=where, code="other_length"
            )
        shape.append(rows if not shape else rows // int(np.prod(shape)))
        array = flat
    values = array.to_numpy(zero_copy_only=False)
    return values.reshape(*shape, -1) if shape else values


def _content(array: pa.Array) -> bytes:
    """Return the content of a column as bytes, independent of its memory layout."""
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
