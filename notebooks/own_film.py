# %% [markdown]
# # Own film to joint angles
#
# Set the variable MY_FILM to a film (needs the extra `video`) or to keypoints of a detector.  Without it the notebook
# simulates the keypoints of a synthetic walker, 2 px off, as AlphaPose writes them.

# %%
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from gait_pipeline.synthetic import walkers

from walk3d import reconstruct
from walk3d.film.simulation.keypoints import DetectorError, Filming, simulate_keypoints

source, facts = Path(os.environ.get("MY_FILM", "walk.json")), {}
if not source.exists():
    people = walkers.walking_population(np.random.default_rng(1), male=1, female=1, duration_s=4.0)
    filming = Filming(heading_rad=np.radians(60.0), speed_mm_s=1200.0, frame_rate_hz=30.0)
    error = DetectorError()
    positions = people.positions_mm[0]
    film = simulate_keypoints(np.random.default_rng(1), positions, people.frame_rate_hz, filming, error)
    pixels = film.pixels + np.array([960.0, 540.0])  # from the middle of the image
    keypoints = np.concatenate([pixels, np.ones((*film.pixels.shape[:2], 1))], axis=-1)
    rows = [
        {"image_id": f"{frame}.jpg", "keypoints": points.ravel().tolist(), "idx": [0.0]}
        for frame, points in enumerate(keypoints)
    ]
    source.write_text(json.dumps(rows), encoding="utf-8")
    facts = {
        "frame_rate_hz": 30.0,
        "width": 1920,
        "height": 1080,
        "layout": "walker15",
        "focal_px": film.focal_px,
    }

# %% [markdown]
# `reconstruct` returns the walk, and the content of `summary.json`: verdict, cadence and angles with 95 % bars.

# %%
walk, summary = reconstruct(source, **facts)
print(summary["verdict"])
stretch = summary["stretches"][0]
print(
    stretch["cadence"]["steps_per_min"], "steps/min, 95 %:", stretch["cadence"]["interval_95_steps_per_min"]
)

# %% [markdown]
# The command `python -m pipeline reconstruct` writes the same walk with its angles over time to a folder.

# %%
from walk3d.film.reconstruct.writing import Reconstruct, run  # noqa: E402

options = Reconstruct()
options.input = replace(options.input, path=str(source), **facts)
options.output = replace(options.output, path="reconstructed", page=False, recording=False)
_, _, folder = run(options)
angles = np.genfromtxt(folder / "angles.csv", delimiter=",", names=True)
print(sorted(path.name for path in folder.iterdir()))
print(angles.dtype.names[:4])
