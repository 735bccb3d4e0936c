"""Error of approach II against sigma²: zhang2007 figure 3."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.studies.figure_inputs import Made, Tables, sd

PUBLISHED_OPTIMUM_MM2 = 70.0


def chosen_without(path_walker: np.ndarray) -> np.ndarray:
    """Index of the sigma² that is best for all other walkers, (R,), from errors (R, S).

    The published optimum is chosen on the walkers that it is reported on; this one has not seen the walker.
    """
    others = path_walker.sum(axis=0) - path_walker
    return others.argmin(axis=1)


def tables(made: Made) -> Tables:
    """``table``: mean over walkers and views; ``table_views``: per view; ``table_nested``: σ² of the others."""
    sweep = made.sweep.arrays
    sigma2, path, views = sweep["sigma2_mm2"], sweep["path_walker_mm2"], sweep["view_angle_deg"]
    nested = chosen_without(path)
    return {
        "table": (
            {
                "sigma2_mm2": sigma2,
                "absolute_error_mm2": path.mean(axis=0),
                "absolute_error_se_mm2": sd(path, 0) / np.sqrt(len(path)),
            },
            ["sigma2_mm2"],
        ),
        "table_views": (
            {
                "view_angle_deg": np.repeat(views, len(sigma2)),
                "sigma2_mm2": np.tile(sigma2, len(views)),
                "absolute_error_mm2": sweep["path_view_mm2"].ravel(),
            },
            ["view_angle_deg", "sigma2_mm2"],
        ),
        "table_nested": (
            {
                "walker": made.walkers,
                "sigma2_mm2": sigma2[nested],
                "absolute_error_mm2": path[np.arange(len(path)), nested],
            },
            ["walker"],
        ),
    }


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Mean error against sigma² with its standard error, the optimum and the published one marked."""
    from pipeline.pictures import curves as pictures  # drawing is slow to import, and not always wanted

    columns = made_tables["table"][0]
    sigma2, error = columns["sigma2_mm2"], columns["absolute_error_mm2"]
    best = int(error.argmin())
    here = float(sigma2[best])
    inside = 0 < best < len(sigma2) - 1
    first, last = sorted([(here, f"here {here:g}"), (PUBLISHED_OPTIMUM_MM2, "published 70")])
    if not inside:
        references = [("x", PUBLISHED_OPTIMUM_MM2, "published 70")]
    elif last[0] - first[0] < 0.15 * float(sigma2[-1]):  # one label for two neighbouring lines
        references = [("x", first[0], ""), ("x", last[0], f"left {first[1]}, right {last[1]}")]
    else:
        references = [("x", first[0], first[1]), ("x", last[0], last[1])]
    remark = "" if inside else f" No optimum inside the range: the lowest error is at its end, {here:g} mm²."
    panel = pictures.Panel(
        series=[pictures.Series(x=sigma2, y=error, spread=columns["absolute_error_se_mm2"])],
        xlabel="Variance $\\sigma^2$ (mm$^2$)",
        ylabel="Average absolute error (mm$^2$)",
        xlim=(0, float(sigma2[-1])),
        references=references,
    )
    pictures.curves(stem, [panel], caption=f"{made.caption} Band: ±1 standard error over walkers.{remark}")


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The curve over sigma², and the error of every view at every sigma² with its valley."""
    from pipeline.recordings import recording  # drawing is slow to import, and not always wanted

    columns = made_tables["table"][0]
    sweep = made.sweep.arrays
    sigma2 = np.rint(columns["sigma2_mm2"]).astype(int)
    views = sweep["path_view_mm2"]
    shown = np.unique(np.linspace(0, len(sweep["view_angle_deg"]) - 1, 7).astype(int))
    valley = np.column_stack([np.arange(len(views)), views.argmin(axis=1)])
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about,
        timeline="sigma2_mm2",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        rec.curve(
            "curves/absolute_error_mm2/map",
            sigma2,
            columns["absolute_error_mm2"],
            sd=columns["absolute_error_se_mm2"],
            label="all views, ±1 standard error",
            colour="blue",
        )
        for view in shown:
            angle = sweep["view_angle_deg"][view]
            name = f"view_{'minus_' if angle < 0 else ''}{abs(angle):.0f}"
            rec.curve(
                f"views/absolute_error_mm2/{name}",
                sigma2,
                views[view],
                label=f"{angle:g}°",
                colour=_COLOURS[int(np.flatnonzero(shown == view)[0])],
            )
        rec.matrix("matrices/error_by_view_and_sigma2", views, paths={"valley": (valley, "orange")})
        rec.blueprint(
            recording.Split(
                "columns",
                [
                    recording.Split(
                        "rows",
                        [
                            recording.Plot(name="mean error (mm²) against σ² (mm²)", origin="curves"),
                            recording.Plot(name="error (mm²) of single views against σ²", origin="views"),
                        ],
                    ),
                    recording.Split(
                        "rows",
                        [
                            recording.Matrix(name="error: view angle down, σ² across; line: best σ²"),
                            recording.Notes(),
                        ],
                    ),
                ],
                [3, 2],
            )
        )


_COLOURS = ("purple", "vermilion", "green", "grey", "yellow", "orange", "blue")
