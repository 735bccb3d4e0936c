"""Tests of samples of walks: samples computed one walk at a time equal samples computed from stored clips."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import partial

import numpy as np
import pytest

from pipeline.clips import walks
from pipeline.clips.options import Steady
from pipeline.ingestion.data import SyntheticData
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples, Pelvis, Size, Sternum

PEOPLE = SyntheticData(name="synthetic", population=9, duration_s=5.0)


def assert_same(one: FourierSamples, other: FourierSamples) -> None:
    for part in fields(FourierSamples):
        np.testing.assert_array_equal(getattr(one, part.name), getattr(other, part.name))


@pytest.mark.parametrize(
    "dataset",
    [
        FourierDataset(),
        FourierDataset(frequency=True),
        FourierDataset(size=Size.stature),
        FourierDataset(harmonics=3),
        FourierDataset(pelvis=Pelvis.above, sternum=Sternum.below_shoulders),
    ],
)
@pytest.mark.parametrize("ratio", [1.6, 1.03])
def test_walks_that_are_let_go_have_the_samples_and_the_report_of_those_that_are_kept(
    dataset: FourierDataset, ratio: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        walks, "Steady", partial(Steady, frequency_ratio=ratio)
    )  # 1.03: many are compared again
    retained = walks.synthetic_walks(PEOPLE, 5, 1)
    gone = dataset.shared().represent(partial(walks.streamed_walks, PEOPLE, 5, 1))
    assert len(gone.positions) == 0
    assert gone.report == retained.report
    assert any(row["reason"] for row in gone.report) == (ratio < 1.1)
    np.testing.assert_array_equal(gone.stature_mm, retained.stature_mm)
    assert_same(dataset.build(gone, workers=1), dataset.build(retained, workers=1))


def test_people_of_normalised_size_are_as_large_as_their_walks_would_be() -> None:
    retained = walks.synthetic_walks(PEOPLE, 5, 1)
    reference, same = (
        FourierDataset(size=size).build(retained, workers=1) for size in (Size.absolute, Size.stature)
    )
    scale = retained.stature_mm.mean() / retained.stature_mm
    np.testing.assert_allclose(
        same.coefficients, scale[:, None, None, None] * reference.coefficients, rtol=1e-12
    )
    for name in ("residual_covariance", "temporal_covariance"):
        grown = scale[:, None, None, None] ** 2 * getattr(reference, name)
        np.testing.assert_allclose(getattr(same, name), grown, rtol=1e-12)
    np.testing.assert_array_equal(same.residual_fraction, reference.residual_fraction)


@pytest.mark.parametrize("everywhere", [False, True])
def test_a_sternum_below_the_shoulders_is_as_unknown_as_these(everywhere: bool) -> None:
    retained = walks.synthetic_walks(replace(PEOPLE, population=3, duration_s=3.0), 5, 1)
    missing = np.zeros((3, 15), bool)
    sternum, shoulder = WALKER15.index("sternum"), WALKER15.index("left_shoulder")
    missing[0, sternum] = missing[1, shoulder] = True
    lacking = {"dropped": missing.any(axis=0)} if everywhere else {"estimated": missing}
    clips = replace(retained, **lacking)
    measured, below = (FourierDataset(sternum=sternum).build(clips, workers=1) for sternum in Sternum)
    expected = missing | (everywhere & missing.any(axis=0))
    np.testing.assert_array_equal(measured.unmeasured, expected)
    expected[:, sternum] = expected[:, shoulder]
    np.testing.assert_array_equal(below.unmeasured, expected)
    assert (below.coefficients[:, :, sternum] == 0.0).all() == everywhere
