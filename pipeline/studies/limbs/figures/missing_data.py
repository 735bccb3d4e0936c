"""Error of a whole skeleton against the share of missing points: park2011 figure 3d."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import Made, Tables, lift, sd
from pipeline.studies.limbs.figures.limb_paths import CAMERA_NAMES
from pipeline.studies.options import LimbDataset, MissingDataSweep

PATTERN_NAMES = {"random": "one by one at random", "block": "runs of frames"}
PATTERN_LABELS = {"random": "random", "block": "runs"}
PATTERN_COLOURS = {"random": "blue", "block": "orange"}

PUBLISHED_FRACTION, PUBLISHED_ERROR = 0.05, 0.13
"""[park2011 section 5.1]: an average error of 13 % for 5 % missing data."""

_TRIALS = (
    "relative_error", "limb_error", "joint_error_mm", "imputed_error_mm", "seen_error_mm", "missing_share",
    "relative_error_up_to_mirror", "limb_error_up_to_mirror", "reprojection_error_px", "length_violation",
    "cartesian_length_violation",
)  # fmt: skip


def tables(made: Made) -> Tables:
    """``table``: every skeleton at every fraction and pattern; ``table_points``: over skeletons."""
    sweep = made.sweep.arrays
    patterns, fractions, trials = sweep["limb_error"].shape
    rows = {
        "trial": np.tile(np.arange(trials), patterns * fractions),
        "clip": np.tile(np.array(made.walkers)[sweep["stretch"]], patterns * fractions),
        "camera": np.tile(sweep["camera"], patterns * fractions),
        "missing_fraction": np.tile(np.repeat(sweep["fractions"], trials), patterns),
        "pattern": np.repeat(sweep["patterns"], fractions * trials),
    }
    points = {
        "missing_fraction": np.tile(sweep["fractions"], patterns),
        "pattern": np.repeat(sweep["patterns"], fractions),
        "trials": np.full(patterns * fractions, trials),
        "relative_error_mean": sweep["relative_error"].mean(axis=2).ravel(),
        "relative_error_sd": sd(sweep["relative_error"], 2).ravel(),
        **{
            f"{name}_median": np.median(sweep[name], axis=2).ravel()
            for name in ("limb_error", "joint_error_mm", "imputed_error_mm", "seen_error_mm")
        },
        "relative_error_up_to_mirror_mean": sweep["relative_error_up_to_mirror"].mean(axis=2).ravel(),
        "limb_error_up_to_mirror_median": np.median(sweep["limb_error_up_to_mirror"], axis=2).ravel(),
    }
    return {
        "table": (
            {**rows, **{name: sweep[name].ravel() for name in _TRIALS}},
            ["pattern", "missing_fraction", "trial"],
        ),
        "table_points": (points, ["pattern", "missing_fraction"]),
    }


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Relative error as in the paper, and the error of points that were seen and of those that were not."""
    from pipeline import pictures

    sweep, columns = _options(made), made_tables["table_points"][0]
    patterns = [str(pattern) for pattern in made.sweep.arrays["patterns"]]
    panels: list[list[pictures.Series]] = [[], []]
    for pattern in patterns:
        here = columns["pattern"] == pattern
        order = np.flatnonzero(here)[np.argsort(columns["missing_fraction"][here])]
        x, colour = 100.0 * columns["missing_fraction"][order], PATTERN_COLOURS[pattern]
        mean, spread = (columns[f"relative_error_{name}"][order] for name in ("mean", "sd"))
        panels[0] += [
            pictures.Series(
                x=x,
                y=mean,
                band=spread if pattern == patterns[0] else None,
                label=PATTERN_LABELS[pattern],
                colour=colour,
            ),
            pictures.Series(
                x=x,
                y=columns["relative_error_up_to_mirror_mean"][order],
                line="dashed",
                colour=colour,
            ),
        ]
        missing = np.isfinite(columns["imputed_error_mm_median"][order])
        panels[1] += [
            pictures.Series(
                x=x[missing],
                y=columns["imputed_error_mm_median"][order][missing],
                label="imputed" if pattern == patterns[0] else "",
                colour=colour,
            ),
            pictures.Series(
                x=x,
                y=columns["seen_error_mm_median"][order],
                label="seen" if pattern == patterns[0] else "",
                line="dotted",
                colour=colour,
            ),
        ]
    limits = (0.0, 100.0 * float(columns["missing_fraction"].max()))
    published = pictures.Series(
        x=np.array([100.0 * PUBLISHED_FRACTION]),
        y=np.array([PUBLISHED_ERROR]),
        line="points",
        label="published",
        colour="black",
    )
    cameras = ", ".join(CAMERA_NAMES[camera] for camera in sweep.cameras)
    high = columns["relative_error_mean"] + columns["relative_error_sd"]
    pictures.draw_lines(
        stem,
        [
            pictures.Panel(
                series=[*panels[0], published],
                xlabel="Missing points (%)",
                xlim=limits,
                ylabel=r"$\Vert X - \hat X\Vert\,/\,\Vert X\Vert$",
                ylim=(0.0, 1.05 * float(high.max())),
            ),
            pictures.Panel(
                series=[line for line in panels[1] if len(line.x)],
                xlabel="Missing points (%)",
                xlim=limits,
                ylabel="3D error of a joint (mm)",
                ylim=(0.0, 1.08 * float(max(line.y.max() for line in panels[1] if len(line.x)))),
            ),
        ],
        columns=2,
        caption=f"{made.caption} {int(columns['trials'][0])} skeletons, {cameras}; noise of {sweep.noise_px:g} px, "
        f"errors of {100 * sweep.length_error:g} % of every length and of {sweep.root_error_mm:g} mm of the root's "
        "trajectory. (a) Mean over skeletons with points missing at random or in runs of frames, in the coordinates "
        "of the recording, on whose origin it depends; band: ±1 standard deviation; dashed: when of every limb and "
        "its mirror the better one is taken; dot: the paper's 13 % at 5 %. (b) Median over skeletons, of points that "
        "were missing and of those that were seen.",
    )


def _options(made: Made) -> MissingDataSweep:
    assert isinstance(made.config.sweep, MissingDataSweep)
    return made.config.sweep


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """One skeleton, recorded and reconstructed with its missing points imputed; errors over time and fractions."""
    from pipeline import recordings as recording

    sweep, notes, columns = made.sweep.arrays, made.sweep.notes, made_tables["table_points"][0]
    true, found, imputed = sweep["shown_true"], sweep["shown_found"], sweep["shown_imputed"]
    assert isinstance(made.config.dataset, LimbDataset)
    times = np.arange(len(true)) / made.config.dataset.frame_rate_hz
    index = {"time": times}
    ground = lift(true)
    # Its place in the world is where it was recorded: brought to the middle of the view.
    ground[:2] = -true[:, 8, :2].mean(axis=0)
    error = np.linalg.norm(found - true, axis=-1)
    seen = ~imputed & (np.arange(true.shape[1]) != 8)
    name = made.walkers[int(sweep["stretch"][int(sweep["shown"][0])])]
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about + f"\n`{name}` with {100 * notes['shown_fraction']:g} % of its points missing "
        f"({PATTERN_NAMES[str(notes['shown_pattern'])]}), the one of median error. Grey: recorded; blue: "
        "reconstructed; orange: points that were imputed. In the image missing points are not there. Bars: mean "
        "relative error in percent over percent of missing points.\n",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        rec.skeleton("world/original", true + ground, WALKER15.bones, index=index)
        rec.skeleton("world/reconstructed", found + ground, WALKER15.bones, index=index, colour="blue")
        dots = np.where(imputed[..., None], found + ground, np.nan)
        if imputed.any():
            # Points alone: a bone needs both its ends, so none is drawn between a joint and itself.
            rec.skeleton(
                "world/imputed",
                dots,
                [(j, j) for j in range(dots.shape[1])],
                index=index,
                colour="orange",
                thickness_mm=16.0,
            )
        # Images count down, in pixels: a pixel is drawn as a millimetre, upright.
        rec.image_points(
            "image/observed",
            sweep["shown_image"] * [1.0, -1.0],
            WALKER15.bones,
            index=index,
            thickness_mm=1.5,
        )
        for part, here, colour in (("imputed", imputed, "orange"), ("seen", seen, "blue")):
            has = here.any(axis=1)
            if has.any():
                mean = np.where(here, error, 0.0).sum(axis=1)[has] / here.sum(axis=1)[has]
                rec.curve(f"curves/error_mm/{part}", times[has], mean, label=f"{part} points", colour=colour)
        for pattern in map(str, sweep["patterns"]):
            here = columns["pattern"] == pattern
            rec.bars(
                f"bars/{pattern}",
                100.0 * columns["relative_error_mean"][here],
                100.0 * columns["missing_fraction"][here],
                colour="blue" if pattern == "random" else "orange",
            )
        bars = [
            recording.Bars(name=f"relative error (%), {PATTERN_NAMES[p]}", origin=f"bars/{p}")
            for p in map(str, sweep["patterns"])
        ]
        rec.blueprint(
            recording.Rows(
                recording.Columns(
                    recording.Space3D(name="recorded and reconstructed"),
                    recording.Image2D(name="observed"),
                    shares=(3, 2),
                ),
                recording.Columns(
                    recording.Plot(name="error (mm) against time (s)", origin="curves/error_mm"),
                    recording.Tabs(*bars),
                    recording.Notes(),
                    shares=(2, 1, 1),
                ),
                shares=(3, 2),
            ),
            playing=True,
        )
