"""A walk as a low-order Fourier series: zhang2007 section 3.1 (zhang2004 section 3.1).

`represent` fits the series to a clip and takes its phase out, `synthesise` gives the motion back.

Symbols
-------
``p(t)``      posture at time t, (T, J, 3) mm
``p0``        average posture
``p_h, q_h``  characteristic postures of harmonic h: p_h multiplies the sine, q_h the cosine
``omega``     fundamental angular frequency, rad/s; ``omega = 2 pi frequency_hz``
"""

from pipeline.core.fourier.frequency import (
    SEARCH_HZ,
    cycle_basis,
    cycle_slope,
    design,
    equal_phases,
    fundamental_frequency,
    single_frequency_power,
    waves,
)
from pipeline.core.fourier.series import FourierRepresentation, mirrored, represent, shift, synthesise

__all__ = [
    "SEARCH_HZ",
    "FourierRepresentation",
    "cycle_basis",
    "cycle_slope",
    "design",
    "equal_phases",
    "fundamental_frequency",
    "mirrored",
    "represent",
    "shift",
    "single_frequency_power",
    "synthesise",
    "waves",
]
