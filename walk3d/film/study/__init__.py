"""Study of 3D walks that are reconstructed from the keypoints of one camera, on simulated clips with ground truth."""

from pipeline.studies.study import Study
from walk3d.film.study.changes import KeypointChanges
from walk3d.film.study.changes_figure import KeypointChangesFigure
from walk3d.film.study.dataset import FilmedWalkersDataset
from walk3d.film.study.figure import KeypointHeadingsFigure, KeypointLaboratoriesFigure
from walk3d.film.study.headings import KeypointHeadings, KeypointLaboratories
from walk3d.film.study.model import KeypointWalkersModel

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
