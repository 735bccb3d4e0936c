"""Whole skeletons reconstructed from still and moving cameras, drawn over the truth: park2011 figure 4."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pandas as pd

from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.core.choice import nearest_to_medians
from pipeline.core.limb_chain import WALKER14
from pipeline.core.reconstructibility import confidence_of_mirror_margin
from pipeline.palette import CONFIDENCES, Style, name_on_dark
from pipeline.scenes import Columns, Image2D, MotionScene, Notes, Rows, Space3D
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import FigureInputs, columns_of, entity_name, tidy
from pipeline.studies.limbs import baselines
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.motions import MotionsSweep
from pipeline.studies.limbs.reconstructed_motions import Motions, MotionsOfBoth
from pipeline.studies.limbs.trials import ROOT
from pipeline.studies.study import Figure, Tables
from pipeline.validation import Count

if TYPE_CHECKING:
    from pipeline.pictures.picture import Picture
    from pipeline.recordings import Recorder, Recording

LIMBS = WALKER14.limbs

PUBLISHED = Reference(y="park2011_humaneva_mean_error", label="published")

ASIDE_RAD = np.pi / 2
"""Angle between the camera's view and the second view in the picture, about the vertical axis."""

STEPS = {"hangs straight down": "baseline", "reconstructed": "orange", "mirrors tried": "blue"}
"""Colours of the compared skeletons: baseline, reconstruction, and reconstruction after trials of mirrored limbs."""

TRACED = ("left_wrist", "right_wrist", "left_ankle", "right_ankle")
"""Joints whose trajectories are drawn over the whole motion."""

Inputs = FigureInputs[LimbStretches, BasisFit, MotionsOfBoth]


class MotionsFigure(Figure):
    """Figure of the camera images, the reconstructions from other views, and the trajectories of whole motions."""

    model = TrajectoryBasisModel
    sweep = MotionsSweep

    mirrors: bool = False  # show the reconstructions with mirrors of doubtful limbs tried
    instants: Count = 4  # number of instants of each motion that are drawn
    shown: list[str] = [  # words of actions; the first clip of each is recorded
        "dance", "jump", "cartwheel", "signals", "walk", "bending", "smooth angles",
    ]  # fmt: skip

    def _of(self, inputs: Inputs) -> Motions:
        """Return the reconstructions to show, with or without trials of mirrored limbs."""
        return inputs.sweep.mirrors_tried if self.mirrors else inputs.sweep.as_chosen

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table`` with a row for each joint, clip and camera, and tables of clips, limbs and options.

        ``table_steps``: each clip and camera by step of `STEPS`; ``table_papers``: clips in the paper's conditions,
        only without trials of mirrors; ``table_options``: number of cosines of the options.
        """
        sweep, order = inputs.sweep, ["clip", "camera"]
        sweep_tables = {"table": sweep.joints, "table_clips": sweep.clips, "table_limbs": sweep.limbs}
        model = cast(TrajectoryBasisModel, inputs.experiment.model)
        further = {} if self.mirrors else {"table_papers": tidy(sweep.papers, by=order)}
        further["table_options"] = pd.DataFrame([{"components": model.components}])
        displayed = {
            name: rows[rows["mirrors_tried"] == self.mirrors].drop(columns="mirrors_tried")
            for name, rows in sweep_tables.items()
        }
        first, second = (
            sweep_tables["table_clips"].query(f"mirrors_tried == {variant}") for variant in (False, True)
        )
        errors = (first["hanging_error_mm"], first["error_mm"], second["error_mm"])
        steps = [
            rows[["clip", "camera"]].assign(step=step, error_mm=error)
            for step, rows, error in zip(STEPS, (first, first, second), errors, strict=True)
        ]
        further["table_steps"] = tidy(pd.concat(steps if self.mirrors else steps[:2]), by=order)
        return {**further, **{name: tidy(rows, by=order) for name, rows in displayed.items()}}

    def chosen(self, inputs: Inputs) -> list[int]:
        """Return the indices of the clips to record: for each word in `shown`, the first clip whose action contains it.

        If no clip matches, the first clip is recorded.
        """
        actions = [str(action).lower() for action in inputs.dataset.action[self._of(inputs).stretch]]
        first_clips = [
            next((n for n, action in enumerate(actions) if word.lower() in action), None)
            for word in self.shown
        ]
        return list(dict.fromkeys(n for n in first_clips if n is not None)) or [0]

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of every clip's error and the published error, by camera on the page, by method in the picture."""
        options, sweep = _options(inputs), self._of(inputs)
        table, steps = tables["table_clips"], tables["table_steps"]
        cameras = {str(name): Style(f"{name} camera", Camera(name).colour) for name in sweep.cameras}
        error: dict[str, Any] = {"y": "error_mm", "zero": True, "references": [PUBLISHED]}
        of_all = steps.groupby(["camera", "step"])["error_mm"].agg(["mean", "median"]).reset_index()
        summaries = [
            (
                columns_of(of_all.rename(columns={how: "error_mm"}).assign(clip="all")),
                Style(f"{how} of all clips", colour),
            )
            for how, colour in (("mean", "original"), ("median", "purple"))
        ]
        charts = [
            Chart(
                **error, table="table_clips", x="clip", abscissa=Axis(words={name: name for name in table["clip"]}),
                by="camera", styles=cameras, picture=False,
            ),
            *(
                Chart(
                    **error, table="table_steps", x="step", where={"camera": camera}, strands="clip", page=False,
                    abscissa=Axis(words={name: name for name in STEPS if name in set(steps["step"])}),
                    title=f"{style.label}: better in {_better(steps, camera)}",
                    name=f"error_{camera}_mm", styles=Style("a clip", "silver", width=0.6),
                    also=[
                        Lines(table=summary, y="error_mm", where={"camera": camera}, strands="clip", styles=look)
                        for summary, look in summaries
                    ],
                )
                for camera, style in cameras.items()
            ),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=len(cameras),
            letters=False,
            caption=f"Lengths: {options.lengths}; root: {options.root.replace('_', ' ')}; noise of "
            f"the image {options.noise_px:g} px"
            + ("; knees and elbows flex one way" if options.use_hinges else "")
            + f". One clip before the {sweep.cameras[0]} camera: of all, its errors are nearest to the medians by their"
            " ratios; shaded, what is seen from the middle of each path. Below, mean error of the joints of"
            f" {len(sweep.stretch)} clips, relative to the pelvis; better: clips whose error the last step reduces."
            " Published: of a video of HumanEva-II.",
        )

    def draw(self, inputs: Inputs, tables: Tables, picture: Picture) -> None:
        """Draw the clip whose errors are nearest to the medians, the cameras from above, and errors of all clips."""
        sweep = self._of(inputs)
        first = tables["table_steps"].query("camera == @camera", local_dict={"camera": sweep.cameras[0]})
        by_step = first.pivot(index="clip", columns="step", values="error_mm").loc[
            inputs.dataset.clip[sweep.stretch]
        ]
        n = nearest_to_medians({step: by_step[step].to_numpy() for step in by_step})
        of_clip, medians = by_step.iloc[n], by_step.median()
        middles = (np.arange(self.instants) + 0.5) * (sweep.truth.shape[1] - 1) / self.instants
        instants = np.unique(np.rint(middles).astype(int))
        truth, lengths = sweep.truth[n], inputs.dataset.lengths_mm[sweep.stretch[n]]
        compared = [baselines.hanging(truth[:, ROOT], lengths), inputs.sweep.as_chosen.positions[n, 0]]
        aside = sweep.azimuth_rad[n, 0] + ASIDE_RAD
        rows = [
            (
                f"from its left: {step}, {of_clip[step]:.0f} mm (median of {len(by_step)} clips:"
                f" {medians[step]:.0f} mm)",
                across(positions[instants], aside),
                across(truth[instants], aside),
                STEPS[step],
            )
            for step, positions in zip(STEPS, [*compared, sweep.positions[n, 0]], strict=True)
            if step in by_step
        ]
        cameras = [
            (
                camera,
                Camera(camera).colour,
                *_from_above(sweep.camera_matrix[n, c], sweep.images[n, c], truth),
            )
            for c, camera in enumerate(map(str, sweep.cameras))
        ]
        image = _options(inputs).upright_mm(sweep.images[n, 0, instants])
        scene = MotionScene(image=image, rows=rows[-2:], ground=truth[:, ROOT, :2], cameras=cameras)
        picture.motion(scene, WALKER15.bones)

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record the selected clips from every camera: true and reconstructed skeleton, image and trajectories.

        The colour of a limb is the confidence of its reconstruction.
        """
        sweep, options = self._of(inputs), _options(inputs)
        numbers, cameras = self.chosen(inputs), [str(camera) for camera in sweep.cameras]
        confidence = np.vectorize(confidence_of_mirror_margin, otypes=[str])(sweep.mirror_margin)
        words = {n: entity_name(str(inputs.dataset.clip[sweep.stretch[n]])) for n in numbers}
        with begin(
            "\nOther clips can be switched on in the streams tree; they stand over the origin by their "
            f"mean pelvis: `world/original/<clip>` ({name_on_dark('original')}), "
            "`world/reconstructed/<camera>/<clip>/<confidence>`, "
            "`world/trajectories/<camera>/<clip>` of wrists and ankles.\n\n"
            f"Limbs are {name_on_dark('decided')} where the data have decided between a limb and its mirror, "
            f"{name_on_dark('in_doubt')} where they are in doubt, {name_on_dark('undecided')} where both are as good.  "
            "`table_clips.csv` has the error of each.\n",
            at=np.arange(sweep.truth.shape[1]) / inputs.dataset.frame_rate_hz,
        ) as rec:
            for n in numbers:
                shift = sweep.truth[n, :, ROOT].mean(axis=0) * [1.0, 1.0, 0.0]
                truth = sweep.truth[n] - shift
                rec.skeleton(f"world/original/{words[n]}", truth)
                _trace(rec, f"world/trajectories/original/{words[n]}", truth, "original")
                for c, camera in enumerate(cameras):
                    positions = sweep.positions[n, c] - shift
                    for name, role in CONFIDENCES.items():
                        entity = f"world/reconstructed/{camera}/{words[n]}/{role}"
                        _limbs_of(rec, entity, positions, confidence[n, c] == name, role)
                    _trace(rec, f"world/trajectories/{camera}/{words[n]}", positions, "blue")
                    matrix, image = sweep.camera_matrix[n, c].copy(), options.upright_mm(sweep.images[n, c])
                    matrix[..., 3] += matrix[..., :3] @ shift
                    rec.camera(
                        f"world/cameras/{camera}/{words[n]}", matrix, image,
                        distance_mm=options.distance_mm,
                    )  # fmt: skip
            first = words[numbers[0]]
            columns = []
            for camera, azimuth in zip(cameras, sweep.azimuth_rad[numbers[0]], strict=True):
                angle = azimuth + np.pi / 3
                paths = ("world/original", f"world/reconstructed/{camera}", "world/trajectories/original",
                         f"world/trajectories/{camera}")  # fmt: skip
                space = Space3D(
                    name=f"{camera} camera, seen from its left",
                    contents=paths,
                    focus=tuple(f"{path}/{first}" for path in paths),
                    eye_mm=(-2600.0 * np.sin(angle), 2600.0 * np.cos(angle), 1500.0),
                )
                entity = f"world/cameras/{camera}/{first}"
                image_view = Image2D(
                    name=f"image of the {camera} camera", origin=entity, contents=(f"{entity}/seen",)
                )
                columns.append(Rows(space, image_view))
            stand = ("world/original", *(f"world/cameras/{camera}" for camera in cameras))
            where = Space3D(
                name="the cameras", contents=stand, focus=tuple(f"{path}/{first}" for path in stand),
                eye_mm=(3000.0, -3000.0, 5000.0),
            )  # fmt: skip
            layout = Columns(*columns, Rows(where, Notes()), shares=[3] * len(columns) + [2])
            rec.blueprint(layout, playing=True)


def across(positions: np.ndarray, azimuth_rad: float) -> np.ndarray:
    """Project positions (…, 3), mm, orthographically along a horizontal direction; return (right, up), mm."""
    right = -np.cos(azimuth_rad) * positions[..., 0] - np.sin(azimuth_rad) * positions[..., 1]
    return np.stack([right, positions[..., 2]], axis=-1)


def _from_above(matrix: np.ndarray, image: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the path (F, 2), mm, of a camera and the triangle (3, 2), mm, of its field of view, seen from above.

    The triangle begins at the middle of the path and ends beyond the truth (F, J, 3).
    """
    inverse = np.linalg.inv(matrix[..., :3])
    centre = -(inverse @ matrix[..., 3:])[..., 0]
    middle = len(centre) // 2
    points = image[middle, np.isfinite(image[middle]).all(axis=-1)]
    ends = [(float(u), points[:, 1].mean(), 1.0) for u in (points[:, 0].min(), points[:, 0].max())]
    rays = np.array([inverse[middle] @ end for end in ends])
    depth = 1.15 * np.linalg.norm(truth[middle].mean(axis=0) - centre[middle])
    reached = centre[middle] + depth * rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return centre[:, :2], np.stack([centre[middle], *reached])[:, :2]


def _better(steps: pd.DataFrame, camera: str) -> str:
    """Return a text such as "9 of 12": the clips of one camera whose error is reduced by trials of mirrored limbs."""
    by_step = steps[steps["camera"] == camera].pivot(index="clip", columns="step", values="error_mm")
    before, last = (by_step[step] for step in [step for step in STEPS if step in by_step][-2:])
    return f"{(last < before).sum()} of {len(by_step)}"


def _options(inputs: Inputs) -> MotionsSweep:
    return cast(MotionsSweep, inputs.experiment.sweep)


def _limbs_of(
    rec: Recording,
    entity: str,
    positions: np.ndarray,
    which: np.ndarray,
    colour: str,
) -> None:
    """Record those limbs of a skeleton that a mask (14,) selects."""
    if not which.any():
        return
    bones = [(int(parent), int(child)) for parent, child in WALKER14.ends[which]]
    selected = np.full_like(positions, np.nan)
    joints = sorted({joint for bone in bones for joint in bone})
    selected[:, joints] = positions[:, joints]
    rec.skeleton(entity, selected, bones, colour=colour, thickness_mm=9.0)


def _trace(rec: Recording, entity: str, positions: np.ndarray, colour: str) -> None:
    """Record the trajectories of wrists and ankles, logged once at the first time stamp and valid at all times."""
    frames = len(positions)
    points = np.concatenate([positions[:, WALKER15.index(joint)] for joint in TRACED])
    steps = [(k * frames + t, k * frames + t + 1) for k in range(len(TRACED)) for t in range(frames - 1)]
    rec.skeleton(entity, points[None], steps, at=[0], colour=colour, thickness_mm=2.0)
