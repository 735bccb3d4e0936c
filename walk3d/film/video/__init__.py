"""2D keypoints of all people in a video, from two networks that are downloaded once, and the skeleton overlay.

OpenCV and LiteRT (``pip install ".[video]"``) are imported only where pictures are processed.
"""
