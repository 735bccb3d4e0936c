"""Errors for a walker outside all data sets, reconstructed by models trained on one data set.

Intervals are over the training people.  A bootstrap would train on about two thirds as many different people, with
fewer eigenwalkers.  Therefore each person's influence on the logarithm of the error is computed by leaving the person
out. Resampled errors are linear in these influences (infinitesimal jackknife).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline import formats, mappings
from pipeline.clips.options import Data
from pipeline.clips.walks import walk_in, walks_of
from pipeline.core import bootstrap, camera, errors, linear_model, reconstruction
from pipeline.ingestion.author import AVERAGE, find_here
from pipeline.ingestion.joints import joints_of
from pipeline.processes import map_processes
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples, Pelvis, Sternum
from pipeline.studies.study import Sweep, Swept, scaled
from pipeline.validation import Count, InvalidInput, Positive
from walk3d.anatomy.prior import Differences
from walk3d.anatomy.study.model import AnatomicalInputs
from walk3d.anatomy.study.sweeps.held_out import Fold, People
from walk3d.anatomy.study.sweeps.setting import Setting, anatomical_setting

METHODS = ("average_walker", "least_squares", "map_70", "map_best", "anybody")
ERROR_VIEWS_DEG = (0.0, 30.0, 60.0, 90.0)
POSTURE_VIEWS_DEG = (0.0, 30.0, 90.0)
NOISE_VARIANCES_MM2 = (70.0, 150.0, 300.0, 500.0, 1000.0, 2000.0, 5000.0, 10000.0)
"""Candidates for sigma² of MAP.

The best candidate is an oracle, because the ground truth of the walker selects it.
"""
DRAWS = 400
"""Number of resamples of the training people."""


@dataclass(frozen=True)
class OutsideErrors:
    """Errors and postures of a walker who is outside all data sets.

    Attributes
    ----------
    rows : DataFrame
        Root mean square error of the missing dimension, mm, by method and error view.
    draws : DataFrame
        The same for resampled training people, by `draw`.
    curve : DataFrame
        The same as `rows`, for all views.
    variances : DataFrame
        Missing variance, mm², by view and person; the walker is last, with ``walker`` in `who`.
    posture_truth : (B, 15, 3)
        Fourier representation of the walker, mm.
    posture_missing : (M, V, B, 15)
        Missing dimension, reconstructed from the posture views, mm.
    printed_noise_mm2, best_noise_mm2 : float
        sigma² of ``map_70`` and ``map_best``.
    source : str
        Source of the walker with its terms, or the file's name if it states no source.
    """

    rows: pd.DataFrame
    draws: pd.DataFrame
    curve: pd.DataFrame
    variances: pd.DataFrame
    posture_truth: np.ndarray
    posture_missing: np.ndarray
    printed_noise_mm2: float
    best_noise_mm2: float
    source: str


class AverageWalkerErrors(Sweep):
    """Errors of a walker from a file, by default the average walker from Troje's laboratory."""

    draws_random_numbers = True

    walker: str = ""  # file of another walker; empty: the author's walker in data/sources.csv
    pelvis: Pelvis = Pelvis.measured  # definition, the same as for the people
    sternum: Sternum = Sternum.measured  # definition, the same as for the people
    components: Count = 30  # eigenwalkers of least squares and MAP
    noise_variance_mm2: Positive = 70.0  # of the printed MAP
    view_angle_deg: Swept = scaled(start=0, stop=90, step="view_step_deg")  # of the curves

    def further_files(self, data: Data) -> dict[str, Path]:
        """Return the path of the file with the outside walker, with the key ``walker``."""
        if self.walker:
            if not Path(self.walker).is_file():
                raise InvalidInput(
                    "the file does not exist",
                    "sweep.walker",
                    received=self.walker,
                    code="no_file",
                    typed=True,
                )
            return {"walker": Path(self.walker)}
        return {"walker": find_here(AVERAGE, data).path}

    def measure(self, inputs: AnatomicalInputs) -> OutsideErrors:
        """Return the errors of all methods, with models of all people and with models that leave one person out.

        The models without one person give the intervals over the training people.
        """
        people = People(inputs.dataset, inputs.model)
        dataset = FourierDataset(harmonics=people.harmonics, pelvis=self.pelvis, sternum=self.sternum)
        walker, source = read_walker(inputs.files["walker"], dataset)
        whole = anatomical_setting(inputs.model_options, people.harmonics)
        test = _Test(people, walker, replace(whole, differences=Differences()), self)
        grid = self.view_angle_deg.values("sweep.view_angle_deg")
        errors_deg, postures_deg = np.array(ERROR_VIEWS_DEG), np.array(POSTURE_VIEWS_DEG)
        best, error = test.errors((), errors_deg)
        left_out = map_processes(
            lambda person: test.errors((person,), errors_deg)[1], range(people.count), inputs.workers
        )
        missing = test.missing(people.fold(), postures_deg, best)
        return OutsideErrors(
            rows=_rows(error, errors_deg),
            draws=_draws(error, np.stack(left_out), inputs.generator("people")),
            curve=_rows(test.errors((), grid, best)[1], grid),
            variances=_variances(inputs.dataset, inputs.model.tested, walker, grid),
            posture_truth=walker.coefficients[0],
            posture_missing=missing,
            printed_noise_mm2=self.noise_variance_mm2,
            best_noise_mm2=best,
            source=source,
        )


class _Test:
    """Reconstruction of the outside walker by models that are trained on the data set."""

    def __init__(
        self, people: People, walker: FourierSamples, anybody: Setting, options: AverageWalkerErrors
    ) -> None:
        self.people, self.anybody, self.options = people, anybody, options
        self.truth = walker.coefficients[0]
        self.residual = walker.residual_covariance[0]
        tested = people.model.tested
        self.samples = linear_model.flatten(people.data.coefficients[tested][:, :5])

    def missing(self, fold: Fold, view_deg: np.ndarray, noise_mm2: float, *without: int) -> np.ndarray:
        """Return the reconstructed missing dimension (M, A, B, 15) of the outside walker by M methods from A views, mm.

        `noise_mm2` is sigma² of ``map_best``.
        """
        view, blocks = np.radians(view_deg), len(self.truth)
        model = self.model(*without)
        sample = linear_model.flatten(self.truth[None, :5])[0]
        missing = np.zeros((len(METHODS), len(view), blocks, len(WALKER15.joints)))
        average = linear_model.unflatten(model.mean)
        missing[0, :, :5] = camera.missing_dimension(average, view[:, None, None])
        for m, noise in enumerate((None, self.options.noise_variance_mm2, noise_mm2), 1):
            views = reconstruction.from_known_views(model, sample, view, noise_variance=noise)
            missing[m, :, :5] = views.missing
        (estimate,) = fold.reconstruct([self.anybody], self.truth[None], view)
        along_view = estimate.estimated[:, 0].reshape(len(view), len(WALKER15.joints), -1)
        missing[-1] = along_view.swapaxes(1, 2)
        return missing

    def model(self, *without: int) -> linear_model.LinearModel:
        """Return the average walker and the eigenwalkers of all training people except those left out."""
        return linear_model.fit(np.delete(self.samples, without, axis=0), self.options.components)

    def best_noise(self, model: linear_model.LinearModel) -> float:
        """Return the sigma², mm², with the smallest mean error of MAP over the views of the error tables."""
        sample, view = linear_model.flatten(self.truth[None, :5])[0], np.radians(ERROR_VIEWS_DEG)
        deltas = [
            reconstruction.from_known_views(model, sample, view, noise_variance=noise).delta
            for noise in NOISE_VARIANCES_MM2
        ]
        return NOISE_VARIANCES_MM2[int(np.argmin([errors.absolute_error(delta).mean() for delta in deltas]))]

    def errors(
        self, without: tuple[int, ...], view_deg: np.ndarray, noise_mm2: float = 0.0
    ) -> tuple[float, np.ndarray]:
        """Return sigma², mm², of the method ``map_best``, and the RMS errors (M, A), mm, of M methods from A views.

        If the given sigma² is 0, the sigma² with the smallest error is selected.
        """
        noise_mm2 = noise_mm2 or self.best_noise(self.model(*without))
        view = np.radians(view_deg)
        missing = self.missing(self.people.fold(*without), view_deg, noise_mm2, *without)
        delta = camera.missing_dimension(self.truth, view[:, None, None]) - missing
        power = errors.absolute_error(delta, errors.along_missing(self.residual, view))
        return noise_mm2, np.sqrt(errors.walker_error(power))


def read_walker(path: Path, dataset: FourierDataset) -> tuple[FourierSamples, str]:
    """Read a walk from a file; return its Fourier representation, and the walk's source with its terms of use.

    Raises
    ------
    InvalidInput
        If the file has no steady walk, or a joint was not measured.
    """
    motion, positions, valid = joints_of(formats.read(path), mappings.chosen(mappings.AUTO))
    prepared = walk_in(path.stem, positions, motion.frame_rate_hz, valid, motion.up)
    if prepared.positions is None:
        raise InvalidInput(str(prepared.row["reason"]), path.name, code=prepared.row["code"])
    samples = dataset.build(walks_of([prepared]), workers=1)
    if samples.unmeasured.any():
        raise InvalidInput("a joint of the walker was not measured", path.name, code="joints_not_measured")
    sources = [note.removeprefix("Source: ") for note in motion.notes if note.startswith("Source: ")]
    return samples, sources[0].rstrip(".") if sources else path.name


def _rows(error: np.ndarray, view_deg: np.ndarray) -> pd.DataFrame:
    """Return errors (M, A) as a table with a row for each of M methods and A views."""
    return pd.DataFrame(
        {
            "method": np.repeat(METHODS, len(view_deg)),
            "view_angle_deg": np.tile(view_deg, len(METHODS)),
            "rms_error_mm": error.ravel(),
        }
    )


def _draws(error: np.ndarray, left_out: np.ndarray, generator: np.random.Generator) -> pd.DataFrame:
    """Return a table of errors for resampled training people, approximated from leave-one-out errors (P, M, A)."""
    count, logarithm = len(left_out), np.log(left_out)
    influence = (count - 1) * (logarithm.mean(axis=0) - logarithm)
    times = bootstrap.resampling_weights(count, generator, resamples=DRAWS)
    drawn = error * np.exp(np.einsum("bp,pma->bma", times / count, influence))
    views = np.array(ERROR_VIEWS_DEG)
    tables = [_rows(draw_errors, views).assign(draw=number) for number, draw_errors in enumerate(drawn)]
    return pd.concat(tables, ignore_index=True)


def _variances(
    people: FourierSamples, tested: np.ndarray, walker: FourierSamples, view_deg: np.ndarray
) -> pd.DataFrame:
    """Return the missing variance, mm², of each person and of the walker, by view."""
    tables = []
    for samples, number, who in [
        *((people, n, str(people.person[n])) for n in tested),
        (walker, 0, "walker"),
    ]:
        posture = samples.coefficients[number, 0]
        variance = errors.missing_variance(samples.temporal_covariance[number], posture, np.radians(view_deg))
        tables.append(
            pd.DataFrame({"who": who, "view_angle_deg": view_deg, "missing_variance_mm2": variance})
        )
    return pd.concat(tables, ignore_index=True)
