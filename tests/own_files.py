"""Recordings of synthetic people as files with the pipeline's own joints, and tables that list such files."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from pipeline.skeleton import WALKER15
from pipeline.skeleton.source_mapping import SourceMapping

OWN_JOINTS = SourceMapping(name="walker15", up="z", joints={j: {j: 1.0} for j in WALKER15.joints})
"""Mapping for files whose points are the pipeline's own joints."""


def write_table(path: Path, contents: Mapping[str, bytes]) -> Path:
    """Write a table of sources that lists the given files as walks or skeletons, each file with its own subject."""
    rows = ["path,source,subject,trial,action,frame_rate_hz,skeleton,bytes,sha256,address,origin"]
    for name, content in contents.items():
        action = "skeleton" if name.endswith(".asf") else "walk"
        sha256 = hashlib.sha256(content).hexdigest()
        rows.append(f"{name},here,{Path(name).stem},{name},{action},60,walker15,{len(content)},{sha256},,")
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path
