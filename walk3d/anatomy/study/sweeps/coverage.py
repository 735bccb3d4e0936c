"""Coverage of the error bars of every method, as computed and as calibrated on other people."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import ndtri

from pipeline.core import linear_model
from pipeline.processes import map_processes
from pipeline.studies.study import Sweep, scaled
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.study.model import AnatomicalInputs
from walk3d.anatomy.study.sweeps.held_out import (
    BARS,
    NOISE_VARIANCES_MM2,
    PARTNERS,
    PHASES,
    Choosers,
    MirroredViews,
    People,
)
from walk3d.anatomy.study.sweeps.setting import anatomical_setting, approach_two

METHODS = ("least_squares", "map_70", "map_tuned", "anatomical")
COMPONENTS = 30
"""Number of eigenwalkers for reconstruction by least squares [zhang2007 4.1]."""
SAMPLE_VIEW_DEG, SAMPLES = 30.0, 12
"""View angle, degrees, at which the posterior is sampled, and number of samples."""
_MIN_SD_MM = 1e-6
LEVELS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99])
LEVEL_95 = 10
"""Index of the level of 95 % in `LEVELS`, the levels of the error bars."""


@dataclass(frozen=True)
class Bars:
    """Coverage and half-widths of the error bars of every method, in the missing dimension.

    Attributes
    ----------
    levels, views, joints : DataFrame
        Coverage and half width by person, method, kind of bars and level; of 95 % bars by view; and by group of joints.
    sample_person : int
        Person whose posterior is sampled: the one with the median error.
    estimate : (1 + 2H, 15)
        Estimated missing dimension of that person.
    samples : (N, 1 + 2H, 15)
        Samples of the posterior.
    """

    levels: pd.DataFrame
    views: pd.DataFrame
    joints: pd.DataFrame
    sample_person: int
    estimate: np.ndarray
    samples: np.ndarray


class Coverage(Sweep):
    """Sweep over known view angles that compares the error bars of several methods with their errors."""

    draws_random_numbers = True

    seen_from_deg: MirroredViews = scaled(start=-90, stop=90, step={"full": 6, "smoke": 90})  # true views
    partners: Choosers = scaled(value=PARTNERS)  # number of other people for the selection of sigma² of MAP

    def measure(self, inputs: AnatomicalInputs) -> Bars:
        """Return the coverage and the half-widths of every method's error bars."""
        view_deg = self.seen_from_deg.values("sweep.seen_from_deg")
        view = np.radians(view_deg)
        people = People(inputs.dataset, inputs.model)
        whole = anatomical_setting(inputs.model_options, people.harmonics)
        tuned = people.tuned_map(NOISE_VARIANCES_MM2, self.partners, inputs.workers)

        def person_errors(person: int) -> tuple[np.ndarray, np.ndarray]:
            fold = people.fold(person)
            settings = (approach_two(70.0), tuned[person], whole)
            bars = [fold.bars(setting, person, view)[1:] for setting in settings]
            errors, deviations = zip(least_squares_bars(people, person, view), *bars, strict=True)
            return np.stack(errors), np.maximum(np.stack(deviations), _MIN_SD_MM)

        folds = map_processes(person_errors, range(people.count), inputs.workers)
        error = np.abs([fold[0] for fold in folds]).swapaxes(0, 1)  # (M, P, A, 15, K)
        deviation = np.stack([fold[1] for fold in folds], axis=1)
        squares = (error**2).mean(axis=(2, 3, 4))
        rows: dict[str, list[dict[str, object]]] = {"levels": [], "views": [], "joints": []}

        def add(name: str, error: np.ndarray, half: np.ndarray, **keys: object) -> None:
            """Add a table row for each of P people with the coverage and width of error bars."""
            covered = (error <= half).reshape(people.count, -1).mean(axis=1)
            for p, who in enumerate(inputs.model.people):
                cells = {"covered_percent": 100.0 * covered[p], "half_width_mm": half[p].mean()}
                rows[name].append({"person": who, **keys, **cells})

        for m, method in enumerate(METHODS):
            off, sd = error[m], deviation[m]
            z = np.moveaxis(off / sd, 2, -1)  # (P, A, K, 15)
            learnt = anatomical.multipliers_without(z, anatomical.GROUP_OF_JOINT, LEVELS)
            textbook = np.broadcast_to(ndtri(0.5 + LEVELS / 2.0), learnt.shape)
            for kind, multipliers in zip(BARS, (textbook, learnt), strict=True):
                halves = multipliers[:, anatomical.GROUP_OF_JOINT][:, None, :, None] * sd[..., None]
                keys = {"method": method, "bars": kind}
                for number, level in enumerate(LEVELS):
                    add("levels", off, halves[..., number], **keys, level_percent=100.0 * level)
                half = halves[..., LEVEL_95]
                for a, view_angle_deg in enumerate(view_deg):
                    add("views", off[:, a], half[:, a], **keys, view_angle_deg=view_angle_deg)
                for g, group in enumerate(anatomical.GROUPS):
                    members = g == anatomical.GROUP_OF_JOINT
                    add("joints", off[:, :, members], half[:, :, members], **keys, joint_group=group)
        frames = {name: pd.DataFrame(cells) for name, cells in rows.items()}
        rms = pd.DataFrame(np.sqrt(squares).T, index=inputs.model.people, columns=list(METHODS)).stack()
        person = int(np.argsort(squares[-1], kind="stable")[people.count // 2])
        return Bars(
            levels=frames.pop("levels").join(rms.rename("rms_error_mm"), on=["person", "method"]),
            **frames,
            sample_person=person,
            **self._sampled(people, person, inputs),
        )

    def _sampled(
        self,
        people: People,
        person: int,
        inputs: AnatomicalInputs,
    ) -> dict[str, np.ndarray]:
        """Return a person's reconstructed missing dimension (1 + 2H, 15), and N samples of its posterior."""
        setting = anatomical_setting(inputs.model_options, people.harmonics)
        (estimate,) = people.fold(person).reconstruct(
            [setting], people.walker(person)[None], np.radians([SAMPLE_VIEW_DEG]), with_covariance=True
        )
        factor = np.linalg.cholesky(estimate.covariance[0, 0])
        drawn = inputs.generator("posterior samples").standard_normal((SAMPLES, len(factor)))
        rows = np.concatenate([estimate.estimated[0], estimate.estimated[0, 0] + drawn @ factor.T])
        missing = rows.reshape(len(rows), -1, 1 + 2 * setting.harmonics).swapaxes(1, 2)
        return {"estimate": missing[0], "samples": missing[1:]}


def least_squares_bars(people: People, person: int, view: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return errors and standard deviations (A, 15, K), mm, of reconstructions by least squares (approach I).

    The covariance is the residual variance times (E^T E)^-1.
    """
    tested = people.model.tested
    others = np.delete(tested, person)
    rows = anatomical.by_joint(people.data.coefficients[others][:, :5]).reshape(len(others), -1)
    model = linear_model.fit(rows, COMPONENTS)
    shape = (anatomical.JOINTS, 3, 5)
    components = model.components.reshape(-1, *shape)
    off = anatomical.by_joint(people.walker(person)[:5]) - model.mean.reshape(shape)
    whole = people.missing(person, view)
    errors, deviations = [], []
    for a, axes in enumerate(anatomical.image_axes(view)):
        E = np.einsum("ij,nkjb->ikbn", axes, components).reshape(3, -1, len(components))
        d = np.einsum("ij,kjb->ikb", axes, off).reshape(3, -1)
        visible = E[:2].reshape(-1, len(components))
        observed = d[:2].ravel()
        Q, R = np.linalg.qr(visible)
        k = np.linalg.solve(R, Q.T @ observed)
        residual = observed - visible @ k
        variance = residual @ residual / max(len(observed) - len(k), 1)
        spread = np.linalg.solve(R.T, E[2].T)  # E (E^T E)^-1 E^T = spread^T spread
        error = np.concatenate([(d[2] - E[2] @ k).reshape(-1, 5), whole[a][:, 5:]], axis=-1)
        errors.append(anatomical.at_instants(error, PHASES))
        deviations.append(anatomical.deviation_at_instants(variance * spread.T @ spread, 5, PHASES))
    return np.stack(errors), np.stack(deviations)
