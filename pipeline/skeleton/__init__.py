"""Joints, parents, mirror pairs and the world frame; source points to joints.

Conventions
-----------
World: right-handed, z up, the walk along +y, +x to the walker's right.  Lengths in millimetres.
Axis order of every array of positions: ``(frame, joint, space)``.

A *source mapping* (``conf/skeleton/*.yaml``) gives the weighted source points of each joint, and the axis of the
file that points up.  Names of points match without case, separators and prefixes, with the side at either end:
``LANK``, ``anna:l_ank``, ``Ank.L`` and ``LeftAnk`` are the same point.
"""

from pipeline.skeleton.joints import ANKLES, LEFT_LEG, PELVIS, POSTURE12, RIGHT_LEG, WALKER15, Skeleton

__all__ = ["ANKLES", "LEFT_LEG", "PELVIS", "POSTURE12", "RIGHT_LEG", "WALKER15", "Skeleton"]
