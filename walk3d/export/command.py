"""Command that exports a motion to a file: a recording, or a walker of a figure as recorded and as reconstructed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from pipeline import formats, mappings
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
from pipeline.core import fourier, resampling, walking
from pipeline.ingestion.joints import joints_of
from pipeline.skeleton import WALKER15
from pipeline.skeleton.body import accepted
from pipeline.skeleton.mapped_joints import map_joints, with_z_up
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.storage.publishing import new_file
from pipeline.validation import require_range
from walk3d.export.motion import WRITTEN, Motion, write


class Layout(StrEnum):
    """Rows of a CSV file: one for each point in each frame (long), or one for each frame (wide)."""

    long = "long"
    wide = "wide"


class Shown(StrEnum):
    """Choice of the motions of a figure's walker that are exported."""

    both = "both"
    original = "original"
    reconstructed = "reconstructed"


@dataclass
class Export:
    """Options of the command `export`.

    If an option is None, `synthesised` uses a default.
    """

    to: str = ""
    walker: str = ""
    view_angle_deg: float | None = None
    method: str = "map"
    motion: Shown = Shown.both
    cycles: float | None = None
    frame_rate_hz: float | None = None
    skeleton: str = ""
    units: str = ""
    subject: str = ""
    up: UpAxis = UpAxis.auto
    layout: Layout = Layout.long
    replace: bool = False


_KIND_OF_OPTION = dict.fromkeys(("walker", "view_angle_deg", "method", "motion"), "figure")
_KIND_OF_OPTION |= dict.fromkeys(("skeleton", "units", "subject", "up"), "recording")
"""Options that apply to only one kind of source, mapped to this kind."""

USAGE = "export FOLDER_OF_A_FIGURE|RECORDING [walker=…] [view_angle_deg=30] [method=map] to=walk.c3d"

MAX_FRAMES = 1_000_000
"""Largest number of frames to write."""
_CYCLES, _RATE_HZ = 3.0, 100.0
"""Default number of cycles and frame rate, Hz, of walkers synthesised from Fourier representations."""


def export(arguments: Sequence[str]) -> Path:
    """Write the motion that the arguments name; return the path of the file.

    Raises
    ------
    InvalidInput
        If an option is unknown or unusable, or the motion does not exist.
    """
    source_name, options = options_of(arguments, Export, usage=USAGE)
    kind = kind_of(source_name, arguments, _KIND_OF_OPTION)
    target = target_file(options.to, WRITTEN, USAGE, source_name, replace=options.replace)
    source = Path(source_name)
    if kind == "film":
        motion = synthesised([("", keypoint_walk(source))], options)
    elif kind == "figure":
        motion = reconstruction(source, options)
    elif options.cycles is not None:
        recording_options = {name: getattr(options, name) for name in ("skeleton", "units", "subject", "up")}
        walk = recorded_walk(source, **recording_options)
        motion = synthesised([("", walk)], options)
    else:
        motion = recording(source, options)
    with new_file(target, replace=options.replace, sources=[source_name]) as path:
        write(path, motion, wide=options.layout is Layout.wide)
    return target


def recording(source: Path, options: Export) -> Motion:
    """Return the points of a recording; with the option ``skeleton``, return its joints with z upwards.

    The frame rate is reduced if ``frame_rate_hz=`` is lower than that of the recording.

    If the file states no unit, the unit is inferred from the length of the legs, provided that a mapping fits the
    points. With ``up=`` points are also turned to z up.
    """
    read = formats.read(source, units=options.units or None, up=options.up)
    if options.subject and not options.skeleton:
        read = mappings.of_one_person(read, mappings.shipped().values(), options.subject)
    rate = read.frame_rate_hz
    requested_hz = rate if options.frame_rate_hz is None else options.frame_rate_hz
    rate_hz = float(require_range("frame_rate_hz", requested_hz, above=0, at_most=rate))
    count = int((len(read.positions_mm) - 1) * rate_hz / rate + 1e-9) + 1
    names, points, parents = read.names, read.positions_mm, None
    own_axes = not options.skeleton and options.up == UpAxis.auto
    if not own_axes and not options.skeleton:
        points = with_z_up(points, options.up)
    if not options.skeleton and read.units_assumed:
        sentence = f"The file states no unit; its numbers are taken as {read.units}, unless you add units=…."
        fit = mappings.suggest(read, mappings.shipped().values())
        if fit.usable:
            legs = walking.leg_length(map_joints(read, fit.mapping)[0])
            factor, sentence = mappings.rescaled(read, fit.mapping, legs)
            points = points * factor
        tell(sentence)
    if options.skeleton:
        mapped, joints, valid = joints_of(read, mappings.chosen(options.skeleton), options.subject)
        for note in mapped.notes[len(read.notes) :]:
            tell(note)
        for remark in accepted(joints, valid, rate, walk=False, up=options.up):
            tell(remark)
        available = np.flatnonzero(valid.any(axis=0)).tolist()
        parents = tuple(
            available.index(parent) if (parent := WALKER15.parents[joint]) in available else -1
            for joint in available
        )
        names, points = tuple(WALKER15.joints[joint] for joint in available), joints[:, available]
    if rate_hz < rate:
        points = resampling.interpolate(points, np.arange(count) * (rate / rate_hz))
    return Motion(names, points, rate_hz, parents, own_axes=own_axes)


def reconstruction(folder: Path, options: Export) -> Motion:
    """Return a walker from the folder of a figure, as recorded and as reconstructed from one view.

    Names of reconstructed joints end in the method, e.g. ``left_knee_map``.  Names of joints that no marker gives, and
    that were estimated, end in ``_estimated``.
    """
    figure = FigureWalkers(folder)
    walks = [] if options.motion is Shown.reconstructed else [("", figure.original(options.walker))]
    if options.motion is not Shown.original:
        reconstructed = figure.reconstructed(options.walker, options.method, options.view_angle_deg)
        walks.append((f"_{options.method}", reconstructed))
    return synthesised(walks, options)


def synthesised(walks: Sequence[tuple[str, Walk]], options: Export) -> Motion:
    """Return synthesised walkers as one motion, with the requested number of cycles and frame rate.

    The names of each walker's joints end in the suffix of this walker.
    """
    cycles = _CYCLES if options.cycles is None else options.cycles
    rate = _RATE_HZ if options.frame_rate_hz is None else options.frame_rate_hz
    require_range("cycles", cycles, above=0, at_most=10000)
    require_range("frame_rate_hz", rate, above=0, at_most=1e5)
    frames = round(cycles / walks[0][1].stride_hz * rate)
    require_range("cycles: frames", frames, at_least=2, at_most=MAX_FRAMES)
    times = np.arange(frames) / rate
    names: list[str] = []
    parents: list[int] = []
    for ending, walk in walks:
        parents += [parent + len(names) if parent >= 0 else -1 for parent in WALKER15.parents]
        names += [
            f"{joint}{ending}" + "_estimated" * bool(unmeasured)
            for joint, unmeasured in zip(WALKER15.joints, walk.unmeasured, strict=True)
        ]
    positions = [fourier.synthesise(walk.coefficients, walk.stride_hz, times) for _, walk in walks]
    return Motion(tuple(names), np.concatenate(positions, axis=1), rate, tuple(parents))


def export_motion(arguments: Sequence[str]) -> int:
    """Export the motion of a recording or of a figure's walker to a file: export SOURCE [OPTION=VALUE ...] to=FILE.

    SOURCE is the folder of a figure (zhang2007_fig5, …) or of `reconstruct`, or a recording that can be read.
    to=FILE.c3d, .trc (OpenSim: y up, x forward), .bvh (y up, z forward), .csv (layout=long|wide) or .npz.

    walker=… view_angle_deg=30 method=map   of a figure: walker, view and method of the reconstruction
    motion=both|original|reconstructed      of a figure; names of reconstructed joints end in the method: left_knee_map
    cycles=3 frame_rate_hz=100              number of cycles and frame rate; of a recording, of its steady walk
    skeleton=auto                           of a recording: joints instead of points
    units=m subject=… up=y                  of a recording: unit if not stated, one of several people, upward axis
    replace=true                            replace an existing file
    """
    tell(f"written: {export(arguments)}")
    return 0
