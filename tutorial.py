# %% [markdown]
# # From two commands to a question of your own
#
# The tutorial takes ten minutes to read and under a minute to compute.  The file is a script (`make tutorial`).
# Jupyter and editors that know `# %%` open it as a notebook.  It answers a question that none of the papers answers:
# *how does the error fall with the number of walkers in the model?*

# %%
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from gait_pipeline.charts import Axis, Chart, Sheet
from gait_pipeline.core import camera, errors, fourier, linear_model, reconstruction
from gait_pipeline.palette import Style
from gait_pipeline.pictures.charts import draw_charts
from gait_pipeline.pictures.postures import draw_postures
from gait_pipeline.pictures.style import Canvas
from gait_pipeline.scenes import PostureRow
from gait_pipeline.skeleton import WALKER15
from gait_pipeline.storage.publishing import publish
from gait_pipeline.synthetic import walkers

FOLDER = Path(os.environ.get("TUTORIAL_FOLDER", "results/tutorial"))
DRAWS = int(os.environ.get("TUTORIAL_DRAWS", "20"))

# %% [markdown]
# ## 1. The two commands
#
# `make sweeps` makes every figure of the four papers, and `make test` tests the software.  `make zhang2007_fig5` makes
# one figure; `SCALE=smoke` makes it small, in seconds.  This is the command that `make` runs, with another folder:

# %%
subprocess.run(
    [
        *(sys.executable, "-m", "pipeline", "figures", "experiment=zhang2007_fig5"),
        *("scale=smoke", f"results={FOLDER / 'results'}"),
    ],
    check=True,
)

# %% [markdown]
# A figure is a folder.  `figure.png` is the picture.  `table.csv` has the numbers of the picture, with units in the
# names of its columns.  `claims.csv` has the paper's sentences with our numbers and verdicts.  `manifest.json` has
# configuration, versions and inputs.

# %%
figure = FOLDER / "results" / "synthetic" / "smoke" / "zhang2007_fig5"
print(sorted(path.name for path in figure.iterdir()))
table = pd.read_csv(figure / "table.csv")
print(table.groupby("method")[["absolute_error_mm2", "rms_error_mm", "relative_error"]].mean().round(2))

# %% [markdown]
# ## 2. One walker by hand
#
# The library does the same in six lines.  `walking_population` makes people with a known true motion; for your own
# recordings use `pipeline.read` and `pipeline.represent` (README, *In Python*).  A walk becomes a Fourier series of 225
# numbers.  All walks but one become a model, and that one walk is reconstructed from its view at 30°.

# %%
people = walkers.walking_population(np.random.default_rng(2007), male=48, female=72)
walks = np.stack([fourier.represent(walk, people.frame_rate_hz).coefficients for walk in people.positions_mm])
samples = linear_model.flatten(walks)  # (120, 225), mm
model = linear_model.fit(samples[1:], 30)
angle = np.radians(30.0)
estimate = reconstruction.from_known_views(model, samples[0], np.array([angle]), noise_variance=70.0)
off_mm = np.sqrt(errors.walker_error(errors.absolute_error(estimate.delta[0])))
print(f"the first walker, from 30°: {off_mm:.1f} mm off in depth")

# %% [markdown]
# The picture at the top of the README shows this reconstruction of a walker, turned.  `publish` writes a folder
# completely or not at all.  The next run replaces it only if this program wrote it:

# %%
reconstructed = camera.combine(camera.project(walks[0], angle), estimate.missing[0], angle)
times = np.arange(5) / 5.0
side = [
    camera.project(fourier.synthesise(motion, 1.0, times), np.radians(90.0))
    for motion in (walks[0], reconstructed)
]
with publish(FOLDER / "one_walker", having="tutorial") as published:
    caption = f"Five instants of a cycle, seen from the side; computed from 30° alone, {off_mm:.1f} mm off in depth."
    draw_postures(
        Canvas(published.folder / "one_walker", caption=caption),
        [("", [PostureRow(label="side view", original=side[0], reconstructed=side[1])])],
        WALKER15.bones,
    )
    published.facts = {"tutorial": "one walker", "off_mm": off_mm}

# %% [markdown]
# ## 3. A question of your own
#
# How many walkers does the model need?  Forty people are held out.  n of the other eighty are drawn at random and form
# a model.  The model reconstructs the forty from views all around.  Several draws show the influence of chance.  The
# *baseline* is the result **without the method**: the average of the same n walkers, for every person.

# %%
views = np.radians(np.arange(-90.0, 91.0, 15.0))
held_out, pool = samples[:40], samples[40:]
draw = np.random.default_rng(1)


def rms_mm(delta: np.ndarray) -> float:
    """Return the error in depth of one walker, mean over the views, from coefficient differences (views, 5, 15)."""
    return float(np.sqrt(errors.walker_error(errors.absolute_error(delta))).mean())


truth = np.stack([camera.missing_dimension(held_out.reshape(-1, 5, 15, 3), view) for view in views], axis=1)
rows = []
for number in (3, 5, 10, 20, 40, 80):
    for turn in range(DRAWS if number < len(pool) else 1):  # there is one way to draw all eighty
        learnt = linear_model.fit(pool[draw.permutation(len(pool))[:number]], min(30, number - 1))
        mean = np.stack([camera.missing_dimension(learnt.mean.reshape(5, 15, 3), view) for view in views])
        map_deltas = [
            reconstruction.from_known_views(learnt, walker, views, noise_variance=70.0).delta
            for walker in held_out
        ]
        for method, deltas in (("map", map_deltas), ("baseline", truth - mean)):
            off = np.mean([rms_mm(delta) for delta in deltas])
            rows.append({"walkers": number, "draw": turn, "method": method, "rms_error_mm": off})

# %% [markdown]
# The tables of this software are *tidy*: a row for each observation, a column for each quantity.  A curve with its band
# is a `groupby` and a call.

# %%
answer = (
    pd.DataFrame(rows)
    .groupby(["method", "walkers"])["rms_error_mm"]
    .agg(
        mean="mean",
        low=lambda errors_mm: errors_mm.quantile(0.05),
        high=lambda errors_mm: errors_mm.quantile(0.95),
    )
    .reset_index()
)
print(answer.round(1).to_string(index=False))
chart = Chart(
    x="walkers",
    abscissa=Axis(label="walkers in the model", log=True, ticks=(3, 5, 10, 20, 40, 80)),
    y="mean",
    band=("low", "high"),
    by="method",
    styles={"baseline": Style("their average (baseline)", "baseline"), "map": Style("MAP", "map")},
    label="error in depth",
    unit="mm",
    zero=True,
)
with publish(FOLDER / "answer", having="tutorial") as published:
    answer.to_csv(published.folder / "answer.csv", index=False, float_format="%.6g")
    caption = f"Forty walkers held out, thirteen views, {DRAWS} draws; bands: nine tenths of the draws."
    draw_charts(Canvas(published.folder / "answer", Sheet(charts=[chart]), {"table": answer}, caption))
    published.facts = {"tutorial": "number of walkers", "draws": DRAWS}
mean_mm = answer.pivot(index="walkers", columns="method", values="mean")
better = mean_mm.index[mean_mm["map"] < mean_mm["baseline"]]
print(
    f"From 10 to 80 walkers the error falls from {mean_mm['map'][10]:.1f} to {mean_mm['map'][80]:.1f} mm;"
    f" the last doubling still takes off {mean_mm['map'][40] - mean_mm['map'][80]:.1f} mm."
    f" From {better[0]} walkers on, the method is worth more than the average of its walkers."
)

# %% [markdown]
# The baseline shows a limit of the method: with a handful of walkers the prior trusts them too much, and their average
# is the better answer.  A next question could be: is the cause the variance σ² = 70 mm², which the papers chose for
# eighty walkers?  Change `noise_variance` above.

# %% [markdown]
# ## 4. The same from the command line
#
# A change of an option needs no script.  A multirun makes a figure for each value.  It also writes `variants.csv` and a
# picture with all curves, and the page shows the figures side by side:
#
# ```
# make run ARGS="-m experiment=zhang2007_fig5 data.population=10,20,40,80"
# make report
# ```
#
# Your own recordings need at least three people.  `make inspect INPUT=my_walks` prints their contents and the next
# command.  `python -m pipeline experiment=zhang2007_fig5 data=folder data.path=my_walks skeleton=auto` makes a figure.
