"""Tests of rigid motion: against SciPy's alignment, with gaps, and in the detection of clusters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.core.rigid import fit_rigid_motion, rigid_clusters


@given(seed=st.integers(0, 2**32 - 1), points=st.integers(3, 6), noise=st.sampled_from([0.0, 1.0, 30.0]))
def test_rotation_and_residual_are_those_of_scipy(seed: int, points: int, noise: float) -> None:
    random = np.random.default_rng(seed)
    reference = random.normal(scale=60.0, size=(points, 3))
    spread = np.linalg.svd(reference - reference.mean(axis=0), compute_uv=False)
    assume(spread[1] > 0.1 * spread[0])  # points on a line fix no turn: see below
    turns = Rotation.random(5, random_state=int(random.integers(2**31)))
    moved = np.stack([turn.apply(reference) for turn in turns]) + random.normal(scale=900.0, size=(5, 1, 3))
    moved += random.normal(scale=noise, size=moved.shape)
    motion = fit_rigid_motion(reference, moved)
    for t in range(5):
        start, end = reference - reference.mean(axis=0), moved[t] - moved[t].mean(axis=0)
        theirs, distance = Rotation.align_vectors(end, start)
        # Noise may leave two turns that fit equally well: then the residuals agree all the same.
        assert motion.residual_mm[t] == pytest.approx(distance / np.sqrt(points), abs=1e-4)
        if noise < 30:
            np.testing.assert_allclose(
                motion.carry(reference)[t] - moved[t].mean(axis=0), theirs.apply(start), atol=1e-4
            )
    assert np.linalg.det(motion.rotation) == pytest.approx(1.0)


def test_points_that_are_not_seen_take_no_part() -> None:
    random = np.random.default_rng(1)
    reference = random.normal(scale=60.0, size=(4, 3))
    moved = np.stack(
        [Rotation.from_rotvec([0, 0, t]).apply(reference) + np.array([t, 0, 9]) for t in (0.1, 0.5, 1.0, 2.0)]
    )
    whole = fit_rigid_motion(reference, moved)
    moved[1, 0] = np.nan  # three are enough
    moved[2, :2] = np.nan  # two are not
    motion = fit_rigid_motion(reference, moved)
    np.testing.assert_allclose(
        motion.carry(reference)[[0, 1, 3]], whole.carry(reference)[[0, 1, 3]], atol=1e-9
    )
    assert np.isnan(motion.carry(reference)[2]).all()
    assert np.isnan(motion.residual_mm).tolist() == [False, False, True, False]


def test_points_on_a_line_fix_no_turn_about_it() -> None:
    line = np.outer([0.0, 40.0, 100.0], [1.0, 2.0, 3.0])
    assert np.isnan(fit_rigid_motion(line, line[None] + 5.0).rotation).all()


def test_points_of_one_segment_are_one_cluster() -> None:
    """The points of two segments with a common hinge form two clusters."""
    random = np.random.default_rng(3)
    upper, lower = random.normal(scale=50, size=(2, 4, 3)) + np.array([[[0, 0, 200]], [[0, 0, -200]]])
    bend = Rotation.from_rotvec(np.linspace(-0.6, 0.6, 40)[:, None] * [1.0, 0, 0])
    below = np.stack([turn.apply(lower) for turn in bend])
    stray = random.normal(scale=300, size=(40, 1, 3))
    positions = np.concatenate([np.broadcast_to(upper, (40, 4, 3)), below, stray], axis=1)
    positions += random.normal(scale=1.0, size=positions.shape)
    positions[::3, 1] = np.nan
    assert rigid_clusters(positions, 6.0) == [[0, 1, 2, 3], [4, 5, 6, 7]]
    reference = np.concatenate([upper, lower, [[0, 0, 0]]])
    assert rigid_clusters(positions, 6.0, reference) == [[0, 1, 2, 3], [4, 5, 6, 7]]
    reference[0] += [0, 0, 60]  # stuck elsewhere when the reference was taken
    assert rigid_clusters(positions, 6.0, reference) == [[1, 2, 3], [4, 5, 6, 7]]
    assert rigid_clusters(positions[:, :2], 6.0) == []
    positions[:, 4] = np.nan  # never seen
    assert rigid_clusters(positions, 6.0) == [[0, 1, 2, 3], [5, 6, 7]]
