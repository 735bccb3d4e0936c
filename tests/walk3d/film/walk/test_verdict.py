"""Tests of the verdicts on either side of each threshold between walks, doubtful walks and other clips."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.core.fourier import cycle_basis
from walk3d.film.walk import verdict as verdicts
from walk3d.film.walk.path import TRUNK
from walk3d.film.walk.sagittal_angles import ANGLES
from walk3d.film.walk.training import BLOCKS, HEIGHT_MM
from walk3d.film.walk.verdict import NOISE_MEMORY_S, bounce, judge

SURE = {
    "relative_residual": 0.8,
    "distance": 1.0,
    "strides": 3.0,
    "leg_motion": 1.0,
    "ankles_together": -0.6,
    "bounce": 1.0,
    "stride_hz": 0.9,
    "knee_deg": 3.0,
}


@pytest.mark.parametrize(
    ("name", "value", "verdict", "words"),
    [
        ("relative_residual", 1.29, "walk", ""),
        ("relative_residual", 1.31, "doubtful", "the residual is large"),
        ("relative_residual", 1.66, "not_a_walk", "no walker moves like this"),
        ("distance", 1.69, "walk", ""),
        ("distance", 1.71, "doubtful", "the walker is unusual"),
        ("distance", 2.61, "not_a_walk", "no view of a walker fits the keypoints"),
        ("strides", 1.21, "walk", ""),
        ("strides", 1.19, "doubtful", "only 1.2 strides"),
        ("strides", 0.79, "not_a_walk", "nothing repeats"),
        ("leg_motion", 0.51, "walk", ""),
        ("leg_motion", 0.49, "not_a_walk", "the legs hardly move"),
        ("ankles_together", 0.09, "walk", ""),
        ("ankles_together", 0.11, "not_a_walk", "the feet move together"),
        ("stride_hz", 0.59, "doubtful", "slow: 71 steps a minute"),
        ("stride_hz", 0.61, "walk", ""),
        ("stride_hz", 1.34, "walk", ""),
        ("stride_hz", 1.36, "not_a_walk", "a run: 163 steps a minute"),
        ("bounce", -0.49, "walk", ""),
        ("bounce", -0.51, "not_a_walk", "a run: the body rises where a walker's falls"),
        ("knee_deg", -14.9, "walk", ""),
        ("knee_deg", -15.6, "doubtful", "a knee bends the wrong way, to -16° (walks: -15 or more)"),
    ],
)
def test_every_threshold_parts_what_is_below_from_what_is_above(
    name: str, value: float, verdict: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    facts = {**SURE, name: value}
    monkeypatch.setattr(verdicts, "bounce", lambda _: facts["bounce"])
    angles = {"left_knee": 0.0, "right_knee": facts["knee_deg"]}
    angles_rad = np.radians([[angles.get(angle, -40.0) for angle in ANGLES]])
    result = judge(
        SimpleNamespace(  # type: ignore[arg-type]
            **facts,
            starts=SimpleNamespace(
                least_distance=facts["distance"], ankles_together=facts["ankles_together"]
            ),
            posterior=SimpleNamespace(angles_rad=angles_rad),
            candidates=[SimpleNamespace(frequency_hz=facts["stride_hz"])],
        )
    )
    assert result.verdict == verdict
    assert [words in reason for reason in result.reasons] == [True] * (verdict != "walk")


def seen_trunk(times: np.ndarray, rise: float, noise_px: np.ndarray) -> SimpleNamespace:
    """Return a simulated reconstruction whose trunk rises `rise` times as far as the average walker's trunk.

    The average walker's trunk rises by 30 mm at 0.9 strides per second; the image has half the size.
    """
    mean = np.zeros((15, 3, BLOCKS))
    mean[TRUNK, 2, 3] = 30.0
    phases = 2.0 * np.pi * 0.9 * times
    up = 15.0 * rise * cycle_basis(phases, BLOCKS)[:, 3] + noise_px
    filmed = np.zeros((len(times), 15, 2))
    filmed[..., 1] = -up[:, None]
    return SimpleNamespace(
        fit=SimpleNamespace(
            times=times,
            phases_rad=phases,
            objective=SimpleNamespace(prior=SimpleNamespace(model=SimpleNamespace(mean=mean))),
        ),
        filmed_px=filmed,
        keypoints=SimpleNamespace(weights=np.ones((len(times), 15))),
        height_px=HEIGHT_MM / 2.0,
    )


@pytest.mark.parametrize("rise", [1.0, 0.0, -2.0])
def test_a_bounce_is_raised_by_twice_its_standard_error(rise: float) -> None:
    times = NOISE_MEMORY_S * np.arange(80)  # every error is another
    assert bounce(seen_trunk(times, rise, np.zeros(80))) == pytest.approx(rise, abs=1e-9)  # type: ignore[arg-type]
    generator = np.random.default_rng(0)
    noise = generator.normal(scale=20.0, size=(400, 80))
    result = np.array([bounce(seen_trunk(times, rise, first)) for first in noise])  # type: ignore[arg-type]
    assert (result.mean() - rise) / result.std() == pytest.approx(2.0, abs=0.3)
    # Frames between, with the same errors, say nothing more.
    twice = np.sort(np.concatenate([times, times + 1e-6]))
    again = bounce(seen_trunk(twice, rise, np.repeat(noise[0], 2)))  # type: ignore[arg-type]
    assert again == pytest.approx(result[0], abs=1e-3)
