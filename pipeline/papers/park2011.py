"""park2011 as data: its 18 equations and its claims."""

from __future__ import annotations

from pipeline.papers.claims import TEST_OF as _TEST_OF
from pipeline.papers.claims import Equation, Paper
from pipeline.papers.park2011_claims import CLAIMS, FIG3A, FIG3B, FIG3C, FIG3D, FIG4


def _equation(number: str, words: str, home: str, note: str = "") -> Equation:
    module = _TEST_OF.get(home.rpartition(".")[0], home.split(".")[0])
    return Equation("park2011", number, words, f"pipeline.core.{home}", f"tests/core/test_{module}.py", note)


EQUATIONS = (
    _equation(
        "1",
        "a trajectory is three series of F coordinates",
        "limb_chain.chain.relative_trajectories",
    ),
    _equation(
        "2",
        "a smooth trajectory is a trajectory basis times K coefficients for each coordinate",
        "trajectory_basis.cosine_basis",
        "the basis must be orthonormal for 12, which is not said: orthonormal DCT-II; K was chosen by hand",
    ),
    _equation(
        "3",
        "an articulated trajectory keeps its distance from the parent trajectory",
        "limb_chain.chain.relative_trajectories",
    ),
    _equation(
        "4",
        "the relative trajectory in spherical coordinates: basis times coefficients for both angles, constant "
        "radius",
        "refinement.spherical.to_directions",
        "the angles are continuous only up to (theta, phi) ~ (-theta, phi + pi) and whole turns, and the pole "
        "is fixed at z: continuity by dynamic programming, pole turned away from the path",
    ),
    _equation(
        "5",
        "all relative trajectories together minimise the reprojection errors",
        "refinement.steps.refine",
        "the distance is printed unsquared: its square is summed",
    ),
    _equation(
        "6",
        "forward kinematics: a trajectory from the root and its parents' relative trajectories",
        "limb_chain.chain.forward",
        "the arguments end at j - 1, so a trajectory would not depend on its own relative trajectory: the sum "
        "runs up to its own",
    ),
    _equation(
        "7",
        "reprojection: the first two rows of the camera over the third",
        "pinhole.project_by_matrix",
        "a negative depth projects as well: a point behind the camera is refused",
    ),
    _equation(
        "8",
        "the two candidate points, where the ray meets the sphere",
        "articulation.hits.ray_sphere",
        "a candidate behind the camera decides for the other; if both are, the frame is dropped",
    ),
    _equation(
        "9",
        "distances of the candidates along the ray, by the quadratic formula",
        "articulation.hits.ray_sphere",
        "a negative discriminant, the ray missing the sphere, is mentioned only in section 5: the nearest "
        "point of the ray, or a larger radius, as an option",
    ),
    _equation(
        "10",
        "a binary variable chooses one of two relative directions in a frame",
        "binary_quadratic.solve.minimise",
    ),
    _equation(
        "11",
        "all relative directions as a linear function of the binary variables",
        "binary_quadratic.solve.minimise",
        "E and F are new matrices although F already counts frames and E is block diagonal with 3-vectors, "
        "not diagonal",
    ),
    _equation(
        "12",
        "the binary variables minimise the part outside the trajectory basis",
        "binary_quadratic.solve.minimise",
        "applies to each coordinate in turn, and only with an orthonormal basis; the matrix is called "
        "positive definite but is numerically singular, exactly so once a ray is tangent: strict definiteness "
        "is not used",
    ),
    _equation(
        "13",
        "reconstructibility: null-space part of the impostor over that of the truth",
        "reconstructibility.reconstructibility",
        "printed for one angle between camera and parent, for which it tends to 1 and predicts nothing: by "
        "default of the vectors that 12 uses, the angle as an option; needs the truth",
    ),
    _equation(
        "14",
        "the estimated angle in a frame is the true one or the impostor",
        "reconstructibility.estimated",
        "b = 1 means the impostor here and the first candidate in 10",
    ),
    _equation(
        "15",
        "the same for the whole angular trajectory, with a diagonal matrix of choices",
        "reconstructibility.estimated",
    ),
    _equation(
        "16",
        "the best coefficients and choices minimise the distance to the chosen angles",
        "reconstructibility.choice_residual",
    ),
    _equation(
        "17",
        "the same with truth and impostor written out",
        "reconstructibility.choice_residual",
    ),
    _equation(
        "18",
        "the same with each split into its parts inside and outside the basis",
        "reconstructibility.choice_residual",
        "that the choices tend to zero is argued for the limit only; in between 13 is a guide, not a bound",
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
    beyond=("park2011_proofs", "park2011_mirrors", "park2011_face_off"),
)
