"""Archives of full-scale results: a folder for each date and commit, with a subfolder for each data set.

``<archive>/<date>-<commit>/<data>/<figure>/…`` has the published files.  The folder of the data set also has their
digests in ``SHA256SUMS`` (checked by ``sha256sum -c SHA256SUMS``), and date and commit in a sealed ``manifest.json``.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline.reading import read_file
from pipeline.storage import provenance
from pipeline.storage import sealed_folders as folders
from pipeline.storage.crate import SBOM, bill_of_materials
from pipeline.storage.publishing import Publication, publish
from pipeline.validation import InvalidInput, is_relative, require_name

CHECKSUMS = "SHA256SUMS"

Files = dict[str, Path | bytes]
"""Files of an archive by name, each as the path of a file to copy or as the content of the file."""


def keep(
    source: Path,
    archive_root: Path,
    figures: Sequence[str],
    *,
    name: str,
    data: str,
    scale: str = "full",
    **traced: Any,
) -> Path:
    """Archive figures in ``<archive_root>/<name>/<data>`` and return that folder.

    An archive contains the files that the figures' manifests list, the tables of all figures, the lock file and its
    bill of materials.  Archiving the same results again changes nothing.

    Parameters
    ----------
    source : Path
        ``results/<data>/full``, or a run in ``results/scratch``.
    archive_root : Path
        Folder of all archives.
    figures : sequence of str
        Folders of the figures in `source`.
    name : str
        Name of the archive: ``<date>-<first 12 digits of the commit>``, or any plain name.
    data : str
        Name of the data set.
    scale : str
        Required scale of the figures; empty for any.
    **traced
        Facts as for `traced_files`.

    Raises
    ------
    InvalidInput
        As `traced_files`; also if the archive exists with other content or cannot be written.
    """
    target = archive_root / require_name("the archive's name", name) / data
    files = traced_files(source, figures, scale=scale, **traced)
    for figure in sorted(set(figures)):
        files |= {f"{figure}/{file}": source / figure / file for file in _listed(source / figure)}
    if target.exists():
        expected = {
            name: folders.digest(item) if isinstance(item, bytes) else folders.file_digest(item)
            for name, item in files.items()
        }
        if not (target / CHECKSUMS).is_file() or verify(target) or _read_sums(target) != expected:
            raise InvalidInput(
                "the archive already has different results for this date and commit",
                f"{name}/{data}",
                code="other_content",
            )
        return target
    with publish(target, having="archive") as publication:
        write_files(publication.folder, files)
        for figure in figures:
            if complaints := folders.complaints_about(publication.folder / figure):
                raise InvalidInput(
                    f"the figure changed while it was being archived: {complaints[0]}", figure, code="changed"
                )
        facts = {"archive": name, "data": data, "date": traced["date"], "commit": traced["commit"]}
        seal(publication, facts)
    return target


def write_files(folder: Path, files: Files) -> None:
    """Write files into the folder of an archive."""
    for name, item in files.items():
        copy = folder / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(item) if isinstance(item, bytes) else shutil.copyfile(item, copy)
        folders.sync(copy)


def seal(publication: Publication, facts: Mapping[str, Any]) -> dict[str, int]:
    """Write an archive's list of checksums, set the content of its manifest, and return each file's size in bytes."""
    folder = publication.folder
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    sums = "".join(f"{folders.file_digest(files[name])}  {name}\n" for name in sorted(files))
    folders.write_bytes(folder / CHECKSUMS, sums.encode())
    publication.facts = facts
    return {name: path.stat().st_size for name, path in files.items()}


def figures_of_run(run: Path) -> tuple[str, list[str]]:
    """Return the data set and the finished figures of a run with changed options, or of a multirun.

    Raises
    ------
    InvalidInput
        If the run has no finished figure, or figures of several data sets.
    """
    figures = sorted(path.parent for path in folders.visible(run, f"**/{folders.MANIFEST}"))
    data = {str(folders.read_manifest(figure).get("data")) for figure in figures}
    if len(data) != 1:
        what = "the run has figures of several data sets" if data else "the run has no finished figure"
        raise InvalidInput(
            what, run, received=", ".join(sorted(data)), code="mixed_data" if data else "no_figure"
        )
    return data.pop(), [figure.relative_to(run).as_posix() for figure in figures]


def traced_files(
    source: Path,
    figures: Sequence[str],
    *,
    date: str,
    commit: str,
    dirty: bool | str,
    lock: Path = provenance.LOCK,
    current: Collection[str] = (),
    scale: str = "full",
) -> Files:
    """Return the files of an archive except the figures, after checking that the origin of each figure is documented.

    The manifest of each figure must state its ``scale`` and, as ``provenance``, the facts of `provenance.provenance`.

    Parameters
    ----------
    source : Path
    figures : sequence of str
    date : str
        Date as ``2026-01-31``.
    commit : str
        Commit that is checked out, forty hexadecimal digits.
    dirty : bool or str
        Whether the working tree differs from that commit; only False is accepted.
    lock : Path
        Lock file with which the results were made.
    current : collection of str
        Figures that the sources of this commit would reproduce, by the keys of their stages.  These may come from
        another commit, which their manifests state.
    scale : str

    Raises
    ------
    InvalidInput
        If the tree is dirty, or a result is missing, unfinished, damaged, of another scale or from other sources.
    """
    if not re.fullmatch(r"\d{4}-\d{2}-\d{2}", date):
        raise InvalidInput(
            "the date of the archive is malformed", expected="2026-01-31", received=date, code="not_a_date"
        )
    if not re.fullmatch(r"[0-9a-f]{40}", commit):
        raise InvalidInput(
            "the archive needs a commit: run this in a git clone",
            expected="40 hexadecimal digits",
            received=commit or "none",
            code="not_a_commit",
            commit=commit,
        )
    if dirty is not False:
        raise InvalidInput(
            "the working tree has uncommitted changes, so the results cannot be traced: commit first",
            code="uncommitted_changes",
        )
    if not lock.is_file():
        raise InvalidInput(
            "the lock file with the versions of packages is missing", lock.name, code="no_file"
        )
    if not figures:
        raise InvalidInput("there is no figure to archive", source, code="no_figure")
    for figure in sorted(set(figures)):
        check_figure(source / figure, commit=commit, lock=lock, scale=scale, current=figure in current)
    tables = {path.name: path for path in folders.visible(source, "*.csv") if path.is_file()}
    return {lock.name: lock, SBOM: bill_of_materials(lock, commit), **tables}


def verify(archive: Path) -> list[str]:
    """Return the changes in an archive, one phrase per file; an empty list if nothing changed.

    Raises
    ------
    InvalidInput
        If the folder is not an archive, or its list of checksums is malformed.
    """
    if not (archive / CHECKSUMS).is_file():
        raise InvalidInput(f"the folder is not an archive: it has no {CHECKSUMS}", archive, code="no_archive")
    sums = _read_sums(archive)
    problems = []
    for name, expected in sorted(sums.items()):
        path = archive / name
        if not path.is_file():
            problems.append(f"{name}: missing")
            continue
        try:
            if folders.file_digest(path) != expected:
                problems.append(f"{name}: changed")
        except OSError as error:
            problems.append(f"{name}: cannot be read ({error.strerror})")
    present = {p.relative_to(archive).as_posix() for p in archive.rglob("*") if not p.is_dir()}
    added = sorted(present - sums.keys() - {CHECKSUMS, folders.MANIFEST})
    return [*problems, *(f"{name}: added" for name in added), *_not_sealed(archive, sums)]


def _not_sealed(archive: Path, sums: dict[str, str]) -> list[str]:
    """Return a complaint if an archive's manifest is damaged or contradicts the checksums; otherwise an empty list."""
    try:
        files = folders.read_manifest(archive)["files"].items()
    except InvalidInput as complaint:
        return [complaint.what]
    expected = {**sums, CHECKSUMS: folders.file_digest(archive / CHECKSUMS)}
    agree = {name: fact["sha256"] for name, fact in files} == expected
    return [] if agree else [f"{CHECKSUMS}: differs from {folders.MANIFEST}"]


def check_figure(folder: Path, *, commit: str, lock: Path, scale: str, current: bool) -> None:
    """Raise InvalidInput unless a folder has a finished figure of the given scale, lock file and commit.

    The figure must come from this commit, or be `current`: this commit's sources would reproduce it.  An empty scale
    stands for any.
    """
    where = f"{folder.parent.parent.name}/{folder.parent.name}/{folder.name}"
    if not folder.is_dir():
        raise InvalidInput("the figure has not been computed yet", where, code="not_made")
    if complaints := folders.complaints_about(folder):
        raise InvalidInput(f"the result is unfinished or damaged: {complaints[0]}", where, code="unfinished")
    manifest = folders.read_manifest(folder)
    origin = manifest.get("provenance", {})
    stated = (
        (
            "scale",
            scale or manifest.get("scale"),
            manifest.get("scale"),
            "only full-scale results are archived",
        ),
        (
            "commit",
            origin.get("commit") if current else commit,
            origin.get("commit"),
            "a commit with other sources made the result: make it again",
        ),
        ("dirty", False, origin.get("dirty"), "a working tree with uncommitted changes made the result"),
        (
            "lock_sha256",
            folders.file_digest(lock),
            origin.get("lock_sha256"),
            "another lock file made the result",
        ),
    )
    for name, expected, received, complaint in stated:
        if received != expected:
            raise InvalidInput(
                complaint,
                where,
                f"{name} {expected}",
                f"{name} {received}",
                code="other_origin",
                fact=name,
                made=received,
            )


def _listed(folder: Path) -> list[str]:
    """Return the names of the files that a figure's manifest lists, and the name of the manifest itself."""
    return [*sorted(folders.read_manifest(folder)["files"]), folders.MANIFEST]


def _read_sums(archive: Path) -> dict[str, str]:
    """Return the sha256 of each file, by file name, from the archive's list of checksums."""
    sums = {}
    content = read_file(archive / CHECKSUMS, subject="the list of checksums")
    text = content.decode("utf-8", errors="replace")
    for number, line in enumerate(text.splitlines(), start=1):
        match = re.fullmatch(r"([0-9a-f]{64})  (\S.*)", line)
        if not match or not is_relative(match[2]):
            raise InvalidInput(
                "the line does not contain the checksum of a file",
                f"{archive.name}/{CHECKSUMS}, line {number}",
                "64 hexadecimal digits, two spaces, a name inside the archive",
                code="not_understood",
            )
        sums[match[2]] = match[1]
    return sums
