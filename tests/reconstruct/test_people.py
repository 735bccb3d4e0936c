"""Tracks of people: how far a person may move from one detection to the next."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.core.keypoint_walk.tracks import find_tracks


@pytest.mark.parametrize(("share", "gap", "tracks"), [(0.08, 1, 1), (0.2, 1, 2), (0.2, 5, 1), (0.5, 5, 2)])
def test_who_moves_too_far_for_the_time_that_passed_is_another(share: float, gap: int, tracks: int) -> None:
    """At 30 frames a second: 9 % of the height at once, and 2.2 heights a second over more than a frame."""
    person = np.random.default_rng(0).uniform(0.0, 100.0, size=(15, 2))
    person[:2] = [[50.0, 0.0], [50.0, 100.0]]  # of height 100
    frame = np.array([0, 1, 1 + gap])
    pixels = person + np.array([0.0, 0.0, 100.0 * share])[:, None, None] * np.array([1.0, 0.0])
    assert len(find_tracks(frame, np.full(3, ""), pixels, 30.0)) == tracks
