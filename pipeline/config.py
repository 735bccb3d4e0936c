"""The options of every stage as plain dataclasses; `conf/` holds their values, `__main__` registers them.

One class per option of each group, so that a stage can tell what it is asked for by type.  Degrees, not
radians, here: this is what people write.  Units stand in the names.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.refusal import Refusal
from pipeline.skeleton import SourceMapping

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
            raise Refusal("the range is not finite", where=name, received=str(self))
        if self.step <= 0:
            raise Refusal(
                "the step is not positive", where=name, expected="step > 0", received=f"{self.step:g}"
            )
        if self.stop <= self.start:
            raise Refusal(
                "the range has length zero",
                where=name,
                expected="stop > start",
                received=f"{self.start:g}..{self.stop:g}",
            )
        count = int(np.floor((self.stop - self.start) / self.step + 1e-9)) + 1
        if count > MOST_VALUES:
            raise Refusal(
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


@dataclass(kw_only=True)
class Data:
    """Where the walks come from."""

    name: str
    walkers: int = 0  # at most so many people; 0: all


@dataclass(kw_only=True)
class SyntheticData(Data):
    """The embedded kinematic population."""

    population: int = 80
    male_share: float = 0.4  # the papers' 32 men of 80
    duration_s: float = 8.0
    frame_rate_hz: float = 120.0
    marker_noise_mm: float = 0.5


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

    sources: list[str]
    action: str = "walk"
    table: str = "data/sources.csv"
    raw: str = "data/raw"
    mirror: str = ""  # a folder that holds the same files; read where raw lacks one
    skeletons: dict[str, SourceMapping] = field(default_factory=dict)  # by the table's skeleton column
    same_person: list[list[str]] = field(default_factory=list)  # subjects that are one person
    steady: Steady = field(default_factory=Steady)


@dataclass(kw_only=True)
class FolderData(Data):
    """The user's own files."""

    path: str = ""
    pattern: str = "**/*"
    person: str = "^([^_.]+)"  # regular expression on the file's name; its first group names the person
    frame_rate_hz: float = 0.0  # for files that do not say (AMC: 120, CSV without time); 0: the file's own
    units: str = ""  # for files that do not say: mm, cm, m, in
    steady: Steady = field(default_factory=Steady)


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
class Model:
    """What is learnt."""


@dataclass(kw_only=True)
class EigenwalkerModel(Model):
    """Average walker and eigenwalkers [zhang2007 3.3] [zhang2004 3]."""

    components: int = 30
    divisor: str = "R-1"  # R-1, R
    mirror: bool = False
    omega_scale_mm: float | None = 1.0  # null: equal to the mean variance of the other numbers


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
