"""Cache of a video's keypoints as a table, so that a second run does not process the film again."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from pipeline.reading import read_json
from pipeline.resources import install_hint, missing_package
from pipeline.validation import InvalidInput

TABLE, ABOUT = "keypoints.csv", "keypoints.json"


def keypoints_table(
    video: Path,
    folder: Path,
    names: tuple[str, ...],
    earlier: Path,
    tell: Callable[[str], None],
    progress: Callable[[int, int], None],
) -> Path:
    """Return the path of the table of a video's keypoints.

    Its columns are ``frame,person,<landmark>_x,<landmark>_y,<landmark>_visibility``.

    Parameters
    ----------
    video : Path
    folder : Path
        Folder into which the table and the facts about the video are written.
    names : tuple of str
        Names of the landmarks.
    earlier : Path
        Folder that may already have the table of the same video, which is then copied.
    tell, progress : callable
        Called with messages on downloads, and with the numbers of processed and of all frames.

    Raises
    ------
    InvalidInput
        If the packages, the networks or the video cannot be used, or no person is visible.
    """
    if not video.is_file():
        raise InvalidInput("there is no such video", "input.path", received=video, code="no_file", typed=True)
    with video.open("rb") as film:
        digest = hashlib.file_digest(film, "sha256").hexdigest()
    table, about = folder / TABLE, folder / ABOUT
    if _about(earlier).get("sha256") == digest and (earlier / TABLE).is_file():
        copy(earlier, folder)
        return table
    from walk3d.film.video.film import frames_of, keypoints_of
    from walk3d.film.video.networks import PACKAGE, networks
    from walk3d.film.video.pose import Pose

    try:
        every, _ = frames_of(video)
        pose = Pose(networks(tell))
    except ModuleNotFoundError as error:
        if not (package := missing_package(error)):
            raise
        raise InvalidInput(
            f"the detection of keypoints in a video needs {install_hint(package)}", "input.path", received=video.name,
            code="missing_package", typed=True, package=package
        ) from error  # fmt: skip
    filmed = keypoints_of(video, pose, lambda done: progress(done, every))
    columns = [f"{name}_{what}" for name in names for what in ("x", "y", "visibility")]
    rows = [",".join(["frame", "person", *columns])]
    for frame, person, points in zip(filmed.frame, filmed.person, filmed.points, strict=True):
        rows.append(f"{frame},{person}," + ",".join(f"{v:.2f}" for v in np.round(points, 2).ravel().tolist()))
    table.write_text("\n".join(rows) + "\n", "utf-8")
    facts = {
        "video": video.name, "sha256": digest, "networks": PACKAGE, "frame_rate_hz": filmed.frame_rate_hz,
        "width": filmed.width, "height": filmed.height, "uneven": filmed.uneven,
    }  # fmt: skip
    about.write_text(json.dumps(facts, indent=1) + "\n", "utf-8")
    return table


def copy(earlier: Path, folder: Path) -> None:
    """Copy the table of a video's keypoints, and the file with facts about the video, to another folder."""
    for name in (TABLE, ABOUT):
        shutil.copyfile(earlier / name, folder / name)


def resampled_hz(folder: Path) -> float:
    """Return the frame rate, Hz, to which a video with non-uniform time stamps was resampled, or 0."""
    about = _about(folder)
    return float(str(about["frame_rate_hz"])) if about.get("uneven") else 0.0


def _about(folder: Path) -> dict[str, object]:
    with suppress(InvalidInput):
        return dict(read_json(folder / ABOUT, dict[str, object]))
    return {}
