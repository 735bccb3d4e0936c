"""2D keypoints of all people in a video, by two networks that are fetched once, and the skeleton over the video.

OpenCV and LiteRT (``pip install ".[video]"``) are imported only where pictures are processed.
"""
