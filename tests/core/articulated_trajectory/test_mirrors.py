"""Tests of the search over mirrored limbs: against enumeration, against the ground truth, and for limbs without
ambiguity.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import chain as joined
from itertools import combinations

import numpy as np
import pytest

from pipeline.core import articulated_trajectory as articulated
from pipeline.core import camera_paths, refinement
from pipeline.core.articulated_trajectory import LimbChoice, LimbTree, Options, TrajectoryBasis, choose_limb
from pipeline.core.articulated_trajectory import mirrors as mirror_search
from pipeline.core.limb_chain import Chain, forward
from pipeline.core.pinhole import Pinhole
from pipeline.core.refinement import Refinement
from pipeline.synthetic.limbs import angular_limb, smooth_series
from pipeline.validation import InvalidInput
from tests.core.cameras import still
from tests.rejects import rejects

ARM = Chain(("shoulder", "elbow", "wrist", "hand"), (None, "shoulder", "elbow", "wrist"))
FRAMES, LENGTHS = 60, np.array([320.0, 260.0, 120.0])
SMOOTH = TrajectoryBasis(10)


class Seen:
    """A synthetic arm with known positions in front of one camera, with functions that solve and refine its limbs."""

    def __init__(self, seed: int, *, noise_px: float = 1.0, camera: Pinhole | None = None) -> None:
        generator = np.random.default_rng(seed)
        self.root = 100.0 * smooth_series(generator, FRAMES, 3, bandwidth=3)
        limbs = [angular_limb(generator, FRAMES, length_mm=float(length)).relative for length in LENGTHS]
        self.truth = forward(ARM, self.root, np.stack(limbs, axis=1))
        self.camera = camera or still(FRAMES, target=self.root.mean(axis=0), distance_mm=2500.0)
        images = self.camera.project(self.truth)
        self.images = images + noise_px * generator.standard_normal(images.shape)

    def choose(self, tree: LimbTree, limb: str) -> LimbChoice:
        return choose_limb(
            self.camera.matrix,
            self.images[:, ARM.joints.index(limb)],
            tree.end(ARM.held_by(limb)),
            float(LENGTHS[ARM.limbs.index(limb)]),
            basis=SMOOTH,
            noise_px=1.0,
            time_limit_s=0.0,
        )

    def combination(self, mirrored: set[str]) -> LimbTree:
        """Solve the limbs one after the other, each relative to its parent limb, with a given set of limbs mirrored."""
        tree = LimbTree(ARM, self.root)
        for limb in ARM.limbs:
            choice = self.choose(tree, limb)
            tree = tree.placed(limb, choice.mirror if limb in mirrored else choice)
        return tree

    def refine(self, tree: LimbTree) -> Refinement:
        return refinement.refine(
            self.images,
            self.camera,
            self.root,
            [-1, 0, 1, 2],
            np.stack([tree.choices[limb].directions for limb in ARM.limbs], axis=1),
            LENGTHS,
            basis=SMOOTH.components,
            options=refinement.RefinementOptions(max_iterations=10),
        )

    def cost(self, tree: LimbTree) -> float:
        return self.refine(tree).cost

    def searched(self, start: LimbTree) -> LimbTree:
        return mirror_search.better_mirrors(start, self.choose, self.cost)


def mirrored_in(tree: LimbTree) -> set[str]:
    return {limb for limb, choice in tree.choices.items() if choice.mirrored}


def test_the_search_goes_down_to_where_no_single_mirror_helps_and_mostly_to_the_best_of_all() -> None:
    best_found = 0
    for seed in range(8):
        observed = Seen(seed)
        start = observed.combination(set())
        every = list(joined.from_iterable(combinations(ARM.limbs, k) for k in range(4)))
        costs = {
            frozenset(chosen): observed.refine(observed.combination(set(chosen))).cost for chosen in every
        }
        result = observed.searched(start)
        cost = observed.refine(result).cost
        assert cost == pytest.approx(costs[frozenset(mirrored_in(result))], rel=1e-9), (
            "a combination as enumerated"
        )
        assert cost <= costs[frozenset()] * (1 + 1e-12)
        best_found += cost <= min(costs.values()) * (1 + 1e-9)
    assert best_found >= 5


def test_wrong_limbs_are_put_right_whatever_is_mirrored_at_the_start() -> None:
    """With a moving camera, the search corrects a limb that starts as its mirror image."""
    attempts = 0
    for seed in range(4):
        camera = camera_paths.around(FRAMES, target=np.zeros(3), sweep_rad=1.5, distance_mm=2500.0)
        observed = Seen(seed, camera=camera)
        right = observed.combination(set())
        for wrong in (limb for limb in ARM.limbs if right.choices[limb].undecided):
            start = observed.combination({wrong})
            result = observed.searched(start)
            assert observed.refine(result).cost <= min(
                observed.refine(tree).cost for tree in (start, right)
            ) * (1 + 1e-9)
            attempts += 1
    assert attempts > 0


def test_errors_fall_where_a_still_camera_and_noise_leave_every_limb_in_doubt() -> None:
    errors = {False: [], True: []}
    for seed in range(12):
        observed = Seen(seed)
        for attempts, distances in errors.items():
            options = Options(SMOOTH, noise_px=1.0, try_mirrors=attempts, time_limit_s=0.0)
            output = articulated.reconstruct(
                observed.images, observed.camera, observed.root, LENGTHS, options, chain=ARM
            )
            distances.append(np.linalg.norm(output.positions - observed.truth, axis=-1).mean())
            assert output.refined is not None
    assert np.mean(errors[True]) < 0.8 * np.mean(errors[False])


def test_a_mirror_behind_the_camera_is_no_candidate() -> None:
    observed = Seen(1)
    start = observed.combination(set())
    allowed = observed.refine(start)

    def cost(tree: LimbTree) -> float:
        if mirrored_in(tree):
            raise InvalidInput("an observed joint starts behind its camera", code="behind_camera")
        return allowed.cost

    result = mirror_search.better_mirrors(start, observed.choose, cost)
    assert not mirrored_in(result)
    with rejects("behind_camera"):
        mirror_search.better_mirrors(observed.combination({"wrist"}), observed.choose, cost)


def test_what_the_data_decide_is_not_tried() -> None:
    camera = camera_paths.around(FRAMES, target=np.zeros(3), sweep_rad=1.5, distance_mm=2500.0)
    shaken = camera_paths.hand_held(np.random.default_rng(1), camera, target=np.zeros(3))
    observed = Seen(2, noise_px=0.0, camera=shaken)
    start = observed.combination(set())
    decided = {limb for limb in ARM.limbs if not start.choices[limb].undecided}
    assert decided
    requested: list[set[str]] = []

    def cost(tree: LimbTree) -> float:
        requested.append(mirrored_in(tree))
        return observed.cost(tree)

    mirror_search.better_mirrors(start, observed.choose, cost)
    assert len(requested) == 1 + len(ARM.limbs) - len(decided)
    assert not decided & set().union(*requested)


def test_a_limb_that_a_mirror_cannot_carry_is_no_candidate() -> None:
    observed = Seen(1)
    start = observed.combination(set())

    def choose(tree: LimbTree, limb: str) -> LimbChoice:
        output = observed.choose(tree, limb)
        if not np.allclose(output.hits.middle, start.choices[limb].hits.middle):
            raise InvalidInput("no candidate position is in front of the camera")
        return output

    result = mirror_search.better_mirrors(start, choose, observed.cost)
    assert mirrored_in(result) <= {ARM.limbs[-1]}, "only the last limb carries nothing"


@pytest.mark.parametrize("given", [True, False])
def test_reconstructions_that_share_their_choices_are_those_made_alone(given: bool) -> None:
    """Reconstructions that share cached limb solutions equal separate ones exactly, with given and with estimated
    lengths.
    """
    observed = Seen(3)
    lengths = LENGTHS if given else np.full(len(LENGTHS), np.nan)
    plain = Options(SMOOTH, noise_px=1.0, time_limit_s=0.0, refine=False)
    arguments = (observed.images, observed.camera, observed.root, lengths)
    shared = articulated.prepared(*arguments, plain, chain=ARM)
    for options in (
        plain,
        replace(plain, try_mirrors=True),
        replace(plain, refine=True),
        replace(plain, noise_px=0.0),
    ):
        alone = articulated.reconstruct(*arguments, options, chain=ARM)
        np.testing.assert_array_equal(shared.under(options).whole().positions, alone.positions)
    assert bool(shared.choices) == given
    # The steps after the choices need the same ones, another noise does not.
    for step in ("try_mirrors", "refine", "use_hinges"):
        for on in (True, False):
            assert bool(shared.under(replace(plain, **{step: on})).choices) == given, step
    assert shared.under(replace(plain, noise_px=0.0)).choices == {}
    if given:
        assert shared.with_lengths(lengths.copy()).choices == shared.choices
        assert shared.with_lengths(1.01 * lengths).choices == {}
