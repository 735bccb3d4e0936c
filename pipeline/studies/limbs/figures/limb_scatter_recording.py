"""The recording of park2011 figure 3a: limbs on their spheres, by reconstructibility."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline import recordings as recording
from pipeline.core.limb_chain import WALKER14
from pipeline.core.reconstructibility import GREEN_ABOVE
from pipeline.studies.figure_inputs import Made
from pipeline.studies.limbs.figures.limb_paths import (
    CAMERA_NAMES,
    EYE_MM,
    OUTSIDE,
    RADIUS_MM,
    increasing,
    path_bones,
    sphere,
)

RANGE = (1e-2, 1e3)
"""Of reconstructibility, as it is shown."""

_ESTIMATE, _TRUTH, _IMPOSTOR = "amber", "green", "orange"


def record(made: Made, running: dict[str, np.ndarray], eta_given: np.ndarray, folder: Path) -> None:
    """The recording, into a folder.

    Parameters
    ----------
    made : Made
    running : dict
        Columns of ``table_running``.
    eta_given : (C, T)
        Reconstructibility of each trial.
    folder : Path
    """
    sweep = made.sweep.arrays
    eta = np.clip(eta_given, *RANGE).ravel()
    paths = RADIUS_MM * sweep["paths"].reshape(eta.size, *sweep["paths"].shape[2:])
    error = sweep["limb_error"].ravel()
    at, rows = increasing(1000.0 * np.log10(eta))
    bones = path_bones(paths.shape[2])
    # The good one has the lowest error of those that are clearly reconstructible, or of all where none is.
    clear = eta >= min(GREEN_ABOVE, float(np.quantile(eta, 0.9)))
    shown = {
        "good": int(np.flatnonzero(clear)[np.argmin(error[clear])]),
        "impostor": int(np.argmax(error)),
    }

    def words(trial: int) -> str:
        camera, number = divmod(trial, sweep["limb_error"].shape[1])
        return (
            f"{WALKER14.limbs[sweep['limb'][number]]} of {made.walkers[sweep['stretch'][number]]}, "
            f"{CAMERA_NAMES[str(sweep['cameras'][camera])]}, eta {eta[trial]:.2f}, error {error[trial]:.2f}, margin "
            f"{sweep['mirror_margin'].ravel()[trial]:.2f} ({sweep['light'].ravel()[trial]})"
        )

    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + "\nRelative trajectories on the sphere of their limb, which is drawn with a radius of one metre: "
        f"{_TRUTH} the truth, {_IMPOSTOR} the impostor, {_ESTIMATE} the estimate, drawn "
        f"{100 * (OUTSIDE - 1):.0f} % outside.\n\n- good: {words(shown['good'])}\n- impostor: "
        f"{words(shown['impostor'])}\n- at the cursor: the trial with that reconstructibility.\n\n"
        "The cursor counts 1000 log10 of eta: 0 is eta = 1, 301 is 2, 1000 is 10.\n",
        timeline="log10_eta_per_mille",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        middle_at, middle_rows = increasing(1000.0 * np.log10(np.clip(running["reconstructibility"], *RANGE)))
        for column, label, colour, width in (
            ("limb_error_median", "running median", "blue", 2.5),
            ("limb_error_low", "lower quartile", "grey", 1.0),
            ("limb_error_high", "upper quartile", "grey", 1.0),
        ):
            rec.curve(
                f"curves/limb_error/{column.removeprefix('limb_error_')}",
                middle_at,
                running[column][middle_rows],
                label=label,
                colour=colour,
                width=width,
            )
        globe, wires = sphere()
        for where, which in {**{k: np.array([v]) for k, v in shown.items()}, "cursor": rows}.items():
            index = {"log10_eta_per_mille": at if where == "cursor" else at[:1]}
            for part, colour, scale in (
                ("truth", _TRUTH, 1.0),
                ("impostor", _IMPOSTOR, 1.0),
                ("estimate", _ESTIMATE, OUTSIDE),
            ):
                of = ("truth", "impostor", "estimate").index(part)
                rec.skeleton(
                    f"world/{where}/{part}",
                    scale * paths[which, of],
                    bones,
                    index=index,
                    colour=colour,
                    thickness_mm=6.0,
                )
            first = {"log10_eta_per_mille": at[:1]}
            rec.skeleton(f"world/{where}/sphere", globe, wires, index=first, thickness_mm=1.0)
        spaces = [
            recording.Space3D(name=name, origin=f"world/{where}", eye_mm=EYE_MM, target_mm=(0.0, 0.0, 0.0))
            for where, name in (
                ("good", "a good one"),
                ("impostor", "the impostor taken"),
                ("cursor", "at the cursor"),
            )
        ]
        rec.blueprint(
            recording.Rows(
                recording.Columns(*spaces),
                recording.Columns(
                    recording.Plot(name="error / length over 1000 log10 of eta", origin="curves/limb_error"),
                    recording.Notes(),
                    shares=(2, 1),
                ),
                shares=(3, 2),
            )
        )
