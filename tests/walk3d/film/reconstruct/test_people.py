"""Tests of the tracking of people: maximum motion between two detections, and joining of tracks."""

from __future__ import annotations

import numpy as np
import pytest

from walk3d.film.walk.tracks import find_tracks


@pytest.mark.parametrize(("share", "gap", "tracks"), [(0.08, 1, 1), (0.2, 1, 2), (0.2, 5, 1), (0.5, 5, 2)])
def test_who_moves_too_far_for_the_time_that_passed_is_another(share: float, gap: int, tracks: int) -> None:
    """A motion above the limits for the time between two detections begins a new track.

    At 30 frames per second, the limits are 9 % of the height, and 2.2 heights per second.
    """
    person = np.random.default_rng(0).uniform(0.0, 100.0, size=(15, 2))
    person[:2] = [[50.0, 0.0], [50.0, 100.0]]  # of height 100
    frame = np.array([0, 1, 1 + gap])
    pixels = person + np.array([0.0, 0.0, 100.0 * share])[:, None, None] * np.array([1.0, 0.0])
    assert len(find_tracks(frame, np.full(3, ""), pixels, 30.0)) == tracks


def test_of_two_people_at_one_place_the_identities_decide() -> None:
    body = np.random.default_rng(0).uniform(0.0, 100.0, size=(15, 2))
    body[:2] = [[50.0, 0.0], [50.0, 100.0]]  # of height 100
    across = np.array([0.0, 5.0, 2.0, 3.0])  # each of the last two is nearer to the other's track
    pixels = body + across[:, None, None] * np.array([1.0, 0.0])
    tracks = find_tracks(np.array([0, 0, 1, 1]), np.array(["a", "b", "b", "a"]), pixels, 30.0)
    assert sorted((track.identity, track.rows.tolist()) for track in tracks) == [("a", [0, 3]), ("b", [1, 2])]


def walker(frames: np.ndarray, height: float = 100.0, row: float = 0.0, speed: float = 3.0) -> np.ndarray:
    """Return the joints (T, 15, 2), px, of a body that crosses the image.

    A speed of 3 pixels per frame is 0.9 heights per second.
    """
    body = np.random.default_rng(0).uniform(0.0, height, size=(15, 2))
    body[:2] = [[height / 2, 0.0], [height / 2, height]]
    return body + np.stack([speed * frames, np.full(len(frames), row)], axis=-1)[:, None]


@pytest.mark.parametrize(
    ("gap", "change", "tracks"),
    [
        (16, {}, [60]),
        (40, {}, [60]),
        (46, {}, [30, 30]),  # unseen for more than 1.5 s
        (20, {"row": 25.0}, [60]),
        (20, {"row": 35.0}, [30, 30]),
        (20, {"height": 118.0}, [60]),
        (20, {"height": 130.0}, [30, 30]),
        (20, {"speed": 0.0}, [30, 30]),  # as if the walker had stayed, where the other stands
    ],
)
def test_tracks_that_continue_each_other_are_one_person(
    gap: int, change: dict[str, float], tracks: list[int]
) -> None:
    before, after = np.arange(30), np.arange(30) + 29 + gap
    pixels = np.concatenate([walker(before), walker(after, **change)])
    for identity in (np.full(60, ""), np.repeat(["1", "2"], 30)):
        people = find_tracks(np.concatenate([before, after]), identity, pixels, 30.0)
        assert [len(track.rows) for track in people] == tracks
        if len(tracks) == 1:
            assert people[0].rows.tolist() == list(range(60))


def test_tracks_stay_apart_where_two_people_may_be_meant() -> None:
    before, after = np.arange(30), np.arange(30) + 50
    frame = np.concatenate([before, after, after])
    pixels = np.concatenate([walker(before), walker(after, row=20.0), walker(after, row=-20.0)])
    assert [len(track.rows) for track in find_tracks(frame, np.full(90, ""), pixels, 30.0)] == [30, 30, 30]
    pixels[60:, :, 1] += 60.0  # then the other is too far off
    tracks = find_tracks(frame, np.full(90, ""), pixels, 30.0)
    assert [track.rows.tolist() for track in tracks] == [list(range(60)), list(range(60, 90))]


def test_who_is_seen_longest_without_a_gap_comes_first() -> None:
    before, after, other = np.arange(30), np.arange(30) + 50, np.arange(50)
    frame = np.concatenate([before, after, other])
    pixels = np.concatenate([walker(before), walker(after), walker(other, row=400.0)])
    tracks = find_tracks(frame, np.full(110, ""), pixels, 30.0)
    assert [track.rows.tolist() for track in tracks] == [list(range(60, 110)), list(range(60))]
