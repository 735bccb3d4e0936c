"""What is in the user's recordings, which mapping fits each, and what to type next."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pipeline import formats, mappings
from pipeline.cli.output import tell_section
from pipeline.cli.walkers import options_of
from pipeline.clips.walks import walk_in
from pipeline.ingestion import joints, nearest_joints
from pipeline.ingestion.corpus import static_trials
from pipeline.ingestion.data import BY_FOLDER, WHOSE, FolderData
from pipeline.ingestion.joints import joints_of
from pipeline.skeleton.body import check
from pipeline.skeleton.mapped_joints import plain_name, up_axis
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from pipeline.storage.publishing import new_file
from pipeline.validation import InvalidInput, bounded, listed


@dataclass
class Inspect:
    """Options of the command; empty: the file's own, or what fits."""

    write: str = ""
    replace: bool = False
    skeleton: str = ""
    units: str = ""
    frame_rate_hz: Annotated[float, bounded(above=0, at_most=1e5)] | None = None
    subject: str = ""
    static: str = ""
    up: UpAxis = UpAxis.auto


@dataclass
class Findings:
    """What was found in one recording, in lines to be printed.

    Attributes
    ----------
    name : str
    lines : list of str
    mapping : str
        Mapping that fits; empty if none does.
    strides : float
        Strides of steady walking; 0 if it holds none.
    people : tuple of str
        Who is in it, if there are several.
    """

    name: str
    lines: list[str] = field(default_factory=list)
    mapping: str = ""
    strides: float = 0.0
    people: tuple[str, ...] = ()


def recordings(source: Path) -> list[Path]:
    """Return the recordings of a folder, in order, or the one file.

    Raises
    ------
    InvalidInput
        If there is nothing of the kind.
    """
    if source.is_file():
        return [source]
    if not source.is_dir():
        raise InvalidInput("there is no such file or folder", source, code="no_file")
    found = sorted(p for p in source.rglob("*") if formats.is_recording(p) and p.is_file())
    if not found:
        expected = "files ending in " + " ".join(formats.READERS)
        raise InvalidInput(
            "no motion capture in the folder: keypoints of a film go to `reconstruct`",
            source,
            expected,
            code="no_recordings",
        )
    return found


def inspect(arguments: Sequence[str]) -> Iterator[Findings]:
    """Yield the findings on each recording that the arguments name, and write a proposal where one is asked for.

    Raises
    ------
    InvalidInput
        If an option is unknown, or there is no recording.
    """
    named, options = options_of(arguments, Inspect, usage="inspect PATH [write=my_lab.yaml]")
    source = Path(named)
    files = recordings(source)
    chosen = mappings.chosen(options.skeleton or mappings.AUTO)
    known = [chosen] if chosen else list(mappings.shipped().values())
    stated: dict[str, Any] = {"units": options.units or None, "frame_rate_hz": options.frame_rate_hz}
    statics = _statics(files)
    for path in files:
        found = Findings(path.relative_to(source if source.is_dir() else path.parent).as_posix())
        try:
            motion = formats.read(path, **stated, up=options.up)
        except InvalidInput as refusal:
            found.lines.append(f"cannot be read: {_found(refusal)}")
            yield found
            continue
        found.lines += _of_file(motion, path.suffix)
        try:
            motion = _one_person(motion, known, options.subject, found)
            noted = len(motion.notes)
            if static := options.static:
                posture = joints.standing(Path(static), **stated)
                motion = joints.carry(motion, posture, Path(static).name, known)
            else:
                motion = joints.completed(motion, known, statics[path], **stated)
            found.lines += motion.notes[noted:]
            fit = mappings.suggest(motion, known)
        except InvalidInput as refusal:
            found.lines.append(f"cannot be used: {refusal if found.people else _found(refusal)}")
            if found.people:
                found.lines.append(f"next: {_again(path, f'subject={shlex.quote(found.people[0])}')}")
            yield found
            continue
        if fit.usable:
            _of_walk(motion, fit, path, options, found)
        else:
            found.lines += _of_no_mapping(motion, fit, path)
        if target := options.write:
            _write(motion, Path(target), path, found, replace=options.replace)
        elif not fit.usable:
            found.lines.append(f"next: {_again(path, 'write=my_lab.yaml')}")
        yield found


def _statics(files: Sequence[Path]) -> dict[Path, tuple[Path, ...]]:
    """What may be the static trial of each recording: of those that are inspected, or of one file's folder."""
    if len(files) == 1:
        near = files[0].parent.iterdir()
        files = sorted({*files, *(p for p in near if formats.is_recording(p) and p.is_file())})
    return static_trials({path: _person(path.name) for path in files})


def _person(name: str, pattern: str = FolderData.person) -> str:
    """Whom the name of a file names by data.person."""
    match = re.search(pattern, name)
    return match[1] if match else name


def _found(refusal: object) -> str:
    """The sentence on what a file contains: nobody sent it."""
    return re.sub(r"(?<=\()received |(?<=, )received ", "found ", str(refusal))


def _of_no_mapping(motion: MotionCapture, fit: mappings.Fit, path: Path) -> list[str]:
    """Which mapping is nearest, if any point of it is there, and what marks no joint."""
    lines = ["no mapping fits"]
    if fit.points:
        lacking = listed(fit.lacking)
        lines[0] += f"; the nearest is {fit.mapping.name}, for which are missing: {lacking}"
    clusters = joints.technical_clusters(motion)
    if len({plain_name(motion.names[group[0]])[0] for group in clusters}) == 2:  # of both sides
        names = "; ".join(", ".join(motion.names[k] for k in group) for group in clusters[:4])
        lines += [
            f"clusters that move rigidly with a segment and mark no joint: {names}"
            + "; …" * (len(clusters) > 4),
            f"next: {_again(path, 'static=STANDING_TRIAL')}   (with knees and ankles;"
            " found by itself if its name begins with the person's and holds the word static)",
        ]
    return lines


def summary(folder: Path, found: Sequence[Findings]) -> list[str]:
    """Return what the recordings of a folder hold together, in lines to be printed."""
    walks = [one for one in found if one.strides]
    doubled = len({Path(one.name).name for one in found}) < len(found)
    who = sorted({_person(one.name, BY_FOLDER) if doubled else _person(Path(one.name).name) for one in walks})
    lines = [f"{len(walks)} of {len(found)} files hold walks, of {len(who)} people: {listed(who)}"]
    if doubled:
        lines.append(f"(files of one name in several folders: runs need data.person={WHOSE})")
    elif len(who) < len(walks) or len(who) < 3:
        lines.append(
            f"(a person is what data.person='{FolderData.person}' finds in the name of a file; with a folder for each"
            " person: data.person='^(.+?)/')"
        )
    if len(who) >= 3:
        lines.append(
            "next: python -m pipeline experiment=zhang2007_fig5 data=folder"
            f" data.path={shlex.quote(str(folder))} skeleton=auto" + f" data.person='{BY_FOLDER}'" * doubled
        )
    if others := _other_files(folder):
        lines.append(f"not read: {others}")
    return lines


def _other_files(folder: Path) -> str:
    """How many files of each suffix that no reader has lie below a folder; empty if there are none."""
    counts = Counter(
        p.suffix.lower() or "no suffix"
        for p in folder.rglob("*")
        if p.is_file()
        and not p.name.startswith(".")
        and not formats.is_recording(p)
        and p.suffix.lower() != ".asf"
    )
    return ", ".join(
        f"{count} of {suffix}" + (f" ({formats.ADVICE[suffix]})" if suffix in formats.ADVICE else "")
        for suffix, count in sorted(counts.items())
    )


def _one_person(
    motion: MotionCapture, known: Sequence[SourceMapping], subject: str, found: Findings
) -> MotionCapture:
    """The points of the person that is chosen, of a file of several, who are listed.

    Raises
    ------
    InvalidInput
        If nothing was measured, or nobody is chosen.
    """
    if not motion.valid.any():
        raise InvalidInput("no sample of any point was measured", code="nothing_measured")
    found.people = tuple(mappings.people(motion, known))
    if found.people:
        found.lines.append(f"people: {', '.join(found.people)}")
    noted = len(motion.notes)
    motion = mappings.of_one_person(motion, known, subject)
    found.lines += motion.notes[noted:]
    return motion


def _of_file(motion: MotionCapture, suffix: str) -> list[str]:
    frames, points = motion.valid.shape
    gaps = 100 * (1 - motion.valid.mean())
    unit = "no unit stated" if motion.units_assumed else f"unit {motion.units}"
    line = (
        f"{suffix.lstrip('.').lower()}: {points} points, {frames} frames at {motion.frame_rate_hz:.6g} Hz"
        f" ({frames / motion.frame_rate_hz:.1f} s), {unit}, {gaps:.1f} % of the samples missing"
    )
    return [line, f"points: {listed(motion.names)}", *motion.notes]


def _of_walk(motion: MotionCapture, fit: mappings.Fit, path: Path, options: Inspect, found: Findings) -> None:
    """What the mapping gives, and whether somebody walks steadily."""
    found.mapping = fit.mapping.name
    given = f"mapping: {fit.mapping.name}, {15 - len(fit.missing)} of 15 joints"
    if fit.missing:
        given += f"; estimated in walks: {', '.join(fit.missing)}"
    found.lines.append(given)
    try:
        read, positions, valid = joints_of(motion, fit.mapping)
        found.lines += read.notes[len(motion.notes) :]
        up = up_axis(motion, fit.mapping)
    except InvalidInput as refusal:
        found.lines.append(_found(refusal))
        return
    found.lines.append(f"axis up: {up}")
    walk = walk_in(path.name, positions, read.frame_rate_hz, valid, options.up)
    run = _run(path, options, found.mapping)
    if walk.positions is None:
        reason, code, values = _found(walk.row["reason"]), walk.row["code"], walk.row["values"]
        if walk.row["leg_length_mm"] and joints.moves(positions) <= joints.MAX_MOTION:
            reason, code = "nobody moves; it may be the static trial of other recordings", "nobody_moves"
            values = {}
        found.lines += [
            _found(complaint.sentence)
            for complaint in check(positions, valid, read.frame_rate_hz, walk=False, up=options.up)
            if complaint.sentence != walk.row["reason"]
        ]
        found.lines.append(f"not usable as a walk: {reason}")
        found.lines.append(f"next: {_after_refusal(code, values, path, options, run)}")
        return
    found.strides = walk.row["strides"]
    found.lines.append(
        f"walk: {found.strides:.1f} strides, {walk.row['locomotion']}, {walk.row['frequency_hz']:.2f} Hz"
        + (f"; {walk.row['reason']}" if walk.row["reason"] else "")
    )
    found.lines.append(f"next (with recordings of three people or more in the folder): {run}")


def _run(path: Path, options: Inspect, mapping: str) -> str:
    """The command that makes a figure of the folder's recordings."""
    stated = "".join(
        f" data.{name}={shlex.quote(f'{value:g}' if isinstance(value, float) else value)}"
        for name in ("units", "frame_rate_hz", "subject", "up")
        if (value := getattr(options, name)) and value != UpAxis.auto
    )
    skeleton = shlex.quote(options.skeleton or mapping)
    folder = shlex.quote(str(path.parent))
    return f"python -m pipeline experiment=zhang2007_fig5 data=folder data.path={folder}{stated} skeleton={skeleton}"


def _again(path: Path, option: str = "") -> str:
    """The command that inspects a recording with an option."""
    return f"python -m pipeline inspect {shlex.quote(str(path))} {option}".rstrip()


def _after_refusal(code: str, values: dict[str, Any], path: Path, options: Inspect, run: str) -> str:
    """What to do about a recording that is no walk."""
    if code == "unit" and options.units:
        return f"{_again(path)}   (without units={options.units})"
    if code == "unit":
        unit = values["unit"]
        option = f"units={unit or 'm (or cm, in …)'}"
        again = f"{_again(path, option)}   (data.units= in runs)"
        if path.suffix.lower() in (".csv", ".trc") and not unit:
            again += (
                f"; keypoints of a video: python -m pipeline reconstruct input.path={shlex.quote(str(path))}"
            )
        return again
    if bounds := values.get("take"):
        return f"if it is a walk all the same: {run} {' '.join(bounds)}"
    return "for actions and limbs (mozerov2006, park2011) all joints are needed, walking is not"


def _write(motion: MotionCapture, target: Path, source: Path, found: Findings, *, replace: bool) -> None:
    if target.suffix.lower() not in (".yaml", ".yml"):
        raise InvalidInput("must end in .yaml", "write", received=target.name, code="unknown_format")
    proposal = nearest_joints.propose(motion, target.stem)
    with new_file(target, replace=replace, sources=[source]) as path:
        path.write_text(nearest_joints.REMARK + mappings.written(proposal, motion), "utf-8")
    found.lines.append(
        f"proposed in {target}: {len(proposal.guessed)} of 15 joints, guessed from names and an average walker"
    )
    found.lines.append(f"next: check it, then skeleton={shlex.quote(str(target))}")


def look(arguments: Sequence[str]) -> int:
    """Print what recordings hold, which mapping fits and what to type next: inspect PATH [OPTION=VALUE ...].

    PATH is a file, or a folder with those below it.  Return 1 if no mapping fits any of them.

    write=my_lab.yaml     write a proposal of a mapping of the file's points to joints, every guess marked
    replace=true          in place of a file that exists
    skeleton=…            a mapping that ships, or a file.yaml, in place of the one that fits best
    units=m               of a file that does not state its unit: mm, cm, m, in, ft
    frame_rate_hz=100     of a file that does not state its rate
    subject=…             who, in a file of several people
    up=y                  axis of the file that points up: x, y, z, -x, -y, -z, in place of what the joints say
    static=standing.trc   a standing trial, whose markers of knees and ankles clusters of the walk carry along;
                          found by itself if its name begins with the person's and holds the word static
    """

    seen = []
    for found in inspect(arguments):
        tell_section(found.name, found.lines)
        seen.append(found)
    folder = next((Path(item) for item in arguments if Path(item).is_dir()), None)
    if folder is not None:
        tell_section("in all", summary(folder, seen))
    return 0 if any(one.mapping for one in seen) or any(a.startswith("write=") for a in arguments) else 1
