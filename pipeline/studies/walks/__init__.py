"""Study of walks: periodic 3D motion from 2D by Fourier series and eigenwalkers [zhang2004, zhang2007]."""

from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierDataset
from pipeline.studies.study import Study
from pipeline.studies.walks import measures
from pipeline.studies.walks.figures.noise_variance import NoiseVariance
from pipeline.studies.walks.figures.postures import Postures
from pipeline.studies.walks.figures.spectrum import Spectrum
from pipeline.studies.walks.figures.view_angles import ViewAngleEstimates
from pipeline.studies.walks.figures.view_errors import ViewErrors
from pipeline.studies.walks.known_view import KnownView
from pipeline.studies.walks.unknown_view import UnknownView

STUDY = Study(
    "walks",
    datasets={"fourier": FourierDataset},
    models={"eigenwalkers": EigenwalkersModel},
    sweeps={
        "known_view": KnownView,
        "unknown_view": UnknownView,
    },
    figures={
        "spectrum": Spectrum,
        "noise_variance": NoiseVariance,
        "postures": Postures,
        "view_errors": ViewErrors,
        "view_angles": ViewAngleEstimates,
    },
    measures=measures,
)
