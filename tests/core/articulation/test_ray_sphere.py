"""Tests of ray-sphere intersections: printed formula, hand-computed cases, distant cameras, and bad input."""

from __future__ import annotations

from contextlib import AbstractContextManager
from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import block_diag

from pipeline.core.articulation import ROBUST_QUANTILE, RayHits, RayStatus, ray_sphere
from pipeline.core.articulation.rays import cast_rays
from pipeline.core.camera_paths import around, hand_held
from pipeline.core.pinhole import Pinhole, project_by_matrix
from tests.core.cameras import off_centre, parallel, still
from tests.rejects import rejects
from tests.strategies import seeds

AT_ORIGIN = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]])
"""Matrix of a camera at the origin that looks along z."""

FRAMES = 12


def limb(seed: int, *, frames: int = FRAMES, radius: float = 300.0) -> tuple[np.ndarray, np.ndarray]:
    """Return random parent positions (F, 3) near the origin, and limb vectors (F, 3) of one length."""
    generator = np.random.default_rng(seed)
    away = generator.standard_normal((frames, 3))
    return 200.0 * generator.standard_normal((frames, 3)), radius * away / np.linalg.norm(
        away, axis=1, keepdims=True
    )


def camera(seed: int, distance_mm: float = 4000.0) -> Pinhole:
    generator = np.random.default_rng(seed)
    path = around(
        FRAMES,
        target=np.zeros(3),
        sweep_rad=generator.uniform(-3, 3),
        distance_mm=distance_mm,
        height_mm=generator.uniform(-500, 500),
    )
    return hand_held(generator, off_centre(path), target=np.zeros(3))


def as_printed(
    P: np.ndarray, pixel: np.ndarray, parent: np.ndarray, radius: float, number: type[float] | type[Fraction]
) -> tuple[np.ndarray, np.ndarray]:
    """Return far and near candidates by the printed formulas (equations 8 and 9), in doubles or in exact fractions."""
    P, parent, homogeneous = (
        np.array([number(float(x)) for x in a.ravel()], dtype=object).reshape(a.shape)
        for a in (P, parent, np.append(pixel, 1.0))
    )
    M = P[:, :3]
    # Of fractions numpy has a cross product from 2.3 on.
    across = [
        np.roll(a, -1) * np.roll(b, -2) - np.roll(a, -2) * np.roll(b, -1)
        for a, b in zip(np.roll(M, -1, 0), np.roll(M, -2, 0), strict=True)
    ]
    inverse = np.stack(across, axis=1) / (M[0] * across[0]).sum()
    C = -(inverse * P[:, 3]).sum(axis=1)
    v = (inverse * homogeneous).sum(axis=1)
    dC = C - parent
    vC, vv = (v * dC).sum(), (v * v).sum()
    root = square_root(vC**2 - vv * ((dC * dC).sum() - number(radius) ** 2))
    far, near = (((-vC + sign * root) / vv * v + dC).astype(float) for sign in (1, -1))
    return far, near


def square_root(x: float | Fraction) -> float | Fraction:
    """Return the square root of a number; for a fraction, to sixty digits."""
    if isinstance(x, float):
        return float(np.sqrt(x))
    with localcontext(prec=60):
        return Fraction((Decimal(x.numerator) / Decimal(x.denominator)).sqrt())


# --- the candidates ---------------------------------------------------------------------------------------


@given(seed=seeds, distance=st.sampled_from([1500.0, 4e3, 1e5, 1e7]))
def test_candidates_are_those_of_the_printed_formula_without_rounding(seed: int, distance: float) -> None:
    parents, chi = limb(seed)
    cameras = camera(seed, distance)
    pixels = cameras.project(parents + chi)
    hits = ray_sphere(cameras.matrix, pixels, parents, 300.0)
    for f in np.flatnonzero(np.linalg.norm(hits.half_chord, axis=1) > 1.0):
        far, near = as_printed(cameras.matrix[f], pixels[f], parents[f], 300.0, Fraction)
        np.testing.assert_allclose(hits.far[f], far, rtol=0, atol=1e-8)
        np.testing.assert_allclose(hits.near[f], near, rtol=0, atol=1e-8)


@pytest.mark.parametrize(("distance", "lost"), [(1e7, 3e-4), (1e9, 1.0)])
def test_from_afar_the_printed_formula_loses_what_this_one_keeps(distance: float, lost: float) -> None:
    """The printed formula loses all digits for distant cameras; ours keeps errors below 1e-10 mm."""
    ours, printed = [], []
    for seed in range(3):
        parents, chi = limb(seed)
        camera = still(FRAMES, target=np.zeros(3), distance_mm=distance)
        pixels = camera.project(parents + chi)
        hits = ray_sphere(camera.matrix, pixels, parents, 300.0)
        for f in np.flatnonzero(np.linalg.norm(hits.half_chord, axis=1) > 1.0):
            exact, plain = (
                as_printed(camera.matrix[f], pixels[f], parents[f], 300.0, number)[0]
                for number in (Fraction, float)
            )
            ours.append(np.linalg.norm(hits.far[f] - exact))
            printed.append(np.linalg.norm(plain - exact))
    assert max(ours) < 1e-10
    assert max(printed) > lost


@given(seed=seeds)
def test_the_truth_is_one_of_the_candidates_and_both_are_seen_where_it_is(seed: int) -> None:
    parents, chi = limb(seed)
    cameras = camera(seed)
    pixels = cameras.project(parents + chi)
    hits = ray_sphere(cameras.matrix, pixels, parents, 300.0)
    towards = np.sign((chi * hits.rays.direction).sum(axis=1))
    np.testing.assert_allclose(hits.chosen(towards), chi, atol=1e-3)  # near tangents amplify rounding
    assert np.median(np.linalg.norm(hits.chosen(towards) - chi, axis=1)) < 1e-9
    for candidate in (hits.far, hits.near):
        np.testing.assert_allclose(cameras.project(parents + candidate), pixels, atol=1e-7)
        np.testing.assert_allclose(np.linalg.norm(candidate, axis=1), 300.0, rtol=1e-12)
    depth = [cameras.in_camera(parents + c)[:, 2] for c in (hits.far, hits.near)]
    assert (depth[0] >= depth[1]).all()
    np.testing.assert_allclose((hits.middle * hits.half_chord).sum(axis=1), 0.0, atol=1e-7)


@given(seed=seeds, scale=st.sampled_from([1e-9, -1.0, 1e6, -3e-4]))
def test_a_camera_matrix_may_have_any_scale_and_sign(seed: int, scale: float) -> None:
    parents, chi = limb(seed)
    cameras = camera(seed).matrix
    pixels = project_by_matrix(cameras, parents + chi)
    np.testing.assert_allclose(
        project_by_matrix(scale * cameras, parents + chi), pixels, rtol=1e-9, atol=1e-9
    )
    first, other = (ray_sphere(P, pixels, parents, 310.0) for P in (cameras, scale * cameras))
    np.testing.assert_allclose(other.far, first.far, atol=1e-6)
    np.testing.assert_allclose(other.rays.ahead, first.rays.ahead, rtol=1e-9, atol=1e-6)
    assert other.status.tolist() == first.status.tolist()


def test_rays_are_those_of_the_pinhole() -> None:
    cameras, (parents, chi) = camera(5), limb(5)
    pixels = cameras.project(parents + chi)
    rays = cast_rays(cameras.matrix, pixels, parents)
    directions = cameras.rays(pixels)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    np.testing.assert_allclose(rays.direction, directions, atol=1e-12)
    np.testing.assert_allclose(
        cameras.centre + rays.ahead[:, None] * directions, parents + rays.middle, atol=1e-8
    )
    towards = parents - cameras.centre
    np.testing.assert_allclose(
        rays.axis, towards / np.linalg.norm(towards, axis=1, keepdims=True), atol=1e-12
    )
    first = still(FRAMES, target=np.zeros(3))
    pixels = first.project(parents + chi)
    again = cast_rays(first.matrix[0], pixels, parents)
    np.testing.assert_array_equal(again.middle, cast_rays(first.matrix, pixels, parents).middle)


# --- parallel rays ----------------------------------------------------------------------------------------


@given(seed=seeds)
def test_parallel_rays_give_mirror_images(seed: int) -> None:
    parents, chi = limb(seed)
    cameras = parallel(FRAMES, target=np.zeros(3), azimuth_rad=0.7)
    pixels = project_by_matrix(cameras, parents + chi)
    hits = ray_sphere(cameras, pixels, parents, 300.0)
    v = hits.rays.direction
    np.testing.assert_allclose(v, np.tile(v[0], (FRAMES, 1)), atol=1e-12)
    along = (chi @ v[0])[:, None] * v
    np.testing.assert_allclose(hits.middle, chi - along, atol=1e-9)
    signs = np.sign(chi @ v[0])
    np.testing.assert_allclose(hits.chosen(signs), chi, atol=1e-4)
    np.testing.assert_allclose(hits.chosen(-signs), chi - 2 * along, atol=1e-4)
    assert np.isinf(hits.rays.ahead).all()
    assert set(hits.status) <= {RayStatus.TWO, RayStatus.TANGENT}
    np.testing.assert_array_equal(hits.rays.axis, v)


def test_far_cameras_come_to_parallel_rays_as_one_over_the_distance() -> None:
    parents, chi = limb(8)
    towards = parallel(FRAMES, target=np.zeros(3))
    off = []
    for distance in (1e5, 1e6, 1e7, 1e8, 1e9):
        far = still(FRAMES, target=np.zeros(3), distance_mm=distance)
        rays = cast_rays(far.matrix, far.project(parents + chi), parents)
        limit = cast_rays(towards, project_by_matrix(towards, parents + chi), parents)
        off.append(np.abs(rays.middle - limit.middle).max())
    np.testing.assert_allclose(np.diff(np.log10(off)), -1.0, atol=0.05)


# --- what a frame may be ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parent", "status", "far", "near"),
    [
        ([3.0, 0, 10], RayStatus.TWO, [-3, 0, 4], [-3, 0, -4]),
        ([5.0, 0, 10], RayStatus.TANGENT, [-5, 0, 0], [-5, 0, 0]),
        ([6.0, 0, 10], RayStatus.TANGENT, [-6, 0, 0], [-6, 0, 0]),
        ([3.0, 0, 2], RayStatus.FORCED, [-3, 0, 4], [-3, 0, -4]),
        ([3.0, 0, 4], RayStatus.FORCED, [-3, 0, 4], [-3, 0, -4]),
        ([3.0, 0, -2], RayStatus.FORCED, [-3, 0, 4], [-3, 0, -4]),
        ([3.0, 0, -4], RayStatus.BEHIND, [np.nan] * 3, [np.nan] * 3),  # the far one is the camera's centre
        ([3.0, 0, -6], RayStatus.BEHIND, [np.nan] * 3, [np.nan] * 3),
        ([6.0, 0, -6], RayStatus.BEHIND, [np.nan] * 3, [np.nan] * 3),
        ([np.nan, 0, 10], RayStatus.MISSING, [np.nan] * 3, [np.nan] * 3),
    ],
)
def test_every_kind_of_frame_by_hand(
    parent: list[float], status: RayStatus, far: list[float], near: list[float]
) -> None:
    """Each status of a frame agrees with a hand-computed example: a ray along the z axis, and a limb of length 5."""
    hits = ray_sphere(AT_ORIGIN, np.zeros((2, 2)), np.array([parent, [0.0, 0, 10]]), 5.0)
    assert hits.status.tolist() == [status, RayStatus.TWO]
    np.testing.assert_allclose(hits.far[0], far, atol=1e-12)
    np.testing.assert_allclose(hits.near[0], near, atol=1e-12)
    assert hits.adjusted.tolist() == [parent == [6.0, 0, 10], False]
    assert hits.usable.tolist() == [status <= RayStatus.FORCED, True]
    settled = hits.resolved()
    if status == RayStatus.FORCED:
        np.testing.assert_allclose(settled.chosen(np.array([-1, 1]))[0], far)
    else:
        np.testing.assert_array_equal(settled.near[0], hits.near[0])


@pytest.mark.parametrize("what", ["camera", "pixel", "parent"])
def test_whatever_is_missing_the_other_frames_are_the_same(what: str) -> None:
    parents, chi = limb(2)
    cameras = camera(2).matrix.copy()
    pixels = camera(2).project(parents + chi)
    whole = ray_sphere(cameras, pixels, parents, 320.0)
    {"camera": cameras, "pixel": pixels, "parent": parents}[what][4].flat[0] = np.nan
    hits = ray_sphere(cameras, pixels, parents, 320.0)
    others = np.arange(FRAMES) != 4
    np.testing.assert_array_equal(hits.far[others], whole.far[others])
    assert hits.status[4] == RayStatus.MISSING
    assert np.isnan(hits.far[4]).all()
    assert not hits.adjusted[4]


def test_a_limb_of_no_length_ends_where_the_ray_passes() -> None:
    hits = ray_sphere(AT_ORIGIN, np.zeros((2, 2)), np.array([[0.0, 0, 10], [0.5, 0, 10]]), 0.0)
    np.testing.assert_array_equal(hits.far, [[0, 0, 0], [-0.5, 0, 0]])
    assert hits.status.tolist() == [RayStatus.TANGENT] * 2
    assert hits.adjusted.tolist() == [False, True]


# --- the radius -------------------------------------------------------------------------------------------


def at_distances(distances: np.ndarray, radius: float, **options: str) -> RayHits:
    """Return the intersections of rays that pass their parent joints at given distances."""
    parents = np.column_stack([distances, np.zeros(len(distances)), np.full(len(distances), 100.0)])
    return ray_sphere(AT_ORIGIN, np.zeros((len(distances), 2)), parents, radius, **options)  # type: ignore[arg-type]


def test_the_radius_is_adjusted_in_a_frame_in_all_or_in_most() -> None:
    distances = np.arange(1.0, 22.0)
    reference = at_distances(distances, 15.0)
    assert reference.radius == 15.0
    np.testing.assert_array_equal(reference.adjusted, distances > 15)
    np.testing.assert_array_equal(reference.status == RayStatus.TANGENT, distances >= 15)
    np.testing.assert_allclose(np.linalg.norm(reference.far, axis=1), np.maximum(distances, 15.0))

    all_of_them = at_distances(distances, 15.0, adjust="global")
    assert all_of_them.radius == 21.0
    np.testing.assert_array_equal(all_of_them.adjusted, distances > 15)
    np.testing.assert_allclose(np.linalg.norm(all_of_them.far, axis=1), 21.0)
    assert all_of_them.status.tolist() == [RayStatus.TWO] * 20 + [RayStatus.TANGENT]

    most = at_distances(distances, 15.0, adjust="robust")
    assert most.radius == np.quantile(distances, ROBUST_QUANTILE) == 20.0
    np.testing.assert_allclose(np.linalg.norm(most.far, axis=1), np.maximum(distances, 20.0))


@given(seed=seeds, adjust=st.sampled_from(["per_frame", "global", "robust"]))
def test_a_radius_that_every_ray_reaches_is_kept(seed: int, adjust: str) -> None:
    distances = np.random.default_rng(seed).uniform(0, 10, 9)
    hits = at_distances(distances, 10.0, adjust=adjust)
    assert hits.radius == 10.0
    assert not hits.adjusted.any()


def test_frames_behind_the_camera_do_not_stretch_the_limb() -> None:
    parents = np.array([[3.0, 0, 10], [50.0, 0, -10], [np.nan, 0, 10]])
    hits = ray_sphere(AT_ORIGIN, np.zeros((3, 2)), parents, 1.0, adjust="global")
    assert hits.radius == 3.0
    assert hits.adjusted.tolist() == [True, False, False]


# --- choices ----------------------------------------------------------------------------------------------


@given(seed=seeds)
def test_choices_are_the_printed_linear_function_of_binary_variables(seed: int) -> None:
    """The selected candidates are chi = E b + F, where E is block diagonal with 3-vectors as blocks."""
    parents, chi = limb(seed)
    hits = ray_sphere(camera(seed).matrix, camera(seed).project(parents + chi), parents, 300.0)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], FRAMES)
    E = block_diag(*(hits.far - hits.near)[:, :, None])
    printed = E @ ((1 + signs) / 2) + hits.near.ravel()
    np.testing.assert_allclose(hits.chosen(signs).ravel(), printed, atol=1e-9)
    one_by_one = np.where((signs > 0)[:, None], hits.far, hits.near)
    np.testing.assert_allclose(hits.chosen(signs), one_by_one, atol=1e-9)


def test_nothing_is_written_to() -> None:
    parents, chi = limb(2)
    cameras, pixels = camera(2).matrix.copy(), camera(2).project(parents + chi)
    for array in (cameras, pixels, parents):
        array.flags.writeable = False
    hits = ray_sphere(cameras, pixels, parents, 250.0, adjust="robust").resolved()
    assert hits.middle.shape == hits.half_chord.shape == (FRAMES, 3)


# --- refusals ---------------------------------------------------------------------------------------------

AHEAD = np.array([[0.0, 0, 10], [1.0, 0, 10]])


@pytest.mark.parametrize(
    ("cameras", "pixels", "parents", "radius", "rejection"),
    [
        (AT_ORIGIN, np.zeros((2, 2)), AHEAD, -1.0, rejects("out_of_range", "radius", value=-1.0)),
        (AT_ORIGIN, np.zeros((2, 2)), AHEAD, np.nan, rejects("out_of_range", "radius")),
        (AT_ORIGIN, np.zeros((2, 3)), AHEAD, 1.0, rejects("wrong_shape", "pixels", shape=(2, 3))),
        (AT_ORIGIN, np.zeros((0, 2)), AHEAD[:0], 1.0, rejects("out_of_range", "frames", value=0)),
        (AT_ORIGIN[:2], np.zeros((2, 2)), AHEAD, 1.0, rejects("wrong_shape", "cameras", shape=(2, 4))),
        (AT_ORIGIN, np.zeros((2, 2)), AHEAD[:1], 1.0, rejects("wrong_shape", "parents", shape=(1, 3))),
        (AT_ORIGIN, np.zeros((2, 2)), AHEAD * [[1], [0]], 1.0, rejects("camera_at_parent", "frame 1")),
        (AT_ORIGIN, np.zeros((2, 2)), -AHEAD, 1.0, rejects("no_ray_hits", missing=0, behind=2)),
        (AT_ORIGIN, np.zeros((2, 2)), AHEAD * np.nan, 1.0, rejects("no_ray_hits", missing=2)),
        (np.zeros((3, 4)), np.zeros((2, 2)), AHEAD, 1.0, rejects("invalid_camera", "frame 0")),
        (AT_ORIGIN * [[1], [1], [0]], np.zeros((2, 2)), AHEAD, 1.0, rejects("invalid_camera", "frame 0")),
        (AT_ORIGIN[[0, 0, 2]], np.zeros((2, 2)), AHEAD, 1.0, rejects("invalid_camera", "frame 0")),
        (AT_ORIGIN[[0, 1, 0]], np.zeros((2, 2)), AHEAD, 1.0, rejects("invalid_camera", "frame 0")),
    ],
)
def test_what_has_no_candidates_is_refused(
    cameras: np.ndarray,
    pixels: np.ndarray,
    parents: np.ndarray,
    radius: float,
    rejection: AbstractContextManager,
) -> None:
    with rejection:
        ray_sphere(cameras, pixels, parents, radius)


def test_no_such_adjustment_and_no_such_signs_are_refused() -> None:
    with rejects("unknown_choice", "adjust", value="shrink"):
        at_distances(np.ones(3), 2.0, adjust="shrink")
    hits = at_distances(np.ones(3), 2.0)
    for signs in ([1, -1], [1, 0, -1]):
        with rejects("not_signs", "signs"):
            hits.chosen(np.array(signs))


@given(seed=seeds)
def test_rays_are_along_the_printed_direction_of_projection(seed: int) -> None:
    """The direction of an image ray is v = R^T K^-1 (x, 1), as in the text of park2011 section 3.2."""
    parents, chi = limb(seed)
    view = camera(seed)
    pixels = view.project(parents + chi)
    homogeneous = np.column_stack([pixels, np.ones(FRAMES)])
    inverse = np.linalg.inv(np.broadcast_to(view.intrinsics, (FRAMES, 3, 3)))
    printed = np.einsum(
        "fyx,fyz,fz->fx", np.broadcast_to(view.rotation, (FRAMES, 3, 3)), inverse, homogeneous
    )
    np.testing.assert_allclose(view.rays(pixels), printed, rtol=1e-12, atol=1e-12)
    units = printed / np.linalg.norm(printed, axis=1, keepdims=True)
    np.testing.assert_allclose(cast_rays(view.matrix, pixels, parents).direction, units, atol=1e-9)
