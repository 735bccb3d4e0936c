"""Held-out people, models trained without them, and reconstructions of their walks from many views.

A prior with mirror images is symmetric.  A walker and its mirror image, both seen from the right, are therefore
equivalent to the walker seen from both sides, and half of the views are enough.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from pipeline.core import errors, fourier
from pipeline.core.choice import first_lowest
from pipeline.processes import map_processes
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Grid
from pipeline.validation import InvalidInput, Several, require_range
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import Conditional, Prior
from walk3d.anatomy.study.model import AnatomicalWalkers
from walk3d.anatomy.study.sweeps.setting import Setting, approach_two

CANDIDATES = 72
"""Number of angles on the full circle at which the likelihood of the view angle is computed."""
PHASES = 8
"""Number of instants of the gait cycle at which error bars are compared with errors."""

BARS = ("as computed", "calibrated")
"""Kinds of error bars: those of a normal distribution, and those scaled by calibration on other people."""
NOISE_VARIANCES_MM2 = (70.0, 150.0, 300.0, 500.0, 700.0, 1000.0, 1500.0)
"""Candidate values of sigma² for MAP, mm².

The study of hidden joints leaves out the first and the last value.
"""

NORMAL_95 = 1.959963984540054
"""Half-width of the 95 % interval of a normal distribution, in standard deviations."""

CHOOSING_VIEWS_DEG = (0.0, 30.0, 60.0, 90.0)
"""View angles, degrees, at which the settings of the methods are selected.

Each pair of people is tested at one of these angles.

Views from the right suffice, because the prior is symmetric.
"""


@dataclass(frozen=True)
class Estimate:
    """True and estimated unknown coefficients of M walkers in A views, in image axes, with their covariance.

    Attributes
    ----------
    true, estimated : (A, M, U)
        Coefficients, mm.
    covariance : (A, M, U, U)
        Posterior covariance, mm²; empty unless requested.
    unknown : (45 B,) bool
        Mask of the unknown coefficients.
    """

    true: np.ndarray
    estimated: np.ndarray
    covariance: np.ndarray
    unknown: np.ndarray


class People:
    """All tested people, and all training walks."""

    def __init__(self, data: FourierSamples, model: AnatomicalWalkers) -> None:
        self.data, self.model = data, model
        self.count = len(model.people)
        self._person = np.array([np.flatnonzero(model.people == who)[0] for who in data.person])
        self._walks: dict[tuple[int, bool], anatomical.Walks] = {}

    @property
    def more_walks(self) -> bool:
        """True if at least one person has several walks."""
        return len(self._person) > self.count

    @property
    def harmonics(self) -> int:
        """Number of harmonics of the ground truth."""
        return self.data.coefficients.shape[1] // 2

    def walker(self, person: int) -> np.ndarray:
        """Return the tested walk (1 + 2H, 15, 3) of a person, mm."""
        return self.data.coefficients[self.model.tested[person]]

    def missing(self, person: int, view_rad: np.ndarray) -> np.ndarray:
        """Return the coefficients (A, 15, 1 + 2H) of a person's missing dimension, mm."""
        away = anatomical.image_axes(view_rad)[:, 2]
        return np.einsum("aj,kjb->akb", away, anatomical.by_joint(self.walker(person)))

    def in_image_axes(self, person: int, view_rad: np.ndarray) -> np.ndarray:
        """Return the coefficients (A, 15, 3, 1 + 2H) of a person in the image axes across, up and away, mm."""
        walker = anatomical.by_joint(self.walker(person))
        return np.einsum("aij,kjb->akib", anatomical.image_axes(view_rad), walker)

    def beyond_in_space(self, person: int, view_rad: np.ndarray) -> np.ndarray:
        """Return the power (A, 15, 3), mm², that a person's Fourier series does not contain, along the image axes."""
        axes = anatomical.image_axes(view_rad)
        covariance = self.data.residual_covariance[self.model.tested[person]]
        return np.einsum("aij,kjl,ail->aki", axes, covariance, axes)

    def training(
        self, setting: Setting, without: Iterable[int]
    ) -> tuple[anatomical.Walks, np.ndarray, np.ndarray]:
        """Return all walks, and the indices (n,) and weights (n,) of the walks on which a setting is trained.

        The training walks are those of everyone except the people in `without`.
        """
        selected = ~np.isin(self._person, list(without))
        if not setting.all_walks:
            selected &= np.isin(np.arange(len(selected)), self.model.tested)
        walks, key = np.flatnonzero(selected), (setting.harmonics, setting.shrinkage.mirror)
        if key not in self._walks:
            coefficients = self.data.coefficients[:, : 1 + 2 * setting.harmonics]
            self._walks[key] = anatomical.Walks(coefficients, mirror=setting.shrinkage.mirror)
        return self._walks[key], walks, anatomical.person_weights(self.data.person[walks])

    def learn(self, setting: Setting, without: Iterable[int], known: Iterable[int] = ()) -> Prior:
        """Return the prior of a setting, trained on everyone except the people in `without`.

        The walks of the `known` people determine the differences of their laboratory.
        """
        learner, walks, weights = self.training(setting, without)
        prior = learner.fit(walks, weights, setting.shrinkage)
        coefficients = self.data.coefficients[walks, : 1 + 2 * setting.harmonics]
        if setting.stance:
            prior = anatomical.with_stance(prior, coefficients, weights, share=setting.stance)
        if np.isfinite(setting.proportions):
            prior = anatomical.with_proportions(prior, tolerance=setting.proportions)
        if setting.differences:
            who, laboratories = self.data.person[walks], self.data.source[walks]
            assumed = setting.differences
            learnt = anatomical.learn_differences(coefficients, who, laboratories, assumed)
            # Laboratories do not sample people at random: after some with adults, the next may record children.
            learnt = replace(learnt, size=max(learnt.size, assumed.size))
            share = anatomical.concentration(weights, laboratories)
            of_laboratory = [self.walker(person)[: coefficients.shape[1]] for person in known]
            prior = anatomical.unfamiliar(prior, learnt, share, of_laboratory)
        return prior

    def fold(self, *without: int, known: tuple[int, ...] = ()) -> Fold:
        """Return the models that are trained on everyone except the people in `without`.

        The walks of the `known` people determine the differences of the tested laboratory.
        """
        return Fold(self, without, known)

    def beyond(self, person: int, view_rad: np.ndarray, harmonics: int) -> np.ndarray:
        """Return the power (A, 15), mm², of a person's missing dimension above the given number of harmonics."""
        power = errors.along_missing(self.data.residual_covariance[self.model.tested[person]], view_rad)
        more = self.missing(person, view_rad)[..., 1 + 2 * harmonics :]
        return power + 0.5 * (more**2).sum(axis=-1)

    # --- settings selected on other people -------------------------------------------------------------------

    def pairs(self, partners: int) -> list[tuple[int, int]]:
        """Return pairs of people for the test of settings, with about `partners` pairs for each person.

        The people are arranged on a circle, and partners are neighbours.
        """
        reach = min(max(partners // 2, 1), (self.count - 1) // 2)
        return [(i, (i + step) % self.count) for i in range(self.count) for step in range(1, reach + 1)]

    def errors_on_others(
        self,
        candidates: Sequence[Setting],
        partners: int,
        workers: int,
        *,
        requested: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the mean errors (P, C), mm², of C candidate settings, computed for each of P people on other people.

        The models are trained without that person and without the people in the test.  `requested` (P, C) bool selects
        the candidates of each person, by default all; the others are infinite.  Harmonics of the truth
        that a candidate lacks are part of its error.
        """
        pairs = self.pairs(partners)
        if requested is None:
            requested = np.ones((self.count, len(candidates)), bool)

        def errors_of_pair(pair: tuple[int, int]) -> np.ndarray:
            i, j = pair
            view = np.radians([CHOOSING_VIEWS_DEG[(i + j) % len(CHOOSING_VIEWS_DEG)]])
            walkers = np.stack([self.walker(j), self.walker(i)])
            missing = np.stack([self.missing(who, view)[0] for who in (j, i)])
            pair_errors = np.full((len(candidates), 2), np.inf)
            fold = self.fold(i, j)
            for tested, mask in (
                ([0, 1], requested[i] & requested[j]),
                ([0], requested[i] & ~requested[j]),
                ([1], requested[j] & ~requested[i]),
            ):
                numbers = np.flatnonzero(mask).tolist()
                estimates = fold.reconstruct([candidates[c] for c in numbers], walkers[tested], view)
                for c, estimate in zip(numbers, estimates, strict=True):
                    blocks = 1 + 2 * candidates[c].harmonics
                    off = (estimate.true - estimate.estimated).reshape(len(tested), -1, blocks)
                    beyond = 0.5 * (missing[tested, :, blocks:] ** 2).sum(axis=-1)
                    pair_errors[c, tested] = (off**2 @ errors.parseval_weights(blocks) + beyond).mean(axis=1)
            return pair_errors

        total = np.zeros((self.count, len(candidates)))
        times = np.zeros(self.count)
        for (i, j), pair_errors in zip(pairs, map_processes(errors_of_pair, pairs, workers), strict=True):
            total[i] += pair_errors[:, 0]  # errors on j of a model without i and j
            total[j] += pair_errors[:, 1]
            times[[i, j]] += 1
        return total / times[:, None]

    def select(self, candidates: Sequence[Setting], partners: int, workers: int) -> list[Setting]:
        """Select, for each person, the candidate setting with the smallest mean error on other people."""
        best = first_lowest(self.errors_on_others(candidates, partners, workers), axis=1)
        return [candidates[number] for number in best]

    def select_in_turn(
        self,
        start: Sequence[Setting],
        alternatives: Sequence[Callable[[Setting], list[Setting]]],
        partners: int,
        workers: int,
    ) -> list[Setting]:
        """Select several options of a setting one after another, for each person by the smallest error on other people.

        There is one pass from a first setting: a kind is not selected again after later kinds have changed.
        """
        best = list(start)
        errors_of: dict[Setting, np.ndarray] = {}  # mean errors (P,), infinite where not computed
        for alternatives_of in alternatives:
            options = [alternatives_of(setting) for setting in best]
            for setting in (setting for group in options for setting in group):
                errors_of.setdefault(setting, np.full(self.count, np.inf))
            requested = np.array(
                [
                    [setting in group and np.isinf(values[p]) for setting, values in errors_of.items()]
                    for p, group in enumerate(options)
                ]
            )
            columns = np.flatnonzero(requested.any(axis=0))
            new, mask = [list(errors_of)[column] for column in columns], requested[:, columns]
            score = self.errors_on_others(new, partners, workers, requested=mask)
            for setting, rows, values in zip(new, mask.T, score.T, strict=True):
                errors_of[setting][rows] = values[rows]
            best = [
                group[int(first_lowest(np.array([errors_of[setting][p] for setting in group])))]
                for p, group in enumerate(options)
            ]
        return best

    def tuned_map(self, noise_variances: Sequence[float], partners: int, workers: int) -> list[Setting]:
        """Return the MAP settings in which each person's sigma² has the smallest error on other people."""
        require_range("dataset.harmonics", self.harmonics, at_least=approach_two(0.0).harmonics)
        return self.select([approach_two(value) for value in noise_variances], partners, workers)


class Fold:
    """Models that are trained on everyone except the left-out people, one for each setting.

    Settings that need the same training share a prior.
    """

    def __init__(self, people: People, without: tuple[int, ...], known: tuple[int, ...]) -> None:
        self._people, self._without, self._known = people, without, known
        self._priors: dict[object, Prior] = {}
        self._last_conditional: tuple[object, Conditional] | None = None

    def prior(self, setting: Setting) -> Prior:
        """Return the prior of a setting, which is trained at its first use."""
        more = setting.all_walks and self._people.more_walks
        varied = (setting.stance, setting.proportions, setting.differences)
        learnt = (setting.harmonics, more, setting.shrinkage, *varied)
        if learnt not in self._priors:
            self._priors[learnt] = self._people.learn(setting, self._without, self._known)
        return self._priors[learnt]

    def conditional(self, setting: Setting, view_rad: np.ndarray, hidden: np.ndarray) -> Conditional:
        """Return the Gaussian distribution of the unknown coefficients for a setting, without bone-length constraints.

        The last result is cached.
        """
        prior = self.prior(setting)
        key = (id(prior), setting.noise, view_rad.tobytes(), hidden.tobytes())
        if self._last_conditional is None or self._last_conditional[0] != key:
            conditional = anatomical.condition(prior, view_rad, noise=setting.noise, hidden=hidden)
            self._last_conditional = key, conditional
        return self._last_conditional[1]

    def reconstruct(
        self,
        settings: Sequence[Setting],
        walkers: np.ndarray,
        view_rad: np.ndarray,
        *,
        hidden: np.ndarray = anatomical.NOTHING_HIDDEN,
        with_covariance: bool = False,
    ) -> list[Estimate]:
        """Reconstruct walkers (M, 1 + 2H, 15, 3) from each of A views, with each of the given settings.

        Settings that differ only in their tolerances of lengths are fitted together.
        """
        estimate_of: dict[int, Estimate] = {}
        alike: dict[tuple[Setting, bool, bool], list[int]] = {}
        for number, setting in enumerate(settings):
            sampled = setting.sampled and not (setting.lengths or with_covariance)
            linear = setting.with_noise(0.0) if sampled else setting.linear
            alike.setdefault((linear, setting.lengths, sampled), []).append(number)
        for (linear, lengths, sampled), numbers in alike.items():
            blocks = 1 + 2 * linear.harmonics
            unknown = anatomical.unknown_coefficients(hidden, blocks)
            turned = np.einsum(
                "aij,mkjb->amkib", anatomical.image_axes(view_rad), anatomical.by_joint(walkers[:, :blocks])
            )
            rows = turned.reshape(*turned.shape[:2], -1)
            true = rows[..., unknown]
            observed = rows[..., ~unknown]
            covariance = np.empty((*true.shape[:2], 0, 0))
            if sampled:
                learner, walks, weights = self._people.training(linear, self._without)
                mean, training, _ = learner.centred(walks, weights)
                variances = [settings[number].noise.variance for number in numbers]
                each = anatomical.expect_from_walks(
                    mean, training, observed, view_rad, unknown=unknown, noise_variances=variances
                )
                for number, expected in zip(numbers, each, strict=True):
                    estimate_of[number] = Estimate(true, expected, covariance, unknown)
                continue
            conditional = self.conditional(linear, view_rad, hidden)
            if not lengths:
                if with_covariance:
                    covariance = np.broadcast_to(
                        conditional.covariance[:, None], (*true.shape, true.shape[-1])
                    )
                expected = conditional.expect(observed)
                for number in numbers:
                    estimate_of[number] = Estimate(true, expected, covariance, unknown)
                continue
            limits = [
                anatomical.tolerances(
                    self.prior(setting),
                    within=setting.within,
                    pairs=setting.pairs,
                    bias=setting.noise.bias,
                    slow=setting.noise.slow,
                )
                for setting in (settings[number] for number in numbers)
            ]
            count = len(walkers)
            fitted = anatomical.fit_lengths(
                conditional,
                np.tile(observed, (1, len(numbers), 1)),
                anatomical.Tolerances(
                    within=np.repeat([each.within for each in limits], count, axis=0),
                    pairs=np.repeat([each.pairs for each in limits], count, axis=0),
                ),
                with_covariance=with_covariance,
            )
            for n, number in enumerate(numbers):
                part = slice(n * count, (n + 1) * count)
                estimate_of[number] = Estimate(
                    true, fitted.unknown[:, part], fitted.covariance[:, part], unknown
                )
        return [estimate_of[number] for number in range(len(settings))]

    def bars(
        self, setting: Setting, person: int, view_rad: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return a person's errors of coefficients (A, 15, B), and errors and standard deviations (A, 15, K) at K
        instants."""
        people, blocks = self._people, 1 + 2 * setting.harmonics
        (estimate,) = self.reconstruct([setting], people.walker(person)[None], view_rad, with_covariance=True)
        off = (estimate.true - estimate.estimated)[:, 0].reshape(len(view_rad), -1, blocks)
        beyond = people.missing(person, view_rad)[..., blocks:]
        error = anatomical.at_instants(np.concatenate([off, beyond], axis=-1), PHASES)
        return off, error, anatomical.deviation_at_instants(estimate.covariance[:, 0], blocks, PHASES)

    def errors(self, settings: Sequence[Setting], person: int, view_rad: np.ndarray) -> list[np.ndarray]:
        """Return E_abs (A, 15), mm², of a person in the missing dimension for each setting [zhang2007 4.1]."""
        walker = self._people.walker(person)[None]
        if not self._people.more_walks:  # `all_walks` then has no effect, so settings may coincide
            settings = [replace(setting, all_walks=True) for setting in settings]
        error_of: dict[Setting, np.ndarray] = {}
        for mirrored in (False, True):
            both_sides = mirrored and mirrored_grid(view_rad)
            seen_from = view_rad[view_rad > -1e-9] if both_sides else view_rad
            walkers = np.concatenate([walker, fourier.mirrored(walker)]) if both_sides else walker
            alike = list(dict.fromkeys(s for s in settings if s.shrinkage.mirror is mirrored))
            for setting, estimate in zip(alike, self.reconstruct(alike, walkers, seen_from), strict=True):
                weights = errors.parseval_weights(1 + 2 * setting.harmonics)
                off = (estimate.true - estimate.estimated).reshape(*estimate.true.shape[:2], -1, len(weights))
                square = off**2 @ weights  # (A', 1 or 2, 15)
                right = square[:, 0]
                if both_sides:
                    left = square[:0:-1, 1][:, list(WALKER15.mirror)]
                    right = np.concatenate([left, right])
                error_of[setting] = right + self._people.beyond(person, view_rad, setting.harmonics)
        return [error_of[setting] for setting in settings]


def mirrored_grid(view_rad: np.ndarray) -> bool:
    """Return True if view angles are symmetric about the frontal view and include the frontal view."""
    return bool(np.allclose(view_rad, -view_rad[::-1], atol=1e-9) and len(view_rad) % 2)


def require_mirrored_grid(name: str, grid: Grid) -> None:
    """Require that view angles are symmetric about the frontal view and include it."""
    values = grid.values(name)
    if not mirrored_grid(values):
        raise InvalidInput(
            "views must be symmetric about the frontal view, and include it",
            name,
            "start -90, stop 90 and a step that divides 90",
            ", ".join(f"{value:g}" for value in values[:4]),
            code="not_mirrored",
        )


MirroredViews = Annotated[Grid, require_mirrored_grid]
Choosers = Several
"""Option type for the number of other people who are used to select each person's settings."""
PARTNERS = {"full": 16, "smoke": 2}
"""Number of other people who are used to select each person's settings, at the full and at the smoke scale."""
