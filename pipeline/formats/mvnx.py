"""Reader of MVNX files, written by Xsens MVN: positions of segment origins, in metres, z up."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from pipeline.formats.contract import damaged, motion_capture, read_bytes
from pipeline.formats.text import millimetres_in, number, read_numbers
from pipeline.skeleton.recorded import MotionCapture


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the positions of the segment origins from an MVNX file, in the file's axes.

    Parameters
    ----------
    path : Path
    frame_rate_hz : float, optional
        Frames per second, used if the file does not state it.
    units : str, optional
        Unit of length; default ``"m"``, the unit of the format.

    Returns
    -------
    MotionCapture
        Points at the origin of each segment, its proximal joint: LeftUpperLeg is the hip, LeftLowerLeg the knee,
        LeftFoot the ankle.

    Raises
    ------
    InvalidInput
        If the file is not MVNX, is truncated, has no positions, or does not state its rate.
    """
    where, unit = path.name, units or "m"
    millimetres = millimetres_in(unit, where)
    root = _root(read_bytes(path), where)
    people = [_subject(subject, str(n), where) for n, subject in enumerate(_all(root, "subject"), start=1)]
    if not people:
        raise damaged("the file contains no subject", where, code="no_subject")
    labels, rates, segments, tracks = zip(*people, strict=True)
    rate = rates[0]
    if len({*rates}) > 1:
        raise damaged(
            "the subjects have different frame rates",
            where,
            "the same rate",
            sorted({*rates})[:4],
            code="rates_differ",
        )
    if not 0 < rate < 1e6:
        if frame_rate_hz is None:
            raise damaged(
                "the frame rate is unknown",
                where,
                "frameRate, or the option frame_rate_hz",
                code="unknown_rate",
            )
        rate = frame_rate_hz
    several = len(people) > 1
    names = [
        f"{label}:{name}" if several else name
        for label, subject_segments in zip(labels, segments, strict=True)
        for name in subject_segments
    ]
    notes = [f"The file contains {len(people)} subjects."] if several else []
    shortest = min(map(len, tracks))
    if shortest < max(map(len, tracks)):
        notes.append(f"The subjects have different numbers of frames; the first {shortest} of each are read.")
    positions = np.concatenate([subject[:shortest] for subject in tracks], axis=1) * millimetres
    return motion_capture(names, positions, rate, unit, notes)


def _subject(
    element: ElementTree.Element, unlabelled: str, where: str
) -> tuple[str, float, list[str], np.ndarray]:
    """Return the label, frame rate, segment names and positions (T, S, 3) of one person in an MVNX file.

    Calibration frames are left out.
    """
    segments = enumerate(_all(element, "segment"), start=1)
    names = [segment.get("label") or f"segment_{k}" for k, segment in segments]
    frames = [frame for frame in _all(element, "frame") if frame.get("type", "normal") == "normal"]
    rows = []
    for k, frame in enumerate(frames, start=1):
        texts = [child.text or "" for child in frame if _tag(child) == "position"]
        words = "".join(texts[-1:]).split()
        if not words or len(words) != 3 * len(names):
            raise damaged(
                "the number of positions does not match the segments",
                f"{where}, frame {k}",
                3 * len(names),
                len(words),
                code="wrong_count",
                needed=3 * len(names),
                count=len(words),
            )

        def location(n: int, k: int = k) -> str:
            return f"{where}, frame {k}, segment {names[n // 3]}"

        rows.append(read_numbers(words, location))
    if not rows:
        raise damaged(
            "a subject has no normal frames",
            f"{where}, frame 1",
            received="no frame",
            code="no_frames",
        )
    rate = number(element.get("frameRate", ""))
    return element.get("label") or unlabelled, rate, names, np.reshape(rows, (len(rows), -1, 3))


def _root(data: bytes, where: str) -> ElementTree.Element:
    class Builder(ElementTree.TreeBuilder):
        """Builder of XML elements that rejects document types, because their entities can expand without limit."""

        def doctype(self, *_: object) -> None:
            raise damaged(
                "this is not an MVNX file", where, "XML without a document type", code="document_type"
            )

    try:
        root = ElementTree.fromstring(data, ElementTree.XMLParser(target=Builder()))
    except ElementTree.ParseError as error:
        location = f"{where}, line {error.position[0]}"
        raise damaged(
            "the file is damaged or truncated", location, "complete XML", code="truncated"
        ) from None
    if _tag(root) != "mvnx":
        raise damaged(
            "this is not an MVNX file",
            where,
            "<mvnx>",
            f"<{_tag(root):.40}>",
            code="wrong_format",
            root=_tag(root),
        )
    return root


def _tag(element: ElementTree.Element) -> str:
    """Return the name of an XML element without its namespace, in lower case."""
    return element.tag.rpartition("}")[2].lower()


def _all(element: ElementTree.Element, tag: str) -> list[ElementTree.Element]:
    return [inner for inner in element.iter() if _tag(inner) == tag]
