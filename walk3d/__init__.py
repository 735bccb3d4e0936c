"""Extensions of `pipeline`: 3D walks from the film of one camera, error bars, point-light displays and motion export.

anatomy/      the anatomical prior, with error bars; its studies and claims
film/         a film or keypoints of one camera to a walk in 3D; detectors' formats; its studies and claims
pointlight/   walks as moving dots, for experiments
export/       motion as C3D, TRC, BVH, CSV and NPZ
page/         scripts for the page of all figures, and the page of one walk
api           functions of the library
plugin        additions of this package to `pipeline`
"""

from __future__ import annotations

TYPE_CHECKING = False  # `typing` is slow to import
if TYPE_CHECKING:
    from typing import Any

    from walk3d import pointlight
    from walk3d.api import angles, calibrate, from_view, reconstruct, walkers, write

__all__ = ["angles", "calibrate", "from_view", "pointlight", "reconstruct", "walkers", "write"]


def __getattr__(name: str) -> Any:
    """Import a function of `walk3d.api`, or the package `pointlight`, when it is first used, and return it."""
    import importlib

    if name == "pointlight":
        return importlib.import_module("walk3d.pointlight")
    if name in __all__:
        return getattr(importlib.import_module("walk3d.api"), name)
    raise AttributeError(f"module 'walk3d' has no attribute {name!r}")
