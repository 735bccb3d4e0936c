"""Reconstruction of one person's 3D walk, with error bars, from 2D keypoints."""
