"""Walks: periodic 3D motion from 2D by Fourier series and eigenwalkers, zhang2004 and zhang2007."""

from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierDataset
from pipeline.studies.study import Study
from pipeline.studies.walks import measures
from pipeline.studies.walks.anatomical_model import AnatomicalModel
from pipeline.studies.walks.figures.coverage import BarCoverage
from pipeline.studies.walks.figures.joint_angles import JointAngleFigure
from pipeline.studies.walks.figures.laboratories import LearningCurves
from pipeline.studies.walks.figures.noise_variance import NoiseVariance
from pipeline.studies.walks.figures.occlusion import HiddenJointErrors
from pipeline.studies.walks.figures.postures import Postures
from pipeline.studies.walks.figures.spectrum import Spectrum
from pipeline.studies.walks.figures.structure import StructureLadder
from pipeline.studies.walks.figures.view_angles import ViewAngleEstimates
from pipeline.studies.walks.figures.view_errors import ViewErrors
from pipeline.studies.walks.joint_angles import JointAngles
from pipeline.studies.walks.known_view import KnownView
from pipeline.studies.walks.sweeps.coverage import Coverage
from pipeline.studies.walks.sweeps.laboratories import Laboratories
from pipeline.studies.walks.sweeps.occlusion import Occlusion
from pipeline.studies.walks.sweeps.structure import Structure
from pipeline.studies.walks.unknown_view import UnknownView

STUDY = Study(
    "walks",
    datasets={"fourier": FourierDataset},
    models={"eigenwalkers": EigenwalkersModel, "anatomical": AnatomicalModel},
    sweeps={
        "known_view": KnownView,
        "unknown_view": UnknownView,
        "joint_angles": JointAngles,
        "structure": Structure,
        "coverage": Coverage,
        "occlusion": Occlusion,
        "laboratories": Laboratories,
    },
    figures={
        "spectrum": Spectrum,
        "noise_variance": NoiseVariance,
        "postures": Postures,
        "view_errors": ViewErrors,
        "view_angles": ViewAngleEstimates,
        "structure": StructureLadder,
        "coverage": BarCoverage,
        "occlusion": HiddenJointErrors,
        "laboratories": LearningCurves,
        "joint_angles": JointAngleFigure,
    },
    measures=measures,
)
