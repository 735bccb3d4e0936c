"""Walks from keypoints of one camera, on simulated clips whose truth is known; of no paper."""

from pipeline.studies.keypoints.changes import KeypointChanges
from pipeline.studies.keypoints.changes_figure import KeypointChangesFigure
from pipeline.studies.keypoints.dataset import FilmedWalkersDataset
from pipeline.studies.keypoints.figure import KeypointHeadingsFigure
from pipeline.studies.keypoints.headings import KeypointHeadings, KeypointLaboratories
from pipeline.studies.keypoints.laboratories_figure import KeypointLaboratoriesFigure
from pipeline.studies.keypoints.model import KeypointWalkersModel
from pipeline.studies.study import Study

STUDY = Study(
    "keypoints",
    datasets={"filmed_walkers": FilmedWalkersDataset},
    models={"keypoint_walkers": KeypointWalkersModel},
    sweeps={
        "keypoint_headings": KeypointHeadings,
        "keypoint_laboratories": KeypointLaboratories,
        "keypoint_changes": KeypointChanges,
    },
    figures={
        "keypoint_headings": KeypointHeadingsFigure,
        "keypoint_laboratories": KeypointLaboratoriesFigure,
        "keypoint_changes": KeypointChangesFigure,
    },
)
