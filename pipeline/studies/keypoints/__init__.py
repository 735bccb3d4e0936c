"""Walks from keypoints of one camera, on simulated clips whose truth is known; of no paper."""

from pipeline.studies.keypoints.changes import KeypointChanges
from pipeline.studies.keypoints.changes_figure import KeypointChangesFigure
from pipeline.studies.keypoints.dataset import FilmedWalkersDataset
from pipeline.studies.keypoints.figure import KeypointHeadingsFigure
from pipeline.studies.keypoints.headings import KeypointHeadings
from pipeline.studies.keypoints.model import KeypointWalkersModel
from pipeline.studies.study import Study

STUDY = Study(
    "keypoints",
    datasets={"filmed_walkers": FilmedWalkersDataset},
    models={"keypoint_walkers": KeypointWalkersModel},
    sweeps={"keypoint_headings": KeypointHeadings, "keypoint_changes": KeypointChanges},
    figures={"keypoint_headings": KeypointHeadingsFigure, "keypoint_changes": KeypointChangesFigure},
)
