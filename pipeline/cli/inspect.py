"""Command `inspect`: content of recordings, the best mapping of markers to joints, and the next command to type."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pipeline import formats, mappings
from pipeline.cli.output import exists, tell_json, tell_section, tell_table
from pipeline.cli.walkers import options_of
from pipeline.clips.walks import walk_in
from pipeline.ingestion import joints, nearest_joints
from pipeline.ingestion.corpus import static_trials
from pipeline.ingestion.data import BY_FOLDER, WHOSE, FolderData
from pipeline.ingestion.joints import joints_of
from pipeline.skeleton.body import check, unit_of_leg
from pipeline.skeleton.joints import LEG_LENGTH_MM
from pipeline.skeleton.mapped_joints import plain_name, up_axis
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from pipeline.storage.publishing import new_file
from pipeline.validation import InvalidInput, bounded, listed


@dataclass
class Inspect:
    """Options of the command `inspect`.

    By default, the values in the file and the best mapping are used.
    """

    write: str = ""
    replace: bool = False
    details: bool = False
    skeleton: str = ""
    units: str = ""
    frame_rate_hz: Annotated[float, bounded(above=0, at_most=1e5)] | None = None
    subject: str = ""
    static: str = ""
    up: UpAxis = UpAxis.auto


@dataclass
class Findings:
    """Results of the inspection of one recording.

    Attributes
    ----------
    name : str
    lines : list of str
        Lines to print.
    refusal : str
        Reason why the recording is not a walk, or is not used; empty for a walk.
    mapping : str
        Mapping that fits; empty if none fits.
    joints : int
        Number of joints, of 15, that the mapping gives.
    strides : float
        Number of strides of steady walking; 0 without a walk.
    people : tuple of str
        Names of the people in a recording of several.
    """

    name: str
    lines: list[str] = field(default_factory=list)
    refusal: str = ""
    mapping: str = ""
    joints: int = 0
    strides: float = 0.0
    people: tuple[str, ...] = ()


def recordings(source: Path) -> list[Path]:
    """Return the sorted recordings in a folder and its subfolders, or a single file.

    Raises
    ------
    InvalidInput
        If the path does not exist or the folder contains no recording.
    """
    if source.is_file():
        return [source]
    if not source.is_dir():
        raise InvalidInput("there is no such file or folder", source, code="no_file")
    files = sorted(p for p in source.rglob("*") if formats.is_recording(p) and p.is_file())
    if not files:
        expected = "files ending in " + " ".join(formats.READERS)
        raise InvalidInput(
            "the folder has no motion capture (for keypoints of a video use `reconstruct`)",
            source,
            expected,
            code="no_recordings",
        )
    return files


def inspect(arguments: Sequence[str]) -> Iterator[Findings]:
    """Yield the findings on each recording that the arguments name; ``write=`` also saves a proposed mapping.

    Raises
    ------
    InvalidInput
        If an option is unknown, or there is no recording.
    """
    named, options = options_of(arguments, Inspect, usage="inspect PATH [write=my_lab.yaml]")
    source = Path(named)
    files = recordings(source)
    chosen = mappings.chosen(options.skeleton or mappings.AUTO)
    candidates = [chosen] if chosen else list(mappings.shipped().values())
    stated: dict[str, Any] = {"units": options.units or None, "frame_rate_hz": options.frame_rate_hz}
    statics = _statics(files)
    for path in files:
        findings = Findings(path.relative_to(source if source.is_dir() else path.parent).as_posix())
        try:
            motion = formats.read(path, **stated, up=options.up)
        except InvalidInput as refusal:
            findings.lines.append(f"cannot be read: {refusal}")
            findings.refusal = f"cannot be read: {_in_words(refusal.code)}"
            yield findings
            continue
        findings.lines += _of_file(motion, path.suffix)
        try:
            motion = _one_person(motion, candidates, options.subject, findings)
            noted, had_static = len(motion.notes), bool(options.static)
            if static := options.static:
                posture = joints.standing(Path(static), **stated)
                motion = joints.carry(motion, posture, Path(static).name, candidates)
            else:
                motion = joints.completed(motion, candidates, statics[path], **stated)
            findings.lines += motion.notes[noted:]
            had_static = had_static or len(motion.notes) > noted
            fit = mappings.suggest(motion, candidates)
        except InvalidInput as refusal:
            findings.lines.append(f"cannot be used: {refusal}")
            findings.refusal = f"cannot be used: {_in_words(refusal.code)}"
            if findings.people:
                findings.lines.append(f"next: {_again(path, f'subject={shlex.quote(findings.people[0])}')}")
            yield findings
            continue
        if fit.usable:
            _of_walk(motion, fit, path, options, findings)
        else:
            findings.lines += _of_no_mapping(motion, fit, path, had_static=had_static)
            findings.refusal = "no mapping fits"
        if target := options.write:
            _write(motion, Path(target), path, findings, replace=options.replace)
        elif not fit.usable and options.skeleton:
            findings.lines.append(f"complete the rules of {options.skeleton}: it needs {listed(fit.lacking)}")
        elif not fit.usable:
            findings.lines.append(f"next: {_again(path, 'write=my_lab.yaml')}")
        yield findings


def _in_words(code: str) -> str:
    """Return an error code as words, with blanks for underscores."""
    return code.replace("_", " ")


def _statics(files: Sequence[Path]) -> dict[Path, tuple[Path, ...]]:
    """Return, for each recording, the files that may be its static trial.

    The trials are searched among the inspected files, or in the folder of a single file.
    """
    if len(files) == 1:
        near = files[0].parent.iterdir()
        files = sorted({*files, *(p for p in near if formats.is_recording(p) and p.is_file())})
    return static_trials({path: _person(path.name) for path in files})


def _person(name: str, pattern: str = FolderData.person) -> str:
    """Return the person's name that a pattern finds in a file name; without a match, the whole file name."""
    match = re.search(pattern, name)
    return match[1] if match else name


def _of_no_mapping(motion: MotionCapture, fit: mappings.Fit, path: Path, *, had_static: bool) -> list[str]:
    """Return lines about a recording that no mapping fits: the nearest mapping, and markers that are not at joints."""
    lines = ["no mapping fits"]
    if fit.points:
        lacking = listed(fit.lacking)
        lines[0] += f"; the nearest is {fit.mapping.name}, which also needs: {lacking}"
    clusters = joints.technical_clusters(motion)
    on_both_sides = len({plain_name(motion.names[group[0]])[0] for group in clusters}) == 2
    if on_both_sides and not had_static:
        names = "; ".join(", ".join(motion.names[k] for k in group) for group in clusters[:4])
        lines += [
            f"marker clusters that move rigidly with a segment and mark no joint: {names}"
            + "; …" * (len(clusters) > 4),
            f"next: {_again(path, 'static=STANDING_TRIAL')}   (a trial with knees and ankles; it is found"
            " automatically if its name begins with the person's and contains the word static)",
        ]
    return lines


def summary(folder: Path, findings: Sequence[Findings]) -> list[str]:
    """Return the summary of a folder: number of files with walks, people, the next command, and unread files."""
    walks = [each for each in findings if each.strides]
    doubled = len({Path(each.name).name for each in findings}) < len(findings)
    who = sorted(
        {_person(each.name, BY_FOLDER) if doubled else _person(Path(each.name).name) for each in walks}
    )
    lines = [
        f"{len(walks)} of {len(findings)} files contain walks, of {len(who)} people: {listed(who)};"
        " details=true shows each file"
    ]
    if doubled:
        lines.append(f"(several folders have files of the same name: set data.person={WHOSE} in runs)")
    elif len(who) < len(walks) or len(who) < 3:
        lines.append(
            f"(the pattern data.person='{FolderData.person}' takes the person from the name of a file; with one folder"
            " per person use data.person='^(.+?)/')"
        )
    if len(who) >= 3:
        lines.append(
            "next: python -m pipeline experiment=zhang2007_fig5 data=folder"
            f" data.path={shlex.quote(str(folder))} skeleton=auto" + f" data.person='{BY_FOLDER}'" * doubled
        )
    else:
        lines.append(f"next: {_again(folder, 'details=true')}   (a figure needs walks of three people)")
    if others := _other_files(folder):
        lines.append(f"not read: {others}")
    return lines


def _other_files(folder: Path) -> str:
    """Return the number of unsupported files in a folder for each suffix, as text; empty if all are supported."""
    counts = Counter(
        p.suffix.lower() or "no suffix"
        for p in folder.rglob("*")
        if p.is_file()
        and not p.name.startswith(".")
        and not formats.is_recording(p)
        and p.suffix.lower() != ".asf"
    )
    return ", ".join(
        f"{count} {suffix}" + (f" ({formats.ADVICE[suffix]})" if suffix in formats.ADVICE else "")
        for suffix, count in sorted(counts.items())
    )


def _one_person(
    motion: MotionCapture, candidates: Sequence[SourceMapping], subject: str, findings: Findings
) -> MotionCapture:
    """Return the recording restricted to one person, and add the names of all people to the findings.

    Raises
    ------
    InvalidInput
        If no sample was measured, or `subject` does not select one of several people.
    """
    if not motion.valid.any():
        raise InvalidInput(
            "the recording has no measured samples: every sample of every point is missing",
            code="nothing_measured",
        )
    findings.people = tuple(mappings.people(motion, candidates))
    if findings.people:
        findings.lines.append(f"people: {', '.join(findings.people)}")
    noted = len(motion.notes)
    motion = mappings.of_one_person(motion, candidates, subject)
    findings.lines += motion.notes[noted:]
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


def _of_walk(
    motion: MotionCapture, fit: mappings.Fit, path: Path, options: Inspect, findings: Findings
) -> None:
    """Add to the findings the joints that the mapping gives, and the steady walk or the reason for its absence."""
    findings.mapping, findings.joints = fit.mapping.name, 15 - len(fit.missing)
    line = f"mapping: {fit.mapping.name}, {findings.joints} of 15 joints"
    if fit.missing:
        line += f"; estimated in walks: {', '.join(fit.missing)}"
    findings.lines.append(line)
    try:
        read, positions, valid = joints_of(motion, fit.mapping)
        findings.lines += read.notes[len(motion.notes) :]
        up = up_axis(motion, fit.mapping)
    except InvalidInput as refusal:
        findings.lines.append(str(refusal))
        findings.refusal = f"cannot be used: {_in_words(refusal.code)}"
        return
    findings.lines.append(f"axis up: {up}")
    walk = walk_in(path.name, positions, read.frame_rate_hz, valid, options.up)
    run = _run(path, options, findings.mapping)
    if walk.positions is None:
        reason, code, values = walk.row["reason"], walk.row["code"], walk.row["values"]
        if walk.row["leg_length_mm"] and joints.moves(positions) <= joints.MAX_MOTION:
            reason, code = "the person does not move: this may be a static trial", "nobody_moves"
            values = {}
        findings.lines += [
            complaint.sentence
            for complaint in check(positions, valid, read.frame_rate_hz, walk=False, up=options.up)
            if complaint.sentence != walk.row["reason"]
        ]
        findings.lines.append(f"not usable as a walk: {reason}")
        findings.refusal = f"not a walk: {_in_words(code)}"
        findings.lines.append(f"next: {_after_refusal(code, values, path, read.units, run)}")
        return
    findings.strides = walk.row["strides"]
    findings.lines.append(
        f"walk: {findings.strides:.1f} strides, {walk.row['locomotion']}, {walk.row['frequency_hz']:.2f} Hz"
        + (f"; {walk.row['reason']}" if walk.row["reason"] else "")
    )
    findings.lines.append(f"next (if the folder has recordings of at least three people): {run}")


def _run(path: Path, options: Inspect, mapping: str) -> str:
    """Return the command that makes a figure from the recordings in a folder."""
    stated = "".join(
        f" data.{name}={shlex.quote(f'{value:g}' if isinstance(value, float) else value)}"
        for name in ("units", "frame_rate_hz", "subject", "up")
        if (value := getattr(options, name)) and value != UpAxis.auto
    )
    skeleton = shlex.quote(options.skeleton or mapping)
    folder = shlex.quote(str(path.parent))
    return f"python -m pipeline experiment=zhang2007_fig5 data=folder data.path={folder}{stated} skeleton={skeleton}"


def _again(path: Path, option: str = "") -> str:
    """Return the command that inspects a recording again with a further option."""
    return f"python -m pipeline inspect {shlex.quote(str(path))} {option}".rstrip()


def _unit(leg: float) -> str:
    """Infer the unit of length of a file from a leg's length; return an empty text for a length of 0 or less."""
    low, high = LEG_LENGTH_MM
    return "mm" if low <= leg <= high else unit_of_leg(leg)


def _after_refusal(code: str, values: dict[str, Any], path: Path, units: str, run: str) -> str:
    """Return the next command, or advice, for a recording that is not usable as a walk."""
    if code == "unit" and (unit := _unit(values["leg_mm"] / formats.millimetres_in(units, path.name))):
        again = f"{_again(path, f'units={unit}')}   (data.units= in runs)"
        if path.suffix.lower() in (".csv", ".trc") and "/" in unit:
            again += (
                f"; keypoints of a video: python -m pipeline reconstruct input.path={shlex.quote(str(path))}"
            )
        return again
    if bounds := values.get("take"):
        return f"if it is a walk nevertheless: {run} {' '.join(bounds)}"
    return "figures of actions and limbs (mozerov2006, park2011) need all joints, but no walking"


def _write(motion: MotionCapture, target: Path, source: Path, findings: Findings, *, replace: bool) -> None:
    if target.suffix.lower() not in (".yaml", ".yml"):
        raise InvalidInput(
            "must be a file name that ends in .yaml", "write", received=target.name, code="unknown_format"
        )
    proposal = nearest_joints.propose(motion, target.stem)
    with new_file(target, replace=replace, sources=[source]) as path:
        path.write_text(nearest_joints.REMARK + mappings.written(proposal, motion), "utf-8")
    findings.lines.append(
        f"wrote {target}: {len(proposal.guessed)} of 15 joints, guessed from names and an average walker"
    )
    again = _again(source, f"skeleton={shlex.quote(str(target))}")
    findings.lines.append(f"next: {again}   (check the proposal first)")


def look(arguments: Sequence[str]) -> int:
    """Show points, mapping and walk of recordings, and the next command: inspect PATH [OPTION=VALUE ...].

    PATH is a file or a folder; subfolders are included.  A folder is shown as one table with one next command.  The
    exit status is 1 if no mapping fits any recording.
    --json prints name, lines, mapping, strides and people of each file for other programs.


    details=true          print what a single file shows for each file of a folder
    write=my_lab.yaml     write a proposed mapping of the file's points to joints, with every guess marked
    replace=true          let write= replace an existing file
    skeleton=…            use this shipped mapping or file.yaml; default: the mapping that fits best
    units=m               unit of a file that does not state one: mm, cm, m, in, ft
    frame_rate_hz=100     frame rate of a file that does not state one
    subject=…             name of the person, for a file of several people
    up=y                  axis of the file that points up: x, y, z, -x, -y, -z; default: from the joints
    static=standing.trc   standing trial with knee and ankle markers, for walks with marker clusters only; found
                          automatically if its name begins with the person's and contains the word static
    """

    as_json, arguments = "--json" in arguments, [item for item in arguments if item != "--json"]
    folder = next((Path(item) for item in arguments if exists(item) and Path(item).is_dir()), None)
    table, inspected = folder is not None and not {"details=true", "details=1"} & {*arguments}, []
    for findings in inspect(arguments):
        if not table and not as_json:
            tell_section(findings.name, findings.lines)
        inspected.append(findings)
    if as_json:
        tell_json([*map(asdict, inspected)])
    elif table:
        tell_table(("file", "mapping", "joints", "strides", "walk"), [*map(_row, inspected)])
    if folder is not None and not as_json:
        tell_section("summary", summary(folder, inspected))
    return (
        0 if any(each.mapping for each in inspected) or any(a.startswith("write=") for a in arguments) else 1
    )


def _row(findings: Findings) -> tuple[str, ...]:
    """Return the row for one recording in the table that summarises a folder."""
    strides = f"{findings.strides:.1f}" if findings.strides else ""
    joints_of_15 = str(findings.joints or "")
    return findings.name, findings.mapping, joints_of_15, strides, findings.refusal or "yes"
