"""MVNX files of Xsens MVN: positions of the origins of segments, in metres, z up."""

from __future__ import annotations

import io
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from pipeline.formats.contract import damaged, motion_capture, read_bytes
from pipeline.formats.text import millimetres_in, number, read_numbers
from pipeline.skeleton.recorded import MotionCapture


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
    people: list[_Subject] = []
    depth = 0
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
                    label = element.get("label") or str(len(people) + 1)
                    people.append(_Subject(label, number(element.get("frameRate", ""))))
                continue
            depth -= 1
            kept.pop()
            if tag in ("segment", "frame") and not people:
                raise damaged("a segment or frame belongs to no subject", where, "<subject> around it")
            if tag == "segment":
                names = people[-1].names
                names.append(element.get("label") or f"segment_{len(names) + 1}")
            if tag == "frame":
                if element.get("type", "normal") == "normal":
                    people[-1].rows.append((element.findtext("{*}position") or "").split())
                element.clear()
                kept[-1].remove(element)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        if hasattr(error, "where"):
            raise
        line = getattr(error, "position", (0, 0))[0]
        raise damaged("the file is damaged or cut short", f"{where}, line {line}", "whole XML") from None
    if not people:
        raise damaged("the file holds no subject", where)
    rates = {person.rate for person in people}
    rate = people[0].rate
    if len(rates) > 1:
        raise damaged("the subjects have different frame rates", where, "one", f"{sorted(rates)[:4]}")
    if not 0 < rate < 1e6:
        if frame_rate_hz is None:
            raise damaged("the frame rate is unknown", where, "frameRate, or the option frame_rate_hz")
        rate = frame_rate_hz
    several = len(people) > 1
    names = [f"{one.label}:{name}" if several else name for one in people for name in one.names]
    notes = [f"The file holds {len(people)} subjects."] if several else []
    shortest = min(len(one.rows) for one in people)
    if shortest < max(len(one.rows) for one in people):
        notes.append(f"The subjects have different numbers of frames; the first {shortest} of each are read.")
    positions = np.concatenate([one.positions(where)[:shortest] for one in people], axis=1) * millimetres
    return motion_capture(names, positions, rate, unit, notes)


@dataclass
class _Subject:
    """One person: the segments, and the words of the positions of each frame."""

    label: str
    rate: float
    names: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)

    def positions(self, where: str) -> np.ndarray:
        """Positions (T, S, 3) in the file's unit."""
        width = 3 * len(self.names)
        wrong = next((k for k, words in enumerate(self.rows) if len(words) != width), None)
        if not self.rows or not self.names or wrong is not None:
            k = wrong or 0
            received = f"{len(self.rows[k])}" if self.rows else "no frame"
            raise damaged("the positions do not fit the segments", f"{where}, frame {k + 1}", width, received)

        def place(n: int) -> str:
            return f"{where}, frame {n // width + 1}, segment {self.names[n % width // 3]}"

        values = read_numbers([word for words in self.rows for word in words], place)
        return values.reshape(len(self.rows), len(self.names), 3)
