"""Tests of the library functions: reconstructions from one view, the shipped walkers, and motion files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import walk3d
from pipeline import fit, read
from pipeline.core import fourier, walking
from pipeline.core.fourier import FourierRepresentation
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.synthetic import walkers
from tests.rejects import rejects
from walk3d.anatomy import prior as anatomical
from walk3d.api import Reconstruction
from walk3d.film.reconstruct import model_file


@pytest.fixture(scope="module")
def walks() -> list[FourierRepresentation]:
    """Return the walks of 36 synthetic people, with the mean pelvis as origin."""
    output = walkers.walking_population(
        np.random.default_rng(8), male=18, female=18, duration_s=3.0, frame_rate_hz=40.0
    )
    return [
        fourier.represent(walking.set_origin(positions, origin="pelvis_mean"), 40.0)
        for positions in output.positions_mm
    ]


def rows_of(view_rad: float, hidden: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return matrices (O, 225) and (U, 225) from a sample to its observed and its unknown coefficients in a view."""
    c, s = np.cos(view_rad), np.sin(view_rad)
    axes = np.array([[c, s, 0.0], [0.0, 0.0, 1.0], [-s, c, 0.0]])
    turned = np.kron(np.eye(75), axes).reshape(5, 15, 3, 225)
    unknown = np.zeros((5, 15, 3), bool)
    unknown[..., 2] = True
    unknown[:, [WALKER15.index(joint) for joint in hidden]] = True
    return turned[~unknown], turned[unknown]


@pytest.mark.parametrize("hidden", [[], ["left_wrist", "right_knee"]])
def test_bars_of_a_known_laboratory_are_the_dense_posterior(
    walks: list[FourierRepresentation], hidden: list[str]
) -> None:
    """Error bars for a known laboratory equal the posterior of 225 coefficients, computed with full matrices."""
    model, view, noise = fit(walks[1:]), np.radians(35.0), 70.0
    result = walk3d.from_view(model, walks[0], 35.0, hidden=hidden, noise_variance_mm2=noise)
    observed, unseen = rows_of(view, hidden)
    C = (model.components.T * model.eigenvalues) @ model.components
    gain = C @ observed.T @ np.linalg.inv(observed @ C @ observed.T + noise * np.eye(len(observed)))
    conditional = C - gain @ observed @ C
    missing = unseen.T @ unseen @ conditional @ unseen.T @ unseen  # 225 x 225, nothing along the image
    variance = np.diag(missing).reshape(5, 15, 3)
    np.testing.assert_allclose(result.standard_deviation**2, variance, rtol=1e-7, atol=1e-6)
    split = missing.reshape(5, 15, 3, 5, 15, 3)
    for joint in (4, 9, 13):
        reference = split[:, joint, :, :, joint].transpose(1, 0, 3, 2)
        np.testing.assert_allclose(result.covariance[joint], reference, rtol=1e-6, atol=1e-6)
    # Half widths at an instant, a quarter of the cycle on: p0 + p1 - q2.
    weights = np.array([1.0, 1.0, 0.0, 0.0, -1.0])
    positions, half = result.at_instants(4)
    knee = WALKER15.index("left_knee")
    np.testing.assert_allclose(positions[1, knee], weights @ result.coefficients[:, knee])
    of_knee = np.einsum("p,apbq,q->ab", weights, result.covariance[knee], weights)
    np.testing.assert_allclose(half[1, knee], result.multipliers[knee] * np.sqrt(np.diag(of_knee)))


def test_bars_of_an_unknown_laboratory_are_the_linear_posterior_where_bones_count_little(
    walks: list[FourierRepresentation], monkeypatch: pytest.MonkeyPatch
) -> None:
    from walk3d.anatomy import one_view

    loose = anatomical.Tolerances(within=np.full(16, 1e9), pairs=np.full(len(anatomical.PAIRS), 1e9))
    monkeypatch.setattr(one_view.anatomical, "tolerances", lambda prior: loose)
    model, view = fit(walks[1:]), np.radians(35.0)
    result = walk3d.from_view(model, walks[0], 35.0, hidden=["head"], laboratory="unknown")
    learnt = one_view.learnt_prior(model.samples)
    prior = anatomical.unfamiliar(learnt, anatomical.Differences())
    C = prior.covariance.transpose(2, 0, 1, 5, 3, 4).reshape(225, 225)
    observed, unseen = rows_of(view, ["head"])
    image = observed @ C @ observed.T
    image += np.diag(100.0 + 0.2 * np.diag(image))
    gain = C @ observed.T @ np.linalg.inv(image)
    mean = anatomical.by_block(prior.mean).ravel()
    sample = walks[0].coefficients.ravel()
    expected = mean + gain @ (observed @ (sample - mean))
    np.testing.assert_allclose(unseen @ result.coefficients.ravel(), unseen @ expected, atol=1e-5)
    np.testing.assert_allclose(observed @ result.coefficients.ravel(), observed @ sample, atol=1e-9)
    conditional = unseen.T @ unseen @ (C - gain @ observed @ C) @ unseen.T @ unseen
    np.testing.assert_allclose(
        result.standard_deviation.ravel() ** 2, np.diag(conditional), rtol=1e-5, atol=1e-5
    )


def covered(found: Reconstruction, walk: FourierRepresentation, scale: float = 1.0) -> float:
    """Return the share of unseen coordinates that lie within their error bars, scaled by `scale`."""
    positions, half = found.at_instants(8)
    basis = fourier.cycle_basis(fourier.equal_phases(8), 5)
    true = np.einsum("kp,pja->kja", basis, walk.coefficients)
    unseen = half > 1e-6
    return float((np.abs(positions - true) <= scale * half)[unseen].mean())


@pytest.mark.parametrize("laboratory", ["known", "unknown"])
def test_bars_of_95_percent_hold_for_people_left_out(
    laboratory: str, walks: list[FourierRepresentation]
) -> None:
    model = fit(walks[8:])
    result = [walk3d.from_view(model, walk, 30.0, laboratory=laboratory) for walk in walks[:8]]
    shares = [covered(each, walk) for each, walk in zip(result, walks, strict=False)]
    assert np.mean(shares) > 0.9
    if laboratory == "known":  # the posterior of MAP alone is too narrow
        assert result[0].calibrated_on == 28
        of_normal = 1.959963984540054 / result[0].multipliers.mean()
        assert (
            np.mean([covered(each, walk, of_normal) for each, walk in zip(result, walks, strict=False)])
            < 0.85
        )
    else:
        assert result[0].calibrated_on == 0
        np.testing.assert_allclose(result[0].multipliers, 1.959963984540054)


def test_bars_of_few_walkers_are_as_computed(walks: list[FourierRepresentation]) -> None:
    result = walk3d.from_view(fit(walks[1:6]), walks[0], 30.0)
    assert result.calibrated_on == 0
    np.testing.assert_allclose(result.multipliers, 1.959963984540054)


def test_the_walkers_that_ship_bring_others_nearer(walks: list[FourierRepresentation]) -> None:
    trained = model_file.load()
    shipped = walk3d.walkers(1450.0, components=225)
    ratio = 1450.0 / 1500.0
    np.testing.assert_allclose(
        shipped.mean.reshape(5, 15, 3), ratio * np.moveaxis(trained.model.mean, -1, 0)[:5]
    )
    covariance = (shipped.components.T * shipped.eigenvalues) @ shipped.components
    reference = trained.model.covariance.reshape(15, 3, 9, 15, 3, 9)
    first, other = (2 * 15 + 4) * 3 + 1, (0 * 15 + 11) * 3 + 2  # q1 of the left wrist, p0 of the left ankle
    assert covariance[first, other] == pytest.approx(ratio**2 * reference[4, 1, 2, 11, 2, 0], rel=1e-6)
    assert covariance[first, first] == pytest.approx(ratio**2 * reference[4, 1, 2, 4, 1, 2], rel=1e-6)
    off = {"walkers": 0.0, "average": 0.0}
    for walk in walks[:4]:
        head = walk.coefficients[0, 0, 2] - walk.coefficients[0, [11, 14], 2].mean()
        model = walk3d.walkers(float(head))
        result = walk3d.from_view(model, walk, 30.0, laboratory="unknown")
        away = np.array([-np.sin(np.radians(30.0)), np.cos(np.radians(30.0)), 0.0])
        off["walkers"] += float((((result.coefficients - walk.coefficients) @ away) ** 2).sum())
        off["average"] += float((((model.mean.reshape(5, 15, 3) - walk.coefficients) @ away) ** 2).sum())
    assert off["walkers"] < 0.6 * off["average"]
    with rejects("out_of_range", "height_mm", value=0.0):
        walk3d.walkers(0.0)
    with rejects("out_of_range", "components", value=226):
        walk3d.walkers(components=226)
    with rejects("no_model"):
        walk3d.walkers(model_folder="nowhere")


def test_the_walkers_that_ship_are_calibrated_by_a_few_people(walks: list[FourierRepresentation]) -> None:
    """Calibration on eight people reduces the errors of the shipped walkers, and the error bars cover the truth."""
    people, off, shares = walks[:9], {"alone": 0.0, "calibrated": 0.0}, []
    shipped = walk3d.walkers(1450.0)
    for number, walk in enumerate(people[:4]):
        model = walk3d.calibrate(shipped, [other for k, other in enumerate(people) if k != number])
        assert len(model.laboratory) == 8
        for name, each in (("alone", shipped), ("calibrated", model)):
            result = walk3d.from_view(each, walk, 30.0, laboratory="unknown")
            off[name] += float(((result.coefficients - walk.coefficients) ** 2).sum())
        shares.append(covered(result, walk))
        np.testing.assert_array_equal(walk3d.from_view(model, walk, 30.0).coefficients, result.coefficients)
    assert off["calibrated"] < 0.6 * off["alone"]
    assert np.mean(shares) > 0.93
    with rejects("same_walk", "model"):
        walk3d.from_view(model, people[0], 30.0)
    with rejects("calibrated_already", "model"):
        walk3d.calibrate(model, people[:1])
    hidden = walk3d.from_view(model, people[3], 30.0, hidden=["head"])
    assert np.isfinite(hidden.coefficients).all()


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv", ".npz"])
def test_a_recording_is_written_and_read_again(suffix: str, tmp_path: Path) -> None:
    positions = np.random.default_rng(1).normal(0.0, 500.0, (12, 3, 3)).round(3)
    valid = np.ones((12, 3), bool)
    valid[4, 1] = False
    motion = MotionCapture(("A", "B", "C"), positions, valid, 50.0, "mm")
    path = walk3d.write(motion, tmp_path / f"walk{suffix}")
    if suffix == ".npz":
        with np.load(path, allow_pickle=False) as arrays:
            again, rate = arrays["positions_mm"], float(arrays["frame_rate_hz"])
            assert arrays["names"].tolist() == ["A", "B", "C"]
    else:
        back = read(path)
        assert back.names == motion.names
        np.testing.assert_array_equal(back.valid, valid)
        again, rate = back.positions_mm, back.frame_rate_hz
    assert rate == pytest.approx(50.0)
    np.testing.assert_allclose(again[valid], positions[valid], atol=2e-3)
    assert np.isnan(again[4, 1]).all()
    with rejects("not_replaced", path.name):
        walk3d.write(motion, path)
    assert walk3d.write(motion, path, replace=True) == path


def test_joints_are_written_with_the_axes_of_the_format(tmp_path: Path) -> None:
    output = walkers.walking_population(
        np.random.default_rng(2), male=1, female=1, duration_s=2.0, frame_rate_hz=40.0
    )
    shape = output.positions_mm.shape[1:3]
    motion = MotionCapture(tuple(WALKER15.joints), output.positions_mm[0], np.ones(shape, bool), 40.0, "mm")
    back = read(walk3d.write(motion, tmp_path / "walk.trc", skeleton="walker15"))
    x, y, z = np.moveaxis(output.positions_mm[0], -1, 0)
    np.testing.assert_allclose(back.positions_mm, np.stack([y, z, x], axis=-1), atol=2e-3)
    with rejects("unknown_choice", "the suffix of a motion file", value=".xyz"):
        walk3d.write(motion, tmp_path / "walk.xyz")
    with rejects("wrong_type", "motion"):
        walk3d.write(output.positions_mm, tmp_path / "walk.c3d")  # type: ignore[arg-type]
    missing = MotionCapture(motion.names, motion.positions_mm, motion.valid.copy(), 40.0, "mm")
    missing.valid[3, 2] = False
    with rejects("missing_sample", "walk.bvh", frame=3):
        walk3d.write(missing, tmp_path / "walk.bvh")
    assert not (tmp_path / "walk.bvh").exists()
