"""Tests of the remarks on performances that do not look like performances of one action."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline import papers
from pipeline.clips.options import SyntheticClips, SyntheticPerformances
from pipeline.clips.performances import synthetic_performances
from pipeline.clips.varied import synthetic_clips
from pipeline.studies.actions.dataset import PostureDataset
from pipeline.studies.actions.figures.key_frame_agreement import alignments_compared
from pipeline.studies.actions.model import MAX_VARIANCE_LEFT, ActionSpaceModel


@pytest.mark.parametrize(
    ("bends", "others", "expected"),
    [(8, 0, []), (8, 1, ["smooth_angles_001 may be of another action"]), (0, 8, ["several actions"])],
)
def test_another_action_is_told(bends: int, others: int, expected: list[str]) -> None:
    performances = synthetic_performances(SyntheticPerformances(performances=8), 3)
    moved = synthetic_clips(SyntheticClips(clips=24, seconds=3.0), 3)
    chosen = [(performances, n) for n in range(bends)]
    chosen += [(moved, n) for n in np.flatnonzero(moved.action == "smooth angles")[:others]]
    motions = [clips.motion(n) for clips, n in chosen]
    clips = replace(
        performances,
        positions=np.concatenate(motions),
        first=np.cumsum([0, *map(len, motions)]),
        phase=None,
        moving_phase=None,
        **{
            name: np.array([getattr(owner, name)[n] for owner, n in chosen])
            for name in ("frame_rate_hz", "leg_length_mm", "person", "clip", "source")
        },
    )
    remarks = ActionSpaceModel().learn(PostureDataset().build(clips, workers=1), workers=1).remarks
    assert len(remarks) == len(expected)
    assert all(words in remark for words, remark in zip(expected, remarks, strict=True))


def test_claims_rest_on_what_is_told() -> None:
    condition = papers.claim("mozerov2006_same_action_class")
    assert condition.bounds.agrees is not None
    assert MAX_VARIANCE_LEFT in condition.bounds.agrees
    assert 1.01 * MAX_VARIANCE_LEFT not in condition.bounds.agrees
    assert condition.name in papers.claim("mozerov2006_natural_modes").scope.rests_on


def test_variance_left_to_all_is_that_about_the_mean_sequence_to_that_about_the_mean_posture() -> None:
    options = ActionSpaceModel()
    performances = synthetic_performances(SyntheticPerformances(performances=5), 3)
    action = options.learn(PostureDataset().build(performances, workers=1), workers=1)
    rows = alignments_compared(action, options).set_index("stage")["variance_left_to_all"]
    for stage in ("linear", "synchronized"):
        postures = np.stack(action.sequences(stage))
        left, whole = (np.square(postures - postures.mean(axis)).sum() for axis in (0, (0, 1)))
        assert rows[stage] == pytest.approx(left / whole * len(postures) / (len(postures) - 1))
