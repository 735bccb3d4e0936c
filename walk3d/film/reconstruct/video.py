"""Input and output of films: the keypoints of a video, and a video with the reconstruction drawn over it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.skeleton import WALKER15
from walk3d.film.keypoints import MEDIAPIPE
from walk3d.film.reconstruct.clip import Input, Walk
from walk3d.film.video import cached

SUFFIXES = (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm")
OVERLAY = "overlay.mp4"


def is_video(options: Input) -> bool:
    """Return True if the input has the suffix of a film."""
    return Path(options.path).suffix.lower() in SUFFIXES


@contextmanager
def with_keypoints(
    options: Input,
    earlier: Path | None = None,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> Iterator[Input]:
    """Yield the input options, with a video replaced by the table of its keypoints.

    Other input is unchanged.

    Parameters
    ----------
    options : Input
    earlier : Path, optional
        Folder of an earlier reconstruction; its keypoints are reused if the film is the same.
    tell, progress : callable
        See `walk3d.film.video.cached.keypoints_table`.
    """
    if not is_video(options):
        yield options
        return
    with tempfile.TemporaryDirectory() as name:
        before = earlier or Path(name)
        table = cached.keypoints_table(Path(options.path), Path(name), MEDIAPIPE, before, tell, progress)
        yield replace(options, path=str(table), layout=options.layout or "mediapipe33")


def overlay(walk: Walk, frames: Iterable[tuple[int, np.ndarray]], path: Path) -> None:
    """Write the film with the keypoints and the reconstructed skeleton drawn over it.

    Parameters
    ----------
    walk : Walk
    frames : iterable of (int, (H, W, 3))
        Numbers and RGB pictures of the film's frames.
    path : Path

    Raises
    ------
    ModuleNotFoundError
        If OpenCV is not installed.
    InvalidInput
        If the film cannot be written.
    """
    from walk3d.film.video.overlay import SIDE_COLOURS, side_of, write_overlay

    keypoints: dict[int, np.ndarray] = {}
    drawn: dict[int, np.ndarray] = {}
    for stretch in walk.stretches:
        if not stretch.walks:
            continue
        numbers = stretch.frames.tolist()
        keypoints |= zip(numbers, stretch.pixels + walk.centre_px, strict=True)
        drawn |= zip(numbers, stretch.fitted.image_px + walk.centre_px, strict=True)
    bones = {bone: SIDE_COLOURS[side_of(WALKER15.joints[joint] for joint in bone)] for bone in WALKER15.bones}
    write_overlay(path, frames, walk.source.frame_rate_hz, bones, keypoints, drawn)
