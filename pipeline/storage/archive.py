"""Archives of full-scale results: a folder for each date and commit, and in it one for each data set.

``<archive>/<date>-<commit>/<data>/<figure>/…`` holds the published files, ``SHA256SUMS`` in the folder of the data set
their digests (``sha256sum -c SHA256SUMS`` checks them), and a sealed ``manifest.json`` beside it date and commit.
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
"""Files by their names in an archive, or their content."""


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

    Archived are the files that each figure's manifest lists, the tables beside the figures, the lock file and its
    bill of materials.  Archiving the same results again changes nothing.

    Parameters
    ----------
    source : Path
        ``results/<data>/full``, or a run of ``results/scratch``.
    archive_root : Path
        Folder of all archives.
    figures : sequence of str
        Folders of figures that must be in `source`.
    name : str
        A plain name: ``<date>-<first 12 digits of the commit>``, or one of your own.
    data : str
        Of the data set.
    scale : str
        At which the figures must be; empty: at any.
    **traced
        As for `traced_files`.

    Raises
    ------
    InvalidInput
        As `traced_files`; if the archive has other content already; or it cannot be written.
    """
    target = archive_root / require_name("the archive's name", name) / data
    files = traced_files(source, figures, scale=scale, **traced)
    for figure in sorted(set(figures)):
        files |= {f"{figure}/{one}": source / figure / one for one in _listed(source / figure)}
    if target.exists():
        wanted = {
            name: folders.digest(item) if isinstance(item, bytes) else folders.file_digest(item)
            for name, item in files.items()
        }
        if not (target / CHECKSUMS).is_file() or verify(target) or _read_sums(target) != wanted:
            raise InvalidInput(
                "the archive already holds other results of this date and commit",
                f"{name}/{data}",
                "the same files, or none",
                code="other_content",
            )
        return target
    with publish(target, having="archive") as publication:
        write_files(publication.folder, files)
        for figure in figures:
            if complaints := folders.complaints_about(publication.folder / figure):
                raise InvalidInput(
                    f"changed while it was being archived: {complaints[0]}", figure, code="changed"
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
    """Write the list of checksums of an archive and give its manifest these facts; return the bytes of each file."""
    folder = publication.folder
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    sums = "".join(f"{folders.file_digest(files[name])}  {name}\n" for name in sorted(files))
    folders.write_bytes(folder / CHECKSUMS, sums.encode())
    publication.facts = facts
    return {name: path.stat().st_size for name, path in files.items()}


def figures_of_run(run: Path) -> tuple[str, list[str]]:
    """Return the data set of a run with changed options, or of a multirun, and the finished figures below it.

    Raises
    ------
    InvalidInput
        If nothing finished is there or the figures are of several data sets.
    """
    found = sorted(path.parent for path in folders.visible(run, f"**/{folders.MANIFEST}"))
    data = {str(folders.read_manifest(figure).get("data")) for figure in found}
    if len(data) != 1:
        what = "figures of several data sets" if data else "no finished figure is there"
        raise InvalidInput(
            what, run, received=", ".join(sorted(data)), code="mixed_data" if data else "no_figure"
        )
    return data.pop(), [figure.relative_to(run).as_posix() for figure in found]


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
    """Return what every archive of figures holds beside them, if all of it can be traced.

    Each figure's manifest must state its ``scale`` and, under ``provenance``, what `provenance.provenance` returns.

    Parameters
    ----------
    source : Path
    figures : sequence of str
    date : str
        ``2026-01-31``.
    commit : str
        The commit that is checked out, forty hexadecimal digits.
    dirty : bool or str
        Whether the working tree differs from that commit; anything but False is refused.
    lock : Path
        The lock file that the results were made with.
    current : collection of str
        Figures that the sources of this commit would make again as they are, by the keys of their stages: these may
        come from another commit, which their manifests name.
    scale : str

    Raises
    ------
    InvalidInput
        If the tree is dirty; or a result is missing, unfinished, damaged, of another scale or made by other sources.
    """
    if not re.fullmatch(r"\d{4}-\d{2}-\d{2}", date):
        raise InvalidInput(
            "the archive's date is not a date", expected="2026-01-31", received=date, code="not_a_date"
        )
    if not re.fullmatch(r"[0-9a-f]{40}", commit):
        raise InvalidInput(
            "the archive needs a commit",
            expected="40 hexadecimal digits",
            received=commit or "none",
            code="not_a_commit",
            commit=commit,
        )
    if dirty is not False:
        raise InvalidInput(
            "the tree differs from its commit, so the results could not be traced: commit first",
            expected="a clean tree",
            received=f"dirty = {dirty}",
            code="uncommitted_changes",
        )
    if not lock.is_file():
        raise InvalidInput("the lock file is missing", lock.name, code="no_file")
    if not figures:
        raise InvalidInput("no figure is expected, so there is nothing to keep", source, code="no_figure")
    for figure in sorted(set(figures)):
        check_figure(source / figure, commit=commit, lock=lock, scale=scale, current=figure in current)
    beside = {path.name: path for path in folders.visible(source, "*.csv") if path.is_file()}
    return {lock.name: lock, SBOM: bill_of_materials(lock, commit), **beside}


def verify(archive: Path) -> list[str]:
    """Return what changed in an archive, one sentence per file; an empty list if nothing did.

    Raises
    ------
    InvalidInput
        If the folder is no archive, or its list of checksums cannot be understood.
    """
    if not (archive / CHECKSUMS).is_file():
        raise InvalidInput("this is no archive", archive, f"a folder with {CHECKSUMS}", code="no_archive")
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
    """Return how the manifest of an archive differs from its list of checksums."""
    try:
        files = folders.read_manifest(archive)["files"].items()
    except InvalidInput as complaint:
        return [f"{folders.MANIFEST}: {complaint.what.removeprefix(folders.MANIFEST).strip()}"]
    expected = {**sums, CHECKSUMS: folders.file_digest(archive / CHECKSUMS)}
    agree = {name: fact["sha256"] for name, fact in files} == expected
    return [] if agree else [f"{CHECKSUMS}: not what {folders.MANIFEST} recorded"]


def check_figure(folder: Path, *, commit: str, lock: Path, scale: str, current: bool) -> None:
    """Require a finished result, made with this lock file, at this scale (empty: at any).

    It must be of this commit, or `current`: such that this commit's sources would make the same.
    """
    where = f"{folder.parent.parent.name}/{folder.parent.name}/{folder.name}"
    if not folder.is_dir():
        raise InvalidInput("the figure has not been made", where, code="not_made")
    if complaints := folders.complaints_about(folder):
        raise InvalidInput(f"the result is unfinished or damaged: {complaints[0]}", where, code="unfinished")
    manifest = folders.read_manifest(folder)
    made = manifest.get("provenance", {})
    stated = (
        (
            "scale",
            scale or manifest.get("scale"),
            manifest.get("scale"),
            "only full-scale results are archived",
        ),
        (
            "commit",
            made.get("commit") if current else commit,
            made.get("commit"),
            "the result was made by another commit, whose sources differ: make it again",
        ),
        ("dirty", False, made.get("dirty"), "the result was made by a tree that differs from its commit"),
        (
            "lock_sha256",
            folders.file_digest(lock),
            made.get("lock_sha256"),
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
    """Return the names of the files that a figure's manifest lists, and of the manifest."""
    return [*sorted(folders.read_manifest(folder)["files"]), folders.MANIFEST]


def _read_sums(archive: Path) -> dict[str, str]:
    """Return the sha256 of each file, by its name in the archive."""
    sums = {}
    try:
        text = read_file(archive / CHECKSUMS).decode("utf-8", errors="replace")
    except InvalidInput as error:
        raise InvalidInput(
            error.what.replace("the file", "the list of checksums", 1),
            archive / CHECKSUMS,
            code=error.code,
            **error.values,
        ) from error
    for number, line in enumerate(text.splitlines(), start=1):
        match = re.fullmatch(r"([0-9a-f]{64})  (\S.*)", line)
        if not match or not is_relative(match[2]):
            raise InvalidInput(
                "the list of checksums cannot be understood",
                f"{archive.name}/{CHECKSUMS}, line {number}",
                "64 hexadecimal digits, two spaces, a name inside the archive",
                code="not_understood",
            )
        sums[match[2]] = match[1]
    return sums
