"""Archives of full-scale results: one folder for each date and commit, with the digest of every file.

``<archive>/<date>-<commit>/<data>/<figure>/…`` holds the published files, ``<archive>/<date>-<commit>/SHA256SUMS``
their digests (``sha256sum -c SHA256SUMS`` checks them), and ``<archive>/index.csv`` one row per data set.
"""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
from collections.abc import Collection, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from pipeline.storage import crate, provenance
from pipeline.storage import sealed_folders as folders
from pipeline.storage.publishing import new_file
from pipeline.storage.sbom import SBOM, bill_of_materials
from pipeline.validation import InvalidInput, require_name

CHECKSUMS = "SHA256SUMS"
INDEX = "index.csv"
COLUMNS = ("archive", "date", "commit", "data", "figures", "files", "bytes", "checksums_sha256")


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
    """Archive figures in ``<archive_root>/<name>/<data>`` and return ``<archive_root>/<name>``.

    Archived are the files that each figure's manifest lists, the tables beside the figures, the lock file and its
    bill of materials.  Archiving the same results again changes nothing, and completes what a killed run began.

    Parameters
    ----------
    source : Path
        ``results/<data>/full``, or a run of ``results/scratch``.
    archive_root : Path
        Folder of all archives and of ``index.csv``.
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
    archive = archive_root / require_name("the archive's name", name)
    files = traced_files(source, figures, scale=scale, **traced)
    for figure in sorted(set(figures)):
        files |= {f"{figure}/{one}": source / figure / one for one in _listed(source / figure)}
    with folders.writing(archive):
        return _keep_files(files, archive, data, figures, date=traced["date"], commit=traced["commit"])


def figures_of_run(run: Path) -> tuple[str, list[str]]:
    """Return the data set of a run with changed options, or of a multirun, and the finished figures below it.

    Raises
    ------
    InvalidInput
        If nothing finished is there or the figures are of several data sets.
    """
    found = sorted(path.parent for path in run.rglob(folders.MANIFEST)) if run.is_dir() else []
    data = {str(folders.read_manifest(figure).get("data")) for figure in found}
    if len(data) != 1:
        what = "figures of several data sets" if data else "no finished figure is there"
        raise InvalidInput(what, where=str(run), received=", ".join(sorted(data)))
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
        raise InvalidInput("the archive's date is not a date", expected="2026-01-31", received=date)
    if not re.fullmatch(r"[0-9a-f]{40}", commit):
        raise InvalidInput(
            "the archive needs a commit", expected="40 hexadecimal digits", received=commit or "none"
        )
    if dirty is not False:
        raise InvalidInput(
            "the tree differs from its commit, so the results could not be traced: commit first",
            expected="a clean tree",
            received=f"dirty = {dirty}",
        )
    if not lock.is_file():
        raise InvalidInput("the lock file is missing", where=lock.name)
    if not figures:
        raise InvalidInput("no figure is expected, so there is nothing to keep", where=str(source))
    for figure in sorted(set(figures)):
        check_figure(source / figure, commit=commit, lock=lock, scale=scale, current=figure in current)
    beside = {path.name: path for path in sorted(source.glob("*.csv"))}
    return {lock.name: lock, SBOM: bill_of_materials(lock, commit), **beside}


def verify(archive: Path) -> list[str]:
    """Return what changed in an archive, one sentence per file; an empty list if nothing did.

    Raises
    ------
    InvalidInput
        If the folder is no archive, or its list of checksums cannot be understood.
    """
    archive = Path(archive)
    if not (archive / CHECKSUMS).is_file():
        raise InvalidInput("this is no archive", where=str(archive), expected=f"a folder with {CHECKSUMS}")
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
    light = {CHECKSUMS, folders.MANIFEST} if crate.CRATE in sums else {CHECKSUMS}
    problems += [f"{name}: added" for name in sorted(present - sums.keys() - light)]
    if crate.CRATE in sums:
        problems += _not_sealed(archive, sums)
    for row in _read_index(archive.parent / INDEX):
        if row["archive"] == archive.name:
            part = {k: v for k, v in sums.items() if k.startswith(f"{row['data']}/")}
            if folders.digest(sums_text(part)) != row["checksums_sha256"]:
                problems.append(f"{CHECKSUMS}: not what {INDEX} recorded for {row['data']}")
    return problems


def _not_sealed(archive: Path, sums: dict[str, str]) -> list[str]:
    """Return how the manifest of a light archive differs from its list of checksums."""
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
        raise InvalidInput("the figure has not been made", where=where)
    if complaints := folders.complaints_about(folder):
        raise InvalidInput(f"the result is unfinished or damaged: {complaints[0]}", where=where)
    manifest = json.loads((folder / folders.MANIFEST).read_bytes())
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
                complaint, where=where, expected=f"{name} {expected}", received=f"{name} {received}"
            )


def _listed(folder: Path) -> list[str]:
    """Return the names of the files that a figure's manifest lists, and of the manifest."""
    names = sorted(json.loads((folder / folders.MANIFEST).read_bytes())["files"])
    for name in names:
        if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts:
            raise InvalidInput(
                "the manifest lists a file outside its folder", where=str(folder), received=name
            )
    return [*names, folders.MANIFEST]


def _keep_files(
    files: Files,
    archive: Path,
    data: str,
    figures: Sequence[str],
    *,
    date: str,
    commit: str,
) -> Path:
    """Copy, list and index; each of the three is one rename, so that a killed run can be completed."""
    wanted = {
        f"{data}/{name}": folders.digest(item) if isinstance(item, bytes) else folders.file_digest(item)
        for name, item in sorted(files.items())
    }
    target = archive / data
    indexed = _read_index(archive.parent / INDEX)
    sums = _read_sums(archive) if (archive / CHECKSUMS).is_file() else {}
    listed = {k: v for k, v in sums.items() if k.startswith(f"{data}/")}
    if target.exists():
        present = {
            p.relative_to(archive).as_posix(): folders.file_digest(p)
            for p in target.rglob("*")
            if p.is_file()
        }
        if present != wanted or listed not in ({}, wanted):
            raise InvalidInput(
                "the archive already holds other results of this date and commit",
                where=f"{archive.name}/{data}",
                expected="the same files, or none",
            )
    elif listed:
        raise InvalidInput("the archive has lost these results", where=f"{archive.name}/{data}")
    else:
        archive.mkdir(parents=True, exist_ok=True)
        folders.remove_stale(archive)
        with folders.temporary_folder(archive) as temporary:
            for name, item in files.items():
                copy = temporary / name
                copy.parent.mkdir(parents=True, exist_ok=True)
                copy.write_bytes(item) if isinstance(item, bytes) else shutil.copyfile(item, copy)
                folders.sync(copy)
                if folders.file_digest(copy) != wanted[f"{data}/{name}"]:
                    raise InvalidInput("the file changed while it was being archived", where=name)
            temporary.replace(target)
    with new_file(archive / CHECKSUMS, replace=True) as path:  # read, so that it is ours
        path.write_bytes(sums_text({**sums, **wanted}))
    row = {
        "archive": archive.name,
        "date": date,
        "commit": commit,
        "data": data,
        "figures": " ".join(sorted({PurePosixPath(figure).name for figure in figures})),
        "files": str(len(files)),
        "bytes": str(sum((target / name).stat().st_size for name in files)),
        "checksums_sha256": folders.digest(sums_text(wanted)),
    }
    # A row of an archive that is no longer there would promise what nobody can look up.
    there = [r for r in indexed if (archive.parent / r["archive"] / r["data"]).is_dir()]
    rows = [r for r in there if (r["archive"], r["data"]) != (archive.name, data)]
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(sorted([*rows, row], key=lambda r: (r["archive"], r["data"])))
    with new_file(archive.parent / INDEX, replace=True) as path:
        path.write_bytes(text.getvalue().encode())
    return archive


def sums_text(sums: dict[str, str]) -> bytes:
    """Return digests by name as ``sha256sum`` writes them."""
    return "".join(f"{sums[name]}  {name}\n" for name in sorted(sums)).encode()


def _read_sums(archive: Path) -> dict[str, str]:
    """Return the sha256 of each file, by its name in the archive."""
    sums = {}
    text = (archive / CHECKSUMS).read_text(encoding="utf-8", errors="replace")
    for number, line in enumerate(text.splitlines(), start=1):
        match = re.fullmatch(r"([0-9a-f]{64})  (\S.*)", line)
        if not match or match[2].startswith("/") or ".." in PurePosixPath(match[2]).parts:
            raise InvalidInput(
                "the list of checksums cannot be understood",
                where=f"{archive.name}/{CHECKSUMS}, line {number}",
                expected="64 hexadecimal digits, two spaces, a name inside the archive",
            )
        sums[match[2]] = match[1]
    return sums


def _read_index(path: Path) -> list[dict[str, str]]:
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8", errors="replace") as stream:
        reader = csv.DictReader(stream)
        header, rows = tuple(reader.fieldnames or ()), list(reader)
    if header != COLUMNS or any(None in r or None in r.values() for r in rows):
        raise InvalidInput("the index cannot be understood", where=path.name, expected=",".join(COLUMNS))
    return rows
