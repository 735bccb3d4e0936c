"""studies.limbs."""
