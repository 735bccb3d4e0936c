"""The page of one reconstructed walk: what it shows, from the reconstruction and the summary."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.core.keypoint_walk.calibration import NORMAL
from pipeline.core.keypoint_walk.film import Stretch
from pipeline.core.keypoint_walk.objective import HEADING, LOG_F, PHASE
from pipeline.core.sagittal_angles import KINDS
from pipeline.reconstruct import cycle, words
from pipeline.reconstruct.clip import Input, Walk
from pipeline.reconstruct.cycle import LEVEL_95, scale_mm
from pipeline.reconstruct.motion import keypoints_px, upright
from pipeline.reconstruct.summary import half_widths_mm, observed, view_sd_rad
from pipeline.report.walk_page import WalkPage


def page_of(
    walk: Walk, stretch: Stretch, summary: dict[str, Any], given: Input, files: Sequence[str]
) -> WalkPage:
    """Return what the page of a stretch shows.

    Parameters
    ----------
    walk : Walk
    stretch : Stretch
        With a reconstruction.
    summary : dict
        As `pipeline.reconstruct.summary.summarise` returns it.
    given : Input
    files : sequence of str
        Beside the page.
    """
    found = stretch.found
    assert found is not None
    view, cadence = summary["view_angle_deg"], summary["cadence"]
    positions = upright(found.posterior.positions_mm) * scale_mm(given)
    half = half_widths_mm(walk, found, given)[..., [0, 2, 1]]
    drawn, numbers = cycle.curves(walk, found), summary["gait_cycle"]["numbers"]
    setting = found.fit.objective.setting
    turned = 2.0 * np.pi * np.exp(found.fit.x[LOG_F]) * setting.times + found.fit.x[PHASE]
    heading = float(found.fit.x[HEADING])
    reach = NORMAL[LEVEL_95] * view_sd_rad(walk, found)
    first, last = summary["frames"]
    return WalkPage(
        title=f"Walk of person {walk.track.identity}" if walk.track.identity else "Walk of one person",
        lead=f"{words.VERDICTS[summary['verdict']]} The walker goes {view['words']}, with"
        f" {cadence['steps_per_min']:g} steps a minute. {' '.join(summary['usable'])}",
        source=f"{Path(given.path).resolve().name}, frames {first} to {last} ({summary['strides']:g} strides)",
        view_words=f"the walker goes {view['words']}",
        units=f"Lengths are in {summary['units']}.",
        terms=f"Walkers are {summary['terms']}.",
        facts=words.facts(summary),
        files=files,
        frame_numbers=stretch.first_frame + np.arange(len(stretch.pixels)),
        frame_rate_hz=walk.frame_rate_hz,
        observed=observed(found),
        keypoints_px=keypoints_px(found) + walk.centre_px,
        reprojection_px=found.image_px + walk.centre_px,
        positions_mm=positions,
        half_mm=half,
        image_px=2.0 * walk.centre_px,
        numbers=[_row(name, of) for name, of in numbers.items()],
        larger=[of.get("difference", {}).get("larger_than_its_bar", False) for of in numbers.values()],
        curve_names=KINDS,
        curves_deg=drawn.angles,
        curves_half_deg=drawn.half,
        walkers_deg=drawn.walkers,
        walkers_half_deg=drawn.walkers_half,
        stance_percent=drawn.stance,
        cycle_percent=100.0 * ((turned[:, None] - found.cycle.phases[0]) / (2.0 * np.pi) % 1.0),
        heading_deg=float(np.degrees(heading)),
        heading_interval_deg=(float(np.degrees(heading - reach)), float(np.degrees(heading + reach))),
        alternatives_deg=[other["heading_deg"] for other in view["alternatives"]],
    )


def _row(name: str, of: dict[str, Any]) -> list[str]:
    """Cells of one number: its name, values of either side or of the walk, their difference, the range of walkers."""

    def cell(side: str) -> str:
        return f"{of[side]['value']:g} ± {of[side]['half_width_95']:g}" if side in of else ""

    low, high = of["walkers_95"]
    named = f"{name.replace('_', ' ')}, {of['unit']}"
    cells = [cell("left") or cell("both"), cell("right"), cell("difference"), f"{low:g} to {high:g}"]
    return [named, *(text.replace("-", "−") for text in cells)]
