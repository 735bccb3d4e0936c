"""Motion out: a walker of a figure, original and reconstructed, or any recording that can be read, as a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline import formats, mappings
from pipeline.clips.corpus import joints_of
from pipeline.core import camera, fourier
from pipeline.formats import motion as motions
from pipeline.formats.motion import Motion
from pipeline.skeleton import WALKER15
from pipeline.storage.store import packed
from pipeline.validation import InvalidInput, require_choice, require_range

OPTIONS = {
    "to": "", "walker": "", "view_angle_deg": "", "method": "map", "motion": "both", "cycles": "3",
    "frame_rate_hz": "100", "skeleton": "", "units": "", "layout": "long",
}  # fmt: skip
"""Options of the command and their defaults."""

MOST_FRAMES = 1_000_000


def export(arguments: Sequence[str]) -> Path:
    """Write the motion that the arguments name, and return the file.

    Raises
    ------
    InvalidInput
        If an option is unknown or unusable, or there is no such motion.
    """
    sources = [item for item in arguments if "=" not in item]
    given = dict(item.split("=", 1) for item in arguments if "=" in item)
    for name in given:
        require_choice("an option of export", name, list(OPTIONS))
    options = OPTIONS | given
    if len(sources) != 1 or not options["to"]:
        expected = (
            "export FOLDER_OF_A_FIGURE|RECORDING [walker=…] [view_angle_deg=30] [method=map] to=walk.c3d"
        )
        raise InvalidInput(
            "one source and to=FILE are needed", expected=expected, received=" ".join(arguments)[:80]
        )
    source, target = Path(sources[0]), Path(options["to"])
    if target.suffix.lower() not in (".c3d", ".trc", ".bvh", ".csv", ".npz"):
        received = target.suffix or "no suffix"
        raise InvalidInput("must end in .c3d, .trc, .bvh, .csv or .npz", where="to", received=received)
    if not target.parent.is_dir():
        raise InvalidInput("must be in a folder that exists", where="to", received=str(target.parent))
    motion = reconstruction(source, options) if source.is_dir() else recording(source, options)
    write(target, motion, wide=options["layout"] == "wide")
    return target


def recording(source: Path, options: dict[str, str]) -> Motion:
    """Return a recording: its points as they are, or with ``skeleton=`` the joints, z up."""
    read = formats.read(source, units=options["units"] or None)
    if not options["skeleton"]:
        return Motion(read.names, read.positions_mm, read.frame_rate_hz, None, own_axes=True)
    _, positions, valid = joints_of(read, mappings.chosen(options["skeleton"]))
    there = np.flatnonzero(valid.any(axis=0))
    place = {int(joint): k for k, joint in enumerate(there)}
    parents = tuple(place.get(WALKER15.parents[joint], -1) for joint in there)
    names = tuple(WALKER15.joints[joint] for joint in there)
    return Motion(names, positions[:, there], read.frame_rate_hz, parents)


def reconstruction(folder: Path, options: dict[str, str]) -> Motion:
    """Return a walker of a figure's folder, as recorded and as reconstructed from one view.

    A joint of the reconstruction is called after its method, ``left_knee_map``; one that was estimated because no
    marker gives it ends in ``_estimated``.
    """
    path = folder / "arrays.npz"
    needed = {"walker", "methods", "demonstration_view_deg", "missing", "original", "stride_hz", "unmeasured"}
    if not path.is_file():
        raise InvalidInput("this is no folder of a figure", where=str(folder), expected="arrays.npz in it")
    with np.load(path, allow_pickle=False) as stored:
        if lacking := needed - set(stored.files):
            expected = (
                "a folder of zhang2007_fig4, zhang2007_fig5, zhang2004_fig3 or zhang2004_fig4, made anew"
            )
            received = f"arrays.npz without {', '.join(sorted(lacking))}"
            what = "this figure holds no reconstructed motion"
            raise InvalidInput(what, where=str(folder), expected=expected, received=received)
        arrays = {name: stored[name] for name in needed}
    walkers, methods = arrays["walker"].tolist(), arrays["methods"].tolist()
    views = arrays["demonstration_view_deg"]
    r = walkers.index(require_choice("walker", options["walker"] or walkers[0], walkers))
    m = methods.index(require_choice("method", options["method"], methods))
    which = require_choice("motion", options["motion"], ("both", "original", "reconstructed"))
    wanted = (
        _number("view_angle_deg", options["view_angle_deg"]) if options["view_angle_deg"] else float(views[0])
    )
    near = np.flatnonzero(np.abs(views - wanted) < 1e-6)
    if not near.size:
        expected = (
            ", ".join(f"{view:g}" for view in views)
            + "; or make the figure with sweep.demonstration_views_deg"
        )
        raise InvalidInput("the figure holds no reconstruction from this view", where="view_angle_deg",
                           expected=expected, received=f"{wanted:g}")  # fmt: skip
    cycles = require_range("cycles", _number("cycles", options["cycles"]), above=0, at_most=10000)
    rate = require_range(
        "frame_rate_hz", _number("frame_rate_hz", options["frame_rate_hz"]), above=0, at_most=1e5
    )
    stride = float(arrays["stride_hz"][r])
    frames = round(cycles / stride * rate)
    require_range("cycles: frames", frames, at_least=2, at_most=MOST_FRAMES)
    times = np.arange(frames) / rate
    original, angle = arrays["original"][r], np.radians(wanted)
    again = camera.combine(camera.project(original, angle), arrays["missing"][m, r, int(near[0])], angle)
    marks = ["_estimated" if unmeasured else "" for unmeasured in arrays["unmeasured"][r]]
    names: list[str] = []
    blocks: list[np.ndarray] = []
    parents: list[int] = []
    for kind, coefficients in (("", original), (f"_{methods[m]}", again)):
        if which == ("reconstructed" if not kind else "original"):
            continue
        parents += [parent + len(names) if parent >= 0 else -1 for parent in WALKER15.parents]
        names += [f"{joint}{kind}{mark}" for joint, mark in zip(WALKER15.joints, marks, strict=True)]
        blocks.append(fourier.synthesise(coefficients, stride, times))
    return Motion(tuple(names), np.concatenate(blocks, axis=1), float(rate), tuple(parents))


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InvalidInput("must be a number", where=name, received=text[:40]) from None


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
