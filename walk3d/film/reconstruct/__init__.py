"""Reconstruction of a 3D walk with error bars from one person's 2D keypoints."""
