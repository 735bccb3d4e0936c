"""zhang2004 as data: its 14 equations and its claims.

The text at hand has gaps, so a sentence of its sections 1 to 3 may be missing here; no numbered equation is.
"""

from __future__ import annotations

from functools import partial

from pipeline.papers import measures
from pipeline.papers.claims import (
    ANY_DATA,
    Claim,
    Equation,
    Interval,
    Paper,
    above,
    at_least,
    at_most,
    below,
    between,
    exactly,
    within,
)
from pipeline.papers.claims import TEST_OF as _TEST_OF
from pipeline.papers.measures import FRONTAL_DEG, LEAST_SQUARES, OBLIQUE_DEG, PROFILE_DEG

FIG2, FIG3, FIG4, FIG5 = (f"zhang2004_fig{n}" for n in (2, 3, 4, 5))
HARMONICS = f"{FIG2}/table_harmonics"
DEMONSTRATIONS = f"{FIG3}/table_demonstrations"
WALKERS = f"{FIG4}/table_walkers"


def _equation(number: str, words: str, home: str, note: str = "") -> Equation:
    module = _TEST_OF.get(home.rpartition(".")[0], home.split(".")[0])
    return Equation("zhang2004", number, words, f"pipeline.core.{home}", f"tests/core/test_{module}.py", note)


EQUATIONS = (
    _equation(
        "1",
        "motion = mean posture + sine and cosine postures of the fundamental and the second harmonic",
        "fourier.series.synthesise",
        "printed as an equality although a residual of about 2 % of the variance is left out",
    ),
    _equation(
        "2",
        "a walker is the vector of mean posture, four characteristic postures and frequency, 226 numbers",
        "fourier.series.represent",
        "which instant is phase zero is not stated: where the fundamental of the left minus the right ankle "
        "along the walk rises through zero",
    ),
    _equation(
        "3",
        "a walker is the average walker plus a weighted sum of eigenwalkers",
        "linear_model.fit",
        "the angular frequency shares the analysis with millimetres and no scale is given, so its weight is "
        "arbitrary: omega_scale_mm, by default such that its variance is the mean variance of the other 225",
    ),
    _equation(
        "4",
        "the 2D motion has a Fourier representation of 151 numbers, frequency included",
        "camera.project",
        "frequency and phase come from the 3D motion before projection, which a real image would not give",
    ),
    _equation(
        "5",
        "the 2D representation is a projection matrix times the 3D representation",
        "camera.projection_matrix",
    ),
    _equation(
        "6",
        "the 2D representation is the projection of average walker plus weighted eigenwalkers",
        "reconstruction.known_view.from_known_views",
    ),
    _equation(
        "7",
        "observed minus projected average = weighted sum of projected eigenwalkers",
        "reconstruction.known_view.least_squares",
    ),
    _equation(
        "8", "the same in matrix form: 151 equations, N unknowns", "reconstruction.known_view.least_squares"
    ),
    _equation(
        "9",
        "least-squares coefficients by the pseudo-inverse",
        "reconstruction.known_view.least_squares",
        "printed as normal equations; computed by orthogonal factorisation, the same minimiser without "
        "squaring the condition number",
    ),
    _equation(
        "10",
        "the reconstructed walker joins the observed 2D and frequency with the missing dimension",
        "camera.combine",
        "the observed coordinates and the frequency are kept as they are, not replaced by the model's",
    ),
    _equation(
        "11",
        "absolute error of a joint: mean over time of the squared difference in the missing dimension",
        "errors.absolute_error",
        "a mean square, in mm^2; the original is the motion itself, residual included",
    ),
    _equation(
        "12",
        "relative error of a joint: absolute error over the variance of the missing dimension",
        "errors.relative_error",
        "the sentence below calls sigma_m, without its square, the variance; 'average overall variance' read "
        "as the variance over time of each joint, averaged over the joints",
    ),
    _equation(
        "13",
        "error of a walker: mean over the 15 joints",
        "errors.walker_error",
        "one equation for the absolute and the relative error alike",
    ),
    _equation(
        "14",
        "view angle and coefficients together minimise the misfit",
        "viewpoint.known_phase.estimate",
        "the norm is printed without its square, which has the same minimiser",
    ),
)

_claim = partial(Claim, paper="zhang2004")

_PEOPLE = "a fact about the recorded people and their laboratory; the eighty recordings are not public"
_SHARE = "one decimal at most is printed, but another population of walkers may differ by 3 points"


def _fact(name: str, quote: str, published: float | None = None, unit: str = "") -> Claim:
    return _claim(
        name=f"zhang2004_{name}",
        section="2",
        quote=quote,
        published=published,
        unit=unit,
        untestable=_PEOPLE,
    )


_OVERGROUND = (
    "people crossing a room speed up and turn a little, on a treadmill they do not, and their clips hold two or three "
    "strides: about 4 % remain after path and heading are taken out"
)

CLAIMS = (
    _claim(
        name="zhang2004_walkers",
        section="2",
        quote="Eighty participants served as subjects to acquire walking data",
        published=80,
        figure=FIG4,
        reduction="different walkers in table_walkers",
        value=lambda t: measures.distinct(t[WALKERS], "walker"),
        needs=(WALKERS,),
        tolerance=exactly(80),
        reason="a count: equal or not",
        explanation={ANY_DATA: "the data at hand hold another number of people"},
    ),
    _fact("markers", "A set of 41 retro-reflective markers was attached to their bodies", 41),
    _fact("treadmill", "Participants were requested to walk on a treadmill"),
    _fact("cameras", "equipped with 9 CCD high-speed cameras", 9),
    _fact("resolution", "with a sub-millimeter spatial resolution"),
    _fact("frame_rate", "a sampling rate of 120 Hz", 120, "Hz"),
    _claim(
        name="zhang2004_joints",
        section="2",
        quote="Each posture is described in terms of 15 markers",
        published=15,
        figure=FIG3,
        reduction="different joints in the table",
        value=lambda t: measures.distinct(t[FIG3], "joint"),
        tolerance=exactly(15),
        reason="a count: equal or not",
    ),
    _claim(
        name="zhang2004_dimensions_3d",
        section="3.1",
        quote="the dimensionality of a Fourier representation at this stage is 45 * 5 + 1 = 226",
        published=226,
        figure=FIG3,
        reduction="joints × 3 × (1 + 2 × harmonics), as the tables name them, and one frequency_hz",
        value=lambda t: (
            measures.representation_length(t[FIG3], t[HARMONICS], 3) + float("frequency_hz" in t[HARMONICS])
        ),
        needs=(FIG3, HARMONICS),
        tolerance=exactly(226),
        reason="a count: equal or not",
    ),
    _claim(
        name="zhang2004_dimensions_2d",
        section="3.2",
        quote="concatenated into a column vector ŵ with 30 * 5 + 1 = 151 entries",
        published=151,
        figure=FIG3,
        reduction="joints × 2 × (1 + 2 × harmonics), as the tables name them, and one frequency_hz",
        value=lambda t: (
            measures.representation_length(t[FIG3], t[HARMONICS], 2) + float("frequency_hz" in t[HARMONICS])
        ),
        needs=(FIG3, HARMONICS),
        tolerance=exactly(151),
        reason="a count: equal or not",
    ),
    _claim(
        name="zhang2004_fewer_components_than_walkers",
        section="3.1",
        quote="The exact dimensionality N of the model … will generally be much smaller than R",
        figure=FIG2,
        reduction="components needed for 95 % of the variance, over the number of walkers",
        value=lambda t: measures.ratio(
            measures.components_needed(t[FIG2], 95.0), measures.distinct(t[HARMONICS], "walker")
        ),
        needs=(FIG2, HARMONICS),
        tolerance=at_most(0.5),
        direction=below(1),
        reason="the paper's own 28 of 80 is 0.35; a half or less is still much smaller",
        explanation={
            "cmu": "with 18 people leave-one-out leaves room for 16 components at most",
        },
    ),
    _claim(
        name="zhang2004_fundamental_share",
        section="4.1",
        quote="the fundamental frequency covered 91.9% of the total variance",
        published=91.9,
        unit="%",
        figure=FIG2,
        reduction="mean over walkers of variance_fraction at harmonic 1",
        value=lambda t: measures.harmonic_share(t[HARMONICS], "variance_fraction", 1),
        needs=(HARMONICS,),
        tolerance=within(91.9, 3),
        direction=at_least(50),
        reason=_SHARE,
    ),
    _claim(
        name="zhang2004_second_harmonic_share",
        section="4.1",
        quote="the second harmonic accounted for another 6.0%",
        published=6.0,
        unit="%",
        figure=FIG2,
        reduction="mean over walkers of variance_fraction at harmonic 2",
        value=lambda t: measures.harmonic_share(t[HARMONICS], "variance_fraction", 2),
        needs=(HARMONICS,),
        tolerance=within(6.0, 3),
        direction=between(0, 25),
        reason=_SHARE,
    ),
    _claim(
        name="zhang2004_two_harmonics_share",
        section="4.1",
        quote="the first two harmonics explain 97.9% of the overall postural variance of a walker",
        published=97.9,
        unit="%",
        figure=FIG2,
        reduction="mean over walkers of variance_fraction, harmonics 1 and 2 added",
        value=lambda t: (
            measures.harmonic_share(t[HARMONICS], "variance_fraction", 1)
            + measures.harmonic_share(t[HARMONICS], "variance_fraction", 2)
        ),
        needs=(HARMONICS,),
        tolerance=Interval(94.9, 100),
        direction=at_least(90),
        reason=_SHARE,
        explanation={
            "cmu": _OVERGROUND,
        },
    ),
    _claim(
        name="zhang2004_twenty_eight_components",
        section="4.1",
        quote="The first 28 principal components accounted for 95% variance of all the Fourier "
        "representations",
        published=95,
        unit="%",
        figure=FIG2,
        reduction="cumulative_fraction at component 28",
        value=lambda t: measures.cumulative_share(t[FIG2], 28),
        tolerance=within(95, 3),
        direction=at_least(90),
        reason=_SHARE,
        explanation={
            "optical": "with 33 people, 28 components leave almost nothing over",
            "cmu": "with so few people, 28 components leave almost nothing over",
            "synthetic": "a kinematic population is more compact than people are: it has fewer ways to differ",
        },
    ),
    _claim(
        name="zhang2004_one_degree_steps",
        section="4.2",
        quote="at one degree intervals from the left profile-view to the right profile-view",
        published=1,
        unit="°",
        figure=FIG4,
        reduction="range of view_angle_deg over the number of steps between its different values",
        value=lambda t: measures.mean_step(t[FIG4], "view_angle_deg"),
        tolerance=exactly(1),
        reason="a setting of the experiment: equal or not",
        explanation={ANY_DATA: "this run used a coarser grid of views"},
    ),
    _claim(
        name="zhang2004_five_postures",
        section="4.2",
        quote="This figure shows five equal interval postures in one motion cycle",
        published=5,
        figure=FIG3,
        reduction="different instants in the table",
        value=lambda t: measures.distinct(t[FIG3], "instant"),
        tolerance=exactly(5),
        reason="a count: equal or not",
    ),
    _claim(
        name="zhang2004_reconstruction_looks_similar",
        section="4.2",
        quote="the original and the reconstructed walking sequences were very similar in the corresponding "
        "postures",
        unit="mm",
        figure=FIG3,
        reduction="mean rms_error_least_squares_mm over all walkers at 0, 30 and 90 degrees",
        value=lambda t: measures.mean(measures.numbers(t[DEMONSTRATIONS], "rms_error_least_squares_mm")),
        needs=(DEMONSTRATIONS,),
        tolerance=at_most(50),
        direction=at_most(100),
        reason="half a knee's breadth, 50 mm, is not seen at a glance; a whole one, 100 mm, is",
    ),
    _claim(
        name="zhang2004_asymmetric_errors",
        section="4.2",
        quote="there are different absolute reconstruction errors in the negative and positive oblique "
        "viewpoints, which implies that human walking is slightly asymmetric",
        unit="%",
        figure=FIG4,
        reduction="mean |E(−α) − E(α)| over the mean of E, 0 < α < 90, of absolute_error_mm2",
        value=lambda t: measures.asymmetry_percent(t[FIG4], "absolute_error_mm2", LEAST_SQUARES),
        tolerance=between(1, 25),
        direction=at_least(1),
        reason="under 1 % no one sees it in a curve; up to a quarter is slight",
    ),
    _claim(
        name="zhang2004_variances_nearly_symmetric",
        section="4.2",
        quote="The very small asymmetry of variances in Fig. 4(b)",
        unit="%",
        figure=FIG4,
        reduction="mean |V(−α) − V(α)| over the mean of V, 0 < α < 90, of missing_variance_mm2",
        value=lambda t: measures.asymmetry_percent(t[FIG4], "missing_variance_mm2", LEAST_SQUARES),
        tolerance=between(0, 5),
        direction=between(0, 15),
        reason="very small but there: over none and under a twentieth",
    ),
    _claim(
        name="zhang2004_energy_of_asymmetric_walkers",
        section="4.2",
        quote="asymmetric walkers should expend more energy than symmetric walkers",
        untestable="needs measurements of energy",
    ),
    _claim(
        name="zhang2004_profile_relative_error_large",
        section="4.2",
        quote="the frontal and the oblique viewpoints have small relative reconstruction errors, while the "
        "profile viewpoints have great relative reconstruction errors",
        figure=FIG4,
        reduction="relative_error in profile over that in frontal views",
        value=lambda t: measures.band_ratio(
            t[FIG4], "relative_error", LEAST_SQUARES, PROFILE_DEG, FRONTAL_DEG
        ),
        tolerance=at_least(3),
        direction=above(1),
        reason="small against great is threefold at least",
    ),
    _claim(
        name="zhang2004_oblique_relative_error_small",
        section="4.2",
        quote="the frontal and the oblique viewpoints have small relative reconstruction errors",
        figure=FIG4,
        reduction="relative_error in profile over that in oblique views",
        value=lambda t: measures.band_ratio(
            t[FIG4], "relative_error", LEAST_SQUARES, PROFILE_DEG, OBLIQUE_DEG
        ),
        tolerance=at_least(3),
        direction=above(1),
        reason="small against great is threefold at least",
    ),
    _claim(
        name="zhang2004_most_variance_retrieved_in_frontal_views",
        section="4.2",
        quote="The proposed method can retrieve most variances in the frontal and oblique viewpoints (near "
        "frontal)",
        figure=FIG4,
        reduction="mean relative_error in frontal views: the share of the missing variance not retrieved",
        value=lambda t: measures.in_band(t[FIG4], "relative_error", LEAST_SQUARES, FRONTAL_DEG),
        tolerance=below(0.5),
        direction=below(1),
        reason="most is more than half; under one is better than knowing each joint's mean alone",
    ),
    _claim(
        name="zhang2004_frontal_and_oblique_actions_more_diverse",
        section="4.2",
        quote="human walking has more diverse actions in the frontal and oblique viewpoints (near frontal), "
        "while the profile and oblique viewpoints (near profile) contain more similar actions",
        figure=FIG4,
        reduction="missing_variance_mm2 in profile over that in frontal views",
        value=lambda t: measures.band_ratio(
            t[FIG4], "missing_variance_mm2", LEAST_SQUARES, PROFILE_DEG, FRONTAL_DEG
        ),
        tolerance=at_most(1 / 3),
        direction=below(1),
        reason="read as the variance that a view misses; clearly more diverse is threefold",
    ),
    _claim(
        name="zhang2004_view_angle_mean",
        section="4.3",
        quote="we can precisely obtain the viewpoints by our proposed linear model",
        unit="°",
        figure=FIG5,
        reduction="mean over views of |estimated_mean_deg − view_angle_deg|",
        value=lambda t: measures.angle_bias_deg(t[FIG5], LEAST_SQUARES),
        tolerance=at_most(2),
        direction=at_most(10),
        reason="precisely: the mean curve stays within two steps of the one-degree grid of views",
    ),
    _claim(
        name="zhang2004_view_angle_spread",
        section="4.3",
        quote="we can precisely obtain the viewpoints by our proposed linear model",
        unit="°",
        figure=FIG5,
        reduction="mean over views of estimated_sd_deg",
        value=lambda t: measures.mean_of_method(t[FIG5], "estimated_sd_deg", LEAST_SQUARES),
        tolerance=at_most(5),
        direction=at_most(15),
        reason="precisely: one walker in three is more than 5° off at most; 15° still tells views apart",
    ),
    _claim(
        name="zhang2004_view_angle_failures",
        section="4.3",
        quote="we can precisely obtain the viewpoints by our proposed linear model",
        unit="%",
        figure=FIG5,
        reduction="failures (more than 30° off) over views × walkers",
        value=lambda t: measures.failures_percent(
            t[FIG5], LEAST_SQUARES, measures.distinct(t[WALKERS], "walker")
        ),
        needs=(FIG5, WALKERS),
        tolerance=at_most(1),
        direction=at_most(10),
        reason="precisely allows one gross error in a hundred; one in ten leaves most views found",
    ),
    _claim(
        name="zhang2004_fits_human_performance",
        section="4.3",
        quote="The poor reconstruction in profile views and the good reconstruction in frontal views fit "
        "with data on human performance",
        untestable="needs human observers",
    ),
    _claim(
        name="zhang2004_less_storage",
        section="5",
        quote="also computational expenditure and storage space requirement are saved",
        untestable="the paper gives no figure and the tables hold neither",
    ),
    _claim(
        name="zhang2004_reasonable_reconstruction",
        section="5",
        quote="the proposed method can reasonably reconstruct 3D human walking data from 2D motion sequences",
        unit="mm",
        figure=FIG4,
        reduction="mean over views of rms_error_mm",
        value=lambda t: measures.mean_of_method(t[FIG4], "rms_error_mm", LEAST_SQUARES),
        tolerance=at_most(50),
        direction=at_most(100),
        reason="half a knee's breadth, 50 mm, is not seen at a glance; a whole one, 100 mm, is",
    ),
)

PAPER = Paper(
    key="zhang2004",
    title="3D Periodic Human Motion Reconstruction from 2D Motion Sequences",
    authors="Zonghua Zhang, Nikolaus F. Troje",
    year=2004,
    venue="CVPR Workshops",
    figures=(FIG2, FIG3, FIG4, FIG5),
    equations=EQUATIONS,
    claims=CLAIMS,
)
