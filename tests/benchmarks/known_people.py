"""Errors of simulated films of people from an unseen laboratory, with and without 3D data of a few of its people.

For CMU and biomechZoo, by a model of all other people: mean distance of the joints, mm, and root mean square error of
the knees, degrees, mean over people and four views, with none, one and three other people known; and the same without
the allowance for unfamiliar laboratories.  Needs MOCAP_MIRROR or `make data`; nothing is timed.
"""

from __future__ import annotations

import numpy as np

from pipeline.cli.compose import compose
from pipeline.clips.kinds import WALKS, Walks
from pipeline.core import fourier
from pipeline.seeding import derive_generator
from pipeline.validation import InvalidInput
from tests.benchmarks.tables import Row
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior.laboratories import COMMON
from walk3d.film.reconstruct.own_laboratory import calibrated
from walk3d.film.simulation.filmed import belt_speed_mm_s, film, training_walks
from walk3d.film.simulation.keypoints import DetectorError, Filming
from walk3d.film.study.clip import compare, reconstruct_clip
from walk3d.film.study.conditions import Condition
from walk3d.film.walk import (
    Detector,
    Prior,
    TrainingWalk,
    compact,
    expand,
    model_of,
    moments,
    prepare,
)
from walk3d.film.walk.sagittal_angles import KINDS

LABORATORIES = ("biomechzoo", "cmu")
HEADINGS_DEG = (0, 30, 60, 90)
KNOWN = (0, 1, 3)
COMPONENTS = 9
"""Number of components, less than half of the smallest number of training people."""
USUAL = Condition(kind="usual", level="usual")


def run() -> list[Row]:
    """Return one row for each laboratory, number of known people, and allowance for unfamiliar laboratories."""
    experiment = compose(["experiment=keypoints_headings", "data=many"])
    try:
        walks = experiment.data.request(WALKS, experiment.skeleton, 1, 1).make()
    except InvalidInput as refusal:
        raise SystemExit(f"known_people: {refusal}") from None
    assert isinstance(walks, Walks)
    return [row for laboratory in LABORATORIES for row in _rows(walks, laboratory)]


def _rows(walks: Walks, laboratory: str) -> list[Row]:
    trained = training_walks(walks)
    others = walks.source != laboratory
    small = compact(moments([trained[k] for k in np.flatnonzero(others)], walks.person[others]), COMPONENTS)
    share = anatomical.concentration(anatomical.person_weights(walks.person[others]), walks.source[others])
    people = list(dict.fromkeys(walks.person[~others].tolist()))
    of_person = [np.flatnonzero(walks.person == person) for person in people]
    each = [anatomical.by_block(np.stack([trained[k].walker for k in mine])) for mine in of_person]
    walkers = [((first + fourier.mirrored(first)) / 2.0).mean(axis=0) for first in each]
    rows: list[Row] = []
    for allowed in (False, True):
        for count in KNOWN:
            result = []
            for number, mine in enumerate(of_person):
                finite = [walkers[(number + 1 + k) % len(people)] for k in range(count)]
                moved = calibrated(small, np.stack(finite), share) if count else small
                left = share * (1.0 - COMMON if count else 1.0) * allowed
                prior = prepare(model_of(expand(moved)), Detector(), unfamiliar=left)
                result += [
                    _errors(walks, int(mine[0]), trained[mine[0]], heading, prior) for heading in HEADINGS_DEG
                ]
            error_mm, knee_deg = np.mean(result, axis=0)
            rows.append({
                "laboratory": laboratory, "people": len(people), "known": count, "unfamiliar_allowed": int(allowed),
                "error_mm": float(error_mm), "knee_error_deg": float(knee_deg),
            })  # fmt: skip
    return rows


def _errors(walks: Walks, walk: int, truth: TrainingWalk, heading: int, prior: Prior) -> tuple[float, float]:
    """Return the joint error, mm, and the knee error, degrees, of one simulated film."""
    filming = Filming(heading_rad=float(np.radians(heading)), speed_mm_s=belt_speed_mm_s(truth))
    generator = derive_generator(2007, f"known people {walk} {heading}")
    simulated = film(generator, walks, walk, DetectorError(), filming, longest_s=3.0)
    measured = compare(reconstruct_clip(simulated, prior, USUAL), simulated, truth, USUAL)
    return float(measured.distance_mm[0]), float(measured.angle_deg[0, list(KINDS).index("knee")])
