"""zhang2007 as data: its 30 equations and its claims."""

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
from pipeline.papers.measures import BOTH, FRONTAL_DEG, LEAST_SQUARES, MAP, OBLIQUE_DEG, PROFILE_DEG

FIG2, FIG3, FIG4, FIG5, FIG6 = (f"zhang2007_fig{n}" for n in (2, 3, 4, 5, 6))
HARMONICS = f"{FIG2}/table_harmonics"
NESTED = f"{FIG3}/table_nested"
DEMONSTRATIONS = f"{FIG4}/table_demonstrations"
WALKERS = f"{FIG5}/table_walkers"


def _equation(number: str, words: str, home: str, note: str = "") -> Equation:
    module = _TEST_OF.get(home.rpartition(".")[0], home.split(".")[0])
    return Equation("zhang2007", number, words, f"pipeline.core.{home}", f"tests/core/test_{module}.py", note)


_LOST_BAR = "the second w-hat stands for the projected average walker C w-bar: its bar is lost in print"
_GRADIENT = (
    "the last sum is printed as a scalar inside a vector equation: read as the vector of entries k_i / "
    "lambda_i"
)
_STACKED = (
    "computed as the stacked least squares [E-hat; diag(sigma / sqrt(lambda))], the same minimiser without "
    "squaring the condition number"
)

EQUATIONS = (
    _equation(
        "3.1",
        "motion = mean posture + sine and cosine postures of the fundamental and the second harmonic + "
        "residual",
        "fourier.series.synthesise",
        "p goes with the sine, q with the cosine; the expansion is fitted by regression, because clips are "
        "not whole cycles",
    ),
    _equation(
        "3.2",
        "a walker is the vector of mean posture and four characteristic postures, 225 numbers",
        "fourier.series.represent",
        "which instant is phase zero is not stated: where the fundamental of the left minus the right ankle "
        "along the walk rises through zero",
    ),
    _equation(
        "3.3",
        "a walker is the average walker plus a weighted sum of N eigenwalkers",
        "linear_model.fit",
        "the divisor of the covariance is not stated and scales every eigenvalue: R - 1; N is capped at R - "
        "1",
    ),
    _equation(
        "3.4",
        "the 2D motion has a Fourier representation of 150 numbers",
        "camera.project",
        "frequency and phase come from the 3D motion before projection, which a real image would not give",
    ),
    _equation(
        "3.5",
        "the 2D representation is a projection matrix times the 3D representation",
        "camera.projection_matrix",
    ),
    _equation(
        "3.6",
        "the 2D representation is the projection of average walker plus weighted eigenwalkers",
        "reconstruction.known_view.from_known_views",
    ),
    _equation(
        "3.7",
        "observed minus projected average = weighted sum of projected eigenwalkers",
        "reconstruction.known_view.least_squares",
    ),
    _equation(
        "3.8", "the same in matrix form: 150 equations, N unknowns", "reconstruction.known_view.least_squares"
    ),
    _equation(
        "3.9",
        "least-squares coefficients by the pseudo-inverse",
        "reconstruction.known_view.least_squares",
        "printed as normal equations; computed by orthogonal factorisation, the same minimiser without "
        "squaring the condition number",
    ),
    _equation(
        "3.10",
        "posterior of the coefficients is proportional to prior times likelihood",
        "reconstruction.known_view.maximum_a_posteriori",
    ),
    _equation(
        "3.11",
        "prior: independent normal coefficients whose variances are the eigenvalues",
        "reconstruction.known_view.maximum_a_posteriori",
        "the eigenvalues depend on the unstated divisor of the covariance (see 3.3)",
    ),
    _equation(
        "3.12",
        "likelihood: independent normal noise of variance sigma^2 on every observed number",
        "reconstruction.known_view.maximum_a_posteriori",
        f"{_LOST_BAR}; this sigma^2, the noise variance, is not the sigma^2 of 4.3",
    ),
    _equation(
        "3.13",
        "posterior: exponential of minus misfit over noise variance minus coefficients over eigenvalues",
        "reconstruction.known_view.maximum_a_posteriori",
        _LOST_BAR,
    ),
    _equation(
        "3.14",
        "the MAP coefficients minimise misfit plus penalty",
        "reconstruction.known_view.maximum_a_posteriori",
        _LOST_BAR,
    ),
    _equation(
        "3.15",
        "MAP coefficients in closed form: regularised normal equations",
        "reconstruction.known_view.maximum_a_posteriori",
        f"{_LOST_BAR}; {_STACKED}",
    ),
    _equation(
        "3.16",
        "the reconstructed walker joins the observed 2D with the missing dimension from the model",
        "camera.combine",
        "the observed coordinates are kept as they are, not replaced by the model's",
    ),
    _equation(
        "4.1",
        "absolute error of a joint: mean over time of the squared difference in the missing dimension",
        "errors.absolute_error",
        "called an absolute error but a mean square, in mm^2; the original is the motion itself, residual "
        "included",
    ),
    _equation("4.2", "absolute error of a walker: mean over the 15 joints", "errors.walker_error"),
    _equation(
        "4.3",
        "relative error of a joint: absolute error over the variance of the missing dimension",
        "errors.relative_error",
        "sigma^2 is here the variance of the missing dimension, not the noise of 3.12; 'average overall "
        "variance' read as the variance over time of each joint, averaged over the joints",
    ),
    _equation("4.4", "relative error of a walker: mean over the 15 joints", "errors.walker_error"),
    _equation(
        "4.5",
        "view angle and coefficients together minimise the misfit",
        "viewpoint.known_phase.estimate",
        "the norm is printed without its square, which has the same minimiser",
    ),
    _equation(
        "4.6",
        "view angle and coefficients together minimise misfit plus penalty",
        "viewpoint.known_phase.estimate",
        "the appendix searches 0 to 180 degrees, the experiment runs from -90 to 90: the range is an option, "
        "by default the whole circle",
    ),
    _equation(
        "A.1",
        "the MAP objective: misfit over twice the noise variance plus penalty",
        "reconstruction.known_view.maximum_a_posteriori",
        f"{_LOST_BAR}; the square of a vector is its squared norm",
    ),
    _equation(
        "A.2",
        "the MAP objective with its square multiplied out",
        "reconstruction.known_view.maximum_a_posteriori",
        _LOST_BAR,
    ),
    _equation(
        "A.3",
        "the gradient of the MAP objective is zero",
        "reconstruction.known_view.maximum_a_posteriori",
        f"{_LOST_BAR}; {_GRADIENT}",
    ),
    _equation(
        "A.4",
        "the normal equations of MAP",
        "reconstruction.known_view.maximum_a_posteriori",
        f"{_LOST_BAR}; {_GRADIENT}",
    ),
    _equation(
        "A.5",
        "MAP coefficients in closed form, as 3.15",
        "reconstruction.known_view.maximum_a_posteriori",
        f"{_LOST_BAR}; {_STACKED}",
    ),
    _equation(
        "B.1",
        "misfit of each of the 150 observed numbers at a candidate view angle",
        "viewpoint.known_phase.estimate",
        f"announced as solving 3.5 but solves 4.5; {_LOST_BAR}",
    ),
    _equation(
        "B.2",
        "horizontal half of the misfit: cos(alpha) x + sin(alpha) y of average walker and eigenwalkers",
        "camera.horizontal",
        "fixes the sense of the view angle: at +90 degrees the image's horizontal is the walk's direction",
    ),
    _equation(
        "B.3",
        "vertical half of the misfit: z of average walker and eigenwalkers, whatever the view",
        "camera.vertical",
    ),
)

_claim = partial(Claim, paper="zhang2007")

_PEOPLE = "a fact about the recorded people and their laboratory; the eighty recordings are not public"
_OBSERVERS = "needs human observers"
_HALF_KNEE = "half a knee's breadth, 50 mm, is not seen at a glance; a whole one, 100 mm, is"
_LINE_WIDTH = (
    "figure 4 draws a person about 30 mm tall, so its drawn line of 0.35 mm is 20 mm wide on the body: what "
    "is thinner than a line is not obvious"
)
_SHARE = "one decimal is printed, but another population of walkers may differ by 3 points"
_COUNT = {ANY_DATA: "the data at hand hold another number of people"}
_SYNTHETIC_UPPER_BODY = (
    "trunk lean and arm posture of the synthetic people are drawn nearly independently of what a frontal or profile "
    "image shows: there least squares amplifies what little it sees (nine tenths of its frontal error is above the "
    "hips) and MAP stays near the average walker; in profile it is the arms"
)
_FEW_WALKERS = (
    "with few walkers more of a new one lies outside the model, and that asks for a stronger prior: with 32 and 17 "
    "walkers in place of 80 the synthetic optimum moves from 39 to 172 and 450 mm², and the gain of MAP at 70 mm² "
    "from 29 to 16 and 12 % (data.walkers=32 and 17)"
)
_FACING = (
    "the truth is the direction of the path, and people do not face exactly where they go: over the optical walkers "
    "the mean error of the view follows the direction that their shoulders face (correlation -0.75 for MAP)"
)
_OVERGROUND = (
    "people crossing a room speed up and turn a little, on a treadmill they do not, and their clips hold two or three "
    "strides: about 4 % remain after path and heading are taken out"
)
_SWEEP = "a setting of the experiment: equal or not"


def _fact(name: str, quote: str, published: float | None = None, unit: str = "") -> Claim:
    return _claim(
        name=f"zhang2007_{name}",
        section="2",
        quote=quote,
        published=published,
        unit=unit,
        untestable=_PEOPLE,
    )


CLAIMS = (
    _claim(
        name="zhang2007_walkers",
        section="2",
        quote="Eighty participants—32 males and 48 females—served as subjects",
        published=80,
        figure=FIG5,
        reduction="different walkers in table_walkers",
        value=lambda t: measures.distinct(t[WALKERS], "walker"),
        needs=(WALKERS,),
        tolerance=exactly(80),
        reason="a count: equal or not",
        explanation=_COUNT,
    ),
    _fact("males", "32 males and 48 females", 32),
    _fact("females", "32 males and 48 females", 48),
    _fact("youngest", "Their ages ranged from 13 to 59 years", 13, "years"),
    _fact("oldest", "Their ages ranged from 13 to 59 years", 59, "years"),
    _fact("mean_age", "the average age was 26 years", 26, "years"),
    _fact("markers", "a set of 41 retroreflective markers was attached to their bodies", 41),
    _fact("treadmill", "they adjusted the speed of the belt to the rate that felt most comfortable"),
    _fact("cameras", "equipped with nine CCD high-speed cameras", 9),
    _fact("resolution", "a submillimeter spatial resolution"),
    _fact("frame_rate", "a sampling rate of 120 Hz", 120, "Hz"),
    _claim(
        name="zhang2007_joints",
        section="2",
        quote="we computed the location of 15 virtual markers",
        published=15,
        figure=FIG4,
        reduction="different joints in the table",
        value=lambda t: measures.distinct(t[FIG4], "joint"),
        tolerance=exactly(15),
        reason="a count: equal or not",
    ),
    _claim(
        name="zhang2007_residual_below_three_percent",
        section="3.1",
        quote="The power carried by the residual term err is less than 3% of the overall power",
        published=3,
        unit="%",
        figure=FIG2,
        reduction="mean over walkers of residual_fraction, the variance about the time mean as a whole",
        value=lambda t: measures.harmonic_share(t[HARMONICS], "residual_fraction", 1),
        needs=(HARMONICS,),
        tolerance=at_most(3),
        direction=at_most(10),
        reason="the paper's own bound; under a tenth is still small enough to discard",
        explanation={
            "optical": _OVERGROUND,
            "cmu": _OVERGROUND,
        },
    ),
    _claim(
        name="zhang2007_dimensions_3d",
        section="3.1",
        quote="the dimensionality of a 3D Fourier representation at this stage is 45*5 = 225",
        published=225,
        figure=FIG4,
        reduction="joints × 3 × (1 + 2 × harmonics), as the tables name them",
        value=lambda t: measures.representation_length(t[FIG4], t[HARMONICS], 3),
        needs=(FIG4, HARMONICS),
        tolerance=exactly(225),
        reason="a count: equal or not",
    ),
    _claim(
        name="zhang2007_dimensions_2d",
        section="3.2",
        quote="These postures are concatenated into a column vector ŵ with 30*5 = 150 entries",
        published=150,
        figure=FIG4,
        reduction="joints × 2 × (1 + 2 × harmonics), as the tables name them",
        value=lambda t: measures.representation_length(t[FIG4], t[HARMONICS], 2),
        needs=(FIG4, HARMONICS),
        tolerance=exactly(150),
        reason="a count: equal or not",
    ),
    _claim(
        name="zhang2007_fewer_components_than_walkers",
        section="3.1",
        quote="The exact dimensionality N of the model … will generally be much smaller than R",
        figure=FIG2,
        reduction="components needed for 95.5 % of the variance, over the number of walkers",
        value=lambda t: measures.ratio(
            measures.components_needed(t[FIG2], 95.5), measures.distinct(t[HARMONICS], "walker")
        ),
        needs=(FIG2, HARMONICS),
        tolerance=at_most(0.5),
        direction=below(1),
        reason="the paper's own 30 of 80 is 0.375; a half or less is still much smaller",
        explanation={
            "cmu": "with 18 people leave-one-out leaves room for 16 components at most",
        },
    ),
    _claim(
        name="zhang2007_coefficients_beyond_training",
        section="3.2.2",
        quote="the obtained coefficients from least-squares minimization may cause the 3D reconstruction to "
        "be far beyond the range of the training data",
        untestable="the figures' tables hold no coefficients; the effect shows in "
        "zhang2007_map_thirty_percent",
    ),
    _claim(
        name="zhang2007_large_eigenvalues_little_affected",
        section="3.2.2",
        quote="when eigenvalue λ(i) is large, the effect of the variance σ² on the coefficients k(i) … is "
        "less",
        untestable="a property of equation 3.15, true of all data alike",
    ),
    _claim(
        name="zhang2007_one_degree_steps",
        section="4, appendix B",
        quote="in 1 degree steps … comparing the 181 obtained values",
        published=181,
        figure=FIG5,
        reduction="different view angles in the table",
        value=lambda t: measures.distinct(t[FIG5], "view_angle_deg"),
        tolerance=exactly(181),
        reason=_SWEEP,
        explanation={ANY_DATA: "this run used a coarser or narrower grid of views"},
    ),
    _claim(
        name="zhang2007_fundamental_share",
        section="4.1",
        quote="the fundamental frequency accounted for 91.9% of the total variance",
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
        name="zhang2007_second_harmonic_share",
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
        name="zhang2007_two_harmonics_share",
        section="4.1",
        quote="the first two harmonics explained 97.9% of the overall postural variance of a walker",
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
        name="zhang2007_thirty_components",
        section="4.1",
        quote="The first 30 principal components accounted for 95.5% of the variance",
        published=95.5,
        unit="%",
        figure=FIG2,
        reduction="cumulative_fraction at component 30",
        value=lambda t: measures.cumulative_share(t[FIG2], 30),
        tolerance=within(95.5, 3),
        direction=at_least(90),
        reason=_SHARE,
        explanation={
            "optical": "with 33 people, 30 components leave almost nothing over",
            "cmu": "with so few people, 30 components leave almost nothing over",
        },
    ),
    _claim(
        name="zhang2007_variance_range",
        section="4.2",
        quote="for variances … ranging from 1 to 625 mm²",
        published=625,
        unit="mm²",
        figure=FIG3,
        reduction="largest sigma2_mm2 of the table",
        value=lambda t: measures.largest(t[FIG3], "sigma2_mm2"),
        tolerance=exactly(625),
        reason=_SWEEP,
        explanation={ANY_DATA: "this run swept another range"},
    ),
    _claim(
        name="zhang2007_optimal_variance",
        section="4.2",
        quote="The optimal variance for all the walkers was about σ² = 70 mm²",
        published=70,
        unit="mm²",
        figure=FIG3,
        reduction="sigma2_mm2 at the smallest absolute_error_mm2",
        value=lambda t: measures.best_variance(t[FIG3]),
        tolerance=within(70, 35),
        direction=between(1, 625),
        reason="'about', of a flat minimum: half as much again either way; the direction is a minimum inside "
        "the swept range",
        explanation={
            "optical": _FEW_WALKERS,
            "cmu": _FEW_WALKERS,
        },
    ),
    _claim(
        name="zhang2007_optimal_variance_nested",
        section="4.2",
        quote="The optimal variance for all the walkers was about σ² = 70 mm²",
        published=70,
        unit="mm²",
        figure=FIG3,
        reduction="median over walkers of the sigma2_mm2 chosen without that walker",
        value=lambda t: measures.median(t[NESTED], "sigma2_mm2"),
        needs=(NESTED,),
        tolerance=within(70, 35),
        direction=between(1, 625),
        reason="the bounds of the plain optimum: the paper chose σ² on the walkers that it reports, this "
        "does not",
        explanation={
            "optical": _FEW_WALKERS,
            "cmu": _FEW_WALKERS,
        },
    ),
    _claim(
        name="zhang2007_five_postures",
        section="4.2",
        quote="This figure shows five equally spaced postures in one motion cycle",
        published=5,
        figure=FIG4,
        reduction="different instants in the table",
        value=lambda t: measures.distinct(t[FIG4], "instant"),
        tolerance=exactly(5),
        reason="a count: equal or not",
    ),
    _claim(
        name="zhang2007_reconstruction_looks_similar",
        section="4.2",
        quote="The original and the reconstructed walking sequences appear very similar",
        unit="mm",
        figure=FIG4,
        reduction="mean RMS error over all walkers at 0, 30 and 90 degrees, the worse of the two approaches",
        value=lambda t: measures.larger(
            measures.mean(measures.numbers(t[DEMONSTRATIONS], "rms_error_least_squares_mm")),
            measures.mean(measures.numbers(t[DEMONSTRATIONS], "rms_error_map_mm")),
        ),
        needs=(DEMONSTRATIONS,),
        tolerance=at_most(50),
        direction=at_most(100),
        reason=_HALF_KNEE,
    ),
    _claim(
        name="zhang2007_no_difference_to_the_eye",
        section="4.2",
        quote="there are no obvious differences between the two calculation approaches",
        unit="mm",
        figure=FIG4,
        reduction="mean of rms_between_methods_mm over all walkers at 0, 30 and 90 degrees",
        value=lambda t: measures.mean(measures.numbers(t[DEMONSTRATIONS], "rms_between_methods_mm")),
        needs=(DEMONSTRATIONS,),
        tolerance=at_most(20),
        direction=at_most(50),
        reason=_LINE_WIDTH,
    ),
    _claim(
        name="zhang2007_no_difference_beside_the_error",
        section="4.2",
        quote="there are no obvious differences between the two calculation approaches",
        figure=FIG4,
        reduction="mean rms_between_methods_mm over the mean RMS error of the two approaches",
        value=lambda t: measures.ratio(
            measures.mean(measures.numbers(t[DEMONSTRATIONS], "rms_between_methods_mm")),
            0.5 * measures.mean(measures.numbers(t[DEMONSTRATIONS], "rms_error_least_squares_mm"))
            + 0.5 * measures.mean(measures.numbers(t[DEMONSTRATIONS], "rms_error_map_mm")),
        ),
        needs=(DEMONSTRATIONS,),
        tolerance=at_most(0.5),
        direction=at_most(1.0),
        reason="two curves at most half as far from each other as from the truth look alike beside it",
        explanation={
            "synthetic": _SYNTHETIC_UPPER_BODY,
        },
    ),
    _claim(
        name="zhang2007_demonstrations",
        section="4.2",
        quote="The same results were inspected visually in all 240 demonstrations",
        published=240,
        figure=FIG4,
        reduction="different pairs of walker and view angle in table_demonstrations",
        value=lambda t: measures.distinct(t[DEMONSTRATIONS], "walker", "view_angle_deg"),
        needs=(DEMONSTRATIONS,),
        tolerance=exactly(240),
        reason="a count, 80 walkers in three views: equal or not",
        explanation=_COUNT,
    ),
    _claim(
        name="zhang2007_no_difference_in_any_demonstration",
        section="4.2",
        quote="in all 240 demonstrations; no obvious differences could be seen",
        unit="mm",
        figure=FIG4,
        reduction="largest rms_between_methods_mm of all walkers and views",
        value=lambda t: measures.largest(t[DEMONSTRATIONS], "rms_between_methods_mm"),
        needs=(DEMONSTRATIONS,),
        tolerance=at_most(20),
        direction=at_most(50),
        reason=_LINE_WIDTH,
        explanation={
            "synthetic": _SYNTHETIC_UPPER_BODY,
            "optical": "the mean over all demonstrations is 11 mm; this is the worst of 99, and four more exceed 17 mm",
        },
    ),
    _claim(
        name="zhang2007_map_thirty_percent",
        section="4.2",
        quote="the error of 3D motion reconstruction is about 30% smaller than the error by approach I",
        published=30,
        unit="%",
        figure=FIG5,
        reduction="1 − mean absolute_error_mm2 over the views of MAP, over that of least squares",
        value=lambda t: measures.map_gain(t[FIG5], "absolute_error_mm2"),
        tolerance=within(30, 10),
        direction=between(0, 100),
        reason="'about', read off curves, of another population: ten points either way",
        explanation={
            "cmu": _FEW_WALKERS,
        },
    ),
    _claim(
        name="zhang2007_map_thirty_percent_relative",
        section="4.2",
        quote="the error of 3D motion reconstruction is about 30% smaller than the error by approach I",
        published=30,
        unit="%",
        figure=FIG5,
        reduction="1 − mean relative_error over the views of MAP, over that of least squares",
        value=lambda t: measures.map_gain(t[FIG5], "relative_error"),
        tolerance=within(30, 10),
        direction=between(0, 100),
        reason="'about', read off curves, of another population: ten points either way",
        explanation={
            "synthetic": _SYNTHETIC_UPPER_BODY,
            "cmu": _FEW_WALKERS,
        },
    ),
    _claim(
        name="zhang2007_map_thirty_percent_nested",
        section="4.2",
        quote="the error of 3D motion reconstruction is about 30% smaller than the error by approach I",
        published=30,
        unit="%",
        figure=FIG3,
        reduction="1 − mean absolute_error_mm2 over walkers with σ² chosen without each, over that of least "
        "squares",
        value=lambda t: measures.reduction_percent(
            measures.mean(measures.numbers(t[NESTED], "absolute_error_mm2")),
            measures.mean(measures.of_method(t[WALKERS], "absolute_error_mm2", LEAST_SQUARES)),
        ),
        needs=(NESTED, WALKERS),
        tolerance=within(30, 10),
        direction=between(0, 100),
        reason="the bounds of the plain gain: here no walker has a say in the σ² used on it",
        explanation={
            "cmu": _FEW_WALKERS,
        },
    ),
    _claim(
        name="zhang2007_map_better_at_every_view",
        section="4.2",
        quote="It is obvious that when prior probability is involved in the calculation, the error … is … "
        "smaller",
        unit="%",
        figure=FIG5,
        reduction="views at which MAP's absolute_error_mm2 is below that of least squares",
        value=lambda t: measures.views_won_by_map(t[FIG5], "absolute_error_mm2"),
        tolerance=at_least(99),
        direction=above(50),
        reason="obvious: the two curves do not cross, but for one view or two in a hundred and eighty-one",
    ),
    _claim(
        name="zhang2007_asymmetric_errors",
        section="4.2",
        quote="there are different absolute reconstruction errors in the negative and positive oblique "
        "viewpoints, which implies that human walking is slightly asymmetric",
        unit="%",
        figure=FIG5,
        reduction="mean |E(−α) − E(α)| over the mean of E, 0 < α < 90, the larger of the two approaches",
        value=lambda t: measures.larger(
            *(measures.asymmetry_percent(t[FIG5], "absolute_error_mm2", method) for method in BOTH)
        ),
        tolerance=between(1, 25),
        direction=at_least(1),
        reason="under 1 % no one sees it in a curve; up to a quarter is slight",
    ),
    _claim(
        name="zhang2007_variances_nearly_symmetric",
        section="4.2",
        quote="The very small asymmetry of variances in Figure 5c",
        unit="%",
        figure=FIG5,
        reduction="mean |V(−α) − V(α)| over the mean of V, 0 < α < 90, of missing_variance_mm2",
        value=lambda t: measures.asymmetry_percent(t[FIG5], "missing_variance_mm2", LEAST_SQUARES),
        tolerance=between(0, 5),
        direction=between(0, 15),
        reason="very small but there: over none and under a twentieth",
    ),
    _claim(
        name="zhang2007_profile_relative_error_large",
        section="4.2",
        quote="frontal … viewpoints produces small relative reconstruction errors, while … the profile view "
        "generates large relative reconstruction errors",
        figure=FIG5,
        reduction="relative_error in profile over that in frontal views, the smaller of the two approaches",
        value=lambda t: measures.smaller(
            *(
                measures.band_ratio(t[FIG5], "relative_error", method, PROFILE_DEG, FRONTAL_DEG)
                for method in BOTH
            )
        ),
        tolerance=at_least(3),
        direction=above(1),
        reason="small against large is threefold at least",
    ),
    _claim(
        name="zhang2007_oblique_relative_error_small",
        section="4.2",
        quote="reconstruction based on frontal and oblique viewpoints produces small relative reconstruction "
        "errors",
        figure=FIG5,
        reduction="relative_error in profile over that in oblique views, the smaller of the two approaches",
        value=lambda t: measures.smaller(
            *(
                measures.band_ratio(t[FIG5], "relative_error", method, PROFILE_DEG, OBLIQUE_DEG)
                for method in BOTH
            )
        ),
        tolerance=at_least(3),
        direction=above(1),
        reason="small against large is threefold at least",
    ),
    _claim(
        name="zhang2007_profile_variance_small",
        section="4.2",
        quote="the overall variance that needs to be recovered from the profile view is relatively small",
        figure=FIG5,
        reduction="missing_variance_mm2 in profile over that in frontal views",
        value=lambda t: measures.band_ratio(
            t[FIG5], "missing_variance_mm2", LEAST_SQUARES, PROFILE_DEG, FRONTAL_DEG
        ),
        tolerance=at_most(1 / 3),
        direction=below(1),
        reason="relatively small is a third at most",
    ),
    _claim(
        name="zhang2007_profile_absolute_error_reasonable",
        section="4.2",
        quote="a reasonable absolute reconstruction error becomes a large relative error",
        figure=FIG5,
        reduction="absolute_error_mm2 in profile over its mean over all views, the larger of the approaches",
        value=lambda t: measures.larger(
            *(measures.profile_to_all(t[FIG5], "absolute_error_mm2", method) for method in BOTH)
        ),
        tolerance=at_most(1),
        direction=at_most(1.5),
        reason="reasonable: no worse than over all views",
        explanation={
            "synthetic": _SYNTHETIC_UPPER_BODY,
        },
    ),
    _claim(
        name="zhang2007_fits_human_performance",
        section="4.2",
        quote="The poor reconstruction in profile views and the good reconstruction in frontal views fit "
        "with data on human performance",
        untestable=_OBSERVERS,
    ),
    _claim(
        name="zhang2007_view_angle_mean",
        section="4.3",
        quote="we can precisely obtain the view angles from motion sequences with unknown viewpoints",
        unit="°",
        figure=FIG6,
        reduction="mean over views of |estimated_mean_deg − view_angle_deg|, the worse of the two approaches",
        value=lambda t: measures.larger(*(measures.angle_bias_deg(t[FIG6], method) for method in BOTH)),
        tolerance=at_most(2),
        direction=at_most(10),
        reason="precisely: the mean curve stays within two steps of the one-degree grid of views",
    ),
    _claim(
        name="zhang2007_view_angle_spread",
        section="4.3",
        quote="we can precisely obtain the view angles from motion sequences with unknown viewpoints",
        unit="°",
        figure=FIG6,
        reduction="mean over views of estimated_sd_deg, the worse of the two approaches",
        value=lambda t: measures.larger(
            *(measures.mean_of_method(t[FIG6], "estimated_sd_deg", method) for method in BOTH)
        ),
        tolerance=at_most(5),
        direction=at_most(15),
        reason="precisely: one walker in three is more than 5° off at most; 15° still tells views apart",
    ),
    _claim(
        name="zhang2007_view_angle_failures",
        section="4.3",
        quote="we can precisely obtain the view angles from motion sequences with unknown viewpoints",
        unit="%",
        figure=FIG6,
        reduction="failures (more than 30° off) over views × walkers, the worse of the two approaches",
        value=lambda t: measures.larger(
            *(
                measures.failures_percent(t[FIG6], method, measures.distinct(t[WALKERS], "walker"))
                for method in BOTH
            )
        ),
        needs=(FIG6, WALKERS),
        tolerance=at_most(1),
        direction=at_most(10),
        reason="precisely allows one gross error in a hundred; one in ten leaves most views found",
    ),
    _claim(
        name="zhang2007_bayes_no_advantage_for_the_view",
        section="4.3",
        quote="Here, Bayesian inference does not provide an advantage",
        unit="°",
        figure=FIG6,
        reduction="mean over views of absolute_angle_error_median_deg, least squares minus MAP",
        value=lambda t: (
            measures.mean_of_method(t[FIG6], "absolute_angle_error_median_deg", LEAST_SQUARES)
            - measures.mean_of_method(t[FIG6], "absolute_angle_error_median_deg", MAP)
        ),
        tolerance=at_most(0.5),
        direction=at_most(1),
        reason="half a step of the one-degree grid that approach II searches is no advantage",
    ),
    _claim(
        name="zhang2007_bayes_no_smaller_spread_of_the_view",
        section="4.3",
        quote="Here, Bayesian inference does not provide an advantage",
        unit="°",
        figure=FIG6,
        reduction="mean over views of estimated_sd_deg, least squares minus MAP",
        value=lambda t: (
            measures.mean_of_method(t[FIG6], "estimated_sd_deg", LEAST_SQUARES)
            - measures.mean_of_method(t[FIG6], "estimated_sd_deg", MAP)
        ),
        tolerance=at_most(0.5),
        direction=at_most(1),
        reason="half a step of the one-degree grid that approach II searches is no advantage",
        explanation={
            "synthetic": _SYNTHETIC_UPPER_BODY,
        },
    ),
    _claim(
        name="zhang2007_less_storage",
        section="5",
        quote="it also reduces computational expenditure and storage requirements",
        untestable="the paper gives no figure and the tables hold neither",
    ),
    _claim(
        name="zhang2007_reasonable_reconstruction",
        section="5",
        quote="the proposed method could reasonably reconstruct 3D human walking data from 2D motion "
        "sequences",
        unit="mm",
        figure=FIG5,
        reduction="mean over views of rms_error_mm, the worse of the two approaches",
        value=lambda t: measures.larger(
            *(measures.mean_of_method(t[FIG5], "rms_error_mm", method) for method in BOTH)
        ),
        tolerance=at_most(50),
        direction=at_most(100),
        reason=_HALF_KNEE,
    ),
    _claim(
        name="zhang2007_map_better_for_most_walkers",
        section="5",
        quote="By applying Bayes' rule to 3D motion reconstruction, we got better performance in "
        "reconstruction",
        unit="%",
        figure=FIG5,
        reduction="walkers whose absolute_error_mm2 by MAP is below that by least squares",
        value=lambda t: measures.walkers_won_by_map(t[WALKERS], "absolute_error_mm2"),
        needs=(WALKERS,),
        tolerance=at_least(75),
        direction=above(50),
        reason="a better method is better for three people in four, not on the average alone",
    ),
    _claim(
        name="zhang2007_view_angle_high_accuracy",
        section="5",
        quote="horizontal viewing angle, was recovered effortlessly and with high accuracy",
        unit="°",
        figure=FIG6,
        reduction="mean over views of absolute_angle_error_median_deg, the worse of the two approaches",
        value=lambda t: measures.larger(
            *(measures.mean_of_method(t[FIG6], "absolute_angle_error_median_deg", method) for method in BOTH)
        ),
        tolerance=at_most(2),
        direction=at_most(10),
        reason="high accuracy: half of the walkers within two steps of the one-degree grid of views",
        explanation={
            "optical": _FACING,
            "cmu": _FACING,
        },
    ),
)

PAPER = Paper(
    key="zhang2007",
    title="3D Periodic Human Motion Reconstruction from 2D Motion Sequences",
    authors="Zonghua Zhang, Nikolaus F. Troje",
    year=2007,
    venue="Neural Computation 19(5)",
    figures=(FIG2, FIG3, FIG4, FIG5, FIG6),
    equations=EQUATIONS,
    claims=CLAIMS,
)
