"""Tests of reconstructibility: against the null space of the basis, the printed equations, and cases with known
results.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import dct
from scipy.linalg import null_space

from pipeline.core.articulation import RayHits, ray_sphere
from pipeline.core.camera_paths import around, hand_held
from pipeline.core.pinhole import project_by_matrix
from pipeline.core.reconstructibility import (
    Reconstructibility,
    choice_residual,
    confidence_of_mirror_margin,
    estimated,
    of_clip,
    outside,
    reconstructibility,
    view_from_the_camera,
    viewing_angles,
)
from pipeline.synthetic.limbs import angular_limb
from tests.core.cameras import parallel, still
from tests.core.limbs import cartesian_limb
from tests.rejects import rejects
from tests.strategies import seeds


def cosines(frames: int, count: int) -> np.ndarray:
    """Return the orthonormal DCT-II basis (F, K), computed with SciPy's transform."""
    return np.asarray(dct(np.eye(frames), axis=0, norm="ortho")[:count].T)


def soft(frames: int, count: int) -> np.ndarray:
    """Return a soft basis (F, K), whose columns get shorter with increasing frequency."""
    return cosines(frames, count) / np.sqrt(1.0 + (np.arange(count) / 6.0) ** 6)


def seen(cameras: np.ndarray, chi: np.ndarray, parents: np.ndarray) -> tuple[RayHits, np.ndarray]:
    """Return the candidate positions of a limb, and the depth signs of the ground truth."""
    hits = ray_sphere(
        cameras, project_by_matrix(cameras, parents + chi), parents, float(np.linalg.norm(chi, axis=1).max())
    )
    return hits, np.where((chi * hits.rays.direction).sum(axis=1) >= 0.0, 1.0, -1.0)


@given(seed=seeds, away=st.floats(1.1, 50.0))
def test_the_angle_at_the_camera_is_that_of_the_printed_formula(seed: int, away: float) -> None:
    """The angle alpha at the camera equals the angle between the lines from the camera to both ends of the limb."""
    chi = np.random.default_rng(seed).standard_normal((9, 3))
    chi /= np.linalg.norm(chi, axis=1, keepdims=True)
    axis = np.tile([0.0, away, 0.0], (9, 1))
    gamma = viewing_angles(chi, axis)
    np.testing.assert_allclose(
        view_from_the_camera(gamma, away), viewing_angles(axis + chi, axis), atol=1e-12
    )


def test_a_basis_that_spans_the_angle_at_the_parent_does_not_span_the_one_at_the_camera() -> None:
    basis = cosines(40, 4)
    gamma = 1.5 + basis[:, 1:] @ np.array([1.5, -1.0, 0.5])
    assert outside(basis, gamma) < 1e-12
    near, far = (outside(basis, view_from_the_camera(gamma, away)) for away in (1.5, 100.0))
    assert near > 0.01
    assert far < 0.1 * near
    with rejects("out_of_range", "distance", value=0.5):
        view_from_the_camera(gamma, 0.5)


# --- the part outside -------------------------------------------------------------------------------------


@given(seed=seeds, frames=st.integers(3, 30), dimensions=st.sampled_from([0, 1, 3]), data=st.data())
def test_outside_is_the_part_in_the_null_space(
    seed: int, frames: int, dimensions: int, data: st.DataObject
) -> None:
    count = data.draw(st.integers(1, frames - 1))
    basis = cosines(frames, count)
    c = np.random.default_rng(seed).standard_normal((frames, dimensions) if dimensions else frames)
    beyond = null_space(basis.T)
    size = float(np.linalg.norm(c))
    assert outside(basis, c) == pytest.approx(np.linalg.norm(beyond.T @ c), rel=1e-9, abs=1e-13 * size)
    assert outside(basis, basis @ (basis.T @ c)) <= 1e-13 * size


@given(seed=seeds, frames=st.integers(3, 30), data=st.data())
def test_outside_a_soft_basis_is_what_a_ridge_leaves(seed: int, frames: int, data: st.DataObject) -> None:
    """The norm outside a soft basis equals the residual of ridge regression: c^T (I - B B^T) c = min |c - Theta a|² +
    a^T Lambda a.
    """
    count = data.draw(st.integers(1, frames - 1))
    c = np.random.default_rng(seed).standard_normal((frames, 3))
    theta, ridge = cosines(frames, count), (np.arange(count) / 6.0) ** 6
    stacked = np.vstack([theta, np.diag(np.sqrt(ridge))])
    target = np.vstack([c, np.zeros((count, 3))])
    left = target - stacked @ np.linalg.lstsq(stacked, target)[0]
    basis = soft(frames, count)
    size = float(np.linalg.norm(c))
    assert outside(basis, c) == pytest.approx(np.linalg.norm(left), rel=1e-9, abs=1e-12 * size)
    dense = np.eye(frames) - basis @ basis.T
    assert outside(basis, c) ** 2 == pytest.approx((c * (dense @ c)).sum(), rel=1e-9, abs=1e-12 * size**2)


def test_a_small_part_outside_is_not_lost_in_rounding() -> None:
    """A component outside the basis that is a billionth of the trajectory is not lost to rounding errors."""
    basis = cosines(50, 10)
    inside, beyond = basis @ np.ones(10), 1e-9 * cosines(50, 20)[:, 15]
    assert outside(basis, inside + beyond) == pytest.approx(1e-9, rel=1e-6)


# --- the measure ------------------------------------------------------------------------------------------


@given(seed=seeds)
def test_a_truth_inside_the_basis_is_reconstructible_without_bound(seed: int) -> None:
    generator = np.random.default_rng(seed)
    chi = cartesian_limb(generator, 40, bandwidth=4)
    camera = hand_held(generator, around(40, target=np.zeros(3), sweep_rad=1.0), target=np.zeros(3))
    v = camera.rays(camera.project(chi))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    along = (chi * v).sum(axis=1)
    half_chord, signs = np.abs(along)[:, None] * v, np.where(along >= 0.0, 1.0, -1.0)
    eta = reconstructibility(cosines(40, 4), chi - along[:, None] * v, half_chord, signs)
    assert eta.ratio > 1e10  # rays bring a rounding of their own
    assert eta.confidence == "green"
    assert eta.impostor == pytest.approx(outside(cosines(40, 4), chi - 2 * along[:, None] * v))


@given(seed=seeds, azimuth=st.floats(-3.0, 3.0))
def test_parallel_rays_are_a_tie_on_either_reading(seed: int, azimuth: float) -> None:
    generator = np.random.default_rng(seed)
    limb = angular_limb(generator, 30, bandwidth=5)
    parents = 100.0 * generator.standard_normal((30, 3))
    cameras = parallel(30, target=np.zeros(3), azimuth_rad=azimuth)
    hits, signs = seen(cameras, limb.relative, parents)
    for reading in ("vector", "angle"):
        eta = reconstructibility(
            cosines(30, 6), hits.middle, hits.half_chord, signs, reading=reading, axis=hits.rays.axis
        )
        assert eta.ratio == pytest.approx(1.0, rel=1e-6)
        assert eta.confidence == "amber"
    flat = np.tile([1.0, 2.0, 3.0], (30, 1))  # truth and impostor both inside
    assert reconstructibility(cosines(30, 2), flat, flat, np.ones(30)).ratio == 1.0


def test_the_truth_and_the_impostor_change_places_with_the_signs() -> None:
    limb = angular_limb(np.random.default_rng(3), 30, bandwidth=4)
    hits, signs = seen(still(30, target=np.zeros(3)).matrix, limb.relative, np.zeros((30, 3)))
    first = reconstructibility(cosines(30, 6), hits.middle, hits.half_chord, signs)
    other = reconstructibility(cosines(30, 6), hits.middle, hits.half_chord, -signs)
    assert first.ratio == pytest.approx(1.0 / other.ratio)
    assert (first.truth, first.impostor) == pytest.approx((other.impostor, other.truth))
    assert first.truth == pytest.approx(outside(cosines(30, 6), limb.relative), rel=1e-6)


def test_a_shaking_camera_makes_limbs_reconstructible_and_a_still_one_does_not() -> None:
    """A shaking camera gives a high median reconstructibility, a still camera a low one, and a smoothly moving one lies
    between.
    """
    basis = cosines(60, 12)
    medians = []
    for path in ("still", "moving", "shaking"):
        etas = []
        for seed in range(40):
            generator = np.random.default_rng(seed)
            limb = angular_limb(generator, 60, bandwidth=5)
            parents = cartesian_limb(generator, 60, length_mm=300.0, bandwidth=5)
            camera = around(60, target=np.zeros(3), sweep_rad=0.0 if path == "still" else 1.5)
            if path == "shaking":
                camera = hand_held(generator, camera, target=np.zeros(3), tremor_mm=100.0)
            hits, signs = seen(camera.matrix, limb.relative, parents)
            etas.append(reconstructibility(basis, hits.middle, hits.half_chord, signs).ratio)
        medians.append(float(np.median(etas)))
    assert medians[0] < medians[1] < medians[2]
    assert medians[2] > 2.0


# --- as printed -------------------------------------------------------------------------------------------


@given(seed=seeds, distance=st.floats(1.5, 50.0))
def test_the_angle_is_that_of_the_printed_formula(seed: int, distance: float) -> None:
    """The angle at the camera equals the printed alpha = atan(sin gamma / (l + cos gamma)) for both candidates."""
    generator = np.random.default_rng(seed)
    camera = still(9, target=np.zeros(3), distance_mm=300.0 * distance)
    chi = angular_limb(generator, 9, length_mm=300.0).relative
    hits, signs = seen(camera.matrix, chi, np.zeros((9, 3)))
    to_parent = -camera.centre
    np.testing.assert_allclose(hits.rays.axis, to_parent / (300.0 * distance), atol=1e-9)
    alphas = []
    for s in (signs, -signs):
        gamma = viewing_angles(hits.chosen(s), hits.rays.axis)
        alphas.append(np.arctan2(np.sin(gamma), distance + np.cos(gamma)))
    actual = viewing_angles(chi - camera.centre, to_parent)
    np.testing.assert_allclose(alphas[0], actual, atol=1e-7)
    np.testing.assert_allclose(alphas[1], actual, atol=1e-7)


def test_the_printed_angle_tends_to_one_far_from_the_camera() -> None:
    limb = angular_limb(np.random.default_rng(1), 40, bandwidth=5)
    off = []
    for distance in (1e4, 1e5, 1e6):
        cameras = still(40, target=np.zeros(3), distance_mm=distance).matrix
        hits, signs = seen(cameras, limb.relative, np.zeros((40, 3)))
        eta = reconstructibility(
            cosines(40, 6), hits.middle, hits.half_chord, signs, reading="angle", axis=hits.rays.axis
        )
        off.append(abs(eta.ratio - 1.0))
    assert off[0] > 5 * off[1] > 25 * off[2] > 0.0


@given(seed=seeds, dimensions=st.sampled_from([0, 3]))
def test_the_printed_identity_holds_for_any_choice(seed: int, dimensions: int) -> None:
    """The equations 16, 17 and 18 of the paper agree for random choices of candidates."""
    generator = np.random.default_rng(seed)
    basis = cosines(20, 5)
    truth, impostor = generator.standard_normal((2, 20, dimensions) if dimensions else (2, 20))
    b = generator.integers(0, 2, 20)
    answer = choice_residual(basis, truth, impostor, b)
    chosen = estimated(truth, impostor, b)
    a, *_ = np.linalg.lstsq(basis, chosen)
    sixteen = np.linalg.norm(basis @ a - chosen) ** 2
    B, eye = np.diag(b), np.eye(20)
    seventeen = np.linalg.norm(basis @ a - (eye - B) @ truth - B @ impostor) ** 2
    beyond = null_space(basis.T)
    parts = [
        (eye - B) @ basis @ (basis.T @ truth) + B @ basis @ (basis.T @ impostor),
        (eye - B) @ beyond @ (beyond.T @ truth) + B @ beyond @ (beyond.T @ impostor),
    ]
    eighteen = np.linalg.norm(basis @ a - parts[0] - parts[1]) ** 2
    assert [sixteen, seventeen, eighteen] == pytest.approx([answer.value] * 3, rel=1e-9)
    np.testing.assert_allclose(answer.within, parts[0].reshape(20, -1), atol=1e-9)
    np.testing.assert_allclose(answer.beyond, parts[1].reshape(20, -1), atol=1e-9)
    assert outside(basis, answer.within + answer.beyond) ** 2 == pytest.approx(answer.value)


def test_a_truth_inside_the_basis_is_the_only_choice_without_a_residual() -> None:
    """If the truth lies in the basis, only the true choice of candidates has no residual, among all 2^10 choices."""
    generator = np.random.default_rng(0)
    basis = cosines(10, 3)
    truth = basis @ generator.standard_normal((3, 3))
    impostor = generator.standard_normal((10, 3))
    values = {
        b: choice_residual(basis, truth, impostor, np.array(b)).value for b in product((0, 1), repeat=10)
    }
    best, second = sorted(values, key=lambda b: values[b])[:2]
    assert best == (0,) * 10
    assert values[best] < 1e-28
    assert values[second] > 1e-3
    everywhere = choice_residual(basis, truth, impostor, np.ones(10))
    assert np.sqrt(everywhere.value) == pytest.approx(outside(basis, impostor))


# --- limbs together, confidence ----------------------------------------------------------------------------


def test_a_clip_is_its_limbs_together() -> None:
    limbs = [Reconstructibility(2.0, 3.0, 6.0), Reconstructibility(0.5, 4.0, 2.0)]
    clip = of_clip(limbs)
    assert clip.truth == pytest.approx(5.0)
    assert clip.impostor == pytest.approx(np.sqrt(40.0))
    assert clip.ratio == pytest.approx(np.sqrt(40.0) / 5.0)
    assert of_clip([Reconstructibility(np.inf, 0.0, 1.0)]).ratio == np.inf
    assert of_clip(limbs[:1]) == limbs[0]
    with rejects("no_limbs"):
        of_clip([])


@pytest.mark.parametrize(
    ("eta", "confidence"),
    [(0.0, "red"), (0.94, "red"), (0.95, "amber"), (2.0, "amber"), (2.01, "green"), (np.inf, "green")],
)
def test_confidence_by_reconstructibility(eta: float, confidence: str) -> None:
    assert Reconstructibility(eta, 1.0, eta).confidence == confidence


@pytest.mark.parametrize(
    ("margin", "confidence"), [(1.0, "red"), (1.3, "amber"), (2.0, "amber"), (2.1, "green")]
)
def test_confidence_by_the_mirror_margin(margin: float, confidence: str) -> None:
    assert confidence_of_mirror_margin(margin) == confidence


# --- refusals ---------------------------------------------------------------------------------------------

BASIS, ONES, SIGNS = cosines(5, 2), np.ones((5, 3)), np.ones(5)


@pytest.mark.parametrize(
    ("arguments", "options", "rejection"),
    [
        ((BASIS, ONES, ONES[:4], SIGNS), {}, rejects("wrong_shape", "half chord", shape=(4, 3))),
        ((BASIS, ONES, ONES, 0 * SIGNS), {}, rejects("not_signs", "signs")),
        ((BASIS[:4], ONES, ONES, SIGNS), {}, rejects("mismatch")),
        ((2 * BASIS, ONES, ONES, SIGNS), {}, rejects("not_orthonormal", norm=pytest.approx(2.0))),
        ((BASIS, ONES * np.nan, ONES, SIGNS), {}, rejects("not_finite", "frame 0")),
        ((cosines(2, 1), ONES[:2], ONES[:2], SIGNS[:2]), {}, rejects("too_few_frames", frames=2)),
        ((BASIS, ONES, ONES, SIGNS), {"reading": "angle"}, rejects("wrong_shape", "axis", shape=())),
        (
            (BASIS, ONES, ONES, SIGNS),
            {"reading": "angle", "axis": ONES[:2]},
            rejects("wrong_shape", "axis", shape=(2, 3)),
        ),
        (
            (BASIS, ONES, ONES, SIGNS),
            {"reading": "tangent"},
            rejects("unknown_choice", "reading", value="tangent"),
        ),
    ],
)
def test_what_has_no_reconstructibility_is_refused(
    arguments: tuple, options: dict, rejection: AbstractContextManager
) -> None:
    with rejection:
        reconstructibility(*arguments, **options)


def test_choices_and_margins_that_are_none_are_refused() -> None:
    for b in (np.full(5, 2), np.zeros(4)):
        with rejects("mismatch"):
            estimated(ONES, ONES, b)
    with rejects("not_orthonormal"):
        choice_residual(0.5 * BASIS, ONES, ONES, np.zeros(5))
    with rejects("not_finite", "margin"):
        confidence_of_mirror_margin(np.nan)
