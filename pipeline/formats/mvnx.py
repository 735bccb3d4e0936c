"""MVNX files of Xsens MVN: positions of the origins of segments, in metres, z up."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

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
    where, unit = path.name, units or "m"
    millimetres = millimetres_in(unit, where)
    people = _Elements(where).read(read_bytes(path))
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
    """One person: the segments, and the numbers of each frame."""

    label: str
    rate: float
    names: list[str] = field(default_factory=list)
    rows: list[np.ndarray] = field(default_factory=list)

    def positions(self, where: str) -> np.ndarray:
        """Positions (T, S, 3) in the file's unit."""
        width = 3 * len(self.names)
        wrong = next((k for k, row in enumerate(self.rows) if len(row) != width), None)
        if not self.rows or not self.names or wrong is not None:
            k = wrong or 0
            raise damaged(
                "the positions do not fit the segments",
                f"{where}, frame {k + 1}",
                width,
                f"{len(self.rows[k])}" if self.rows else "no frame",
            )
        return np.array(self.rows).reshape(len(self.rows), len(self.names), 3)


class _Elements:
    """The elements of a file as they come; nothing but names and positions is kept."""

    def __init__(self, where: str) -> None:
        self.where, self.people = where, list[_Subject]()
        self.depth = 0
        self.frame = 0
        """Depth of the normal frame that is open; 0 if none is."""
        self.text: list[str] | None = None
        """Pieces of the position of the open frame."""

    def read(self, data: bytes) -> list[_Subject]:
        parser = expat.ParserCreate(namespace_separator="}")
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = self.doctype
        parser.StartElementHandler, parser.EndElementHandler = self.start, self.end
        parser.CharacterDataHandler = self.characters
        try:
            parser.Parse(data, True)
        except expat.ExpatError as error:
            raise damaged(
                "the file is damaged or cut short", f"{self.where}, line {error.lineno}", "whole XML"
            ) from None
        return self.people

    def doctype(self, *_: object) -> None:  # its entities could make the file grow without end
        raise damaged("this is not an MVNX file", self.where, "XML without a document type")

    def start(self, name: str, attributes: dict[str, str]) -> None:
        tag = name.rpartition("}")[2].lower()
        if not self.depth and tag != "mvnx":
            raise damaged("this is not an MVNX file", self.where, "<mvnx>", f"<{tag:.40}>")
        self.depth += 1
        if tag == "subject":
            label = attributes.get("label") or str(len(self.people) + 1)
            self.people.append(_Subject(label, number(attributes.get("frameRate", ""))))
        elif tag in ("segment", "frame") and not self.people:
            raise damaged("a segment or frame belongs to no subject", self.where, "<subject> around it")
        elif tag == "segment":
            names = self.people[-1].names
            names.append(attributes.get("label") or f"segment_{len(names) + 1}")
        elif tag == "frame" and attributes.get("type", "normal") == "normal":
            self.frame = self.depth
            self.people[-1].rows.append(np.empty(0))
        elif tag == "position" and self.depth == self.frame + 1 and self.frame:
            self.text = []

    def characters(self, text: str) -> None:
        if self.text is not None:
            self.text.append(text)

    def end(self, name: str) -> None:
        if self.text is not None and self.depth == self.frame + 1:
            person = self.people[-1]
            frame = f"{self.where}, frame {len(person.rows)}"

            def place(n: int) -> str:
                return (
                    f"{frame}, segment {person.names[n // 3] if n // 3 < len(person.names) else n // 3 + 1}"
                )

            person.rows[-1] = read_numbers("".join(self.text).split(), place)
            self.text = None
        if self.depth == self.frame:
            self.frame = 0
        self.depth -= 1
