"""Tests of limb lengths from body proportions and from image rays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core.camera_paths import around
from pipeline.core.limb_chain import WALKER14, Chain, true_lengths
from pipeline.core.limb_chain.lengths import (
    LENGTH_RATIOS,
    anthropometric_lengths,
    demanded_length,
    length_from_rays,
)
from pipeline.synthetic.limbs import angular_limb
from pipeline.synthetic.walkers import walking_population
from tests.core.cameras import still
from tests.rejects import rejects
from tests.strategies import seeds


def test_ordinary_lengths_are_those_of_the_synthetic_walkers_on_average() -> None:
    """Lengths from average proportions agree with the mean limb lengths of synthetic walkers within 4 %."""
    walkers = walking_population(np.random.default_rng(4), male=6, female=6, duration_s=2.5)
    lengths = np.array([true_lengths(WALKER14, positions) for positions in walkers.positions_mm])
    ordinary = np.array(
        [anthropometric_lengths(WALKER14, size_mm=who.body.stature) for who in walkers.people]
    )
    np.testing.assert_allclose(ordinary.mean(axis=0), lengths.mean(axis=0), rtol=0.04)


@given(limb=st.sampled_from(WALKER14.limbs), size=st.floats(1.0, 1e4))
def test_one_known_limb_gives_the_others_in_proportion(limb: str, size: float) -> None:
    from_limb = anthropometric_lengths(WALKER14, of=limb, size_mm=size)
    assert from_limb[WALKER14.limbs.index(limb)] == pytest.approx(size)
    stature = size / LENGTH_RATIOS[limb.removeprefix("left_").removeprefix("right_")]
    np.testing.assert_allclose(from_limb, anthropometric_lengths(WALKER14, size_mm=stature))


def test_lengths_that_nobody_has_measured_are_refused() -> None:
    with rejects("out_of_range", "stature", value=-3.0):
        anthropometric_lengths(WALKER14, size_mm=-3.0)
    with rejects("unknown_choice", "limb", value="tail"):
        anthropometric_lengths(WALKER14, of="tail", size_mm=300.0)
    with rejects("unknown_choice", "limb", value="tail"):
        anthropometric_lengths(Chain(("pelvis", "tail"), (None, "pelvis")), size_mm=1700.0)


# --- lengths from the image -------------------------------------------------------------------------------


@given(seed=seeds, quantile=st.floats(0.1, 1.0))
def test_the_image_never_asks_for_more_than_the_length(seed: int, quantile: float) -> None:
    generator = np.random.default_rng(seed)
    limb = angular_limb(generator, 40, length_mm=250.0)
    parents = 100.0 * generator.standard_normal((40, 3))
    camera = around(40, target=np.zeros(3), sweep_rad=1.0)
    pixels = camera.project(parents + limb.relative)
    requested = demanded_length(camera.matrix, pixels, parents, quantile=quantile)
    assert 0.0 < requested <= 250.0 * (1 + 1e-9)
    assert requested <= demanded_length(camera.matrix, pixels, parents)


def test_a_limb_that_lies_across_a_ray_shows_its_length() -> None:
    """A limb that rotates parallel to the image plane gets the correct length, even with missing frames."""
    turn = np.linspace(0.0, np.pi, 60)
    relative = 250.0 * np.column_stack([np.sin(turn), np.cos(turn), np.zeros(60)])
    camera = around(60, target=np.zeros(3), sweep_rad=0.0)
    pixels = camera.project(relative)
    assert demanded_length(camera.matrix, pixels, np.zeros((60, 3))) == pytest.approx(250.0, rel=2e-3)
    pixels[[4, 30]] = np.nan
    assert demanded_length(camera.matrix, pixels, np.zeros((60, 3))) == pytest.approx(250.0, rel=2e-3)


def test_an_image_that_asks_for_nothing_is_refused() -> None:
    camera = around(3, target=np.zeros(3), sweep_rad=0.0)
    with rejects("no_rays"):
        demanded_length(camera.matrix, np.full((3, 2), np.nan), np.zeros((3, 3)))
    with rejects("out_of_range", "quantile", value=95):
        demanded_length(camera.matrix, np.zeros((3, 2)), np.ones((3, 3)), quantile=95)


@given(seed=seeds)
def test_both_sides_ask_for_the_length_of_either(seed: int) -> None:
    """The length from rays is the larger estimate of left and right limb, if both have a known parent."""
    generator = np.random.default_rng(seed)
    camera = still(60, target=np.zeros(3), distance_mm=4000.0)
    sides = ("left_elbow", "right_elbow")
    parents = {name: generator.normal(0.0, 300.0, 3) + np.zeros((60, 3)) for name in sides}
    paths = {name: angular_limb(generator, 60).relative for name in sides}
    images = {name: camera.project(parents[name] + paths[name]) for name in sides}
    alone = {
        name: demanded_length(camera.matrix, images[name], parents[name], quantile=0.95) for name in sides
    }
    for name in sides:
        assert length_from_rays(camera.matrix, images, parents, name) == max(alone.values())
        other = {**parents, **{n: np.full((60, 3), np.nan) for n in sides if n != name}}
        assert length_from_rays(camera.matrix, images, other, name) == alone[name]
        assert length_from_rays(camera.matrix, {name: images[name]}, parents, name) == alone[name]


def test_the_other_side_is_not_asked_when_it_was_never_seen() -> None:
    camera = still(40, target=np.zeros(3), distance_mm=4000.0)
    parents = {name: np.full((40, 3), 100.0) for name in ("left_knee", "right_knee")}
    path = angular_limb(np.random.default_rng(2), 40).relative
    images = {
        "left_knee": camera.project(parents["left_knee"] + path),
        "right_knee": np.full((40, 2), np.nan),
    }
    assert length_from_rays(camera.matrix, images, parents, "left_knee") > 0.0
    with rejects("no_rays"):
        length_from_rays(
            camera.matrix, images, {**parents, "left_knee": np.full((40, 3), np.nan)}, "right_knee"
        )
