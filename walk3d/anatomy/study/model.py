"""The prior of walkers with what anatomy adds: mirror images, constant bones, left and right alike."""

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
    """The prior of the whole population, and which walk of each person is reconstructed.

    Attributes
    ----------
    prior : Prior
    people, sources : (P,) text
    tested : (P,) int
        Sample of each person that is reconstructed: the walk that two harmonics describe best.
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
    """Mean and covariance of all walks of all people, with mirror images and shrinkage, and tolerances of bones."""

    dataset = FourierDataset

    mirror: bool = True  # also learn from mirror images
    within_harmonic: Share = (
        0.2  # share of the covariance that is kept among coefficients of one harmonic alone
    )
    diagonal: Share = 0.1  # share that is kept of each coefficient by itself
    extra_variance_mm2: Positive = 20.0  # added to each coefficient
    noise_variance_mm2: Positive = 100.0  # of the observed coefficients
    noise_share: Share = 0.2  # of the covariance, added to the noise
    length_factor: Positive = 1.5  # on the standard deviation of a bone's length within the cycle
    pair_factor: Positive = 2.0  # on that of the difference between left and right

    @property
    def shrinkage(self) -> Shrinkage:
        """How the sample covariance is changed."""
        return Shrinkage(
            mirror=self.mirror,
            within_harmonic=self.within_harmonic,
            diagonal=self.diagonal,
            extra_variance=self.extra_variance_mm2,
        )

    @property
    def noise(self) -> Noise:
        """What observed coefficients are off by."""
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
                "error bars and bones need walks of which every joint was measured",
                str(dataset.clip[walk]),
                "data.pattern= that leaves it out",
                f"no {', '.join(joints)}",
                code="joints_not_measured",
                joints=joints,
            )
        if (count := len(np.unique(dataset.person))) < 4:
            raise InvalidInput(
                "settings chosen without a person need at least four people",
                expected="4 or more",
                received=count,
                code="too_few_people",
                count=count,
            )
        return self.population(dataset)

    def population(self, dataset: FourierSamples) -> AnatomicalWalkers:
        """Return the prior of all people, and of each the walk that two harmonics describe best."""
        if dataset.frequency:
            raise InvalidInput(
                "the anatomical prior has no frequency",
                "dataset.frequency",
                "false",
                code="frequency_not_modelled",
            )
        people = np.array(list(dict.fromkeys(dataset.person)))
        left = 1.0 - dataset.variance_fractions[:, :2].sum(axis=1)
        walks = [np.flatnonzero(dataset.person == person) for person in people]
        tested = np.array([of[np.argmin(left[of])] for of in walks])
        prior = fit(dataset.coefficients, person_weights(dataset.person), self.shrinkage)
        return AnatomicalWalkers(
            prior=prior,
            people=people,
            sources=dataset.source[tested],
            tested=tested,
            words=f"{dataset.coefficients.shape[1] // 2} harmonics",
            remarks=[],
        )
