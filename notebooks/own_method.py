# %% [markdown]
# # Your own method against the papers' methods
#
# A method is a function in a file.  It takes the other people's walks and the image of a held-out walk, and returns the
# missing dimension.  This one takes the depth of the most similar person.

# %%
import subprocess
import sys
from pathlib import Path

import pandas as pd

FILE = """
import numpy as np
from gait_pipeline.core import camera
from gait_pipeline.palette import Style
from gait_pipeline.plugins import Plugin
from gait_pipeline.studies.walks.methods import Method


def reconstruct(fold, walk, views):
    missing = []
    for view, image in zip(views, walk.observed(views), strict=True):
        others = camera.project(fold.training, view)  # (people, 5, 15, 2)
        nearest = ((others - image) ** 2).sum(axis=(1, 2, 3)).argmin()
        missing.append(camera.missing_dimension(fold.training[nearest], view))
    return np.stack(missing)


PLUGIN = Plugin(methods=[Method("nearest", Style("nearest person", "purple"), reconstruct)])
"""
Path("nearest.py").write_text(FILE, encoding="utf-8")

# %% [markdown]
# `plugins=nearest.py` adds the method to the figure.  Every person is left out in turn.

# %%
overrides = [
    *("experiment=zhang2007_fig5", "scale=smoke", "plugins=nearest.py"),
    *("figure.picture=false", "figure.recording=false", "workers=1"),
]
subprocess.run([sys.executable, "-m", "pipeline", *overrides], check=True, stdout=subprocess.DEVNULL)
table = pd.read_csv(next(Path("results").glob("**/zhang2007_fig5/table.csv")))
errors = table.groupby("method")["rms_error_mm"].mean().round(1)
print(errors.sort_values())

# %% [markdown]
# [The guide](../docs/extend.md#a-method) adds a claim with an interval, and a figure of your own.
