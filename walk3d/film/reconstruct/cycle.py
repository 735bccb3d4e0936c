"""Gait cycle of a reconstructed walk in the units of the report: events, numbers and curves, with error bars."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.storage import tables
from walk3d.film.reconstruct.clip import Walk
from walk3d.film.walk import HEIGHT_MM, Reconstruction
from walk3d.film.walk.calibration import (
    NORMAL,
    angle_half_widths,
    cycle_half_widths,
)
from walk3d.film.walk.cycle import (
    EVENTS,
    NUMBERS,
    GaitCycle,
    angle_curves,
    deviations,
    gait_cycle,
)
from walk3d.film.walk.film import Stretch
from walk3d.film.walk.prior import Prior
from walk3d.film.walk.sagittal_angles import ANGLES, KINDS, SIDES

LEVEL_95 = 2
"""Index of the 95 % level in `LEVELS`."""
HEIGHT_SHARE = 0.89
"""Height of the head's centre above the ankles as a share of stature: 0.93 minus 0.039 [Winter 2009, figure 4.1]."""
INSTANTS = 101
"""Number of samples of a curve over the cycle: one for each per cent from 0 to 100."""
NO_VARIABILITY = "the variability between strides is unknown: the walk is reconstructed as one average cycle"


def scale_mm(walk: Walk) -> float:
    """Return the factor that scales lengths of the model, mm, to the walker's stature; 1 if no stature is given."""
    return walk.stature_mm * HEIGHT_SHARE / HEIGHT_MM if walk.stature_mm else 1.0


_REPORTED = """
stride_time stride_time s
step_time step_time s
stance stance share
swing stance rest
double_support double_support share
stride_length stride_length length
step_length step_length length
step_width step_width length
greatest_hip_flexion hip_most angle
least_hip_flexion hip_least angle
greatest_knee_flexion knee_most angle
least_knee_flexion knee_least angle
"""
"""Name of each gait-cycle number in the summary, its name in the model, and the key of its unit in `_MEASURES`."""
_MEASURES = {
    "s": ("s", 0.0, 1.0, 3), "share": ("% of cycle", 0.0, 100.0, 1), "rest": ("% of cycle", 100.0, -100.0, 1),
    "angle": ("°", 0.0, 180.0 / np.pi, 1), "length": ("% of stature", 0.0, 100.0 * HEIGHT_SHARE / HEIGHT_MM, 1),
}  # fmt: skip
"""Unit, offset, factor and number of decimals with which each kind of gait-cycle number is reported.

Lengths are per cent of an unknown stature.
"""


def _average_cycle(prior: Prior) -> tuple[GaitCycle, np.ndarray]:
    """Return the average walker's gait cycle, and the covariance (407, 407) of the model's walkers.

    The covariance is that of the Fourier coefficients, the phase and the logarithm of the stride frequency.
    """
    model, size = prior.model, prior.model.mean.size
    covariance = np.zeros((size + 2, size + 2))
    covariance[:size, :size], covariance[-1, -1] = model.covariance, model.log_frequency[1] ** 2
    return gait_cycle(model.mean, np.exp(model.log_frequency[0]), prior.belt), covariance


def numbers(walk: Walk, reconstruction: Reconstruction) -> dict[str, dict[str, Any]]:
    """Return the gait-cycle numbers by name.

    Each has a unit, the half widths of its 95 % error bars, and the range of 95 % of walkers.

    Numbers of one side have ``left``, ``right`` and ``difference``; numbers of the walk have ``both``.
    ``larger_than_its_bar`` marks a difference beyond its bar; it is False if the labels are unsure.
    """
    cycle, prior = reconstruction.cycle, reconstruction.fit.objective.prior
    sd = deviations(cycle.slopes, reconstruction.posterior.covariance)
    half = cycle_half_widths(walk.calibration, sd, LEVEL_95)
    usual, covariance = _average_cycle(prior)
    reach = NORMAL[LEVEL_95] * deviations(usual.slopes, covariance)
    numbers = {}
    measures = _MEASURES | ({"length": ("mm", 0.0, scale_mm(walk), 0)} if walk.stature_mm else {})
    for name, kind, measure in map(str.split, _REPORTED.strip().splitlines()):
        unit, added, factor, digits = measures[measure]
        rows: dict[str, Any] = {"unit": unit}
        for number, (number_kind, side) in enumerate(NUMBERS):
            if number_kind != kind:
                continue
            is_difference = side == "difference"
            value = factor * float(cycle.values[number]) + (0.0 if is_difference else added)
            rows[side or "both"] = {
                "value": round(value, digits) + 0.0,  # avoids negative zero
                "half_width_95": round(abs(factor) * float(half[number]), digits),
            }
            if is_difference:
                larger = bool(abs(cycle.values[number]) > half[number])
                rows[side]["larger_than_its_bar"] = larger and not reconstruction.labels_unsure
            elif side != "right":
                middle, wide = factor * usual.values[number] + added, abs(factor) * reach[number]
                rows["walkers_95"] = [round(float(end), digits) for end in (middle - wide, middle + wide)]
        numbers[name] = rows
    return numbers


def events(walk: Walk, stretch: Stretch) -> dict[str, dict[str, list[float]]]:
    """Return the times of foot contact and toe-off in the video, s, with the half widths of their 95 % error bars."""
    reconstruction = stretch.fitted
    middle = (stretch.first_frame + stretch.last_frame) / 2.0 / walk.frame_rate_hz
    contacts = {}
    for number, (event, of_sides) in enumerate(zip(EVENTS, reconstruction.event_times, strict=True)):
        wide = walk.calibration.cycle[number, LEVEL_95] * NORMAL[LEVEL_95]
        for side, (when, sd) in zip(SIDES, of_sides, strict=True):
            contacts[f"{side}_{event}"] = {
                "time_s": (middle + when).round(3).tolist(),
                "half_width_95_s": (wide * sd).round(3).tolist(),
            }
    return contacts


def curves(walk: Walk, reconstruction: Reconstruction) -> dict[str, np.ndarray]:
    """Return the joint angles of each side, degrees, from the side's foot contact to its next foot contact.

    Returns
    -------
    dict of str to array
        ``angles`` and ``angles_half`` (6, 2, 101): angles by `KINDS` and side, and half widths of their 95 % bars.  The
        trunk has one angle, from either contact.  ``walkers`` and ``walkers_half`` (6, 101): the average walker of the
        model, and half widths of the range of 95 % of its walkers.  ``stance`` (2,): per cent of the toe-offs.
    """
    prior = reconstruction.fit.objective.prior
    angles, sd = angle_curves(
        reconstruction.posterior.walker, reconstruction.posterior.covariance, reconstruction.cycle, INSTANTS
    )
    half = angle_half_widths(walk.calibration, sd, LEVEL_95)
    usual, covariance = _average_cycle(prior)
    average, spread = angle_curves(prior.model.mean, covariance, usual, INSTANTS)
    # The trunk has no side: its column is used for left and right.
    columns = np.array([[ANGLES.index(f"{s}_{k}" if k != "trunk" else k) for s in SIDES] for k in KINDS])
    drawn = {
        "angles": np.moveaxis(angles[[0, 1], :, columns], -1, 2),
        "angles_half": np.moveaxis(half[[0, 1], :, columns], -1, 2),
        "walkers": average[0][:, columns[:, 0]].T,
        "walkers_half": NORMAL[LEVEL_95] * spread[0][:, columns[:, 0]].T,
    }
    stance = reconstruction.cycle.values[[NUMBERS.index(("stance", side)) for side in SIDES]]
    return {name: np.degrees(values) for name, values in drawn.items()} | {"stance": 100.0 * stance}


def curve_rows(drawn: dict[str, np.ndarray]) -> dict[str, Any]:
    """Return the columns of the table of angle curves, degrees, with one row per angle and per cent of the cycle."""
    angles, half, middle, reach = (
        drawn[name] for name in ("angles", "angles_half", "walkers", "walkers_half")
    )
    values = {
        "left_deg": angles[:, 0], "left_half_deg": half[:, 0], "right_deg": angles[:, 1], "right_half_deg": half[:, 1],
        "walkers_mean_deg": middle, "walkers_low_deg": middle - reach, "walkers_high_deg": middle + reach,
    }  # fmt: skip
    return {
        "angle": np.repeat(KINDS, INSTANTS),
        "cycle_percent": np.tile(np.arange(INSTANTS), len(KINDS)),
        **{name: column.ravel().round(2) for name, column in values.items()},
    }


def number_rows(numbers: dict[str, dict[str, Any]]) -> dict[str, list[Any]]:
    """Return the columns of the table of gait-cycle numbers, with one row per number and side."""
    rows = [
        (name, side, number[side]["value"], number[side]["half_width_95"], number["unit"])
        for name, number in numbers.items()
        for side in (*SIDES, "difference", "both")
        if side in number
    ]
    return tables.of_rows(("number", "side", "value", "half_width_95", "unit"), rows)


def angle_rows(walk: Walk) -> dict[str, np.ndarray]:
    """Return the columns of the table of joint angles in each frame, degrees, with half widths of 95 % error bars."""
    blocks = []
    for number, stretch in enumerate(walk.stretches):
        if not stretch.walks:
            continue
        posterior = stretch.fitted.posterior
        bars = angle_half_widths(walk.calibration, posterior.angles_sd_rad, LEVEL_95)
        angles = np.degrees([posterior.angles_rad, bars]).round(2)
        times = (stretch.frames / walk.frame_rate_hz).round(6)
        blocks.append(np.column_stack([np.full(len(times), number), stretch.frames, times, *angles]))
    names = [
        "stretch",
        "frame",
        "time_s",
        *(f"{angle}{end}" for end in ("_deg", "_half_deg") for angle in ANGLES),
    ]
    return dict(zip(names, np.concatenate(blocks).T, strict=True))
