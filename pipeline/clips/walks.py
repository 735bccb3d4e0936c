"""Steady walks, as their treadmill equivalents, and those of the synthetic population."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from pipeline.clips.kinds import Keep, Walks
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

LARGEST_SLOPE, STEP_MM = 0.1, 150.0
"""Rise of the pelvis over the way, and besides, beyond which people walk on a steep ramp or on stairs."""
LEVEL_SLOPE = 0.025
"""Rise over the way up to which a floor counts as level: axes of laboratories, as in CMU, are tilted by up to 2.2 %."""

BAD_JOINT_SHARE = 0.4
"""Share of what two harmonics leave that a bad joint has, at least: of 105 recorded walks one has more, of little."""

FAR_FREQUENCY = "far_frequency"
"""Code of a walk whose frequency is far from the others': of its refusal, or of the remark if it is kept."""

EQUAL_FIT_RATIO = 1.5
"""Ratio of the residuals of two frequencies up to which both describe a walk equally well."""


def synthetic_walks(options: SyntheticPeople, seed: int, workers: int) -> Walks:
    """Return the walks of the synthetic population."""
    return walks_let_go(options, seed, workers, None)[0]


def walks_let_go(
    options: SyntheticPeople, seed: int, workers: int, keep: Keep | None
) -> tuple[Walks, list[Any]]:
    """Return the walks of the synthetic population without their positions, and what `keep` makes of each.

    A few thousand people have gigabytes of positions.  Without `keep` these stay, and nothing is made of them.
    """
    count = min(options.walkers or options.population, options.population)
    male = round(count * options.male_share)
    digits = max(3, len(str(count)))
    people = walkers.members(derive_generator(seed, "ingest"), male=male, female=count - male)
    steady = Steady(locomotion=Locomotion.treadmill, heading=options.heading)
    recorded = (options.duration_s, options.frame_rate_hz, options.marker_noise_mm, options.offsets)

    def whole(r: int) -> PreparedClip:
        name = f"synthetic_{r + 1:0{digits}d}"
        row = report_row(REPORT_COLUMNS, clip=name, person=name, source="synthetic")
        _, positions = walkers.walker(people[r], *recorded)
        return steady_walk(RawClip(row, positions, options.frame_rate_hz), steady)

    def one(r: int) -> PreparedClip:
        walk = whole(r)
        if keep is None or walk.positions is None:
            return walk
        reduced = keep(walk.positions, walk.frame_rate_hz, walk.row["frequency_hz"])
        stature = walking.stature(walk.positions)
        return dataclasses.replace(walk, positions=np.empty((0, 15, 3)), stature_mm=stature, kept=reduced)

    walks = compared(map_processes(one, range(count), workers), steady.frequency_ratio, whole)
    return walks_of(walks), [walk.kept for walk in walks if walk.positions is not None]


def walk_in(
    name: str,
    positions: np.ndarray,
    frame_rate_hz: float,
    valid: np.ndarray | None,
    up: UpAxis = UpAxis.auto,
    **options: Any,
) -> PreparedClip:
    """Return the steady part of joints (T, 15, 3) of one recording, by options of `Steady`, or why there is none."""
    raw = RawClip(report_row(REPORT_COLUMNS, clip=name), positions, frame_rate_hz, valid, up=up)
    return steady_walk(raw, Steady(**options))


def steady_walk(raw: RawClip, steady: Steady) -> PreparedClip:
    """Return the steady part of a clip as its treadmill equivalent, or why there is none."""

    def select(bridged: BridgedClip, row: dict[str, Any]) -> np.ndarray:
        return _steady_part(bridged, row, raw.frame_rate_hz, steady)

    return prepare(raw, steady.gap_s, select, may_lack_joints=True)


def _steady_part(
    bridged: BridgedClip, row: dict[str, Any], frame_rate_hz: float, steady: Steady
) -> np.ndarray:
    """Return the treadmill equivalent (T, 15, 3), mm, of the steady stretch; enters its figures into `row`.

    Joints that are missing throughout are filled in with what `complete` estimates.
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
    if abs(rise) > LARGEST_SLOPE * way + STEP_MM:
        raise InvalidInput(
            "no steady walking: the way is not level",
            expected="a floor",
            received=f"the pelvis {'rises' if rise > 0 else 'falls'} by {abs(rise):.0f} mm",
            code="not_level",
            rise_mm=float(rise),
        )
    remarks = []
    if stretch.locomotion == "overground" and abs(rise) > LEVEL_SLOPE * way:
        level[..., 2] -= np.linspace(-rise / 2, rise / 2, len(level))[:, None]
        remarks.append(f"a slope of {100 * rise / way:.1f} % was taken out, as the path is")
    level, series, worst = _completed(level, row, frame_rate_hz, steady.residual_share)
    if steady.heading is Heading.steps:
        # A turn about the vertical moves no frequency and no share of the variance.
        level = walking.turn_about_vertical(level, -walking.step_heading(series.coefficients))
    of_walker = {"leg_mm": row["leg_length_mm"], "speed_mm_s": stretch.speed_mm_s}
    walking.require_walk(level, frame_rate_hz, **of_walker)
    remarks.append(
        walking.unusual_cadence(level, frame_rate_hz, **of_walker, frequency_hz=series.frequency_hz)
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
            "no steady walking: the steady stretch is too short",
            expected=f"{steady.cycles:g} strides",
            received=told_apart(row["strides"], steady.cycles, 2),
            code="too_few_strides",
            strides=row["strides"],
        )
    share, least = row["fundamental_share"], steady.fundamental_share
    left, most = series.residual_fraction, steady.residual_share
    overrides = [f"data.steady.fundamental_share={np.floor(100 * share) / 100:g}"] if share < least else []
    overrides += [f"data.steady.residual_share={np.ceil(100 * left) / 100:g}"] if left > most else []
    if share < least:
        raise InvalidInput(
            "the fundamental frequency looks wrong: it holds too little of the variance",
            expected=f"{least:g} or more",
            received=f"{told_apart(share, least, 2)} at {series.frequency_hz:.2f} Hz; taken with {' '.join(overrides)}",
            code="low_fundamental",
            take=overrides,
        )
    if left > most:
        raise InvalidInput(
            f"not periodic: two harmonics leave too much of the variance, {worst}",
            expected=f"{most:g} or less",
            received=f"{told_apart(left, most, 2)}; taken with {overrides[0]}",
            code="not_periodic",
            take=overrides,
        )
    return level


def _completed(
    level: np.ndarray, row: dict[str, Any], frame_rate_hz: float, residual_share: float
) -> tuple[np.ndarray, fourier.FourierRepresentation, str]:
    """Return a walk with its missing joints filled in, its series, and which joint has most of what that leaves.

    As long as they leave more than `residual_share` and one joint above the legs has `BAD_JOINT_SHARE` of that, it
    counts as missing, with a remark in `row`.
    """
    missing = np.isnan(level).any(axis=(0, 2))
    remarks = []
    while True:
        completed, series = complete(level, missing, frame_rate_hz)
        left = np.trace(series.residual_covariance, axis1=1, axis2=2)
        worst = int(left.argmax())
        share, joint = float(left[worst] / max(left.sum(), np.finfo(float).tiny)), WALKER15.joints[worst]
        sound = series.residual_fraction <= residual_share
        if sound or share < BAD_JOINT_SHARE or joint in LOWER_BODY:
            break
        missing[worst] = True
        remarks.append(f"{joint} is estimated: it had {share:.0%} of what two harmonics leave")
    if sound and remarks:
        row["missing_joints"] = ", ".join(np.array(WALKER15.joints)[missing])
        row["reason"] = "; ".join(filter(None, (row["reason"], *remarks)))
    return completed, series, f"{share:.0%} of it at {joint}"


def compared(
    walks: Sequence[PreparedClip], ratio: float, whole: Callable[[int], PreparedClip] | None = None
) -> list[PreparedClip]:
    """Refuse walks whose frequency is half or double the true one.

    People of different size are compared at equal Froude number: frequency times the root of leg length.  If a walk is
    off the population's median by more than `ratio`, its double or half frequency, whichever is nearer to the median,
    is tried.  The walk is refused if that one fits equally well; otherwise it is a slow or quick walk and is kept with
    a remark.  `whole` returns a walk with its positions, where these were let go.
    """
    usable = [walk for walk in walks if walk.positions is not None]
    if len(usable) < 3:
        return list(walks)

    def scaled_frequency(walk: PreparedClip) -> float:
        return walk.row["frequency_hz"] * np.sqrt(walk.row["leg_length_mm"])

    median = float(np.median([scaled_frequency(walk) for walk in usable]))

    def judged(number: int, walk: PreparedClip) -> PreparedClip:
        off = scaled_frequency(walk) / median if walk.positions is not None else 1.0
        if walk.positions is None or 1 / ratio <= off <= ratio:
            return walk
        other = walk.row["frequency_hz"] * (2.0 if off < 1 else 0.5)
        positions = (whole(number) if whole else walk).positions
        assert positions is not None
        series = fourier.represent(positions, walk.frame_rate_hz, frequency_hz=other)
        if series.residual_fraction > EQUAL_FIT_RATIO * walk.row["residual_share"]:
            remark = f"{'slower' if off < 1 else 'quicker'} than the others: {off:.2f} of their frequency"
            remarks = "; ".join(filter(None, (remark, walk.row["reason"])))
            return dataclasses.replace(walk, row=walk.row | {"reason": remarks, "code": FAR_FREQUENCY})
        take = f"data.steady.frequency_ratio={np.ceil(100 * max(off, 1 / off)) / 100:g}"
        reason = InvalidInput(
            "the fundamental frequency is far from the other walkers'",
            expected=f"within a factor of {ratio:g} for the leg length",
            received=f"{walk.row['frequency_hz']:.2f} Hz, a factor of {told_apart(off, ratio ** np.sign(off - 1), 2)};"
            f" taken with {take}",
            code=FAR_FREQUENCY,
            take=[take],
        )
        return refused(walk.row, reason)

    return [judged(number, walk) for number, walk in enumerate(walks)]


def walks_of(walks: Sequence[PreparedClip], inputs: Mapping[str, str] | None = None) -> Walks:
    """Return the walks that are kept; `inputs` as in `collect`."""
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
