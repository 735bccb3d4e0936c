"""Small published folders for tests, written without computing a figure, and pages opened in a browser."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from pipeline.chart_json import to_json
from pipeline.charts import Axis, Chart
from pipeline.core.camera_paths import around
from pipeline.palette import Style
from pipeline.storage import tables
from pipeline.storage.sealed_folders import write_manifest
from pipeline.storage.store import packed

CLAIM = {
    "claim": ["zhang2007_map_thirty_percent"],
    "paper": ["zhang2007"],
    "section": ["4.2"],
    "figure": ["zhang2007_fig5"],
    "quote": ['about <b>30</b>% smaller & "less"'],
    "published": [30.0],
    "value": [28.7792742],
    "value_low": [22.5],
    "value_high": [35.0],
    "unit": ["%"],
    "agreement": ["agrees"],
    "beyond_baseline": ["yes"],
    "why": ["bounds 20 to 40"],
}


def view_errors() -> dict[str, Any]:
    """Return a table in the form of zhang2007_fig5."""
    return {
        "method": ["least_squares", "least_squares", "map", "map"],
        "view_angle_deg": [0, 30, 0, 30],
        "absolute_error_mm2": [500.0, 400.0, 300.0, 250.5],
        "absolute_error_sd_mm2": [50.0, 40.0, 30.0, 25.0],
        "relative_error": [1.0, 0.5, 0.25, 0.125],
    }


VIEW_CHARTS = [
    Chart(
        x="view_angle_deg",
        abscissa=Axis(label="view angle", unit="°"),
        y=y, by="method", label=label, zero=True, band=band,
        styles={"least_squares": Style("least squares", "least_squares"), "map": Style("MAP", "map")},
    )
    for y, band, label in (
        ("absolute_error_mm2", "absolute_error_sd_mm2", "mean square error"),
        ("relative_error", "", "relative error"),
        ("missing_variance_mm2", "", "missing variance"),
    )
]  # fmt: skip
"""Charts in the form of zhang2007_fig5."""


def plant(
    folder: Path,
    *,
    table: Mapping[str, Any] | None = None,
    arrays: Mapping[str, np.ndarray] | None = None,
    claims: Mapping[str, Any] | None = None,
    configuration: Mapping[str, Any] | None = None,
    more: Mapping[str, Mapping[str, Any]] | None = None,
    scale: str = "smoke",
    lock_sha256: str = "absent",
    recording: bytes = b"",
    inputs: Mapping[str, str] | None = None,
) -> Path:
    """Write the folder of a published figure with the given tables, arrays and claims, and return its path."""
    folder.mkdir(parents=True)
    tables.write(folder / "table.csv", table or view_errors())
    for name, columns in (more or {}).items():
        tables.write(folder / name, columns)
    tables.write(
        folder / "table_ingest.csv", {"source": ["synthetic", "folder"], "verdict": ["kept", "refused"]}
    )
    if claims:
        tables.write(folder / "claims.csv", claims)
    (folder / "arrays.npz").write_bytes(packed(arrays or {"walker": np.array(["a"])}))
    Image.new("RGB", (1800, 300), "white").save(folder / "figure.png")
    if recording:
        (folder / "recording.rrd").write_bytes(recording)
    write_manifest(
        folder,
        {
            "figure": folder.name,
            "data": "synthetic",
            "scale": scale,
            "seed": 2007,
            "inputs": dict(inputs or {}),
            "configuration": {
                "title": "Errors <against> view",
                **(configuration or {}),
            },
            "expect": "MAP & lower",
            "charts": [to_json(chart) for chart in VIEW_CHARTS],
            "stages": {"sweep": {"key": "0"}},
            "provenance": {
                "commit": "f" * 40,
                "dirty": False,
                "python": "3.11",
                "packages": {"numpy": "2.3"},
                "lock_sha256": lock_sha256,
            },
        },
    )
    return folder


def limb_clips() -> dict[str, np.ndarray]:
    """Return two clips of twenty frames in front of one camera, reconstructed without error."""
    generator = np.random.default_rng(1)
    truth = 300.0 * generator.standard_normal((2, 20, 15, 3)) + np.array([0.0, 0.0, 1000.0])
    camera = around(20, target=np.array([0.0, 0.0, 1000.0]), sweep_rad=1.0)
    images = np.stack([camera.project(clip) for clip in truth])
    return {
        "cameras": np.array(["moving"]),
        "stretch": np.array([0, 1]),
        "clip_name": np.array(["walking_001", "bending_001"]),
        "truth": truth,
        "positions": truth[:, None],
        "images": images[:, None],
        "camera_matrix": np.broadcast_to(camera.matrix, (2, 1, 20, 3, 4)),
        "mirror_margin": np.full((2, 1, 14), 3.0),
    }


def shown(browser: str, address: str, profile: Path) -> str:
    """Return the HTML of a page after two minutes of the browser's virtual time."""
    command = [
        browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}", "--dump-dom",
        "--virtual-time-budget=120000", address,
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=600).stdout
