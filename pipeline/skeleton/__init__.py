"""Joints with parents and mirror pairs, the world's axes, and mappings from source points to joints.

Conventions
-----------
The world frame is right-handed, z up, with the walk along +y and +x to the walker's right.  Lengths are in millimetres.
The axes of every array of positions are ``(frame, joint, space)``.

A *source mapping* (``conf/skeleton/*.yaml``) gives the weighted source points of each joint, and the axis of the
file that points up.  Case, separators and prefixes in point names are ignored, and the side may be at either end:
``LANK``, ``anna:l_ank``, ``Ank.L`` and ``LeftAnk`` are the same point.
"""

from pipeline.skeleton.joints import ANKLES, LEFT_LEG, PELVIS, POSTURE12, RIGHT_LEG, WALKER15, Skeleton

__all__ = ["ANKLES", "LEFT_LEG", "PELVIS", "POSTURE12", "RIGHT_LEG", "WALKER15", "Skeleton"]
