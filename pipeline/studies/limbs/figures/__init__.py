"""studies.limbs.figures."""
