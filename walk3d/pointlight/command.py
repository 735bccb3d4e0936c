"""Command for point-light walkers of a recording, a figure, a 3D reconstruction, or an average walker."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np

from pipeline.cli.author import author_walk, write_mm
from pipeline.cli.output import tell
from pipeline.cli.walkers import (
    FigureWalkers,
    Walk,
    keypoint_walk,
    kind_of,
    options_of,
    recorded_walk,
    target_file,
)
from pipeline.core import fourier
from pipeline.skeleton import WALKER15
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.storage.publishing import new_file
from pipeline.validation import InvalidInput, bounded
from walk3d import pointlight
from walk3d.pointlight import Noise, PointLights


class Joints(StrEnum):
    """Choice of the joints that are shown as dots."""

    all = "all"
    measured = "measured"


_UpToThousand = Annotated[float, bounded(above=0, at_most=1000)]


@dataclass
class WalkOptions:
    """Options of the command that select the walk."""

    harmonics: Annotated[int, bounded(at_least=1, at_most=10)] = 2
    gender: float | None = None
    weight: float = 0.0
    nervous: float = 0.0
    happy: float = 0.0
    walker: str = ""
    method: str = ""
    from_view_deg: float | None = None
    skeleton: str = ""
    units: str = ""
    subject: str = ""
    up: UpAxis = UpAxis.auto


@dataclass
class ViewOptions:
    """Options of the view, the duration, the walking path and the joints."""

    view_angle_deg: Annotated[float, bounded(at_least=-360, at_most=360)] = 0.0
    cycles: _UpToThousand = 1.0
    frame_rate_hz: _UpToThousand = 60.0
    translating: bool = False
    speed_mm_s: Annotated[float, bounded(at_least=-20000, at_most=20000)] | None = None
    joints: Joints = Joints.all


@dataclass
class DisturbanceOptions:
    """Options that disturb the display: manipulations and noise dots."""

    seed: Annotated[int, bounded(at_least=0, at_most=2**63)] = 1
    inverted: bool = False
    mirrored: bool = False
    scrambled: bool = False
    phase_scrambled: bool = False
    lifetime_frames: Annotated[int, bounded(at_least=0, at_most=1e5)] = 0
    shown: int = 8
    noise_dots: int = 0
    noise: Noise = Noise.scrambled_walker
    field: float = 1.5


@dataclass
class FileOptions:
    """Options of the output file."""

    to: str = "walker.svg"
    height_px: int = 400
    dot_px: float = 4.0
    replace: bool = False


@dataclass
class Display(FileOptions, DisturbanceOptions, ViewOptions, WalkOptions):
    """All options of the command `pointlight`.

    The name of an option ends in its unit; `point_lights` explains the options.

    Options without bounds are checked when the display is made.
    """


_KIND_OF_OPTION = dict.fromkeys(("walker", "method", "from_view_deg"), "figure") | {
    "skeleton": "recording",
    "units": "recording",
    "subject": "recording",
    "up": "recording",
    "harmonics": "recording or film",
    **dict.fromkeys(("weight", "nervous", "happy"), "author"),
}
"""Options that apply to only one kind of source, mapped to this kind."""
_NEEDED_OPTION = {
    "shown": "lifetime_frames",
    "noise": "noise_dots",
    "field": "noise_dots",
    "speed_mm_s": "translating",
}
"""Options that have an effect only together with a second option, mapped to the second option."""

USAGE = "pointlight RECORDING|FOLDER|synthetic|author [view_angle_deg=90] [inverted=true] [noise_dots=60] to=walker.svg"

SUFFIXES = (".svg", ".csv", ".gif", ".ptd", ".mm")
"""Suffixes of the output file, each with its own format."""
_VIEW_OPTIONS = (
    "inverted", "mirrored", "scrambled", "phase_scrambled", "lifetime_frames", "noise_dots",
)  # fmt: skip


def make(arguments: Sequence[str]) -> tuple[Path, str]:
    """Write the point-light display that the arguments select; return its path and a description.

    Raises
    ------
    InvalidInput
        If an option is unknown or unusable, or the walker does not exist.
    """
    source, options = options_of(arguments, Display, usage=USAGE)
    kind = kind_of(source, arguments, _KIND_OF_OPTION)
    for name, other in _NEEDED_OPTION.items():
        if any(item.startswith(f"{name}=") for item in arguments) and not getattr(options, other):
            raise InvalidInput(
                f"has no effect without {other}", name, f"{other}=… as well", code="needs_another"
            )
    if Path(options.to).suffix.lower() in (".mp4", ".mov", ".webm", ".avi"):
        raise InvalidInput(
            "cannot write a video, since the package installs no video library",
            "to",
            "a .gif, which `ffmpeg -i walker.gif walker.mp4` converts; or .svg, .csv, .ptd, .mm",
            options.to,
            code="no_films",
            typed=True,
        )
    target = target_file(options.to, SUFFIXES, USAGE, source, replace=options.replace)
    walk = _walk(kind, Path(source), options)
    with new_file(target, replace=options.replace, sources=[source]) as path:
        words = (_in_space if path.suffix.lower() in (".ptd", ".mm") else _in_view)(path, walk, options)
    return target, words


def _in_view(target: Path, walk: Walk, options: Display) -> str:
    """Write the dots of a walk, as seen from one view, to a file; return a description of the display."""
    hundredths = max(
        2, round(100 / options.frame_rate_hz)
    )  # duration of a GIF's frame, hundredths of a second
    suffix = target.suffix.lower()
    if suffix == ".gif":
        options = replace(options, frame_rate_hz=100 / hundredths)
    lights = display(walk, options)
    height, dot = options.height_px, options.dot_px
    words = _words(walk, lights, options)
    if suffix == ".svg":
        target.write_text(pointlight.as_svg(lights, height_px=height, dot_px=dot, title=words), "utf-8")
    elif suffix == ".csv":
        target.write_text(pointlight.as_csv(lights), "utf-8")
    else:
        from walk3d.pointlight.picture import draw_gif

        places, size = pointlight.pixels(lights, height)
        draw_gif(target, places, size, dot_px=dot, hundredths=hundredths, comment=words)
    return words


def display(walk: Walk, options: Display) -> PointLights:
    """Return the point-light dots of a walk, with the selected manipulations and noise dots.

    Every disturbance has a separate generator, so that one does not change the random numbers of another.
    """
    phase, location, lifetime, noise = map(
        np.random.default_rng, np.random.SeedSequence(options.seed).spawn(4)
    )
    lights = pointlight.walker(
        walk.coefficients,
        walk.stride_hz,
        view_angle_rad=np.radians(options.view_angle_deg),
        cycles=options.cycles,
        frame_rate_hz=options.frame_rate_hz,
        speed_mm_s=_speed(walk, options),
        joints=~walk.unmeasured if options.joints is Joints.measured else None,
    )
    if options.phase_scrambled:
        lights = pointlight.phase_scrambled(lights, phase)
    if options.scrambled:
        lights = pointlight.scrambled(lights, location)
    if options.inverted:
        lights = pointlight.inverted(lights)
    if options.mirrored:
        lights = pointlight.mirrored(lights)
    all_lights, frames = lights, options.lifetime_frames
    if frames:
        lights = pointlight.limited_lifetime(lights, lifetime, lifetime_frames=frames, shown=options.shown)
    return pointlight.with_noise(
        lights,
        noise,
        dots=options.noise_dots,
        kind=options.noise,
        like=all_lights,
        field=options.field,
        lifetime_frames=frames,
    )


def _walk(kind: str, path: Path, options: WalkOptions) -> Walk:
    """Return the walk to display: synthetic, Troje's average walker, or from a figure, keypoints or a recording."""
    harmonics = options.harmonics
    if kind == "synthetic":
        gender = options.gender or 0.0
        coefficients, stride_hz = pointlight.synthetic_walker(gender)
        description = "average synthetic walker"
        description += f", {gender:+g} on the axis from women (-1) to men (+1)" if gender else ""
        return Walk(description, coefficients, stride_hz, np.zeros(15, bool))
    if kind == "author":
        axes = {name: getattr(options, name) or 0.0 for name in ("gender", "weight", "nervous", "happy")}
        return author_walk(**axes)
    if options.gender is not None:
        raise InvalidInput(
            "a recording has no gender axis: only the synthetic and the author's walker have one",
            "gender",
            "`pointlight synthetic gender=…` or `pointlight author gender=…`",
            code="no_gender",
        )
    if kind == "film":
        return keypoint_walk(path, harmonics=harmonics)
    if kind == "recording":
        return recorded_walk(
            path,
            skeleton=options.skeleton,
            units=options.units,
            subject=options.subject,
            up=options.up,
            harmonics=harmonics,
        )
    figure = FigureWalkers(path)
    if not options.method and options.from_view_deg is None:
        return figure.original(options.walker)
    return figure.reconstructed(options.walker, options.method or "map", options.from_view_deg)


def _speed(walk: Walk, options: ViewOptions) -> float:
    """Return the speed of the displayed walker, mm/s.

    It is 0 for a walk on the spot, otherwise the requested speed or the walk's speed.
    """
    if not options.translating:
        return 0.0
    if options.speed_mm_s is not None:
        return options.speed_mm_s
    return walk.speed_mm_s or pointlight.walking_speed(walk.coefficients, walk.stride_hz)


def _in_space(target: Path, walk: Walk, options: Display) -> str:
    """Write the joints in 3D, in the format of the Body Movement Library or the BioMotion Lab.

    Return a description.
    """
    suffix = target.suffix.lower()
    for name in _VIEW_OPTIONS:
        if getattr(options, name):
            format_name = suffix.lstrip(".").upper()
            raise InvalidInput(
                f"changes a view of the walk, but {format_name} files contain positions in three dimensions",
                name,
                "to=walker.csv",
                code="view_alone",
            )
    if suffix == ".mm":
        speed = _speed(walk, replace(options, translating=True))
        write_mm(target, walk, speed)
        return f"{walk.name}: Fourier series, mm, x forwards, z up, {speed / 1000:.2f} m/s"
    count = max(round(options.cycles / walk.stride_hz * pointlight.files.PTD_RATE_HZ), 2)
    times = np.arange(count) / pointlight.files.PTD_RATE_HZ
    positions = fourier.synthesise(walk.coefficients, walk.stride_hz, times)
    positions[..., 1] += (_speed(walk, options) * times)[:, None]
    target.write_text(pointlight.as_ptd(positions), "utf-8")
    return f"{walk.name}: {count} frames at 60 Hz in three dimensions, inches, z up"


def _words(walk: Walk, lights: PointLights, options: Display) -> str:
    """Return a description of the display in one sentence."""
    parts = [name.replace("_", " ") for name in ("inverted", "mirrored", "scrambled", "phase_scrambled", "translating")
            if getattr(options, name)]  # fmt: skip
    if options.lifetime_frames:
        parts.append(f"{options.shown} dots that live {options.lifetime_frames} frames")
    if options.noise_dots:
        parts.append(f"among {options.noise_dots} noise dots ({options.noise.replace('_', ' ')})")
    if estimated := [WALKER15.joints[j] for j in np.flatnonzero(walk.unmeasured)]:
        parts.append(
            ("without " if options.joints is Joints.measured else "with estimated ") + ", ".join(estimated)
        )
    frames = len(lights.positions)
    length = f"{frames} frames at {lights.frame_rate_hz:g} Hz{', a loop' if lights.loops else ''}"
    view = f"seen from {options.view_angle_deg:g}°"
    return f"{walk.name}: {', '.join([view, *parts, length, f'seed {options.seed}'])}"


def point_lights(arguments: Sequence[str]) -> int:
    """Write a point-light walker: pointlight RECORDING|FOLDER|synthetic|author [OPTION=VALUE ...] [to=walker.svg].

    RECORDING is any recording that can be read; FOLDER is that of a figure (zhang2007_fig5, …) or of `reconstruct`.
    author is the average walker of the second author's laboratory (`make data ARGS=author`).
    to=FILE.svg is animated in a browser, .csv has a row for each frame and dot; .gif; .ptd (Body Movement Library, 3D);
    .mm (Fourier series of the BioMotion Lab, 3D).

    view_angle_deg=0        0 frontal, -90 left profile, 90 right profile
    cycles=1 frame_rate_hz=60 harmonics=2 seed=1 height_px=400 dot_px=4 joints=all|measured
    inverted=true mirrored=true         upside down; left and right exchanged
    scrambled=true phase_scrambled=true each dot at a random position; each dot at a random phase
    lifetime_frames=6 shown=8           8 dots at a time, each at another joint after 6 frames
    noise_dots=60 noise=scrambled_walker|uniform field=1.5
    translating=true [speed_mm_s=1300]  over the ground instead of on a treadmill
    walker=… [method=map from_view_deg=30]  of a figure: as recorded, or as reconstructed from a view
    gender=3                            of `synthetic`: -1 the average woman, 1 the average man; of `author` from -6
                                        (women) to 6 (men), in the units of its own axis
    weight=3 nervous=-2 happy=6         of `author`: from -6 to 6
    skeleton=… units=m subject=… up=y   of a recording; subject= if it has several people
    replace=true                        replace an existing file
    """
    target, words = make(arguments)
    tell(f"written: {target} ({words})")
    return 0
