"""Content of the page that describes one reconstructed walk."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from walk3d.film.reconstruct import cycle, words
from walk3d.film.reconstruct.clip import Walk
from walk3d.film.reconstruct.cycle import LEVEL_95, scale_mm
from walk3d.film.reconstruct.motion import keypoints_px, upright
from walk3d.film.reconstruct.summary import half_widths_mm, observed, view_sd_rad
from walk3d.film.reconstruct.walk_page import Cycle, Frames, Heading, WalkPage
from walk3d.film.walk.calibration import NORMAL
from walk3d.film.walk.objective import HEADING
from walk3d.film.walk.sagittal_angles import KINDS


def page_of(walk: Walk, summary: dict[str, Any], path: str, files: Sequence[str]) -> WalkPage:
    """Return the content of the page for the best stretch of a walk.

    Parameters
    ----------
    walk : Walk
    summary : dict
        Result of `walk3d.film.reconstruct.summary.summarise`.
    path : str
        File of keypoints, or film.
    files : sequence of str
        Names of the files next to the page.
    """
    stretch, reconstruction = walk.best, walk.best.fitted
    view, cadence = summary["view_angle_deg"], summary["cadence"]
    positions = upright(reconstruction.posterior.positions_mm) * scale_mm(walk)
    half = half_widths_mm(walk, reconstruction)[..., [0, 2, 1]]
    heading = reconstruction.fit.x[HEADING]
    reach = NORMAL[LEVEL_95] * view_sd_rad(walk, reconstruction)
    first, last = summary["frames"]
    return WalkPage(
        title=f"Walk of person {walk.track.identity}" if walk.track.identity else "Walk of one person",
        lead=f"{words.VERDICTS[summary['verdict']]} The walker goes {view['words']}, with"
        f" {cadence['steps_per_min']:g} steps a minute. {' '.join(summary['usable'])}",
        source=f"{Path(path).resolve().name}, frames {first} to {last} ({summary['strides']:g} strides)",
        view_words=f"the walker goes {view['words']}",
        terms=f"The model was {summary['terms']}.",
        facts=words.facts(summary),
        files=files,
        frames=Frames(
            numbers=stretch.frames,
            rate_hz=walk.frame_rate_hz,
            observed=observed(reconstruction),
            keypoints_px=keypoints_px(reconstruction) + walk.centre_px,
            reprojection_px=reconstruction.image_px + walk.centre_px,
            image_px=2.0 * walk.centre_px,
            positions_mm=positions,
            half_mm=half,
            cycle_percent=100.0
            * (
                (reconstruction.fit.phases_rad[:, None] - reconstruction.cycle.phases[0])
                / (2.0 * np.pi)
                % 1.0
            ),
        ),
        cycle=Cycle(
            numbers=summary["gait_cycle"]["numbers"],
            curves=cycle.curves(walk, reconstruction),
            curve_names=KINDS,
        ),
        heading=Heading(
            deg=np.degrees(heading),
            interval_deg=(np.degrees(heading - reach), np.degrees(heading + reach)),
            alternatives_deg=[other["heading_deg"] for other in view["alternatives"]],
        ),
    )
