"""Tests of reconstructed coefficients: limits, independent minimiser, finite differences, hidden joints, error bars."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from pipeline.core import fourier, linear_model, walking
from pipeline.core.reconstruction import from_known_views
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers as synthetic
from tests.rejects import rejects
from tests.strategies import angles, seeds, walkers
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import Noise, Prior, Shrinkage, Tolerances

HIDDEN = np.isin(WALKER15.joints, ["left_wrist", "head"])
PLAIN = Shrinkage(mirror=False, within_harmonic=0.0, diagonal=0.0, extra_variance=0.0)


def learnt(seed: int, count: int = 14, shrinkage: Shrinkage | None = None) -> tuple[Prior, np.ndarray]:
    """Return a prior that is learnt from synthetic walkers, and a walker who is not among them."""
    people = walkers(np.random.default_rng(seed), count + 1)
    weights = np.full(count, 1.0 / count)
    return anatomical.fit(people[1:], weights, shrinkage or Shrinkage()), people[0]


def seen_from(walker: np.ndarray, view: np.ndarray) -> np.ndarray:
    """Return the coefficients (A, 1, 45 B) of a walker in the image axes of A views."""
    axes = anatomical.image_axes(view)
    return np.einsum("aij,kjb->akib", axes, anatomical.by_joint(walker)).reshape(len(view), 1, -1)


@given(seed=seeds, angle=angles, noise_variance=st.floats(1.0, 1000.0))
@settings(max_examples=20, deadline=None)
def test_without_its_parts_it_is_approach_two(seed: int, angle: float, noise_variance: float) -> None:
    """Without mirror images, shrinkage and bone lengths, the result is MAP with all eigenwalkers [zhang2007 3.15]."""
    people = walkers(np.random.default_rng(seed), 12)
    view = np.array([angle, -angle])
    prior = anatomical.fit(people[1:], np.full(11, 1 / 11), PLAIN)
    conditional = anatomical.condition(prior, view, noise=Noise(variance=noise_variance, share=0.0))
    result = conditional.expect(seen_from(people[0], view)[..., ~conditional.unknown])[:, 0]
    rows = linear_model.flatten(people)
    expected = from_known_views(linear_model.fit(rows[1:], 10), rows[0], view, noise_variance=noise_variance)
    missing = result.reshape(2, 15, 5).swapaxes(1, 2)
    np.testing.assert_allclose(missing, expected.missing, rtol=0, atol=1e-7)


@pytest.mark.parametrize("hidden", [False, True], ids=["all seen", "hidden joints"])
def test_the_conditional_is_that_of_the_formula(hidden: bool) -> None:
    """The Gaussian distribution of the unknown coefficients equals the textbook formula with full matrices."""
    prior, walker = learnt(12)
    view = np.array([-0.7, 0.3])
    result = anatomical.condition(
        prior,
        view,
        noise=Noise(bias=4.0),
        hidden=HIDDEN if hidden else anatomical.NOTHING_HIDDEN,
    )
    u, o = result.unknown, ~result.unknown
    rows = seen_from(walker, view)
    for a, axes in enumerate(anatomical.image_axes(view)):
        C = np.einsum("pi,kiblju,qj->kpblqu", axes, prior.covariance, axes).reshape(225, 225)
        m = np.einsum("pi,kib->kpb", axes, prior.mean).ravel()
        floor = np.broadcast_to(np.array([16.0, 0.0, 0.0, 0.0, 0.0]), (15, 3, 5)).ravel()[o]
        gain = C[np.ix_(u, o)] @ np.linalg.inv(C[np.ix_(o, o)] + np.diag(100 + 0.2 * np.diag(C)[o] + floor))
        expected = m[u] + gain @ (rows[a, 0, o] - m[o])
        np.testing.assert_allclose(result.expect(rows[..., o])[a, 0], expected, atol=1e-8)
        np.testing.assert_allclose(result.covariance[a], C[np.ix_(u, u)] - gain @ C[np.ix_(o, u)], atol=1e-7)


@pytest.mark.parametrize("mirror", [False, True], ids=["walks", "mirror images, too"])
@pytest.mark.parametrize("hidden", [anatomical.NOTHING_HIDDEN, HIDDEN], ids=["all seen", "hidden joints"])
def test_the_expectation_from_walks_is_that_of_their_covariance(mirror: bool, hidden: np.ndarray) -> None:
    rng, view, variances = np.random.default_rng(3), np.radians([-70.0, 20.0]), [30.0, 700.0]
    walks = anatomical.Walks(100.0 * rng.standard_normal((9, 5, 15, 3)), mirror=mirror)
    some, weights = np.array([0, 2, 3, 5, 8]), np.full(5, 0.2)
    plain = Shrinkage(mirror=mirror, within_harmonic=0.0, diagonal=0.0, extra_variance=0.0)
    prior, unknown = walks.fit(some, weights, plain), anatomical.unknown_coefficients(hidden, 5)
    observed = 100.0 * rng.standard_normal((2, 3, int((~unknown).sum())))
    mean, rows, _ = walks.centred(some, weights)
    result = anatomical.expect_from_walks(
        mean, rows, observed, view, unknown=unknown, noise_variances=variances
    )
    for variance, of_variance in zip(variances, result, strict=True):
        noise = Noise(variance=variance, share=0.0)
        conditional = anatomical.condition(prior, view, noise=noise, hidden=hidden)
        np.testing.assert_allclose(of_variance, conditional.expect(observed), rtol=1e-8, atol=1e-7)


def test_a_noise_variance_below_rounding_is_refused() -> None:
    unknown = anatomical.unknown_coefficients(anatomical.NOTHING_HIDDEN, 5)
    walks, observed = np.full((2, 225), 1024.0), np.zeros((1, 1, int((~unknown).sum())))
    with rejects("too_little_noise"):
        anatomical.expect_from_walks(
            np.zeros(225), walks, observed, np.zeros(1), unknown=unknown, noise_variances=[1e-12]
        )


def test_lengths_without_limits_leave_the_linear_part() -> None:
    prior, walker = learnt(1)
    view = np.radians([-40.0, 0.0, 90.0])
    conditional = anatomical.condition(prior, view, noise=Noise())
    observed = seen_from(walker, view)[..., ~conditional.unknown]
    endless = Tolerances(
        within=np.full(len(anatomical.BONES), np.inf), pairs=np.full(len(anatomical.PAIRS), np.inf)
    )
    result = anatomical.fit_lengths(conditional, observed, endless, with_covariance=True)
    np.testing.assert_allclose(result.unknown, conditional.expect(observed), atol=1e-9)
    np.testing.assert_allclose(result.covariance[:, 0], conditional.covariance, rtol=1e-6, atol=1e-6)
    assert result.converged.all()


@pytest.mark.parametrize("hidden", [anatomical.NOTHING_HIDDEN, HIDDEN], ids=["all seen", "hidden joints"])
def test_the_derivatives_are_those_of_finite_differences(hidden: np.ndarray) -> None:
    prior, walker = learnt(2)
    rows = seen_from(walker, np.array([0.6]))[0, 0]
    unknown = anatomical.unknown_coefficients(hidden, 5)
    limits = anatomical.tolerances(prior)
    lengths, first = anatomical.Lengths(unknown, rows[None, ~unknown], limits), np.zeros(1, dtype=int)
    start = rows[None, unknown]
    gradient, matrix = lengths.slope(start, first)[1][0], lengths.matrix(start, first, exact=True)[0]
    rng = np.random.default_rng(0)
    for _ in range(4):
        way, step = rng.standard_normal(start.shape[1]), 1e-4
        (ahead, more), (behind, less) = (lengths.slope(start + h * way, first) for h in (step, -step))
        assert (ahead - behind) / (2 * step) == pytest.approx(2 * gradient @ way, rel=1e-6)
        np.testing.assert_allclose(
            (more - less)[0] / (2 * step), matrix @ way, rtol=1e-5, atol=1e-6 * np.abs(matrix).max()
        )


@pytest.mark.parametrize("hidden", [anatomical.NOTHING_HIDDEN, HIDDEN], ids=["all seen", "hidden joints"])
def test_an_independent_minimiser_finds_the_same_walker(hidden: np.ndarray) -> None:
    """A quasi-Newton method finds the same minimum of an objective that is written independently."""
    prior, walker = learnt(3)
    limits = anatomical.tolerances(prior)
    view = np.array([0.4])
    conditional = anatomical.condition(prior, view, noise=Noise(), hidden=hidden)
    unknown = conditional.unknown
    rows = seen_from(walker, view)
    observed = rows[..., ~unknown]
    result = anatomical.fit_lengths(conditional, observed, limits)
    mean = conditional.expect(observed)[0, 0]
    P = np.linalg.inv(conditional.covariance[0])
    phases = np.arange(20) / 20
    weight = 4 / 20

    def objective(z: np.ndarray) -> float:
        u = mean + root @ z
        whole = rows[0, 0].copy()
        whole[unknown] = u
        motion = fourier.synthesise(np.moveaxis(whole.reshape(15, 3, 5), -1, 0), 1.0, phases)
        lengths = np.stack([np.linalg.norm(motion[:, a] - motion[:, b], axis=1) for a, b in anatomical.BONES])
        middle = lengths.mean(axis=1)
        within = weight * (((lengths - middle[:, None]) / limits.within[:, None]) ** 2).sum()
        left, right = np.array(anatomical.PAIRS).T
        pairs = (((middle[left] - middle[right]) / limits.pairs) ** 2).sum()
        return float((u - mean) @ P @ (u - mean) + within + pairs)

    root = np.linalg.cholesky(conditional.covariance[0])
    before = np.linalg.solve(root, result.unknown[0, 0] - mean)
    assert objective(before) == pytest.approx(result.cost[0, 0], rel=1e-7)
    rng = np.random.default_rng(0)
    start = before + 0.02 * rng.standard_normal(len(before))
    again = minimize(objective, start, method="BFGS", options={"gtol": 1e-4, "maxiter": 25})
    assert objective(before) <= again.fun + 1e-6
    for _ in range(20):  # and no step from it falls
        assert objective(before + 0.01 * rng.standard_normal(len(before))) > objective(before)


def test_the_deviations_are_those_of_a_sampler_of_the_posterior() -> None:
    """Standard deviations equal those of posterior samples that a Metropolis sampler draws.

    The sampler uses an independent objective, whose density is exp(-J / 2).
    """
    people = synthetic.walking_population(np.random.default_rng(7), male=8, female=8, duration_s=3.3)
    rate_hz = people.frame_rate_hz
    walks = np.stack(
        [
            fourier.represent(
                walking.treadmill_equivalent(p, rate_hz, locomotion="treadmill"), rate_hz
            ).coefficients
            for p in people.positions_mm
        ]
    )
    prior, walker = anatomical.fit(walks[1:], np.full(15, 1 / 15), Shrinkage()), walks[0]
    limits = anatomical.tolerances(prior)
    view, rng = np.array([0.4]), np.random.default_rng(0)
    conditional = anatomical.condition(prior, view, noise=Noise())
    rows, unknown = seen_from(walker, view)[0, 0], conditional.unknown
    result = anatomical.fit_lengths(conditional, rows[None, None, ~unknown], limits, with_covariance=True)
    mean, P = conditional.expect(rows[None, None, ~unknown])[0, 0], np.linalg.inv(conditional.covariance[0])
    basis = fourier.cycle_basis(fourier.equal_phases(20), 5)
    (starts, ends), (left, right) = np.array(anatomical.BONES).T, np.array(anatomical.PAIRS).T

    def objective(u: np.ndarray) -> np.ndarray:
        """Return the cost J (n,) of n walkers."""
        whole = np.tile(rows, (len(u), 1))
        whole[:, unknown] = u
        motion = whole.reshape(-1, 15, 3, 5) @ basis.T
        lengths = np.linalg.norm(motion[:, ends] - motion[:, starts], axis=2)
        middle = lengths.mean(axis=-1)
        within = 4 / 20 * (((lengths - middle[..., None]) / limits.within[:, None]) ** 2).sum(axis=(1, 2))
        pairs = (((middle[:, left] - middle[:, right]) / limits.pairs) ** 2).sum(axis=1)
        return np.asarray(((u - mean) @ P * (u - mean)).sum(axis=1) + within + pairs)

    chains, step = 120, 1.6 / np.sqrt(unknown.sum())
    root = np.linalg.cholesky(result.covariance[0, 0])
    start = np.tile(result.unknown[0, 0], (chains, 1))
    cost, retained = objective(start), []
    for number in range(1000):
        moved = start + step * rng.standard_normal(start.shape) @ root.T
        proposed = objective(moved)
        used = np.log(rng.random(chains)) < (cost - proposed) / 2.0
        start[used], cost[used] = moved[used], proposed[used]
        if number > 400 and number % 50 == 0:
            retained.append(start.copy())
    drawn = anatomical.at_instants(np.concatenate(retained).reshape(-1, 15, 5), 6).std(axis=0)
    sd = anatomical.deviation_at_instants(result.covariance[0, 0], 5, 6)
    linear = anatomical.deviation_at_instants(conditional.covariance[0], 5, 6)
    assert (drawn / sd).mean() == pytest.approx(1.0, abs=0.06)
    assert 0.7 < (drawn / sd).min() <= (drawn / sd).max() < 1.3  # Laplace's approximation is one
    assert (linear / drawn).mean() > 1.25  # what the bones tell


def test_all_observations_converge_and_do_not_depend_on_their_company() -> None:
    prior, walker = learnt(4)
    other = learnt(5)[1]
    view = np.radians([-90.0, -45.0, 0.0, 30.0])
    conditional = anatomical.condition(prior, view, noise=Noise())
    both = np.concatenate([seen_from(walker, view), seen_from(other, view)], axis=1)
    limits = anatomical.tolerances(prior)
    together = anatomical.fit_lengths(conditional, both[..., ~conditional.unknown], limits)
    alone = anatomical.fit_lengths(conditional, both[:, 1:, ~conditional.unknown], limits)
    assert together.converged.all()
    np.testing.assert_allclose(together.unknown[:, 1:], alone.unknown, atol=1e-6)


def test_the_mirror_image_from_the_other_side_is_the_mirrored_answer() -> None:
    prior, walker = learnt(6)
    angle = np.array([0.7])
    limits = anatomical.tolerances(prior)
    missing = []
    for w, view in ((walker, -angle), (fourier.mirrored(walker), angle)):
        conditional = anatomical.condition(prior, view, noise=Noise())
        observed = seen_from(w, view)[..., ~conditional.unknown]
        missing.append(anatomical.fit_lengths(conditional, observed, limits).unknown[0, 0].reshape(15, 5))
    back = missing[1][list(WALKER15.mirror)]
    back[:, 1:3] *= -1.0
    np.testing.assert_allclose(back, missing[0], atol=1e-5)


def test_a_hidden_joint_is_recovered_from_the_others_and_kept_off_the_seen() -> None:
    """A hidden joint is estimated better from the visible joints than by its mean.

    The true position of the hidden joint has no influence.
    """
    prior, walker = learnt(7, count=30)
    view = np.array([0.3])
    conditional = anatomical.condition(prior, view, noise=Noise(), hidden=HIDDEN)
    assert conditional.unknown.sum() == 15 * 5 + 2 * 2 * 5
    spoiled = walker.copy()
    spoiled[:, HIDDEN] += 1e3
    first, second = (
        conditional.expect(seen_from(w, view)[..., ~conditional.unknown]) for w in (walker, spoiled)
    )
    np.testing.assert_array_equal(first, second)


def test_a_floor_widens_the_posterior_and_the_tolerances() -> None:
    prior, _ = learnt(8)
    view = np.array([0.2])
    sharp = anatomical.condition(prior, view, noise=Noise())
    blunt = anatomical.condition(prior, view, noise=Noise(bias=10.0, slow=3.0))
    assert np.linalg.eigvalsh(blunt.covariance[0] - sharp.covariance[0])[0] > -1e-6
    narrow, wide = anatomical.tolerances(prior), anatomical.tolerances(prior, bias=10.0, slow=3.0)
    assert (wide.within > narrow.within).all()
    assert (wide.pairs > narrow.pairs).all()


def test_without_any_variance_the_conditional_is_refused() -> None:
    prior, _ = learnt(9, shrinkage=PLAIN)
    with rejects("no_variance"):
        anatomical.condition(prior, np.array([0.0]), noise=Noise(variance=0.0, share=0.0))


# --- bars ---------------------------------------------------------------------------------------------------


def test_deviations_at_instants_are_those_of_samples() -> None:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((10, 10))
    sd = anatomical.deviation_at_instants(root @ root.T, 5, 6)
    drawn = (rng.standard_normal((20000, 10)) @ root.T).reshape(-1, 2, 5)
    np.testing.assert_allclose(sd, anatomical.at_instants(drawn, 6).std(axis=0), rtol=0.03)


def test_multipliers_are_quantiles_of_the_others() -> None:
    rng = np.random.default_rng(1)
    z = np.abs(rng.standard_normal((6, 40, 3)))
    groups = np.array([0, 1, 0])
    result = anatomical.multipliers_without(z, groups, np.array([0.5, 0.95]))
    np.testing.assert_allclose(result[2, 0, 1], np.quantile(np.delete(z, 2, axis=0)[..., [0, 2]], 0.95))
    spoiled = z.copy()
    spoiled[2] = 1e6
    again = anatomical.multipliers_without(spoiled, groups, np.array([0.5, 0.95]))
    np.testing.assert_array_equal(again[2], result[2])
    assert (again[0] > result[0]).any()


# --- view -----------------------------------------------------------------------------------------------------


def test_the_costs_are_minus_twice_the_log_density_on_both_sides() -> None:
    prior, walker = learnt(10)
    displayed = seen_from(walker, np.array([0.5]))[0].reshape(1, 15, 3, 5)[:, :, :2]
    costs = anatomical.view_costs(prior, displayed, 12, noise=Noise())
    for g, beta in enumerate(anatomical.circle(12)):
        axes = anatomical.image_axes(np.array([beta]))[0, :2]
        C = np.einsum("pi,kiblju,qj->kpblqu", axes, prior.covariance, axes)
        matrix = C.reshape(150, 150)
        matrix = matrix + np.diag(100.0 + 0.2 * np.diag(matrix))
        off = (displayed[0] - np.einsum("pi,kib->kpb", axes, prior.mean)).ravel()
        target = off @ np.linalg.solve(matrix, off) + np.linalg.slogdet(matrix)[1]
        assert costs[0, g] == pytest.approx(target, rel=1e-9)


@pytest.mark.parametrize("angle_deg", [-170.0, -45.0, 3.3, 90.0])
def test_the_highest_mode_is_the_true_view(angle_deg: float) -> None:
    prior, walker = learnt(11, count=20)
    displayed = seen_from(walker, np.radians([angle_deg]))[0].reshape(1, 15, 3, 5)[:, :, :2]
    result = anatomical.posterior_of(anatomical.view_costs(prior, displayed, 72, noise=Noise()))
    off = np.degrees(result.angle_rad[0]) - angle_deg
    assert abs((off + 180.0) % 360.0 - 180.0) < 5.0
    assert result.other_cost[0] > 0.0


def test_a_smooth_cost_gives_its_own_mode_and_no_other() -> None:
    circle = anatomical.circle(360)
    off = np.mod(circle - 0.31 + np.pi, 2 * np.pi) - np.pi
    result = anatomical.posterior_of((2 * (1 - np.cos(off)) / 0.05**2)[None])
    assert result.angle_rad[0] == pytest.approx(0.31, abs=1e-4)
    assert result.other_cost[0] == np.inf
