"""Joints, parents, mirror pairs and the world frame; source points to joints.

Conventions
-----------
World: right-handed, z up, the walk along +y, +x to the walker's right.  Lengths in millimetres.
Axis order of every array of positions: ``(frame, joint, space)``.

A *source mapping* (``conf/skeleton/*.yaml``) gives the weighted source points of each joint, and the axis of the
file that points up.  Names of points match without case, separators and prefixes, with the side at either end:
``LANK``, ``anna:l_ank``, ``Ank.L`` and ``LeftAnk`` are the same point.
"""

from pipeline.skeleton.joints import POSTURE12, WALKER15, LimbTree, Skeleton
from pipeline.skeleton.mapped_joints import LOWER_BODY, map_joints, up_axis, with_z_up
from pipeline.skeleton.recorded import MILLIMETRES, MotionCapture
from pipeline.skeleton.source_mapping import Lowering, Rule, SourceMapping, UpAxis
from pipeline.skeleton.source_points import SourcePoints, plain_name

__all__ = [
    "LOWER_BODY",
    "MILLIMETRES",
    "POSTURE12",
    "WALKER15",
    "LimbTree",
    "Lowering",
    "MotionCapture",
    "Rule",
    "Skeleton",
    "SourceMapping",
    "SourcePoints",
    "UpAxis",
    "map_joints",
    "plain_name",
    "up_axis",
    "with_z_up",
]
