# %% [markdown]
# # From two commands to a question of your own
#
# Ten minutes of reading, under a minute of computing.  The file is a script (`make tutorial`) and, in Jupyter or an
# editor that knows `# %%`, a notebook.  It ends with an answer that none of the papers gives: *how does the error fall
# with the number of walkers that the model is learnt from?*

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
# `make sweeps` makes every figure of the four papers, `make test` tests the software.  One figure alone is
# `make zhang2007_fig5`; small, in seconds, with `SCALE=smoke`.  That is what `make` runs, with a folder of our own:

# %%
subprocess.run(
    [
        *(sys.executable, "-m", "pipeline", "figures", "experiment=zhang2007_fig5"),
        *("scale=smoke", f"results={FOLDER / 'results'}"),
    ],
    check=True,
)

# %% [markdown]
# A figure is a folder.  `figure.png` is the picture, `table.csv` what is drawn, with units in the names of its columns;
# `claims.csv` has the paper's sentences with our numbers and verdicts, `manifest.json` where all of it comes from.

# %%
figure = FOLDER / "results" / "synthetic" / "smoke" / "zhang2007_fig5"
print(sorted(path.name for path in figure.iterdir()))
table = pd.read_csv(figure / "table.csv")
print(table.groupby("method")[["absolute_error_mm2", "rms_error_mm", "relative_error"]].mean().round(2))

# %% [markdown]
# ## 2. One walker by hand
#
# The same in six lines.  `walking_population` makes people whose true motion is known; with recordings of your own,
# `pipeline.read` and `pipeline.represent` take its place (README, *In Python*).  A walk becomes a Fourier series of
# 225 numbers, all walks but one become a model, and that one is seen from 30° only.

# %%
people = walkers.walking_population(np.random.default_rng(2007), male=48, female=72)
walks = np.stack([fourier.represent(walk, people.frame_rate_hz).coefficients for walk in people.positions_mm])
samples = linear_model.flatten(walks)  # (120, 225), mm
model = linear_model.fit(samples[1:], 30)
angle = np.radians(30.0)
found = reconstruction.from_known_views(model, samples[0], np.array([angle]), noise_variance=70.0)
off_mm = np.sqrt(errors.walker_error(errors.absolute_error(found.delta[0])))
print(f"the first walker, from 30°: {off_mm:.1f} mm off in depth")

# %% [markdown]
# What the picture at the head of the README shows is this walker's `again`, turned.  A folder is published whole, and
# replaced by the next run only if this program wrote it:

# %%
again = camera.combine(camera.project(walks[0], angle), found.missing[0], angle)
times = np.arange(5) / 5.0
side = [
    camera.project(fourier.synthesise(motion, 1.0, times), np.radians(90.0)) for motion in (walks[0], again)
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
# How many walkers does the model need?  Forty people are kept aside.  Of the other eighty, n are drawn at random, a
# model is learnt from them, and the forty are reconstructed from views all around; this is done several times over, so
# that chance shows.  A number alone says little: beside it stands what one gets **without the method**, the average of
# the same n walkers for everybody (the *baseline*).

# %%
views = np.radians(np.arange(-90.0, 91.0, 15.0))
aside, pool = samples[:40], samples[40:]
draw = np.random.default_rng(1)


def rms_mm(delta: np.ndarray) -> float:
    """Error in depth of one walker, mean over the views, of coefficient differences (views, 5, 15)."""
    return float(np.sqrt(errors.walker_error(errors.absolute_error(delta))).mean())


truth = np.stack([camera.missing_dimension(aside.reshape(-1, 5, 15, 3), view) for view in views], axis=1)
rows = []
for number in (3, 5, 10, 20, 40, 80):
    for turn in range(DRAWS if number < len(pool) else 1):  # all eighty can be drawn in one way only
        learnt = linear_model.fit(pool[draw.permutation(len(pool))[:number]], min(30, number - 1))
        mean = np.stack([camera.missing_dimension(learnt.mean.reshape(5, 15, 3), view) for view in views])
        made = [
            reconstruction.from_known_views(learnt, walker, views, noise_variance=70.0).delta
            for walker in aside
        ]
        for method, deltas in (("map", made), ("baseline", truth - mean)):
            off = np.mean([rms_mm(delta) for delta in deltas])
            rows.append({"walkers": number, "draw": turn, "method": method, "rms_error_mm": off})

# %% [markdown]
# The tables of this software are *tidy*: a row for each observation, a column for each quantity, so that a curve with
# its band is a `groupby` and a call.

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
    abscissa=Axis(label="walkers that the model is learnt from", log=True, ticks=(3, 5, 10, 20, 40, 80)),
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
# So the baseline was worth drawing: with a handful of walkers, the prior trusts them too much, and everybody's average
# is the better answer.  The next question is yours: is it the variance σ² = 70 mm², which the papers chose for eighty?
# Change `noise_variance` above.

# %% [markdown]
# ## 4. The same from the command line
#
# What has an option needs no script.  A multirun makes a figure for each value, and ends in `variants.csv` and a
# picture of the curves over each other; the page shows them side by side:
#
# ```
# make run ARGS="-m experiment=zhang2007_fig5 data.population=10,20,40,80"
# make report
# ```
#
# And on your own recordings, at least three people: `make inspect INPUT=my_walks` says what is in them and what to
# type, `python -m pipeline experiment=zhang2007_fig5 data=folder data.path=my_walks skeleton=auto` makes the figure.
