"""Summary of a reconstructed walk, in words and numbers, for ``summary.json``."""

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
"""Words for the locomotion of a walker who moves through the image more slowly than the feet imply."""
ALTERNATIVE_COST = 60.0
"""Difference from the cost of the best candidate, up to which other candidates are listed as alternatives."""
SECOND_SIDE_DEG = 10.0
"""Angle between heading and nearest main direction, degrees, above which the summary names a second visible side."""
TURNED_DEG = 20.0
"""Change of heading over a stretch, degrees, above which the path is reported as bent."""
SINGLE_STRIDE = 1.2
"""Number of strides below which the summary warns that times and left-right differences rest on a single stride."""
OFF_MIDDLE_DEG = 12.0
"""Angle between walker and image centre, degrees, above which the advice mentions an unknown focal length."""
LEAN_DEG = 9.0
"""Angle between walker and vertical in the image, degrees, above which the advice mentions a rolled camera."""


def heading_words(heading_rad: float) -> str:
    """Return the walking direction in words, as seen by the camera.

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
    to, side = ways[nearest % 4]
    if not off:
        return f"straight {to}, seen from {side}"
    aside, second = ways[(nearest + (1 if off > 0 else -1)) % 4]
    return f"{to}, {abs(off)}° off {aside}, seen from {side}{f' and {second}' if abs(off) > SECOND_SIDE_DEG else ''}"


def units(walk: Walk) -> str:
    """Return the unit of lengths in the results, in words."""
    return "mm" if walk.stature_mm else "mm of a walker of 1500 mm from ankles to the centre of the head"


def observed(reconstruction: Reconstruction) -> np.ndarray:
    """Return the mask (15,) of joints that were detected in at least one frame; all other joints are only estimated."""
    return np.asarray((reconstruction.keypoints.weights > 0).any(axis=0))


def summarise(walk: Walk) -> dict[str, Any]:
    """Return the summary of a clip, as plain numbers and strings."""
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


def off_middle_rad(reconstruction: Reconstruction) -> float:
    """Root mean square, over a stretch, of the horizontal angle between walker and image centre, rad."""
    visible = reconstruction.keypoints.weights > 0
    columns = np.where(visible, reconstruction.keypoints.pixels[..., 0], np.nan)[visible.any(axis=1)]
    bearing = np.arctan(np.nanmean(columns, axis=1) / reconstruction.focal_px)
    return np.sqrt(np.mean(bearing**2))


def view_sd_rad(walk: Walk, reconstruction: Reconstruction) -> float:
    """Standard deviation of the heading, rad.

    It combines the deviation of the fit, crabwise walking, and the uncertainty of an assumed focal length.

    Off the middle of the image, the apparent view depends on the focal length.  A focal length that was estimated with
    the walk is already part of the fit's deviation.
    """
    assumed = not (walk.focal_known or reconstruction.focal_estimated)
    from_focal = FOCAL_SD * off_middle_rad(reconstruction) if assumed else 0.0
    fitted = reconstruction.posterior.heading_sd_rad * walk.calibration.view[0, LEVEL_95]
    return np.sqrt(fitted**2 + VIEW_EXTRA_RAD**2 + from_focal**2)


def _stretch(stretch: Stretch, walk: Walk) -> dict[str, Any]:
    described: dict[str, Any] = {
        "frames": [stretch.first_frame, stretch.last_frame],
        "verdict": str(stretch.judgement.verdict),
        "why": list(stretch.judgement.reasons),
    }
    reconstruction = stretch.reconstruction
    if reconstruction is None:
        return described
    described["focal_px"] = _round(reconstruction.focal_px, 1)
    described["residual_percent_of_height"] = _round(reconstruction.relative_residual, 2)
    described["distance_from_walkers"] = _round(reconstruction.starts.least_distance, 2)
    if not stretch.walks:
        return described  # the numbers of a walk would mislead
    stride_hz = reconstruction.fit.frequency_hz
    fitted = reconstruction.posterior.log_frequency_sd * walk.calibration.view[1, LEVEL_95]
    cadence_half = NORMAL[LEVEL_95] * np.hypot(fitted, CADENCE_EXTRA)
    described |= {
        "usable": _usable(reconstruction) if stretch.judgement.verdict == Verdict.doubtful else [],
        "strides": _round(reconstruction.strides, 1),
        "view_angle_deg": _view_angle(reconstruction, walk),
        "cadence": {
            "strides_per_s": _round(stride_hz, 3),
            "steps_per_min": _round(120.0 * stride_hz, 1),
            "interval_95_steps_per_min": _interval(120.0 * stride_hz, 120.0 * stride_hz * cadence_half),
        },
        **_speed(reconstruction, stride_hz, walk.stature_mm),
        "angles_deg": _angles(reconstruction, walk),
        "gait_cycle": {
            "numbers": cycle.numbers(walk, reconstruction),
            "events": cycle.events(walk, stretch),
            "variability": cycle.NO_VARIABILITY,
        },
        "labels": {
            "exchanged_throughout": reconstruction.labels_exchanged,
            "unsure": reconstruction.labels_unsure,
            "exchanged_frames": {
                limb: stretch.frames[which].tolist() for limb, which in reconstruction.fit.exchanged.items()
            },
        },
        "noise": {
            "sigma_px": _round(reconstruction.fit.noise.sigma_px, 2),
            "kappa": _round(reconstruction.fit.noise.kappa, 2),
        },
        "half_width_95_mm": {
            joint: [_round(v, 0) for v in row]
            for joint, row in zip(
                WALKER15.joints, half_widths_mm(walk, reconstruction).mean(axis=0), strict=True
            )
            if joint != "pelvis"
        },
        "bars": {
            "for": walk.bars_for,
            "mean_half_width_95_mm": {
                audience: _round(
                    half_widths_mm(replace(walk, bars_for=audience), reconstruction)[:, SCORED].mean(), 1
                )
                for audience in walk.calibrations
            },
        },
        "estimated_joints": [
            j for j, visible in zip(WALKER15.joints, observed(reconstruction), strict=True) if not visible
        ],
        "next_time": advice(walk, stretch),
    }
    return described


def _view_angle(reconstruction: Reconstruction, walk: Walk) -> dict[str, Any]:
    """Return the view angle with its confidence interval, and the alternative views with a similar cost."""
    heading = reconstruction.fit.x[HEADING]
    half = np.degrees(NORMAL[LEVEL_95] * view_sd_rad(walk, reconstruction))
    alternatives = [
        c
        for c in reconstruction.candidates[1:]
        if c.cost_above_best
        < (ALTERNATIVE_COST if c.labels_exchanged == reconstruction.labels_exchanged else LABELS_UNSURE)
    ]
    return {
        "value": _round(view_angle_deg(heading), 1),
        "interval_95": _interval(view_angle_deg(heading), half),
        "convention": "of the papers: 0 is seen from behind, +90 from the walker's right",
        "heading_deg": _round(np.degrees(heading), 1),
        "turned_deg": _round(turned_deg(reconstruction), 1),
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
            for c in alternatives
        ],
    }


def _usable(reconstruction: Reconstruction) -> list[str]:
    """Return one sentence, in a list, that names the usable results of a doubtful walk."""
    slow = reconstruction.candidates[0].frequency_hz < SLOW_STRIDE_HZ
    reasons = {
        "cadence, times and speeds are wrong if the frame rate is": slow,
        "angles and lengths may be wrong by more than their bars": reconstruction.relative_residual
        > DOUBTFUL_RESIDUAL,
        "angles and lengths are biased towards those of other walkers": reconstruction.starts.least_distance
        > DOUBTFUL_DISTANCE,
        "times and left-right differences rest on one stride": reconstruction.strides < SINGLE_STRIDE,
    }
    doubts = [words for words, applies in reasons.items() if applies] or [
        "all other numbers may be wrong by more than their bars"
    ]
    return [f"Usable: heading{'' if slow else ' and cadence'}; {'; '.join(doubts)}."]


def half_widths_mm(walk: Walk, reconstruction: Reconstruction) -> np.ndarray:
    """Half widths (T, 15, 3), mm, of the 95 % error bars of joints relative to the pelvis.

    The axes are right, down and away from the camera.
    """
    return joint_half_widths(walk.calibration, reconstruction.posterior.sd_mm, LEVEL_95) * scale_mm(walk)


def _speed(reconstruction: Reconstruction, stride_hz: float, stature_mm: float) -> dict[str, Any]:
    belt = reconstruction.fit.objective.prior.belt
    stride = 2.0 * np.pi * (belt @ reconstruction.posterior.walker.ravel())  # mm of ground per cycle
    stature = HEIGHT_MM / HEIGHT_SHARE
    described: dict[str, Any] = {
        "locomotion": "overground" if reconstruction.starts.overground else NO_PATH,
        "step_length": {"per_stature": _round(stride / 2.0 / stature, 3)},
        "speed": {"statures_per_s": _round(stride * stride_hz / stature, 3)},
    }
    if stature_mm:
        described["step_length"]["mm"] = _round(stride / 2.0 / stature * stature_mm, 0)
        described["speed"]["mm_per_s"] = _round(stride * stride_hz / stature * stature_mm, 0)
    return described


def _angles(reconstruction: Reconstruction, walk: Walk) -> dict[str, Any]:
    """Return the minimum and maximum of each angle over the frames, and the mean half width of its 95 % error bars."""
    angles = np.degrees(reconstruction.posterior.angles_rad)
    half = np.degrees(angle_half_widths(walk.calibration, reconstruction.posterior.angles_sd_rad, LEVEL_95))
    return {
        name: {
            "least": _round(angles[:, k].min(), 1),
            "most": _round(angles[:, k].max(), 1),
            "mean_half_width_95": _round(half[:, k].mean(), 1),
        }
        for k, name in enumerate(ANGLES)
    }


def turned_deg(reconstruction: Reconstruction) -> float:
    """Heading at the end of a stretch minus the heading at its beginning, degrees.

    The heading in the summary applies to the middle of the stretch.

    Detectors exaggerate how a passing body turns its front and then its back to the camera.  Seen from the side, about
    20 to 50° of this turn are an artefact, also on a straight path.
    """
    times = reconstruction.fit.times
    return np.degrees(reconstruction.fit.x[TURN]) * (times[-1] - times[0])


def path_bend_deg(reconstruction: Reconstruction) -> float:
    """Change in the direction of the path over a stretch, degrees, estimated from positions in the image.

    Directions are 0° towards the camera and +90° to the right.
    """
    pixels = np.where(
        reconstruction.keypoints.weights[..., None] > 0, reconstruction.keypoints.pixels, np.nan
    )
    heights = reconstruction.fit.objective.prior.mean[:, 2, 0]
    return -np.degrees(path_turn_rad(pixels, heights, reconstruction.focal_px))


def lean_deg(reconstruction: Reconstruction) -> float:
    """Angle in the image between the vertical at the walker and the line from ankles to head, degrees."""
    at, pitch = reconstruction.image_px.mean(axis=(0, 1)), reconstruction.fit.x[PITCH]
    above = reconstruction.image_px[:, WALKER15.index("head")] - reconstruction.image_px[:, ANKLES].mean(
        axis=1
    )
    vertical = at * np.sin(pitch) - [0.0, reconstruction.focal_px * np.cos(pitch)]
    lean, upright = (np.arctan2(up[0], -up[1]) for up in (above.mean(axis=0), vertical))
    return float(np.degrees(abs(lean - upright)))


def advice(walk: Walk, stretch: Stretch) -> list[str]:
    """Return advice on how to film the next clip better."""
    reconstruction, sentences = stretch.fitted, []
    heading = abs(np.degrees(reconstruction.fit.x[HEADING]))
    if min(heading, 180.0 - heading) < 20.0:
        sentences.append(
            "Film at 30 to 60° to the path: depth is then better determined and the knee error a fifth smaller."
        )
    if reconstruction.strides < 2.0:
        sentences.append(
            f"The clip has only {reconstruction.strides:.1f} strides: three or more halve the error of the cadence."
        )
    if reconstruction.height_px < 250.0:
        sentences.append(
            f"The walker is only {reconstruction.height_px:.0f} px high: film nearer or with a longer lens."
        )
    if (
        reconstruction.starts.overground
        and min(abs(turned_deg(reconstruction)), abs(bend := path_bend_deg(reconstruction))) > TURNED_DEG
    ):
        sentences.append(
            f"The path bends: its direction turned by {bend:+.0f}°, and the view is that in the middle."
            " Film a straight path, or select fewer frames (input.frames)."
        )
    if reconstruction.labels_unsure:
        sentences.append("Left and right could not be distinguished: film a path towards or past the camera.")
    if (lean := lean_deg(reconstruction)) > LEAN_DEG:
        sentences.append(
            f"The walker leans by {lean:.0f}° in the picture: turn the film upright if the camera was rolled."
            " The error bars allow neither for a rolled camera nor for a stoop."
        )
    off = np.degrees(off_middle_rad(reconstruction))
    if not walk.focal_known and off > OFF_MIDDLE_DEG:
        sentences.append(
            f"The walker is {off:.0f}° off the middle of the image, where the view depends on the focal length:"
            " give it (input.focal_px), or film the walker in the middle."
        )
    elif not walk.focal_known:
        sentences.append("Give the focal length in pixels (input.focal_px) if the camera is known.")
    return sentences


def table_rows(walk: Walk) -> dict[str, list[Any]]:
    """Return the columns of the long table of joints, for all frames of all stretches that are or may be a walk.

    Axes: x to the image's right, y away from the camera, z up.  The origin is the pelvis in the middle of the stretch.
    """
    J, rows = len(WALKER15.joints), list[tuple[Any, ...]]()
    for number, stretch in enumerate(walk.stretches):
        if not stretch.walks:
            continue
        reconstruction = stretch.fitted
        level, half = world_mm(reconstruction) * scale_mm(walk), half_widths_mm(walk, reconstruction)
        frames = np.repeat(stretch.frames, J)
        upright = np.concatenate([level[..., [0, 2, 1]] * [1.0, 1.0, -1.0], half[..., [0, 2, 1]]], axis=-1)
        rows += zip(
            [number] * len(frames),
            frames.tolist(),
            (frames / walk.frame_rate_hz).round(6).tolist(),
            WALKER15.joints * len(level),
            *upright.reshape(-1, 6).T.round(2).tolist(),
            (reconstruction.keypoints.weights > 0).astype(int).ravel().tolist(),
            strict=True,
        )
    names = ("stretch", "frame", "time_s", "joint", "x", "y", "z", "half_x", "half_y", "half_z", "observed")
    return tables.of_rows(names, rows)


def filmed_mm(reconstruction: Reconstruction) -> np.ndarray:
    """Return positions (T, 15, 3), mm, in level camera axes relative to the camera, including the walker's path."""
    x, objective = reconstruction.fit.x, reconstruction.fit.objective
    unbiased = x.copy()
    unbiased[:SIZE] = reconstruction.posterior.walker.ravel()
    return objective.at(unbiased).level.T


def world_mm(reconstruction: Reconstruction) -> np.ndarray:
    """Return positions (T, 15, 3), mm, in level camera axes, including the walker's path.

    The origin is the pelvis in the middle frame of the stretch.
    """
    level = filmed_mm(reconstruction)
    middle = len(level) // 2
    return level - level[middle, WALKER15.index("pelvis")]
