"""park2011 as data: its 18 equations and its claims; the rooms that compute them are not built yet."""

from __future__ import annotations

from pipeline.papers_ledger import Claim, Equation, Paper

FIG3A, FIG3B, FIG3C, FIG3D = (f"park2011_fig3{panel}" for panel in "abcd")
FIG4 = "park2011_fig4"


def _equation(number: str, words: str, note: str = "") -> Equation:
    return Equation("park2011", number, words, note=note)


EQUATIONS = (
    _equation("1", "a trajectory is three series of F coordinates"),
    _equation(
        "2",
        "a smooth trajectory is a trajectory basis times K coefficients for each coordinate",
        "the basis must be orthonormal for 12, which is not said: orthonormal DCT-II; K was chosen by hand",
    ),
    _equation("3", "an articulated trajectory keeps its distance from the parent trajectory"),
    _equation(
        "4",
        "the relative trajectory in spherical coordinates: basis times coefficients for both angles, "
        "constant radius",
        "the angles are continuous only up to (theta, phi) ~ (-theta, phi + pi) and whole turns, and the "
        "pole is fixed at z: continuity by dynamic programming, pole turned away from the path",
    ),
    _equation(
        "5",
        "all relative trajectories together minimise the reprojection errors",
        "the distance is printed unsquared: its square is summed",
    ),
    _equation(
        "6",
        "forward kinematics: a trajectory from the root and its parents' relative trajectories",
        "the arguments end at j - 1, so a trajectory would not depend on its own relative trajectory: the "
        "sum runs up to its own",
    ),
    _equation(
        "7",
        "reprojection: the first two rows of the camera over the third",
        "a negative depth projects as well: a point behind the camera is refused",
    ),
    _equation(
        "8",
        "the two candidate points, where the ray meets the sphere",
        "a candidate behind the camera decides for the other; if both are, the frame is dropped",
    ),
    _equation(
        "9",
        "distances of the candidates along the ray, by the quadratic formula",
        "a negative discriminant, the ray missing the sphere, is mentioned only in section 5: the nearest "
        "point of the ray, or a larger radius, as an option",
    ),
    _equation("10", "a binary variable chooses one of two relative directions in a frame"),
    _equation(
        "11",
        "all relative directions as a linear function of the binary variables",
        "E and F are new matrices although F already counts frames and E is block diagonal with 3-vectors, "
        "not diagonal",
    ),
    _equation(
        "12",
        "the binary variables minimise the part outside the trajectory basis",
        "applies to each coordinate in turn, and only with an orthonormal basis; the matrix is called "
        "positive definite but is numerically singular, exactly so once a ray is tangent: strict "
        "definiteness is not used",
    ),
    _equation(
        "13",
        "reconstructibility: null-space part of the impostor over that of the truth",
        "printed for one angle between camera and parent, for which it tends to 1 and predicts nothing: by "
        "default of the vectors that 12 uses, the angle as an option; needs the truth",
    ),
    _equation(
        "14",
        "the estimated angle in a frame is the true one or the impostor",
        "b = 1 means the impostor here and the first candidate in 10",
    ),
    _equation("15", "the same for the whole angular trajectory, with a diagonal matrix of choices"),
    _equation("16", "the best coefficients and choices minimise the distance to the chosen angles"),
    _equation("17", "the same with truth and impostor written out"),
    _equation(
        "18",
        "the same with each split into its parts inside and outside the basis",
        "that the choices tend to zero is argued for the limit only; in between 13 is a guide, not a bound",
    ),
)

_MATHEMATICS = "a theorem or a known result of complexity, true of all data alike"


def _claim(
    name: str, section: str, figure: str, quote: str, published: float | None = None, unit: str = ""
) -> Claim:
    return Claim(
        name=f"park2011_{name}",
        paper="park2011",
        section=section,
        quote=quote,
        published=published,
        unit=unit,
        figure=figure,
    )


def _fact(
    name: str, section: str, quote: str, why: str, published: float | None = None, unit: str = ""
) -> Claim:
    return Claim(
        name=f"park2011_{name}",
        paper="park2011",
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
    _fact(
        "np_hard",
        "3.2",
        "A binary quadratic programming problem is NP-hard in general",
        _MATHEMATICS,
    ),
    _claim(
        "smooth_and_length_preserved",
        "1",
        FIG4,
        "The results are smooth, length preserved 3D trajectories",
    ),
    _claim(
        "imputed_points_articulated",
        "2",
        FIG3D,
        "all imputed points between frames satisfy the articulation constraint while the Cartesian "
        "representation does not",
    ),
    _claim(
        "direct_optimisation_falls_into_local_minimum",
        "3.2",
        FIG3A,
        "direct optimization falls into a local minimum",
    ),
    _claim(
        "quadratic_matrix_positive_definite",
        "3.2",
        FIG3A,
        "Since our quadratic matrix is positive definite, the objective function behaves convexly",
    ),
    _claim(
        "accurate_initialisation",
        "3.2",
        FIG3A,
        "This yields an accurate initialization which can be refined by nonlinear optimization",
    ),
    _claim(
        "possible_with_moving_parent",
        "4",
        FIG3A,
        "if the parent trajectory is independent of the camera trajectory, the trajectory reconstruction is "
        "still possible",
    ),
    _claim(
        "possible_with_stationary_camera",
        "4",
        FIG3A,
        "Even when camera and parent motions are stationary, the reconstruction is possible",
    ),
    _claim(
        "high_reconstructibility_low_error",
        "4",
        FIG3A,
        "When η_a is high (≫ 1), 3D reconstruction error of an articulated trajectory is low",
        1,
    ),
    _claim(
        "low_reconstructibility_impostor",
        "4",
        FIG3A,
        "when η_a is low (≪ 1), our solution converges to the impostor trajectory",
        1,
    ),
    _claim(
        "humaneva_mean_error",
        "5.1",
        FIG4,
        "Our method results in 128.8mm of 3D mean error with 17.75mm standard deviation",
        128.8,
        "mm",
    ),
    _claim(
        "humaneva_error_spread",
        "5.1",
        FIG4,
        "Our method results in 128.8mm of 3D mean error with 17.75mm standard deviation",
        17.75,
        "mm",
    ),
    _fact(
        "best_of_the_others",
        "5.1",
        "comparable to the error of the state-of-art pose estimation algorithms (82mm~211.4mm)",
        "a result of other authors' methods, which are not part of this project",
        82,
        "mm",
    ),
    _fact(
        "worst_of_the_others",
        "5.1",
        "comparable to the error of the state-of-art pose estimation algorithms (82mm~211.4mm)",
        "a result of other authors' methods, which are not part of this project",
        211.4,
        "mm",
    ),
    _claim(
        "parent_error_is_a_lower_bound",
        "5.1",
        FIG3B,
        "The error in the parent trajectory is a lower bound on the reconstruction error",
    ),
    _claim(
        "small_root_error_reliable",
        "5.1",
        FIG3B,
        "the variance of the distribution for small root trajectory error (< 0.2) is low",
        0.2,
    ),
    _claim(
        "large_root_error_unreliable",
        "5.1",
        FIG3B,
        "the reconstruction from high root trajectory error (> 0.3) causes high error in the child "
        "trajectory",
        0.3,
    ),
    _claim(
        "small_radius_reliable",
        "5.1",
        FIG3C,
        "Even though the initial scale is small (i.e., 10⁻² ∼ 10⁰), the 3D reconstruction can be done "
        "reliably",
        0.01,
    ),
    _claim(
        "large_radius_unreliable",
        "5.1",
        FIG3C,
        "When the initial scale is high (> 10¹), however, the reconstruction becomes unreliable",
        10,
    ),
    _claim(
        "error_with_missing_data",
        "5.1",
        FIG3D,
        "Our algorithm produces an average error of 13% for 5% missing data",
        13,
        "%",
    ),
    _claim(
        "missing_points_imputed",
        "5.1",
        FIG3D,
        "our spatial and temporal constraints enable us to impute missing points",
    ),
    _claim(
        "stationary_and_moving_camera",
        "7",
        FIG4,
        "we are able to reconstruct highly articulated human motions from a stationary camera and a moving "
        "camera",
    ),
    _claim(
        "no_activity_specific_prior",
        "5.1",
        FIG4,
        "our approach uses only activity independent geometric constraints",
    ),
)

PAPER = Paper(
    key="park2011",
    title="3D Reconstruction of a Smooth Articulated Trajectory from a Monocular Image Sequence",
    authors="Hyun Soo Park, Yaser Sheikh",
    year=2011,
    venue="ICCV",
    figures=(FIG3A, FIG3B, FIG3C, FIG3D, FIG4),
    equations=EQUATIONS,
    claims=CLAIMS,
)
