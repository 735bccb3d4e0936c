"""Film in: 2D keypoints of everybody in a video, by two networks that are fetched once; and the skeleton over it.

OpenCV and LiteRT are needed (``pip install ".[video]"``) where pictures are touched, and imported there alone.
"""
