"""The options of every stage as plain dataclasses; `conf/` holds their values, `__main__` registers them.

One class per option of each group, so that a stage can tell what it is asked for by type.  Degrees, not
radians, here: this is what people write.  Units stand in the names.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.skeleton import SourceMapping
from pipeline.validation import InvalidInput

MOST_VALUES = 100_000
"""A finer grid is a slip of the pen: it would fill the memory."""


@dataclass(kw_only=True)
class Grid:
    """Equally spaced values, both ends included: the stop wherever whole steps reach it.

    Examples
    --------
    >>> Grid(start=-90, stop=90, step=45).values("view")
    array([-90., -45.,   0.,  45.,  90.])
    """

    start: float
    stop: float
    step: float

    def values(self, name: str) -> np.ndarray:
        """The values, float64; `name` is the option's name, for the refusal of an empty grid."""
        if not np.isfinite([self.start, self.stop, self.step]).all():
            raise InvalidInput("the range is not finite", where=name, received=str(self))
        if self.step <= 0:
            raise InvalidInput(
                "the step is not positive", where=name, expected="step > 0", received=f"{self.step:g}"
            )
        if self.stop <= self.start:
            raise InvalidInput(
                "the range has length zero",
                where=name,
                expected="stop > start",
                received=f"{self.start:g}..{self.stop:g}",
            )
        count = int(np.floor((self.stop - self.start) / self.step + 1e-9)) + 1
        if count > MOST_VALUES:
            raise InvalidInput(
                "the range has too many values",
                where=name,
                expected=f"{MOST_VALUES} or fewer",
                received=str(count),
            )
        return self.start + self.step * np.arange(count, dtype=float)


@dataclass(kw_only=True)
class Scale:
    """How large a run is.  Presets take their sizes from here, so any preset can wear any scale."""

    name: str
    walkers: int  # at most so many people; 0: all
    view_step_deg: float
    sigma2_step_mm2: float
    performances: int  # of an action, at most; 0: all
    tracked: int  # performances that are held out and tracked; 0: all
    particles: list[int]
    clips: int  # of varied motion, at most; 0: all
    trials: int  # of every point of a sweep over limbs


@dataclass(kw_only=True)
class Data:
    """Where the walks come from."""

    name: str
    walkers: int = 0  # at most so many people; 0: all


@dataclass(kw_only=True)
class SyntheticPerformances:
    """Bending to the floor, each performance at a rate of its own that is known [mozerov2006 section 4]."""

    performances: int = 40
    subjects: int = 5
    frames_mean: float = 100.0
    frame_rate_hz: float = 30.0
    rate_spread: float = 0.3
    marker_noise_mm: float = 0.5
    limit: int = 0  # at most so many performances; 0: all


@dataclass(kw_only=True)
class RecordedPerformances:
    """Which recordings hold performances of one action."""

    sources: list[str] = field(default_factory=list)
    action: str = ""
    cut: str = "whole"  # whole: a clip is a performance; cycles: every cycle of a steady walk is one
    limit: int = 0  # at most so many performances; 0: all


@dataclass(kw_only=True)
class SyntheticClips:
    """Walking, bending and bodies of smooth angles in turn: motion with known answers for park2011."""

    clips: int = 12
    seconds: float = 6.8
    frame_rate_hz: float = 30.0
    bandwidth: int = 10  # cosines of the angles of the smooth bodies, over the whole clip
    limit: int = 0  # at most so many clips; 0: all


@dataclass(kw_only=True)
class RecordedClips:
    """Which recordings hold varied motion."""

    sources: list[str] = field(default_factory=list)
    action: str = ""  # beginning of the table's action, or the whole of it
    limit: int = 0  # at most so many clips; 0: all


@dataclass(kw_only=True)
class SyntheticData(Data):
    """The embedded kinematic population."""

    population: int = 80
    male_share: float = 0.4  # the papers' 32 men of 80
    duration_s: float = 8.0
    frame_rate_hz: float = 120.0
    marker_noise_mm: float = 0.5
    performances: SyntheticPerformances = field(default_factory=SyntheticPerformances)
    clips: SyntheticClips = field(default_factory=SyntheticClips)


@dataclass(kw_only=True)
class Steady:
    """What counts as steady walking, and as a usable Fourier series of it."""

    locomotion: str = "auto"  # auto, overground, treadmill
    path: str = "cubic"  # cubic, moving_average: the horizontal path that is taken out
    speed_band: float = 0.35  # relative to the median speed; narrower bands are tried first
    turn_deg_s: float = 45.0
    cycles: float = 1.5
    gap_s: float = 0.1  # longer gaps end a stretch, shorter ones are bridged
    fundamental_share: float = 0.6
    residual_share: float = 0.15
    frequency_ratio: float = 1.6  # to the population's median, leg length allowed for


@dataclass(kw_only=True)
class RecordedData(Data):
    """Public recordings listed in `data/sources.csv`."""

    sources: list[str]  # of walks
    action: str = "walk"
    table: str = "data/sources.csv"
    raw: str = "data/raw"
    mirror: str = ""  # a folder that holds the same files; read where raw lacks one
    skeletons: dict[str, SourceMapping] = field(default_factory=dict)  # by the table's skeleton column
    same_person: list[list[str]] = field(default_factory=list)  # subjects that are one person
    steady: Steady = field(default_factory=Steady)
    performances: RecordedPerformances = field(default_factory=RecordedPerformances)
    clips: RecordedClips = field(default_factory=RecordedClips)


@dataclass(kw_only=True)
class FolderData(Data):
    """The user's own files."""

    path: str = ""
    pattern: str = "**/*"
    person: str = "^([^_.]+)"  # regular expression on the file's name; its first group names the person
    frame_rate_hz: float = 0.0  # for files that do not say (AMC: 120, CSV without time); 0: the file's own
    units: str = ""  # for files that do not say: mm, cm, m, in
    steady: Steady = field(default_factory=Steady)
    performances: RecordedPerformances = field(default_factory=RecordedPerformances)
    clips: RecordedClips = field(default_factory=RecordedClips)


@dataclass(kw_only=True)
class Dataset:
    """How clips become samples."""


@dataclass(kw_only=True)
class FourierDataset(Dataset):
    """Fourier representations [zhang2007 3.2] [zhang2004 2]."""

    harmonics: int = 2
    frequency: bool = False  # zhang2004: the frequency is the 226th number
    origin: str = "pelvis_mean"  # pelvis_mean, floor
    size: str = "absolute"  # absolute, stature
    walks: str = "best"  # best: one to a person, by residual; all


@dataclass(kw_only=True)
class LimbDataset(Dataset):
    """Stretches of equal length out of clips, as limbs that hang on each other [park2011 3]."""

    frames: int = 100
    frame_rate_hz: float = 30.0
    stretches: int = 2  # of each clip, evenly over it; fewer where it is too short


@dataclass(kw_only=True)
class Model:
    """What is learnt."""


@dataclass(kw_only=True)
class EigenwalkersModel(Model):
    """Average walker and eigenwalkers [zhang2007 3.3] [zhang2004 3]."""

    components: int = 30
    divisor: str = "R-1"  # R-1, R
    mirror: bool = False
    omega_scale_mm: float | None = 1.0  # null: equal to the mean variance of the other numbers


@dataclass(kw_only=True)
class TrajectoryBasisModel(Model):
    """The trajectory basis [park2011 2]: nothing is learnt, K is looked at."""

    components: int = 20  # K; 0: each limb chooses its own, from its images
    basis: str = "hard"  # hard: as printed; soft: a ridge (k / softness)^6 on K coefficients
    softness: float = 10.0


@dataclass(kw_only=True)
class Sweep:
    """What is tried on every fold."""


@dataclass(kw_only=True)
class NoSweep(Sweep):
    """Nothing: the figure shows the model itself."""


@dataclass(kw_only=True)
class KnownViewSweep(Sweep):
    """Experiment 1: the view is known; section 4.2 of both papers."""

    view_angle_deg: Grid
    sigma2_mm2: Grid
    methods: list[str] = field(default_factory=lambda: ["least_squares", "map"])
    noise_variance_mm2: float = 70.0
    phase_source: str = "motion3d"  # motion3d, observed2d: frequency and phase from the view alone
    truth: str = "motion"  # motion, fourier
    missing_variance: str = "temporal"  # temporal, overall
    demonstration_views_deg: list[float] = field(default_factory=lambda: [0.0, 30.0, 90.0])


@dataclass(kw_only=True)
class UnknownViewSweep(Sweep):
    """Experiment 2: the view is estimated too [zhang2007 4.5] [zhang2007 4.6] [zhang2004 14]."""

    view_angle_deg: Grid
    methods: list[str] = field(default_factory=lambda: ["least_squares", "map"])
    noise_variance_mm2: float = 70.0
    phase_source: str = "motion3d"  # motion3d, observed2d: frequency and phase from the view alone
    solver: str = "global"  # global, published
    angle_range_deg: list[float] = field(default_factory=lambda: [-180.0, 180.0])
    start_deg: float = 0.0  # of the published solver
    failure_deg: float = 30.0


@dataclass(kw_only=True)
class LimbSweep(Sweep):
    """Random limbs of random stretches, before cameras on random sides [park2011 section 5.1]."""

    trials: int  # of every point of the sweep, the same ones at all points
    cameras: list[str] = field(
        default_factory=lambda: ["shaky", "still"]
    )  # still, moving, shaky; first is drawn
    distance_mm: float = 4000.0
    focal_px: float = 1000.0
    around_deg: float = 60.0  # how far a moving or shaky camera walks around
    time_limit_s: float = 5.0  # nominal, of each certificate: a count of operations, as `minimise` says


@dataclass(kw_only=True)
class ReconstructibilitySweep(LimbSweep):
    """Error against reconstructibility [park2011 13]."""

    cameras: list[str] = field(default_factory=lambda: ["still", "moving", "shaky"])
    reading: str = "vector"  # vector, angle (as printed)
    noise_px: float = 0.0
    adjust: str = "per_frame"  # per_frame, global, robust: what to do where a ray misses the sphere
    refined: int = 10  # trials of each camera whose reprojection error is refined from other starts as well


@dataclass(kw_only=True)
class RootErrorSweep(LimbSweep):
    """Error against error of the parent trajectory, in radii."""

    ratios: list[float] = field(default_factory=lambda: [0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5])
    smooth: bool = True  # the error is in the trajectory basis; else it is white
    noise_px: float = 0.0
    adjust: str = "per_frame"


@dataclass(kw_only=True)
class RadiusScaleSweep(LimbSweep):
    """Error against scale of the radius that is assumed."""

    scales: list[float] = field(
        default_factory=lambda: (
            [0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 2.0, 3.0, 10.0, 30.0, 100.0]
        )
    )
    adjusts: list[str] = field(
        default_factory=lambda: ["global", "per_frame", "robust"]
    )  # first as in the paper
    noise_px: float = 0.0


@dataclass(kw_only=True)
class MissingDataSweep(LimbSweep):
    """Error of a whole skeleton against the share of missing points."""

    cameras: list[str] = field(default_factory=lambda: ["still"])
    fractions: list[float] = field(default_factory=lambda: [0.0, 0.05, 0.1, 0.2, 0.3, 0.5])
    patterns: list[str] = field(default_factory=lambda: ["random", "block"])
    length_error: float = 0.02  # standard deviation over limbs, relative
    root_error_mm: float = 20.0
    noise_px: float = 1.0
    use_hinges: bool = True
    adjust: str = "per_frame"
    share: float = 0.3  # of the trials: each is a skeleton of fourteen limbs
    time_limit_s: float = 0.0  # signs at once, without certificates


@dataclass(kw_only=True)
class ProofSweep(LimbSweep):
    """Share of programmes that are proved, by frames and components."""

    cameras: list[str] = field(default_factory=lambda: ["still", "moving", "shaky"])  # in turn
    frames: list[int] = field(default_factory=lambda: [25, 50, 100, 200])
    components: list[int] = field(default_factory=lambda: [10, 20])
    noises_px: list[float] = field(default_factory=lambda: [0.0, 1.0])
    adjust: str = "per_frame"
    long_share: float = 0.2  # of the trials for over 100 frames, which may take the time limit each
    time_limit_s: float = 2.0


@dataclass(kw_only=True)
class MotionsSweep(Sweep):
    """Whole skeletons of varied motion, from a still, a moving and a shaky camera [park2011 section 5.2]."""

    cameras: list[str] = field(default_factory=lambda: ["still", "moving", "shaky"])
    clips: int = 0  # of the data set, evenly over all; 0: all.  Of each its liveliest stretch
    distance_mm: float = 4000.0
    focal_px: float = 1000.0
    around_deg: float = 60.0
    noise_px: float = 1.0
    lengths: str = "true"  # true; anthropometric: ratios, scaled to the true thighs; estimated: from the rays
    root: str = "true"  # true; unit_depth: its image, at the depth that it has in the middle frame
    use_hinges: bool = True
    try_mirrors: bool = False  # of limbs in doubt, where all limbs refined together then fit better
    exact: bool = False  # take the signs that the certificate finds, not the first
    time_limit_s: float = 0.2  # nominal, of each certificate


@dataclass(kw_only=True)
class FaceOffSweep(Sweep):
    """Walks reconstructed by eigenwalkers and by articulated trajectories from the same projections."""

    view_angle_deg: list[float] = field(default_factory=lambda: [0.0, 30.0, 60.0, 90.0])
    walkers: int = 10  # evenly over all; 0: all
    frames: int = 100  # out of the middle of each walk; fewer where it is shorter
    frame_rate_hz: float = 30.0
    noise_px: list[float] = field(default_factory=lambda: [0.0, 1.0, 3.0])
    occluded: list[float] = field(default_factory=lambda: [0.0, 0.1, 0.3])  # share of joints unseen, in runs
    occlusion_frames: float = 10.0  # mean length of such a run
    varied_view_deg: float = 30.0  # where noise and occlusion are varied
    cameras: list[str] = field(default_factory=lambda: ["still", "moving", "shaky"])
    distance_mm: float = 4000.0
    focal_px: float = 1000.0
    around_deg: float = 60.0
    components: int = 20  # 0: each limb chooses its own
    softness: float = 30.0  # of the trajectory basis; 0: a hard one, which long gaps leave undetermined
    refine: bool = False  # of articulated trajectories, in the end: costs time, moves errors by 3 %
    noise_variance_mm2: float = 70.0  # of approach II
    time_limit_s: float = 0.0  # nominal, of each choice of signs; 0: the first ones


@dataclass(kw_only=True)
class Report:
    """What is drawn, logged and tabulated."""

    picture: bool = True
    recording: bool = True


@dataclass(kw_only=True)
class SpectrumReport(Report):
    """Cumulative variance and share of each harmonic."""


@dataclass(kw_only=True)
class NoiseVarianceReport(Report):
    """Error against sigma²."""


@dataclass(kw_only=True)
class PosturesReport(Report):
    """Postures over one cycle, original and reconstructed."""

    walker: int = 0
    instants: int = 5


@dataclass(kw_only=True)
class ViewErrorsReport(Report):
    """Errors and missing variance against view angle."""


@dataclass(kw_only=True)
class ViewAnglesReport(Report):
    """Estimated against true view angle."""


@dataclass(kw_only=True)
class LimbScatterReport(Report):
    """Error of each trial against reconstructibility."""


@dataclass(kw_only=True)
class LimbErrorsReport(Report):
    """Error of the trials against what is swept, with bands."""


@dataclass(kw_only=True)
class ProofsReport(Report):
    """Share of programmes proved, and what it costs."""


@dataclass(kw_only=True)
class MotionsReport(Report):
    """Images, reconstructions from other views, whole trajectories."""

    instants: int = 4
    shown: list[str] = field(
        default_factory=lambda: ["dance", "jump", "cartwheel", "signals", "walk", "bending", "smooth angles"]
    )  # the first clip whose action says so is drawn


@dataclass(kw_only=True)
class FaceOffReport(Report):
    """Both families against view, noise and occlusion."""


@dataclass(kw_only=True)
class Config:
    """One figure, whole."""

    figure: str
    paper: str
    title: str
    expect: str  # what the reader should see
    scale: Scale
    data: Data
    skeleton: SourceMapping
    dataset: Dataset
    model: Model
    sweep: Sweep
    report: Report
    seed: int = 2007
    workers: int = 2
    results: str = "results"

    @property
    def purpose(self) -> str:
        """Which of a data set's corpora the figure is made of: walks, performances or clips."""
        match self.dataset:
            case FourierDataset():
                return "walks"
            case _:
                return "clips"
