"""Whole skeletons from still and moving cameras, over the truth: park2011 figure 4."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.core.limb_chain import WALKER14
from pipeline.palette import Style
from pipeline.scenes import Columns, Image2D, MotionBlock, Notes, Rows, Space3D
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.figures.presentation import confidences
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.motions import MotionsSweep
from pipeline.studies.limbs.reconstructed_motions import Motions, MotionsOfBoth
from pipeline.studies.limbs.trials import ROOT
from pipeline.studies.presentation import entity_name
from pipeline.studies.study import Figure
from pipeline.validation import Count

if TYPE_CHECKING:
    from pipeline.pictures import Picture
    from pipeline.recordings import Recorder, Recording

LIMBS = WALKER14.limbs

PUBLISHED = Reference(y="park2011_humaneva_mean_error", label="published, one video of walking")

VIEWS = {"from its left": np.pi / 2, "half right": -np.pi / 4}
"""The other views of the picture: how far around the camera's own azimuth they stand, rad."""

TRACED = ("left_wrist", "right_wrist", "left_ankle", "right_ankle")
"""Joints whose whole trajectories are drawn."""

LIGHT_COLOURS = {"green": "decided", "amber": "in_doubt", "red": "undecided"}
"""Colours of limbs in the recording."""

Inputs = FigureInputs[LimbStretches, BasisFit, MotionsOfBoth]


@dataclass(kw_only=True)
class MotionsFigure(Figure):
    """Images, reconstructions from other views, whole trajectories."""

    model = TrajectoryBasisModel
    sweep = MotionsSweep

    mirrors: bool = False  # show the reconstructions in which mirrors of limbs in doubt were tried
    instants: Count = 4  # of each motion that are drawn
    shown: list[str] = field(  # the first clip whose action says so is drawn
        default_factory=lambda: ["dance", "jump", "cartwheel", "signals", "walk", "bending", "smooth angles"]
    )

    def _of(self, inputs: Inputs) -> Motions:
        """Return the reconstructions that the figure shows."""
        return inputs.sweep.mirrors_tried if self.mirrors else inputs.sweep.as_chosen

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: each joint of each clip and camera; ``table_clips``; ``table_limbs``.

        ``table_papers``: of clips in the paper's conditions, beside the first figure alone.
        """
        sweep, order = inputs.sweep, ["clip", "camera"]
        made = {"table": sweep.joints, "table_clips": sweep.clips, "table_limbs": sweep.limbs}
        beside = {} if self.mirrors else {"table_papers": tidy(sweep.papers, by=order)}
        shown = {
            name: rows[rows["mirrors_tried"] == self.mirrors].drop(columns="mirrors_tried")
            for name, rows in made.items()
        }
        return {**beside, **{name: tidy(rows, by=order) for name, rows in shown.items()}}

    def chosen(self, inputs: Inputs) -> list[int]:
        """Return which clips are drawn: of each word the first whose action says so; if none does, the first."""
        actions = [str(action).lower() for action in inputs.dataset.action[self._of(inputs).stretch]]
        found = [
            next((n for n, action in enumerate(actions) if word.lower() in action), None)
            for word in self.shown
        ]
        return list(dict.fromkeys(n for n in found if n is not None)) or [0]

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """Error of every clip from every camera, on the page, with the paper's number."""
        table = tables["table_clips"]
        chart = Chart(
            table="table_clips", x="clip", words={name: name for name in dict.fromkeys(table["clip"])},
            y="error_mm", by="camera", label="error", zero=True, picture=False, references=[PUBLISHED],
            styles={str(name): Style(f"{name} camera", Camera(name).colour) for name in self._of(inputs).cameras},
        )  # fmt: skip
        return Sheet(charts=[chart])

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], picture: Picture) -> None:
        """Draw a row to each clip shown, a block to each camera: image, two other views, whole trajectories."""
        options, sweep = _options(inputs), self._of(inputs)
        of_clips = tables["table_clips"].set_index(["clip", "camera"])
        clips = inputs.dataset.clip[sweep.stretch]
        middles = (np.arange(self.instants) + 0.5) * (sweep.truth.shape[1] - 1) / self.instants
        instants = np.unique(np.rint(middles).astype(int))
        confidence = confidences(sweep.mirror_margin)
        traced = [WALKER15.index(joint) for joint in TRACED]
        drawn = [LIMBS.index(WALKER15.joints[child]) for _, child in WALKER15.bones]
        rows = []
        for n in self.chosen(inputs):
            row = []
            for c, camera in enumerate(map(str, sweep.cameras)):
                truth, positions = sweep.truth[n], sweep.positions[n, c]
                angles = [sweep.azimuth_rad[n, c] + turn for turn in VIEWS.values()]
                paths = [across(p[:, traced], angles[0]).swapaxes(0, 1) for p in (truth, positions)]
                of_clip = of_clips.loc[(clips[n], camera)]
                action = of_clip["action"].split(" - ")[0].split(",")[0]
                row.append(
                    MotionBlock(
                        title=f"{action.capitalize()}, {camera} camera: {of_clip['error_mm']:.0f} mm "
                        f"(hanging {of_clip['hanging_error_mm']:.0f})",
                        image=options.upright_mm(sweep.images[n, c, instants]),
                        truth=np.stack([across(truth[instants], angle) for angle in angles]),
                        reconstruction=np.stack([across(positions[instants], angle) for angle in angles]),
                        paths_true=paths[0],
                        paths=paths[1],
                        confidence=tuple(confidence[n, c, drawn].tolist()),
                    )
                )
            rows.append(row)
        means = tables["table_clips"].groupby("camera")["error_mm"].mean()
        picture.motions(
            rows,
            WALKER15.bones,
            views=list(VIEWS),
            caption=f"Lengths: {options.lengths}; root: {options.root.replace('_', ' ')}; noise of "
            f"the image {options.noise_px:g} px"
            + ("; knees and elbows flex one way" if options.use_hinges else "")
            + ("; mirrors of limbs in doubt tried" if self.mirrors else "")
            + ". Each title gives the mean error of the joints relative to the pelvis, beside that of a skeleton that "
            "hangs straight down; over all "
            f"{len(sweep.stretch)} clips it is "
            + ", ".join(f"{means[camera]:.0f} mm ({camera})" for camera in map(str, sweep.cameras))
            + _without_help(tables)
            + ". Colours: how far the other mirror of a limb is from being as smooth. Right: wrists and ankles from "
            "the first of the other views, true ones thin.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], begin: Recorder) -> None:
        """Log every clip shown from every camera: truth, reconstruction by confidence, image, whole trajectories."""
        sweep, options = self._of(inputs), _options(inputs)
        numbers, cameras = self.chosen(inputs), [str(camera) for camera in sweep.cameras]
        confidence = confidences(sweep.mirror_margin)
        words = {n: entity_name(str(inputs.dataset.clip[sweep.stretch[n]])) for n in numbers}
        index = {"time": np.arange(sweep.truth.shape[1]) / inputs.dataset.frame_rate_hz}
        with begin(
            "\nOther clips can be switched on in the streams tree; they stand over the origin by their "
            "mean pelvis: `world/truth/<clip>` (grey), `world/reconstructed/<camera>/<clip>/<confidence>`, "
            "`world/trajectories/<camera>/<clip>` of wrists and ankles.\n\nLimbs are green where the data have decided "
            "between a limb and its mirror, amber where they are in doubt, orange where both are as good.\n\n"
            "| clip | action | from | camera | error | confidence |\n|---|---|---|---|---|---|\n"
            + _lines(inputs, sweep, tables["table_clips"], words),
        ) as rec:
            for n in numbers:
                shift = sweep.truth[n, :, ROOT].mean(axis=0) * [1.0, 1.0, 0.0]
                truth = sweep.truth[n] - shift
                rec.skeleton(f"world/truth/{words[n]}", truth, index=index)
                _trace(rec, f"world/trajectories/truth/{words[n]}", truth, "original")
                for c, camera in enumerate(cameras):
                    positions = sweep.positions[n, c] - shift
                    for name, colour in LIGHT_COLOURS.items():
                        entity = f"world/reconstructed/{camera}/{words[n]}/{name}"
                        _limbs_of(rec, entity, positions, confidence[n, c] == name, index, colour)
                    _trace(rec, f"world/trajectories/{camera}/{words[n]}", positions, "blue")
                    image = options.upright_mm(sweep.images[n, c])
                    rec.image_points(f"image/{camera}/{words[n]}", image, index=index)
            first = words[numbers[0]]
            columns = []
            for camera, azimuth in zip(cameras, sweep.azimuth_rad[numbers[0]], strict=True):
                angle = float(azimuth) + np.pi / 3
                paths = ("world/truth", f"world/reconstructed/{camera}", "world/trajectories/truth",
                         f"world/trajectories/{camera}")  # fmt: skip
                space = Space3D(
                    name=f"{camera} camera, seen from its left",
                    contents=paths,
                    shown=tuple(f"{path}/{first}" for path in paths),
                    eye_mm=(-2600.0 * float(np.sin(angle)), 2600.0 * float(np.cos(angle)), 1500.0),
                )
                image_view = Image2D(
                    name=f"image of the {camera} camera",
                    contents=(f"image/{camera}",),
                    shown=(f"image/{camera}/{first}",),
                    beside=space,
                )
                columns.append(Rows(space, image_view))
            layout = Columns(*columns, Notes(), shares=[3] * len(columns) + [2])
            rec.blueprint(layout, playing=True)


def across(positions: np.ndarray, azimuth_rad: float) -> np.ndarray:
    """Return positions (…, 3) as a far camera at an azimuth sees them: (…, 2) to the right and up, mm."""
    right = -np.cos(azimuth_rad) * positions[..., 0] - np.sin(azimuth_rad) * positions[..., 1]
    return np.stack([right, positions[..., 2]], axis=-1)


def _options(inputs: Inputs) -> MotionsSweep:
    return cast(MotionsSweep, inputs.experiment.sweep)


def _without_help(tables: dict[str, pd.DataFrame]) -> str:
    """Words for the caption: errors in the paper's conditions, and of skeletons that do nothing."""
    papers = tables.get("table_papers")
    nothing = tables["table_clips"][["hanging_error_mm", "mean_pose_error_mm"]].mean()
    words = (
        f"; a skeleton that hangs straight down errs by {nothing['hanging_error_mm']:.0f} mm, the mean pose by "
        f"{nothing['mean_pose_error_mm']:.0f} mm"
    )
    if papers is None:
        return words
    means = papers.groupby("camera")["error_mm"].mean()
    return (
        "; in the paper's conditions (proportions, root at one depth, no hinges) "
        + ", ".join(f"{mean:.0f} mm ({camera})" for camera, mean in means.items())
        + words
    )


def _lines(inputs: Inputs, shown: Motions, of_clips: pd.DataFrame, words: dict[int, str]) -> str:
    """Rows of the description: what each clip shown is, and how far it is off."""
    lines = []
    for n, name in words.items():
        stretch = shown.stretch[n]
        start = inputs.dataset.start_s[stretch]
        rows = of_clips[of_clips["clip"] == inputs.dataset.clip[stretch]].set_index("camera")
        for camera, row in rows.loc[list(shown.cameras)].iterrows():
            lines.append(
                f"| {name} | {row['action']} | {start:.1f} s | {camera} | {row['error_mm']:.0f} mm "
                f"| {row['confidence']} |\n"
            )
    return "".join(lines)


def _limbs_of(
    rec: Recording,
    entity: str,
    positions: np.ndarray,
    which: np.ndarray,
    index: dict[str, np.ndarray],
    colour: str,
) -> None:
    """Add those limbs (14,) of a skeleton of one confidence, if there are any."""
    if not which.any():
        return
    bones = [(int(parent), int(child)) for parent, child in WALKER14.ends[which]]
    apart = np.full_like(positions, np.nan)
    held = sorted({joint for bone in bones for joint in bone})
    apart[:, held] = positions[:, held]
    rec.skeleton(entity, apart, bones, index=index, colour=colour, thickness_mm=9.0)


def _trace(rec: Recording, entity: str, positions: np.ndarray, colour: str) -> None:
    """Add whole trajectories of wrists and ankles: one row at the beginning, which stands for all times."""
    frames = len(positions)
    points = np.concatenate([positions[:, WALKER15.index(joint)] for joint in TRACED])
    steps = [(k * frames + t, k * frames + t + 1) for k in range(len(TRACED)) for t in range(frames - 1)]
    rec.skeleton(entity, points[None], steps, index={"time": np.zeros(1)}, colour=colour, thickness_mm=2.0)
