"""Light archive of full-scale results, small enough for the repository or a mail.

It contains the page, tables (large ones compressed), claims, reduced pictures, manifests, recordings and the tutorial's
pictures.  It also has the lock file, its bill of materials, ``SHA256SUMS``, ``digits.csv`` and
``ro-crate-metadata.json``. ``left_out.csv`` lists the files that do not fit: the largest tables and recordings.  The
motion of recorded people may not be passed on: their archive has no recordings, and its page has no players.
"""

from __future__ import annotations

import gzip
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.pictures.embedding import reduced
from pipeline.reading import MAX_UNPACKED_BYTES, read_file
from pipeline.report import document
from pipeline.report.published import Published, read_published
from pipeline.storage import agreement, archive, crate, tables
from pipeline.storage import sealed_folders as folders
from pipeline.storage.publishing import publish
from pipeline.validation import InvalidInput

MAX_BYTES, METADATA_BYTES = 10_000_000, 500_000
"""Size limits, bytes, of the whole archive and of its metadata."""

RECORDINGS_BYTES = 1_000_000
"""Bytes of the archive that are reserved for recordings when the tables are written."""

PLAIN_BYTES = 20_000
"""Size, bytes, above which a table is compressed."""

WIDTH = 1100
"""Largest width of the pictures in the archive, px."""

LEFT_OUT = "left_out.csv"
"""Table of the figure files that the archive omits, with their sizes and digests."""


def keep_light(folder: Path, target: Path, figures: Sequence[str], **traced: Any) -> dict[str, int]:
    """Write the light archive of ``results/<data>/full`` to `target`, and return the bytes of each kind of file.

    Parameters
    ----------
    folder, target : Path
        Results and archive; an earlier light archive at `target` is replaced, any other folder is an error.
    figures : sequence of str
        Names of the figures; all must be made from this commit, or from identical sources.
    **traced
        Options of `archive.traced_files`.

    Raises
    ------
    InvalidInput
        If `archive.traced_files` raises one, or the archive would be larger than 10 MB.
    """
    files = archive.traced_files(folder, figures, **traced)
    date, commit = traced["date"], traced["commit"]
    results = read_published(folder, figures)
    with publish(target, having="light") as publication:
        inside = publication.folder
        archive.write_files(inside, files)
        for name in results.figures:
            (inside / name).mkdir()
        texts, recordings = _smallest_first(results, folder)
        left = MAX_BYTES - document.MAX_BYTES - METADATA_BYTES - _write_pictures(results, folder, inside)
        room = 0 if results.recorded else RECORDINGS_BYTES
        left, written = _write_until_full(texts, inside, left - room)
        if not results.recorded:
            written |= _write_until_full(recordings, inside, left + room)[1]
        _write_left_out(inside / LEFT_OUT, results, written)
        agreement.write_rule(inside, results.figures)
        drawn = folder.parent.parent / document.TUTORIAL
        for path in folders.visible(drawn, "*/*.svg") if results.data == "synthetic" else ():
            (inside / document.TUTORIAL).mkdir(exist_ok=True)
            (inside / document.TUTORIAL / path.name).write_bytes(read_file(path))
        document.write_page(folder, figures, to=inside, motion=not results.recorded)
        commands = {
            name: {"title": figure.title, "command": f"make {name} DATA={results.data}"}
            for name, figure in results.figures.items()
        }
        facts = {
            path.relative_to(inside).as_posix(): (path.stat().st_size, folders.file_digest(path))
            for path in sorted(inside.rglob("*"))
            if path.is_file()
        }
        metadata = crate.crate(
            facts,
            commands,
            name=f"3D motion from 2D motion: {results.data}, {results.scale} scale",
            description=("" if results.recorded else "Recordings, ")
            + "tables, verdicts and pictures of the figures of four papers, computed again.",
            date=date,
            commit=commit,
        )
        (inside / crate.CRATE).write_text(json.dumps(metadata, indent=1) + "\n", "utf-8")
        sealed = {"light": True, "data": results.data, "scale": results.scale, "commit": commit, "date": date}
        sizes = archive.seal(publication, sealed)
        total = sum(sizes.values()) + (inside / archive.CHECKSUMS).stat().st_size
        if total > MAX_BYTES:
            raise InvalidInput(
                "the light archive would be too large",
                target,
                f"at most {MAX_BYTES} bytes",
                f"{total} bytes",
                code="file_too_large",
            )
    kinds: Counter[str] = Counter()
    for name, size in sizes.items():
        kinds[name.removesuffix(".gz").rpartition(".")[2]] += size
    return kinds


Files = list[tuple[str, bytes]]
"""List of files, each with its name in the archive and its content."""


def _smallest_first(results: Published, folder: Path) -> tuple[Files, Files]:
    """Return two lists of files, sorted by size: tables with their manifests, and recordings.

    Manifests precede tables, and large tables are compressed.
    """
    texts: Files = []
    recordings: Files = []
    for name, figure in results.figures.items():
        for file in figure.files:
            if file.endswith((".csv", ".json")):
                content = read_file(folder / name / file)
                if len(content) > MAX_UNPACKED_BYTES:
                    continue
                large = len(content) > PLAIN_BYTES and file not in (folders.MANIFEST, agreement.CLAIMS)
                text = gzip.compress(content, mtime=0) if large else content
                texts.append((f"{name}/{file}{'.gz' if large else ''}", text))
            elif file.endswith(".rrd"):
                recordings.append((f"{name}/{file}", read_file(folder / name / file)))

    def order(item: tuple[str, bytes]) -> tuple[bool, int, str]:
        return (not item[0].endswith(folders.MANIFEST), len(item[1]), item[0])

    return sorted(texts, key=order), sorted(recordings, key=order)


def _write_until_full(files: Files, inside: Path, room: int) -> tuple[int, set[str]]:
    """Write files while the remaining size permits; return the remaining bytes and the names that were written.

    The names do not include ``.gz``.
    """
    names = set()
    for name, content in files:
        if len(content) > room:
            break
        (inside / name).write_bytes(content)
        room -= len(content)
        names.add(name.removesuffix(".gz"))
    return room, names


def _write_pictures(results: Published, folder: Path, inside: Path) -> int:
    """Write the pictures at reduced size, and return their total size in bytes."""
    total = 0
    for name in results.figures:
        if (folder / name / "figure.png").is_file():
            content = reduced(folder / name / "figure.png", WIDTH)[0]
            (inside / name / "figure.webp").write_bytes(content)
            total += len(content)
    return total


def _write_left_out(path: Path, results: Published, kept: set[str]) -> None:
    """Write a table of the figure files that the archive omits, with their digests from the manifests."""
    rows = [
        (name, file, fact["bytes"], fact["sha256"])
        for name, figure in results.figures.items()
        for file, fact in sorted(figure.manifest["files"].items())
        if f"{name}/{file}" not in kept and file != "figure.png"
    ]
    tables.write(path, tables.of_rows(("figure", "file", "bytes", "sha256"), rows))
