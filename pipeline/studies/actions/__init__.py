"""Study of actions: a model learnt from synchronized performances is the prior for tracking [mozerov2006]."""

from pipeline.studies.actions import measures
from pipeline.studies.actions.dataset import PostureDataset
from pipeline.studies.actions.figures.action_model import ActionModelFigure
from pipeline.studies.actions.figures.posture_samples import PostureSamples
from pipeline.studies.actions.figures.tracking import TrackingError
from pipeline.studies.actions.figures.trellis import OptimalPath
from pipeline.studies.actions.figures.warp import Warp
from pipeline.studies.actions.figures.warp_error import WarpError
from pipeline.studies.actions.model import ActionSpaceModel
from pipeline.studies.actions.posture_samples import PostureSampling
from pipeline.studies.actions.smoothness import Smoothness
from pipeline.studies.actions.timing import Timing
from pipeline.studies.actions.tracking import HeldOutTracking
from pipeline.studies.study import Study

STUDY = Study(
    name="actions",
    datasets={"postures": PostureDataset},
    models={"action_space": ActionSpaceModel},
    sweeps={
        "posture_samples": PostureSampling,
        "smoothness": Smoothness,
        "timing": Timing,
        "tracking": HeldOutTracking,
    },
    figures={
        "warp": Warp,
        "trellis": OptimalPath,
        "action_model": ActionModelFigure,
        "posture_samples": PostureSamples,
        "warp_error": WarpError,
        "tracking": TrackingError,
    },
    measures=measures,
)
