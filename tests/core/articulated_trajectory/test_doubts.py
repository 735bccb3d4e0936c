"""Tests of a reconstruction's warnings: too few cosines, large residuals, upside-down images, wrong lengths."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from pipeline.core import camera_paths
from pipeline.core.articulated_trajectory import Articulated, Options, TrajectoryBasis, prepared, reconstruct
from pipeline.core.limb_chain import Chain, relative_trajectories
from pipeline.core.pinhole import Pinhole
from pipeline.core.reconstructibility import confidence_of_mirror_margin
from pipeline.skeleton import WALKER15
from pipeline.synthetic.limbs import synthetic_body
from tests.rejects import rejects

LEG = Chain(("left_hip", "left_knee", "left_ankle"), (None, "left_hip", "left_knee"))
FRAMES, RATE_HZ = 297, 30.0
HEIGHT_PX = 1080.0


class Film:
    """A synthetic leg, and its images from a hand-held camera above the hip."""

    def __init__(self, *, bandwidth: int = 40) -> None:
        generator = np.random.default_rng(5)
        body = synthetic_body(generator, FRAMES, bandwidth=bandwidth)
        self.truth = body.positions_mm[:, [WALKER15.index(joint) for joint in LEG.joints]]
        self.lengths = np.linalg.norm(relative_trajectories(LEG, self.truth), axis=-1).mean(axis=0)
        hip = self.truth[:, 0]
        path = camera_paths.around(FRAMES, target=hip.mean(axis=0), sweep_rad=1.0, height_mm=700.0)
        shaken = camera_paths.hand_held(generator, path, target=hip.mean(axis=0))
        in_middle = np.array([[1.0, 0.0, 960.0], [0.0, 1.0, 0.5 * HEIGHT_PX], [0.0, 0.0, 1.0]])
        self.camera = Pinhole(in_middle @ shaken.intrinsics, shaken.rotation, shaken.centre)
        self.images = self.camera.project(self.truth)

    def reconstructed(self, **changes: Any) -> Articulated:
        inputs: dict[str, Any] = {"images": self.images, "lengths": self.lengths, "frame_rate_hz": RATE_HZ}
        options = Options(time_limit_s=0.0, basis=changes.pop("basis", None))
        inputs |= changes
        images, lengths = inputs.pop("images"), inputs.pop("lengths")
        return reconstruct(images, self.camera, self.truth[:, 0], lengths, options, chain=LEG, **inputs)

    def errors_mm(self, found: Articulated) -> np.ndarray:
        return np.asarray(np.linalg.norm(found.positions - self.truth, axis=-1).mean(axis=0)[1:])


@contextmanager
def heard() -> Iterator[list[str]]:
    """Collect the texts of warnings, and check that none is longer than 300 characters."""
    sentences: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield sentences
    sentences += [str(warning.message) for warning in caught]
    assert all(len(words) <= 300 for words in sentences)


# --- number of cosines ------------------------------------------------------------------------------------


def test_cosines_are_eight_to_a_second_unless_a_basis_is_given() -> None:
    film = Film()
    inputs = (film.images, film.camera, film.truth[:, 0], film.lengths)
    for rate, components in ((30.0, 79), (120.0, 20), (10.0, 148)):
        assert prepared(*inputs, chain=LEG, frame_rate_hz=rate).options.basis == TrajectoryBasis(components)
    basis = TrajectoryBasis(12, 3.0)
    for rate in (None, 30.0):
        assert prepared(*inputs, Options(basis), chain=LEG, frame_rate_hz=rate).options.basis == basis
    with rejects("no_frame_rate", "frame_rate_hz"):
        reconstruct(*inputs, chain=LEG)
    for rate in (0.0, -30.0, np.nan):
        with rejects("out_of_range", "frame_rate_hz"):
            reconstruct(*inputs, chain=LEG, frame_rate_hz=rate)


def test_a_clip_of_ten_seconds_is_recovered_by_default_and_not_by_twenty_cosines() -> None:
    film = Film()
    reconstruction = film.reconstructed()
    assert film.errors_mm(reconstruction).max() < 5.0
    assert set(reconstruction.confidence.values()) == {"green"}
    with pytest.warns(UserWarning, match="is .* px off"):
        few = film.reconstructed(basis=TrajectoryBasis(20))
    assert film.errors_mm(few).min() > 30.0
    assert "green" not in few.confidence.values()


# --- residuals --------------------------------------------------------------------------------------------


def test_a_residual_above_five_pixels_is_a_warning_with_its_number() -> None:
    film = Film()
    with heard() as caught:
        reconstruction = film.reconstructed(basis=TrajectoryBasis(20))
    away = film.camera.project(reconstruction.positions) - film.images
    residual = np.sqrt((away**2).sum(axis=-1).mean(axis=0))
    np.testing.assert_allclose([*reconstruction.residual_px.values()], residual, rtol=1e-9, atol=1e-9)
    assert [*reconstruction.residual_px] == [*LEG.joints]
    worst = LEG.joints[int(residual.argmax())]
    (sentence,) = caught
    assert f"The reprojection of {worst} is {residual.max():.1f} px off" in sentence
    assert residual.max() > 5.0


def test_joints_that_were_not_seen_have_no_residual_in_these_frames() -> None:
    film = Film()
    images = film.images.copy()
    images[10:15, 2] = np.nan
    reconstruction = film.reconstructed(images=images)
    assert np.isnan(reconstruction.reprojection_px["left_ankle"]).nonzero()[0].tolist() == [*range(10, 15)]
    assert reconstruction.residual_px["left_ankle"] < 1.0


def test_the_trajectory_in_the_basis_is_compared_also_without_refinement() -> None:
    film = Film()
    inputs = (film.images, film.camera, film.truth[:, 0], film.lengths)
    options = Options(TrajectoryBasis(20), refine=False, time_limit_s=0.0)
    result = prepared(*inputs, options, chain=LEG).whole()
    assert np.abs(film.camera.project(result.positions) - film.images).max() < 0.5, (
        "candidates lie on their rays"
    )
    assert result.residual_px["left_ankle"] > 5.0


# --- images upside down -----------------------------------------------------------------------------------


def test_images_upside_down_are_noticed_and_upright_ones_are_not() -> None:
    film = Film()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        upright = film.reconstructed()
    turned = film.images * [1.0, -1.0] + [0.0, HEIGHT_PX]
    with heard() as caught:
        reconstruction = film.reconstructed(images=turned)
    assert film.errors_mm(reconstruction).min() > 300.0
    sentence = next(words for words in caught if "upside down" in words)
    pooled = {
        name: np.sqrt(np.mean(np.concatenate([*first.reprojection_px.values()]) ** 2))
        for name, first in (("as it is", reconstruction), ("upright", upright))
    }
    assert f"instead of {pooled['as it is']:.1f} px" in sentence
    assert f"are then {pooled['upright']:.1f} px off" in sentence
    assert "green" not in reconstruction.confidence.values()


# --- wrong lengths ----------------------------------------------------------------------------------------


def test_a_shank_that_is_too_long_is_not_green() -> None:
    """A shank that is 26 % too long fits its images, but the image rays never require its whole length."""
    film = Film()
    reconstruction = film.reconstructed(lengths=film.lengths * [1.0, 1.26])
    shank = reconstruction.limbs["left_ankle"]
    assert film.errors_mm(reconstruction)[1] > 150.0
    assert reconstruction.residual_px["left_ankle"] < 5.0
    assert confidence_of_mirror_margin(shank.solution.margin) == "green"
    assert shank.crossing == pytest.approx(1 / 1.26, abs=0.06)
    assert reconstruction.confidence == {"left_knee": "green", "left_ankle": "amber"}


def test_a_shank_that_is_too_short_leaves_no_limb_green() -> None:
    """A shank that is too short does not fit its images, and moves the reconstructed knee by 5 cm."""
    film = Film()
    with heard() as caught:
        reconstruction = film.reconstructed(lengths=film.lengths / [1.0, 1.26])
    assert film.errors_mm(reconstruction).min() > 50.0
    assert confidence_of_mirror_margin(reconstruction.limbs["left_knee"].solution.margin) == "green"
    assert reconstruction.residual_px["left_knee"] < 5.0 < reconstruction.residual_px["left_ankle"]
    assert "green" not in reconstruction.confidence.values()
    assert ["left_ankle" in words for words in caught] == [True]
