"""Whole skeletons from still and moving cameras, over the truth: park2011 figure 4."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.core.limb_chain import WALKER14
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import Made, Tables
from pipeline.studies.limbs.figures.motions_recording import (
    ROOT,
    TRACED,
    lights,
    options_of,
    recordings,
    shown,
    upright_mm,
)

__all__ = ["picture", "recordings", "tables"]

LIMBS = WALKER14.limbs
CHILDREN = WALKER14.ends[:, 1]
VIEWS = {"from its left": np.pi / 2, "half right": -np.pi / 4}
"""The other views of the picture: how far around the camera's own azimuth they stand, rad."""

MOST = 1e6
"""Ratios are tabulated up to this: where the truth lies in the basis, they are without bound."""

OF_LIMBS = (
    "proved", "objective", "best_objective", "lower_bound", "limb_error", "components", "length_ratio",
)  # fmt: skip
"""What the table of limbs takes from the sweep as it is."""


def tables(made: Made) -> Tables:
    """``table``: each joint of each clip and camera; ``table_clips``; ``table_limbs``."""
    options_of(made)
    sweep = made.sweep.arrays
    cameras, stretch, error = sweep["cameras"], sweep["stretch"], sweep["error_mm"]
    clips, actions = (made.dataset.arrays[name][stretch] for name in ("clip", "action"))
    grid = error.shape[:2]
    of_limbs = (*grid, len(LIMBS))

    def keys(shape: tuple[int, ...]) -> dict[str, np.ndarray]:
        tail = [1] * (len(shape) - 1)
        by_camera = cameras.reshape(1, -1, *[1] * (len(shape) - 2))
        return {
            "clip": np.broadcast_to(clips.reshape(-1, *tail), shape).ravel(),
            "action": np.broadcast_to(actions.reshape(-1, *tail), shape).ravel(),
            "camera": np.broadcast_to(by_camera, shape).ravel(),
        }

    hung = error[..., CHILDREN]
    mean = hung.mean(axis=-1)  # (N, C, F)
    margin = np.minimum(sweep["mirror_margin"], MOST)
    middle_margin = np.median(margin, axis=-1)
    return {
        "table": (
            {
                **keys(of_limbs),
                "joint": np.tile(LIMBS, grid[0] * grid[1]),
                "error_mm": hung.mean(axis=2).ravel(),
                "error_sd_mm": hung.std(axis=2, ddof=1).ravel(),
                "imputed_share": sweep["imputed"][..., CHILDREN].mean(axis=2).ravel(),
            },
            ["clip", "camera"],
        ),
        "table_clips": (
            {
                **keys(grid),
                "lengths": np.full(np.prod(grid), made.sweep.notes["lengths"]),
                "error_mm": mean.mean(axis=-1).ravel(),
                "error_sd_mm": mean.std(axis=-1, ddof=1).ravel(),
                "error_up_to_mirror_mm": sweep["error_up_to_mirror_mm"].ravel(),
                "length_change_max": sweep["length_change"].max(axis=-1).ravel(),
                "acceleration_ratio": _acceleration_ratio(sweep["positions"], sweep["truth"]).ravel(),
                "reprojection_error_px": sweep["reprojection_error_px"].ravel(),
                "proved_share": sweep["proved"].mean(axis=-1).ravel(),
                "light": lights(middle_margin).ravel(),
                "mirror_margin_median": middle_margin.ravel(),
                "reconstructibility": np.minimum(sweep["reconstructibility_of_clip"], MOST).ravel(),
            },
            ["clip", "camera"],
        ),
        "table_limbs": (
            {
                **keys(of_limbs),
                "limb": np.tile(LIMBS, grid[0] * grid[1]),
                "reconstructibility": np.minimum(sweep["reconstructibility"], MOST).ravel(),
                "mirror_margin": margin.ravel(),
                "light": lights(margin).ravel(),
                "mirrored": sweep["mirrored"].ravel(),
                **{name: sweep[name].ravel() for name in OF_LIMBS},
            },
            ["clip", "camera"],
        ),
    }


def _acceleration_ratio(positions: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Rms acceleration (N, C) of the reconstruction about the pelvis, over that of the truth."""
    made = positions - positions[..., [ROOT], :]
    true = truth - truth[:, :, [ROOT]]
    power = [np.square(np.diff(p, n=2, axis=-3)).mean(axis=(-3, -2, -1)) for p in (made, true)]
    return np.asarray(np.sqrt(power[0] / power[1][:, None]))


def across(positions: np.ndarray, azimuth_rad: float) -> np.ndarray:
    """Positions (…, 3) as a far camera at an azimuth sees them: (…, 2) to the right and up, mm."""
    right = -np.cos(azimuth_rad) * positions[..., 0] - np.sin(azimuth_rad) * positions[..., 1]
    return np.stack([right, positions[..., 2]], axis=-1)


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """A row to each clip shown, a block to each camera: image, two other views, whole trajectories."""
    from pipeline import pictures

    options, report = options_of(made)
    sweep = made.sweep.arrays
    cameras = [str(camera) for camera in sweep["cameras"]]
    of_clips = made_tables["table_clips"][0]
    frames = sweep["truth"].shape[1]
    instants = np.unique(
        np.rint((np.arange(report.instants) + 0.5) * (frames - 1) / report.instants).astype(int)
    )
    light = lights(sweep["mirror_margin"])
    traced = [WALKER15.index(joint) for joint in TRACED]
    rows = []
    for n in shown(made):
        row = []
        for c, camera in enumerate(cameras):
            truth, positions = sweep["truth"][n], sweep["positions"][n, c]
            angles = [sweep["azimuth_rad"][n, c] + turn for turn in VIEWS.values()]
            paths = [across(p[:, traced], angles[0]).swapaxes(0, 1) for p in (truth, positions)]
            number = n * len(cameras) + c
            action = str(of_clips["action"][number]).split(" - ")[0].split(",")[0]
            row.append(
                pictures.MotionBlock(
                    title=f"{action.capitalize()}, {camera} camera: {of_clips['error_mm'][number]:.0f} mm",
                    image=upright_mm(made, sweep["images"][n, c, instants]),
                    truth=np.stack([across(truth[instants], angle) for angle in angles]),
                    reconstruction=np.stack([across(positions[instants], angle) for angle in angles]),
                    paths_true=paths[0],
                    paths=paths[1],
                    confidence=tuple(
                        str(light[n, c, LIMBS.index(WALKER15.joints[j])]) for _, j in WALKER15.bones
                    ),
                )
            )
        rows.append(row)
    errors = [of_clips["error_mm"][of_clips["camera"] == camera].mean() for camera in cameras]
    pictures.draw_motions(
        stem,
        rows,
        WALKER15.bones,
        views=list(VIEWS),
        caption=f"{made.caption} Lengths: {made.sweep.notes['lengths']}; root: {options.root.replace('_', ' ')}; "
        f"noise of the image {options.noise_px:g} px"
        + ("; knees and elbows flex one way" if options.use_hinges else "")
        + ("; mirrors of limbs in doubt tried" if options.try_mirrors else "")
        + ". Each title gives the mean error of the joints relative to the pelvis; over all "
        f"{len(sweep['stretch'])} clips it is "
        + ", ".join(f"{error:.0f} mm ({camera})" for error, camera in zip(errors, cameras, strict=True))
        + ". Colours: how far the other mirror of a limb is from being as smooth. Right: wrists and ankles from the "
        "first of the other views, true ones thin.",
    )
