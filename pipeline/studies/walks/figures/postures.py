"""Original and reconstructed postures over one cycle: zhang2007 figure 4, zhang2004 figure 3."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.core import camera, errors, fourier
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import METHOD_COLOURS, METHOD_NAMES, Made, Tables, lift, walker_words
from pipeline.studies.options import PosturesReport
from pipeline.validation import InvalidInput

_PLAYED_HZ = 30.0


def _report(made: Made) -> PosturesReport:
    report = made.config.report
    if not isinstance(report, PosturesReport):
        raise TypeError(f"postures are not made by {type(report).__name__}")
    if not 0 <= report.walker < len(made.walkers):
        raise InvalidInput(
            "there is no such walker",
            where="report.walker",
            expected=f"0 to {len(made.walkers) - 1}",
            received=str(report.walker),
        )
    if report.instants < 1:
        raise InvalidInput(
            "no instants", where="report.instants", expected="1 or more", received=str(report.instants)
        )
    return report


def reconstructed(made: Made, method: int, walker: int, view: int) -> np.ndarray:
    """Fourier representation (5, 15, 3) put together from the observed view and the missing dimension."""
    truth = made.dataset.arrays["coefficients"][walker]
    angle = np.radians(made.sweep.arrays["demonstration_view_deg"][view])
    return camera.combine(
        camera.project(truth, angle), made.sweep.arrays["missing"][method, walker, view], angle
    )


def tables(made: Made) -> Tables:
    """``table``: joints of one walker at each instant; ``table_demonstrations``: every walker, every view."""
    report = _report(made)
    sweep, data = made.sweep.arrays, made.dataset.arrays
    views = sweep["demonstration_view_deg"]
    times = np.arange(report.instants) / report.instants  # fractions of a cycle, at one hertz
    original = fourier.synthesise(data["coefficients"][report.walker], 1.0, times)
    rows: dict[str, list[np.ndarray]] = {}
    joints = np.tile(WALKER15.joints, report.instants)
    for m, method in enumerate(made.methods):
        for v, view in enumerate(views):
            again = fourier.synthesise(reconstructed(made, m, report.walker, v), 1.0, times)
            block = {
                "walker": np.full(joints.size, made.walkers[report.walker]),
                "view_angle_deg": np.full(joints.size, view),
                "method": np.full(joints.size, method),
                "instant": np.repeat(np.arange(report.instants), len(WALKER15.joints)),
                "joint": joints,
            }
            for which, motion in (("original", original), ("reconstructed", again)):
                for axis, name in enumerate("xyz"):
                    block[f"{which}_{name}_mm"] = motion[..., axis].ravel()
            for name, values in block.items():
                rows.setdefault(name, []).append(values)
    squared = errors.walker_error(sweep["demonstration_error_mm2"])
    demonstrations = {
        "walker": np.repeat(made.walkers, len(views)),
        "view_angle_deg": np.tile(views, len(made.walkers)),
    }
    # What the paper tries has its columns, empty where this run leaves it out: the ledger then knows why.
    published = list(METHOD_NAMES) if made.config.paper == "zhang2007" else ["least_squares"]
    untried = np.full(squared[0].size, np.nan)
    for method in METHOD_NAMES:
        if method in made.methods:
            errors_of_method = np.sqrt(squared[made.methods.index(method)]).ravel()
            demonstrations[f"rms_error_{method}_mm"] = errors_of_method
        elif method in published:
            demonstrations[f"rms_error_{method}_mm"] = untried
    both = set(made.methods) == set(METHOD_NAMES)
    if both or len(published) > 1:
        apart = errors.walker_error(errors.absolute_error(sweep["missing"][0] - sweep["missing"][-1]))
        demonstrations["rms_between_methods_mm"] = np.sqrt(apart).ravel() if both else untried
    return {
        "table": (
            {name: np.concatenate(values) for name, values in rows.items()},
            ["view_angle_deg", "method", "instant"],
        ),
        "table_demonstrations": (demonstrations, ["walker", "view_angle_deg"]),
    }


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Rows of postures, each seen along the observed horizontal, so that across the page runs what was missing."""
    from pipeline.pictures import curves as pictures  # drawing is slow to import, and not always wanted

    report = _report(made)
    columns = made_tables["table"][0]
    shape = (report.instants, len(WALKER15.joints))
    groups = []
    for m, method in enumerate(made.methods):
        rows = []
        for view in made.sweep.arrays["demonstration_view_deg"]:
            here = (columns["method"] == method) & (columns["view_angle_deg"] == view)
            seen = []
            for which in ("original", "reconstructed"):
                space = np.stack([columns[f"{which}_{a}_mm"][here].reshape(shape) for a in "xyz"], axis=-1)
                across = camera.missing_dimension(space, np.radians(view))
                seen.append(np.stack([across, space[..., 2]], axis=-1))
            rows.append(pictures.PostureRow(label=f"{view:g}°", original=seen[0], reconstructed=seen[1]))
        title = f"({'ab'[m]}) Approach {'I' * (1 + (method == 'map'))}" if len(made.methods) > 1 else ""
        groups.append((title, rows))
    pictures.postures(
        stem,
        groups,
        WALKER15.bones,
        caption=f"{made.caption} Walker {made.walkers[report.walker]}; across the page runs the dimension that"
        " the view did not show.",
    )


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """Every walker, original and reconstructed from every demonstration view, walking in place."""
    from pipeline.recordings import recording  # drawing is slow to import, and not always wanted

    report = _report(made)
    data, views = made.dataset.arrays, made.sweep.arrays["demonstration_view_deg"]
    chosen = walker_words(made.walkers[report.walker])
    middle = 1 if len(views) > 1 else 0
    seconds = 1.0 / float(np.median(data["frequency_hz"]))
    times = np.arange(0.0, seconds, 1.0 / _PLAYED_HZ)
    index = {"time": times}
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + "\nAll walkers are played at one common pace and can be switched on in the streams tree: "
        "`world/original/<walker>`, `world/reconstructed/<method>/view_<angle>/<walker>`. "
        "Grey: original. "
        + ", ".join(f"{METHOD_COLOURS[m]}: {METHOD_NAMES[m]}" for m in made.methods)
        + ".\n",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        for r, name in enumerate(made.walkers):
            word = walker_words(name)
            truth = data["coefficients"][r]
            original = fourier.synthesise(truth, 1.0 / seconds, times)
            ground = lift(original)
            rec.skeleton(f"world/original/{word}", original + ground, WALKER15.bones, index=index)
            for v, view in enumerate(views):
                rec.image_points(
                    f"image/observed/view_{view:.0f}/{word}",
                    fourier.synthesise(camera.project(truth, np.radians(view)), 1.0 / seconds, times),
                    WALKER15.bones,
                    index=index,
                )
                for m, method in enumerate(made.methods):
                    rec.skeleton(
                        f"world/reconstructed/{method}/view_{view:.0f}/{word}",
                        fourier.synthesise(reconstructed(made, m, r, v), 1.0 / seconds, times) + ground,
                        WALKER15.bones,
                        index=index,
                        colour=METHOD_COLOURS[method],
                    )
        spaces = [
            recording.Space3D(
                name=f"{view:g}°: original and reconstructions",
                contents=(
                    "world/original",
                    *(f"world/reconstructed/{m}/view_{view:.0f}" for m in made.methods),
                ),
                shown=(
                    f"world/original/{chosen}",
                    *(f"world/reconstructed/{m}/view_{view:.0f}/{chosen}" for m in made.methods),
                ),
            )
            for view in views
        ]
        rec.blueprint(
            recording.Split(
                "columns",
                [
                    recording.Split("tabs", [spaces[middle], *spaces[:middle], *spaces[middle + 1 :]]),
                    recording.Split(
                        "rows",
                        [
                            recording.Image2D(
                                name=f"observed at {views[middle]:g}°",
                                contents=(f"image/observed/view_{views[middle]:.0f}",),
                                shown=(f"image/observed/view_{views[middle]:.0f}/{chosen}",),
                            ),
                            recording.Notes(),
                        ],
                    ),
                ],
                [3, 2],
            ),
            playing=True,
        )
