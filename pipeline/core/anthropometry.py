"""Published body sizes, from which the synthetic walkers are drawn.

The grades of support (*published*, *read*, *assumed*), the tick ✓ and the legend are those of
`walkers.normative_gait`, which holds what these bodies do.

Sources
-------
zhang2007 section 2 (ages); Gordon et al. 1989 (US Army survey: stature, biacromial breadth); Kuczmarski
et al. 2002 (growth charts); Drillis & Contini 1966, as in Winter 2009 figure 4.1 (segment lengths);
Bell et al. 1990 and Seidel et al. 1995 (hip joint centres); Winter 1991 (foot); Knutson 2005 (leg length
inequality).
"""

from __future__ import annotations

AGE_RANGE_YEARS = (13.0, 59.0)
AGE_BETA = (1.7, 4.3)
"""Range of ages, and parameters of the beta distribution of ages in this range.

The ages are 13–59 with mean 26 ✓ [zhang2007 section 2]; the mean of the distribution is 13 + 46 · 1.7/6. The
shape is assumed.
"""

STATURE_MM = {True: (1755.8, 66.8), False: (1629.4, 63.6)}
"""Mean and standard deviation of the stature of men (True) and women (False), mm.

Published: Gordon et al. 1989 (men ✓).
"""

GROWTH_AGE_YEARS = (13.0, 14.0, 15.0, 16.0, 17.0, 18.0)
GROWTH = {
    True: (0.886, 0.930, 0.964, 0.985, 0.995, 1.0),
    False: (0.964, 0.984, 0.993, 0.997, 1.0, 1.0),
}
"""Median stature at each age, relative to the adult median.

Read: Kuczmarski et al. 2002 (growth charts).
"""

SEGMENTS = {"thigh": 0.245, "shank": 0.246, "ankle_height": 0.039, "upper_arm": 0.186, "forearm": 0.146}
"""Lengths of segments relative to stature.  Published: Drillis & Contini 1966."""

TRUNK, NECK_AND_HEAD, SHOULDER_DROP = 0.295, 0.105, 0.015
"""Vertical distances relative to stature H: hips to sternum, sternum to head centre, shoulder centres to sternum.

The virtual sternum is midway between C7 and the notch, at 0.825 H.  The centre of the head is at 0.93 H.  Read:
Drillis & Contini 1966 heights (hip 0.530, shoulder 0.818, chin 0.870).
"""

LEG_SHARE_CV, TRUNK_SHARE_CV, ARM_SHARE_CV, SEGMENT_CV, HEAD_CV = 0.025, 0.02, 0.025, 0.012, 0.05
"""Coefficients of variation of five body proportions among people of equal stature.

They are for the leg, the trunk, the arm, one segment relative to its neighbour, and the head.  Assumed from Gordon
et al. 1989 (crotch height, sleeve: residual SD 2–3 %).
"""

BIACROMIAL_MM = {True: (397.0, 18.0), False: (362.6, 17.4)}
BIACROMIAL_TO_SHOULDER_CENTRES = 0.90
"""Mean and SD of biacromial breadth, mm, and the ratio of the distance between shoulder centres to this breadth.

The breadth is published: Gordon et al. 1989.  The shoulder centres are assumed 18 mm inside each acromion.
"""

HIP_CENTRES_MM = {True: (172.0, 9.0), False: (172.0, 9.0)}
"""Mean and SD of the distance between the hip joint centres, mm, equal for men and women.

Read: Bell et al. 1990; Seidel et al. 1995.
"""

BREADTH_STATURE_CORRELATION = 0.4
"""Correlation of hip and shoulder breadth with stature.

Read: Gordon et al. 1989 (0.3–0.5).
"""

LEG_INEQUALITY_SD_MM = 5.0
"""Standard deviation of the difference in length between the right and the left leg of a person, mm.

Order of magnitude published: Knutson 2005 (mean magnitude 5.2 mm).
"""

FOOT_HEEL, FOOT_BALL = 0.026, 0.073
"""Horizontal distance of the heel behind the ankle, and of the ball ahead of the ankle, relative to stature.

Read: Winter 1991; Drillis & Contini 1966 (foot length 0.152).
"""
