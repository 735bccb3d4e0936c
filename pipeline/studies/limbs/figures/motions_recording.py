"""The recording of park2011 figure 4: which clips it shows, and skeletons whose limbs say how far data decide them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.core.limb_chain import WALKER14
from pipeline.core.reconstructibility import light_of_mirror_margin
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import Made, Tables, walker_words
from pipeline.studies.options import LimbDataset, MotionsReport, MotionsSweep
from pipeline.validation import InvalidInput

if TYPE_CHECKING:
    from pipeline import recordings as recording

LIGHTS = {"green": "decided", "amber": "in_doubt", "red": "undecided"}
"""Colours of the lights."""

ROOT = WALKER15.index("pelvis")
TRACED = ("left_wrist", "right_wrist", "left_ankle", "right_ankle")
"""Joints whose whole trajectories are drawn."""


def options_of(made: Made) -> tuple[MotionsSweep, MotionsReport]:
    """The sweep's and the report's options; a InvalidInput if there are no instants to draw."""
    sweep, report = made.config.sweep, made.config.report
    if not isinstance(sweep, MotionsSweep) or not isinstance(report, MotionsReport):
        raise TypeError(f"motions are not made by {type(report).__name__} of {type(sweep).__name__}")
    if report.instants < 1:
        raise InvalidInput(
            "no instants", where="report.instants", expected="1 or more", received=str(report.instants)
        )
    return sweep, report


def lights(margins: np.ndarray) -> np.ndarray:
    """Traffic light of each mirror margin, of any shape."""
    flat = [light_of_mirror_margin(float(margin)) for margin in np.ravel(margins)]
    return np.array(flat).reshape(np.shape(margins))


def shown(made: Made) -> list[int]:
    """Which clips are drawn: of each word of the report the first whose action says so; if none does, the first."""
    _, report = options_of(made)
    actions = made.dataset.arrays["action"][made.sweep.arrays["stretch"]]
    found: list[int] = []
    for word in report.shown:
        number = next((n for n, action in enumerate(actions) if word.lower() in str(action).lower()), None)
        if number is not None and number not in found:
            found.append(number)
    return found or [0]


def upright_mm(made: Made, image: np.ndarray) -> np.ndarray:
    """An image (…, 2), px, to the right and up in mm at the camera's distance."""
    sweep, _ = options_of(made)
    return np.asarray(image * (sweep.distance_mm / sweep.focal_px) * [1.0, -1.0])


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """Every clip shown, from every camera: truth, reconstruction by lights, image, whole trajectories."""
    from pipeline import recordings as recording

    sweep = made.sweep.arrays
    clips, starts = (made.dataset.arrays[name][sweep["stretch"]] for name in ("clip", "start_s"))
    cameras = [str(camera) for camera in sweep["cameras"]]
    light = lights(sweep["mirror_margin"])
    numbers = shown(made)
    words = {n: walker_words(str(clips[n])) for n in numbers}
    if not isinstance(made.config.dataset, LimbDataset):
        raise TypeError("motions are stretches of limbs")
    frames, rate_hz = sweep["truth"].shape[1], made.config.dataset.frame_rate_hz
    index = {"time": np.arange(frames) / rate_hz}
    first = numbers[0]
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + "\nOther clips can be switched on in the streams tree; they stand over the origin by their "
        "mean pelvis: `world/truth/<clip>` (grey), `world/reconstructed/<camera>/<clip>/<light>`, "
        "`world/trajectories/<camera>/<clip>` of wrists and ankles.\n\nLimbs are green where the data have decided "
        "between a limb and its mirror, amber where they are in doubt, orange where both are as good.\n\n"
        "| clip | action | from | camera | error | light |\n|---|---|---|---|---|---|\n"
        + _lines(made_tables, words, clips, starts),
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        for n in numbers:
            shift = sweep["truth"][n, :, ROOT].mean(axis=0) * [1.0, 1.0, 0.0]
            truth = sweep["truth"][n] - shift
            rec.skeleton(f"world/truth/{words[n]}", truth, WALKER15.bones, index=index)
            _trace(rec, f"world/trajectories/truth/{words[n]}", truth, "original")
            for c, camera in enumerate(cameras):
                positions = sweep["positions"][n, c] - shift
                for name, colour in LIGHTS.items():
                    _limbs_of(
                        rec,
                        f"world/reconstructed/{camera}/{words[n]}/{name}",
                        positions,
                        light[n, c] == name,
                        index,
                        colour,
                    )
                _trace(rec, f"world/trajectories/{camera}/{words[n]}", positions, "blue")
                rec.image_points(
                    f"image/{camera}/{words[n]}",
                    upright_mm(made, sweep["images"][n, c]),
                    WALKER15.bones,
                    index=index,
                )
        columns = []
        for c, camera in enumerate(cameras):
            angle = float(sweep["azimuth_rad"][first, c]) + np.pi / 3
            columns.append(
                recording.Rows(recording.Space3D(
                            name=f"{camera} camera, seen from its left",
                            contents=(
                                "world/truth", f"world/reconstructed/{camera}", "world/trajectories/truth",
                                f"world/trajectories/{camera}",
                            ),
                            shown=(
                                f"world/truth/{words[first]}", f"world/reconstructed/{camera}/{words[first]}",
                                f"world/trajectories/truth/{words[first]}",
                                f"world/trajectories/{camera}/{words[first]}",
                            ),
                            eye_mm=(-2600.0 * float(np.sin(angle)), 2600.0 * float(np.cos(angle)), 1500.0),
                        ),
                        recording.Image2D(
                            name=f"image of the {camera} camera",
                            contents=(f"image/{camera}",),
                            shown=(f"image/{camera}/{words[first]}",),
                        ), shares=(3, 2))
            )  # fmt: skip
        rec.blueprint(
            recording.Columns(*columns, recording.Notes(), shares=[3] * len(columns) + [2]), playing=True
        )


def _lines(made_tables: Tables, words: dict[int, str], clips: np.ndarray, starts: np.ndarray) -> str:
    """Rows of the description: what each clip shown is, and how far it is off."""
    of_clips, lines = made_tables["table_clips"][0], []
    for n in words:
        for k in np.flatnonzero(of_clips["clip"] == clips[n]):
            lines.append(
                f"| {words[n]} | {of_clips['action'][k]} | {starts[n]:.1f} s | {of_clips['camera'][k]} | "
                f"{of_clips['error_mm'][k]:.0f} mm | {of_clips['light'][k]} |\n"
            )
    return "".join(lines)


def _limbs_of(
    rec: recording.Recording,
    entity: str,
    positions: np.ndarray,
    which: np.ndarray,
    index: dict[str, np.ndarray],
    colour: str,
) -> None:
    """Add those limbs (14,) of a skeleton that have one light, if there are any."""
    if not which.any():
        return
    bones = [(int(parent), int(child)) for parent, child in WALKER14.ends[which]]
    apart = np.full_like(positions, np.nan)
    held = sorted({joint for bone in bones for joint in bone})
    apart[:, held] = positions[:, held]
    rec.skeleton(entity, apart, bones, index=index, colour=colour, thickness_mm=9.0)


def _trace(rec: recording.Recording, entity: str, positions: np.ndarray, colour: str) -> None:
    """Add whole trajectories of wrists and ankles: one row at the beginning, which stands for all times."""
    frames = len(positions)
    points = np.concatenate([positions[:, WALKER15.index(joint)] for joint in TRACED])
    steps = [(k * frames + t, k * frames + t + 1) for k in range(len(TRACED)) for t in range(frames - 1)]
    rec.skeleton(entity, points[None], steps, index={"time": np.zeros(1)}, colour=colour, thickness_mm=2.0)
