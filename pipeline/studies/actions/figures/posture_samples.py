"""Mean postures and accepted samples as skeletons: mozerov2006 figure 4."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.core import camera
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import Made, Tables

VIEW_DEG = -55.0
"""Three-quarter view of the picture, from the left."""

_APART_MM = 750.0
"""Between neighbours in the recording, which stand in a row across this view."""

_MEASURES = (
    "draws",
    "acceptance",
    "nearest_training_mm",
    "nearest_training_max_mm",
    "spread_mm",
    "limb_direction_norm_min",
    "limb_direction_norm_max",
    "bounds_held_fraction",
)


def tables(made: Made) -> Tables:
    """``table``: joints of the mean postures (draw -1) and of the samples shown; ``table_samples``: all measured."""
    sweep = made.sweep.arrays
    frames, kinds = sweep["frames"], sweep["kinds"]
    bodies = np.concatenate([sweep["mean_joints"][:, None], sweep["sample_joints"]], axis=1)
    shown = bodies.shape[1]
    joints = len(WALKER15.joints)
    return {
        "table": (
            {
                "frame": np.repeat(frames, shown * joints),
                "draw": np.tile(np.repeat(np.arange(shown) - 1, joints), len(frames)),
                "joint": np.tile(WALKER15.joints, len(frames) * shown),
                **{f"{axis}_mm": bodies[..., k].ravel() for k, axis in enumerate("xyz")},
            },
            ["frame", "draw"],
        ),
        "table_samples": (
            {
                "frame": np.repeat(frames, len(kinds)),
                "kind": np.tile(kinds, len(frames)),
                **{name: sweep[name].ravel() for name in _MEASURES},
            },
            ["frame", "kind"],
        ),
    }


def _bodies(made_tables: Tables) -> tuple[np.ndarray, np.ndarray]:
    """Frames (N,), and joints (N, 1 + S, 15, 3) in mm, the mean posture first."""
    columns = made_tables["table"][0]
    frames = np.array(list(dict.fromkeys(columns["frame"].tolist())))
    joints = np.stack([columns[f"{axis}_mm"] for axis in "xyz"], axis=-1)
    return frames, joints.reshape(len(frames), -1, len(WALKER15.joints), 3)


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """A row to a frame: the mean posture, then accepted samples, each over the mean posture."""
    from pipeline import pictures

    columns = made_tables["table_samples"][0]
    frames, bodies = _bodies(made_tables)
    seen = camera.project(bodies, np.radians(VIEW_DEG))
    accepted = columns["kind"] == "accepted"
    rows = [
        pictures.SkeletonRow(
            label=f"({'abcdefgh'[n % 8]}) frame {frame}", centre=seen[n, 0], others=seen[n, 1:]
        )
        for n, frame in enumerate(frames)
    ]
    measured = "; ".join(
        f"frame {frame}: {columns['spread_mm'][here]:.0f} mm from the mean posture, "
        f"{columns['nearest_training_mm'][here]:.0f} mm from the nearest recorded one"
        for frame, here in ((f, np.flatnonzero(accepted & (columns["frame"] == f))[0]) for f in frames)
    )
    pictures.draw_skeletons(
        stem,
        rows,
        WALKER15.bones,
        legend=("mean posture", "accepted by the action model"),
        caption=f"{made.caption} Frames of the mean performance counted from 1; body of mean limb lengths. Median of "
        f"{int(columns['draws'][accepted][0])} samples, mean over joints: {measured}.",
    )


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The mean performance, playing; at each of the frames the mean posture and its samples side by side."""
    from pipeline import recordings as recording

    frames, bodies = _bodies(made_tables)
    performance = made.sweep.arrays["mean_performance"]
    first = {"frame": np.array([1])}
    angle = np.radians(VIEW_DEG)
    # The eye is in front of the row, where the image's horizontal runs to the left.
    to_right = -np.array([np.cos(angle), np.sin(angle), 0.0])
    ahead = np.array([-np.sin(angle), np.cos(angle), 0.0])
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + "\nSide by side, grey: the mean posture; blue: postures drawn at random within the learnt bounds. Orange, "
        "`world/mean_performance`: plays on the timeline `frame`, counted from 1.\n",
        timeline="frame",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        rec.skeleton(
            "world/mean_performance",
            performance,
            WALKER15.bones,
            index={"frame": np.arange(1, len(performance) + 1)},
            colour="orange",
        )
        rows = []
        for frame, body in zip(frames, bodies, strict=True):
            middle = (len(body) - 1) / 2
            reach = 0.5 * len(body) * _APART_MM + 500.0
            for draw, joints in enumerate(body):
                name = "mean" if draw == 0 else f"accepted_{draw}"
                rec.skeleton(
                    f"world/frame_{frame}/{name}",
                    (joints + (draw - middle) * _APART_MM * to_right)[None],
                    WALKER15.bones,
                    index=first,
                    colour="blue" if draw else "original",
                )
            rows.append(
                recording.Space3D(
                    name=f"frame {frame}: mean posture and accepted samples",
                    contents=(f"world/frame_{frame}",),
                    eye_mm=(reach * ahead[0], reach * ahead[1], 1100.0),
                    target_mm=(0.0, 0.0, 850.0),
                )
            )
        rec.blueprint(
            recording.Columns(
                recording.Rows(*rows),
                recording.Rows(
                    recording.Space3D(name="mean performance", contents=("world/mean_performance",)),
                    recording.Notes(),
                ),
                shares=(7, 3),
            ),
            playing=True,
        )
