"""Tests of the binary quadratic programme: against enumeration, SCIP and the printed formula; bounds and mirror
solutions.
"""

from __future__ import annotations

import itertools
import tracemalloc
from collections.abc import Callable
from contextlib import AbstractContextManager
from types import SimpleNamespace

import numba.core.caching
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from pipeline.compilation import compiled_with_free_sums
from pipeline.core.binary_quadratic import BinarySolution, minimise
from pipeline.core.binary_quadratic import candidates as programmes
from pipeline.core.binary_quadratic import descent as sign_search
from pipeline.core.binary_quadratic.candidates import Programme, programme_of
from pipeline.core.binary_quadratic.searches import BoxSearch, SuffixSearch
from pipeline.core.binary_quadratic.solve import _margin, _signs
from pipeline.core.trajectory_basis import TrajectoryBasis, cosine_basis, restricted, soft_ridge
from tests.benchmarks.binary_quadratic import by_scip, limb
from tests.rejects import rejects
from tests.strategies import seeds

STYLES = ("generic", "limb", "parallel", "tied", "tangent")
BASES = ("hard", "soft", "gaps", "soft with gaps")


def candidates(generator: np.random.Generator, frames: int, style: str) -> tuple[np.ndarray, np.ndarray]:
    """Return middle and half chord (F, 3) of random candidates."""
    if style == "limb":
        first = limb(frames, int(generator.integers(2**31)), noise_px=generator.uniform(0, 3))
        return first.middle, first.half_chord
    middle, half_chord = generator.standard_normal((2, frames, 3))
    if style == "parallel":
        middle[:, 1] = 0.0
        half_chord[:, [0, 2]] = 0.0
    elif style == "tied":
        middle[:] = middle[0]
        half_chord[:] = half_chord[0]
    elif style == "tangent":
        half_chord[generator.uniform(size=frames) < 0.4] = 0.0
    return middle, half_chord


def basis_of(generator: np.random.Generator, frames: int, style: str) -> np.ndarray:
    """Return a random trajectory basis (F, K) of a given style."""
    components = int(generator.integers(1, frames + 1))
    ridge = soft_ridge(components, generator.uniform(0.5, 5)) if style.startswith("soft") else None
    if not style.endswith("gaps"):
        cutoff = None if ridge is None else generator.uniform(0.5, 5)
        return TrajectoryBasis(components, cutoff).rows(frames, np.ones(frames, dtype=bool))
    whole = 2 * frames
    observed = generator.permutation(np.arange(whole) < frames)
    # One more would not be determined by the frames of an unlucky draw.
    few = min(components, frames // 2 + 1)
    return restricted(cosine_basis(whole, few), observed, ridge=None if ridge is None else ridge[:few])


def enumerated(
    basis: np.ndarray, middle: np.ndarray, half_chord: np.ndarray, allowed: np.ndarray
) -> np.ndarray:
    """Return the costs J of all signs that `allowed` (F,) leaves free, as differences of squares."""
    options = [(-1.0, 1.0) if sign == 0 else (float(sign),) for sign in allowed]
    signs = np.array(list(itertools.product(*options)))
    points = middle + signs[:, :, None] * half_chord
    inside = np.einsum("fk,nfd->nkd", basis, points)
    return np.square(points).sum(axis=(1, 2)) - np.square(inside).sum(axis=(1, 2))


@given(
    seed=seeds,
    frames=st.integers(2, 12),
    style=st.sampled_from(STYLES),
    kind=st.sampled_from(BASES),
)
@settings(max_examples=150)
def test_the_proved_signs_are_those_of_enumeration(seed: int, frames: int, style: str, kind: str) -> None:
    generator = np.random.default_rng(seed)
    middle, half_chord = candidates(generator, frames, style)
    basis = basis_of(generator, frames, kind)
    solution = minimise(basis, middle, half_chord, time_limit_s=20.0)

    costs = enumerated(basis, middle, half_chord, np.zeros(frames))
    size = np.square(middle).sum() + np.square(half_chord).sum()
    least = costs.min()
    assert solution.proved
    assert solution.objective == pytest.approx(least, rel=1.1e-6, abs=1e-11 * size)
    assert solution.lower_bound <= least + 1e-11 * size
    assert solution.lower_bound >= solution.objective - max(1e-6 * abs(solution.objective), 1e-11 * size)
    reference = enumerated(basis, middle, half_chord, solution.signs)
    assert reference == pytest.approx([solution.objective], rel=1e-9, abs=1e-11 * size)
    tangent = (half_chord == 0).all(axis=1)
    assert (solution.signs[tangent] == 1).all()
    assert (solution.values == solution.signs).all()


@pytest.mark.parametrize("kind", BASES)
@pytest.mark.parametrize("search", [BoxSearch, SuffixSearch])
def test_either_search_proves_the_optimum_alone_whatever_it_starts_from(
    search: type[BoxSearch] | type[SuffixSearch], kind: str
) -> None:
    for seed in range(12):
        generator = np.random.default_rng(seed)
        frames = int(generator.integers(4, 14))
        middle, half_chord = candidates(generator, frames, STYLES[seed % len(STYLES)])
        programme = programme_of(basis_of(generator, frames, kind), middle, half_chord)
        costs = enumerated(programme.basis, middle, half_chord, programme.kind)
        values = np.where(programme.kind == 0, generator.choice([-1.0, 1.0], frames), programme.kind)
        best = np.array([programme.objective(values)])
        searcher = search(programme) if search is BoxSearch else search(programme, float(best[0]))  # type: ignore[call-arg]
        bounds = []
        while not searcher.finished:
            searcher.run(best, values, 1e-6, programme.allowance(float(best[0])), 7)
            bounds.append(min(searcher.lower_bound(), best[0] * (1 - 1e-6)))
        rounding = 1e-11 * programme.size
        assert best[0] == pytest.approx(costs.min(), rel=1.1e-6, abs=rounding)
        assert programme.objective(values) == pytest.approx(best[0], rel=1e-12, abs=rounding)
        assert max(bounds) <= costs.min() + rounding
        assert searcher.nodes > 0


@pytest.mark.parametrize("seed", range(6))
def test_a_bound_holds_whenever_a_search_is_stopped(seed: int) -> None:
    first = limb(60, seed, noise_px=2.0)
    basis = cosine_basis(60, 10)
    optimum = minimise(basis, first.middle, first.half_chord, time_limit_s=20.0)
    assert optimum.proved
    programme = programme_of(basis, first.middle, first.half_chord)
    for searcher in (BoxSearch(programme), SuffixSearch(programme, optimum.objective * 2)):
        values = np.where(programme.weight > 0, 1.0, programme.kind)
        best = np.array([programme.objective(values)])
        bounds = []
        for _ in range(400):
            bounds.append(min(searcher.lower_bound(), best[0] * (1 - 1e-6)))
            if searcher.finished:
                break
            searcher.run(best, values, 1e-6, programme.allowance(float(best[0])), 20)
        assert max(bounds) <= optimum.objective
        assert max(bounds) > 0


def test_the_objective_is_the_printed_one() -> None:
    """The cost J equals the printed ||(Theta Theta^T - I)(E b + F)||² with b in {0, 1} [park2011 10-12]."""
    generator = np.random.default_rng(12)
    single, theta = limb(30, 3), cosine_basis(30, 8)
    b = generator.integers(0, 2, 30)
    first, second = single.middle + single.half_chord, single.middle - single.half_chord
    e = np.zeros((30, 3, 30))
    e[np.arange(30), :, np.arange(30)] = first - second
    outside = np.einsum("fg,gd->fd", theta @ theta.T - np.eye(30), e @ b + second)
    programme = programme_of(theta, single.middle, single.half_chord)
    assert programme.objective(2.0 * b - 1.0) == pytest.approx(np.square(outside).sum(), rel=1e-10)


@pytest.mark.parametrize(("frames", "components"), [(18, 5), (24, 6), (30, 8)])
def test_scip_finds_the_same(frames: int, components: int) -> None:
    scip = pytest.importorskip("pyscipopt", reason="needs SCIP: pip install pyscipopt")
    first, basis = limb(frames, 5, noise_px=1.0), cosine_basis(frames, components)
    ours = minimise(basis, first.middle, first.half_chord, time_limit_s=20.0)
    theirs = by_scip(scip, basis, first.middle, first.half_chord, limit_s=60.0)
    assert ours.proved
    assert theirs.proved
    assert ours.objective == pytest.approx(theirs.objective, rel=2e-4)
    assert ours.objective <= theirs.objective * (1 + 1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_relaxed_frames_are_at_their_best_between_the_candidates(seed: int) -> None:
    """Relaxed frames get the optimal values, as found by enumeration of the signs with bounded least squares."""
    generator = np.random.default_rng(seed)
    middle, half_chord = generator.standard_normal((2, 8, 3))
    basis = cosine_basis(8, 3) if seed % 2 else TrajectoryBasis(6, 2.0).rows(8, np.ones(8, dtype=bool))
    lengths = np.linalg.norm(half_chord, axis=1)
    below = np.sort(lengths)[3]
    solution = minimise(basis, middle, half_chord, relax_below=float(below), time_limit_s=20.0)
    relaxed = lengths < below
    values, vectors = np.linalg.eigh(np.eye(8) - basis @ basis.T)
    root = np.sqrt(np.maximum(values, 0))[:, None] * vectors.T
    costs = []
    for signs in itertools.product((-1.0, 1.0), repeat=int((~relaxed).sum())):
        fixed = np.zeros(8)
        fixed[~relaxed] = signs
        target = -(root @ (middle + fixed[:, None] * half_chord)).T.ravel()
        matrix = np.concatenate([root[:, relaxed] * half_chord[relaxed, d] for d in range(3)])
        costs.append(2 * lsq_linear(matrix, target, (-1, 1), tol=1e-14, method="bvls").cost)
    assert solution.proved
    assert solution.objective == pytest.approx(min(costs), rel=2e-6)
    assert (np.abs(solution.values[relaxed]) <= 1).all()
    assert (solution.values[~relaxed] == solution.signs[~relaxed]).all()


@pytest.mark.parametrize("camera", ["still", "shaky", "distant"])
def test_limbs_of_a_hundred_frames_are_proved(camera: str) -> None:
    """For noise-free limbs, each optimum is proved, and the heuristic search is nearly optimal."""
    for seed in range(6):
        single, basis = limb(100, seed, camera=camera), cosine_basis(100, 20)
        solution = minimise(basis, single.middle, single.half_chord, time_limit_s=30.0)
        assert solution.proved
        assert solution.objective <= programme_of(basis, single.middle, single.half_chord).objective(
            single.signs
        ) * (1 + 1e-6)
        programme = programme_of(basis, single.middle, single.half_chord)
        first = programme.objective(sign_search.search(programme))
        assert first <= 1.1 * solution.objective


def test_with_a_shaky_camera_and_a_limb_in_the_basis_the_truth_is_found() -> None:
    for seed in range(6):
        first = limb(100, seed, camera="shaky", rate_hz=0.8)
        solution = minimise(cosine_basis(100, 24), first.middle, first.half_chord, time_limit_s=30.0)
        across = np.linalg.norm(first.half_chord, axis=1) > 30.0
        assert solution.proved
        assert solution.margin > 2
        assert (solution.signs == first.signs)[across].all()


@pytest.mark.parametrize("noise_px", [0.0, 1.0])
def test_parallel_rays_do_not_tell_the_mirrors_apart(noise_px: float) -> None:
    generator = np.random.default_rng(4)
    first = limb(80, 9, camera="distant")
    middle = first.middle + noise_px * generator.standard_normal((80, 3)) * [1, 0, 1]
    half_chord = first.half_chord * [0, 1, 0]
    solution = minimise(cosine_basis(80, 14), middle, half_chord, time_limit_s=30.0)
    assert solution.margin == pytest.approx(1.0, abs=1e-9)
    assert (solution.mirror_signs == -solution.signs).all()
    assert solution.signs[0] == 1


@pytest.mark.parametrize("seed", range(6))
def test_of_two_equal_mirrors_the_first_frame_with_a_choice_is_in_front(seed: int) -> None:
    """If both mirror solutions cost the same, the first free sign is +1; frames with tangent rays have no free sign."""
    middle, half_chord = candidates(np.random.default_rng(seed), 12, "parallel")
    half_chord[0] = 0.0
    solution = minimise(cosine_basis(12, 6), middle, half_chord, time_limit_s=30.0)
    assert solution.margin == pytest.approx(1.0, abs=1e-9)
    assert solution.signs[1] == 1


@given(seed=seeds, frames=st.integers(6, 40), style=st.sampled_from(STYLES), kind=st.sampled_from(BASES))
@example(seed=452947, frames=19, style="parallel", kind="hard")
@settings(max_examples=60)
def test_the_mirror_is_a_minimum_on_the_other_side(seed: int, frames: int, style: str, kind: str) -> None:
    generator = np.random.default_rng(seed)
    middle, half_chord = candidates(generator, frames, style)
    programme = programme_of(basis_of(generator, frames, kind), middle, half_chord)
    solution = minimise(programme.basis, middle, half_chord, time_limit_s=20.0)
    weight = programme.weight
    rounding = 1e-11 * programme.size
    if not weight.any():
        assert solution.mirror_objective == solution.margin == np.inf
        return
    agreement = weight * solution.signs * solution.mirror_signs
    assert agreement.sum() <= 1e-9 * weight.sum()
    assert solution.mirror_objective == pytest.approx(
        programme.objective(solution.mirror_signs), rel=1e-9, abs=rounding
    )
    assert solution.margin >= 1 - 1e-6
    assert solution.objective <= solution.mirror_objective * (1 + 1e-9) + rounding
    # What the searches left may be the mirror, where the two changed places: within the gap if the search has ended.
    if not solution.proved:
        return
    better = 1.1e-6 if solution.margin <= 1 + 1.1e-6 else 1e-8
    for frame in np.flatnonzero(weight):
        flipped = solution.mirror_signs.copy()
        flipped[frame] *= -1
        nearer = agreement.sum() - 2 * agreement[frame]
        assert (
            nearer > -1e-9 * weight.sum()
            or programme.objective(flipped) >= solution.mirror_objective * (1 - better) - rounding
        )


def same(one: BinarySolution, other: BinarySolution) -> bool:
    """Return True if two solutions are identical to the last bit."""
    return all(np.array_equal(value, vars(other)[name]) for name, value in vars(one).items())


def test_a_proof_is_the_same_twice() -> None:
    """Two runs of the same proof give identical solutions, and do not modify their arguments."""
    first, basis = limb(120, 2, noise_px=1.0), cosine_basis(120, 14)
    inputs = [basis.copy(), first.middle.copy(), first.half_chord.copy()]
    for array in inputs:
        array.setflags(write=False)
    once = minimise(inputs[0], inputs[1], inputs[2], time_limit_s=60.0)
    assert once.proved
    assert same(once, minimise(inputs[0], inputs[1], inputs[2], time_limit_s=60.0))


def test_without_time_there_are_signs_and_a_bound_all_the_same() -> None:
    first, basis = limb(300, 1, noise_px=1.0), cosine_basis(300, 30)
    solution = minimise(basis, first.middle, first.half_chord, time_limit_s=0.0)
    assert not solution.proved
    assert 0 < solution.lower_bound < solution.objective
    assert solution.objective <= programme_of(basis, first.middle, first.half_chord).objective(first.signs)


def test_the_time_limit_is_an_amount_of_work() -> None:
    """Twice the time limit enters about twice as many nodes, and an unfinished search is reproducible."""
    first, basis = limb(400, 1, noise_px=1.0), cosine_basis(400, 40)
    short, again, longer = (
        minimise(basis, first.middle, first.half_chord, time_limit_s=limit) for limit in (0.04, 0.04, 0.08)
    )
    assert not short.proved
    assert same(short, again)
    assert 1.5 < longer.steps / short.steps < 2.5
    assert longer.lower_bound >= short.lower_bound


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("kind", ["hard", "soft with gaps"])
def test_the_table_of_products_changes_nothing_but_the_time(
    style: str, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Signs, mirror solutions and bounds are the same with and without a stored matrix of the quadratic form."""
    for seed in range(6):
        generator = np.random.default_rng(seed)
        middle, half_chord = candidates(generator, 40, style)
        basis = basis_of(generator, 40, kind)
        monkeypatch.setattr(programmes, "TABLE", 40)
        fast = minimise(basis, middle, half_chord, time_limit_s=0.2)
        monkeypatch.setattr(programmes, "TABLE", 39)
        plain = minimise(basis, middle, half_chord, time_limit_s=0.2)
        rounding = 2.0 * programme_of(basis, middle, half_chord).allowance(plain.objective)
        close = {"rel": 1e-9, "abs": rounding}
        for number in ("objective", "lower_bound", "mirror_objective"):
            assert getattr(fast, number) == pytest.approx(getattr(plain, number), **close), number
        assert fast.proved == plain.proved
        if style in {"generic", "limb"} and plain.objective > 1e3 * rounding:
            np.testing.assert_array_equal(fast.signs, plain.signs)
            np.testing.assert_array_equal(fast.mirror_signs, plain.mirror_signs)


def test_nothing_as_large_as_the_null_space_is_formed() -> None:
    frames = 4000
    first, basis = limb(frames, 1), cosine_basis(frames, 8)
    programme = programme_of(basis, first.middle, first.half_chord)
    tracemalloc.start()
    minimise(basis, first.middle, first.half_chord, time_limit_s=0.0)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert isinstance(programme, Programme)
    assert most < frames * frames * 8 / 20


def test_two_frames_and_one_are_programmes_too() -> None:
    pair = minimise(np.full((2, 1), np.sqrt(0.5)), np.zeros((2, 3)), np.array([[1.0, 0, 0], [-1.0, 0, 0]]))
    assert pair.signs.tolist() == [1, -1]
    assert pair.objective == pytest.approx(0.0, abs=1e-15)
    assert pair.proved
    single = minimise(np.array([[0.5]]), np.ones((1, 3)), np.array([[0.5, 0, 0]]))
    assert single.signs.tolist() == [-1]
    assert single.objective == pytest.approx(0.75 * 2.25)


def test_where_nothing_can_be_kept_kernels_are_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("CacheImpl", "_CacheImpl"):
        if hasattr(numba.core.caching, name):
            monkeypatch.setattr(getattr(numba.core.caching, name), "_locator_classes", [])
    kernel = compiled_with_free_sums(lambda x: 2.0 * x)
    assert kernel(1.5) == 3.0


FINE = SimpleNamespace(basis=cosine_basis(6, 2), middle=np.zeros((6, 3)), half_chord=np.ones((6, 3)))
HOLE = np.where(np.arange(6)[:, None] == 4, np.nan, np.zeros((6, 3)))
REFUSED: dict[str, tuple[Callable[[], object], AbstractContextManager]] = {
    "missing frame": (
        lambda: minimise(FINE.basis, HOLE, FINE.half_chord),
        rejects("not_finite", "frame 4", array="middle"),
    ),
    "missing chord": (
        lambda: minimise(FINE.basis, FINE.middle, HOLE),
        rejects("not_finite", "frame 4", array="half_chord"),
    ),
    "all missing": (
        lambda: minimise(FINE.basis, np.full((6, 3), np.nan), FINE.half_chord),
        rejects("not_finite", "all frames", array="middle"),
    ),
    "infinite": (
        lambda: minimise(FINE.basis, np.where(np.isnan(HOLE), np.inf, 0.0), FINE.half_chord),
        rejects("not_finite", "frame 4", array="middle"),
    ),
    "other frames": (
        lambda: minimise(FINE.basis, FINE.middle[:5], FINE.half_chord),
        rejects("wrong_shape", "middle", shape=(5, 3)),
    ),
    "more components than frames": (
        lambda: minimise(np.ones((2, 3)) / 9, FINE.middle[:2], FINE.half_chord[:2]),
        rejects("wrong_shape", shape=(2, 3)),
    ),
    "no components": (
        lambda: minimise(FINE.basis[:, :0], FINE.middle, FINE.half_chord),
        rejects("wrong_shape", shape=(6, 0)),
    ),
    "not orthonormal": (
        lambda: minimise(1.1 * FINE.basis, FINE.middle, FINE.half_chord),
        rejects("not_orthonormal", norm=pytest.approx(1.1)),
    ),
    "basis of NaN": (
        lambda: minimise(np.where(FINE.basis > 0.5, np.nan, FINE.basis), FINE.middle, FINE.half_chord),
        rejects("not_finite", "frame 0", array="basis"),
    ),
    "negative gap": (
        lambda: minimise(FINE.basis, FINE.middle, FINE.half_chord, gap=-1),
        rejects("out_of_range", "gap", value=-1),
    ),
    "time limit of NaN": (
        lambda: minimise(FINE.basis, FINE.middle, FINE.half_chord, time_limit_s=np.nan),
        rejects("out_of_range", "time_limit_s"),
    ),
    "negative chord": (
        lambda: minimise(FINE.basis, FINE.middle, FINE.half_chord, relax_below=-1.0),
        rejects("out_of_range", "relax_below", value=-1.0),
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_programme_is_refused_in_one_sentence(case: str) -> None:
    attempt, rejection = REFUSED[case]
    with rejection:
        attempt()


@pytest.mark.parametrize(
    ("other", "here", "rounding", "margin"),
    [(6.0, 2.0, 1.0, 3.0), (0.5, 0.0, 0.5, 1.0), (0.5, 0.1, 0.4, 5.0), (6.0, 0.0, 1.0, np.inf)],
)
def test_the_margin_is_the_ratio_of_the_costs(
    other: float, here: float, rounding: float, margin: float
) -> None:
    assert _margin(other, here, rounding) == margin


def test_a_value_of_zero_has_a_positive_sign() -> None:
    assert _signs(np.array([-0.2, 0.0, 0.7])).tolist() == [-1, 1, 1]
