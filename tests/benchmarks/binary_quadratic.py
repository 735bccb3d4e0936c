"""Time of the binary quadratic programme of one limb, compared with the solver SCIP, and its growth with F and K.

Limbs are synthetic: 300 mm, 4 m from the camera, 30 frames per second, sure to be smooth but not to lie in the basis.
SCIP takes part where pyscipopt is installed, in one thread, from nothing, on the first few limbs, by either of two
ways of writing the programme; the better counts.  ``first``: our first signs, or SCIP's time to any that
cost no more than our best; ``proof``: everything, or the limit where there is no proof, and how many were proved.
Wall times of one thread in milliseconds, medians over limbs.  ``bound_least`` is the worst lower bound over J.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from time import perf_counter
from types import ModuleType

import numpy as np

from pipeline.core.binary_quadratic import BinarySolution, minimise
from pipeline.core.binary_quadratic import descent as sign_search
from pipeline.core.binary_quadratic.candidates import programme_of
from pipeline.core.trajectory_basis import TrajectoryBasis, cosine_basis
from tests.benchmarks.tables import Row

LIMIT_S = 5.0
GAP = 1e-6
LIMBS = 10
FEW = 3
"""Number of limbs that SCIP solves."""


@dataclass(frozen=True)
class Limb:
    """Candidate positions of one limb in each frame, with the true signs and positions.

    Attributes
    ----------
    middle, half_chord : (F, 3)
        m and u, mm.
    signs : (F,) int
        The true ones.
    truth : (F, 3)
        The relative trajectory, mm.
    """

    middle: np.ndarray
    half_chord: np.ndarray
    signs: np.ndarray
    truth: np.ndarray


def limb(
    frames: int, seed: int, *, noise_px: float = 0.0, camera: str = "still", rate_hz: float = 1.5
) -> Limb:
    """Return a 300 mm limb that rotates smoothly about a moving parent joint, seen from 4 m with f = 1 000 px.

    Parameters
    ----------
    frames : int
        F, at 30 a second.
    seed : int
    noise_px : float
        Standard deviation of the noise of a pixel.
    camera : {"still", "shaky", "distant"}
        Where the camera is: in one place, wherever a hand takes it, or so far away that rays are parallel.
    rate_hz : float
        Above twice this the limb does not turn.
    """
    generator = np.random.default_rng(seed)
    seconds = frames / 30.0
    t = (np.arange(frames) + 0.5) / frames

    def smooth(dimensions: int, amplitude: float, rate: float) -> np.ndarray:
        orders = np.arange(1, max(3, int(2 * rate * seconds) + 1))
        weights = generator.standard_normal((len(orders), dimensions))
        weights /= 1 + (2 * orders[:, None] / len(orders)) ** 2
        moved = np.cos(np.pi * orders * t[:, None]) @ weights
        return amplitude * moved / np.sqrt(np.square(moved).mean())

    inclination = np.pi / 2 + smooth(1, 0.6, rate_hz)[:, 0]
    azimuth = generator.uniform(-np.pi, np.pi) + smooth(1, 0.9, rate_hz)[:, 0]
    truth = 300.0 * np.stack(
        [np.sin(inclination) * np.cos(azimuth), np.sin(inclination) * np.sin(azimuth), np.cos(inclination)],
        axis=1,
    )
    parent = smooth(3, 300.0, 0.8)
    centre = np.broadcast_to([0.0, -4000.0, 0.0], (frames, 3))
    if camera == "shaky":
        centre = centre + 300.0 * generator.standard_normal((frames, 3))
    ray = np.broadcast_to([0.0, 1.0, 0.0], (frames, 3)) if camera == "distant" else parent + truth - centre
    ray = ray / np.linalg.norm(ray, axis=1, keepdims=True)
    ray = ray + 1e-3 * noise_px * generator.standard_normal((frames, 3))
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    start = truth if camera == "distant" else centre - parent
    middle = start - (start * ray).sum(axis=1, keepdims=True) * ray
    neighbours = np.linalg.norm(middle, axis=1, keepdims=True)
    middle = middle * np.minimum(1.0, 300.0 / neighbours)  # where noise takes the ray past the sphere
    half_chord = np.sqrt(np.maximum(300.0**2 - np.square(middle).sum(axis=1, keepdims=True), 0.0)) * ray
    return Limb(middle, half_chord, np.where((truth * ray).sum(axis=1) < 0, -1, 1), truth)


@dataclass(frozen=True)
class Peer:
    """Result of SCIP: objective J recomputed from its signs, whether it is proved optimal, and the time."""

    objective: float
    proved: bool
    seconds: float
    seconds_to_target: float


def by_scip(
    scip: ModuleType,
    basis: np.ndarray,
    middle: np.ndarray,
    half_chord: np.ndarray,
    *,
    limit_s: float,
    target: float = -np.inf,
    residuals: bool = True,
) -> Peer:
    """Solve the programme with SCIP: smallest t with ||(I - B B^T)(m + s u)||² <= t, for an orthonormal basis B.

    Parameters
    ----------
    scip : module
        pyscipopt.
    basis : (F, K)
    middle, half_chord : (F, 3)
    limit_s : float
    target : float
        J at which the clock of `seconds_to_target` stops, mm²; SCIP's tolerance is added.
    residuals : bool
        Whether the residuals are variables of their own; otherwise one quadratic form over the signs.
    """
    frames = len(basis)
    scale = np.abs(half_chord).max()
    projector = np.eye(frames) - basis @ basis.T
    model = scip.Model()
    model.hideOutput()
    model.setParam("limits/time", limit_s)
    model.setParam("limits/gap", GAP)
    model.setParam("parallel/maxnthreads", 1)
    chosen = [model.addVar(vtype="B") for _ in range(frames)]
    epigraph = model.addVar(lb=0.0, ub=None)
    constant = projector @ (middle - half_chord) / scale
    linear = 2.0 * projector[:, :, None] * half_chord[None] / scale
    if residuals:
        squares = []
        for i in range(frames):
            for d in range(3):
                r = model.addVar(lb=None, ub=None)
                model.addCons(
                    r
                    == constant[i, d]
                    + scip.quicksum(float(linear[i, j, d]) * chosen[j] for j in range(frames))
                )
                squares.append(r * r)
        model.addCons(scip.quicksum(squares) <= epigraph)
    else:
        quadratic = np.einsum("ijd,ikd->jk", linear, linear)
        slope = 2.0 * np.einsum("ijd,id->j", linear, constant)
        terms = [
            float(quadratic[j, k]) * (1 if j == k else 2) * chosen[j] * chosen[k]
            for j in range(frames)
            for k in range(j + 1)
        ]
        terms += [float(slope[j]) * chosen[j] for j in range(frames)]
        model.addCons(scip.quicksum(terms) + float(np.square(constant).sum()) <= epigraph)
    model.setObjective(epigraph, "minimize")

    def cost(solution: object) -> float:
        signs = np.array([1.0 if model.getSolVal(solution, b) > 0.5 else -1.0 for b in chosen])
        points = middle + signs[:, None] * half_chord
        return float(np.square(points - basis @ (basis.T @ points)).sum())

    watch = _watch(scip, lambda: cost(model.getBestSol()) <= target * (1 + GAP))
    model.includeEventhdlr(watch, "watch", "when the best is good enough")
    watch.started = perf_counter()
    model.optimize()
    seconds = perf_counter() - watch.started
    if model.getNSols() == 0:
        return Peer(np.inf, False, seconds, np.inf)
    best = cost(model.getBestSol())
    reached = watch.reached if best > target * (1 + GAP) else min(watch.reached, seconds)
    return Peer(best, model.getStatus() in ("optimal", "gaplimit"), seconds, reached)


def _watch(scip: ModuleType, good: Callable[[], bool]):  # type: ignore[no-untyped-def]  # its base is imported late
    """Return an event handler of SCIP that records the time at which its best solution is first good enough."""

    class Watch(scip.Eventhdlr):  # type: ignore[name-defined]
        started = 0.0
        reached = np.inf

        def eventinit(self) -> None:
            self.model.catchEvent(scip.SCIP_EVENTTYPE.BESTSOLFOUND, self)

        def eventexit(self) -> None:
            self.model.dropEvent(scip.SCIP_EVENTTYPE.BESTSOLFOUND, self)

        def eventexec(self, event: object) -> None:
            if not np.isfinite(self.reached) and good():
                self.reached = perf_counter() - self.started

    return Watch()


def _ours(
    problems: list[tuple[np.ndarray, Limb]], limit_s: float
) -> tuple[list[float], list[BinarySolution], list[float]]:
    """Return the times to the first signs, ms, the solutions, and the times to the solutions, ms, of all problems."""
    first, result, whole = [], [], []
    for basis, single in problems:
        programme = programme_of(basis, single.middle, single.half_chord)
        started = perf_counter()
        sign_search.search(programme)
        first.append(1e3 * (perf_counter() - started))
        started = perf_counter()
        result.append(minimise(basis, single.middle, single.half_chord, gap=GAP, time_limit_s=limit_s))
        whole.append(1e3 * (perf_counter() - started))
    return first, result, whole


def _row(label: str, problems: list[tuple[np.ndarray, Limb]], limit_s: float, scip: ModuleType | None) -> Row:
    """Return the table row for one size and kind of limb."""
    first, result, whole = _ours(problems, limit_s)
    row: Row = {
        "limbs": label,
        "first_ms": float(np.median(first)),
        "first_most_ms": max(first),
        "first_is_best": f"{_first_is_best(problems, result)}/{len(result)}",
        "proof_ms": float(np.median(whole)),
        "proof_most_ms": max(whole),
        "proved": f"{sum(single.proved for single in result)}/{len(result)}",
        "bound_least": min(single.lower_bound / single.objective for single in result),
        "scip_first_ms": "",
        "scip_proof_ms": "",
        "scip_proved": "",
        "scip_over_ours": "",
    }
    if scip is not None:
        peers = []
        for (basis, single), mine in list(zip(problems, result, strict=True))[:FEW]:
            # Either way of writing it; each measure of the better one.
            runs = [
                by_scip(
                    scip,
                    basis,
                    single.middle,
                    single.half_chord,
                    limit_s=limit_s,
                    target=mine.objective,
                    residuals=way,
                )
                for way in (True, False)
            ]
            for run in runs:
                if run.proved and mine.proved and abs(run.objective - mine.objective) > 1e-4 * mine.objective:
                    raise SystemExit(
                        f"two proved optima of J differ: ours is {mine.objective:.8g}, SCIP's is {run.objective:.8g}"
                    )
            peers.append(runs)
        reached = float(np.median([min(run.seconds_to_target for run in runs) for runs in peers]))
        proof = float(np.median([min(run.seconds for run in runs) for runs in peers]))
        row["scip_first_ms"] = 1e3 * reached if np.isfinite(reached) else "never"
        row["scip_proof_ms"] = 1e3 * proof
        row["scip_proved"] = f"{sum(any(run.proved for run in runs) for runs in peers)}/{len(peers)}"
        row["scip_over_ours"] = 1e3 * proof / float(np.median(whole[:FEW]))
    return row


def _first_is_best(problems: list[tuple[np.ndarray, Limb]], found: list[BinarySolution]) -> int:
    """Return the number of limbs whose first signs were already the best that the whole search found."""
    programmes = [programme_of(basis, single.middle, single.half_chord) for basis, single in problems]
    firsts = [programme.objective(sign_search.search(programme)) for programme in programmes]
    return sum(first <= best.objective * (1 + 10 * GAP) for first, best in zip(firsts, found, strict=True))


def run() -> list[Row]:
    """Return rows for growing F and K without noise, and rows for noise, soft bases and other cameras."""
    scip: ModuleType | None = None
    try:
        scip = import_module("pyscipopt")
    except ImportError:
        print("pyscipopt is not installed: its columns stay empty")
    minimise(np.ones((1, 1)), np.zeros((1, 3)), np.ones((1, 3)))  # compiled before anything is timed
    rows = []
    for frames, components in (
        (20, 6),
        (40, 10),
        (60, 12),
        (100, 10),
        (100, 20),
        (100, 40),
        (200, 20),
        (200, 40),
    ):
        problems = [(cosine_basis(frames, components), limb(frames, seed)) for seed in range(LIMBS)]
        peer = scip if components == 20 or frames < 100 else None
        rows.append(_row(f"F = {frames}, K = {components}, no noise", problems, LIMIT_S, peer))
    for frames, components in ((100, 20), (200, 20), (200, 40), (500, 20), (500, 100)):
        problems = [
            (cosine_basis(frames, components), limb(frames, seed, noise_px=1.0)) for seed in range(LIMBS)
        ]
        rows.append(_row(f"F = {frames}, K = {components}, 1 px", problems, 1.0, None))
    soft = [
        (TrajectoryBasis(40, 10.0).rows(100, np.ones(100, dtype=bool)), limb(100, seed, noise_px=1.0))
        for seed in range(LIMBS)
    ]
    rows.append(_row("F = 100, soft, 1 px", soft, 1.0, None))
    for camera in ("shaky", "distant"):
        problems = [
            (cosine_basis(200, 40), limb(200, seed, noise_px=1.0, camera=camera)) for seed in range(LIMBS)
        ]
        rows.append(_row(f"F = 200, K = 40, 1 px, {camera} camera", problems, 1.0, None))
    return rows
