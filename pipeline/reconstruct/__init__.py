"""One person's 2D keypoints in, a 3D walk with error bars out.

The package may be called: ``pipeline.reconstruct("walk.json", frame_rate_hz=30)`` is what
``python -m pipeline reconstruct input.path=walk.json input.frame_rate_hz=30`` does, without writing files.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.reconstruct.clip import Walk


class CallablePackage(ModuleType):
    """The package, which is also the function that it is about."""

    def __call__(
        self, path: str | Path, *, model_folder: str | Path | None = None, **known: Any
    ) -> tuple[Walk, dict[str, Any]]:
        """Reconstruct a video, or a file or folder of keypoints.

        Parameters
        ----------
        path : str or Path
        model_folder : str or Path, optional
            Of a model of one's own, by ``make model``; the one that comes with the package if not given.
        **known
            What is known of the video: the fields of `pipeline.reconstruct.clip.Input`, as ``frame_rate_hz=30``.

        Returns
        -------
        walk : Walk
        summary : dict
            Verdict, view angle, cadence, joint angles, as in ``summary.json``.

        Raises
        ------
        InvalidInput
            If the input cannot be used.
        """
        from pipeline.reconstruct.clip import Input, reconstruct_clip
        from pipeline.reconstruct.model_file import SHIPPED
        from pipeline.reconstruct.summary import summarise
        from pipeline.reconstruct.video import with_keypoints

        given = Input(path=str(path), **known)
        with with_keypoints(given) as keypoints:
            walk = reconstruct_clip(keypoints, Path(model_folder) if model_folder else SHIPPED)
        return walk, summarise(walk)


sys.modules[__name__].__class__ = CallablePackage
