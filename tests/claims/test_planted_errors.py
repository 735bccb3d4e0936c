"""Tests with errors inserted into the code: each error makes a good verdict worse, and none makes a verdict better.

The figures are made again of 24 people, a few populations and coarse views, with the error in one function; the ledger
then judges them as it does published ones, conditions that claims rest on as well: a claim on a figure whose
condition is not met cannot be tested, so that nothing is earned by an error that makes results look better.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.cli.compose import compose
from pipeline.core import action_model, camera, linear_model, reconstruction, viewpoint
from pipeline.core.action_model import learning
from pipeline.core.articulated_trajectory import limb_choice
from pipeline.core.fourier import shift
from pipeline.core.trajectory_basis import TrajectoryBasis
from pipeline.papers import Agreement, Beyond
from pipeline.skeleton import WALKER15
from pipeline.stages import chain, populations
from pipeline.storage.store import Store
from pipeline.studies import ledger
from pipeline.studies.actions.model import ActionSpaceModel
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.limbs.model import TrajectoryBasisModel
from pipeline.studies.registry import all_measures
from pipeline.studies.walks import methods
from pipeline.studies.walks.methods import Fold, Walk

MEASURES = all_measures()

pytestmark = pytest.mark.thorough

REDUCED = (
    "data=synthetic", "scale=full", "scale.view_step_deg=15", "scale.sigma2_step_mm2=23", "scale.populations=4",
    "data.population=24", "workers=1", "figure.picture=false", "figure.recording=false",
)  # fmt: skip

SIZES = {
    "zhang2007_fig6": (
        "scale.view_step_deg=60",
        "scale.populations=3",
        "sweep.published_views_deg=[]",
        "data.population=80",
    ),
    "park2011_fig4": ("sweep.cameras=[still,moving]", "sweep.clips=12", "sweep.time_limit_s=0"),
}

KNOWN, UNKNOWN = ("zhang2007_fig3", "zhang2007_fig5"), ("zhang2007_fig6",)
LIMBS, ACTIONS = ("park2011_fig4",), ("mozerov2006_fig3",)
WARPS = (*ACTIONS, "mozerov2006_warp_error")

Views = Callable[..., Any]
from_known_views, estimate = reconstruction.from_known_views, viewpoint.estimate
select_signs, teach, held_out = limb_choice.select_signs, ActionSpaceModel.teach, methods.held_out
learn_action, build = action_model.learn_action, FourierDataset.build


def made_of(figures: tuple[str, ...], folder: Path) -> dict[str, Any]:
    """Compute the tables of the figures, and return them by the names that claims use."""
    result: dict[str, Any] = {}
    for name in figures:
        experiment = compose([f"experiment={name}", *REDUCED, *SIZES.get(name, ())])
        store = Store(folder)
        inputs = FigureInputs(experiment, *(retained.value for retained in chain.run(experiment, store)))
        tables = {**experiment.figure.tables(inputs), **populations.tables(experiment, store)}
        result |= {name if key == "table" else f"{name}/{key}": table for key, table in tables.items()}
    return result


def with_the_people_of(made: Path, folder: Path) -> Path:
    """Copy the cached people of one results folder to another, without any result computed from them.

    They are drawn, and their walks represented, without any function in whose place an error is put.
    """
    for stage in ("ingest", "population"):
        for retained in (made / "cache").glob(f"{stage}-*"):
            shutil.copytree(retained, folder / "cache" / retained.name)
    return folder


Answers = dict[str, tuple[Agreement, Beyond, float | None]]


def answers(figures: tuple[str, ...], folder: Path) -> Answers:
    """Return both verdicts on each claim that needs only these figures."""
    output = made_of(figures, folder)
    claims = [claim for claim in ledger._claims(figures) if set(claim.tables) <= set(output)]
    judged = ledger.judge(claims, output, "synthetic", overridden=True, measures=MEASURES)
    return {v.claim.name: (v.agreement, v.beyond, v.value) for v in judged}


GOOD_AGREEMENT = (Agreement.AGREES, Agreement.MET)


def lost(clean: Answers, planted: Answers) -> list[str]:
    """Return the claims with a good verdict that became worse; claims that became undecided are not counted."""
    return [
        name
        for name, (agreement, beyond, _) in clean.items()
        if (agreement in GOOD_AGREEMENT and planted[name][0] not in (*GOOD_AGREEMENT, Agreement.UNDECIDED))
        or (beyond is Beyond.YES and planted[name][1] is not Beyond.YES)
    ]


def earned(clean: Answers, planted: Answers) -> list[str]:
    """Return the claims that became good: they agree with the paper, and beat their baseline if they have one."""

    def good(answer: tuple[Agreement, Beyond, float | None]) -> bool:
        return answer[0] in GOOD_AGREEMENT and answer[1] in (Beyond.YES, Beyond.NOT_APPLICABLE)

    return [name for name in clean if good(planted[name]) and not good(clean[name])]


# --- the plants -------------------------------------------------------------------------------------------


def average_walker(fold: Any, sample: np.ndarray, views: np.ndarray, *, noise_variance: float | None) -> Any:
    return from_known_views(linear_model.truncated(fold, 1), sample, views, noise_variance=1e15)


def average_walker_for_map(
    fold: Any, sample: np.ndarray, views: np.ndarray, *, noise_variance: float | None
) -> Any:
    plain = average_walker if noise_variance else from_known_views
    return plain(fold, sample, views, noise_variance=noise_variance)


def wrong_sign(fold: Any, sample: np.ndarray, views: np.ndarray, *, noise_variance: float | None) -> Any:
    result = from_known_views(fold, sample, views, noise_variance=noise_variance)
    return replace(result, missing=-result.missing, delta=result.delta + 2 * result.missing)


def compared_with(found: Any, sample: np.ndarray, views: np.ndarray) -> Any:
    true = camera.missing_dimension(linear_model.unflatten(sample), views[:, None, None])
    return replace(found, delta=true - found.missing)


def mirrored_camera(fold: Any, sample: np.ndarray, views: np.ndarray, *, noise_variance: float | None) -> Any:
    turned = linear_model.unflatten(sample) * [-1.0, -1.0, 1.0]
    result = from_known_views(
        fold, linear_model.flatten(turned[None])[0], views, noise_variance=noise_variance
    )
    return compared_with(result, sample, views)


def shuffled_views(fold: Any, sample: np.ndarray, views: np.ndarray, *, noise_variance: float | None) -> Any:
    order = np.random.default_rng(1).permutation(len(views))
    result = from_known_views(fold, sample, views[order], noise_variance=noise_variance)
    return compared_with(result, sample, views)


def shuffled_images(fold: Any, observed: np.ndarray, **options: Any) -> Any:
    return estimate(fold, np.roll(observed, len(observed) // 2, axis=0), **options)


def knows_everybody(self: Eigenwalkers, walker: int) -> Any:
    retained = self.kept
    return linear_model.LinearModel(
        self.mean, self.components[:retained], self.eigenvalues[:retained], self.total_variance, 1.0
    )


def five_per_cent_larger(*arguments: Any) -> tuple[Fold, Walk]:
    fold, walk = held_out(*arguments)
    return fold, replace(walk, sample=1.05 * walk.sample)


def believes_the_image(*arguments: Any) -> tuple[Fold, Walk]:
    fold, walk = held_out(*arguments)
    return replace(fold, noise_variance_mm2=1.0), walk


def signs_at_random(hits: Any, solution: Any, used: Any, basis: Any, *, mirrored: bool) -> Any:
    signs = np.random.default_rng(len(solution.signs)).choice([-1, 1], len(solution.signs))
    drawn = replace(solution, signs=signs, values=signs.astype(float), mirror_signs=-signs)
    return select_signs(hits, drawn, used, basis, mirrored=mirrored)


def stretched_in_time(self: ActionSpaceModel, *arguments: Any, **options: Any) -> Any:
    learnt = teach(self, *arguments, **options)
    return replace(learnt, synchronized=learnt.linear, disparity=np.zeros_like(learnt.disparity))


def largest_for_median(distances: np.ndarray) -> int:
    return int(np.asarray(distances).sum(axis=1).argmax())


def smoothness_times(factor: float) -> Callable[..., Any]:
    def learnt(postures: Any, **options: Any) -> Any:
        return learn_action(postures, **{**options, "smoothness": factor * options["smoothness"]})

    return learnt


def cosines(fewer: Callable[[int], int]) -> Callable[..., Any]:
    def basis(self: TrajectoryBasisModel) -> TrajectoryBasis:
        return TrajectoryBasis(fewer(self.components), self.cutoff)

    return basis


def some(data: FourierSamples, share: int) -> np.ndarray:
    """Return a mask (R,) of the walkers that get an input error: every `share`-th walker."""
    return np.arange(len(data.clip)) % share == share - 1


def phases_moved(data: FourierSamples, angles: np.ndarray) -> FourierSamples:
    return replace(
        data, coefficients=np.stack([shift(c, a) for c, a in zip(data.coefficients, angles, strict=True)])
    )


def phase_zero_spread(data: FourierSamples) -> FourierSamples:
    return phases_moved(data, np.radians(10.0) * np.random.default_rng(1).standard_normal(len(data.clip)))


def phase_zero_shifted(data: FourierSamples) -> FourierSamples:
    return phases_moved(data, np.full(len(data.clip), np.radians(40.0)))


def head_and_sternum_exchanged(data: FourierSamples) -> FourierSamples:
    order, places = np.arange(15), [WALKER15.index("head"), WALKER15.index("sternum")]
    order[places] = places[::-1]
    return changed(data, some(data, 3), lambda part: part[:, order], lambda part: part[order])


def changed(
    data: FourierSamples,
    those: np.ndarray,
    series: Callable[[np.ndarray], np.ndarray],
    power: Callable[[np.ndarray], np.ndarray],
) -> FourierSamples:
    """Return samples in which the coefficients (5, 15, 3) and covariances (15, 3, 3) of some walkers are changed."""
    output = {}
    for name, change in (
        ("coefficients", series),
        ("residual_covariance", power),
        ("temporal_covariance", power),
    ):
        output[name] = getattr(data, name).copy()
        for r in np.flatnonzero(those):
            output[name][r] = change(output[name][r])
    return replace(data, **output)


def eight_per_cent_small(data: FourierSamples) -> FourierSamples:
    return changed(data, some(data, 8), lambda part: 0.92 * part, lambda part: 0.92**2 * part)


def half_the_frequency(data: FourierSamples) -> FourierSamples:
    """Represent every eighth walker at half the stride frequency, so that the fundamental is the second harmonic."""
    those = some(data, 8)
    coefficients, residual = data.coefficients.copy(), data.residual_covariance.copy()
    second = coefficients[those, 3:5]
    residual[those] += 0.5 * np.einsum("rhji,rhjk->rjik", second, second)
    coefficients[those, 3:5], coefficients[those, 1:3] = coefficients[those, 1:3], 0.0
    frequency = np.where(those, 0.5, 1.0) * data.frequency_hz
    return replace(data, coefficients=coefficients, residual_covariance=residual, frequency_hz=frequency)


def heading_spread(data: FourierSamples) -> FourierSamples:
    turns = np.radians(5.0) * np.random.default_rng(1).standard_normal(len(data.clip))
    output = data
    for r, turn in enumerate(turns):
        about = np.array(
            [[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]]
        )
        output = changed(
            output, np.arange(len(turns)) == r, partial(turned, about), partial(turned_twice, about)
        )
    return output


def turned(about: np.ndarray, part: np.ndarray) -> np.ndarray:
    return part @ about.T


def turned_twice(about: np.ndarray, part: np.ndarray) -> np.ndarray:
    return about @ part @ about.T


def residual_dropped(data: FourierSamples) -> FourierSamples:
    left = data.temporal_covariance - data.residual_covariance
    return replace(data, residual_covariance=np.zeros_like(left), temporal_covariance=left)


def with_walkers(error: Callable[[FourierSamples], FourierSamples]) -> Callable[..., FourierSamples]:
    """Return the dataset stage with an error added to its result."""

    def built(self: FourierDataset, *arguments: Any, **options: Any) -> FourierSamples:
        return error(build(self, *arguments, **options))

    return built


def of_walkers(
    error: Callable[[FourierSamples], FourierSamples],
) -> tuple[tuple[str, ...], tuple[Any, str, Any]]:
    return KNOWN, (FourierDataset, "build", with_walkers(error))


PLANTS: dict[str, tuple[tuple[str, ...], tuple[Any, str, Any]]] = {
    "average walker for both approaches": (KNOWN, (reconstruction, "from_known_views", average_walker)),
    "average walker for MAP": (KNOWN, (reconstruction, "from_known_views", average_walker_for_map)),
    "wrong sign of the missing axis": (KNOWN, (reconstruction, "from_known_views", wrong_sign)),
    "camera mirrored": (KNOWN, (reconstruction, "from_known_views", mirrored_camera)),
    "test walker in the model": (KNOWN, (Eigenwalkers, "fold", knows_everybody)),
    "sigma² = 1": (KNOWN, (methods, "held_out", believes_the_image)),
    "views shuffled, experiment 1": (KNOWN, (reconstruction, "from_known_views", shuffled_views)),
    "views shuffled, experiment 2": (UNKNOWN, (viewpoint, "estimate", shuffled_images)),
    "test walker 5 % too large": (KNOWN, (methods, "held_out", five_per_cent_larger)),
    "linear for dense matching": (ACTIONS, (ActionSpaceModel, "teach", stretched_in_time)),
    "random signs": (LIMBS, (limb_choice, "select_signs", signs_at_random)),
    "median → max": (ACTIONS, (learning, "median_sequence", largest_for_median)),
    "mu × 10": (WARPS, (action_model, "learn_action", smoothness_times(10.0))),
    "mu = 0": (WARPS, (action_model, "learn_action", smoothness_times(0.0))),
    "K − 1 cosines": (LIMBS, (TrajectoryBasisModel, "limb_basis", cosines(lambda k: k - 1))),
    "K / 2 cosines": (LIMBS, (TrajectoryBasisModel, "limb_basis", cosines(lambda k: k // 2))),
    "phase zero with sd 10°": of_walkers(phase_zero_spread),
    "head and sternum exchanged in a third": of_walkers(head_and_sternum_exchanged),
    "an eighth of the people 8 % small": of_walkers(eight_per_cent_small),
    "an eighth at half the frequency": of_walkers(half_the_frequency),
    "heading with sd 5°": of_walkers(heading_spread),
    "residual dropped from the truth": of_walkers(residual_dropped),
}
"""Affected figures, function to replace, and replacement with the error, for each inserted error."""


@contextmanager
def planted(name: str) -> Iterator[tuple[str, ...]]:
    """Insert an error into the code, and yield the figures that it affects."""
    figures, (owner, attribute, error) = PLANTS[name]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(owner, attribute, error)
        yield figures


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results folder of the figures that are computed without an error."""
    return tmp_path_factory.mktemp("clean")


@pytest.fixture(scope="module")
def clean(made: Path) -> Answers:
    """Verdicts on the claims without an error in the code."""
    return answers((*KNOWN, *UNKNOWN, *LIMBS, *WARPS), made)


@pytest.mark.parametrize("name", PLANTS)
def test_an_error_takes_a_good_verdict_away_and_earns_none(
    name: str, clean: Answers, made: Path, tmp_path: Path
) -> None:
    with planted(name) as figures:
        result = answers(figures, with_the_people_of(made, tmp_path))
    before = {claim: clean[claim] for claim in result if claim in clean}
    gone, won = lost(before, result), earned(before, result)
    print(f"\n{name}: {len(gone)} taken away, {len(won)} earned")
    for claim in (*gone, *won):
        print(f"  {claim}: {before[claim]} -> {result[claim]}")
    assert gone
    assert not won


def test_a_phase_zero_shifted_alike_for_all_moves_nothing(clean: Answers, made: Path, tmp_path: Path) -> None:
    figures, (owner, attribute, error) = of_walkers(phase_zero_shifted)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(owner, attribute, error)
        result = answers(figures, with_the_people_of(made, tmp_path))
    for claim, (agreement, beyond, value) in result.items():
        before = clean[claim]
        assert (agreement, beyond) == before[:2], claim
        if value is not None:
            assert value == pytest.approx(before[2], rel=1e-6, abs=1e-9), claim
