"""Average walker and eigenwalkers of all walkers, and without each person: zhang2007 3.3, zhang2004 section 3."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from pipeline.core import fourier, linear_model
from pipeline.core.linear_model import LinearModel
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples
from pipeline.studies.study import Model, part, stack
from pipeline.validation import Count, InvalidInput, Positive

BLOCK = 64
"""Number of leave-one-person-out models that are computed together."""

Divisor = StrEnum("Divisor", {"R-1": "R-1", "R": "R"})
Divisor.__doc__ = """Divisor of the covariance, which the papers do not state."""


@dataclass(frozen=True)
class Eigenwalkers:
    """Linear model of all walkers, and one linear model for each walker without that walker's person.

    Attributes
    ----------
    samples : (R, D)
        Training samples: flattened Fourier representations.
    mean : (D,)
    components : (K, D)
    eigenvalues : (K,)
        Eigenvalues of the whole population, for all its components.
    total_variance : float
    folds : LinearModel
        Models without each walker, stacked.
    words, remarks : str, list of str
    """

    samples: np.ndarray
    mean: np.ndarray
    components: np.ndarray
    eigenvalues: np.ndarray
    total_variance: float
    folds: LinearModel
    words: str
    remarks: list[str]

    def fold(self, walker: int) -> LinearModel:
        """Return the model that is learnt without the person of one walker."""
        return part(self.folds, walker)

    @property
    def kept(self) -> int:
        """Number of eigenwalkers in each leave-one-person-out model."""
        return self.folds.components.shape[1]


class EigenwalkersModel(Model):
    """Options of the average walker and the eigenwalkers."""

    dataset = FourierDataset

    components: Count = 30  # number of eigenwalkers
    divisor: Divisor = Divisor["R-1"]
    mirror: bool = False  # also learn from mirror images
    prior: str = ""  # also compare a method that brings a model of other people, e.g. of a plug-in
    omega_scale_mm: Positive | None = 1.0  # null: equal to the mean variance of the other numbers

    def training(self, dataset: FourierSamples) -> tuple[np.ndarray, dict[str, Any]]:
        """Return the walkers as rows (R, D), and the options for learning with `linear_model.leave_one_out`."""
        rate = dataset.frequency_hz if dataset.frequency else None
        samples = linear_model.flatten(dataset.coefficients, rate)
        mirrors = linear_model.flatten(fourier.mirrored(dataset.coefficients), rate) if self.mirror else None
        scale_last = self.omega_scale_mm if dataset.frequency else 1.0
        return samples, {"mirrors": mirrors, "divisor": self.divisor.value, "scale_last": scale_last}

    def learn(self, dataset: FourierSamples, *, workers: int) -> Eigenwalkers:
        """Return the model of all walkers and the leave-one-person-out models."""
        samples, how = self.training(dataset)
        mirrors = how["mirrors"]
        people = len(np.unique(dataset.person))
        if people < 3:
            raise InvalidInput(
                "leave-one-out needs at least three walkers",
                expected="3 or more",
                received=people,
                code="too_few_people",
                count=people,
            )
        population = samples if mirrors is None else np.concatenate([samples, mirrors])
        overall = linear_model.fit(
            population, len(population), divisor=how["divisor"], scale_last=how["scale_last"]
        )
        blocks = [range(start, min(start + BLOCK, len(samples))) for start in range(0, len(samples), BLOCK)]

        def held_out(block: range) -> list[LinearModel]:
            models = linear_model.leave_one_out(
                samples, self.components, groups=dataset.person, only=block, **how
            )
            return [model for model, _ in models]

        folds = [fold for block in map_processes(held_out, blocks, workers) for fold in block]
        count = min(len(fold.eigenvalues) for fold in folds)
        fewer = count < self.components
        remark = (
            f"{count} eigenwalkers instead of {self.components}: leave-one-out has only"
            f" {people - 1} people to learn from"
        )
        return Eigenwalkers(
            samples=samples,
            mean=overall.mean,
            components=overall.components,
            eigenvalues=overall.eigenvalues,
            total_variance=float(overall.total_variance),
            folds=stack([linear_model.truncated(fold, count) for fold in folds]),
            words=f"{count} eigenwalkers" + (f" (of {self.components} asked for)" if fewer else ""),
            remarks=[remark] if fewer else [],
        )
