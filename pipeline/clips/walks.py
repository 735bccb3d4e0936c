"""Steady treadmill-equivalent walks out of recordings, or out of the synthetic population.

Every clip ends in the report, kept or refused, with what was cut and why; nothing is dropped in silence.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.clips.corpus import Clip, read_clip
from pipeline.clips.kinds import Clips, Corpus, Request, packed_clips
from pipeline.clips.options import FolderData, Locomotion, RecordedData, Steady, SyntheticData
from pipeline.core import fourier, walking
from pipeline.seeding import derive_generator
from pipeline.synthetic import walkers
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput

REPORT_COLUMNS = (
    "clip", "person", "source", "frames", "first_frame", "last_frame", "locomotion", "speed_mm_s", "turn_deg",
    "strides", "bridged_values", "leg_length_mm", "frequency_hz", "fundamental_share", "second_share",
    "residual_share", "verdict", "reason",
)  # fmt: skip


AS_WELL = 1.5
"""A residual up to so many times another's describes the walk as well."""


@dataclass(frozen=True, kw_only=True)
class Walks(Clips):
    """Steady walks, as their treadmill equivalents.

    Attributes
    ----------
    frequency_hz, residual_share, stature_mm : (W,)
        Fundamental frequency; share of the variance that two harmonics leave; head above the lower ankle.
    """

    frequency_hz: np.ndarray
    residual_share: np.ndarray
    stature_mm: np.ndarray


@dataclass(frozen=True)
class Walk:
    """A steady walk, or the row of the report that says why there is none."""

    row: dict[str, Any]
    positions: np.ndarray | None
    frame_rate_hz: float


def synthetic_walks(options: SyntheticData, seed: int, workers: int) -> Walks:
    """Return the embedded population's walks."""
    count = min(options.walkers or options.population, options.population)
    if count < 1:
        where = "data.population" if options.population < 1 else "data.walkers"
        raise InvalidInput("no walkers", where=where, expected="1 or more", received=str(count))
    male = round(count * options.male_share)
    population = walkers.walking_population(
        derive_generator(seed, "ingest"),
        male=male,
        female=count - male,
        duration_s=options.duration_s,
        frame_rate_hz=options.frame_rate_hz,
        marker_noise_mm=options.marker_noise_mm,
    )
    steady = Steady(locomotion=Locomotion.treadmill)

    def one(r: int) -> Walk:
        name = f"synthetic_{r + 1:03d}"
        row = dict.fromkeys(REPORT_COLUMNS, "") | {"clip": name, "person": name, "source": "synthetic"}
        positions = population.positions_mm[r]
        return steady_walk(row, positions, np.isfinite(positions).all(axis=-1), options.frame_rate_hz, steady)

    return _packed(map_threads(one, range(count), workers), steady, inputs={})


def recorded_walks(clips: Iterable[Clip], steady: Steady, workers: int) -> Walks:
    """Return the steady walks in recordings."""

    def one(clip: Clip) -> Walk:
        row = dict.fromkeys(REPORT_COLUMNS, "") | {
            "clip": clip.name,
            "person": clip.person,
            "source": clip.source,
        }
        try:
            motion, positions, valid = read_clip(clip)
            walk = steady_walk(row, positions, valid, motion.frame_rate_hz, steady)
        except InvalidInput as refusal:
            # Readers name the file by its path; the report is kept, and shown to others, without it.
            reason = str(refusal).replace(str(clip.path), clip.name)
            return Walk(row | {"verdict": "refused", "reason": reason}, None, 0.0)
        notes = "; ".join(motion.notes)
        return dataclasses.replace(walk, row=walk.row | {"reason": walk.row["reason"] or notes})

    clips = list(clips)
    inputs = {clip.name: clip.sha256 for clip in clips if clip.path}
    return _packed(map_threads(one, clips, workers), steady, inputs=inputs)


def steady_walk(
    row: dict[str, Any], positions: np.ndarray, valid: np.ndarray, frame_rate_hz: float, steady: Steady
) -> Walk:
    """The steady stretch of one clip as its treadmill equivalent, with its row of the report."""
    row = row | {"frames": len(positions), "verdict": "refused"}
    try:
        walking.require_millimetres(positions)
        row["leg_length_mm"] = walking.leg_length(positions)
        bridged = walking.bridge_gaps(positions, valid, frame_rate_hz, gap_s=steady.gap_s)
        row["bridged_values"] = bridged.n_filled
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
        series = fourier.represent(level, frame_rate_hz)
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
                received=f"{row['strides']:.2f}",
            )
        if row["fundamental_share"] < steady.fundamental_share:
            raise InvalidInput(
                "the fundamental frequency looks wrong: it holds too little of the variance",
                expected=f"{steady.fundamental_share:g} or more",
                received=f"{row['fundamental_share']:.2f} at {series.frequency_hz:.2f} Hz",
            )
        if series.residual_fraction > steady.residual_share:
            raise InvalidInput(
                "not periodic: two harmonics leave too much of the variance",
                expected=f"{steady.residual_share:g} or less",
                received=f"{series.residual_fraction:.2f}",
            )
    except InvalidInput as refusal:
        return Walk(row | {"reason": str(refusal)}, None, frame_rate_hz)
    return Walk(row | {"verdict": "kept"}, level, frame_rate_hz)


def _against_population(walks: list[Walk], ratio: float) -> list[Walk]:
    """Refuse walks whose frequency is half or double of the true one.

    People of different size are compared at equal Froude number: frequency times the root of leg length.  A walk
    far from the population's median is refused if its double or half, whichever is nearer to the population,
    describes it as well; otherwise it is a slow or a quick walk, and stays with a remark.
    """
    kept = [w for w in walks if w.positions is not None]
    if len(kept) < 3:
        return walks
    scaled = {id(w): w.row["frequency_hz"] * np.sqrt(w.row["leg_length_mm"]) for w in kept}
    middle = float(np.median(list(scaled.values())))
    judged = []
    for walk in walks:
        off = scaled[id(walk)] / middle if id(walk) in scaled else 1.0
        if walk.positions is not None and not 1 / ratio <= off <= ratio:
            other = walk.row["frequency_hz"] * (2.0 if off < 1 else 0.5)
            series = fourier.represent(walk.positions, walk.frame_rate_hz, frequency_hz=other)
            if series.residual_fraction > AS_WELL * walk.row["residual_share"]:
                remark = f"{'slower' if off < 1 else 'quicker'} than the others: {off:.2f} of their frequency"
                judged.append(dataclasses.replace(walk, row=walk.row | {"reason": remark}))
                continue
            reason = str(
                InvalidInput(
                    "the fundamental frequency is far from the other walkers'",
                    expected=f"within a factor of {ratio:g} for the leg length",
                    received=f"{walk.row['frequency_hz']:.2f} Hz, a factor of {off:.2f}",
                )
            )
            walk = Walk(walk.row | {"verdict": "refused", "reason": reason}, None, walk.frame_rate_hz)
        judged.append(walk)
    return judged


def _packed(walks: list[Walk], steady: Steady, *, inputs: dict[str, str]) -> Walks:
    walks = _against_population(walks, steady.frequency_ratio)
    kept = [w for w in walks if w.positions is not None]
    rows = [w.row for w in walks]
    if not kept:
        reasons = "; ".join(f"{row['clip']}: {row['reason']}" for row in rows[:3])
        more = f"; and {len(rows) - 3} more" if len(rows) > 3 else ""
        raise InvalidInput(f"none of the {len(rows)} clips can be used", received=reasons + more)
    positions = [w.positions for w in kept if w.positions is not None]

    return Walks(
        **packed_clips([w.row for w in kept], positions, [w.frame_rate_hz for w in kept]),
        stature_mm=np.array([walking.stature(p) for p in positions]),
        frequency_hz=np.array([w.row["frequency_hz"] for w in kept]),
        residual_share=np.array([w.row["residual_share"] for w in kept]),
        report=rows,
        report_columns=list(REPORT_COLUMNS),
        inputs=inputs,
    )


class WalksCorpus(Corpus):
    """Walks: zhang2004, zhang2007."""

    name = "walks"
    words = "walks"
    sample = "walker"
    world = (
        "World: right-handed, metres, z up, the walk along +y, +x to the walker's right; walkers are lifted from "
        "the tables' origin, the mean pelvis, to stand on the ground.\n"
        "View angle 0 is the frontal view, -90 the left profile, +90 the right profile; image right is the walker's "
        "right at 0, so a video taken from the front has to be mirrored."
    )
    result = Walks

    def synthetic(self, data: SyntheticData, seed: int, workers: int) -> Request:
        """Return the request for the embedded population."""
        alone = {name: value for name, value in vars(data).items() if name not in ("performances", "clips")}
        return Request({"data": alone, "seed": seed}, lambda: synthetic_walks(data, seed, workers))

    def recorded(self, data: RecordedData | FolderData, clips: Sequence[Clip], workers: int) -> Request:
        """Return the request for steady walks in recordings."""
        options = {"steady": data.steady, "clips": [clip.identity for clip in clips]}
        return Request(options, lambda: recorded_walks(clips, data.steady, workers))


WALKS = WalksCorpus()
"""The one corpus of walks."""
