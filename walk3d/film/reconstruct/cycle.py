"""The gait cycle of a reconstructed walk in units that are read: events, numbers of either side, curves, with bars."""

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
HEIGHT_SHARE = 0.89
"""Height of the centre of the head above the ankles over stature: 0.93 minus 0.039 [Winter 2009, figure 4.1]."""
INSTANTS = 101
"""Of a curve over the cycle: every per cent, the next contact included."""
NO_VARIABILITY = (
    "how much one stride differs from the next is not told: the walk is reconstructed as one average cycle"
)


def scale_mm(walk: Walk) -> float:
    """Millimetres of the walker for one of the model; the model's own where no stature is given."""
    return walk.stature_mm * HEIGHT_SHARE / HEIGHT_MM if walk.stature_mm else 1.0


_SHOWN = """
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
"""Name, kind and measure of every number that is shown."""
_MEASURES = {
    "s": ("s", 0.0, 1.0, 3), "share": ("% of cycle", 0.0, 100.0, 1), "rest": ("% of cycle", 100.0, -100.0, 1),
    "angle": ("°", 0.0, 180.0 / np.pi, 1), "length": ("% of stature", 0.0, 100.0 * HEIGHT_SHARE / HEIGHT_MM, 1),
}  # fmt: skip
"""Unit, what is added after a factor, and digits; a length's where no stature is given."""


def _usual(prior: Prior) -> tuple[GaitCycle, np.ndarray]:
    """The average walker's cycle, and the covariance (407, 407) of walkers and of their frequencies."""
    model, size = prior.model, prior.model.mean.size
    covariance = np.zeros((size + 2, size + 2))
    covariance[:size, :size], covariance[-1, -1] = model.covariance, model.log_frequency[1] ** 2
    return gait_cycle(model.mean, np.exp(model.log_frequency[0]), prior.belt), covariance


def numbers(walk: Walk, found: Reconstruction) -> dict[str, dict[str, Any]]:
    """Return the numbers of the cycle by name: unit, values with half widths of 95 % bars, the range of walkers.

    A number of either side has ``left``, ``right`` and their ``difference``, and whether it is larger than its bar,
    which is false where the labels are unsure; one of the walk has ``both``.
    """
    cycle, prior = found.cycle, found.fit.objective.prior
    sd = deviations(cycle.slopes, found.posterior.covariance)
    half = cycle_half_widths(walk.calibration, sd, LEVEL_95)
    usual, covariance = _usual(prior)
    reach = NORMAL[LEVEL_95] * deviations(usual.slopes, covariance)
    numbers = {}
    measures = _MEASURES | ({"length": ("mm", 0.0, scale_mm(walk), 0)} if walk.stature_mm else {})
    for name, kind, measure in map(str.split, _SHOWN.strip().splitlines()):
        unit, added, factor, digits = measures[measure]
        rows: dict[str, Any] = {"unit": unit}
        for number, (of, side) in enumerate(NUMBERS):
            if of != kind:
                continue
            apart = side == "difference"
            value = factor * float(cycle.values[number]) + (0.0 if apart else added)
            rows[side or "both"] = {
                "value": round(value, digits) + 0.0,  # never a negative zero
                "half_width_95": round(abs(factor) * float(half[number]), digits),
            }
            if apart:
                larger = bool(abs(cycle.values[number]) > half[number])
                rows[side]["larger_than_its_bar"] = larger and not found.labels_unsure
            elif side != "right":
                middle, wide = factor * usual.values[number] + added, abs(factor) * reach[number]
                rows["walkers_95"] = [round(float(end), digits) for end in (middle - wide, middle + wide)]
        numbers[name] = rows
    return numbers


def events(walk: Walk, stretch: Stretch) -> dict[str, dict[str, list[float]]]:
    """Return the times in the video at which each foot is set down and taken off, s, with half widths of 95 % bars."""
    found = stretch.fitted
    middle = (stretch.first_frame + stretch.last_frame) / 2.0 / walk.frame_rate_hz
    contacts = {}
    for number, (event, of_sides) in enumerate(zip(EVENTS, found.event_times, strict=True)):
        wide = walk.calibration.cycle[number, LEVEL_95] * NORMAL[LEVEL_95]
        for side, (when, sd) in zip(SIDES, of_sides, strict=True):
            contacts[f"{side}_{event}"] = {
                "time_s": (middle + when).round(3).tolist(),
                "half_width_95_s": (wide * sd).round(3).tolist(),
            }
    return contacts


def curves(walk: Walk, found: Reconstruction) -> dict[str, np.ndarray]:
    """Return angles over the gait cycle, degrees, each of either side from its foot's contact to its next.

    Returns
    -------
    dict of str to array
        ``angles`` and ``angles_half`` (6, 2, 101): by `KINDS` and side, and half widths of 95 % bars; the trunk's are
        one angle, from either contact.  ``walkers`` and ``walkers_half`` (6, 101): the average walker of the model, and
        half widths of what holds 95 % of its walkers.  ``stance`` (2,): per cent at which a foot is taken off.
    """
    prior = found.fit.objective.prior
    angles, sd = angle_curves(found.posterior.walker, found.posterior.covariance, found.cycle, INSTANTS)
    half = angle_half_widths(walk.calibration, sd, LEVEL_95)
    usual, covariance = _usual(prior)
    average, spread = angle_curves(prior.model.mean, covariance, usual, INSTANTS)
    # The trunk has no side: left and right contact see the same angle.
    of = np.array([[ANGLES.index(f"{s}_{k}" if k != "trunk" else k) for s in SIDES] for k in KINDS])
    drawn = {
        "angles": np.moveaxis(angles[[0, 1], :, of], -1, 2),
        "angles_half": np.moveaxis(half[[0, 1], :, of], -1, 2),
        "walkers": average[0][:, of[:, 0]].T,
        "walkers_half": NORMAL[LEVEL_95] * spread[0][:, of[:, 0]].T,
    }
    stance = found.cycle.values[[NUMBERS.index(("stance", side)) for side in SIDES]]
    return {name: np.degrees(values) for name, values in drawn.items()} | {"stance": 100.0 * stance}


def curve_rows(drawn: dict[str, np.ndarray]) -> dict[str, Any]:
    """Columns of the table of curves: a row to each angle and per cent of the cycle, degrees."""
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
        **{name: of.ravel().round(2) for name, of in values.items()},
    }


def number_rows(numbers: dict[str, dict[str, Any]]) -> dict[str, list[Any]]:
    """Columns of the table of numbers: a row to each number and side."""
    rows = [
        (name, side, of[side]["value"], of[side]["half_width_95"], of["unit"])
        for name, of in numbers.items()
        for side in (*SIDES, "difference", "both")
        if side in of
    ]
    return tables.of_rows(("number", "side", "value", "half_width_95", "unit"), rows)


def angle_rows(walk: Walk) -> dict[str, np.ndarray]:
    """Columns of the table of angles in every frame, degrees, with half widths of 95 % bars."""
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
