"""Additions of this package to `pipeline`."""

from __future__ import annotations

from pipeline.plugins import Plugin

PLUGIN = Plugin(methods="walk3d.anatomy.method:METHODS")
