"""The action model: a mean performance and the spread at each of its postures: mozerov2006 section 4."""

from pipeline.core.action_model.bounds import (
    BOUND,
    FLOOR_SHARE,
    ActionModel,
    acceptance_left_out,
    accepted,
    learn,
    sample,
)

__all__ = ["BOUND", "FLOOR_SHARE", "ActionModel", "acceptance_left_out", "accepted", "learn", "sample"]
