"""Commands, configuration, methods, studies and page scripts that `walk3d` adds to the package `pipeline`."""

from __future__ import annotations

from pathlib import Path

from pipeline.plugins import Page, Plugin

_FOLDER = Path(__file__).parent

PLUGIN = Plugin(
    conf=_FOLDER / "conf",
    methods="walk3d.methods:METHODS",
    studies="walk3d.studies:STUDIES",
    commands={
        "reconstruct": "walk3d.film.command:reconstruct",
        "model": "walk3d.film.training_command:train_model",
        "export": "walk3d.export.command:export_motion",
        "pointlight": "walk3d.pointlight.command:point_lights",
    },
    page=Page(
        scripts=[_FOLDER / "page" / name for name in ("anatomy.js", "joint_angles.js", "yours.js")],
        columns={"zhang2007_joint_angles": {"table.csv": ("method", "angle", "view_angle_deg", "rmse_deg")}},
    ),
)
