# %% [markdown]
# # Own motion capture to figure 5
#
# Set the variable MY_WALKS to a folder of recordings (C3D, TRC, BVH, …) whose names begin with the person.  Without it
# the notebook writes six synthetic people.

# %%
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from gait_pipeline.core import fourier
from gait_pipeline.synthetic import walkers

from gait_pipeline import fit, motion, read, represent
from walk3d import angles, calibrate, from_view, write
from walk3d import walkers as shipped

folder = Path(os.environ.get("MY_WALKS", "my_walks"))
if not folder.is_dir():
    folder.mkdir()
    people = walkers.walking_population(np.random.default_rng(1), male=3, female=3, duration_s=4.0)
    for number, positions in enumerate(people.positions_mm):
        walk = fourier.represent(positions, people.frame_rate_hz)
        write(motion(walk.coefficients, walk.frequency_hz), folder / f"p{number}_1.c3d")
files = sorted(folder.glob("*.c3d"))
print(len(files), "files")

# %% [markdown]
# `read` returns the points of a file.  A notebook shows them as a player.

# %%
recording = read(files[0])
print(recording)

# %% [markdown]
# One command makes figure 5 of zhang2007 from the folder.  With few people `model.prior=shipped` adds the model that
# ships, calibrated on the other people.  Leave out `scale=smoke` for all views.

# %%
overrides = [
    *("experiment=zhang2007_fig5", "scale=smoke", "data=folder", f"data.path={folder}", "skeleton=auto"),
    *("model.prior=shipped", "figure.picture=false", "figure.recording=false", "workers=1"),
]
subprocess.run([sys.executable, "-m", "pipeline", *overrides], check=True, stdout=subprocess.DEVNULL)
table = pd.read_csv(next(Path("results").glob("**/zhang2007_fig5/table.csv")))
print(table.groupby("method")["rms_error_mm"].mean().round(1).sort_values())

# %% [markdown]
# The library does the same for one walk, with error bars, and its result becomes a file.

# %%
walks = [represent(path) for path in files]
model = calibrate(shipped(), walks[1:])
result = from_view(model, walks[0], 30)
own = from_view(fit(walks[1:]), walks[0], 30)
for name, each in (("shipped model", result), ("own people", own)):
    off = each.coefficients - walks[0].coefficients
    print(f"{name}: {np.sqrt((off**2).sum(axis=2).mean()):.0f} mm")
walking = motion(result.coefficients, walks[0].frequency_hz)
write(walking, "reconstructed.c3d", replace=True)
print(f"largest flexion of the left knee: {angles(walking)['left_knee_deg'].max():.0f}°")
