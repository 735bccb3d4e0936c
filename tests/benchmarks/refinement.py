"""Time to refine 14 limbs over 300 frames with analytic derivatives, compared with SciPy's trust-region method.

The peer minimises the same residuals over the same unknowns from the same start, by scipy.optimize.least_squares with
two-point differences as it comes, and then with what suits it best: our analytic Jacobian as a dense matrix, steps
by LSMR, unknowns scaled by the Jacobian.  Both must find the same minimum before anything is timed.  The note gives the
CPU seconds of ours, and those from a start three times as far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pipeline.core.pinhole import Pinhole, look_at
from pipeline.core.refinement import Refinement, RefinementOptions, refine, reprojection
from pipeline.core.refinement.inputs import starting_path
from pipeline.core.refinement.spherical import SphericalTrajectory
from pipeline.core.trajectory_basis import cosine_basis
from tests.benchmarks.tables import Row
from tests.benchmarks.timing import cpu_seconds, in_turns, relative_difference

PARENTS = (-1, 0, 1, 1, 3, 4, 1, 6, 7, 0, 9, 10, 0, 12, 13)
"""Parent joint of each of 15 joints: pelvis, sternum with head and arms, and legs."""

FRAMES, ROUNDS = 300, 3
NEAR, FAR = 0.02, 0.06
"""Small and large perturbation of the first six cosine coefficients in an initial estimate."""

SAME = 1e-4
"""Relative distance below which two sets of positions count as the same minimum."""


@dataclass(frozen=True)
class Clip:
    """Moving limbs, their images and an initial estimate, used for both refinement methods."""

    images: np.ndarray
    camera: Pinhole
    root: np.ndarray
    start: np.ndarray
    lengths: np.ndarray
    charts: np.ndarray
    basis: np.ndarray

    def ours(self) -> Refinement:
        return refine(
            self.images,
            self.camera,
            self.root,
            PARENTS,
            self.start,
            self.lengths,
            basis=self.basis,
            options=RefinementOptions(charts=self.charts),
        )


def clip(frames: int, components: int, *, away: float = NEAR, noise_px: float = 1.0) -> Clip:
    """Return smoothly moving limbs in front of a moving camera, with noisy images and a perturbed initial estimate."""
    generator = np.random.default_rng(2011)
    limbs = len(PARENTS) - 1
    basis = cosine_basis(frames, components)
    sizes = 0.2 * np.sqrt(frames) / np.arange(1, components + 1) ** 1.5
    lengths = generator.uniform(150.0, 450.0, limbs)
    theta, phi = generator.uniform(-1, 1, (2, limbs, components)) * sizes
    theta[:, 0] += np.pi / 2 * np.sqrt(frames)
    up = np.array([0.0, 0.0, 1.0])
    charts = []
    for _ in range(limbs):
        lean = generator.uniform(0.5, 1.0) * generator.choice([-1.0, 1.0])
        ahead = np.array([np.cos(lean), np.sin(lean), 0.0])
        turn = Rotation.from_euler("y", generator.uniform(-np.pi, np.pi)).as_matrix()
        charts.append(np.stack([ahead, np.cross(up, ahead), up]) @ turn.T)
    paths = [SphericalTrajectory(*path).directions(basis) for path in zip(theta, phi, charts, strict=True)]
    directions = np.stack(paths, axis=1)
    t = np.linspace(0, 1, frames)
    root = np.column_stack([600 * t - 300, 100 * np.sin(3 * t), 900 + 40 * np.sin(9 * t)])
    positions = [root]
    for limb, parent in enumerate(PARENTS[1:]):
        positions.append(positions[parent] + lengths[limb] * directions[:, limb])
    centre = np.column_stack([800 * t - 200, np.full(frames, -4000.0), 1200 + 300 * np.cos(4 * t)])
    camera = look_at(centre, root, focal_px=1000.0)
    images = camera.project(np.stack(positions, axis=1))
    bend = np.einsum("fk,klx->flx", basis[:, :6], generator.standard_normal((6, limbs, 3)))
    return Clip(
        images=images + noise_px * generator.standard_normal(images.shape),
        camera=camera,
        root=root,
        start=directions + away * np.sqrt(frames) * bend,
        lengths=lengths,
        charts=np.stack(charts),
        basis=basis,
    )


def peer(one: Clip, *, analytic: bool) -> np.ndarray:
    """Return the positions (L, F, 3), mm, that SciPy finds from the same initial estimate."""
    limbs, size = len(one.lengths), 2 * one.basis.shape[1]
    inputs = reprojection.observe(
        one.images[:, 1:],
        one.camera,
        one.root,
        parents=tuple(parent - 1 for parent in PARENTS[1:]),
        lengths=one.lengths,
        charts=one.charts,
        basis=one.basis,
        penalty=np.zeros((limbs, size)),
    )
    paths = [
        starting_path(one.start[:, limb], one.basis, chart=one.charts[limb], cutoff=None, called=str(limb))
        for limb in range(limbs)
    ]
    start = np.stack([np.concatenate([path.coefficients_theta, path.coefficients_phi]) for path in paths])

    def positions(flat: np.ndarray) -> np.ndarray:
        return reprojection.forward(inputs, reprojection.relative(inputs, flat.reshape(limbs, size)))

    def residuals(flat: np.ndarray) -> np.ndarray:
        return reprojection.residuals(inputs, positions(flat)).ravel()

    def jacobian(flat: np.ndarray) -> np.ndarray:
        return reprojection.jacobian(inputs, flat.reshape(limbs, size)).reshape(-1, flat.size)

    if analytic:
        coefficients = least_squares(residuals, start.ravel(), jac=jacobian, tr_solver="lsmr", x_scale="jac")
    else:
        coefficients = least_squares(residuals, start.ravel(), jac="2-point")
    return positions(coefficients.x)


def run() -> list[Row]:
    """Return rows for SciPy with numerical derivatives and for SciPy with our Jacobian."""
    rows = []
    for components, analytic in ((20, False), (20, True), (40, True)):
        problem = clip(FRAMES, components)
        result, theirs = problem.ours(), peer(problem, analytic=analytic).swapaxes(0, 1)
        if not result.converged:
            raise SystemExit(f"our refinement with {components} components has not converged")
        agreement = relative_difference(result.positions[:, 1:], theirs, at_most=SAME)
        seconds = min(cpu_seconds(problem.ours) for _ in range(ROUNDS))
        far = clip(FRAMES, components, away=FAR)
        steps, longer = far.ours().n_iterations, cpu_seconds(far.ours)
        rows.append(
            in_turns(
                f"14 limbs, {FRAMES} frames, {components} components",
                "scipy, our Jacobian" if analytic else "scipy, 2-point differences",
                problem.ours,
                lambda problem=problem, analytic=analytic: peer(problem, analytic=analytic),
                rounds=ROUNDS if analytic else 1,
                agreement=agreement,
                note=f"ours {seconds:.2g} s, {result.n_iterations} steps; from afar {longer:.2g} s, {steps} steps",
            )
        )
    return rows
