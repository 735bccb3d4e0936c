"""Face-off: eigenwalkers against articulated trajectories on walks, of no paper; it compares studies."""

from pipeline.studies.face_off.comparison import FaceOffSweep
from pipeline.studies.face_off.figure import FaceOffFigure
from pipeline.studies.study import Study

STUDY = Study("face_off", sweeps={"face_off": FaceOffSweep}, figures={"face_off": FaceOffFigure})
