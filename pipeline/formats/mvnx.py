"""MVNX files of Xsens MVN: positions of the origins of segments, in metres, z up."""

from __future__ import annotations

import io
from pathlib import Path
from xml.etree import ElementTree

from pipeline.formats.contract import damaged, motion_capture, read_bytes
from pipeline.formats.text import millimetres_in, number, read_numbers
from pipeline.skeleton import MotionCapture


def read(path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the positions of segment origins from an MVNX file, in the file's axes.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Used if the file does not state it.
    units : str, optional
        Unit of length; ``"m"``, as the format has it, if not given.

    Returns
    -------
    MotionCapture
        A segment's origin is its proximal joint: LeftUpperLeg the hip, LeftLowerLeg the knee, LeftFoot the ankle.

    Raises
    ------
    InvalidInput
        If the file is not MVNX, is cut short, has no positions, or does not state its rate.
    """
    path = Path(path)
    where, data = path.name, read_bytes(path)
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:  # entities could make the file grow without end
        raise damaged("this is not an MVNX file", where, "XML without a document type")
    unit = units or "m"
    millimetres = millimetres_in(unit, where)
    names: list[str] = []
    rows: list[list[str]] = []
    rate, depth = 0.0, 0
    kept: list[ElementTree.Element] = []
    try:
        for event, element in ElementTree.iterparse(io.BytesIO(data), events=("start", "end")):
            tag = element.tag.rpartition("}")[2].lower()
            if event == "start":
                if not depth and tag != "mvnx":
                    raise damaged("this is not an MVNX file", where, "<mvnx>", f"<{tag:.40}>")
                depth += 1
                kept.append(element)
                if tag == "subject":
                    rate = number(element.get("frameRate", ""))
                continue
            depth -= 1
            kept.pop()
            if tag == "segment":
                names.append(element.get("label") or f"segment_{len(names) + 1}")
            if tag == "frame":
                if element.get("type", "normal") == "normal":
                    rows.append((element.findtext("{*}position") or "").split())
                element.clear()
                kept[-1].remove(element)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        if hasattr(error, "where"):
            raise
        line = getattr(error, "position", (0, 0))[0]
        raise damaged("the file is damaged or cut short", f"{where}, line {line}", "whole XML") from None
    wrong = next((k for k, words in enumerate(rows) if len(words) != 3 * len(names)), None)
    if not rows or not names or wrong is not None:
        k = wrong or 0
        received = f"{len(rows[k])}" if rows else "no frame"
        raise damaged(
            "the positions do not fit the segments", f"{where}, frame {k + 1}", 3 * len(names), received
        )
    if not 0 < rate < 1e6:
        if frame_rate_hz is None:
            raise damaged("the frame rate is unknown", where, "frameRate, or the option frame_rate_hz")
        rate = frame_rate_hz
    width = 3 * len(names)

    def place(n: int) -> str:
        return f"{where}, frame {n // width + 1}, segment {names[n % width // 3]}"

    values = read_numbers([word for words in rows for word in words], place)
    positions = values.reshape(len(rows), len(names), 3) * millimetres
    return motion_capture(names, positions, rate, unit, [])
