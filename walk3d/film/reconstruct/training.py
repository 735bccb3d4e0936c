"""Training of the model of walkers: eigenwalkers, and error bars that are learnt on left-out people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.seeding import derive_generator
from pipeline.validation import Options, require_count
from walk3d.anatomy.prior import concentration, person_weights
from walk3d.film.reconstruct.model_file import TrainedModel
from walk3d.film.simulation.filmed import belt_speed_mm_s, film, training_walks
from walk3d.film.simulation.keypoints import DetectorError, Filming
from walk3d.film.walk import (
    CompactMoments,
    Detector,
    Fitting,
    Moments,
    compact,
    errors,
    expand,
    model_of,
    moments,
    prepare,
    reconstruct,
)
from walk3d.film.walk.calibration import ANYBODY, AS_OURS, LEVELS, StandardErrors, learn

HEADINGS_DEG = (0, 30, -30, 60, -60, 90, -90, 180)
"""Headings, degrees, of each person's simulated clips.

Each heading is filmed overground and on a treadmill, with a person's walks in turn.
"""
MIN_OTHER_PEOPLE = 3
"""Minimum number of people outside the largest laboratory for learning the error bars for any person."""


class Training(Options):
    """Options of training.

    Attributes
    ----------
    components : int
        Number of eigenwalkers.
    seed : int
        Seed of the simulated clips on which error bars are learnt.
    """

    components: int = 14
    seed: int = 2007


def left_out_errors(
    walks: Walks, groups: np.ndarray, options: Training, error: DetectorError
) -> Iterator[tuple[str, StandardErrors]]:
    """Yield the standardised errors of each person in simulated clips, for models trained without the person's group.

    Parameters
    ----------
    walks : Walks
    groups : (R,)
        Group of each walk: its person, or its laboratory.
    options : Training
    error : DetectorError
    """
    trained = training_walks(walks)
    people = list(dict.fromkeys(walks.person.tolist()))
    cases = [(overground, heading) for overground in (True, False) for heading in HEADINGS_DEG]
    for group in dict.fromkeys(groups.tolist()):
        others = groups != group
        rest = [walk for walk, other in zip(trained, others, strict=True) if other]
        model = model_of(expand(_compacted(moments(rest, walks.person[others]), options)))
        share = concentration(person_weights(walks.person[others]), walks.source[others])
        prior = prepare(model, Detector(floor_mm=np.full(15, error.bias_mm)), unfamiliar=share)
        for person in dict.fromkeys(walks.person[~others].tolist()):
            number, walks_of_person = people.index(person), np.flatnonzero(walks.person == person)
            for case, (overground, heading) in enumerate(cases):
                k = int(walks_of_person[case % len(walks_of_person)])
                generator = derive_generator(options.seed, f"{number} {case}")
                speed = belt_speed_mm_s(trained[k]) if overground else 0.0
                filming = Filming(heading_rad=np.radians(heading), speed_mm_s=speed)
                sim = film(generator, walks, k, error, filming)
                weights = np.ones(sim.pixels.shape[:2])
                reconstruction = reconstruct(
                    sim.pixels,
                    weights,
                    sim.frame_rate_hz,
                    sim.focal_px,
                    prior,
                    Fitting(both_labellings=False),
                )
                of_truth = reconstruction, sim.positions_mm, sim.heading_rad
                events = errors.event_errors(*of_truth)
                yield person, errors.standard_errors(*of_truth, trained[k], events)


def _compacted(full_moments: Moments, options: Training) -> CompactMoments:
    """Return statistics of walkers with the requested number of eigenwalkers, or fewer if there are few people.

    The number of eigenwalkers is less than half the number of people.
    """
    return compact(full_moments, min(options.components, (full_moments.walkers - 1) // 2))


def train(walks: Walks, options: Training, tell: Callable[[str], None] = lambda _: None) -> TrainedModel:
    """Train a model and learn its error bars.

    Parameters
    ----------
    walks : Walks
    options : Training
    tell : callable
        Called with lines of progress.
    """
    require_count("training.components", options.components)
    full_moments = moments(training_walks(walks), walks.person)
    compact_moments = compact(full_moments, options.components)
    sources = Counter(dict(zip(walks.person.tolist(), walks.source.tolist(), strict=True)).values())
    left_out = {AS_OURS: walks.person}
    if full_moments.walkers - max(sources.values()) >= MIN_OTHER_PEOPLE:
        left_out[ANYBODY] = walks.source
    calibrations, clips = {}, 0
    for audience, groups in left_out.items():
        clip_errors: list[StandardErrors] = []
        people: set[str] = set()
        for person, errors_of_clip in left_out_errors(walks, groups, options, DetectorError()):
            clip_errors.append(errors_of_clip)
            if person not in people:
                people.add(person)
                tell(
                    f"error bars, {audience.replace('_', ' ')}: {len(people)} of {full_moments.walkers} people left out"
                )
        calibrations[audience] = learn(clip_errors)
        clips += len(clip_errors)
    about = {
        "people_by_source": dict(sorted(sources.items())),
        "walks": len(walks),
        "components": options.components,
        "variance_kept": round(
            float(compact_moments.eigenvalues.sum() / np.trace(full_moments.covariance)), 4
        ),
        "calibration": {
            "clips": clips,
            "for": list(calibrations),
            "levels": list(LEVELS),
            "seed": options.seed,
        },
    }
    return TrainedModel(compact_moments, calibrations, about)
