"""One person's 2D keypoints in, a 3D walk with error bars out."""
