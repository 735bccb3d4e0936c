"""Output folder of a reconstructed walk: summary, joints with error bars, 3D motion, recording, page."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

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
from walk3d.film.reconstruct.walk_page import MAX_FRAMES
from walk3d.film.video import cached
from walk3d.film.video.film import numbered
from walk3d.film.video.small import MAX_PICTURES, key_frames, small_pictures, thinned, walkers_part

PAGE = "walk.html"


class Output(Options):
    """Options of the output: the folder, and the files to write."""

    path: str = ""  # folder of the output; empty: results/reconstructed/<its folder>_<its name>
    formats: list[Format] = [Format.c3d, Format.trc, Format.bvh, Format.csv]  # file formats of the 3D walk
    names: Names = Names.ours  # joint names of the BVH, for retargeting: ours, mixamo, rokoko
    in_place: bool = False  # write the BVH without the path
    recording: bool = True  # write a recording for the rerun viewer
    page: bool = True  # write an HTML page with a player
    overlay: bool = True  # write the video with the skeleton over it


class Reconstruct(Options):
    """Options of the ``reconstruct`` command."""

    input: Input = Input()
    output: Output = Output()
    model_folder: str = ""  # folder of your own model; empty: the model that comes with the package


def run(
    options: Reconstruct,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> tuple[Walk, dict[str, Any], Path]:
    """Reconstruct the walk in a video, or in a file or folder of keypoints, and write the results.

    Parameters
    ----------
    options : Reconstruct
    tell, progress : callable
        For a video: called with messages on downloads, and with the numbers of processed and of all frames.

    Returns
    -------
    walk : Walk
    summary : dict
        Content of ``summary.json``.
    folder : Path

    Raises
    ------
    InvalidInput
        If the input cannot be used, or the output folder contains the input or unrelated files.
    """
    source = Path(options.input.path).resolve()
    folder = Path(options.output.path) if options.output.path else _default_folder(options.input.path)
    if options.input.path and folder.resolve() in (source, *source.parents):
        raise InvalidInput("must not contain the input", "output.path", received=folder, code="holds_input")
    require_replaceable(folder, having="verdict")
    model = Path(options.model_folder) if options.model_folder else SHIPPED
    with video.with_keypoints(options.input, folder, tell, progress) as keypoints:
        walk = reconstruct_clip(keypoints, model)
        summary = summarise(walk)
        with publish(folder, having="verdict") as publication:
            if video.is_video(options.input):
                cached.copy(Path(keypoints.path).parent, publication.folder)
            _fill(publication.folder, walk, summary, options)
            publication.facts = {"command": "reconstruct", "verdict": summary["verdict"]}
    return walk, summary, folder


def _default_folder(path: str) -> Path:
    resolved = Path(path).resolve()
    name = resolved.name if resolved.is_dir() else resolved.stem
    # Many files share a name: the folder above distinguishes them.
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

    small = _small_pictures(folder, walk, summary, options)

    def overlay(path: Path) -> None:
        if video.is_video(options.input):
            video.overlay(walk, _frames(folder, options), path)

    def recording(path: Path) -> None:
        from walk3d.film.reconstruct.recording import write_recording

        write_recording(walk, words.as_markdown(summary), path, small)

    def page(path: Path) -> None:
        from walk3d.film.reconstruct.page import page_of
        from walk3d.film.reconstruct.walk_page import write_walk_page

        files = sorted(file.name for file in folder.iterdir())
        content = page_of(walk, summary, options.input.path, files)
        if small:
            part = walkers_part(content.frames.reprojection_px, content.frames.image_px)
            content = replace(content, film=key_frames(small, part), film_part=part)
        write_walk_page(path, content)

    # Imported here: these libraries take longer to load than most walks take to reconstruct.
    for name, enabled, write in (
        (video.OVERLAY, out.overlay, overlay),
        ("recording.rrd", out.recording, recording),
        (PAGE, out.page, page),
    ):
        try:
            if enabled:
                write(folder / name)
        except ModuleNotFoundError as error:
            _note_missing(summary, name, error)


def _frames(folder: Path, options: Reconstruct) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the index and the image of each frame of the film."""
    return numbered(Path(options.input.path), cached.resampled_hz(folder))


def _small_pictures(
    folder: Path, walk: Walk, summary: dict[str, Any], options: Reconstruct
) -> dict[int, np.ndarray]:
    """Return reduced images of the film by frame index; empty if the input is keypoints or OpenCV is missing."""
    if not video.is_video(options.input) or not (options.output.recording or options.output.page):
        return {}
    numbers = thinned(thinned(walk.best.frames, MAX_FRAMES), MAX_PICTURES)
    try:
        return small_pictures(_frames(folder, options), numbers)
    except ModuleNotFoundError as error:
        _note_missing(summary, f"film in {PAGE} and recording.rrd", error)
        return {}


def _note_missing(summary: dict[str, Any], name: str, error: ModuleNotFoundError) -> None:
    """Add a note that a file is missing because a package is not installed; any other error is raised again."""
    if not (package := missing_package(error)):
        raise error
    summary["notes"].append(f"No {name}: it needs {install_hint(package)}.")
