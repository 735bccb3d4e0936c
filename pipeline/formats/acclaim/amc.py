"""Reader of Acclaim motions (AMC): bone positions from joint angles and the skeleton file (ASF).

The conventions are those of `pipeline.formats.acclaim.asf`.  The translation of the root is in the skeleton's unit of
length.
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np

from pipeline.formats.acclaim.asf import (
    SHIFTS,
    AsfSkeleton,
    forward_kinematics,
    read_skeleton,
    text_without_comments,
)
from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged, motion_capture
from pipeline.formats.text import read_numbers
from pipeline.skeleton.recorded import MotionCapture

FRAME_RATE_HZ = 120.0
"""Frame rate, Hz, assumed for AMC files, which do not store it: the rate of the public AMC recordings."""

_FRAME_NUMBER = re.compile(r"^[ \t]*(\d{1,9})[ \t]*$", re.MULTILINE)


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the positions of the bone ends from an AMC file and its skeleton file, in the file's axes.

    Parameters
    ----------
    path : Path
        The motion (.amc); `skeleton_of` finds its skeleton.
    frame_rate_hz : float, optional
        Frames per second; `FRAME_RATE_HZ` if not given.
    units : str, optional
        Unit of length to use in place of the skeleton's own, e.g. ``"cm"`` or ``"in/0.45"``.

    Returns
    -------
    MotionCapture
        Points: ``root``, then the bones as the skeleton lists them.  A NaN in the file makes the points that depend
        on it invalid, and is noted.

    Raises
    ------
    InvalidInput
        If either file is missing, cut short or contradicts itself or the other.
    """
    text, notes = text_without_comments(path)
    skeleton = read_skeleton(skeleton_of(path), units=units)
    first = _FRAME_NUMBER.search(text)
    if first is None:
        raise damaged("the file has no numbered frames", path.name, "an AMC motion", code="no_frames")
    radians = _header(text[: first.start()], skeleton.radians, path.name, notes)
    start, values = _values(text[first.start() :], skeleton, path.name)
    require_points(len(values), len(skeleton.names), path.name)
    if start != 1:
        notes.append(f"Frames are numbered from {start}.")
    scales = [skeleton.millimetres if freedom in SHIFTS else radians for _, freedom in skeleton.channels]
    return motion_capture(
        skeleton.names,
        forward_kinematics(skeleton, values * scales),
        FRAME_RATE_HZ if frame_rate_hz is None else frame_rate_hz,
        skeleton.units,
        notes,
        of_angles=True,
    )


def skeleton_of(path: Path) -> Path:
    """Find the skeleton file (.asf) of a motion file (.amc).

    The folder of the motion, its parent and the parent's folder ``asf`` are searched, in this order.  Among several
    skeletons, the one with the longest name that begins the motion's name is taken (``16.asf`` for ``16_11.amc``).  In
    ``asf`` the names must begin with the same number (``07-walk.asf`` for ``07_01-walk.amc``).

    Raises
    ------
    InvalidInput
        If there is no skeleton, several fit, or a folder cannot be read.
    """
    skeletons: list[Path] = []
    asf_folder = path.parent.parent / "asf"
    for folder in (path.parent, path.parent.parent, asf_folder):
        try:
            if folder is asf_folder and not folder.is_dir():
                continue
            skeletons = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".asf")
        except OSError as error:
            raise damaged(
                "the folder of the skeleton file cannot be read",
                path.name,
                received=error.strerror or "",
                code="unreadable",
            ) from None
        if folder is asf_folder:  # contains the skeletons of all people
            skeletons = [p for p in skeletons if _number(p) == _number(path)]
        if skeletons:
            break
    begins = [p for p in skeletons if path.stem.lower().startswith(p.stem.lower())]
    longest = max((len(p.stem) for p in begins), default=0)
    skeletons = [p for p in begins if len(p.stem) == longest] or skeletons
    if len(skeletons) != 1:
        raise damaged(
            "the skeleton file of this motion is missing or ambiguous",
            path.name,
            "one .asf file in its folder, one folder up or in asf/",
            ", ".join(p.name for p in skeletons) or "none",
            code="unclear_skeleton",
            skeletons=[p.name for p in skeletons],
        )
    return skeletons[0]


def _number(path: Path) -> str:
    """Return the number at the beginning of a file name, without leading zeros; empty if there is no number."""
    return str(re.findall("^0*([0-9]*)", path.stem)[0])


def _header(header: str, radians: float, where: str, notes: list[str]) -> float:
    """Return the factor from the file's unit of angle to radians, and add a note for each unused header line."""
    for line in filter(None, map(str.strip, header.split("\n"))):
        if not line.startswith(":"):
            raise damaged(
                "the header has a line without a keyword",
                where,
                ":FULLY-SPECIFIED, :DEGREES, then a frame number",
                f"{line!r:.40}",
                code="unknown_keyword",
                keyword=line,
            )
        keyword = line.upper()
        if keyword in (":DEGREES", ":RADIANS"):
            radians = np.pi / 180 if keyword == ":DEGREES" else 1.0
        elif keyword != ":FULLY-SPECIFIED":
            notes.append(f"The header line {line!r} is not used.")
    return radians


def _values(body: str, skeleton: AsfSkeleton, where: str) -> tuple[int, np.ndarray]:
    """Return the number of the first frame, and the values (T, C) of the skeleton's channels.

    The bones may be in any order within a frame.

    Raises
    ------
    InvalidInput
        If a frame is missing, repeated or incomplete, or has a bone that is not in the skeleton.
    """
    freedoms = dict(zip(skeleton.names, skeleton.freedoms, strict=True))
    by_lower_name = {name.lower(): name for name in freedoms}
    numbers: list[int] = []
    frames: list[dict[str, list[str]]] = []
    for line in body.split("\n"):
        words = line.split()
        if not words:
            continue
        if _FRAME_NUMBER.fullmatch(line):
            numbers.append(int(words[0]))
            frames.append({})
            continue
        location = f"{where}, frame {numbers[-1]}"
        name = by_lower_name.get(words[0].lower())
        if name is None:
            raise damaged(
                "the bone is not in the skeleton",
                location,
                received=f"{words[0]!r:.40}",
                code="unknown_joint",
                joint=words[0],
            )
        location += f", bone {name}"
        if name in frames[-1]:
            raise damaged("the frame has the bone twice", location, code="joint_twice")
        if len(words) != 1 + len(freedoms[name]):
            raise damaged(
                "the number of values of the bone is wrong",
                location,
                len(freedoms[name]),
                len(words) - 1,
                code="wrong_count",
                needed=len(freedoms[name]),
                count=len(words) - 1,
            )
        frames[-1][name] = words[1:]
    moving = [name for name in skeleton.names if freedoms[name]]
    if not moving:
        raise damaged("the skeleton has no degrees of freedom: nothing can move", where, code="no_channels")
    for number, frame in zip(numbers, frames, strict=True):
        if missing := [name for name in moving if name not in frame]:
            what = "the file is truncated" if frame is frames[-1] else "the frame is incomplete"
            raise damaged(
                f"{what}: a bone is missing",
                f"{where}, frame {number}, bone {missing[0]}",
                code="incomplete_frame",
                joint=missing[0],
            )
    for before, after in itertools.pairwise(numbers):
        if after != before + 1:
            raise damaged(
                "frames are missing or repeated",
                f"{where}, after frame {before}",
                before + 1,
                after,
                code="frame_order",
                needed=before + 1,
                frame=after,
            )
    channels = skeleton.channels

    def location_of(n: int) -> str:
        name, freedom = channels[n % len(channels)]
        return f"{where}, frame {numbers[n // len(channels)]}, bone {name}, {freedom}"

    words = [word for frame in frames for name in moving for word in frame[name]]
    return numbers[0], read_numbers(words, location_of).reshape(len(frames), -1)
