"""Names of MediaPipe Pose's landmarks, which its files may leave out."""

_FACE = (
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer",
    "left_ear", "right_ear", "mouth_left", "mouth_right",
)  # fmt: skip
_BODY = (
    "shoulder", "elbow", "wrist", "pinky", "index", "thumb", "hip", "knee", "ankle", "heel", "foot_index",
)  # fmt: skip
MEDIAPIPE = (*_FACE, *(f"{side}_{part}" for part in _BODY for side in ("left", "right")))
"""The 33 landmarks in order."""
