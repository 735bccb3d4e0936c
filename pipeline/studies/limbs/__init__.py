"""Study of limbs: reconstruction of articulated motion from one camera with trajectory bases [park2011]."""

from pipeline.studies.limbs import measures
from pipeline.studies.limbs.dataset import LimbDataset
from pipeline.studies.limbs.figures.limb_errors import RadiusScaleFigure, RootErrorFigure
from pipeline.studies.limbs.figures.limb_scatter import LimbScatter
from pipeline.studies.limbs.figures.missing_data import MissingDataFigure
from pipeline.studies.limbs.figures.motions import MotionsFigure
from pipeline.studies.limbs.missing_data import MissingDataSweep
from pipeline.studies.limbs.model import TrajectoryBasisModel
from pipeline.studies.limbs.motions import MotionsSweep
from pipeline.studies.limbs.one_limb import RadiusScaleSweep, RootErrorSweep
from pipeline.studies.limbs.reconstructibility import ReconstructibilitySweep
from pipeline.studies.study import Study

STUDY = Study(
    "limbs",
    datasets={"limbs": LimbDataset},
    models={"trajectory_basis": TrajectoryBasisModel},
    sweeps={
        "reconstructibility": ReconstructibilitySweep,
        "root_error": RootErrorSweep,
        "radius_scale": RadiusScaleSweep,
        "missing_data": MissingDataSweep,
        "motions": MotionsSweep,
    },
    figures={
        "limb_scatter": LimbScatter,
        "root_error": RootErrorFigure,
        "radius_scale": RadiusScaleFigure,
        "missing_data": MissingDataFigure,
        "motions": MotionsFigure,
    },
    measures=measures,
)
