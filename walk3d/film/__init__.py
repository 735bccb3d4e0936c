"""Films and keypoints of one camera to walks in 3D."""
