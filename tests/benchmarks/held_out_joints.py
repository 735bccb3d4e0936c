"""Error of hidden joints of recorded people, estimated from the visible joints by a model of synthetic walkers.

For each group of joints: the root mean square distance of the expected positions from the measured ones over a cycle,
all joints of the group and all people together, and the median and the worst person, mm at the person's own size.
Legs and pelvis are needed and never estimated, so that hidden feet are ``refused``; one side is its arm.  Needs
MOCAP_MIRROR or `make data`; nothing is timed.
"""

from __future__ import annotations

import numpy as np

from pipeline.cli.compose import compose
from pipeline.clips import missing_joints
from pipeline.clips.kinds import WALKS
from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import LOWER_BODY
from pipeline.validation import InvalidInput
from tests.benchmarks.tables import Row

GROUPS = {
    "head": ("head",),
    "sternum": ("sternum",),
    "left arm": ("left_shoulder", "left_elbow", "left_wrist"),
    "right arm": ("right_shoulder", "right_elbow", "right_wrist"),
    "both wrists": ("left_wrist", "right_wrist"),
    "both arms": tuple(f"{side}_{part}" for side in ("left", "right") for part in ("shoulder", "elbow", "wrist")),
    "all above the pelvis": tuple(joint for joint in WALKER15.joints if joint not in LOWER_BODY),
    "left foot": ("left_ankle",),
    "both feet": ("left_ankle", "right_ankle"),
}  # fmt: skip


def run() -> list[Row]:
    """Return one row for each group of hidden joints."""
    experiment = compose(["experiment=zhang2007_fig5", "data=optical"])
    try:
        clips = experiment.data.request(WALKS, experiment.skeleton, 1, 1).make()
    except InvalidInput as refusal:
        raise SystemExit(f"held_out_joints: {refusal}") from None
    walks = experiment.dataset.build(clips, workers=1).coefficients
    return [_row(group, joints, walks) for group, joints in GROUPS.items()]


def _row(group: str, joints: tuple[str, ...], walks: np.ndarray) -> Row:
    row: Row = {"hidden": group, "people": len(walks), "joints": len(joints)}
    if set(joints) & set(LOWER_BODY):
        return row | {"rms_mm": "refused", "median_mm": "refused", "worst_mm": "refused"}
    missing = np.isin(WALKER15.joints, joints)
    square = []
    for truth in walks:
        # What is hidden is not there to be read.
        values = np.where(missing[None, :, None], np.nan, truth)
        result = missing_joints.conditional_mean(missing_joints.population(), values, missing)
        distance = (result - truth)[:, missing]
        # The mean over a cycle of the square of a series: that of its constant and half that of its waves.
        square.append(float(((distance[0] ** 2).sum(-1) + 0.5 * (distance[1:] ** 2).sum(axis=(0, 2))).mean()))
    each = np.sqrt(square)
    return row | {
        "rms_mm": float(np.sqrt(np.mean(square))),
        "median_mm": float(np.median(each)),
        "worst_mm": float(each.max()),
    }
