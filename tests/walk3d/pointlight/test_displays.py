"""Tests of properties that point-light displays have for every walker."""

from __future__ import annotations

import csv
import io
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from pipeline.core import fourier
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from tests.rejects import rejects
from walk3d import pointlight
from walk3d.pointlight import Noise, PointLights

HZ = 60.0


@pytest.fixture(scope="module")
def series() -> tuple[np.ndarray, float]:
    return pointlight.synthetic_walker()


@pytest.fixture(scope="module")
def lights(series: tuple[np.ndarray, float]) -> PointLights:
    return pointlight.walker(*series, view_angle_rad=0.6, frame_rate_hz=HZ)


def generator(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_a_view_shows_the_walker(series: tuple[np.ndarray, float]) -> None:
    coefficients, stride = series
    side = pointlight.walker(coefficients, stride, view_angle_rad=np.pi / 2, cycles=2, frame_rate_hz=HZ)
    count = round(2 / stride * HZ)
    walk = fourier.synthesise(coefficients, stride, np.arange(count) * 2 / stride / count)
    np.testing.assert_allclose(side.positions, walk[..., [1, 2]], atol=1e-9)  # forward is to the right
    assert side.loops
    np.testing.assert_allclose(side.positions[: count // 2], side.positions[count - count // 2 :], atol=20)
    assert not pointlight.walker(coefficients, stride, cycles=1.5).loops


def test_a_walker_who_translates_leaves_no_foot_behind(series: tuple[np.ndarray, float]) -> None:
    """The lower foot of a walker who moves over the ground is nearly at rest.

    Its median speed is less than a quarter of the walker's speed.
    """
    coefficients, stride = series
    speed = pointlight.walking_speed(coefficients, stride)
    moving = pointlight.walker(
        coefficients, stride, view_angle_rad=np.pi / 2, cycles=2, frame_rate_hz=200, speed_mm_s=speed
    )
    assert not moving.loops
    ankles = moving.positions[:, [WALKER15.index("left_ankle"), WALKER15.index("right_ankle")]]
    lower = ankles[..., 1].argmin(axis=1)
    slip = np.gradient(ankles[..., 0], axis=0)[np.arange(len(lower)), lower] * 200
    assert np.median(np.abs(slip)) < 0.25 * speed


def test_the_speed_is_that_of_the_belt() -> None:
    people = walkers.walking_population(generator(4), male=2, female=3, duration_s=4.0, frame_rate_hz=HZ)
    for walk, belt in zip(people.positions_mm, (who.speed for who in people.people), strict=True):
        representation = fourier.represent(walk, HZ)
        speed = pointlight.walking_speed(representation.coefficients, representation.frequency_hz)
        assert speed == pytest.approx(belt, rel=0.1)


@pytest.mark.parametrize("flip", [pointlight.inverted, pointlight.mirrored])
def test_twice_is_the_original(lights: PointLights, flip: object) -> None:
    once = flip(lights)  # type: ignore[operator]
    assert np.abs(once.positions - lights.positions).max() > 100
    np.testing.assert_allclose(flip(once).positions, lights.positions, atol=1e-9)  # type: ignore[operator]
    np.testing.assert_allclose(once.bounds, lights.bounds, atol=1e-9)


def test_the_inverted_head_is_below(lights: PointLights) -> None:
    turned = pointlight.inverted(lights).positions[..., 1].mean(axis=0)
    assert turned[WALKER15.index("head")] < turned[WALKER15.index("left_ankle")]


def test_scrambling_keeps_what_each_dot_does_and_the_rectangle(lights: PointLights) -> None:
    moved = pointlight.scrambled(lights, generator())
    shift = moved.positions - lights.positions
    np.testing.assert_allclose(shift, np.broadcast_to(shift[:1], shift.shape), atol=1e-9)
    assert np.linalg.norm(shift[0], axis=-1).max() > 100
    low, high = lights.bounds
    assert (moved.positions >= low - 1e-9).all()
    assert (moved.positions <= high + 1e-9).all()


def test_phase_scrambling_keeps_each_trajectory_up_to_its_beginning(lights: PointLights) -> None:
    moved = pointlight.phase_scrambled(lights, generator())
    first = []
    for dot in range(15):
        off = [
            np.abs(np.roll(lights.positions[:, dot], -k, axis=0) - moved.positions[:, dot]).max()
            for k in range(len(lights.positions))
        ]
        assert min(off) == 0.0
        first.append(int(np.argmin(off)))
    assert len(set(first)) > 8
    with rejects("looping_display"):
        pointlight.phase_scrambled(replace(lights, loops=False), generator())


@pytest.mark.parametrize(("lifetime", "shown"), [(1, 3), (6, 8), (7, 14), (20, 1)])
def test_a_short_lived_dot_is_always_at_a_joint(lights: PointLights, lifetime: int, shown: int) -> None:
    short = pointlight.limited_lifetime(lights, generator(), lifetime_frames=lifetime, shown=shown)
    distance = np.linalg.norm(short.positions[:, :, None] - lights.positions[:, None], axis=-1)
    assert distance.min(axis=-1).max() == 0.0
    at = distance.argmin(axis=-1)
    assert all(len(set(joints)) == shown for joints in at.tolist())  # no two at the same joint
    for dot in at.T:
        changes = np.flatnonzero(np.diff(dot))
        assert (np.diff(changes) == lifetime).all()
        assert len(changes) in range((len(at) - 1) // lifetime, -(-len(at) // lifetime) + 1)
    if lifetime > shown > 1:  # staggered: they do not all change at once
        assert (np.diff(at, axis=0) != 0).sum(axis=1).max() < shown
    with rejects("out_of_range", "dots that are shown", value=15):
        pointlight.limited_lifetime(lights, generator(), lifetime_frames=lifetime, shown=15)


def test_noise_moves_like_the_walker_and_the_walker_is_left_alone(lights: PointLights) -> None:
    among = pointlight.with_noise(lights, generator(), dots=40, field=2.0)
    np.testing.assert_array_equal(among.positions[:, among.of_walker], lights.positions)
    noise = among.positions[:, ~among.of_walker]
    assert noise.shape[1] == 40
    reference = lights.positions - lights.positions.mean(axis=0)
    spectra = np.abs(np.fft.fft(reference, axis=0))
    lent = []
    for dot in np.moveaxis(noise - noise.mean(axis=0), 1, 0):
        off = np.abs(np.abs(np.fft.fft(dot, axis=0))[:, None] - spectra).max(axis=(0, 2))
        assert off.min() < 1e-6 * spectra.max()
        lent.append(int(off.argmin()))
    assert np.bincount(lent, minlength=15).max() <= 3  # every joint lends about equally often
    low, high = lights.bounds
    middle, half = (low + high) / 2, high - low
    assert (np.abs(noise - middle) <= half + 1e-9).all()


def test_uniform_noise_stands_still_for_its_lifetime(lights: PointLights) -> None:
    still = pointlight.with_noise(lights, generator(), dots=9, kind=Noise.uniform).positions[:, 15:]
    np.testing.assert_array_equal(still, np.broadcast_to(still[:1], still.shape))
    short = pointlight.with_noise(lights, generator(), dots=9, kind=Noise.uniform, lifetime_frames=5)
    jumps = np.any(np.diff(short.positions[:, 15:], axis=0) != 0, axis=-1)
    assert (np.diff(np.flatnonzero(jumps[:, 0])) == 5).all()
    assert jumps.any(axis=0).all()
    assert jumps.sum(axis=1).max() < 9


def test_the_same_seed_gives_the_same_display_and_another_one_another(lights: PointLights) -> None:
    def made(seed: int) -> str:
        draw = generator(seed)
        some = pointlight.scrambled(pointlight.phase_scrambled(lights, draw), draw)
        short = pointlight.limited_lifetime(some, draw, lifetime_frames=6, shown=5)
        return pointlight.as_csv(pointlight.with_noise(short, draw, dots=10, like=some, lifetime_frames=6))

    assert made(3) == made(3)
    assert made(3) != made(4)


def test_gender_moves_from_the_average_woman_to_the_average_man() -> None:
    (woman, _), (middle, _), (man, _) = (pointlight.synthetic_walker(g) for g in (-1.0, 0.0, 1.0))
    np.testing.assert_allclose((woman + man) / 2, middle, atol=1e-9)
    shoulders = [WALKER15.index("left_shoulder"), WALKER15.index("right_shoulder")]
    wide = [float(np.ptp(who[0, shoulders, 0])) for who in (woman, middle, man)]
    assert wide == sorted(wide)
    with rejects("out_of_range", "gender", value=7.0):
        pointlight.synthetic_walker(7.0)


def test_the_svg_shows_every_frame(lights: PointLights) -> None:
    text = pointlight.as_svg(lights, height_px=300, title="a < b & c")
    root = ET.fromstring(text)
    space = "{http://www.w3.org/2000/svg}"
    assert root.findtext(f"{space}title") == "a < b & c"
    places, (width, height) = pointlight.pixels(lights, 300)
    circles = root.findall(f".//{space}circle")
    assert len(circles) == 15
    for dot, circle in enumerate(circles):
        for axis, animate in enumerate(circle.findall(f"{space}animate")):
            values = [float(value) for value in animate.attrib["values"].split(";")]
            np.testing.assert_allclose(values, places[:, dot, axis], atol=0.006)
            assert float(animate.attrib["dur"].rstrip("s")) == pytest.approx(len(values) / HZ, rel=1e-5)
    assert (places >= 0).all()
    assert (places <= [width, height]).all()
    head, ankle = places[0, WALKER15.index("head")], places[0, WALKER15.index("left_ankle")]
    assert head[1] < ankle[1]  # a picture counts from above


def test_the_table_and_the_library_format_hold_the_numbers(
    lights: PointLights, series: tuple[np.ndarray, float]
) -> None:
    rows = list(csv.DictReader(io.StringIO(pointlight.as_csv(lights))))
    result = np.array([[float(row["x_mm"]), float(row["y_mm"])] for row in rows]).reshape(-1, 15, 2)
    np.testing.assert_allclose(result, lights.positions, atol=1e-4)
    assert {row["kind"] for row in rows} == {"walker"}
    walk = fourier.synthesise(series[0], series[1], np.arange(7) / HZ)
    first, *numbers = pointlight.as_ptd(walk).split()
    assert int(first) == 7
    inches = np.array([float(value) for value in numbers]).reshape(7, 15, 3)
    np.testing.assert_allclose(inches * 25.4, walk, atol=1e-4)
