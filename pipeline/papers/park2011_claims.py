"""The claims of park2011: its numbers and sentences, and what decides whether our figures reproduce them.

What "low", "high", "reliable" and "found" mean is said once, in `pipeline.papers_measures_limbs`.
"""

from __future__ import annotations

from functools import partial

from pipeline.papers import measures
from pipeline.papers import measures_limbs as limbs
from pipeline.papers.claims import ANY_DATA, Claim, Interval, above, at_least, at_most, below
from pipeline.papers.measures_limbs import BLOCK, FAR, PROGRAMME, RANDOM, SHAKY, STILL

FIG3A, FIG3B, FIG3C, FIG3D = (f"park2011_fig3{panel}" for panel in "abcd")
FIG4 = "park2011_fig4"
CORRELATION = f"{FIG3A}/table_correlation"
REFINEMENT = f"{FIG3A}/table_refinement"
MATRICES = f"{FIG3A}/table_matrices"
ROOT_ERRORS, RADII = f"{FIG3B}/table_cameras", f"{FIG3C}/table_cameras"
CLIPS = f"{FIG4}/table_clips"

_claim = partial(Claim, paper="park2011")

_MATHEMATICS = "a theorem or a known result of complexity, true of all data alike"
_OTHERS = "a result of other authors' methods, which are not part of this project"
_HUMANEVA = (
    "HumanEva-II is not part of this project's data; the nearest that is measured is walking from one still camera, "
    "with the pelvis given, in park2011_fig4's table_clips: 123 mm with 54 mm of standard deviation on data=cmu (one "
    "clip; 63 mm with the better mirror of every limb), see park2011_comparable_to_pose_estimation"
)
_COIN = "a coin decides between a limb and its mirror half of the time"
_MIRRORS_TAKEN = {
    "synthetic": "limbs are taken for their mirrors: with the better mirror of every limb it is 58 mm before the still "
    "camera and 51 mm before the others",
    ANY_DATA: "limbs are taken for their mirrors, and what hangs on them goes along: with the better mirror of every "
    "limb it is 85 mm before the still camera and 86 mm before the others (cmu)",
}
_SPREAD_OF_MIRRORS = (
    "at small errors of the root the spread is that of limbs and their mirrors: most are nearly exact, and those that "
    "are taken for their mirrors are wrong by up to two radii"
)
_TRUE_RADIUS = (
    "reliable: the median limb is at most a tenth of its length farther off than with the true radius, whatever the "
    "camera makes of that"
)
_IMPUTED = (
    "as near to the truth as points that were seen, or a quarter farther; twice as far is still of their size"
)


def _fact(
    name: str, section: str, quote: str, why: str, published: float | None = None, unit: str = ""
) -> Claim:
    return _claim(
        name=f"park2011_{name}",
        section=section,
        quote=quote,
        published=published,
        unit=unit,
        untestable=why,
    )


CLAIMS = (
    _fact(
        "two_to_the_f_trajectories",
        "1",
        "for a 2D trajectory of F frames, there are 2^F 3D trajectories that remain at fixed distance",
        _MATHEMATICS,
    ),
    _fact("np_hard", "3.2", "A binary quadratic programming problem is NP-hard in general", _MATHEMATICS),
    _claim(
        name="park2011_length_preserved",
        section="1",
        quote="The results are smooth, length preserved 3D trajectories",
        figure=FIG4,
        reduction="largest length_change_max of table_clips",
        value=lambda t: measures.largest(t[CLIPS], "length_change_max"),
        needs=(CLIPS,),
        tolerance=at_most(1e-6),
        direction=at_most(0.01),
        reason="kept by construction, so but for rounding; a hundredth is not seen",
    ),
    _claim(
        name="park2011_smooth",
        section="1",
        quote="The results are smooth, length preserved 3D trajectories",
        figure=FIG4,
        reduction="mean acceleration_ratio of table_clips: root mean square acceleration over that of the truth",
        value=lambda t: measures.mean(measures.numbers(t[CLIPS], "acceleration_ratio")),
        needs=(CLIPS,),
        tolerance=at_most(1),
        direction=at_most(2),
        reason="smooth: no rougher than the motion that it shows; twice as rough is still a motion without jumps, "
        "while a single wrong sign accelerates ten times as much",
        explanation={
            "synthetic": "bodies of smooth angles move in 5 cosines where the basis has 20, and a pixel of noise fills "
            "the rest: 4.2 times the truth's acceleration, where bends have 1.0 and walks 1.1 times",
            ANY_DATA: "a pixel of noise at 4 m, through 20 cosines, is about as rough as people's motion: 1.0 times "
            "the truth's acceleration, from 0.4 to 2.8 between clips (cmu)",
        },
    ),
    _claim(
        name="park2011_imputed_points_articulated",
        section="2",
        quote="all imputed points between frames satisfy the articulation constraint while the Cartesian "
        "representation does not",
        figure=FIG3D,
        reduction="largest length_violation of the table: at and between frames",
        value=lambda t: measures.largest(t[FIG3D], "length_violation"),
        tolerance=at_most(1e-6),
        reason="satisfied or not, but for rounding",
    ),
    _claim(
        name="park2011_cartesian_points_not_articulated",
        section="2",
        quote="all imputed points between frames satisfy the articulation constraint while the Cartesian "
        "representation does not",
        figure=FIG3D,
        reduction="mean cartesian_length_violation of the table: coordinates in the same basis",
        value=lambda t: measures.mean(measures.numbers(t[FIG3D], "cartesian_length_violation")),
        tolerance=at_least(0.01),
        direction=above(1e-6),
        reason="a hundredth of a limb's length is the least that matters: 4 mm of a thigh",
    ),
    _claim(
        name="park2011_direct_optimisation_falls_into_local_minimum",
        section="3.2",
        quote="direct optimization falls into a local minimum",
        figure=FIG3A,
        reduction="limb_error_median of table_refinement, from the better of the two other starts over from the "
        "programme's",
        value=lambda t: limbs.direct_to_programme(t[REFINEMENT]),
        needs=(REFINEMENT,),
        tolerance=at_least(2),
        direction=above(1),
        reason="another minimum than the programme's start leads to if it is at least twice as far from the truth",
        explanation={
            "synthetic": "limbs of smooth angles turn about one direction and are found from it as well, 37 % of them "
            "where the programme finds 50 % and random signs 13 %: the other half are its mirrors, as far from the "
            "truth",
        },
    ),
    _claim(
        name="park2011_quadratic_matrix_positive_definite",
        section="3.2",
        quote="Since our quadratic matrix is positive definite, the objective function behaves convexly",
        unit="%",
        figure=FIG3A,
        reduction="1 - mean numerically_singular_share of table_matrices",
        value=lambda t: (
            100.0 * (1.0 - measures.mean(measures.numbers(t[MATRICES], "numerically_singular_share")))
        ),
        needs=(MATRICES,),
        tolerance=at_least(99),
        reason="a property of every programme's matrix: one in a hundred may be an exception",
        explanation={
            ANY_DATA: "it is a sum of three matrices that lose K dimensions each, and where half chords change as "
            "smoothly as the basis what is left of them is rounding: the smallest eigenvalue is under 1e-8 of the "
            "largest in four programmes of five. Semidefinite is enough for a convex bound, and ours asks for no more",
        },
    ),
    _claim(
        name="park2011_tight_bound",
        section="3.2",
        quote="enables us to define a tight lower bound of the rectangle in polynomial time",
        unit="%",
        figure=FIG3A,
        reduction="mean proved of the table",
        value=lambda t: 100.0 * measures.mean(measures.numbers(t[FIG3A], "proved")),
        tolerance=at_least(90),
        direction=above(50),
        reason="bounds are tight if with them the search comes to an end in nine limbs of ten, of 100 frames each",
    ),
    _claim(
        name="park2011_accurate_initialisation",
        section="3.2",
        quote="This yields an accurate initialization which can be refined by nonlinear optimization",
        figure=FIG3A,
        reduction="median limb_error of the table's trials of reconstructibility above 1",
        value=lambda t: limbs.median_error_above(t[FIG3A], 1.0),
        tolerance=at_most(0.1),
        direction=at_most(0.3),
        reason="where the paper expects accuracy, the median limb is within a tenth of its length of the truth; "
        "within three tenths it is still on the right side of the parent",
    ),
    _claim(
        name="park2011_initialisation_can_be_refined",
        section="3.2",
        quote="This yields an accurate initialization which can be refined by nonlinear optimization",
        unit="%",
        figure=FIG3A,
        reduction="mean converged_share of table_refinement, from the programme's start",
        value=lambda t: 100.0 * measures.mean(limbs.where(t[REFINEMENT], "converged_share", start=PROGRAMME)),
        needs=(REFINEMENT,),
        tolerance=at_least(90),
        direction=above(50),
        reason="it can be refined if the optimisation comes to an end in nine trials of ten",
    ),
    _claim(
        name="park2011_possible_with_moving_parent",
        section="4",
        quote="if the parent trajectory is independent of the camera trajectory, the trajectory reconstruction is "
        "still possible",
        unit="%",
        figure=FIG3A,
        reduction="trials of the still camera, whose parents move, with limb_error under 0.1",
        value=lambda t: limbs.percent_found(limbs.where(t[FIG3A], "limb_error", camera=STILL)),
        tolerance=at_least(90),
        direction=above(50),
        reason=f"possible if it succeeds nine times of ten; {_COIN}, so more than half is a direction",
        explanation={
            ANY_DATA: "the parent moves, but before a still camera at 4 m a limb and its mirror are about as smooth, "
            "and which of them costs less is the toss of a coin: up to the mirror 86 % are found (cmu: 82 %), and "
            "before a camera that shakes 84 % without that (cmu: 81 %)",
        },
    ),
    _claim(
        name="park2011_possible_with_stationary_camera",
        section="4",
        quote="Even when camera and parent motions are stationary, the reconstruction is possible if γ_X ∈ Θ because "
        "each α is a nonlinear function of γ_X",
        unit="%",
        figure=FIG3A,
        reduction="trials of the still camera whose reconstructibility is above 1",
        value=lambda t: limbs.percent_above(t[FIG3A], "reconstructibility", 1.0, camera=STILL),
        tolerance=at_least(90),
        direction=above(50),
        reason="possible if the impostor lies farther outside the basis than the truth, which the paper derives for "
        f"every still camera at a finite distance; {_COIN}",
        explanation={
            ANY_DATA: "true, but by too little: at 4 m perspective is slight, reconstructibility is within 5 % of one "
            "for 77 % of the limbs (cmu: 67 %), and what truth itself has outside the basis decides on which side",
        },
    ),
    _claim(
        name="park2011_accuracy_is_high_above_one",
        section="4, figure 3",
        quote="The accuracy of the reconstruction is high when η_a is greater than 1",
        published=1,
        figure=FIG3A,
        reduction="the reconstructibility that divides limb_error under 0.1 from the rest, fewest on the wrong side",
        value=lambda t: limbs.dividing_reconstructibility(t[FIG3A]),
        tolerance=Interval(0.8, 1.25),
        direction=Interval(0.5, 2),
        reason="a quarter more, or as much less, is still one; twice as much is of its order",
    ),
    _claim(
        name="park2011_high_reconstructibility_low_error",
        section="4",
        quote="When η_a is high (≫ 1), 3D reconstruction error of an articulated trajectory is low",
        figure=FIG3A,
        reduction="median limb_error of the table's trials of reconstructibility above 2",
        value=lambda t: limbs.median_error_above(t[FIG3A], FAR),
        tolerance=at_most(0.1),
        direction=at_most(0.3),
        reason="low: within a tenth of the limb's length; what holds above twice the threshold holds far above it",
    ),
    _claim(
        name="park2011_low_reconstructibility_impostor",
        section="4",
        quote="when η_a is low (≪ 1), our solution converges to the impostor trajectory",
        unit="%",
        figure=FIG3A,
        reduction="mean taken_impostor of the table's trials of reconstructibility under 1/2",
        value=lambda t: limbs.impostors_percent_below(t[FIG3A], 1.0 / FAR),
        tolerance=at_least(90),
        direction=above(50),
        reason=f"it converges to the impostor if nine trials of ten do; {_COIN}; what holds under half the threshold "
        "holds far below it",
        explanation={
            ANY_DATA: "so low that one or two limbs of three hundred are, if any; see "
            "park2011_impostor_where_it_is_spanned_better",
        },
    ),
    _claim(
        name="park2011_impostor_where_it_is_spanned_better",
        section="4",
        quote="our solution converges to the impostor trajectory because the trajectory basis spans the impostor "
        "trajectory better",
        unit="%",
        figure=FIG3A,
        reduction="mean taken_impostor of the table's trials of reconstructibility under 1",
        value=lambda t: limbs.impostors_percent_below(t[FIG3A], 1.0),
        tolerance=at_least(90),
        direction=above(50),
        reason=f"the paper's own reason holds from 1 downwards; {_COIN}",
        explanation={
            ANY_DATA: "from 0.95 to 1 both are spanned as well and either is taken; below 0.95 the impostor is taken "
            "by 15 of 16 limbs (cmu: 35 of 39)",
        },
    ),
    _claim(
        name="park2011_reconstructibility_characterises_accuracy",
        section="7",
        quote="we propose a measure of reconstructibility of an articulated trajectory, which characterizes the "
        "reconstruction accuracy",
        figure=FIG3A,
        reduction="spearman_vector of table_correlation, all cameras: of the vectors that the programme uses",
        value=lambda t: measures.mean(limbs.where(t[CORRELATION], "spearman_vector", camera="all")),
        needs=(CORRELATION,),
        tolerance=at_most(-0.5),
        direction=below(0),
        reason="it characterises if a better measured limb is nearly always the more accurate one: more than half of "
        "what a perfect order would have",
    ),
    _claim(
        name="park2011_reconstructibility_as_printed",
        section="4, equation 13",
        quote="We define a measure of reconstructibility of an articulated trajectory, η_a, as a criterion to "
        "characterize reconstruction accuracy",
        figure=FIG3A,
        reduction="spearman_angle of table_correlation, all cameras: of the angle at the parent, as printed",
        value=lambda t: measures.mean(limbs.where(t[CORRELATION], "spearman_angle", camera="all")),
        needs=(CORRELATION,),
        tolerance=at_most(-0.5),
        direction=below(0),
        reason="the same bounds as for the reading by vectors",
        explanation={
            ANY_DATA: "far from the camera the impostor's angle is pi less the true one, so that both have the same "
            "part outside of any basis and their ratio says nothing",
        },
    ),
    _fact(
        "humaneva_mean_error",
        "5.1",
        "Our method results in 128.8mm of 3D mean error with 17.75mm standard deviation",
        _HUMANEVA,
        128.8,
        "mm",
    ),
    _fact(
        "humaneva_error_spread",
        "5.1",
        "Our method results in 128.8mm of 3D mean error with 17.75mm standard deviation",
        _HUMANEVA,
        17.75,
        "mm",
    ),
    _claim(
        name="park2011_comparable_to_pose_estimation",
        section="5.1",
        quote="This error is comparable to the error of the state-of-art pose estimation algorithms (82mm~211.4mm)",
        published=211.4,
        unit="mm",
        figure=FIG4,
        reduction="mean error_mm of table_clips, walking before the still camera",
        value=lambda t: limbs.of_walking(t[CLIPS], "error_mm", STILL),
        needs=(CLIPS,),
        tolerance=at_most(211.4),
        reason="comparable is whatever is no worse than the worst that the paper counts as such; other people, "
        "another camera, and joints relative to a pelvis that is given",
    ),
    _fact(
        "best_of_the_others",
        "5.1",
        "comparable to the error of the state-of-art pose estimation algorithms (82mm~211.4mm)",
        _OTHERS,
        82,
        "mm",
    ),
    _fact(
        "worst_of_the_others",
        "5.1",
        "comparable to the error of the state-of-art pose estimation algorithms (82mm~211.4mm)",
        _OTHERS,
        211.4,
        "mm",
    ),
    _claim(
        name="park2011_parent_error_is_a_lower_bound",
        section="5.1",
        quote="The error in the parent trajectory is a lower bound on the reconstruction error",
        unit="%",
        figure=FIG3B,
        reduction="trials with a root error whose child_error_ratio is at least their parent_error_ratio",
        value=lambda t: limbs.above_parent_percent(t[FIG3B]),
        tolerance=at_least(95),
        direction=above(50),
        reason="a bound holds without exception; one trial in twenty is left to the mean over frames of what goes up "
        "and down",
        explanation={
            ANY_DATA: "the child stays on the ray of its own image, whatever its parent: its error is in depth alone, "
            "where the parent's has all three directions, and the more the parent is wrong the less is handed on",
        },
    ),
    _claim(
        name="park2011_small_root_error_low_spread",
        section="5.1",
        quote="the variance of the distribution for small root trajectory error (< 0.2) is low",
        figure=FIG3B,
        reduction="child_error_sd of table_cameras, still camera: mean over root errors under 0.2, relative to mean "
        "over those above 0.3",
        value=lambda t: limbs.spread_small_to_large(t[ROOT_ERRORS], STILL),
        needs=(ROOT_ERRORS,),
        tolerance=at_most(0.5),
        direction=below(1),
        reason="low against what it is for errors that the paper calls high: half of it or less",
        explanation={ANY_DATA: _SPREAD_OF_MIRRORS},
    ),
    _claim(
        name="park2011_small_root_error_low_spread_from_a_shaky_camera",
        section="5.1",
        quote="the variance of the distribution for small root trajectory error (< 0.2) is low",
        figure=FIG3B,
        reduction="the same with the shaky camera",
        value=lambda t: limbs.spread_small_to_large(t[ROOT_ERRORS], SHAKY),
        needs=(ROOT_ERRORS,),
        tolerance=at_most(0.5),
        direction=below(1),
        reason="the same bounds before a camera from which a limb is not taken for its mirror",
        explanation={
            ANY_DATA: f"{_SPREAD_OF_MIRRORS}; before the shaky camera these are 16 % (cmu: 19 %)",
        },
    ),
    _claim(
        name="park2011_small_root_error_reliable",
        section="5.1",
        quote="for small root trajectory error (< 0.2) is low, i.e., the reconstruction can be done reliably",
        published=0.2,
        figure=FIG3B,
        reduction="largest root_error_ratio up to which child_error_median of table_cameras is at most 0.3, still "
        "camera",
        value=lambda t: limbs.reliable_root_error(t[ROOT_ERRORS], STILL),
        needs=(ROOT_ERRORS,),
        tolerance=at_least(0.15),
        direction=above(0),
        reason="reliable: the error stays under 0.3 radii, where the paper's high errors begin; 0.15 is the last root "
        "error under 0.2 that is tried",
        explanation={
            ANY_DATA: "a median over limbs of which nearly as many are taken for their mirrors as not",
        },
    ),
    _claim(
        name="park2011_small_root_error_reliable_from_a_shaky_camera",
        section="5.1",
        quote="for small root trajectory error (< 0.2) is low, i.e., the reconstruction can be done reliably",
        published=0.2,
        figure=FIG3B,
        reduction="the same with the shaky camera",
        value=lambda t: limbs.reliable_root_error(t[ROOT_ERRORS], SHAKY),
        needs=(ROOT_ERRORS,),
        tolerance=at_least(0.15),
        direction=above(0),
        reason="the same bounds before a camera from which a limb is not taken for its mirror",
    ),
    _claim(
        name="park2011_large_root_error_unreliable",
        section="5.1",
        quote="the reconstruction from high root trajectory error (> 0.3) causes high error in the child "
        "trajectory",
        published=0.3,
        figure=FIG3B,
        reduction="smallest root_error_ratio at which child_error_median of table_cameras is over 0.3, shaky camera",
        value=lambda t: limbs.unreliable_root_error(t[ROOT_ERRORS], SHAKY),
        needs=(ROOT_ERRORS,),
        tolerance=Interval(0.15, 0.4),
        direction=at_most(0.4),
        reason="high from 0.4, the first root error above 0.3 that is tried, if not before, but not below 0.2, where "
        "the paper finds it reliable; a camera from which a limb is not taken for its mirror, else it is high anyway",
    ),
    _claim(
        name="park2011_small_radius_reliable",
        section="5.1",
        quote="Even though the initial scale is small (i.e., 10⁻² ∼ 10⁰), the 3D reconstruction can be done "
        "reliably",
        published=0.01,
        figure=FIG3C,
        reduction="smallest radius_scale from which up to 1 limb_error_median of table_cameras is at most 0.1 over "
        "what it is at 1; still camera, radius adjusted in all frames",
        value=lambda t: limbs.least_reliable_scale(t[RADII], STILL),
        needs=(RADII,),
        tolerance=at_most(0.01),
        direction=at_most(0.1),
        reason=_TRUE_RADIUS,
        explanation={
            ANY_DATA: "the farthest ray asks for a radius a little shorter than the limb, and that is enough for a "
            "still camera to take more mirrors: at every small scale the median error is 0.25, and 0.07 up to the "
            "mirror; with the true radius 0.14 and 0.00 (cmu)",
        },
    ),
    _claim(
        name="park2011_small_radius_reliable_from_a_shaky_camera",
        section="5.1",
        quote="Even though the initial scale is small (i.e., 10⁻² ∼ 10⁰), the 3D reconstruction can be done "
        "reliably",
        published=0.01,
        figure=FIG3C,
        reduction="the same with the shaky camera",
        value=lambda t: limbs.least_reliable_scale(t[RADII], SHAKY),
        needs=(RADII,),
        tolerance=at_most(0.01),
        direction=at_most(0.1),
        reason=_TRUE_RADIUS,
    ),
    _claim(
        name="park2011_large_radius_unreliable",
        section="5.1",
        quote="When the initial scale is high (> 10¹), however, the reconstruction becomes unreliable",
        published=10,
        figure=FIG3C,
        reduction="largest radius_scale whose limb_error_median of table_cameras is at most 0.1 over that at 1; still "
        "camera, radius adjusted in all frames",
        value=lambda t: limbs.largest_reliable_scale(t[RADII], STILL),
        needs=(RADII,),
        tolerance=Interval(1, 10),
        reason="the paper finds scales up to 1 reliable and those above 10 not, and says nothing of those between",
    ),
    _claim(
        name="park2011_error_with_missing_data",
        section="5.1",
        quote="Our algorithm produces an average error of 13% for 5% missing data",
        published=13,
        unit="%",
        figure=FIG3D,
        reduction="mean relative_error of the table at missing_fraction 0.05, random",
        value=lambda t: 100.0 * measures.mean(limbs.at_missing(t[FIG3D], "relative_error", 0.05, RANDOM)),
        tolerance=Interval(6.5, 19.5),
        direction=at_most(26),
        reason="half to one and a half times as much, in direction up to twice: the sizes of the artificial errors are "
        "not printed, and the measure divides by the distance of the joints from an origin that is not named either",
        explanation={
            ANY_DATA: "the camera stands still, so that limbs are taken for their mirrors whether points are missing "
            "or not: as much without any missing, and 10 % with the better mirror of every limb (cmu: 9 %), see "
            "park2011_error_with_missing_data_up_to_mirror; joints are about a metre from our origin",
        },
    ),
    _claim(
        name="park2011_error_with_missing_data_up_to_mirror",
        section="5.1",
        quote="Our algorithm produces an average error of 13% for 5% missing data",
        published=13,
        unit="%",
        figure=FIG3D,
        reduction="the same with relative_error_up_to_mirror: of every limb and its mirror the one nearer to the truth",
        value=lambda t: (
            100.0 * measures.mean(limbs.at_missing(t[FIG3D], "relative_error_up_to_mirror", 0.05, RANDOM))
        ),
        tolerance=Interval(6.5, 19.5),
        direction=at_most(26),
        reason="the same bounds where the choice between a limb and its mirror is not what is judged",
    ),
    _claim(
        name="park2011_missing_points_imputed",
        section="5.1",
        quote="our spatial and temporal constraints enable us to impute missing points",
        figure=FIG3D,
        reduction="mean imputed_error_mm over mean seen_error_mm, trials with points missing at random",
        value=lambda t: limbs.imputed_to_seen(t[FIG3D], RANDOM),
        tolerance=at_most(1.25),
        direction=at_most(2),
        reason=_IMPUTED,
    ),
    _claim(
        name="park2011_occluded_points_imputed",
        section="5.1",
        quote="for the evaluation of missing data caused by occlusion or measurement failure",
        figure=FIG3D,
        reduction="mean imputed_error_mm over mean seen_error_mm, trials with points missing in blocks",
        value=lambda t: limbs.imputed_to_seen(t[FIG3D], BLOCK),
        tolerance=at_most(1.25),
        direction=at_most(2),
        reason=_IMPUTED,
    ),
    _claim(
        name="park2011_stationary_and_moving_camera",
        section="7",
        quote="we are able to reconstruct highly articulated human motions from a stationary camera and a moving "
        "camera",
        unit="mm",
        figure=FIG4,
        reduction="larger of the means of error_mm of table_clips, still camera and moving camera",
        value=lambda t: limbs.worst_camera(t[CLIPS], "error_mm"),
        needs=(CLIPS,),
        tolerance=at_most(128.8 + 17.75),
        direction=at_most(211.4),
        reason="able to as well as on HumanEva, 128.8 mm and one standard deviation; the worst that the paper calls "
        "comparable is 211.4 mm",
        explanation=_MIRRORS_TAKEN,
    ),
    _fact(
        "no_activity_specific_prior",
        "5.1",
        "our approach uses only activity independent geometric constraints",
        "a property of the method, which is given no example of any activity; knees and elbows that flex one way, "
        "which we add, are not the paper's and know of no activity either",
    ),
)
