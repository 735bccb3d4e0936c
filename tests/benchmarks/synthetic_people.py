"""Comparison of synthetic and recorded people: sway, bob, variance, and offsets of head, sternum and pelvis.

Options: `data`, names of data sets with commas between, and `folder`, a folder of recordings, each one person or an
average walker.  All are scaled to 1500 mm from the ankles to the head, means over the cycle.  A number is the mean
over people, followed by the standard deviation between them (``_sd``).

sway, bob      amplitude of the pelvis sideways, once a cycle, and upwards, twice a cycle, mm
profile, frontal   variance over time of the dimension that this view does not see, mean over joints, mm²
head, sternum_ahead   head and sternum ahead of the hips, mm
sternum, pelvis   sternum above the shoulders; pelvis above the hips, mm
hips, trunk, neck   hips above the ankles; sternum above the hips; head above the sternum, mm
distance       of the average walker from the synthetic average (synthetic: mean of each person's), mm: root mean
               square over the cycle about the middle of the hips, mean over joints
nearer         synthetic people who are nearer to the synthetic average

Rows repeat with other definitions of pelvis and sternum.  Recorded people need MOCAP_MIRROR or `make data`.
"""

from __future__ import annotations

import numpy as np

from pipeline.cli.compose import compose
from pipeline.clips.kinds import WALKS, Walks
from pipeline.core.walking.definitions import HEAD, HIPS, SHOULDERS, STERNUM
from pipeline.skeleton import ANKLES, PELVIS
from pipeline.validation import InvalidInput
from tests.benchmarks.tables import Row

HEIGHT_MM = 1500.0
DEFINITIONS = (
    ("measured", "measured"),
    ("hips", "measured"),
    ("above", "measured"),
    ("above", "below_shoulders"),
)
X, Y, Z = 0, 1, 2


def run(data: str = "synthetic,optical,cmu,many", folder: str = "") -> list[Row]:
    """Return one row for each data set and joint definition, with the synthetic people first."""
    names = [name for name in data.split(",") if name != "synthetic"]
    sets = [["data=synthetic", "data.populations=0"], *([f"data={name}"] for name in names)]
    if folder:
        sets.append(["data=folder", f"data.path={folder}"])
    rows: list[Row] = []
    synthetic: dict[tuple[str, str], np.ndarray] = {}
    for overrides in sets:
        experiment = compose(["experiment=zhang2007_fig5", *overrides])
        try:
            clips = experiment.data.request(WALKS, experiment.skeleton, experiment.seed, 1).make()
        except InvalidInput as refusal:
            raise SystemExit(f"synthetic_people, {experiment.data.name}: {refusal}") from None
        for definition in DEFINITIONS:
            walks = scaled(_defined(overrides, clips, *definition))
            people = synthetic.setdefault(definition, walks)
            rows.append(_row(experiment.data.name, definition, walks, people))
    return rows


def _defined(overrides: list[str], clips: Walks, pelvis: str, sternum: str) -> np.ndarray:
    """Return Fourier representations (R, 5, 15, 3), mm, of people with these definitions of pelvis and sternum."""
    switched = [*overrides, f"dataset.pelvis={pelvis}", f"dataset.sternum={sternum}"]
    dataset = compose(["experiment=zhang2007_fig5", *switched]).dataset
    return np.asarray(dataset.build(clips, workers=1).coefficients)


def scaled(walks: np.ndarray) -> np.ndarray:
    """Return walks (R, 5, 15, 3), mm, scaled to the same body height, relative to the midpoint of the hips."""
    height = walks[:, 0, HEAD, Z] - walks[:, 0, ANKLES, Z].mean(axis=1)
    walks = walks * (HEIGHT_MM / height)[:, None, None, None]
    walks[:, 0] -= walks[:, 0, HIPS].mean(axis=1)[:, None]
    return walks


def distance_mm(walks: np.ndarray, average: np.ndarray) -> np.ndarray:
    """Return the distances (…,), mm, of walks (…, 5, 15, 3) from a given walk: rms over the cycle, mean over joints."""
    distance = walks - average
    square = distance[..., 0, :, :] ** 2 + 0.5 * (distance[..., 1:, :, :] ** 2).sum(axis=-3)
    return np.sqrt(square.sum(axis=-1)).mean(axis=-1)


def _row(name: str, definition: tuple[str, str], walks: np.ndarray, synthetic: np.ndarray) -> Row:
    row: Row = dict(zip(("people", "pelvis", "sternum"), (name, *definition), strict=True))
    row["count"] = len(walks)
    variance = 0.5 * (walks[:, 1:] ** 2).sum(axis=1).mean(axis=1)
    mean = walks[:, 0]
    quantities = {
        "sway_mm": np.hypot(*walks[:, 1:3, PELVIS, X].T),
        "bob_mm": np.hypot(*walks[:, 3:5, PELVIS, Z].T),
        "profile_mm2": variance[:, X],
        "frontal_mm2": variance[:, Y],
        "head_mm": mean[:, HEAD, Y],
        "sternum_mm": mean[:, STERNUM, Z] - mean[:, SHOULDERS, Z].mean(axis=1),
        "sternum_ahead_mm": mean[:, STERNUM, Y],
        "pelvis_mm": mean[:, PELVIS, Z],
        "hips_mm": -mean[:, ANKLES, Z].mean(axis=1),
        "trunk_mm": mean[:, STERNUM, Z],
        "neck_mm": mean[:, HEAD, Z] - mean[:, STERNUM, Z],
    }
    for quantity, values in quantities.items():
        row[quantity] = float(values.mean())
        row[f"{quantity}_sd"] = float(values.std(ddof=1)) if len(values) > 1 else 0.0
    average = synthetic.mean(axis=0)
    each = distance_mm(synthetic, average)
    distance = float(each.mean() if walks is synthetic else distance_mm(walks.mean(axis=0), average))
    return row | {"distance_mm": distance, "nearer": int((each < distance).sum())}
