"""The gait cycle of a reconstructed walk in units that are read: events, numbers of either side, curves, with bars."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.core.keypoint_walk import HEIGHT_MM, Reconstruction
from pipeline.core.keypoint_walk.calibration import (
    NORMAL,
    angle_half_widths,
    cycle_half_widths,
)
from pipeline.core.keypoint_walk.cycle import (
    EVENTS,
    NUMBERS,
    SIDED,
    WHOLE,
    angle_curves,
    deviations,
    event_times,
    gait_cycle,
)
from pipeline.core.keypoint_walk.film import Stretch
from pipeline.core.keypoint_walk.objective import LOG_F, PHASE
from pipeline.core.keypoint_walk.prior import Prior
from pipeline.core.sagittal_angles import ANGLES, KINDS, SIDES
from pipeline.reconstruct.clip import Input, Walk

LEVEL_95 = 2
HEIGHT_SHARE = 0.89
"""Height of the centre of the head above the ankles over stature: 0.93 minus 0.039 [Winter 2009, figure 4.1]."""
INSTANTS = 101
"""Of a curve over the cycle: every per cent, the next contact included."""
NO_VARIABILITY = (
    "how much one stride differs from the next is not told: the walk is reconstructed as one average cycle"
)
_NAMES = {
    "stride_time": "stride time", "step_time": "step time", "stance": "stance", "swing": "swing",
    "double_support": "double support", "stride_length": "stride length", "step_length": "step length",
    "step_width": "step width", "hip_most": "greatest hip flexion", "hip_least": "least hip flexion",
    "knee_most": "greatest knee flexion", "knee_least": "least knee flexion",
}  # fmt: skip


def scale_mm(given: Input) -> float:
    """Millimetres of the walker for one of the model; the model's own where no stature is given."""
    return given.stature_mm * HEIGHT_SHARE / HEIGHT_MM if given.stature_mm else 1.0


def _unit(kind: str, given: Input) -> tuple[str, float, int]:
    """Unit, factor to it, and digits of a kind of numbers."""
    if kind.endswith("_time"):
        return "s", 1.0, 3
    if kind in ("stance", "double_support"):
        return "% of cycle", 100.0, 1
    if kind in ("stride_length", "step_length", "step_width"):
        share = 100.0 * HEIGHT_SHARE / HEIGHT_MM
        return ("mm", scale_mm(given), 0) if given.stature_mm else ("% of stature", share, 1)
    return "°", 180.0 / np.pi, 1


def _of_walkers(prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """The average walker (15, 3, 9), and the covariance (407, 407) of walkers and of their frequencies."""
    size = prior.model.mean.size
    covariance = np.zeros((size + 2, size + 2))
    covariance[:size, :size] = prior.model.covariance
    covariance[-1, -1] = prior.model.log_frequency[1] ** 2
    return prior.model.mean, covariance


def numbers(walk: Walk, found: Reconstruction, given: Input) -> dict[str, dict[str, Any]]:
    """Return the numbers of the cycle by name: unit, values with half widths of 95 % bars, the range of walkers.

    A number of either side has ``left``, ``right`` and their ``difference``, and whether it is larger than its bar; one
    of the walk has ``both``.
    """
    cycle, prior = found.cycle, found.fit.objective.prior
    sd = deviations(cycle.slopes, found.posterior.covariance)
    half = cycle_half_widths(walk.calibration, sd, LEVEL_95) * walk.bars_factor
    mean, covariance = _of_walkers(prior)
    usual = gait_cycle(mean, float(np.exp(prior.model.log_frequency[0])), prior.belt)
    reach = NORMAL[LEVEL_95] * deviations(usual.slopes, covariance)
    said: dict[str, dict[str, Any]] = {}
    for kind in (*WHOLE, *SIDED):
        unit, factor, digits = _unit(kind, given)
        rows: dict[str, Any] = {"unit": unit}
        for number, (of, side) in enumerate(NUMBERS):
            if of != kind:
                continue
            rows[side or "both"] = {
                "value": round(factor * float(cycle.values[number]), digits),
                "half_width_95": round(factor * float(half[number]), digits),
            }
            if side == "difference":
                rows[side]["larger_than_its_bar"] = bool(abs(cycle.values[number]) > half[number])
            elif side != "right":
                ends = factor * (usual.values[number] + np.array([-1.0, 1.0]) * reach[number])
                rows["walkers_95"] = [round(float(end), digits) for end in ends]
        said[_NAMES[kind].replace(" ", "_")] = rows
        if kind == "stance":
            said["swing"] = _swing(rows)
    return said


def _swing(stance: dict[str, Any]) -> dict[str, Any]:
    """What stance leaves of the cycle."""
    low, high = stance["walkers_95"]
    said: dict[str, Any] = {"unit": stance["unit"]}
    for side in (*SIDES, "difference"):
        whole = 0.0 if side == "difference" else 100.0
        said[side] = stance[side] | {"value": round(whole - stance[side]["value"], 1)}
    return said | {"walkers_95": [round(100.0 - high, 1), round(100.0 - low, 1)]}


def events(walk: Walk, stretch: Stretch) -> dict[str, dict[str, list[float]]]:
    """Return the times in the video at which each foot is set down and taken off, s, with half widths of 95 % bars."""
    found = stretch.found
    assert found is not None
    x, times = found.fit.x, found.fit.objective.setting.times
    middle = (stretch.first_frame + stretch.last_frame) / 2.0 / walk.frame_rate_hz
    at = event_times(found.cycle, found.posterior.covariance, float(x[PHASE]), float(np.exp(x[LOG_F])), times)
    said = {}
    for number, (event, of_sides) in enumerate(zip(EVENTS, at, strict=True)):
        wide = walk.calibration.cycle[number, LEVEL_95] * NORMAL[LEVEL_95] * walk.bars_factor
        for side, (when, sd) in zip(SIDES, of_sides, strict=True):
            said[f"{side}_{event}"] = {
                "time_s": (middle + when).round(3).tolist(),
                "half_width_95_s": (wide * sd).round(3).tolist(),
            }
    return said


@dataclass(frozen=True)
class Curves:
    """Angles over the gait cycle, degrees: a kind of angle of either side, from its foot's contact to its next.

    Attributes
    ----------
    angles, half : (6, 2, 101)
        By `KINDS` and side, and half widths of 95 % bars; the trunk's are one angle, from either contact.
    walkers, walkers_half : (6, 101)
        The average walker of the model, and half widths of what holds 95 % of its walkers.
    stance : (2,)
        Per cent of the cycle at which each foot is taken off.
    """

    angles: np.ndarray
    half: np.ndarray
    walkers: np.ndarray
    walkers_half: np.ndarray
    stance: np.ndarray


def curves(walk: Walk, found: Reconstruction) -> Curves:
    """Return the curves of a walk."""
    prior = found.fit.objective.prior
    angles, sd = angle_curves(found.posterior.walker, found.posterior.covariance, found.cycle, INSTANTS)
    half = angle_half_widths(walk.calibration, sd, LEVEL_95) * walk.bars_factor
    mean, covariance = _of_walkers(prior)
    usual = gait_cycle(mean, float(np.exp(prior.model.log_frequency[0])), prior.belt)
    average, spread = angle_curves(mean, covariance, usual, INSTANTS)
    # The trunk has no side: left and right contact see the same angle.
    of = np.array([[ANGLES.index(f"{s}_{k}" if k != "trunk" else k) for s in SIDES] for k in KINDS])
    side = np.array([0, 1])
    stance = [NUMBERS.index(("stance", s)) for s in SIDES]
    return Curves(
        angles=np.degrees(np.moveaxis(angles[side, :, of], -1, 2)),
        half=np.degrees(np.moveaxis(half[side, :, of], -1, 2)),
        walkers=np.degrees(average[0][:, of[:, 0]].T),
        walkers_half=np.degrees(NORMAL[LEVEL_95] * spread[0][:, of[:, 0]].T),
        stance=100.0 * found.cycle.values[stance],
    )


def curve_rows(drawn: Curves) -> dict[str, list[Any]]:
    """Columns of the table of curves: a row to each angle and per cent of the cycle, degrees."""
    columns: dict[str, list[Any]] = {
        "angle": [kind for kind in KINDS for _ in range(INSTANTS)],
        "cycle_percent": list(range(INSTANTS)) * len(KINDS),
    }
    for number, side in enumerate(SIDES):
        columns[f"{side}_deg"] = drawn.angles[:, number].ravel().round(2).tolist()
        columns[f"{side}_half_deg"] = drawn.half[:, number].ravel().round(2).tolist()
    low, high = drawn.walkers - drawn.walkers_half, drawn.walkers + drawn.walkers_half
    for name, values in (("mean", drawn.walkers), ("low", low), ("high", high)):
        columns[f"walkers_{name}_deg"] = values.ravel().round(2).tolist()
    return columns


def number_rows(said: dict[str, dict[str, Any]]) -> dict[str, list[Any]]:
    """Columns of the table of numbers: a row to each number and side."""
    rows = [
        {"number": name, "side": side, **of[side], "unit": of["unit"]}
        for name, of in said.items()
        for side in (*SIDES, "difference", "both")
        if side in of
    ]
    names = ("number", "side", "value", "half_width_95", "unit")
    return {name: [row[name] for row in rows] for name in names}


def angle_rows(walk: Walk) -> dict[str, list[Any]]:
    """Columns of the table of angles in every frame, degrees, with half widths of 95 % bars."""
    columns: dict[str, list[Any]] = {name: [] for name in ("stretch", "frame", "time_s")}
    columns |= {f"{angle}{end}": [] for end in ("_deg", "_half_deg") for angle in ANGLES}
    for number, stretch in enumerate(walk.stretches):
        found = stretch.found
        if found is None or stretch.judgement.verdict == "not_a_walk":
            continue
        frames = stretch.first_frame + np.arange(len(stretch.pixels))
        half = angle_half_widths(walk.calibration, found.posterior.angles_sd_rad, LEVEL_95)
        columns["stretch"] += [number] * len(frames)
        columns["frame"] += frames.tolist()
        columns["time_s"] += (frames / walk.frame_rate_hz).round(6).tolist()
        for k, angle in enumerate(ANGLES):
            columns[f"{angle}_deg"] += np.degrees(found.posterior.angles_rad[:, k]).round(2).tolist()
            columns[f"{angle}_half_deg"] += np.degrees(half[:, k] * walk.bars_factor).round(2).tolist()
    return columns
