"""Tests of the particle filter: against a Kalman filter, against direct implementations, and for the benefit of the
prior.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from pipeline.core import camera
from pipeline.core.resampling import interpolate
from pipeline.core.tracking import (
    Dynamics,
    Likelihood,
    Track,
    best_phase,
    joint_error,
    learnt_diffusion,
    particles,
    track,
)
from pipeline.core.tracking.prediction import Walk
from pipeline.skeleton import WALKER15
from tests.rejects import rejects
from tests.strategies import seeds

VIEW = 0.7  # rad
JOINTS = len(WALKER15.joints)


# --- toys -------------------------------------------------------------------------------------------------


def linear_joints(generator: np.random.Generator, dimensions: int) -> Callable[[np.ndarray], np.ndarray]:
    """Return a random linear function from the aSpace to joint positions, mm."""
    matrix = 100.0 * generator.standard_normal((JOINTS * 3, dimensions))
    return lambda x: (x @ matrix.T).reshape(len(x), JOINTS, 3)


def limbs(x: np.ndarray) -> np.ndarray:
    """Return joint positions (S, 15, 3) of a body whose limb angles are linear functions of x (S, b)."""
    generator = np.random.default_rng(5)
    turn = generator.standard_normal((2, 15, x.shape[1])) * 0.5
    up, round_ = generator.uniform(-2, 2, (2, 1, 15)) + np.einsum("ajb,sb->asj", turn, x)
    direction = np.stack([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)], axis=-1)
    positions = np.zeros((len(x), JOINTS, 3))
    positions[:, 8, 2] = 900.0
    for joint in (1, 9, 12, 0, 2, 5, 3, 6, 4, 7, 10, 13, 11, 14):  # parents first
        positions[:, joint] = positions[:, WALKER15.parents[joint]] + 300.0 * direction[:, joint]
    return positions


def performances(seed: int, count: int, *, samples: int = 60, dimensions: int = 5) -> np.ndarray:
    """Return synchronized random performances (M, P, b) of one action, each with a smooth individual deviation."""
    generator = np.random.default_rng(seed)
    t = np.linspace(0, 1, samples)[:, None]
    scale = 0.7 ** np.arange(dimensions)
    action = np.sin(np.pi * t * [1, 2, 1, 3, 2][:dimensions]) * scale * 1.5
    reference = generator.standard_normal((count, 2, dimensions)) * 0.3 * scale
    return action + reference[:, :1] + reference[:, 1:] * np.cos(np.pi * t)


def seen(
    x: np.ndarray, generator: np.random.Generator, *, noise: float, occluded: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the true joint positions (T, 15, 3), and their noisy image (T, 15, 2)."""
    true = limbs(x)
    image = camera.project(true, VIEW) + noise * generator.standard_normal((len(x), JOINTS, 2))
    image[generator.random((len(x), JOINTS)) < occluded] = np.nan
    return true, image


def model(train: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return train.mean(axis=0), train.std(axis=0, ddof=1)


# --- weighted samples -------------------------------------------------------------------------------------


@given(seed=seeds, count=st.integers(1, 50))
def test_systematic_counts_are_the_expected_ones_rounded(seed: int, count: int) -> None:
    generator = np.random.default_rng(seed)
    weights = generator.dirichlet(np.full(count, 0.3))
    with np.errstate(divide="ignore"):
        chosen = particles.resample_systematically(np.log(weights), generator.random())
    counts = np.bincount(chosen, minlength=count)
    assert len(chosen) == count
    assert (np.abs(counts - count * weights) < 1 + 1e-9).all()
    assert not counts[weights == 0].any()


@given(seed=seeds, count=st.integers(1, 12))
@settings(max_examples=30)
def test_systematic_resampling_is_unbiased_in_whatever_order(seed: int, count: int) -> None:
    """Systematic resampling is unbiased: a particle of weight w is drawn w S times on average in S draws."""
    generator = np.random.default_rng(seed)
    weights = generator.dirichlet(np.ones(count))
    order = generator.permutation(count)
    offsets = (np.arange(4000) + 0.5) / 4000

    def mean_counts(weights: np.ndarray) -> np.ndarray:
        chosen = [particles.resample_systematically(np.log(weights), u) for u in offsets]
        return np.bincount(np.concatenate(chosen), minlength=count) / len(offsets)

    np.testing.assert_allclose(mean_counts(weights), count * weights, atol=2e-3)
    np.testing.assert_allclose(mean_counts(weights[order]), count * weights[order], atol=2e-3)


def test_log_weights_keep_what_weights_would_lose() -> None:
    log_weights, total = particles.normalise(np.array([-9000.0, -9000.0, -9100.0]))
    assert total == pytest.approx(-9000.0 + np.log(2))
    assert particles.effective_sample_size(log_weights) == pytest.approx(2.0)


# --- prediction -------------------------------------------------------------------------------------------


def test_pruned_predictions_are_redrawn_as_by_rejecting_until_accepted() -> None:
    """Pruned predictions have the same distribution as predictions that are redrawn until the model accepts them."""
    walk = Walk(np.zeros((9, 2)), np.ones((9, 2)), Dynamics(diffusion=0.5), prior=True)
    state = np.tile([3.0, 1.0, 2.9, -1.0], (4000, 1))
    generator = np.random.default_rng(1)
    innovations, pruned = walk.draw(state, len(state), generator)
    z = walk.apply(state, innovations)[:, 2:]
    assert np.abs(z).max() <= 3.0 + 1e-9

    naive = np.empty((4000, 2))
    rejected = 0
    for i in range(len(naive)):
        for attempt in range(1000):
            naive[i] = np.sqrt(0.75) * state[i, 2:] + 0.5 * generator.standard_normal(2)
            if (np.abs(naive[i]) <= 3.0).all():
                break
            rejected += attempt == 0
    assert pruned == pytest.approx(rejected / 4000, abs=0.03)
    assert pruned > 0.05
    for coordinate in range(2):
        assert stats.ks_2samp(z[:, coordinate], naive[:, coordinate]).pvalue > 1e-3


def test_without_an_image_particles_keep_the_learnt_variance() -> None:
    walk = Walk(np.zeros((2, 3)), np.ones((2, 3)), Dynamics(diffusion=0.4), prior=True)
    generator = np.random.default_rng(2)
    state = None
    for _ in range(60):
        innovations, _ = walk.draw(state, 4000, generator)
        state = walk.apply(state, innovations)
    assert state is not None
    assert state[:, 2:].std(axis=0) == pytest.approx(np.full(3, stats.truncnorm.std(-3, 3)), abs=0.05)


@given(seed=seeds)
@settings(max_examples=20)
def test_phases_never_run_backwards_nor_past_the_end_and_rates_stay_bounded(seed: int) -> None:
    d = Dynamics(nominal_rate=2.0, rate_bounds=(0.25, 1.5), rate_step=0.7, start_phase=(0.1, 0.4))
    walk = Walk(np.zeros((30, 2)), np.ones((30, 2)), d, prior=True)
    generator = np.random.default_rng(seed)
    state = walk.apply(None, walk.draw(None, 50, generator)[0])
    assert ((state[:, 0] >= 2.9 - 1e-9) & (state[:, 0] <= 11.6 + 1e-9)).all()
    for _ in range(20):
        before, state = state, walk.apply(state, walk.draw(state, 50, generator)[0])
        assert ((state[:, 1] >= 0.5 - 1e-9) & (state[:, 1] <= 3.0 + 1e-9)).all()
        np.testing.assert_allclose(state[:, 0], np.minimum(before[:, 0] + state[:, 1], 29.0))


def test_the_diffusion_of_an_autoregression_is_learnt_back() -> None:
    generator = np.random.default_rng(3)
    z = generator.standard_normal((200, 50, 4))
    for p in range(1, 50):
        z[:, p] = np.sqrt(1 - 0.3**2) * z[:, p - 1] + 0.3 * z[:, p]
    mean, sd = np.arange(200.0).reshape(50, 4), np.full((50, 4), 7.0)
    sd[:, 3] = 0.0  # a coordinate that does not vary has no say
    assert learnt_diffusion(mean + sd * z, mean, sd) == pytest.approx(0.3, abs=0.01)
    with rejects("identical_performances", "learnt diffusion"):
        learnt_diffusion(mean[None], mean, sd)


# --- the exact filter -------------------------------------------------------------------------------------


def kalman(
    start: tuple[np.ndarray, np.ndarray],
    steps: list[tuple[np.ndarray, np.ndarray, np.ndarray]],
    images: np.ndarray,
    matrix: np.ndarray,
    noise: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return means, variances and log evidence of a Kalman filter for the linear model x' = F x + c + N(0, Q)."""
    (x, covariance), means, variances, evidence = start, [], [], []
    for frame, image in enumerate(images):
        if frame:
            F, c, Q = steps[frame - 1]
            x, covariance = F @ x + c, F @ covariance @ F.T + Q
        finite = np.isfinite(image)
        if finite.any():
            H = matrix[finite]
            S = H @ covariance @ H.T + noise**2 * np.eye(finite.sum())
            evidence.append(stats.multivariate_normal.logpdf(image[finite], H @ x, S))
            gain = np.linalg.solve(S, H @ covariance).T
            x, covariance = x + gain @ (image[finite] - H @ x), covariance - gain @ H @ covariance
        else:
            evidence.append(0.0)
        means.append(x)
        variances.append(np.diag(covariance))
    return np.array(means), np.array(variances), np.array(evidence)


@pytest.mark.parametrize("prior", [True, False])
def test_the_filter_is_the_kalman_filter_where_that_is_exact(prior: bool) -> None:
    """For linear joints, a known rate and no bounds, the particle filter agrees with the Kalman filter."""
    noise, n_particles = 400.0, 20000
    generator = np.random.default_rng(11)
    b, frames, q = 3, 10, 0.5
    to_joints = linear_joints(generator, b)
    mean = np.cumsum(generator.standard_normal((frames, b)), axis=0)
    sd = generator.uniform(0.5, 1.5, (frames, b))
    dynamics = Dynamics(rate_bounds=(1.0, 1.0), diffusion=q, bound=np.inf)
    if prior:
        keep, size = np.sqrt(1 - q**2), sd
        F = [np.diag(keep * sd[t] / sd[t - 1]) for t in range(1, frames)]
        c = [mean[t] - F[t - 1] @ mean[t - 1] for t in range(1, frames)]
    else:
        size = np.tile(np.sqrt((sd**2).mean(axis=0)), (frames, 1))
        F, c = [np.eye(b)] * (frames - 1), [np.zeros(b)] * (frames - 1)
    Q = [np.diag((q * size[t]) ** 2) for t in range(1, frames)]
    matrix = camera.project(to_joints(np.eye(b)), VIEW).reshape(b, -1).T
    x = (
        mean + 0.7 * sd * generator.standard_normal((frames, b))
        if prior
        else mean[:1] + np.zeros((frames, b))
    )
    image = camera.project(to_joints(x), VIEW) + noise * generator.standard_normal((frames, JOINTS, 2))
    image[generator.random((frames, JOINTS)) < 0.3] = np.nan
    image[4] = np.nan

    start = (mean[0], np.diag(sd[0] ** 2))
    expected, variance, evidence = kalman(
        start, list(zip(F, c, Q, strict=True)), image.reshape(frames, -1), matrix, noise
    )
    tracked = track(
        mean,
        sd,
        Likelihood(image, VIEW, noise),
        to_joints=to_joints,
        n_particles=n_particles,
        generator=generator,
        dynamics=dynamics,
        prior=prior,
    )
    # Errors of n independent samples would be sqrt(variance / n); effective samples are a tenth of n or more.
    tolerance = 4.0 / np.sqrt(n_particles / 10)
    assert (np.abs(tracked.posture - expected) < tolerance * np.sqrt(variance)).all()
    np.testing.assert_allclose(tracked.standard_deviation, np.sqrt(variance), rtol=tolerance)
    np.testing.assert_allclose(tracked.log_evidence, evidence, atol=3 * tolerance)
    assert tracked.log_evidence[4] == 0.0
    assert not tracked.lost.any()
    assert not tracked.pruned_fraction.any()


# --- the plain loop ---------------------------------------------------------------------------------------


def one_by_one(
    mean: np.ndarray,
    sd: np.ndarray,
    image: np.ndarray,
    noise: float,
    count: int,
    d: Dynamics,
    prior: bool,
    generator: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return postures, phases and evidence of a particle filter that is written as plain loops over particles."""
    b, last = mean.shape[1], len(mean) - 1.0
    size = np.ones(b) if prior else np.sqrt((sd**2).mean(axis=0))
    keep = np.sqrt(1 - d.diffusion**2) if prior else 1.0
    states: list[np.ndarray] = []
    weights = np.full(count, 1 / count)
    postures, phases, evidences = [], [], []
    for frame in range(len(image)):
        drawn = generator.standard_normal((count, 2 + b))
        redrawn = []
        for i in range(count):
            for k in range(b if prior else 0):
                centre, step = (keep * states[i][2 + k], d.diffusion) if frame else (0.0, 1.0)
                if abs(centre + step * drawn[i, 2 + k]) > d.bound:
                    redrawn.append((i, 2 + k, (-d.bound - centre) / step, (d.bound - centre) / step))
        for (i, k, low, high), u in zip(redrawn, generator.random(len(redrawn)), strict=True):
            below, above = stats.norm.cdf([low, high])
            drawn[i, k] = stats.norm.ppf(below + u * (above - below))
        x, density = np.empty((count, b)), np.empty(count)
        for i, e in enumerate(drawn):
            slowest, fastest = d.nominal_rate * d.rate_bounds[0], d.nominal_rate * d.rate_bounds[1]
            state = np.empty(2 + b)
            if frame:
                rate = states[i][1] + d.rate_step * d.nominal_rate * e[1]
                while not slowest <= rate <= fastest:
                    rate = 2 * (slowest if rate < slowest else fastest) - rate
                state[:2] = min(states[i][0] + rate, last), rate
                state[2:] = keep * states[i][2:] + d.diffusion * size * e[2:]
            else:
                first, final = d.start_phase[0] * last, d.start_phase[1] * last
                share = stats.norm.cdf(e[:2])
                state[:2] = first + (final - first) * share[0], slowest + (fastest - slowest) * share[1]
                state[2:] = e[2:] if prior else mean[0] + sd[0] * e[2:]
            states[i : i + 1] = [state]
            p = state[:1]
            x[i] = interpolate(mean, p)[0] + interpolate(sd, p)[0] * state[2:] if prior else state[2:]
            residual = (camera.project(limbs(x[[i]])[0], VIEW) - image[frame])[~np.isnan(image[frame, :, 0])]
            density[i] = stats.norm.logpdf(residual, scale=noise).sum()
        best = density.max()
        weights = weights * np.exp(density - best)
        evidences.append(best + np.log(weights.sum()))
        weights /= weights.sum()
        postures.append(weights @ x)
        phases.append(weights @ [state[0] for state in states])
        if 1 / (weights**2).sum() < count / 2:
            offset, edges = generator.random(), np.cumsum(weights)
            retained = [
                next(i for i in range(count) if edges[i] > (n + offset) / count) for n in range(count)
            ]
            states, weights = [states[i] for i in retained], np.full(count, 1 / count)
    return np.array(postures), np.array(phases), np.array(evidences)


@pytest.mark.parametrize("prior", [True, False])
@pytest.mark.parametrize("occluded", [0.0, 0.4])
def test_the_filter_is_the_plain_loop_given_the_same_random_numbers(prior: bool, occluded: float) -> None:
    """Given the same random numbers, the particle filter equals plain loops over particles."""
    mean, sd = model(performances(0, 25, samples=14)[1:])
    _, image = seen(
        performances(0, 25, samples=14)[0], np.random.default_rng(3), noise=20.0, occluded=occluded
    )
    d = Dynamics(diffusion=0.6, bound=1.5, rate_step=0.9, rate_bounds=(0.3, 1.6), start_phase=(0.0, 0.2))
    expected = one_by_one(mean, sd, image, 30.0, 24, d, prior, np.random.default_rng(9))
    tracked = track(
        mean,
        sd,
        Likelihood(image, VIEW, 30.0),
        to_joints=limbs,
        n_particles=24,
        generator=np.random.default_rng(9),
        dynamics=d,
        prior=prior,
    )
    assert (tracked.pruned_fraction > 0).any() == prior
    assert (tracked.effective_sample_size < 12).any()  # so they are resampled
    postures, phases, evidence = expected
    np.testing.assert_allclose(tracked.posture, postures, rtol=0, atol=1e-9)
    np.testing.assert_allclose(tracked.log_evidence, evidence, rtol=1e-9)
    if prior:
        np.testing.assert_allclose(tracked.phase, phases, rtol=0, atol=1e-9)


# --- what is not seen -------------------------------------------------------------------------------------


def run(
    likelihood: Likelihood,
    *,
    prior: bool = True,
    n_particles: int = 300,
    dynamics: Dynamics | None = None,
    seed: int = 1,
) -> Track:
    """Return the track of a held-out synthetic performance, with an action model of 24 other performances."""
    train = performances(0, 25)[1:]
    return track(
        *model(train),
        likelihood,
        to_joints=limbs,
        n_particles=n_particles,
        generator=np.random.default_rng(seed),
        dynamics=dynamics or Dynamics(diffusion=0.1),
        prior=prior,
    )


def test_a_joint_that_was_not_seen_says_nothing() -> None:
    """An invisible joint does not influence weights and evidence, wherever its estimate lies."""
    generator = np.random.default_rng(4)
    _, image = seen(performances(0, 25)[0], generator, noise=10.0)
    image[:, [4, 7]] = np.nan
    likelihood = Likelihood(image, VIEW, 10.0)
    tracked = run(likelihood)
    moved = track(
        *model(performances(0, 25)[1:]),
        likelihood,
        to_joints=lambda x: limbs(x) + np.isin(np.arange(15), [4, 7])[:, None] * 1e5,
        n_particles=300,
        generator=np.random.default_rng(1),
        dynamics=Dynamics(diffusion=0.1),
    )
    np.testing.assert_array_equal(tracked.posture, moved.posture)
    np.testing.assert_array_equal(tracked.log_evidence, moved.log_evidence)
    assert (tracked.visible == 13).all()


def test_a_frame_with_nothing_seen_coasts_on_the_prediction() -> None:
    generator = np.random.default_rng(4)
    x = performances(0, 25)[0]
    _, image = seen(x, generator, noise=5.0)
    image[20:30] = np.nan
    tracked = run(Likelihood(image, VIEW, 5.0), n_particles=1000)
    assert (tracked.visible[20:30] == 0).all()
    assert not tracked.lost.any()
    assert (tracked.log_evidence[20:30] == 0).all()
    assert (np.diff(tracked.phase[19:30]) > 0.3).all()  # the action goes on unseen
    growth = tracked.standard_deviation[29].mean() / tracked.standard_deviation[19].mean()
    assert growth > 1.5
    mean, _ = model(performances(0, 25)[1:])
    stayed = np.abs(tracked.posture[19] - x[29]).mean()
    assert np.abs(tracked.posture[29] - x[29]).mean() < 0.5 * stayed
    assert (
        joint_error(limbs(tracked.posture), limbs(x))[35:].mean()
        < joint_error(limbs(mean), limbs(x))[35:].mean()
    )


def test_a_performance_that_is_no_such_action_is_lost_and_said_so() -> None:
    generator = np.random.default_rng(4)
    x = performances(0, 25)[0]
    _, image = seen(x, generator, noise=1.0)
    image[30:] = camera.project(limbs(x[30:] + 2.5), VIEW)
    tracked = run(Likelihood(image, VIEW, 15.0))
    assert tracked.lost[35:].all()
    assert not tracked.lost[:30].any()
    assert np.isfinite(tracked.posture).all()
    assert tracked.effective_sample_size[35:].max() >= 1.0 - 1e-9


def test_a_body_without_joints_is_lost_and_the_prediction_stands() -> None:
    walk = performances(0, 25)[1:]
    placed = iter([True])

    def nowhere(x: np.ndarray) -> np.ndarray:
        return limbs(x) if next(placed, False) else np.full((len(x), JOINTS, 3), np.nan)

    tracked = track(
        *model(walk),
        Likelihood(np.zeros((3, JOINTS, 2)), VIEW, 5.0),
        to_joints=nowhere,
        n_particles=300,
        generator=np.random.default_rng(1),
    )
    assert tracked.lost.all()
    assert np.isneginf(tracked.log_evidence).all()
    np.testing.assert_allclose(tracked.effective_sample_size, 300.0)


# --- what the prior is worth ------------------------------------------------------------------------------


def test_a_held_out_performance_is_tracked_without_noise() -> None:
    """With many particles, a noise-free held-out performance is tracked with a mean error below 12 mm."""
    x = interpolate(performances(0, 25)[0], np.linspace(0.0, 59.0, 45) ** 1.2 / 59**0.2)
    true = limbs(x)
    likelihood = Likelihood(camera.project(true, VIEW), VIEW, 10.0)
    mean, _ = model(performances(0, 25)[1:])
    dynamics = Dynamics(nominal_rate=59 / 44, diffusion=0.1)
    tracked = run(likelihood, n_particles=20000, dynamics=dynamics)
    error = joint_error(limbs(tracked.posture), true)
    alone = joint_error(limbs(interpolate(mean, best_phase(true, limbs(mean)))), true)
    assert error.mean() < 12.0
    assert error.mean() < alone.mean() / 5
    assert not tracked.lost.any()


@pytest.mark.parametrize(("noise", "occluded", "n_particles"), [(20.0, 0.7, 300), (20.0, 0.0, 50)])
def test_the_prior_helps_where_particles_or_joints_are_few(
    noise: float, occluded: float, n_particles: int
) -> None:
    """The prior reduces errors with few particles or few visible joints, compared with no prior and with the mean
    alone.
    """
    mean, _ = model(performances(0, 25)[1:])
    errors: dict[object, list[float]] = {"mean": []}
    for seed in range(4):
        true, image = seen(
            performances(0, 25)[0], np.random.default_rng(seed), noise=noise, occluded=occluded
        )
        likelihood = Likelihood(image, VIEW, noise)
        for prior, q in ((True, 0.1), (False, 0.1), (False, 0.2), (False, 0.4), (False, 0.8)):
            tracked = run(
                likelihood, prior=prior, n_particles=n_particles, seed=seed, dynamics=Dynamics(diffusion=q)
            )
            errors.setdefault((prior, q), []).append(joint_error(limbs(tracked.posture), true).mean())
        errors["mean"].append(
            joint_error(limbs(interpolate(mean, best_phase(true, limbs(mean)))), true).mean()
        )
    means = {key: np.mean(value) for key, value in errors.items()}
    with_prior = means.pop((True, 0.1))
    assert with_prior < 0.8 * min(means.values()), (with_prior, means)


def test_the_evidence_says_which_action_it_was() -> None:
    x = performances(0, 25)[0]
    _, image = seen(x, np.random.default_rng(6), noise=20.0, occluded=0.5)
    likelihood = Likelihood(image, VIEW, 20.0)
    mean, sd = model(performances(0, 25)[1:])

    def evidence(mean: np.ndarray) -> float:
        tracked = track(
            mean,
            sd,
            likelihood,
            to_joints=limbs,
            n_particles=300,
            generator=np.random.default_rng(0),
        )
        return float(tracked.log_evidence.sum())

    assert evidence(mean) > evidence(mean[::-1]) + 10
    assert evidence(mean) > evidence(mean[:, ::-1]) + 10


def test_the_same_seed_gives_the_same_track_and_nothing_is_changed() -> None:
    _, image = seen(performances(0, 25)[0], np.random.default_rng(8), noise=5.0, occluded=0.2)
    mean, sd = model(performances(0, 25)[1:])
    retained = image.copy(), mean.copy(), sd.copy()
    first, second, other = (
        track(
            mean,
            sd,
            Likelihood(image, VIEW, 5.0),
            to_joints=limbs,
            n_particles=100,
            generator=np.random.default_rng(seed),
        )
        for seed in (3, 3, 4)
    )
    for name in vars(first):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert not np.array_equal(first.posture, other.posture)
    for before, after in zip(retained, (image, mean, sd), strict=True):
        np.testing.assert_array_equal(before, after)


def test_one_particle_follows_its_own_prediction() -> None:
    _, image = seen(performances(0, 25)[0], np.random.default_rng(8), noise=5.0)
    tracked = run(Likelihood(image, VIEW, 500.0), n_particles=1)
    np.testing.assert_allclose(tracked.effective_sample_size, 1.0)
    np.testing.assert_allclose(tracked.standard_deviation, 0.0, atol=1e-12)
    assert (np.diff(tracked.phase) >= 0).all()


# --- what a track is measured by --------------------------------------------------------------------------


@given(seed=seeds)
@settings(max_examples=20)
def test_the_best_phase_is_the_best_of_all(seed: int) -> None:
    generator = np.random.default_rng(seed)
    performance, mean = generator.standard_normal((6, 4, 3)), generator.standard_normal((9, 4, 3))
    performance[generator.random((6, 4)) < 0.3] = np.nan
    performance[:, 0] = 1.0
    distances = np.nansum((performance[:, None] - mean) ** 2, axis=(2, 3))
    np.testing.assert_array_equal(best_phase(performance, mean), distances.argmin(axis=1))


def test_errors_are_of_the_joints_and_not_of_the_place() -> None:
    true = np.random.default_rng(0).standard_normal((4, JOINTS, 3))
    np.testing.assert_allclose(joint_error(np.add(true, [3.0, 4.0, 0.0]), true), 0.0, atol=1e-12)
    moved = true.copy()
    moved[:, 0, 0] += 14.0
    np.testing.assert_allclose(joint_error(moved, true), 1.0)  # one of fourteen joints
    np.testing.assert_allclose(
        interpolate(true, np.array([0.0, 1.5, 3.0])), [true[0], true[1:3].mean(0), true[3]]
    )


# --- bad input --------------------------------------------------------------------------------------------


def test_a_mean_performance_that_has_no_place_is_refused() -> None:
    with rejects("not_finite", "sample 0 of the mean"):
        track(
            np.zeros((9, 5)), np.ones((9, 5)), Likelihood(np.zeros((4, JOINTS, 2)), VIEW, 1.0),
            to_joints=lambda x: np.full((len(x), 15, 3), np.inf), n_particles=10,
            generator=np.random.default_rng(0),
        )  # fmt: skip


def test_a_random_walk_may_step_by_more_than_the_learnt_deviation() -> None:
    Walk(np.zeros((2, 1)), np.ones((2, 1)), Dynamics(diffusion=2.0), prior=False)
