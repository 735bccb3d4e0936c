"""Motion out: a walker of a figure, original and reconstructed, or any recording that can be read, as a file."""

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
    """Rows of a CSV: a point of a frame, or a frame."""

    long = "long"
    wide = "wide"


class Shown(StrEnum):
    """Motion of a figure."""

    both = "both"
    original = "original"
    reconstructed = "reconstructed"


@dataclass
class Export:
    """Options of the command; the usual ones of None are said at `synthesised`."""

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


_OF = dict.fromkeys(("walker", "view_angle_deg", "method", "motion"), "figure")
_OF |= dict.fromkeys(("skeleton", "units", "subject", "up"), "recording")
"""Options that only some kinds of source have."""

USAGE = "export FOLDER_OF_A_FIGURE|RECORDING [walker=…] [view_angle_deg=30] [method=map] to=walk.c3d"

MOST_FRAMES = 1_000_000
_CYCLES, _RATE_HZ = 3.0, 100.0
"""Of walkers made of their Fourier representations, where nothing else is asked for."""


def export(arguments: Sequence[str]) -> Path:
    """Write the motion that the arguments name, and return the file.

    Raises
    ------
    InvalidInput
        If an option is unknown or unusable, or there is no such motion.
    """
    named, options = options_of(arguments, Export, usage=USAGE)
    kind = kind_of(named, arguments, _OF)
    target = target_file(options.to, WRITTEN, USAGE, named, replace=options.replace)
    source = Path(named)
    if kind == "film":
        motion = synthesised([("", keypoint_walk(source))], options)
    elif kind == "figure":
        motion = reconstruction(source, options)
    elif options.cycles is not None:
        stated = {name: getattr(options, name) for name in ("skeleton", "units", "subject", "up")}
        walk = recorded_walk(source, **stated)
        motion = synthesised([("", walk)], options)
    else:
        motion = recording(source, options)
    with new_file(target, replace=options.replace, sources=[named]) as path:
        write(path, motion, wide=options.layout is Layout.wide)
    return target


def recording(source: Path, options: Export) -> Motion:
    """Return a recording: its points as they are, or with ``skeleton=`` the joints, z up; at a lower rate if asked.

    A unit that the file does not state is that of human legs, if it is known which points they are.  With ``up=``
    points are turned to z up, too.
    """
    read = formats.read(source, units=options.units or None, up=options.up)
    if options.subject and not options.skeleton:
        read = mappings.of_one_person(read, mappings.shipped().values(), options.subject)
    rate = read.frame_rate_hz
    asked = rate if options.frame_rate_hz is None else options.frame_rate_hz
    wanted = float(require_range("frame_rate_hz", asked, above=0, at_most=rate))
    count = int((len(read.positions_mm) - 1) * wanted / rate + 1e-9) + 1
    names, points, parents = read.names, read.positions_mm, None
    own_axes = not options.skeleton and options.up == UpAxis.auto
    if not own_axes and not options.skeleton:
        points = with_z_up(points, options.up)
    if not options.skeleton and read.units_assumed:
        sentence = f"The file states no unit; its numbers are taken as {read.units}, or as units=… says."
        fit = mappings.suggest(read, mappings.shipped().values())
        if fit.usable:
            legs = walking.leg_length(map_joints(read, fit.mapping)[0])
            factor, sentence = mappings.rescaled(read, fit.mapping, legs)
            points = points * factor
        tell(sentence)
    if options.skeleton:
        known, joints, valid = joints_of(read, mappings.chosen(options.skeleton), options.subject)
        for decided in known.notes[len(read.notes) :]:
            tell(decided)
        for remark in accepted(joints, valid, rate, walk=False, up=options.up):
            tell(remark)
        there = np.flatnonzero(valid.any(axis=0)).tolist()
        parents = tuple(
            there.index(parent) if (parent := WALKER15.parents[joint]) in there else -1 for joint in there
        )
        names, points = tuple(WALKER15.joints[joint] for joint in there), joints[:, there]
    if wanted < rate:
        points = resampling.interpolate(points, np.arange(count) * (rate / wanted))
    return Motion(names, points, wanted, parents, own_axes=own_axes)


def reconstruction(folder: Path, options: Export) -> Motion:
    """Return a walker of a figure's folder, as recorded and as reconstructed from one view.

    A joint of the reconstruction is called after its method, ``left_knee_map``; one that was estimated because no
    marker gives it ends in ``_estimated``.
    """
    figure = FigureWalkers(folder)
    walks = [] if options.motion is Shown.reconstructed else [("", figure.original(options.walker))]
    if options.motion is not Shown.original:
        again = figure.reconstructed(options.walker, options.method, options.view_angle_deg)
        walks.append((f"_{options.method}", again))
    return synthesised(walks, options)


def synthesised(walks: Sequence[tuple[str, Walk]], options: Export) -> Motion:
    """Return walkers, each with the ending of its joints' names, for as many cycles and at the rate asked for."""
    cycles = _CYCLES if options.cycles is None else options.cycles
    rate = _RATE_HZ if options.frame_rate_hz is None else options.frame_rate_hz
    require_range("cycles", cycles, above=0, at_most=10000)
    require_range("frame_rate_hz", rate, above=0, at_most=1e5)
    frames = round(cycles / walks[0][1].stride_hz * rate)
    require_range("cycles: frames", frames, at_least=2, at_most=MOST_FRAMES)
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
    """Write a walker of a figure or a recording: export SOURCE [OPTION=VALUE ...] to=FILE.

    SOURCE is the folder of a figure (zhang2007_fig5, …) or of `reconstruct`, or a file that can be read.
    to=FILE.c3d, .trc (OpenSim: y up, x forward), .bvh (y up, z forward), .csv, .npz; layout=wide of a CSV.

    walker=… view_angle_deg=30 method=map   of a figure: who, reconstructed from which view, and how
    motion=both|original|reconstructed      of a figure; joints of a reconstruction end in its method: left_knee_map
    cycles=3 frame_rate_hz=100              so many cycles at this rate; of a recording, of its steady walk
    skeleton=auto                           of a recording: the joints in place of the points
    units=m subject=… up=y                  of a recording: its unit if not stated, one of several people, axis up
    replace=true                            a file that exists
    """
    tell(f"written: {export(arguments)}")
    return 0
