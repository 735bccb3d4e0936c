"""Point-light walkers: joints of a walk as dots on a dark background, with optional manipulations and noise.

A display is made in steps.  Each step is a pure function of `PointLights`; random steps take a generator:

>>> import numpy as np
>>> from walk3d import pointlight
>>> coefficients, stride_hz = pointlight.synthetic_walker()
>>> lights = pointlight.walker(coefficients, stride_hz, view_angle_rad=np.pi / 2, frame_rate_hz=60.0)
>>> lights = pointlight.inverted(pointlight.scrambled(lights, np.random.default_rng(1)))
>>> pointlight.as_svg(lights)[:4]
'<svg'

The package itself is the function `of_motion`: ``walk3d.pointlight(read("walk.c3d"))`` shows a recording.
"""

import sys
from types import ModuleType

from walk3d.pointlight.dots import of_motion, synthetic_walker, walker, walking_speed
from walk3d.pointlight.files import PointLights, as_csv, as_ptd, as_svg, pixels
from walk3d.pointlight.manipulations import (
    Noise,
    inverted,
    limited_lifetime,
    mirrored,
    phase_scrambled,
    scrambled,
    with_noise,
)

__all__ = [
    "Noise",
    "PointLights",
    "as_csv",
    "as_ptd",
    "as_svg",
    "inverted",
    "limited_lifetime",
    "mirrored",
    "of_motion",
    "phase_scrambled",
    "pixels",
    "scrambled",
    "synthetic_walker",
    "walker",
    "walking_speed",
    "with_noise",
]


class _Function(ModuleType):
    """Module that can be called like the function `of_motion`."""

    __call__ = staticmethod(of_motion)


sys.modules[__name__].__class__ = _Function
