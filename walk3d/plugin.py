"""Additions of this package to `pipeline`."""

from __future__ import annotations

from pathlib import Path

from pipeline.plugins import Plugin

PLUGIN = Plugin(
    conf=Path(__file__).parent / "conf",
    methods="walk3d.anatomy.method:METHODS",
    studies="walk3d.studies:STUDIES",
    commands={
        "reconstruct": "walk3d.film.command:reconstruct",
        "model": "walk3d.film.training_command:train_model",
        "export": "walk3d.export.command:export_motion",
        "pointlight": "walk3d.pointlight.command:point_lights",
    },
)
