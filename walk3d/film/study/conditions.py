"""Conditions of the simulated clips; each condition changes one aspect of the film or of the reconstruction.

Degradations make the film worse: errors of the detector; length, rate, distance and height of filming.  The ablation
leaves out an ingredient of the reconstruction, joints, correct labels, or people like the walker.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from typing import Any

from pipeline.skeleton import WALKER15
from walk3d.film.simulation.keypoints import DetectorError
from walk3d.film.walk import Fitting
from walk3d.film.walk.objective import FOCAL_SD

USUAL = "as usual"


class Changes(StrEnum):
    """Groups of conditions; a figure compares the conditions of one group."""

    degradations = "degradations"
    ablation = "ablation"


@dataclass(frozen=True, kw_only=True)
class Knowledge:
    """Assumptions of the reconstruction about the walker and the detector.

    Attributes
    ----------
    floor_mm : float
        Assumed standard deviation of a joint's fixed offset; 0: no offset is assumed or removed.
    harmonics : int
        Number of harmonics of the walker; higher ones are zero.
    bones : bool
        True: bones keep their lengths.
    other_sources : bool
        True: the model is learnt only from people of other sources.
    """

    floor_mm: float = 10.0
    harmonics: int = 4
    bones: bool = True
    other_sources: bool = False


_as_labelled = partial(Fitting, both_labellings=False)


@dataclass(frozen=True, kw_only=True)
class Condition:
    """Condition under which clips are simulated: the usual condition, or one that differs from it in one respect.

    Attributes
    ----------
    kind, level : str
        Kind and size of the change.
    error : DetectorError
    filming : dict
        Fields of `walk3d.film.simulation.keypoints.Filming` in place of the usual ones.
    strides : float
        Length of the clip, to which a shorter recording is continued; 0: as recorded, up to a limit.
    focal_factor : float
        Focal length that is given to the reconstruction, over the true one.
    hidden : tuple of str
        Joints that are never seen.
    wrong_labels : bool
        True: left and right are exchanged throughout.
    knowledge : Knowledge
    fitting : Fitting
        Options of the fit; by default, labels are used as given.
    """

    kind: str = USUAL
    level: str = ""
    error: DetectorError = field(default_factory=DetectorError)
    filming: dict[str, Any] = field(default_factory=dict)
    strides: float = 0.0
    focal_factor: float = 1.0
    hidden: tuple[str, ...] = ()
    wrong_labels: bool = False
    knowledge: Knowledge = field(default_factory=Knowledge)
    fitting: Fitting = field(default_factory=_as_labelled)

    @property
    def name(self) -> str:
        """Name of the condition: kind and level of its change."""
        return f"{self.kind}: {self.level}" if self.level else self.kind


def _several(kind: str, change: Callable[[Any], dict[str, Any]], levels: dict[str, Any]) -> list[Condition]:
    return [Condition(kind=kind, level=level, **change(value)) for level, value in levels.items()]


_ERROR = DetectorError()
_LEGS = {f"{side}_{joint}" for side in ("left", "right") for joint in ("hip", "knee", "ankle")}
_TRUNK = ("head", "sternum", "pelvis")
_RIGHT_ARM = ("right_elbow", "right_wrist")

CONDITIONS: dict[Changes, list[Condition]] = {
    Changes.degradations: [
        Condition(),
        *_several(
            "noise",
            lambda times: {
                "error": replace(_ERROR, white_px=times * _ERROR.white_px, slow_px=times * _ERROR.slow_px)
            },
            {"none": 0.0, "2 times": 2.0, "4 times": 4.0},
        ),
        *_several("bias", lambda mm: {"error": replace(_ERROR, bias_mm=mm)}, {"none": 0.0, "20 mm": 20.0}),
        Condition(
            kind="bias", level="20 mm, told", error=replace(_ERROR, bias_mm=20.0), knowledge=Knowledge(floor_mm=20.0)
        ),
        *_several(
            "missing", lambda share: {"error": replace(_ERROR, missing=share)}, {"20 %": 0.2, "50 %": 0.5}
        ),
        *_several(
            "swaps", lambda rate: {"error": replace(_ERROR, swaps_per_s=rate)},
            {"0.5 per second": 0.5, "1.5 per second": 1.5},
        ),
        *_several("strides", lambda n: {"strides": n}, {"6": 6.0, "4": 4.0, "2": 2.0, "1.5": 1.5, "1": 1.0}),
        *_several(
            "frame rate", lambda hz: {"filming": {"frame_rate_hz": hz}}, {"60 Hz": 60.0, "15 Hz": 15.0, "10 Hz": 10.0}
        ),
        *_several(
            "distance", lambda m: {"filming": {"distance_mm": (1000 * m, 1000 * m)}}, {"10 m": 10.0, "20 m": 20.0}
        ),
        *_several(
            "camera height", lambda m: {"filming": {"height_mm": (1000 * m, 1000 * m)}}, {"0.3 m": 0.3, "2.5 m": 2.5}
        ),
        *_several(
            "focal length told", lambda times: {"focal_factor": times}, {"25 % too long": 1.25, "20 % too short": 0.8}
        ),
        *_several(
            "focal length found", lambda times: {"focal_factor": times, "fitting": _as_labelled(focal_sd=FOCAL_SD)},
            {"from 40 % too short": 0.6, "from 40 % too long": 1.4},
        ),
    ],
    Changes.ablation: [
        Condition(),
        *_several(
            "without", lambda knowledge: {"knowledge": knowledge},
            {
                "the fourth harmonic": Knowledge(harmonics=3), "harmonics 3 and 4": Knowledge(harmonics=2),
                "lengths of bones": Knowledge(bones=False),
            },
        ),
        *_several(
            "without", lambda fitting: {"fitting": fitting},
            {
                "several starts": _as_labelled(max_starts=1), "search for swaps": _as_labelled(relabel=False),
                "long tails of errors": _as_labelled(nu=1e6), "path as fast as feet": _as_labelled(overground=False),
            },
        ),
        Condition(kind="without", level="giving the bias back", knowledge=Knowledge(floor_mm=0.0)),
        *_several(
            "never seen", lambda joints: {"hidden": joints},
            {
                "head, sternum, pelvis": _TRUNK, "right arm": _RIGHT_ARM,
                "all but the legs": tuple(joint for joint in WALKER15.joints if joint not in _LEGS),
            },
        ),
        Condition(kind="labels wrong", level="as given", wrong_labels=True),
        Condition(kind="labels wrong", level="both tried", wrong_labels=True, fitting=Fitting()),
        Condition(kind="learnt from", level="other sources", knowledge=Knowledge(other_sources=True)),
    ],
}  # fmt: skip
"""Conditions by group.

The usual condition is first, and the largest change of each kind is last.
"""
