"""Model of walkers with the anatomical prior, which uses mirror images and bones of constant, symmetric length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples
from pipeline.studies.study import Model, SweepInputs
from pipeline.validation import InvalidInput, Positive, Share, require_range
from walk3d.anatomy.prior import Noise, Prior, Shrinkage, fit, person_weights


@dataclass(frozen=True)
class AnatomicalWalkers:
    """Prior of the whole population, and the tested walk of each person.

    Attributes
    ----------
    prior : Prior
    people, sources : (P,) text
    tested : (P,) int
        Number of each person's sample for reconstruction: the walk that two harmonics describe best.
    words, remarks : str, list of str
    """

    prior: Prior
    people: np.ndarray
    sources: np.ndarray
    tested: np.ndarray
    words: str
    remarks: list[str]


AnatomicalInputs = SweepInputs[object, FourierSamples, AnatomicalWalkers]


class AnatomicalModel(Model):
    """Mean and covariance of all walks of all people, with mirror images, shrinkage and bone tolerances."""

    dataset = FourierDataset

    mirror: bool = True  # also train on mirror images
    within_harmonic: Share = (
        0.2  # share of the covariance that is restricted to coefficients of the same harmonic
    )
    diagonal: Share = 0.1  # share of the covariance that is restricted to its diagonal
    extra_variance_mm2: Positive = 20.0  # variance that is added to each coefficient
    noise_variance_mm2: Positive = 100.0  # noise of the observed coefficients
    noise_share: Share = 0.2  # share of a coefficient's variance that is added to the noise
    length_factor: Positive = 1.5  # factor on the standard deviation of a bone's length within the cycle
    pair_factor: Positive = 2.0  # factor on that of the difference between left and right

    @property
    def shrinkage(self) -> Shrinkage:
        """Shrinkage of the sample covariance."""
        return Shrinkage(
            mirror=self.mirror,
            within_harmonic=self.within_harmonic,
            diagonal=self.diagonal,
            extra_variance=self.extra_variance_mm2,
        )

    @property
    def noise(self) -> Noise:
        """Noise of the observed coefficients."""
        return Noise(variance=self.noise_variance_mm2, share=self.noise_share)

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_range("model.diagonal", self.diagonal, at_most=1.0 - self.within_harmonic)

    def learn(self, dataset: FourierSamples, *, workers: int) -> AnatomicalWalkers:
        """Return the prior of the whole population."""
        if dataset.unmeasured.any():
            walk = np.flatnonzero(dataset.unmeasured.any(axis=1))[0]
            joints = [WALKER15.joints[j] for j in np.flatnonzero(dataset.unmeasured[walk])]
            raise InvalidInput(
                "error bars and bone lengths need a walk in which every joint was measured",
                str(dataset.clip[walk]),
                "a data.pattern that does not match this clip",
                f"no {', '.join(joints)}",
                code="joints_not_measured",
                joints=joints,
            )
        if (count := len(np.unique(dataset.person))) < 4:
            raise InvalidInput(
                "selecting settings on other people needs at least four people",
                expected="4 or more",
                received=count,
                code="too_few_people",
                count=count,
            )
        return self.population(dataset)

    def population(self, dataset: FourierSamples) -> AnatomicalWalkers:
        """Return the prior of all people, and the walk of each person that two harmonics describe best."""
        if dataset.frequency:
            raise InvalidInput(
                "the anatomical prior does not model the stride frequency",
                "dataset.frequency",
                "false",
                code="frequency_not_modelled",
            )
        people = np.array(list(dict.fromkeys(dataset.person)))
        left = 1.0 - dataset.variance_fractions[:, :2].sum(axis=1)
        walks = [np.flatnonzero(dataset.person == person) for person in people]
        tested = np.array([numbers[np.argmin(left[numbers])] for numbers in walks])
        prior = fit(dataset.coefficients, person_weights(dataset.person), self.shrinkage)
        return AnatomicalWalkers(
            prior=prior,
            people=people,
            sources=dataset.source[tested],
            tested=tested,
            words=f"{dataset.coefficients.shape[1] // 2} harmonics",
            remarks=[],
        )
