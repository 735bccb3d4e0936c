"""Detection of people and of their 33 landmarks in one image, by two neural networks.

Symbols
-------
``region``  (4,): centre, side and turn of a square about a person, px and rad: the middle of the hips, twice the
            radius of a circle about the body with a margin, and its lean

The detector's squares are decoded as its training encoded them: anchors on grids of 28, 14 and 7 cells.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from walk3d.film.video.networks import FILES

DETECTOR_PX, LANDMARK_PX = 224, 256
GRIDS = ((28, 2), (14, 2), (7, 6))
"""Number of cells along each side, and number of anchors per cell, for each of the person detector's three grids."""
MIN_SCORE = 0.5
OVERLAP = 0.3
"""Intersection over union of two boxes above which both detections belong to the same person."""
MARGIN = 1.25
LANDMARKS = 33
AUXILIARY = (33, 34)
"""Indices of two auxiliary points after the landmarks: the middle of the hips, and a point on a circle around the body.
"""


@contextmanager
def silent() -> Iterator[None]:
    """Suppress the messages of libraries on standard error; exceptions are still raised."""
    sys.stderr.flush()
    stderr, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)
        os.close(nowhere)


def anchors() -> np.ndarray:
    """Return the centres (2254, 2) of the detector's anchors, as shares of the size of its input image."""
    parts = []
    for cells, times in GRIDS:
        middle = (np.arange(cells) + 0.5) / cells
        grid = np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)
        parts.append(np.repeat(grid, times, axis=0))
    return np.concatenate(parts)


def region_of(centre: np.ndarray, rim: np.ndarray) -> np.ndarray:
    """Return the square region around a person, px, given the centre and the top of a circle around the body."""
    away = rim - centre
    return np.array([*centre, 2.0 * MARGIN * np.hypot(*away), np.arctan2(away[0], -away[1])])


def _to_square(region: np.ndarray, size: int) -> np.ndarray:
    """Return the affine map (2, 3) from image pixels to the pixels of a person's upright square region."""
    x, y, side, turn = region
    scale = size / side
    c, s = scale * np.cos(turn), scale * np.sin(turn)
    linear = np.array([[c, s], [-s, c]])
    return np.column_stack([linear, size / 2.0 - linear @ [x, y]])


class Pose:
    """Detector of people and detector of landmarks; each network runs in one thread.

    Parameters
    ----------
    folder : Path
        Folder of the networks.
    """

    def __init__(self, folder: Path) -> None:
        # Imported here: the base install has neither package, and other parts of this module work without them.
        import cv2
        from ai_edge_litert.interpreter import Interpreter

        cv2.setNumThreads(1)
        self._cv2 = cv2
        detector, landmarks, _ = FILES
        with silent():
            self._detector, self._landmarks = (
                Interpreter(str(folder / name), num_threads=1) for name in (detector, landmarks)
            )
            for network in (self._detector, self._landmarks):
                network.allocate_tensors()
        self._anchors = anchors()

    def _run(self, network: Any, picture: np.ndarray) -> list[np.ndarray]:
        network.set_tensor(network.get_input_details()[0]["index"], picture[None])
        network.invoke()
        return [
            np.asarray(network.get_tensor(out["index"])[0], float) for out in network.get_output_details()[:2]
        ]

    def detect(self, picture: np.ndarray, *, closer: bool = False) -> list[np.ndarray]:
        """Return the regions of the people in an RGB image (H, W, 3), sorted by decreasing confidence.

        If none is found, `closer` searches overlapping squares of half the side for smaller people.
        """
        height, width = picture.shape[:2]
        side = float(max(width, height))
        regions = self._within(picture, np.array([width / 2.0, height / 2.0, side, 0.0]))
        if closer and not regions:
            middles = product(*(_middles(extent, side / 2.0) for extent in (width, height)))
            regions = [
                region for at in middles for region in self._within(picture, np.array([*at, side / 2.0, 0.0]))
            ]
        return regions

    def _within(self, picture: np.ndarray, window: np.ndarray) -> list[np.ndarray]:
        """Return the regions of the people in a square window of an image, sorted by decreasing confidence."""
        square = self._cv2.warpAffine(picture, _to_square(window, DETECTOR_PX), (DETECTOR_PX, DETECTOR_PX))
        raw, score = self._run(self._detector, square.astype(np.float32) / 127.5 - 1.0)
        sure = 1.0 / (1.0 + np.exp(-np.clip(score[:, 0], -50.0, 50.0)))
        people: list[tuple[np.ndarray, np.ndarray]] = []
        for number in np.argsort(-sure, kind="stable"):
            if sure[number] < MIN_SCORE:
                break
            points = raw[number].reshape(-1, 2) / DETECTOR_PX
            points[[0, 2, 3, 4, 5]] += self._anchors[number]
            centre, extent = points[:2]
            box = np.concatenate([centre - extent / 2.0, centre + extent / 2.0])
            if all(_shared(box, other) < OVERLAP for other, _ in people):
                circle = (points[2:4] - 0.5) * window[2] + window[:2]
                people.append((box, region_of(*circle)))
        return [region for _, region in people]

    def place(self, picture: np.ndarray, region: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Locate the landmarks of the person in a region of an image.

        Returns
        -------
        points : (33, 3)
            Column and row, px, and visibility, 0 to 1.
        region : (4,)
            Region of the same person, for the next picture.
        score : float
            Confidence that there is a person, 0 to 1.
        """
        to_square = _to_square(region, LANDMARK_PX)
        square = self._cv2.warpAffine(picture, to_square, (LANDMARK_PX, LANDMARK_PX))
        flat, score = self._run(self._landmarks, square.astype(np.float32) / 255.0)
        rows = flat.reshape(-1, 5)
        back = self._cv2.invertAffineTransform(to_square)
        positions = rows[:, :2] @ back[:, :2].T + back[:, 2]
        # The smaller of the two scores: visible, and present in the picture.
        visibility = 1.0 / (1.0 + np.exp(-np.clip(rows[:, 3:5].min(axis=1), -50.0, 50.0)))
        points = np.column_stack([positions, visibility])[:LANDMARKS]
        return points, region_of(*positions[list(AUXILIARY)]), score[0]


def _middles(extent: float, side: float) -> np.ndarray:
    """Return the centres of windows that cover an extent, each overlapping the next one by at least half."""
    spare = max(extent - side, 0.0)
    return extent / 2.0 + np.linspace(-spare / 2.0, spare / 2.0, 1 + int(np.ceil(2.0 * spare / side)))


def _shared(box: np.ndarray, other: np.ndarray) -> float:
    """Return the intersection over union of two boxes (left, top, right, bottom)."""
    sides = np.minimum(box[2:], other[2:]) - np.maximum(box[:2], other[:2])
    both = np.prod(np.maximum(sides, 0.0))
    return both / max(np.prod(box[2:] - box[:2]) + np.prod(other[2:] - other[:2]) - both, 1e-12)
