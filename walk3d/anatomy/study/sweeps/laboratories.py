"""Errors and error bars for people of laboratories outside the training data, and learning curves.

Differences between laboratories are estimated from the training laboratories only, never from the tested one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from pipeline.core import errors, linear_model
from pipeline.processes import map_processes
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, scaled
from pipeline.validation import require_range
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import Differences
from walk3d.anatomy.study.model import AnatomicalInputs
from walk3d.anatomy.study.sweeps.held_out import (
    CHOOSING_VIEWS_DEG,
    NOISE_VARIANCES_MM2,
    NORMAL_95,
    PARTNERS,
    Choosers,
    Fold,
    People,
)
from walk3d.anatomy.study.sweeps.setting import Setting, anatomical_setting
from walk3d.anatomy.study.sweeps.structure import errors_of

PERSON, LABORATORY = "all but the person", "all other laboratories"
"""Choices of training data: everyone except the tested person, or all laboratories except the person's own.

Each other laboratory alone is one further choice.
"""
METHODS = ("average_walker", "map_tuned", "anatomical", "anybody")
"""Methods to compare: ``anatomical`` ignores differences between laboratories, ``anybody`` models them."""
KNOWN_COUNTS = (1, 3, 8)
"""Numbers k of people of the tested laboratory whose 3D walks are known to the methods ``anybody_k``."""
MIN_PEOPLE = 4
"""Minimum number of people for the training of a model."""
CURVE = (4, 6, 8, 12, 16, 24, 32, 41, 64)
"""Numbers of training people in the learning curves."""
OFFSET_MM, SIZE = 25.0, 0.1
"""Differences between two simulated laboratories.

`OFFSET_MM` is the root mean square offset of a joint along an axis; `SIZE` is the relative difference of body size.
"""
VIEWS = np.radians(CHOOSING_VIEWS_DEG)
LEVEL = np.array([0.95])


@dataclass(frozen=True)
class LaboratoryErrors:
    """Reconstruction errors of all people, for several choices of training data.

    Attributes
    ----------
    rows : DataFrame
        Mean square error by person, `learnt_from` and method (``anybody_k``: k people of the laboratory are known).
        Also the shares within 95 % bars as computed and as calibrated (`covered_95`, `covered_95_calibrated`).
        Multipliers are calibrated on people who were left out in the same way, without the tested laboratory if that is
        left out.  They are NaN for methods without bars, or with one training laboratory.
    curve : DataFrame
        Mean square error by person, method, and numbers of training `people` and their `laboratories`; also the share
        of the person's variance that these people span.  `left_out` is the person, the laboratory, or all but one other
        laboratory.
    """

    rows: pd.DataFrame
    curve: pd.DataFrame


def simulated_laboratories(
    data: FourierSamples, rng: np.random.Generator, *, offset_mm: float = OFFSET_MM, size: float = SIZE
) -> FourierSamples:
    """Return the walks with simulated differences between two laboratories that each recorded half of the people.

    The two simulated laboratories differ in the positions of joints and in the sizes of bodies.

    Offsets of joints are symmetric in the sides.
    """
    people = list(dict.fromkeys(data.person))
    laboratory = np.array([people.index(who) % 2 for who in data.person])
    moved = rng.normal(0.0, offset_mm / 2.0, (15, 3))
    moved = (moved + moved[list(WALKER15.mirror)] * [-1.0, 1.0, 1.0]) / np.sqrt(2.0)
    moved[WALKER15.index("pelvis")] = 0.0
    scale = (1.0 + size * (laboratory - 0.5))[:, None, None, None]
    coefficients = scale * data.coefficients
    coefficients[:, 0] += np.where(laboratory[:, None, None] == 0, moved, -moved)
    names = np.array(["laboratory_1", "laboratory_2"])
    residual = scale**2 * data.residual_covariance
    return replace(data, coefficients=coefficients, residual_covariance=residual, source=names[laboratory])


class Laboratories(Sweep):
    """Sweep that reconstructs all people with models of other people and with models of other laboratories."""

    draws_random_numbers = True

    partners: Choosers = scaled(value=PARTNERS)  # number of other people for the selection of sigma² of MAP

    def measure(self, inputs: AnatomicalInputs) -> LaboratoryErrors:
        """Return the errors and error bars of all people.

        People of a single source are split into two simulated laboratories.
        """
        data, model = inputs.dataset, inputs.model
        if len(np.unique(data.source)) == 1:
            data = simulated_laboratories(data, inputs.generator("laboratories"))
            model = replace(model, sources=data.source[model.tested])
        people = People(data, model)
        require_range("the number of people", people.count, at_least=2 * MIN_PEOPLE)
        whole = anatomical_setting(inputs.model_options, people.harmonics)
        tuned = people.tuned_map(NOISE_VARIANCES_MM2, self.partners, inputs.workers)
        anybody = replace(whole, differences=Differences())
        orders = [inputs.generator(f"people {n}").permutation(people.count) for n in range(people.count)]

        def person_rows(
            person: int,
        ) -> tuple[list[dict[str, object]], list[np.ndarray], list[dict[str, object]]]:
            rows, z = [], []
            settings = dict(zip(METHODS, (tuned[person], tuned[person], whole, anybody), strict=True))
            key = {"person": str(model.people[person]), "tested": str(model.sources[person])}
            for learnt_from, left in left_out(model.sources, person):
                fold = people.fold(*np.flatnonzero(left).tolist())
                plain = {method: settings[method] for method in METHODS[:2]}
                error = errors_of(people, fold, plain, person, VIEWS).mean(axis=(1, 2))
                bars = [_with_bars(people, fold, settings[method], person) for method in METHODS[2:]]
                rows += [
                    {**key, "learnt_from": learnt_from, "method": method, "absolute_error_mm2": value}
                    for method, value in zip(METHODS, [*error, *(e for e, _ in bars)], strict=True)
                ]
                z += [each for _, each in bars]
            rows += [{**key, **row} for row in _of_known_people(people, anybody, person, orders[person])]
            return rows, z, _curve(people, settings, person, orders[person])

        results = map_processes(person_rows, range(people.count), inputs.workers)
        rows = pd.DataFrame([row for each in results for row in each[0]])
        barred = rows["method"].isin(METHODS[2:])
        z = np.concatenate([each[1] for each in results])
        rows.loc[barred, "covered_95"] = (z <= NORMAL_95).mean(axis=(1, 2, 3))
        for (learnt_from, _), part in rows[barred].groupby(["learnt_from", "method"]):
            group = part["person" if learnt_from == PERSON else "tested"].to_numpy()
            if learnt_from in (PERSON, LABORATORY) and len(np.unique(group)) > 1:
                group_z = z[np.flatnonzero(np.isin(rows.index[barred], part.index))]
                m = anatomical.multipliers_without(group_z, anatomical.GROUP_OF_JOINT, LEVEL, alike=group)[
                    ..., 0
                ]
                covered = group_z <= m[:, None, None, anatomical.GROUP_OF_JOINT]
                rows.loc[part.index, "covered_95_calibrated"] = covered.mean(axis=(1, 2, 3))
        return LaboratoryErrors(rows, pd.DataFrame([row for each in results for row in each[2]]))


def left_out(sources: np.ndarray, person: int) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the choices of training data for one person, each with the mask (P,) of people who are left out.

    Kinds with fewer than `MIN_PEOPLE` training people are skipped.
    """
    tested = sources[person]
    yield PERSON, np.arange(len(sources)) == person
    others = [name for name in dict.fromkeys(sources) if name != tested]
    alone = [(str(name), sources != name) for name in others if len(others) > 1]
    for learnt_from, left in [(LABORATORY, sources == tested), *alone]:
        if (~left).sum() >= MIN_PEOPLE:
            yield learnt_from, left


def _of_known_people(
    people: People, anybody: Setting, person: int, order: np.ndarray
) -> Iterator[dict[str, object]]:
    """Yield the errors of a person whose laboratory is left out, if a few of its people are known in 3D.

    Those people determine only the laboratory's difference; they are not training data.
    """
    same_laboratory = people.model.sources == people.model.sources[person]
    others = order[same_laboratory[order] & (order != person)]
    if (~same_laboratory).sum() < MIN_PEOPLE:
        return
    for count in (k for k in KNOWN_COUNTS if k <= len(others)):
        fold = people.fold(*np.flatnonzero(same_laboratory).tolist(), known=tuple(others[:count].tolist()))
        error, z = _with_bars(people, fold, anybody, person)
        yield {
            "learnt_from": LABORATORY,
            "method": f"anybody_{count}",
            "absolute_error_mm2": error,
            "covered_95": (z <= NORMAL_95).mean(),
        }


def _with_bars(people: People, fold: Fold, setting: Setting, person: int) -> tuple[float, np.ndarray]:
    """Return one person's mean square error, mm², and absolute standardised errors (A, K, 15) at K instants."""
    off, error, sd = fold.bars(setting, person, VIEWS)
    weights, beyond = errors.parseval_weights(off.shape[-1]), people.beyond(person, VIEWS, setting.harmonics)
    square = off**2 @ weights + beyond
    return square.mean(), np.moveaxis(np.abs(error) / sd, 1, -1)


def _curve(
    people: People, settings: dict[str, Setting], person: int, order: np.ndarray
) -> list[dict[str, object]]:
    """Return the errors of one person for increasing numbers of training people.

    Only numbers that are available for every person are used.
    """
    rows: list[dict[str, object]] = []
    sources = people.model.sources[order]
    for kind, (allowed, most) in _drawn_from(people.model.sources, person, order).items():
        for count in (n for n in CURVE if n <= most):
            selected = order[allowed][:count]
            fold = people.fold(*np.setdiff1d(np.arange(people.count), selected).tolist())
            unused = "anybody" if kind == "person" else "anatomical"
            methods = {m: s for m, s in settings.items() if m != unused}
            method_errors = errors_of(people, fold, methods, person, VIEWS).mean(axis=(1, 2))
            key = {
                "person": str(people.model.people[person]),
                "left_out": kind,
                "people": count,
                "laboratories": len(np.unique(sources[allowed][:count])),
                "spanned_percent": 100.0 * _spanned(people, selected, person),
            }
            rows += [
                {**key, "method": method, "absolute_error_mm2": error}
                for method, error in zip(methods, method_errors, strict=True)
            ]
    return rows


def _drawn_from(sources: np.ndarray, person: int, order: np.ndarray) -> dict[str, tuple[np.ndarray, int]]:
    """Return, for each learning curve, the mask (P,) of possible training people, and their maximum number.

    The masks follow a random order of people. The number is available for every tested person.

    Kinds: without the person; without the laboratory; and, with several other laboratories, the largest one only.
    """
    names, counts = np.unique(sources, return_counts=True)
    size = dict(zip(names, counts, strict=True))
    largest = sorted(size, key=lambda name: (-size[name], name))
    tested = sources[person]
    single = next(name for name in largest if name != tested)
    kinds = {
        "person": (order != person, len(sources) - 1),
        "laboratory": (sources[order] != tested, len(sources) - size[largest[0]]),
    }
    if len(largest) > 2:
        kinds["all but one other laboratory"] = (sources[order] == single, size[largest[1]])
    return kinds


def _spanned(people: People, others: np.ndarray, person: int) -> float:
    """Return the share of a person's deviation from the mean that lies in the span of other people.

    The deviation is from the mean of the other people. All walks have two harmonics.
    """
    walkers = linear_model.flatten(np.stack([people.walker(n)[:5] for n in (*others, person)]))
    centred = walkers[:-1] - walkers[:-1].mean(axis=0)
    deviation = walkers[-1] - walkers[:-1].mean(axis=0)
    directions = np.linalg.svd(centred, full_matrices=False)[2][: len(others) - 1]
    return ((directions @ deviation) ** 2).sum() / (deviation**2).sum()
