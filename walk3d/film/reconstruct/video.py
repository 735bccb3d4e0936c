"""Film in and out: the keypoints of a video for the reconstruction, and the reconstruction over the video."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.skeleton import WALKER15
from walk3d.film.keypoints import MEDIAPIPE
from walk3d.film.reconstruct.clip import Input, Walk
from walk3d.film.video import kept

SUFFIXES = (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm")
OVERLAY = "overlay.mp4"


def is_video(given: Input) -> bool:
    """Whether the input is a film, by its suffix."""
    return Path(given.path).suffix.lower() in SUFFIXES


@contextmanager
def with_keypoints(
    given: Input,
    earlier: Path | None = None,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> Iterator[Input]:
    """Input with the keypoints of a video in its place, while the context lasts; any other input as it is.

    Parameters
    ----------
    given : Input
    earlier : Path, optional
        Folder of an earlier reconstruction: keypoints of the same film are taken from there.
    tell, progress : callable
        See `walk3d.film.video.kept.keypoints_table`.
    """
    if not is_video(given):
        yield given
        return
    with tempfile.TemporaryDirectory() as name:
        before = earlier or Path(name)
        table = kept.keypoints_table(Path(given.path), Path(name), MEDIAPIPE, before, tell, progress)
        yield replace(given, path=str(table), layout=given.layout or "mediapipe33")


def overlay(walk: Walk, video: Path, path: Path) -> None:
    """Write the video with the keypoints and the reconstructed skeleton over it.

    Raises
    ------
    ModuleNotFoundError
        Without OpenCV.
    InvalidInput
        If no film can be written.
    """
    from walk3d.film.video.overlay import write_overlay

    seen: dict[int, np.ndarray] = {}
    drawn: dict[int, np.ndarray] = {}
    for stretch in walk.stretches:
        if not stretch.walks:
            continue
        frames = stretch.frames.tolist()
        seen |= zip(frames, stretch.pixels + walk.centre_px, strict=True)
        drawn |= zip(frames, stretch.fitted.image_px + walk.centre_px, strict=True)
    write_overlay(path, video, walk.source.frame_rate_hz, WALKER15.bones, seen, drawn)
