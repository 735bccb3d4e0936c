"""Choices that both experiments on walks share: the approaches, and where phase and frequency come from."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from pipeline.validation import InvalidInput, require_range


class Method(StrEnum):
    """The papers' two approaches."""

    least_squares = "least_squares"
    map = "map"

    def noise_variance(self, sigma2_mm2: float) -> float | None:
        """Return sigma² for approach II, nothing for approach I, which has none."""
        return sigma2_mm2 if self is Method.map else None


class PhaseSource(StrEnum):
    """Where frequency and phase of a walk come from."""

    motion3d = "motion3d"
    """The 3D motion before projection, as in the papers."""
    observed2d = "observed2d"
    """Each view alone: what a 2D input allows."""


def validate_methods(methods: Sequence[Method], noise_variance_mm2: float) -> None:
    """Validate the methods of a sweep.  Raises InvalidInput if there are none, or one stands twice."""
    if not methods or len(set(methods)) < len(methods):
        raise InvalidInput(
            "must be " + " or ".join(Method) + ", or both",
            where="sweep.methods",
            received=", ".join(methods) or "none",
        )
    require_range("sweep.noise_variance_mm2", noise_variance_mm2, above=0, unit="mm²")
