"""Delay of a laboratory's foot contacts and toe-offs after the turning points of the ankles; nothing is timed.

The events are in the C3D files of biomechZoo.  For each kind: how many, of how many people; the mean share of the cycle
by which they come after the ankle's turning points about the pelvis; and how far they are, ms, from these points and
with the mean share of others: median and 90 %.  Needs MOCAP_MIRROR or `make data`.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from scipy.signal import find_peaks

from pipeline import resources
from pipeline.fetch.sources import read_sources, resolve
from pipeline.formats import c3d
from pipeline.formats.c3d.header import read_header
from pipeline.formats.c3d.parameters import read_parameters
from pipeline.validation import InvalidInput
from tests.benchmarks.tables import Row

KINDS = {"contact": ("Foot Strike", 1.0), "toe_off": ("Foot Off", -1.0)}
"""Label of each event in the file, and sign of the ankle coordinate at its turning point."""


def run() -> list[Row]:
    """Return one row for each kind of gait event."""
    mirrors = [Path(part) for part in os.environ.get("MOCAP_MIRROR", "").split(os.pathsep) if part]
    rows = [row for row in read_sources(resources.DATA / "sources.csv") if row["source"] == "biomechzoo"]
    paths = [(row["subject"], resolve(row, raw=resources.DATA / "raw", mirror=mirrors)) for row in rows]
    result: dict[str, list[tuple[str, float, float]]] = {kind: [] for kind in KINDS}
    for person, path in paths:
        if path is not None and path.suffix == ".c3d":
            for kind, late, period in _late(path):
                result[kind].append((person, late, period))
    if not any(result.values()):
        raise SystemExit(
            "gait_events: no recording of biomechzoo was found; set MOCAP_MIRROR or run make data"
        )
    return [_row(kind, events) for kind, events in result.items()]


def _late(path: Path) -> list[tuple[str, float, float]]:
    """Return the kind of each event, its delay after the ankle's nearest turning point, cycles, and the cycle, s."""
    data = path.read_bytes()
    parameters = read_parameters(data, read_header(data, path.name), path.name, [])
    times = np.array(parameters.numbers("EVENT:TIMES")).reshape(-1, 2) @ [60.0, 1.0]
    first = (parameters.numbers("TRIAL:ACTUAL_START_FIELD") or [1.0])[0]
    try:
        motion = c3d.read(path)
    except InvalidInput:
        return []
    at = dict(zip(motion.names, np.moveaxis(motion.positions_mm, 1, 0), strict=True))
    rate, distance = motion.frame_rate_hz, int(0.6 * motion.frame_rate_hz)
    heading = np.nanmean(np.diff(at["PELO"], axis=0), axis=0)[:2]
    ahead = {
        side: np.nan_to_num(at[f"{side}TIO"] - at["PELO"])[:, :2] @ heading / np.linalg.norm(heading)
        for side in "LR"
    }

    def turning(side: str, sign: float) -> np.ndarray:
        signal = sign * ahead[side]
        return np.asarray(find_peaks(signal, distance=distance, prominence=0.5 * np.ptp(signal))[0])

    strides = np.concatenate([np.diff(turning(side, 1.0)) for side in "LR"])
    if not len(strides):
        return []
    period = float(np.median(strides)) / rate
    labels, contexts = parameters.texts("EVENT:LABELS"), parameters.texts("EVENT:CONTEXTS")
    result = []
    for time, label, context in zip(times, labels, contexts, strict=True):
        for kind, (name, sign) in KINDS.items():
            points = turning(context[0], sign) if label == name and context[:1] in ("L", "R") else np.empty(0)
            frame = time * rate - first  # frames are counted from one
            late = (frame - points[np.abs(points - frame).argmin()]) / rate if len(points) else np.inf
            if abs(late) < 0.2 * period:  # else of a step that the clip does not hold
                result.append((kind, late / period, period))
    return result


def _row(kind: str, events: list[tuple[str, float, float]]) -> Row:
    person = np.array([who for who, _, _ in events])
    share, period = np.array([late for _, late, _ in events]), np.array([seconds for *_, seconds in events])
    people = np.unique(person)
    mean = {who: share[person == who].mean() for who in people}
    others = np.array([np.mean([mean[other] for other in people if other != who]) for who in person])
    row: Row = {"event": kind, "events": len(share), "people": len(people)}
    row["share_of_cycle"] = float(np.mean(list(mean.values())))
    for name, off in (("from_ankle", share), ("with_share_of_others", share - others)):
        off_ms = 1e3 * np.abs(off) * period
        row |= {
            f"{name}_median_ms": float(np.median(off_ms)),
            f"{name}_90_ms": float(np.quantile(off_ms, 0.9)),
        }
    return row
