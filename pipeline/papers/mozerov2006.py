"""mozerov2006 as data: its 19 equations; its claims are in `papers_mozerov2006_claims`."""

from __future__ import annotations

from pipeline.papers.claims import TEST_OF as _TEST_OF
from pipeline.papers.claims import Equation, Paper
from pipeline.papers.mozerov2006_claims import CLAIMS, FIG1, FIG2, FIG3, FIG4

_HOMES = {
    **dict.fromkeys(("6", "7"), "synchronization.pair.normalise"),
    **dict.fromkeys(("8", "9"), "synchronization.pair.rate_to_rate"),
    **dict.fromkeys(("10", "18"), "synchronization.pair.warp"),
    **dict.fromkeys(("11", "12"), "synchronization.pair.synchronization_distance"),
    **dict.fromkeys(("1", "2"), "posture.cosines.postures"),
    "3": "aspace.learn",
    "4": "aspace.smallest_dimensions",
    "5": "aspace.ASpace",
    "13": "synchronization.trellis.trellis",
    "14": "synchronization.pair.disparity_space_image",
    "15": "synchronization.pair.synchronize",
    "16": "synchronization.trellis.accumulate",
    "17": "synchronization.trellis.backtrack",
    "19": "synchronization.all_pairs.median_sequence",
}
"""Where each equation lives, below ``pipeline.core``."""

_TESTS = {"posture": "posture", "aspace": "aspace"}
"""Modules with a file of tests of their own; the others are parts of the synchronization, and tested as such."""


def _equation(number: str, words: str, note: str = "") -> Equation:
    home = _HOMES[number]
    test = _TEST_OF.get(home.rpartition(".")[0], home.split(".")[0])
    test = _TESTS.get(test, "synchronization")
    return Equation("mozerov2006", number, words, f"pipeline.core.{home}", f"tests/core/test_{test}.py", note)


EQUATIONS = (
    _equation(
        "1",
        "a posture is the pelvis height and three direction cosines of each of twelve limbs: 37 numbers",
        "'normalized' height is undefined: pelvis height over leg length; a direction has no twist, so the "
        "parent's frame must be chosen (parallel transport from rest), and the hip has no parent, so its "
        "heading is taken out",
    ),
    _equation(
        "2",
        "a performance is a time-ordered sequence of postures",
        "the duration printed is T = delta-f F although F postures span F - 1 intervals",
    ),
    _equation(
        "3",
        "eigenvectors of the covariance of all postures of an action",
        "the sign of an eigenvector is free: its largest entry is made positive",
    ),
    _equation(
        "4",
        "the first b eigenvalues carry nearly all of the variance",
        "the middle term is printed as the sum to b plus an error, joined by an approximate sign where the "
        "identity is exact; b is the smallest number that reaches 95 %",
    ),
    _equation(
        "5",
        "a posture in the aSpace: projections of its deviation from the mean posture",
        "blended cosines are no unit vectors, so limbs are renormalised before drawing",
    ),
    _equation(
        "6",
        "a performance as a continuous signal through its postures",
        "the kind of interpolation is not stated: linear; t = (f - 1) delta-f never reaches the end of its "
        "own domain [0, T)",
    ),
    _equation(
        "7",
        "linear synchronization: one constant rate, the quotient of the durations",
        "extrapolates past the last posture with the T of 2: end points are aligned instead, which "
        "satisfies 9 at both ends; the subscripts of the result are printed in both orders",
    ),
    _equation("8", "synchronization: the time of one signal is the integral of a changing rate"),
    _equation(
        "9",
        "the rate-to-rate function keeps both ends and never runs backwards",
        "16 leaves the start free although 9 pins it: fixed by default, free as an option",
    ),
    _equation(
        "10",
        "the same as a relative shift of time, the disparity function",
        "the shift is printed as Delta times t here and as Delta times the sampling interval in 12: the "
        "latter is meant",
    ),
    _equation(
        "11",
        "synchronization distance: misfit of the signals plus mu times the variation of the shift",
        "the misfit is an unsquared norm here, squared in 12 and 14: squared",
    ),
    _equation(
        "12",
        "the same for samples: squared misfits plus mu times the changes of disparity",
        "the first sum runs to P, one past the last sample, and the second difference mixes seconds and "
        "samples: everything is in samples; mu has no value in print",
    ),
    _equation(
        "13",
        "the disparity changes by at most one from sample to sample",
        "monotony alone gives only the lower bound: this also caps the rate at 2, and the cap binds on real "
        "data; a wider set of steps is an option",
    ),
    _equation(
        "14",
        "disparity space image: squared distance at a sample and a disparity",
        "outside the other sequence it is undefined: infinite",
    ),
    _equation(
        "15",
        "the disparity function minimises the synchronization distance",
        "the text at hand lost its right side: read as 12 minimised subject to 13",
    ),
    _equation(
        "16",
        "recurrence: least cost of arriving at a sample with a disparity",
        "penalises |d + k|, the size of the former disparity, where 12 penalises |k|, its change: |k| by "
        "default, as printed as an option; ties go to k = 0, then -1, then +1",
    ),
    _equation(
        "17",
        "backtracking: the steps stored on the way, from disparity zero at the end",
        "pins the end but not the start (see 9)",
    ),
    _equation("18", "the synchronized sequence: samples taken at the shifted times"),
    _equation(
        "19",
        "global distance of a pattern: sum of its distances to all performances of the action",
        "distances are not symmetric, so every ordered pair is needed; the first is taken on ties",
    ),
)

PAPER = Paper(
    key="mozerov2006",
    title="3D Human Motion Sequences Synchronization Using Dense Matching Algorithm",
    authors="Mikhail Mozerov, Ignasi Rius, Xavier Roca, Jordi González",
    year=2006,
    venue="DAGM Symposium, Lecture Notes in Computer Science 4174",
    figures=(FIG1, FIG2, FIG3, FIG4),
    equations=EQUATIONS,
    claims=CLAIMS,
    beyond=("mozerov2006_warp_error", "mozerov2006_variance_left", "mozerov2006_tracking"),
)
