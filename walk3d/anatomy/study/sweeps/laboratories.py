"""People of laboratories that no model has seen: errors and bars across laboratories, and what more people would bring.

How laboratories differ is learnt from those that train: nothing comes from the laboratory that is tested.
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
"""What is learnt from, besides each other laboratory alone."""
METHODS = ("average_walker", "map_tuned", "anatomical", "anybody")
"""The last two: as if measured as those who train, and with what laboratories differ by."""
KNOWN = (1, 3, 8)
"""Other people of the tested laboratory whose walks are known in 3D: method ``anybody_k``."""
LEAST_PEOPLE = 4
"""That are learnt from."""
CURVE = (4, 6, 8, 12, 16, 24, 32, 41, 64)
"""Numbers of people that are learnt from."""
OFFSET_MM, SIZE = 25.0, 0.1
"""What two simulated laboratories differ by: root mean square per axis of a joint, and size."""
VIEWS = np.radians(CHOOSING_VIEWS_DEG)
LEVEL = np.array([0.95])


@dataclass(frozen=True)
class LaboratoryErrors:
    """Errors of everybody by what is learnt from.

    Attributes
    ----------
    rows : DataFrame
        A row to each person, `learnt_from` and method (with k people of the laboratory known, ``anybody_k``): mean
        square error; shares within 95 % bars as computed, and with
        multipliers learnt on people who were left out in the same way, none of them of this laboratory if that is left
        out (`covered_95`, `covered_95_calibrated`; NaN of methods without bars or where only one laboratory trains).
    curve : DataFrame
        A row to each person, number of `people` learnt from, of how many `laboratories`, and method: mean square error,
        and the share of the person's variance that these people span; `left_out` is the person, the laboratory, or all
        but one other laboratory.
    """

    rows: pd.DataFrame
    curve: pd.DataFrame


def simulated_laboratories(
    data: FourierSamples, rng: np.random.Generator, *, offset_mm: float = OFFSET_MM, size: float = SIZE
) -> FourierSamples:
    """The walks of one source as if two laboratories had recorded them, with other joints and people of another size.

    Offsets of joints are alike left and right.
    """
    people = list(dict.fromkeys(data.person))
    of = np.array([people.index(who) % 2 for who in data.person])
    moved = rng.normal(0.0, offset_mm / 2.0, (15, 3))
    moved = (moved + moved[list(WALKER15.mirror)] * [-1.0, 1.0, 1.0]) / np.sqrt(2.0)
    moved[WALKER15.index("pelvis")] = 0.0
    scale = (1.0 + size * (of - 0.5))[:, None, None, None]
    coefficients = scale * data.coefficients
    coefficients[:, 0] += np.where(of[:, None, None] == 0, moved, -moved)
    names = np.array(["laboratory_1", "laboratory_2"])
    residual = scale**2 * data.residual_covariance
    return replace(data, coefficients=coefficients, residual_covariance=residual, source=names[of])


class Laboratories(Sweep):
    """Everybody by models of other people, and of other laboratories."""

    draws_random_numbers = True

    partners: Choosers = scaled(value=PARTNERS)  # people who choose sigma² of MAP for each person

    def measure(self, inputs: AnatomicalInputs) -> LaboratoryErrors:
        """Return errors and bars of everybody; people of a single source get two simulated laboratories."""
        data, model = inputs.dataset, inputs.model
        if len(np.unique(data.source)) == 1:
            data = simulated_laboratories(data, inputs.generator("laboratories"))
            model = replace(model, sources=data.source[model.tested])
        people = People(data, model)
        require_range("the number of people", people.count, at_least=2 * LEAST_PEOPLE)
        whole = anatomical_setting(inputs.model_options, people.harmonics)
        tuned = people.tuned_map(NOISE_VARIANCES_MM2, self.partners, inputs.workers)
        anybody = replace(whole, differences=Differences())
        orders = [inputs.generator(f"people {n}").permutation(people.count) for n in range(people.count)]

        def one(person: int) -> tuple[list[dict[str, object]], list[np.ndarray], list[dict[str, object]]]:
            rows, z = [], []
            of = dict(zip(METHODS, (tuned[person], tuned[person], whole, anybody), strict=True))
            key = {"person": str(model.people[person]), "tested": str(model.sources[person])}
            for learnt_from, left in left_out(model.sources, person):
                fold = people.fold(*np.flatnonzero(left).tolist())
                plain = {method: of[method] for method in METHODS[:2]}
                error = errors_of(people, fold, plain, person, VIEWS).mean(axis=(1, 2))
                bars = [_with_bars(people, fold, of[method], person) for method in METHODS[2:]]
                rows += [
                    {**key, "learnt_from": learnt_from, "method": method, "absolute_error_mm2": value}
                    for method, value in zip(METHODS, [*error, *(e for e, _ in bars)], strict=True)
                ]
                z += [each for _, each in bars]
            rows += [{**key, **row} for row in _of_known_people(people, anybody, person, orders[person])]
            return rows, z, _curve(people, of, person, orders[person])

        found = map_processes(one, range(people.count), inputs.workers)
        rows = pd.DataFrame([row for each in found for row in each[0]])
        barred = rows["method"].isin(METHODS[2:])
        z = np.concatenate([each[1] for each in found])
        rows.loc[barred, "covered_95"] = (z <= NORMAL_95).mean(axis=(1, 2, 3))
        for (learnt_from, _), of in rows[barred].groupby(["learnt_from", "method"]):
            group = of["person" if learnt_from == PERSON else "tested"].to_numpy()
            if learnt_from in (PERSON, LABORATORY) and len(np.unique(group)) > 1:
                mine = z[np.flatnonzero(np.isin(rows.index[barred], of.index))]
                m = anatomical.multipliers_without(mine, anatomical.GROUP_OF_JOINT, LEVEL, alike=group)[
                    ..., 0
                ]
                held = mine <= m[:, None, None, anatomical.GROUP_OF_JOINT]
                rows.loc[of.index, "covered_95_calibrated"] = held.mean(axis=(1, 2, 3))
        return LaboratoryErrors(rows, pd.DataFrame([row for each in found for row in each[2]]))


def left_out(sources: np.ndarray, person: int) -> Iterator[tuple[str, np.ndarray]]:
    """What is learnt from for one person, and who is left out (P,) bool; too few to learn from are left aside."""
    mine = sources[person]
    yield PERSON, np.arange(len(sources)) == person
    others = [name for name in dict.fromkeys(sources) if name != mine]
    alone = [(str(name), sources != name) for name in others if len(others) > 1]
    for learnt_from, left in [(LABORATORY, sources == mine), *alone]:
        if (~left).sum() >= LEAST_PEOPLE:
            yield learnt_from, left


def _of_known_people(
    people: People, anybody: Setting, person: int, order: np.ndarray
) -> Iterator[dict[str, object]]:
    """Errors of a person whose laboratory is left out, but for some of its people who are known in 3D.

    Theirs are only the mean and the covariance of what sets the laboratory apart: nobody of it is learnt from.
    """
    mine = people.model.sources == people.model.sources[person]
    theirs = order[mine[order] & (order != person)]
    if (~mine).sum() < LEAST_PEOPLE:
        return
    for count in (k for k in KNOWN if k <= len(theirs)):
        fold = people.fold(*np.flatnonzero(mine).tolist(), known=tuple(theirs[:count].tolist()))
        error, z = _with_bars(people, fold, anybody, person)
        yield {
            "learnt_from": LABORATORY,
            "method": f"anybody_{count}",
            "absolute_error_mm2": error,
            "covered_95": (z <= NORMAL_95).mean(),
        }


def _with_bars(people: People, fold: Fold, setting: Setting, person: int) -> tuple[float, np.ndarray]:
    """Mean square error, mm², and |error| over standard deviation (A, K, 15) of the missing dimension at instants."""
    off, error, sd = fold.bars(setting, person, VIEWS)
    weights, beyond = errors.parseval_weights(off.shape[-1]), people.beyond(person, VIEWS, setting.harmonics)
    square = off**2 @ weights + beyond
    return square.mean(), np.moveaxis(np.abs(error) / sd, 1, -1)


def _curve(
    people: People, settings: dict[str, Setting], person: int, order: np.ndarray
) -> list[dict[str, object]]:
    """Errors of one person by what ever more people tell: as many as everybody has."""
    rows: list[dict[str, object]] = []
    sources = people.model.sources[order]
    for kind, (allowed, most) in _drawn_from(people.model.sources, person, order).items():
        for count in (n for n in CURVE if n <= most):
            kept = order[allowed][:count]
            fold = people.fold(*np.setdiff1d(np.arange(people.count), kept).tolist())
            unused = "anybody" if kind == "person" else "anatomical"
            methods = {m: s for m, s in settings.items() if m != unused}
            found = errors_of(people, fold, methods, person, VIEWS).mean(axis=(1, 2))
            key = {
                "person": str(people.model.people[person]),
                "left_out": kind,
                "people": count,
                "laboratories": len(np.unique(sources[allowed][:count])),
                "spanned_percent": 100.0 * _spanned(people, kept, person),
            }
            rows += [
                {**key, "method": method, "absolute_error_mm2": error}
                for method, error in zip(methods, found, strict=True)
            ]
    return rows


def _drawn_from(sources: np.ndarray, person: int, order: np.ndarray) -> dict[str, tuple[np.ndarray, int]]:
    """Who may be learnt from, in a random order, (P,) bool; and how many everybody has of that kind.

    Without the person, or the laboratory; and of one other laboratory alone, the largest, where there are several.
    """
    names, counts = np.unique(sources, return_counts=True)
    size = dict(zip(names, counts, strict=True))
    largest = sorted(size, key=lambda name: (-size[name], name))
    mine = sources[person]
    one = next(name for name in largest if name != mine)
    kinds = {
        "person": (order != person, len(sources) - 1),
        "laboratory": (sources[order] != mine, len(sources) - size[largest[0]]),
    }
    if len(largest) > 2:
        kinds["all but one other laboratory"] = (sources[order] == one, size[largest[1]])
    return kinds


def _spanned(people: People, kept: np.ndarray, person: int) -> float:
    """Share of what two harmonics of a person differ from the mean of others by that lies in the span of these."""
    walkers = linear_model.flatten(np.stack([people.walker(n)[:5] for n in (*kept, person)]))
    centred = walkers[:-1] - walkers[:-1].mean(axis=0)
    own = walkers[-1] - walkers[:-1].mean(axis=0)
    directions = np.linalg.svd(centred, full_matrices=False)[2][: len(kept) - 1]
    return ((directions @ own) ** 2).sum() / (own**2).sum()
