"""Motion out: a walker of a figure, original and reconstructed, or any recording that can be read, as a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline import formats, mappings
from pipeline.cli.output import tell
from pipeline.cli.walkers import (
    FigureWalkers,
    Walk,
    keypoint_walk,
    number,
    options_of,
    recorded_walk,
    target_file,
    yes,
)
from pipeline.core import fourier, resampling
from pipeline.formats import motion as motions
from pipeline.formats.motion import Motion
from pipeline.ingestion.corpus import joints_of
from pipeline.skeleton import WALKER15
from pipeline.storage.artefacts import packed
from pipeline.storage.publishing import new_file
from pipeline.validation import require_choice, require_range

OPTIONS = {
    "to": "", "walker": "", "view_angle_deg": "", "method": "map", "motion": "both", "cycles": "",
    "frame_rate_hz": "", "skeleton": "", "units": "", "subject": "", "layout": "long", "replace": "false",
}  # fmt: skip
"""Options of the command and their defaults."""

USAGE = "export FOLDER_OF_A_FIGURE|RECORDING [walker=…] [view_angle_deg=30] [method=map] to=walk.c3d"

MOST_FRAMES = 1_000_000
_CYCLES, _RATE_HZ = "3", "100"
"""Of walkers made of their Fourier representations, where nothing else is asked for."""


def export(arguments: Sequence[str]) -> Path:
    """Write the motion that the arguments name, and return the file.

    Raises
    ------
    InvalidInput
        If an option is unknown or unusable, or there is no such motion.
    """
    named, options = options_of(arguments, OPTIONS, "export", usage=USAGE)
    target = target_file(options, (".c3d", ".trc", ".bvh", ".csv", ".npz"), USAGE, named)
    require_choice("layout", options["layout"], ("long", "wide"))
    source = Path(named)
    if (source / "joints.csv").is_file():
        motion = synthesised([("", keypoint_walk(source))], options)
    elif source.is_dir():
        motion = reconstruction(source, options)
    elif options["cycles"]:
        skeleton, units, subject = (options[name] for name in ("skeleton", "units", "subject"))
        walk = recorded_walk(source, skeleton=skeleton, units=units, subject=subject)
        motion = synthesised([("", walk)], options)
    else:
        motion = recording(source, options)
    with new_file(target, replace=yes("replace", options["replace"]), sources=[named]) as path:
        write(path, motion, wide=options["layout"] == "wide")
    return target


def recording(source: Path, options: dict[str, str]) -> Motion:
    """Return a recording: its points as they are, or with ``skeleton=`` the joints, z up; at a lower rate if asked."""
    read = formats.read(source, units=options["units"] or None)
    if options["subject"] and not options["skeleton"]:
        read = mappings.of_one_person(read, mappings.shipped().values(), options["subject"])
    rate = read.frame_rate_hz
    wanted = number("frame_rate_hz", options["frame_rate_hz"] or repr(rate), above=0, at_most=rate)
    count = int((len(read.positions_mm) - 1) * wanted / rate + 1e-9) + 1
    at = np.arange(count) * (rate / wanted)
    fewer, rate = wanted < rate, wanted
    if not options["skeleton"]:
        points = resampling.interpolate(read.positions_mm, at) if fewer else read.positions_mm
        return Motion(read.names, points, rate, None, own_axes=True)
    _, positions, valid = joints_of(read, mappings.chosen(options["skeleton"]), options["subject"])
    there = np.flatnonzero(valid.any(axis=0))
    place = {int(joint): k for k, joint in enumerate(there)}
    parents = tuple(place.get(WALKER15.parents[joint], -1) for joint in there)
    names = tuple(WALKER15.joints[joint] for joint in there)
    joints = resampling.interpolate(positions, at) if fewer else positions
    return Motion(names, joints[:, there], rate, parents)


def reconstruction(folder: Path, options: dict[str, str]) -> Motion:
    """Return a walker of a figure's folder, as recorded and as reconstructed from one view.

    A joint of the reconstruction is called after its method, ``left_knee_map``; one that was estimated because no
    marker gives it ends in ``_estimated``.
    """
    figure = FigureWalkers(folder)
    which = require_choice("motion", options["motion"], ("both", "original", "reconstructed"))
    walks = [] if which == "reconstructed" else [("", figure.original(options["walker"]))]
    if which != "original":
        view = options["view_angle_deg"]
        again = figure.reconstructed(
            options["walker"], options["method"], number("view_angle_deg", view) if view else None
        )
        walks.append((f"_{options['method']}", again))
    return synthesised(walks, options)


def synthesised(walks: Sequence[tuple[str, Walk]], options: dict[str, str]) -> Motion:
    """Return walkers, each with the ending of its joints' names, for as many cycles and at the rate asked for."""
    cycles = number("cycles", options["cycles"] or _CYCLES, above=0, at_most=10000)
    rate = number("frame_rate_hz", options["frame_rate_hz"] or _RATE_HZ, above=0, at_most=1e5)
    frames = round(cycles / walks[0][1].stride_hz * rate)
    require_range("cycles: frames", frames, at_least=2, at_most=MOST_FRAMES)
    times = np.arange(frames) / rate
    names: list[str] = []
    parents: list[int] = []
    for ending, walk in walks:
        parents += [parent + len(names) if parent >= 0 else -1 for parent in WALKER15.parents]
        marks = ["_estimated" if unmeasured else "" for unmeasured in walk.unmeasured]
        names += [f"{joint}{ending}{mark}" for joint, mark in zip(WALKER15.joints, marks, strict=True)]
    positions = [fourier.synthesise(walk.coefficients, walk.stride_hz, times) for _, walk in walks]
    return Motion(tuple(names), np.concatenate(positions, axis=1), rate, tuple(parents))


def write(target: Path, motion: Motion, *, wide: bool = False) -> None:
    """Write points in the format of the suffix: as `pipeline.formats.motion` has it, or arrays of numpy."""
    if target.suffix.lower() != ".npz":
        motions.write(target, motion, wide=wide)
        return
    arrays = {
        "names": np.array(motion.names),
        "positions_mm": motion.positions,
        "frame_rate_hz": np.array(motion.frame_rate_hz),
    }
    target.write_bytes(packed(arrays))


def export_motion(arguments: Sequence[str]) -> int:
    """Write a walker of a figure or a recording: export SOURCE [OPTION=VALUE ...] to=FILE.

    SOURCE is the folder of a figure (zhang2007_fig5, …) or of `reconstruct`, or a file that can be read.
    to=FILE.c3d, .trc (OpenSim: y up, x forward), .bvh (y up, z forward), .csv, .npz; layout=wide of a CSV.

    walker=… view_angle_deg=30 method=map   of a figure: who, reconstructed from which view, and how
    motion=both|original|reconstructed      of a figure; joints of a reconstruction end in its method: left_knee_map
    cycles=3 frame_rate_hz=100              so many cycles at this rate; of a recording, of its steady walk
    skeleton=auto                           of a recording: the joints in place of the points
    units=m subject=…                       of a recording that does not state its unit; that has several people
    replace=true                            a file that exists
    """
    tell(f"written: {export(arguments)}")
    return 0
