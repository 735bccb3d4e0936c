"""The picture of one reconstructed walk: what it shows, from the reconstruction."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.core.keypoint_walk.calibration import angle_half_widths
from pipeline.core.keypoint_walk.objective import HEADING
from pipeline.core.sagittal_angles import ANGLES
from pipeline.pictures.keypoint_walk import WalkPicture
from pipeline.reconstruct.clip import Input, Walk
from pipeline.reconstruct.cycle import LEVEL_95
from pipeline.reconstruct.motion import keypoints_px
from pipeline.reconstruct.summary import heading_words

PICTURED = 5
"""Frames that a picture shows."""


def picture_of(walk: Walk, given: Input) -> WalkPicture:
    """Return what the picture of the best stretch shows."""
    stretch = walk.best
    found = stretch.found
    assert found is not None
    T = len(stretch.pixels)
    chosen = np.unique(np.linspace(0, T - 1, PICTURED).round().astype(int))
    keypoints, reprojected = keypoints_px(found), found.image_px
    knees = [ANGLES.index("left_knee"), ANGLES.index("right_knee")]
    half = angle_half_widths(walk.calibration, found.posterior.angles_sd_rad, LEVEL_95) * walk.bars_factor
    heading = float(found.fit.x[HEADING])
    return WalkPicture(
        keypoints=keypoints[chosen] + walk.centre_px,
        reprojected=reprojected[chosen] + walk.centre_px,
        frames=chosen + stretch.first_frame,
        headings_deg=np.degrees(found.starts.headings_rad),
        heading_cost=found.starts.heading_cost,
        heading_deg=float(np.degrees(heading)),
        times_s=(stretch.first_frame + np.arange(T)) / walk.frame_rate_hz,
        angles_deg=np.degrees(found.posterior.angles_rad[:, knees]),
        half_deg=np.degrees(half[:, knees]),
        angle_names=["left knee", "right knee"],
        positions_mm=found.posterior.positions_mm[chosen],
        title=f"{Path(given.path).name}: {stretch.judgement.verdict}, {heading_words(heading)}",
    )
