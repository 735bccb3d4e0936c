"""Prior for walkers of a laboratory outside the training data, which may differ in joint definitions and body sizes.

Symbols
-------
``o_g``      standard deviation, over pairs of laboratories, of the offset between their joints of group g, mm per axis
``s``        standard deviation of the difference in body size, as a share
``omega_l``  weight of laboratory l among the training walks
``J_g``      1 for the constant coefficients of the joints of group g, and between a joint and its mirror image, whose
             offset is the same forwards, up and outwards; 0 elsewhere
``L``        ``sum_l omega_l² (sum_g o_g² J_g + s² m m^T)``, covariance of the difference of a new laboratory's walker
``C'``       ``C + L``; with k people known in 3D, of mean y, and half of L common to all people of the laboratory:
             mean ``m + G (y - m)``, covariance ``C + L - G L/2``, ``G = L/2 (L/2 + (C + L/2)/k)^-1``

The offset of a laboratory has half the variance of a difference, B.  The new offset differs from the mean of the
training offsets with variance ``B (1 + sum omega²)``.  The training walks contain ``B (1 - sum omega²)`` of it and lack
``2 B sum omega²``, which decreases as laboratories are added.  Positions are relative to the mean pelvis, which
therefore has no offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from pipeline.core import fourier
from pipeline.skeleton import WALKER15
from walk3d.anatomy.prior.bars import GROUP_OF_JOINT, GROUPS
from walk3d.anatomy.prior.prior import JOINTS, Prior, by_joint

ASSUMED_CONTRASTS = 4.0
"""Weight of the assumed differences between laboratories, as an equivalent number of observed differences."""
COMMON = 0.5
"""Share of the difference between laboratories that all people of one laboratory have in common.

The rest varies between people with the placement of markers.
"""
_HAS_OFFSET = np.array([joint != "pelvis" for joint in WALKER15.joints])
_OUTWARDS = np.array([-1.0 if joint.startswith("left") else 1.0 for joint in WALKER15.joints])


@dataclass(frozen=True, kw_only=True)
class Differences:
    """Standard deviations of the differences between two laboratories in joint positions and in body size.

    Attributes
    ----------
    offset_mm : tuple of float
        o_g of each of `GROUPS`.  Two examiners place landmarks 6 to 25 mm apart; two rules place hip centres 25 to 30
        mm apart (Della Croce 2005 and Leardini 2005, Gait & Posture 21).
    size : float
        s; 0.1 covers body heights from 1.2 to 1.8 m, of children and adults.
    """

    offset_mm: tuple[float, ...] = (25.0,) * len(GROUPS)
    size: float = 0.1


def concentration(weights: np.ndarray, laboratories: np.ndarray) -> float:
    """Return the sum of the squared weights of laboratories, which is the inverse of their effective number.

    Examples
    --------
    >>> concentration(np.array([0.25, 0.25, 0.5]), np.array(["a", "a", "b"]))
    0.5
    """
    _, laboratory = np.unique(laboratories, return_inverse=True)
    return min(float((np.bincount(laboratory, weights) ** 2).sum()), 1.0)


def definitions(differences: Differences = Differences(), *, across: bool = True) -> np.ndarray:
    """Return the covariance (15, 3, 15, 3), mm², of the offsets of joints between two laboratories.

    The offsets of the left and the right side are mirror images.

    Without `across`, offsets are only forwards and up: they turn limbs in the plane of progression, or move joints
    along them.  Films of five laboratories, left out in turn, were reconstructed worse with `across`.
    """
    offset = np.array(differences.offset_mm)[GROUP_OF_JOINT] * _HAS_OFFSET
    alike = np.eye(JOINTS)
    alike = np.maximum(alike, alike[list(WALKER15.mirror)]) * np.outer(offset, offset)
    sideways = across * alike * np.outer(_OUTWARDS, _OUTWARDS)
    return np.einsum("ajk,ab->jakb", np.stack([sideways, alike, alike]), np.eye(3))


def unfamiliar(
    prior: Prior, differences: Differences, share: float = 1.0, known: Sequence[np.ndarray] = ()
) -> Prior:
    """Return the prior for a walker whose laboratory is not among the training walks.

    Parameters
    ----------
    prior : Prior
    differences : Differences
    share : float
        Result of `concentration` for the training walks.
    known : sequence of (1 + 2H, 15, 3)
        One walk for each of some other people of that laboratory, relative to the mean pelvis, mm.  They determine most
        of the laboratory's difference.

    Notes
    -----
    Joints with an offset make bone lengths less constant over the cycle, even where the offset is known.  The offset of
    each joint has half the variance of a difference.
    """
    offset = np.array(differences.offset_mm)[GROUP_OF_JOINT]
    mean = prior.mean.ravel()
    C = prior.covariance.reshape(mean.size, mean.size)
    constant = np.zeros((*prior.mean.shape, *prior.mean.shape))
    constant[:, :, 0, :, :, 0] = definitions(differences)
    L = share * (constant.reshape(C.shape) + differences.size**2 * np.outer(mean, mean))
    definition_variance = 0.5 * share * (offset[_HAS_OFFSET] ** 2).mean()
    if len(known):
        common, individual = COMMON * L, (1.0 - COMMON) * L
        gain = cho_solve(cho_factor(common + (C + individual) / len(known)), common).T
        mean = mean + gain @ (by_joint(np.stack(known)).reshape(len(known), -1).mean(axis=0) - mean)
        L = individual + common - gain @ common
    return replace(
        prior,
        mean=mean.reshape(prior.mean.shape),
        covariance=(C + L).reshape(prior.covariance.shape),
        definition_variance=prior.definition_variance + definition_variance,
    )


def learn_differences(
    coefficients: np.ndarray,
    people: np.ndarray,
    laboratories: np.ndarray,
    assumed: Differences,
    *,
    worth: float = ASSUMED_CONTRASTS,
) -> Differences:
    """Estimate the differences between laboratories as random effects, shrunken towards assumed differences.

    Parameters
    ----------
    coefficients : (R, 1 + 2H, 15, 3)
        Fourier representations relative to the mean pelvis, mm.
    people, laboratories : (R,)
    assumed : Differences
        Assumed differences, returned if there is one laboratory, or none has two people.
    worth : float
        Weight of the assumption, as a number of contrasts between laboratories with many people.

    Notes
    -----
    Method of moments of DerSimonian and Laird: variance of the laboratories' means, less the part that the sampling of
    people explains.  The weight of a laboratory is the share of its mean's variance that is due to the laboratory, if
    the assumption holds.  Left and right are averaged, as with mirror images among the training walks.
    """
    constant = (coefficients[:, 0] + fourier.mirrored(coefficients)[:, 0]) / 2.0
    who, first = np.unique(people, return_index=True)
    of_person = np.stack([constant[people == person].mean(axis=0) for person in who])
    names, laboratory, counts = np.unique(laboratories[first], return_inverse=True, return_counts=True)
    if len(names) < 2 or counts.max() < 2:
        return assumed
    average = of_person.mean(axis=0)
    size = np.einsum("pjk,jk->p", of_person, average) / (average**2).sum()
    offset = of_person - size[:, None, None] * average

    def deviation_of(values: np.ndarray, before: float) -> float:
        """Return the standard deviation of the difference between laboratories in n quantities of P people.

        The values are (P, n), and the standard deviation is pooled over the n quantities.
        """
        means = np.stack([values[laboratory == number].mean(axis=0) for number in range(len(names))])
        sampling = ((values - means[laboratory]) ** 2).sum(axis=0).mean() / (len(who) - len(names)) / counts
        reliability = 0.5 * before**2 / np.maximum(0.5 * before**2 + sampling, np.finfo(float).tiny)
        if reliability.sum() <= 1.0:
            return before
        spread = (reliability @ (means - reliability @ means / reliability.sum()) ** 2).mean()
        by_chance = reliability @ sampling - reliability**2 @ sampling / reliability.sum()
        between = max(
            (spread - by_chance) / (reliability.sum() - (reliability**2).sum() / reliability.sum()), 0.0
        )
        contrasts = reliability.sum() - 1.0
        return np.sqrt((worth * before**2 + contrasts * 2.0 * between) / (worth + contrasts))

    groups = [_HAS_OFFSET & (number == GROUP_OF_JOINT) for number in range(len(GROUPS))]
    return Differences(
        offset_mm=tuple(
            deviation_of(offset[:, group].reshape(len(who), -1), before)
            for group, before in zip(groups, assumed.offset_mm, strict=True)
        ),
        size=deviation_of(size[:, None], assumed.size),
    )
