"""Studies of the anatomical prior: ablation, error bars, hidden joints, other laboratories and joint angles."""

from pipeline.studies.study import Study
from walk3d.anatomy.study.figures.coverage import BarCoverage
from walk3d.anatomy.study.figures.joint_angles import JointAngleFigure
from walk3d.anatomy.study.figures.laboratories import LearningCurves
from walk3d.anatomy.study.figures.occlusion import HiddenJointErrors
from walk3d.anatomy.study.figures.structure import StructureLadder
from walk3d.anatomy.study.joint_angles import JointAngles
from walk3d.anatomy.study.model import AnatomicalModel
from walk3d.anatomy.study.sweeps.coverage import Coverage
from walk3d.anatomy.study.sweeps.laboratories import Laboratories
from walk3d.anatomy.study.sweeps.occlusion import Occlusion
from walk3d.anatomy.study.sweeps.structure import Structure

STUDY = Study(
    "anatomy",
    models={"anatomical": AnatomicalModel},
    sweeps={
        "joint_angles": JointAngles,
        "structure": Structure,
        "coverage": Coverage,
        "occlusion": Occlusion,
        "laboratories": Laboratories,
    },
    figures={
        "structure": StructureLadder,
        "coverage": BarCoverage,
        "occlusion": HiddenJointErrors,
        "laboratories": LearningCurves,
        "joint_angles": JointAngleFigure,
    },
)
