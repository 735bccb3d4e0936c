"""The page of one walk that was reconstructed from keypoints: one HTML file with a player."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.palette import COLOURS, ROLES
from pipeline.report import templates
from pipeline.report.players import encoded, quantise
from pipeline.report.published import packed_json
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput

MOST_BYTES = 1_000_000
MOST_FRAMES = 600
"""More frames are thinned out, which the eye does not see."""
_SCRIPTS = ("walker.js", "charts.js", "players.js", "theme.js", "walk.js")


@dataclass(frozen=True)
class WalkPage:
    """What the page of a walk shows.

    Attributes
    ----------
    title, lead, view_words, units, terms : str
    facts : sequence of (str, sequence of str)
        Titles and sentences.
    files : sequence of str
        Names of files beside the page.
    frame_numbers : (T,) int
        Of the video.
    frame_rate_hz : float
    observed : (15,) bool
        False for joints that were never seen.
    keypoints_px, reprojection_px : (T, 15, 2)
        Keypoints are NaN where missing.
    positions_mm, half_mm : (T, 15, 3)
        About the pelvis, right, away and up; half widths of 95 % bars.
    angle_names : sequence of str
        Of both sides, as ``left_knee``.
    angles_deg, angle_half_deg : (T, A)
    heading_deg : float
        0 is towards the camera, +90 to the image's right.
    heading_interval_deg : (float, float)
    alternatives_deg : sequence of float
        Other headings that are possible.
    """

    title: str
    lead: str
    view_words: str
    units: str
    terms: str
    facts: Sequence[tuple[str, Sequence[str]]]
    files: Sequence[str]
    frame_numbers: np.ndarray
    frame_rate_hz: float
    observed: np.ndarray
    keypoints_px: np.ndarray
    reprojection_px: np.ndarray
    positions_mm: np.ndarray
    half_mm: np.ndarray
    angle_names: Sequence[str]
    angles_deg: np.ndarray
    angle_half_deg: np.ndarray
    heading_deg: float
    heading_interval_deg: tuple[float, float]
    alternatives_deg: Sequence[float]


def write_walk_page(path: Path, page: WalkPage) -> None:
    """Write the page of a walk.

    Raises
    ------
    InvalidInput
        If it would be larger than `MOST_BYTES`.
    """
    text = templates.environment().get_template("walk.html.j2").render(
        page=page,
        style=templates.style(),
        script=templates.scripts(_SCRIPTS),
        roles=packed_json({**{name: name for name in COLOURS}, **ROLES}),
        bones=packed_json([list(bone) for bone in WALKER15.bones]),
        packed=packed_json(_packed(page)),
    )  # fmt: skip
    content = text.encode()
    if len(content) > MOST_BYTES:
        raise InvalidInput(
            "the page would be too large", where=path.name, expected=f"at most {MOST_BYTES} bytes",
            received=str(len(content)),
        )  # fmt: skip
    path.write_bytes(content)


def _packed(page: WalkPage) -> dict[str, Any]:
    """Return what the browser draws, every so many frames of a long clip."""
    every = int(np.ceil(len(page.frame_numbers) / MOST_FRAMES))
    numbers = page.frame_numbers[::every]

    def packed(values: np.ndarray) -> dict[str, str]:
        return quantise(values[::every].reshape(len(numbers), -1)).packed()

    seen = np.isfinite(page.keypoints_px).all(axis=-1)
    return {
        "frames": len(numbers),
        "frame_numbers": numbers.tolist(),
        "times_s": [round(float(number) / page.frame_rate_hz, 4) for number in numbers],
        "rate_hz": page.frame_rate_hz / every,
        "observed": np.asarray(page.observed).tolist(),
        "seen": encoded(seen[::every], "u1"),
        "keypoints": packed(np.where(seen[..., None], page.keypoints_px, page.reprojection_px)),
        "image": packed(page.reprojection_px),
        "positions": packed(page.positions_mm),
        "half": packed(page.half_mm),
        "angle_names": list(page.angle_names),
        "angles": packed(page.angles_deg),
        "angle_half": packed(page.angle_half_deg),
        "heading_deg": page.heading_deg,
        "heading_interval_deg": list(page.heading_interval_deg),
        "alternatives_deg": list(page.alternatives_deg),
    }
