"""mozerov2006 as data: its 19 equations and its claims; the figures are not built yet."""

from __future__ import annotations

from pipeline.papers_ledger import Claim, Equation, Paper

FIG1, FIG2, FIG3, FIG4 = (f"mozerov2006_fig{n}" for n in (1, 2, 3, 4))


_HOMES = {
    **dict.fromkeys(("6", "7"), "synchronization.normalise"),
    **dict.fromkeys(("8", "9"), "synchronization.rate_to_rate"),
    **dict.fromkeys(("10", "18"), "synchronization.warp"),
    **dict.fromkeys(("11", "12"), "synchronization.synchronization_distance"),
    **dict.fromkeys(("1", "2"), "posture.postures"),
    "13": "trellis.trellis",
    "14": "synchronization.disparity_space_image",
    "15": "synchronization.synchronize",
    "16": "trellis.accumulate",
    "17": "trellis.backtrack",
    "19": "all_pairs.median_sequence",
}
"""Where the equations that are built live, below ``pipeline.core``."""


def _equation(number: str, words: str, note: str = "") -> Equation:
    home = _HOMES.get(number, "")
    test = f"tests/core/test_{'posture' if 'posture' in home else 'synchronization'}.py" if home else ""
    return Equation("mozerov2006", number, words, f"pipeline.core.{home}" if home else "", test, note)


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

_PERFORMERS = "a fact about the recorded people and their laboratory; the recordings are not public"


def _claim(
    name: str, section: str, figure: str, quote: str, published: float | None = None, unit: str = ""
) -> Claim:
    return Claim(
        name=f"mozerov2006_{name}",
        paper="mozerov2006",
        section=section,
        quote=quote,
        published=published,
        unit=unit,
        figure=figure,
    )


def _fact(
    name: str,
    section: str,
    quote: str,
    published: float | None = None,
    unit: str = "",
    why: str = _PERFORMERS,
) -> Claim:
    return Claim(
        name=f"mozerov2006_{name}",
        paper="mozerov2006",
        section=section,
        quote=quote,
        published=published,
        unit=unit,
        untestable=why,
    )


CLAIMS = (
    _fact("markers", "2", "A set of 19 reflective markers were placed on several characteristic points", 19),
    _claim("rigid_parts", "2", FIG3, "composed of twelve rigid body parts", 12),
    _claim("joints", "2", FIG3, "and fifteen joints", 15),
    _claim("posture_parameters", "2", FIG3, "we represent a human body posture ψ using 37 parameters", 37),
    _claim(
        "cosines_without_discontinuities",
        "2",
        FIG3,
        "it doesn't lead to discontinuities, in contrast to other methods such as Euler angles",
    ),
    _claim(
        "redundant_cosines",
        "2",
        FIG3,
        "we are using 3 parameters to determine only 2 DOF for each limb",
        2,
        "degrees of freedom",
    ),
    _claim(
        "highly_correlated_postures",
        "2",
        FIG3,
        "these natural constraints lead to highly correlated data in the original space",
    ),
    _claim(
        "rate_rarely_constant",
        "3",
        FIG1,
        "in our research we rarely if ever have a constant rate ratio",
    ),
    _claim(
        "linear_normalisation_not_enough",
        "3",
        FIG1,
        "a simple normalization using Eq. (7) does not give us the needed signal fitting",
    ),
    _claim(
        "path_is_optimal",
        "3",
        FIG2,
        "the sum of the cost values along this path plus the weighted length of the path is minimal among "
        "all other possible paths",
    ),
    _claim(
        "median_better_than_arbitrary_pattern",
        "3",
        FIG3,
        "an arbitrary choice among the training set is not a reasonable solution",
    ),
    _fact("performances", "4", "a training set consisting of 40 performances of a bending action", 40),
    _claim("eigenvectors", "4", FIG3, "we choose the first 16 eigenvectors", 16),
    _claim("variance_captured", "4", FIG3, "eigenvectors that captured 95% of the original data", 95, "%"),
    _fact("frames", "4", "different durations with 100 frames on average", 100, "frames"),
    _claim(
        "seconds_for_a_pair",
        "4",
        FIG3,
        "The time needed for synchronizing two arbitrary sequences taken from our database is 1.5 10⁻² "
        "seconds",
        0.015,
        "s",
    ),
    _claim(
        "seconds_for_the_set",
        "4",
        FIG3,
        "0.6 seconds to synchronize the whole training set",
        0.6,
        "s",
    ),
    _fact("processor", "4", "run with a 3 GHz Pentium D processor", 3, "GHz"),
    _claim(
        "different_speeds_hide_the_pattern",
        "4",
        FIG3,
        "Such a mistiming makes very difficult to learn any common pattern from the data",
    ),
    _claim("key_frames", "4", FIG3, "a set of 5 key-frames in each sequence by hand", 5),
    _claim(
        "as_good_as_key_frames",
        "4",
        FIG3,
        "the results are very similar to the ones obtained with the proposed automatic synchronization "
        "method",
    ),
    _claim(
        "within_three_standard_deviations",
        "4",
        FIG3,
        "±3 times the learnt standard deviation at each synchronized posture",
        3,
        "standard deviations",
    ),
    _claim(
        "feasible_postures_accepted",
        "4",
        FIG4,
        "only those human postures which lie within the learnt variance boundaries from the mean performance "
        "are accepted by the motion model",
    ),
    _claim(
        "sampled_postures_meaningful",
        "4",
        FIG4,
        "for each selected mean posture, only similar and meaningful postures are generated",
    ),
    _claim(
        "real_time",
        "5",
        FIG3,
        "The technique utilizes dynamic programming, and can be used in real-time applications",
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
)
