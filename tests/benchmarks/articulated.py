"""Time to reconstruct a skeleton of 14 limbs from one camera, and its growth with frames F and DCT coefficients K.

A synthetic body whose angles are smooth wanders before a camera that walks around it.  The first rows are the whole,
300 frames, with certificates under a time limit of 0.5 s to each limb as by default.  To hold: under 10 s on one core.
Shares of the whole: ``signs`` are rays, spheres, the first signs and angles; ``proofs`` what certificates take beyond;
``refinement`` that of all limbs together.  CPU seconds of one thread, the least of two rounds.  The rows of growth go
without certificates, whose time is the limit's; the last of each gives the exponents of the signs' time and of a
step of refinement, whose number depends on the motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.articulated_trajectory import Articulated, Options, TrajectoryBasis, prepared
from pipeline.core.camera_paths import around
from pipeline.core.pinhole import Pinhole
from pipeline.synthetic.limbs import SyntheticBody, synthetic_body
from tests.benchmarks.tables import Row
from tests.benchmarks.timing import cpu_seconds, exponent

FRAMES, COMPONENTS = 300, 20
BOUND_S, LIMIT_S = 10.0, 0.5
BY_FRAMES, BY_COMPONENTS = (100, 200, 400, 800), (10, 20, 40)
ROUNDS = 2


@dataclass(frozen=True)
class Shot:
    """Moving body and its images from one camera."""

    body: SyntheticBody
    camera: Pinhole
    images: np.ndarray
    noise_px: float

    def skeleton(self, basis: TrajectoryBasis, *, limit_s: float, refine: bool) -> Articulated:
        return prepared(
            self.images,
            self.camera,
            self.body.root_mm,
            self.body.lengths_mm,
            Options(basis, noise_px=self.noise_px, refine=refine, time_limit_s=limit_s),
        ).whole()


def shot(frames: int, *, noise_px: float = 0.0) -> Shot:
    """Return a moving body and its images; the body moves at the same pace for every number of frames."""
    generator = np.random.default_rng(2011)
    body = synthetic_body(generator, frames, bandwidth=max(3, frames // 20))
    camera = around(frames, target=body.root_mm, sweep_rad=np.pi / 2)
    images = camera.project(body.positions_mm)
    return Shot(body, camera, images + noise_px * generator.standard_normal(images.shape), noise_px)


def _stages(one: Shot, basis: TrajectoryBasis, *, limit_s: float) -> Row:
    """Return the CPU time of the reconstruction, s, the fraction of each stage, and the fraction of proved signs."""
    result = one.skeleton(basis, limit_s=limit_s, refine=True)  # warm

    def seconds(limit: float, refine: bool) -> float:
        return min(
            cpu_seconds(lambda: one.skeleton(basis, limit_s=limit, refine=refine)) for _ in range(ROUNDS)
        )

    signs = seconds(0.0, False)
    # No certificates run at the same time: their time depends on the load of the machine.
    refinement = max(seconds(0.0, True) - signs, 0.0)
    whole = seconds(limit_s, True) if limit_s > 0 else signs + refinement
    proofs = max(whole - signs - refinement, 0.0)
    assert result.refined is not None, "asked for"
    return {
        "total_s": round(whole, 3),
        "signs_share": round(signs / whole, 2),
        "proofs_share": round(proofs / whole, 2),
        "refinement_share": round(refinement / whole, 2),
        "proved": round(float(np.mean([limb.solution.proved for limb in result.limbs.values()])), 2),
        "steps": result.refined.n_iterations,
        "signs_ms": round(1e3 * signs, 1),
        "step_ms": round(1e3 * refinement / result.refined.n_iterations, 2),
    }


def run() -> list[Row]:
    """Return rows for whole reconstructions, and rows for the growth of time with F and K and its exponents."""
    rows: list[Row] = []
    for basis, basis in (
        ("hard", TrajectoryBasis(COMPONENTS)),
        ("soft", TrajectoryBasis(2 * COMPONENTS, 12.0)),
    ):
        for noise_px in (0.0, 1.0):
            row = _stages(shot(FRAMES, noise_px=noise_px), basis, limit_s=LIMIT_S)
            if not float(row["total_s"]) < BOUND_S:
                raise SystemExit(
                    f"a skeleton of {FRAMES} frames takes {row['total_s']} s, more than {BOUND_S:g} s"
                )
            rows.append({"job": f"whole, {basis} basis, {noise_px:g} px", **_sizes(FRAMES, basis), **row})
    for grows, sizes in (("F", BY_FRAMES), ("K", BY_COMPONENTS)):
        result = []
        for size in sizes:
            frames = size if grows == "F" else FRAMES
            basis = TrajectoryBasis(size if grows == "K" else COMPONENTS)
            row = _stages(shot(frames), basis, limit_s=0.0)
            result.append(row)
            rows.append({"job": f"growth with {grows}", **_sizes(frames, basis), **row})
        for stage in ("signs", "step"):
            rows[-1][f"{stage}_exponent"] = exponent(sizes, [float(row[f"{stage}_ms"]) for row in result])
    headings = dict.fromkeys(name for row in rows for name in row)
    return [{name: row.get(name, "") for name in headings} for row in rows]


def _sizes(frames: int, basis: TrajectoryBasis) -> Row:
    return {"frames": frames, "components": basis.components}
