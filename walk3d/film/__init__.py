"""Reconstruction of 3D walks from films and keypoints of one camera."""
