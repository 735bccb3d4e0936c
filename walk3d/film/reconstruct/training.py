"""Training of the model that reconstructs walks: eigenwalkers, and error bars learnt on people who were left out."""

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
"""Of simulated clips, overground and on a treadmill each; a person's walks take turns."""
LEAST_KNOWN = 3
"""People of other laboratories of whom bars for anybody may be learnt."""


class Training(Options):
    """Options of training.

    Attributes
    ----------
    components : int
        Eigenwalkers that are kept.
    seed : int
        Of the simulated clips on which error bars are learnt.
    """

    components: int = 14
    seed: int = 2007


def left_out_errors(
    walks: Walks, groups: np.ndarray, options: Training, error: DetectorError
) -> Iterator[tuple[str, StandardErrors]]:
    """Yield each person's errors over standard deviations in simulated clips, by a model without his or her group.

    Parameters
    ----------
    walks : Walks
    groups : (R,)
        Of each walk: who walked, or where it was recorded.
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
            number, mine = people.index(person), np.flatnonzero(walks.person == person)
            for case, (overground, heading) in enumerate(cases):
                k = int(mine[case % len(mine)])
                generator = derive_generator(options.seed, f"{number} {case}")
                speed = belt_speed_mm_s(trained[k]) if overground else 0.0
                filming = Filming(heading_rad=np.radians(heading), speed_mm_s=speed)
                sim = film(generator, walks, k, error, filming)
                seen = np.ones(sim.pixels.shape[:2])
                found = reconstruct(
                    sim.pixels, seen, sim.frame_rate_hz, sim.focal_px, prior, Fitting(both_labellings=False)
                )
                of_truth = found, sim.positions_mm, sim.heading_rad
                events = errors.event_errors(*of_truth)
                yield person, errors.standard_errors(*of_truth, trained[k], events)


def _compacted(found: Moments, options: Training) -> CompactMoments:
    """As many eigenwalkers as are asked for, if they are fewer than half the people."""
    return compact(found, min(options.components, (found.walkers - 1) // 2))


def train(walks: Walks, options: Training, tell: Callable[[str], None] = lambda _: None) -> TrainedModel:
    """Train a model and learn its error bars.

    Parameters
    ----------
    walks : Walks
    options : Training
    tell : callable
        Told of progress.
    """
    require_count("training.components", options.components)
    whole = moments(training_walks(walks), walks.person)
    small = compact(whole, options.components)
    sources = Counter(dict(zip(walks.person.tolist(), walks.source.tolist(), strict=True)).values())
    left_out = {AS_OURS: walks.person}
    if whole.walkers - max(sources.values()) >= LEAST_KNOWN:
        left_out[ANYBODY] = walks.source
    calibrations, clips = {}, 0
    for whom, groups in left_out.items():
        found: list[StandardErrors] = []
        people: set[str] = set()
        for person, of_clip in left_out_errors(walks, groups, options, DetectorError()):
            found.append(of_clip)
            if person not in people:
                people.add(person)
                tell(
                    f"error bars, {whom.replace('_', ' ')}: {len(people)} of {whole.walkers} people left out"
                )
        calibrations[whom] = learn(found)
        clips += len(found)
    about = {
        "people_by_source": dict(sorted(sources.items())),
        "walks": len(walks),
        "components": options.components,
        "variance_kept": round(float(small.eigenvalues.sum() / np.trace(whole.covariance)), 4),
        "calibration": {
            "clips": clips,
            "for": list(calibrations),
            "levels": list(LEVELS),
            "seed": options.seed,
        },
    }
    return TrainedModel(small, calibrations, about)
