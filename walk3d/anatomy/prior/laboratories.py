"""Walkers of a laboratory that a prior was not learnt from: joints lie elsewhere, people are of another size.

Symbols
-------
``o_g``      standard deviation, over pairs of laboratories, of how far apart they put a joint of group g, mm per axis
``s``        that of the size of their people, as a share
``omega_l``  weight of laboratory l among the training walks
``J_g``      on the constant coefficients of the joints of group g one, and between a joint and its mirror image, which
             lies as far forwards, up and outwards; zero elsewhere
``L``        ``sum_l omega_l² (sum_g o_g² J_g + s² m m^T)``, covariance of what sets a new laboratory's walker apart
``C'``       ``C + L``; with k people known in 3D, of mean y, and half of L in common to all people of the laboratory:
             mean ``m + G (y - m)``, covariance ``C + L - G L/2``, ``G = L/2 (L/2 + (C + L/2)/k)^-1``

A laboratory's offset has half the variance of a difference, B.  The new offset differs from the mean of the training
ones by ``B (1 + sum omega²)``, of which the training walks show ``B (1 - sum omega²)``: what they lack is
``2 B sum omega²``, everything for one laboratory and ever less as laboratories are added.  Positions are about the mean
pelvis, which therefore has no offset.
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

WORTH = 4.0
"""Contrasts between laboratories that what is assumed of them counts as, beside those that are measured."""
COMMON = 0.5
"""Share of L that all people of a laboratory have in common; the rest is each one's own, as markers are placed anew."""
_PLACED = np.array([joint != "pelvis" for joint in WALKER15.joints])
_OUTWARDS = np.array([-1.0 if joint.startswith("left") else 1.0 for joint in WALKER15.joints])


@dataclass(frozen=True, kw_only=True)
class Differences:
    """How two laboratories differ.

    Attributes
    ----------
    offset_mm : tuple of float
        o_g of each of `GROUPS`: landmarks are found again within 6 to 25 mm by another examiner, centres of hips within
        25 to 30 mm by another rule (Della Croce 2005 and Leardini 2005, Gait & Posture 21).
    size : float
        s; sizes from 1.2 to 1.8 m, of children and adults alike, have 0.1.
    """

    offset_mm: tuple[float, ...] = (25.0,) * len(GROUPS)
    size: float = 0.1


def concentration(weights: np.ndarray, laboratories: np.ndarray) -> float:
    """Sum of squares of the laboratories' weights: one over how many laboratories there are in effect.

    Examples
    --------
    >>> concentration(np.array([0.25, 0.25, 0.5]), np.array(["a", "a", "b"]))
    0.5
    """
    _, of = np.unique(laboratories, return_inverse=True)
    return min(float((np.bincount(of, weights) ** 2).sum()), 1.0)


def definitions(differences: Differences = Differences(), *, across: bool = True) -> np.ndarray:
    """Covariance (15, 3, 15, 3) of how far two laboratories put joints apart, mm²: alike on both sides.

    Without `across`, forwards and up alone, where a definition turns limbs in the plane of progression, or moves joints
    along them: films of five laboratories, left out in turn, were reconstructed worse with it.
    """
    offset = np.array(differences.offset_mm)[GROUP_OF_JOINT] * _PLACED
    alike = np.eye(JOINTS)
    alike = np.maximum(alike, alike[list(WALKER15.mirror)]) * np.outer(offset, offset)
    sideways = across * alike * np.outer(_OUTWARDS, _OUTWARDS)
    return np.einsum("ajk,ab->jakb", np.stack([sideways, alike, alike]), np.eye(3))


def unfamiliar(
    prior: Prior, differences: Differences, share: float = 1.0, known: Sequence[np.ndarray] = ()
) -> Prior:
    """Return the prior of a walker of a laboratory that is not among the training walks.

    Parameters
    ----------
    prior : Prior
    differences : Differences
    share : float
        As `concentration` gives it.
    known : sequence of (1 + 2H, 15, 3)
        Walks of other people of that laboratory, one to each, about the mean pelvis, mm: they fix most of what sets
        the laboratory apart.

    Notes
    -----
    Bones turn in the cycle about joints that lie elsewhere, so that their lengths are less constant, too: each joint's
    own offset has half the variance of a difference.  They are so where the offset is known, too.
    """
    offset = np.array(differences.offset_mm)[GROUP_OF_JOINT]
    mean = prior.mean.ravel()
    C = prior.covariance.reshape(mean.size, mean.size)
    constant = np.zeros((*prior.mean.shape, *prior.mean.shape))
    constant[:, :, 0, :, :, 0] = definitions(differences)
    L = share * (constant.reshape(C.shape) + differences.size**2 * np.outer(mean, mean))
    own = 0.5 * share * (offset[_PLACED] ** 2).mean()
    if len(known):
        alike, own_ways = COMMON * L, (1.0 - COMMON) * L
        gain = cho_solve(cho_factor(alike + (C + own_ways) / len(known)), alike).T
        mean = mean + gain @ (by_joint(np.stack(known)).reshape(len(known), -1).mean(axis=0) - mean)
        L = own_ways + alike - gain @ alike
    return replace(
        prior,
        mean=mean.reshape(prior.mean.shape),
        covariance=(C + L).reshape(prior.covariance.shape),
        definition_variance=prior.definition_variance + own,
    )


def learn_differences(
    coefficients: np.ndarray,
    people: np.ndarray,
    laboratories: np.ndarray,
    assumed: Differences,
    *,
    worth: float = WORTH,
) -> Differences:
    """Learn how laboratories differ as random effects, shrunken towards what is assumed.

    Parameters
    ----------
    coefficients : (R, 1 + 2H, 15, 3)
        Fourier representations about the mean pelvis, mm.
    people, laboratories : (R,)
    assumed : Differences
        What is returned if there is one laboratory, or none with two people.
    worth : float
        Number of contrasts between laboratories of many people that the assumption counts as.

    Notes
    -----
    By moments, as DerSimonian and Laird do: the variance of the laboratories' means less what the people of each, drawn
    anew, would make of it.  A laboratory counts by how much of the variance of its mean is its own, if the assumption
    holds.  Left and right are taken together, as mirror images among training walks do.
    """
    constant = (coefficients[:, 0] + fourier.mirrored(coefficients)[:, 0]) / 2.0
    who, first = np.unique(people, return_index=True)
    of_person = np.stack([constant[people == person].mean(axis=0) for person in who])
    names, of, counts = np.unique(laboratories[first], return_inverse=True, return_counts=True)
    if len(names) < 2 or counts.max() < 2:
        return assumed
    average = of_person.mean(axis=0)
    size = np.einsum("pjk,jk->p", of_person, average) / (average**2).sum()
    offset = of_person - size[:, None, None] * average

    def learnt(values: np.ndarray, before: float) -> float:
        """Standard deviation of a difference between laboratories, of values (P, n) that have it in common."""
        means = np.stack([values[of == number].mean(axis=0) for number in range(len(names))])
        drawn = ((values - means[of]) ** 2).sum(axis=0).mean() / (len(who) - len(names)) / counts
        own = 0.5 * before**2 / np.maximum(0.5 * before**2 + drawn, np.finfo(float).tiny)
        if own.sum() <= 1.0:
            return before
        spread = (own @ (means - own @ means / own.sum()) ** 2).mean()
        by_chance = own @ drawn - own**2 @ drawn / own.sum()
        between = max((spread - by_chance) / (own.sum() - (own**2).sum() / own.sum()), 0.0)
        contrasts = own.sum() - 1.0
        return np.sqrt((worth * before**2 + contrasts * 2.0 * between) / (worth + contrasts))

    groups = [_PLACED & (number == GROUP_OF_JOINT) for number in range(len(GROUPS))]
    return Differences(
        offset_mm=tuple(
            learnt(offset[:, group].reshape(len(who), -1), before)
            for group, before in zip(groups, assumed.offset_mm, strict=True)
        ),
        size=learnt(size[:, None], assumed.size),
    )
