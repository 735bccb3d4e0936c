"""Files of a reconstructed walk in one folder: summary, joints with bars, 3D motion, recording, page."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pipeline.resources import install_hint, missing_package
from pipeline.storage import tables
from pipeline.storage.publishing import publish
from pipeline.storage.sealed_folders import require_replaceable
from pipeline.validation import InvalidInput, Options, require_name
from walk3d.export.bvh import Names
from walk3d.film.reconstruct import cycle, motion, video, words
from walk3d.film.reconstruct.clip import Input, Walk, reconstruct_clip
from walk3d.film.reconstruct.model_file import SHIPPED
from walk3d.film.reconstruct.motion import Format
from walk3d.film.reconstruct.summary import summarise, table_rows
from walk3d.film.video import kept

PAGE = "walk.html"


class Output(Options):
    """What is written where."""

    path: str = ""  # folder; empty: results/reconstructed/<its folder>_<its name>
    formats: list[Format] = [Format.c3d, Format.trc, Format.bvh, Format.csv]  # of the walk in 3D
    names: Names = Names.ours  # of a BVH's joints, for retargeting: ours, mixamo, rokoko
    in_place: bool = False  # a BVH without the path
    recording: bool = True  # for the rerun viewer
    page: bool = True  # HTML with a player
    overlay: bool = True  # of a video: the skeleton over it


class Reconstruct(Options):
    """Options of the command ``reconstruct``."""

    input: Input = Input()
    output: Output = Output()
    model_folder: str = ""  # of a model of one's own; empty: the one that comes with the package


def run(
    options: Reconstruct,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> tuple[Walk, dict[str, Any], Path]:
    """Reconstruct a video, or a file or folder of keypoints, and write what was found.

    Parameters
    ----------
    options : Reconstruct
    tell, progress : callable
        Of a video: told what is fetched, and how many of how many frames are done.

    Returns
    -------
    walk : Walk
    summary : dict
        As written to ``summary.json``.
    folder : Path

    Raises
    ------
    InvalidInput
        If the input cannot be used, or the folder holds it, or files of others.
    """
    given = Path(options.input.path).resolve()
    folder = Path(options.output.path) if options.output.path else _default_folder(options.input.path)
    if options.input.path and folder.resolve() in (given, *given.parents):
        raise InvalidInput("must not hold the input", "output.path", received=folder, code="holds_input")
    require_replaceable(folder, having="verdict")
    model = Path(options.model_folder) if options.model_folder else SHIPPED
    with video.with_keypoints(options.input, folder, tell, progress) as keypoints:
        walk = reconstruct_clip(keypoints, model)
        summary = summarise(walk)
        with publish(folder, having="verdict") as publication:
            if video.is_video(options.input):
                kept.copy(Path(keypoints.path).parent, publication.folder)
            _fill(publication.folder, walk, summary, options)
            publication.facts = {"command": "reconstruct", "verdict": summary["verdict"]}
    return walk, summary, folder


def _default_folder(path: str) -> Path:
    resolved = Path(path).resolve()
    name = resolved.name if resolved.is_dir() else resolved.stem
    # Many are called alike: the folder above tells them apart.
    return Path("results") / "reconstructed" / require_name("output.path", f"{resolved.parent.name}_{name}")


def _fill(folder: Path, walk: Walk, summary: dict[str, Any], options: Reconstruct) -> None:
    text = json.dumps(summary, indent=1, ensure_ascii=False) + "\n"
    (folder / "summary.json").write_text(text, "utf-8")
    rows = table_rows(walk)
    if rows["frame"]:
        tables.write(folder / "joints.csv", rows)
        tables.write(folder / "angles.csv", cycle.angle_rows(walk))
    out = options.output
    motion.write_motion(walk, out.formats, folder, out.names, in_place=out.in_place)
    if not walk.best.walks:
        return
    tables.write(folder / "cycle.csv", cycle.curve_rows(cycle.curves(walk, walk.best.fitted)))
    tables.write(folder / "numbers.csv", cycle.number_rows(summary["gait_cycle"]["numbers"]))

    def recording(path: Path) -> None:
        from walk3d.film.reconstruct.recording import write_recording

        write_recording(walk, words.as_markdown(summary), path)

    def page(path: Path) -> None:
        from walk3d.film.reconstruct.page import page_of
        from walk3d.film.reconstruct.walk_page import write_walk_page

        files = sorted(file.name for file in folder.iterdir())
        shown = page_of(walk, summary, options.input.path, files)
        if (film := folder / video.OVERLAY).is_file():
            from walk3d.film.video.overlay import key_frames

            shown = replace(
                shown, pictures=key_frames(film, shown.frames.numbers, shown.frames.reprojection_px)
            )
        write_walk_page(path, shown)

    def overlay(path: Path) -> None:
        if video.is_video(options.input):
            video.overlay(walk, Path(options.input.path), path)

    # Imported where they are used: these libraries take longer to load than most walks to reconstruct.
    for name, wanted, write in (
        (video.OVERLAY, out.overlay, overlay),
        ("recording.rrd", out.recording, recording),
        (PAGE, out.page, page),
    ):
        try:
            if wanted:
                write(folder / name)
        except ModuleNotFoundError as error:
            if not (package := missing_package(error)):
                raise
            summary["notes"].append(f"No {name}: it needs {install_hint(package)}.")
