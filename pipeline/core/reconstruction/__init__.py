"""3D from one known view: zhang2007 section 3.2 and appendix A, zhang2004 section 3.2."""

from pipeline.core.reconstruction.known_view import (
    KnownViews,
    check_noise_variance,
    from_known_views,
    least_squares,
    less_average,
    maximum_a_posteriori,
    right_hand_side,
)

__all__ = [
    "KnownViews",
    "check_noise_variance",
    "from_known_views",
    "least_squares",
    "less_average",
    "maximum_a_posteriori",
    "right_hand_side",
]
