"""People who are held out, the priors learnt without them, and their reconstructions from many views.

A prior that knows mirror images is the same seen from the left and from the right, so that a walker and its mirror
image, both seen from the right, are one walker seen from both sides: half of the views serve all.
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
"""Angles over the circle at which the likelihood of a view is evaluated."""
PHASES = 8
"""Instants of the cycle at which bars are looked at."""

BARS = ("as computed", "calibrated")
"""Error bars by the textbook, and with multipliers learnt from other people."""
NOISE_VARIANCES_MM2 = (70.0, 150.0, 300.0, 500.0, 700.0, 1000.0, 1500.0)
"""sigma² of MAP that others choose among; joints that are hidden leave out both ends."""

NORMAL_95 = 1.959963984540054
"""Half width of the 95 % interval of a normal distribution, standard deviations."""

CHOOSING_VIEWS_DEG = (0.0, 30.0, 60.0, 90.0)
"""Each pair of people chooses settings at one of these; the prior makes no difference between left and right."""


@dataclass(frozen=True)
class Estimate:
    """Unknown coefficients of M walkers from A views, in image axes: true, estimated, and how sure.

    Attributes
    ----------
    true, estimated : (A, M, U)
        mm.
    covariance : (A, M, U, U)
        mm²; empty if not asked for.
    unknown : (45 B,) bool
    """

    true: np.ndarray
    estimated: np.ndarray
    covariance: np.ndarray
    unknown: np.ndarray


class People:
    """Everybody who is tested, and the walks of everybody to learn from."""

    def __init__(self, data: FourierSamples, model: AnatomicalWalkers) -> None:
        self.data, self.model = data, model
        self.count = len(model.people)
        self._person = np.array([np.flatnonzero(model.people == who)[0] for who in data.person])
        self._walks: dict[tuple[int, bool], anatomical.Walks] = {}

    @property
    def more_walks(self) -> bool:
        """Whether anybody has more walks than the one that is tested."""
        return len(self._person) > self.count

    @property
    def harmonics(self) -> int:
        """Of the truth."""
        return self.data.coefficients.shape[1] // 2

    def walker(self, person: int) -> np.ndarray:
        """The tested walk (1 + 2H, 15, 3) of a person."""
        return self.data.coefficients[self.model.tested[person]]

    def missing(self, person: int, view_rad: np.ndarray) -> np.ndarray:
        """Coefficients (A, 15, 1 + 2H) of a person's missing dimension, mm."""
        away = anatomical.image_axes(view_rad)[:, 2]
        return np.einsum("aj,kjb->akb", away, anatomical.by_joint(self.walker(person)))

    def in_image_axes(self, person: int, view_rad: np.ndarray) -> np.ndarray:
        """Coefficients (A, 15, 3, 1 + 2H) of a person across, up and away, mm."""
        walker = anatomical.by_joint(self.walker(person))
        return np.einsum("aij,kjb->akib", anatomical.image_axes(view_rad), walker)

    def beyond_in_space(self, person: int, view_rad: np.ndarray) -> np.ndarray:
        """Power (A, 15, 3) across, up and away of what the Fourier series does not hold, mm²."""
        axes = anatomical.image_axes(view_rad)
        covariance = self.data.residual_covariance[self.model.tested[person]]
        return np.einsum("aij,kjl,ail->aki", axes, covariance, axes)

    def training(
        self, setting: Setting, without: Iterable[int]
    ) -> tuple[anatomical.Walks, np.ndarray, np.ndarray]:
        """All walks as a setting has them, and which (n,) are learnt from without some people, with what weights."""
        kept = ~np.isin(self._person, list(without))
        if not setting.all_walks:
            kept &= np.isin(np.arange(len(kept)), self.model.tested)
        walks, how = np.flatnonzero(kept), (setting.harmonics, setting.shrinkage.mirror)
        if how not in self._walks:
            coefficients = self.data.coefficients[:, : 1 + 2 * setting.harmonics]
            self._walks[how] = anatomical.Walks(coefficients, mirror=setting.shrinkage.mirror)
        return self._walks[how], walks, anatomical.person_weights(self.data.person[walks])

    def learn(self, setting: Setting, without: Iterable[int], known: Iterable[int] = ()) -> Prior:
        """What is learnt without some people; some of their laboratory are known to belong to it."""
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
            # Whom a laboratory records is no draw: a few of adults do not say that the next has no children.
            learnt = replace(learnt, size=max(learnt.size, assumed.size))
            share = anatomical.concentration(weights, laboratories)
            of_laboratory = [self.walker(person)[: coefficients.shape[1]] for person in known]
            prior = anatomical.unfamiliar(prior, learnt, share, of_laboratory)
        return prior

    def fold(self, *without: int, known: tuple[int, ...] = ()) -> Fold:
        """What can be learnt without these people; `known` are of the tested laboratory, and tell where it differs."""
        return Fold(self, without, known)

    def beyond(self, person: int, view_rad: np.ndarray, harmonics: int) -> np.ndarray:
        """Power (A, 15) in the missing dimension of what a number of harmonics does not hold, mm²."""
        power = errors.along_missing(self.data.residual_covariance[self.model.tested[person]], view_rad)
        more = self.missing(person, view_rad)[..., 1 + 2 * harmonics :]
        return power + 0.5 * (more**2).sum(axis=-1)

    # --- settings chosen without a person -------------------------------------------------------------------

    def pairs(self, partners: int) -> list[tuple[int, int]]:
        """Pairs of people, each person in about `partners` of them: neighbours on a circle."""
        reach = min(max(partners // 2, 1), (self.count - 1) // 2)
        return [(i, (i + step) % self.count) for i in range(self.count) for step in range(1, reach + 1)]

    def tried(
        self,
        candidates: Sequence[Setting],
        partners: int,
        workers: int,
        *,
        wanted: np.ndarray | None = None,
    ) -> np.ndarray:
        """Mean errors (P, C) of candidates on the others of each person, mm²; infinite for those not asked for.

        The models behind a person's errors have seen neither that person nor the one they are tried on.  Which
        candidates are asked for by each person is `wanted`, (P, C) bool: all unless it is given.  Harmonics of the
        truth that a candidate leaves out are part of its error.
        """
        pairs = self.pairs(partners)
        if wanted is None:
            wanted = np.ones((self.count, len(candidates)), bool)

        def one(pair: tuple[int, int]) -> np.ndarray:
            i, j = pair
            view = np.radians([CHOOSING_VIEWS_DEG[(i + j) % len(CHOOSING_VIEWS_DEG)]])
            walkers = np.stack([self.walker(j), self.walker(i)])
            missing = np.stack([self.missing(who, view)[0] for who in (j, i)])
            found = np.full((len(candidates), 2), np.inf)
            fold = self.fold(i, j)
            for tried_on, asked in (
                ([0, 1], wanted[i] & wanted[j]),
                ([0], wanted[i] & ~wanted[j]),
                ([1], wanted[j] & ~wanted[i]),
            ):
                numbers = np.flatnonzero(asked).tolist()
                estimates = fold.reconstruct([candidates[c] for c in numbers], walkers[tried_on], view)
                for c, estimate in zip(numbers, estimates, strict=True):
                    blocks = 1 + 2 * candidates[c].harmonics
                    off = (estimate.true - estimate.estimated).reshape(len(tried_on), -1, blocks)
                    beyond = 0.5 * (missing[tried_on, :, blocks:] ** 2).sum(axis=-1)
                    found[c, tried_on] = (off**2 @ errors.parseval_weights(blocks) + beyond).mean(axis=1)
            return found

        total = np.zeros((self.count, len(candidates)))
        times = np.zeros(self.count)
        for (i, j), found in zip(pairs, map_processes(one, pairs, workers), strict=True):
            total[i] += found[:, 0]  # j, tried by a model that has not seen i
            total[j] += found[:, 1]
            times[[i, j]] += 1
        return total / times[:, None]

    def chosen(self, candidates: Sequence[Setting], partners: int, workers: int) -> list[Setting]:
        """For each person the candidate that is best for the others."""
        best = first_lowest(self.tried(candidates, partners, workers), axis=1)
        return [candidates[number] for number in best]

    def chosen_in_turn(
        self,
        start: Sequence[Setting],
        alternatives: Sequence[Callable[[Setting], list[Setting]]],
        partners: int,
        workers: int,
    ) -> list[Setting]:
        """For each person, one kind of setting after the other as is best for the others, from a first setting.

        One pass: a kind that has been chosen is not looked at again when others have changed.
        """
        best = list(start)
        known: dict[Setting, np.ndarray] = {}  # mean errors (P,), infinite for who has not asked
        for alternatives_of in alternatives:
            mine = [alternatives_of(setting) for setting in best]
            for setting in (setting for of in mine for setting in of):
                known.setdefault(setting, np.full(self.count, np.inf))
            asked = np.array(
                [
                    [setting in of and np.isinf(values[p]) for setting, values in known.items()]
                    for p, of in enumerate(mine)
                ]
            )
            columns = np.flatnonzero(asked.any(axis=0))
            new, wanted = [list(known)[column] for column in columns], asked[:, columns]
            score = self.tried(new, partners, workers, wanted=wanted)
            for setting, by, values in zip(new, wanted.T, score.T, strict=True):
                known[setting][by] = values[by]
            best = [
                of[int(first_lowest(np.array([known[setting][p] for setting in of])))]
                for p, of in enumerate(mine)
            ]
        return best

    def tuned_map(self, noise_variances: Sequence[float], partners: int, workers: int) -> list[Setting]:
        """MAP for each person, with the sigma² that is best for the others."""
        require_range("dataset.harmonics", self.harmonics, at_least=approach_two(0.0).harmonics)
        return self.chosen([approach_two(value) for value in noise_variances], partners, workers)


class Fold:
    """What is learnt without some people; settings that learn alike share their priors."""

    def __init__(self, people: People, without: tuple[int, ...], known: tuple[int, ...]) -> None:
        self._people, self._without, self._known = people, without, known
        self._priors: dict[object, Prior] = {}
        self._last_conditional: tuple[object, Conditional] | None = None

    def prior(self, setting: Setting) -> Prior:
        """The prior of a setting."""
        more = setting.all_walks and self._people.more_walks
        varied = (setting.stance, setting.proportions, setting.differences)
        learnt = (setting.harmonics, more, setting.shrinkage, *varied)
        if learnt not in self._priors:
            self._priors[learnt] = self._people.learn(setting, self._without, self._known)
        return self._priors[learnt]

    def conditional(self, setting: Setting, view_rad: np.ndarray, hidden: np.ndarray) -> Conditional:
        """The linear part of a setting, for some views; the last one is kept, for other methods."""
        prior = self.prior(setting)
        wanted = (id(prior), setting.noise, view_rad.tobytes(), hidden.tobytes())
        if self._last_conditional is None or self._last_conditional[0] != wanted:
            found = anatomical.condition(prior, view_rad, noise=setting.noise, hidden=hidden)
            self._last_conditional = wanted, found
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
        """Reconstruct walkers (M, 1 + 2H, 15, 3) from views (A,) with each of some settings.

        Settings alike but for lengths are fitted together.
        """
        found: dict[int, Estimate] = {}
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
                    found[number] = Estimate(true, expected, covariance, unknown)
                continue
            conditional = self.conditional(linear, view_rad, hidden)
            if not lengths:
                if with_covariance:
                    covariance = np.broadcast_to(
                        conditional.covariance[:, None], (*true.shape, true.shape[-1])
                    )
                expected = conditional.expect(observed)
                for number in numbers:
                    found[number] = Estimate(true, expected, covariance, unknown)
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
            for place, number in enumerate(numbers):
                part = slice(place * count, (place + 1) * count)
                found[number] = Estimate(true, fitted.unknown[:, part], fitted.covariance[:, part], unknown)
        return [found[number] for number in range(len(settings))]

    def bars(
        self, setting: Setting, person: int, view_rad: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return errors of the coefficients (A, 15, B), and of the missing dimension at instants with deviations."""
        people, blocks = self._people, 1 + 2 * setting.harmonics
        (found,) = self.reconstruct([setting], people.walker(person)[None], view_rad, with_covariance=True)
        off = (found.true - found.estimated)[:, 0].reshape(len(view_rad), -1, blocks)
        beyond = people.missing(person, view_rad)[..., blocks:]
        error = anatomical.at_instants(np.concatenate([off, beyond], axis=-1), PHASES)
        return off, error, anatomical.deviation_at_instants(found.covariance[:, 0], blocks, PHASES)

    def errors(self, settings: Sequence[Setting], person: int, view_rad: np.ndarray) -> list[np.ndarray]:
        """E_abs (A, 15) of a person in the missing dimension with each of several settings, mm² [zhang2007 4.1]."""
        walker = self._people.walker(person)[None]
        if not self._people.more_walks:  # settings that differ in nothing else are one
            settings = [replace(setting, all_walks=True) for setting in settings]
        found: dict[Setting, np.ndarray] = {}
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
                found[setting] = right + self._people.beyond(person, view_rad, setting.harmonics)
        return [found[setting] for setting in settings]


def mirrored_grid(view_rad: np.ndarray) -> bool:
    """Whether view angles lie alike on both sides of the frontal one, which is among them."""
    return bool(np.allclose(view_rad, -view_rad[::-1], atol=1e-9) and len(view_rad) % 2)


def require_mirrored_grid(name: str, grid: Grid) -> None:
    """Require view angles that are symmetric about the frontal view, which is one of them."""
    values = grid.values(name)
    if not mirrored_grid(values):
        raise InvalidInput(
            "views must lie alike on both sides of the frontal one",
            name,
            "start -90, stop 90 and a step that divides 90",
            ", ".join(f"{value:g}" for value in values[:4]),
            code="not_mirrored",
        )


MirroredViews = Annotated[Grid, require_mirrored_grid]
Choosers = Several
"""People who choose settings for each person."""
PARTNERS = {"full": 16, "smoke": 2}
"""Number of people who choose the settings of each person, by scale."""
