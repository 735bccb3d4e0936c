"""Steady walks, converted to treadmill walking: recorded walks, or walks of the synthetic population."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from pipeline.clips.kinds import Reducer, Walks
from pipeline.clips.missing_joints import complete
from pipeline.clips.options import Heading, Locomotion, Steady, SyntheticPeople
from pipeline.clips.usable import PreparedClip, RawClip, collect, prepare, refused, report_row
from pipeline.core import fourier, walking
from pipeline.core.walking import BridgedClip
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.skeleton import PELVIS, WALKER15
from pipeline.skeleton.mapped_joints import LOWER_BODY
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.synthetic import walkers
from pipeline.validation import InvalidInput, told_apart

REPORT_COLUMNS = (
    "clip", "person", "source", "frames", "first_frame", "last_frame", "locomotion", "speed_mm_s", "turn_deg",
    "strides", "bridged_values", "missing_joints", "leg_length_mm", "frequency_hz", "fundamental_share", "second_share",
    "residual_share", "verdict", "reason",
)  # fmt: skip

MAX_SLOPE, MAX_STEP_MM = 0.1, 150.0
"""Largest rise of the pelvis in a level walk: a fraction of the path length plus a constant in mm.

Steep ramps and stairs exceed it.
"""
MAX_LEVEL_SLOPE = 0.025
"""Largest slope of a floor that counts as level; laboratory axes are tilted by up to 2.2 %, as in CMU data."""

MIN_BAD_JOINT_SHARE = 0.4
"""Share of the residual of a two-harmonic fit above which a joint counts as badly tracked."""

FAR_FREQUENCY = "far_frequency"
"""Code of the error or remark on a walk whose stride frequency is far from those of other walks."""

MAX_EQUAL_FIT_RATIO = 1.5
"""Largest ratio of residuals at which two frequencies count as fitting a walk equally well."""


def synthetic_walks(options: SyntheticPeople, seed: int, workers: int) -> Walks:
    """Return the walks of the synthetic population."""
    return streamed_walks(options, seed, workers, None)[0]


def streamed_walks(
    options: SyntheticPeople, seed: int, workers: int, reduce: Reducer | None
) -> tuple[Walks, list[Any]]:
    """Return the synthetic walks without positions, and for each walk the result of the function `reduce`.

    The positions of a few thousand people take gigabytes.  Without `reduce` they are kept, and the results are None.
    """
    count = min(options.walkers or options.population, options.population)
    male = round(count * options.male_share)
    digits = max(3, len(str(count)))
    people = walkers.members(derive_generator(seed, "ingest"), male=male, female=count - male)
    steady = Steady(locomotion=Locomotion.treadmill, heading=options.heading)
    recorded = (options.duration_s, options.frame_rate_hz, options.marker_noise_mm, options.offsets)

    def complete_walk(r: int) -> PreparedClip:
        name = f"synthetic_{r + 1:0{digits}d}"
        row = report_row(REPORT_COLUMNS, clip=name, person=name, source="synthetic")
        _, positions = walkers.walker(people[r], *recorded)
        return steady_walk(RawClip(row, positions, options.frame_rate_hz), steady)

    def prepared_walk(r: int) -> PreparedClip:
        walk = complete_walk(r)
        if reduce is None or walk.positions is None:
            return walk
        reduced = reduce(walk.positions, walk.frame_rate_hz, walk.row["frequency_hz"])
        stature = walking.stature(walk.positions)
        return dataclasses.replace(walk, positions=np.empty((0, 15, 3)), stature_mm=stature, reduced=reduced)

    walks = compared(
        map_processes(prepared_walk, range(count), workers), steady.frequency_ratio, complete_walk
    )
    return walks_of(walks), [walk.reduced for walk in walks if walk.positions is not None]


def walk_in(
    name: str,
    positions: np.ndarray,
    frame_rate_hz: float,
    valid: np.ndarray | None,
    up: UpAxis = UpAxis.auto,
    **options: Any,
) -> PreparedClip:
    """Return the steady part of a recorded walk (T, 15, 3), mm, or a rejected clip.

    `options` are the options of `Steady`.
    """
    raw = RawClip(report_row(REPORT_COLUMNS, clip=name), positions, frame_rate_hz, valid, up=up)
    return steady_walk(raw, Steady(**options))


def steady_walk(raw: RawClip, steady: Steady) -> PreparedClip:
    """Return the steady part of a clip as treadmill walking, or a rejected clip."""

    def select(bridged: BridgedClip, row: dict[str, Any]) -> np.ndarray:
        return _steady_part(bridged, row, raw.frame_rate_hz, steady)

    return prepare(raw, steady.gap_s, select, may_lack_joints=True)


def _steady_part(
    bridged: BridgedClip, row: dict[str, Any], frame_rate_hz: float, steady: Steady
) -> np.ndarray:
    """Return the steady part of a walk as treadmill walking (T, 15, 3), mm, and add its properties to `row`.

    Joints that are missing in all frames are estimated by `complete`.
    """
    stretch = walking.steady_stretch(
        bridged.positions,
        bridged.whole,
        frame_rate_hz,
        locomotion=steady.locomotion.value,
        speed_band=steady.speed_band,
        turn_rad_s=np.radians(steady.turn_deg_s),
        cycles=steady.cycles,
    )
    row |= {
        "first_frame": stretch.start,
        "last_frame": stretch.stop - 1,
        "locomotion": stretch.locomotion,
        "speed_mm_s": stretch.speed_mm_s,
        "turn_deg": float(np.degrees(stretch.turn_rad)),
    }
    level = walking.treadmill_equivalent(
        bridged.positions[stretch.start : stretch.stop],
        frame_rate_hz,
        locomotion=stretch.locomotion,
        path=steady.path.value,
    )
    rise = np.polyfit(np.arange(len(level)), level[:, PELVIS, 2], 1)[0] * len(level)
    way = stretch.speed_mm_s * len(level) / frame_rate_hz
    if abs(rise) > MAX_SLOPE * way + MAX_STEP_MM:
        raise InvalidInput(
            "no steady walking: the ground is not level",
            expected="a level floor",
            received=f"the pelvis {'rises' if rise > 0 else 'falls'} by {abs(rise):.0f} mm",
            code="not_level",
            rise_mm=float(rise),
        )
    remarks = []
    if stretch.locomotion == "overground" and abs(rise) > MAX_LEVEL_SLOPE * way:
        level[..., 2] -= np.linspace(-rise / 2, rise / 2, len(level))[:, None]
        remarks.append(f"a slope of {100 * rise / way:.1f} % was removed, like the path")
    level, series, worst = _completed(level, row, frame_rate_hz, steady.residual_share)
    if steady.heading is Heading.steps:
        # A rotation about the vertical changes neither frequencies nor shares of the variance.
        level = walking.turn_about_vertical(level, -walking.step_heading(series.coefficients))
    size_and_speed = {"leg_mm": row["leg_length_mm"], "speed_mm_s": stretch.speed_mm_s}
    walking.require_walk(level, frame_rate_hz, **size_and_speed)
    remarks.append(
        walking.unusual_cadence(level, frame_rate_hz, **size_and_speed, frequency_hz=series.frequency_hz)
    )
    row["reason"] = "; ".join(filter(None, (row["reason"], *remarks)))
    row |= {
        "strides": len(level) / frame_rate_hz * series.frequency_hz,
        "frequency_hz": series.frequency_hz,
        "fundamental_share": float(series.variance_fractions[0]),
        "second_share": float(series.variance_fractions[1]),
        "residual_share": series.residual_fraction,
    }
    if row["strides"] < steady.cycles:
        raise InvalidInput(
            "no steady walking: the steady part of the walk is too short",
            expected=f"{steady.cycles:g} strides",
            received=told_apart(row["strides"], steady.cycles, 2),
            code="too_few_strides",
            strides=row["strides"],
        )
    _require_periodic(row, steady, worst)
    return level


def _require_periodic(row: Mapping[str, Any], steady: Steady, worst: str) -> None:
    """Raise InvalidInput unless two harmonics describe a walk well enough.

    The message states the overrides with which the walk is accepted.
    """
    share, min_share = row["fundamental_share"], steady.fundamental_share
    residual, max_residual = row["residual_share"], steady.residual_share
    overrides = (
        [f"data.steady.fundamental_share={np.floor(100 * share) / 100:g}"] if share < min_share else []
    )
    overrides += (
        [f"data.steady.residual_share={np.ceil(100 * residual) / 100:g}"] if residual > max_residual else []
    )
    if share < min_share:
        raise InvalidInput(
            "the fundamental frequency is probably wrong: its harmonic has too small a share of the variance",
            expected=f"{min_share:g} or more",
            received=f"{told_apart(share, min_share, 2)} at {row['frequency_hz']:.2f} Hz;"
            f" accepted with {' '.join(overrides)}",
            code="low_fundamental",
            take=overrides,
        )
    if residual > max_residual:
        raise InvalidInput(
            f"the walk is not periodic: two harmonics leave too large a share of the variance, {worst}",
            expected=f"{max_residual:g} or less",
            received=f"{told_apart(residual, max_residual, 2)}; accepted with {overrides[0]}",
            code="not_periodic",
            take=overrides,
        )


def _completed(
    level: np.ndarray, row: dict[str, Any], frame_rate_hz: float, residual_share: float
) -> tuple[np.ndarray, fourier.FourierRepresentation, str]:
    """Return a walk with estimates of missing joints, its Fourier series, and words on the worst tracked joint.

    While the residual is above `residual_share`, a joint above the legs with `MIN_BAD_JOINT_SHARE` of it counts as
    missing, and gets a remark in `row`.
    """
    missing = np.isnan(level).any(axis=(0, 2))
    remarks = []
    while True:
        completed, series = complete(level, missing, frame_rate_hz)
        residual = np.trace(series.residual_covariance, axis1=1, axis2=2)
        worst = int(residual.argmax())
        share, joint = (
            float(residual[worst] / max(residual.sum(), np.finfo(float).tiny)),
            WALKER15.joints[worst],
        )
        sound = series.residual_fraction <= residual_share
        if sound or share < MIN_BAD_JOINT_SHARE or joint in LOWER_BODY:
            break
        missing[worst] = True
        remarks.append(f"{joint} is estimated: it had {share:.0%} of the residual of two harmonics")
    if sound and remarks:
        row["missing_joints"] = ", ".join(np.array(WALKER15.joints)[missing])
        row["reason"] = "; ".join(filter(None, (row["reason"], *remarks)))
    return completed, series, f"{share:.0%} of it at {joint}"


def compared(
    walks: Sequence[PreparedClip], ratio: float, complete_walk: Callable[[int], PreparedClip] | None = None
) -> list[PreparedClip]:
    """Reject each walk whose estimated stride frequency is probably half or double the true frequency.

    People of different size are compared at equal Froude number: frequency times the root of leg length.  If a walk
    differs from the population's median by more than a factor of `ratio`, its double or half frequency is fitted,
    whichever is nearer to the median.  If that frequency fits equally well, the walk is rejected.  Otherwise it is a
    slow or quick walk, and is kept with a remark.  `complete_walk` returns a walk with its positions, if `walks` have
    none.
    """
    usable = [walk for walk in walks if walk.positions is not None]
    if len(usable) < 3:
        return list(walks)

    def scaled_frequency(walk: PreparedClip) -> float:
        return walk.row["frequency_hz"] * np.sqrt(walk.row["leg_length_mm"])

    median = float(np.median([scaled_frequency(walk) for walk in usable]))

    def checked(number: int, walk: PreparedClip) -> PreparedClip:
        relative = scaled_frequency(walk) / median if walk.positions is not None else 1.0
        if walk.positions is None or 1 / ratio <= relative <= ratio:
            return walk
        other = walk.row["frequency_hz"] * (2.0 if relative < 1 else 0.5)
        positions = (complete_walk(number) if complete_walk else walk).positions
        assert positions is not None
        series = fourier.represent(positions, walk.frame_rate_hz, frequency_hz=other)
        if series.residual_fraction > MAX_EQUAL_FIT_RATIO * walk.row["residual_share"]:
            tempo = "slower" if relative < 1 else "quicker"
            remark = f"{tempo} than the others: {relative:.2f} of their frequency"
            remarks = "; ".join(filter(None, (remark, walk.row["reason"])))
            return dataclasses.replace(walk, row=walk.row | {"reason": remarks, "code": FAR_FREQUENCY})
        factor = told_apart(relative, ratio ** np.sign(relative - 1), 2)
        take = f"data.steady.frequency_ratio={np.ceil(100 * max(relative, 1 / relative)) / 100:g}"
        reason = InvalidInput(
            "the fundamental frequency is far from that of other walkers",
            expected=f"within a factor of {ratio:g} of the median, scaled to the leg length",
            received=f"{walk.row['frequency_hz']:.2f} Hz, a factor of {factor}; accepted with {take}",
            code=FAR_FREQUENCY,
            take=[take],
        )
        return refused(walk.row, reason)

    return [checked(number, walk) for number, walk in enumerate(walks)]


def walks_of(walks: Sequence[PreparedClip], inputs: Mapping[str, str] | None = None) -> Walks:
    """Return the usable walks, collected from prepared clips."""
    fields = collect(walks, REPORT_COLUMNS, inputs)
    usable = [walk for walk in walks if walk.positions is not None]
    return Walks(
        **fields,
        stature_mm=np.array(
            [
                walk.stature_mm or walking.stature(walk.positions)
                for walk in usable
                if walk.positions is not None
            ]
        ),
        frequency_hz=np.array([walk.row["frequency_hz"] for walk in usable]),
        residual_share=np.array([walk.row["residual_share"] for walk in usable]),
        estimated=np.array(
            [
                [joint in walk.row["missing_joints"].split(", ") for joint in WALKER15.joints]
                for walk in usable
            ]
        ),
        dropped=np.zeros(len(WALKER15.joints), bool),
    )
