"""What is said of a reconstructed walk, in words and numbers: the content of ``summary.json``."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.skeleton import ANKLES, WALKER15
from pipeline.storage import tables
from walk3d.film.reconstruct import cycle
from walk3d.film.reconstruct.clip import Walk
from walk3d.film.reconstruct.cycle import HEIGHT_SHARE, LEVEL_95, scale_mm
from walk3d.film.walk import HEIGHT_MM, Reconstruction, view_angle_deg
from walk3d.film.walk.calibration import (
    CADENCE_EXTRA,
    NORMAL,
    VIEW_EXTRA_RAD,
    angle_half_widths,
    joint_half_widths,
)  # fmt: skip
from walk3d.film.walk.errors import SCORED
from walk3d.film.walk.film import Stretch
from walk3d.film.walk.objective import FOCAL_SD, HEADING, PITCH, TURN
from walk3d.film.walk.reconstruction import LABELS_UNSURE
from walk3d.film.walk.sagittal_angles import ANGLES
from walk3d.film.walk.tracks import path_turn_rad
from walk3d.film.walk.training import SIZE
from walk3d.film.walk.verdict import DOUBTFUL_DISTANCE, DOUBTFUL_RESIDUAL, SLOW_STRIDE_HZ, Verdict

NO_PATH = "in place, on a treadmill, or the camera follows"
"""Locomotion of a walker who does not move through the image as fast as the feet say."""
RIVAL_COST = 60.0
"""Candidates whose cost is above the best's by less are given as alternatives."""
SEEN_DEG = 10.0
"""Degrees off one of the four main directions from which on somebody is seen from another side, too."""
TURNED_DEG = 20.0
"""Turn of the heading over a stretch beyond which the path is said to bend."""
ONE_STRIDE = 1.2
"""Strides below which times and differences of left and right rest on one."""
OFF_MIDDLE_DEG = 12.0
"""Distance of the walker from the middle of the image beyond which an unknown focal length is remarked on."""
LEAN_DEG = 9.0
"""Lean of the head over the ankles in the image beyond which a rolled camera is remarked on."""


def heading_words(heading_rad: float) -> str:
    """Where somebody walks, as seen by the camera.

    Examples
    --------
    >>> import numpy as np
    >>> heading_words(0.0)
    'straight towards the camera, seen from the front'
    >>> heading_words(np.radians(101))
    "to the image's right, 11° off away from the camera, seen from the walker's right and behind"
    >>> heading_words(np.radians(-140))
    "away from the camera, 40° off to the image's left, seen from behind and the walker's left"
    """
    ways = (
        ("towards the camera", "the front"), ("to the image's right", "the walker's right"),
        ("away from the camera", "behind"), ("to the image's left", "the walker's left"),
    )  # fmt: skip
    degrees = np.degrees(heading_rad) % 360.0
    nearest = round(degrees / 90.0)
    off = round(degrees - 90.0 * nearest)
    to, seen = ways[nearest % 4]
    if not off:
        return f"straight {to}, seen from {seen}"
    aside, also = ways[(nearest + (1 if off > 0 else -1)) % 4]
    return f"{to}, {abs(off)}° off {aside}, seen from {seen}{f' and {also}' if abs(off) > SEEN_DEG else ''}"


def units(walk: Walk) -> str:
    """What lengths are in."""
    return "mm" if walk.stature_mm else "mm of a walker of 1500 mm from ankles to the centre of the head"


def observed(found: Reconstruction) -> np.ndarray:
    """Joints (15,) bool that the detector gave in some frame; the others are estimated from them."""
    return np.asarray((found.keypoints.weights > 0).any(axis=0))


def summarise(walk: Walk) -> dict[str, Any]:
    """Return everything that is known of a clip, as plain numbers and texts."""
    best = walk.best
    stretches = [_stretch(stretch, walk) for stretch in walk.stretches]
    return {
        "verdict": str(best.judgement.verdict),
        "why": list(best.judgement.reasons),
        **stretches[walk.stretches.index(best)],
        "recognised": {
            "format": walk.source.format,
            "layout": walk.recognised,
            "frames": walk.source.n_frames,
            "frame_rate_hz": walk.frame_rate_hz,
            "focal_known": walk.focal_known,
            "principal_point_px": [_round(v, 1) for v in walk.centre_px],
            "person": walk.track.identity or "longest track",
            "track_frames": [int(walk.track.frame[0]), int(walk.track.frame[-1])],
        },
        "notes": list(walk.notes),
        "stretches": stretches,
        "units": units(walk),
        "terms": "learnt from healthy adults and children; not for clinical use",
    }


def _round(value: float, digits: int) -> float:
    return round(float(value), digits)


def _interval(centre: float, half: float) -> list[float]:
    return [_round(centre - half, 1), _round(centre + half, 1)]


def off_middle_rad(found: Reconstruction) -> float:
    """Root mean square angle between the walker and the middle of the image, sideways, over the stretch."""
    seen = found.keypoints.weights > 0
    columns = np.where(seen, found.keypoints.pixels[..., 0], np.nan)[seen.any(axis=1)]
    bearing = np.arctan(np.nanmean(columns, axis=1) / found.focal_px)
    return np.sqrt(np.mean(bearing**2))


def view_sd_rad(walk: Walk, found: Reconstruction) -> float:
    """Standard deviation of the heading: the fit's, crabwise walking, and a focal length that was assumed.

    Off the middle of the image, part of the side from which somebody is seen is due to where he is in the image; how
    much, the focal length says.  Where that was found with the walk, the fit's deviation has it already.
    """
    assumed = not (walk.focal_known or found.focal_found)
    from_focal = FOCAL_SD * off_middle_rad(found) if assumed else 0.0
    fitted = found.posterior.heading_sd_rad * walk.calibration.view[0, LEVEL_95]
    return np.sqrt(fitted**2 + VIEW_EXTRA_RAD**2 + from_focal**2)


def _stretch(stretch: Stretch, walk: Walk) -> dict[str, Any]:
    described: dict[str, Any] = {
        "frames": [stretch.first_frame, stretch.last_frame],
        "verdict": str(stretch.judgement.verdict),
        "why": list(stretch.judgement.reasons),
    }
    found = stretch.found
    if found is None:
        return described
    described["focal_px"] = _round(found.focal_px, 1)
    described["residual_percent_of_height"] = _round(found.relative_residual, 2)
    described["distance_from_walkers"] = _round(found.starts.least_distance, 2)
    if not stretch.walks:
        return described  # numbers of a walk that is none would only mislead
    heading = found.fit.x[HEADING]
    half = np.degrees(NORMAL[LEVEL_95] * view_sd_rad(walk, found))
    stride_hz = found.fit.frequency_hz
    fitted = found.posterior.log_frequency_sd * walk.calibration.view[1, LEVEL_95]
    cadence_half = NORMAL[LEVEL_95] * np.hypot(fitted, CADENCE_EXTRA)
    rivals = [
        c
        for c in found.candidates[1:]
        if c.cost_above_best < (RIVAL_COST if c.labels_exchanged == found.labels_exchanged else LABELS_UNSURE)
    ]
    described |= {
        "usable": _usable(found) if stretch.judgement.verdict == Verdict.doubtful else [],
        "strides": _round(found.strides, 1),
        "view_angle_deg": {
            "value": _round(view_angle_deg(heading), 1),
            "interval_95": _interval(view_angle_deg(heading), half),
            "convention": "of the papers: 0 is seen from behind, +90 from the walker's right",
            "heading_deg": _round(np.degrees(heading), 1),
            "turned_deg": _round(turned_deg(found), 1),
            "words": heading_words(heading),
            "alternatives": [
                {
                    "heading_deg": _round(np.degrees(c.heading_rad), 1),
                    "view_angle_deg": _round(view_angle_deg(c.heading_rad), 1),
                    "words": heading_words(c.heading_rad),
                    "stride_hz": _round(c.frequency_hz, 3),
                    "left_and_right_exchanged": c.labels_exchanged,
                    "cost_above_best": _round(c.cost_above_best, 1),
                }
                for c in rivals
            ],
        },
        "cadence": {
            "strides_per_s": _round(stride_hz, 3),
            "steps_per_min": _round(120.0 * stride_hz, 1),
            "interval_95_steps_per_min": _interval(120.0 * stride_hz, 120.0 * stride_hz * cadence_half),
        },
        **_speed(found, stride_hz, walk.stature_mm),
        "angles_deg": _angles(found, walk),
        "gait_cycle": {
            "numbers": cycle.numbers(walk, found),
            "events": cycle.events(walk, stretch),
            "variability": cycle.NO_VARIABILITY,
        },
        "labels": {
            "exchanged_throughout": found.labels_exchanged,
            "unsure": found.labels_unsure,
            "exchanged_frames": {
                limb: stretch.frames[which].tolist() for limb, which in found.fit.exchanged.items()
            },
        },
        "noise": {"sigma_px": _round(found.fit.noise.sigma_px, 2), "kappa": _round(found.fit.noise.kappa, 2)},
        "half_width_95_mm": {
            joint: [_round(v, 0) for v in row]
            for joint, row in zip(WALKER15.joints, half_widths_mm(walk, found).mean(axis=0), strict=True)
            if joint != "pelvis"
        },
        "bars": {
            "for": walk.bars_for,
            "mean_half_width_95_mm": {
                whom: _round(half_widths_mm(replace(walk, bars_for=whom), found)[:, SCORED].mean(), 1)
                for whom in walk.calibrations
            },
        },
        "estimated_joints": [j for j, seen in zip(WALKER15.joints, observed(found), strict=True) if not seen],
        "next_time": advice(walk, stretch),
    }
    return described


def _usable(found: Reconstruction) -> list[str]:
    """What remains usable of a walk that is doubtful."""
    slow = found.candidates[0].frequency_hz < SLOW_STRIDE_HZ
    reasons = {
        "cadence, times and speeds are as right as the frame rate": slow,
        "angles and lengths may be off by more than their bars": found.relative_residual > DOUBTFUL_RESIDUAL,
        "angles and lengths are pulled towards those of other walkers": found.starts.least_distance
        > DOUBTFUL_DISTANCE,
        "times and differences of left and right rest on one stride": found.strides < ONE_STRIDE,
    }
    doubts = [words for words, held in reasons.items() if held] or [
        "everything may be off by more than its bars"
    ]
    return [f"Usable: heading{'' if slow else ' and cadence'}; {'; '.join(doubts)}."]


def half_widths_mm(walk: Walk, found: Reconstruction) -> np.ndarray:
    """Half widths (T, 15, 3) of 95 % bars about the pelvis, right, down and away, mm."""
    return joint_half_widths(walk.calibration, found.posterior.sd_mm, LEVEL_95) * scale_mm(walk)


def _speed(found: Reconstruction, stride_hz: float, stature_mm: float) -> dict[str, Any]:
    belt = found.fit.objective.prior.belt
    stride = 2.0 * np.pi * (belt @ found.posterior.walker.ravel())  # mm of ground per cycle
    stature = HEIGHT_MM / HEIGHT_SHARE
    described: dict[str, Any] = {
        "locomotion": "overground" if found.starts.overground else NO_PATH,
        "step_length": {"per_stature": _round(stride / 2.0 / stature, 3)},
        "speed": {"statures_per_s": _round(stride * stride_hz / stature, 3)},
    }
    if stature_mm:
        described["step_length"]["mm"] = _round(stride / 2.0 / stature * stature_mm, 0)
        described["speed"]["mm_per_s"] = _round(stride * stride_hz / stature * stature_mm, 0)
    return described


def _angles(found: Reconstruction, walk: Walk) -> dict[str, Any]:
    """Ranges of the angles over the frames, and the bar of an angle in a frame, in the mean."""
    angles = np.degrees(found.posterior.angles_rad)
    half = np.degrees(angle_half_widths(walk.calibration, found.posterior.angles_sd_rad, LEVEL_95))
    return {
        name: {
            "least": _round(angles[:, k].min(), 1),
            "most": _round(angles[:, k].max(), 1),
            "mean_half_width_95": _round(half[:, k].mean(), 1),
        }
        for k, name in enumerate(ANGLES)
    }


def turned_deg(found: Reconstruction) -> float:
    """Heading at the end of a stretch less that at its beginning; the heading that is told is that of the middle.

    Detectors exaggerate how a body that passes turns its front, then its back to the camera: seen from the side, some
    20 to 50° of this are theirs, also on a straight path.
    """
    times = found.fit.times
    return np.degrees(found.fit.x[TURN]) * (times[-1] - times[0])


def path_bend_deg(found: Reconstruction) -> float:
    """Turn of the path in the image over a stretch, whatever the body does: 0° is towards the camera, +90° right."""
    pixels = np.where(found.keypoints.weights[..., None] > 0, found.keypoints.pixels, np.nan)
    heights = found.fit.objective.prior.mean[:, 2, 0]
    return -np.degrees(path_turn_rad(pixels, heights, found.focal_px))


def lean_deg(found: Reconstruction) -> float:
    """Angle in the image between the vertical at the walker and the head over the ankles."""
    at, pitch = found.image_px.mean(axis=(0, 1)), found.fit.x[PITCH]
    above = found.image_px[:, WALKER15.index("head")] - found.image_px[:, ANKLES].mean(axis=1)
    vertical = at * np.sin(pitch) - [0.0, found.focal_px * np.cos(pitch)]
    lean, upright = (np.arctan2(up[0], -up[1]) for up in (above.mean(axis=0), vertical))
    return float(np.degrees(abs(lean - upright)))


def advice(walk: Walk, stretch: Stretch) -> list[str]:
    """What to film better next time."""
    found, sentences = stretch.fitted, []
    heading = abs(np.degrees(found.fit.x[HEADING]))
    if min(heading, 180.0 - heading) < 20.0:
        sentences.append(
            "From 30 to 60° to the path depth is better known and the knee's error a fifth smaller."
        )
    if found.strides < 2.0:
        sentences.append(f"Only {found.strides:.1f} strides: three or more halve the error of the cadence.")
    if found.height_px < 250.0:
        sentences.append(
            f"The walker is only {found.height_px:.0f} px high: film nearer or with a longer lens."
        )
    if (
        found.starts.overground
        and min(abs(turned_deg(found)), abs(bend := path_bend_deg(found))) > TURNED_DEG
    ):
        sentences.append(
            f"The path bends: the heading turned by {bend:+.0f}° on the way, and the view is that of the middle."
            " Film a straight path, or give fewer frames."
        )
    if found.labels_unsure:
        sentences.append(
            "Left and right could not be told apart: filming a path towards or past the camera tells them."
        )
    if (lean := lean_deg(found)) > LEAN_DEG:
        sentences.append(
            f"The walker leans by {lean:.0f}° in the picture: turn the film upright if the camera was rolled; bars know"
            " neither of that nor of somebody who stoops so."
        )
    off = np.degrees(off_middle_rad(found))
    if not walk.focal_known and off > OFF_MIDDLE_DEG:
        sentences.append(
            f"The walker is {off:.0f}° off the middle of the image, where the view depends on the focal length:"
            " give it (input.focal_px), or film him in the middle."
        )
    elif not walk.focal_known:
        sentences.append("Give the focal length in pixels (input.focal_px) if the camera is known.")
    return sentences


def table_rows(walk: Walk) -> dict[str, list[Any]]:
    """Columns of the long table of joints: every frame of every stretch that is or may be a walk.

    Axes are x to the image's right, y away from the camera, z up, about the pelvis in the middle of the stretch.
    """
    J, rows = len(WALKER15.joints), list[tuple[Any, ...]]()
    for number, stretch in enumerate(walk.stretches):
        if not stretch.walks:
            continue
        found = stretch.fitted
        level, half = world_mm(found) * scale_mm(walk), half_widths_mm(walk, found)
        frames = np.repeat(stretch.frames, J)
        upright = np.concatenate([level[..., [0, 2, 1]] * [1.0, 1.0, -1.0], half[..., [0, 2, 1]]], axis=-1)
        rows += zip(
            [number] * len(frames),
            frames.tolist(),
            (frames / walk.frame_rate_hz).round(6).tolist(),
            WALKER15.joints * len(level),
            *upright.reshape(-1, 6).T.round(2).tolist(),
            (found.keypoints.weights > 0).astype(int).ravel().tolist(),
            strict=True,
        )
    names = ("stretch", "frame", "time_s", "joint", "x", "y", "z", "half_x", "half_y", "half_z", "observed")
    return tables.of_rows(names, rows)


def world_mm(found: Reconstruction) -> np.ndarray:
    """Positions (T, 15, 3) in level camera axes about the pelvis in the middle of the stretch, path included."""
    x, objective = found.fit.x, found.fit.objective
    own = x.copy()
    own[:SIZE] = found.posterior.walker.ravel()
    level = objective.at(own).level.T
    middle = len(level) // 2
    return level - level[middle, WALKER15.index("pelvis")]
