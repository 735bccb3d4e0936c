"""The light archive: what a person needs of full-scale results, small enough for the repository or a mail.

It holds the page, all tables (large ones compressed), claims, reduced pictures, manifests, the lock file and the
smallest recordings, with ``SHA256SUMS``, ``digits.csv`` and ``ro-crate-metadata.json``, and what the tutorial drew.
The arrays stay in the full archive.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Sequence
from pathlib import Path

from pipeline import pictures
from pipeline.report.document import TUTORIAL, write_page
from pipeline.report.entries import PICTURE_WIDTH
from pipeline.report.published import read_published
from pipeline.storage import agreement, archive, crate, provenance
from pipeline.storage import sealed_folders as folders
from pipeline.storage.store import Store
from pipeline.validation import InvalidInput

MOST_BYTES = 10_000_000
PLAIN_BYTES = 150_000
"""Tables up to this size stay as they are; larger ones are compressed."""

RECORDING_BYTES = 1_500_000
"""Largest recording that is kept."""


def keep_light(
    folder: Path,
    target: Path,
    figures: Sequence[str],
    *,
    date: str,
    commit: str,
    dirty: bool | str,
    lock: Path = provenance.LOCK,
) -> dict[str, int]:
    """Write the light archive of ``results/<data>/full`` in `target`; return the bytes of each kind of file.

    Parameters
    ----------
    folder, target : Path
        `target` may be there only as an earlier light archive, which is replaced.
    figures : sequence of str
        All must be made, by this commit.
    date, commit, dirty, lock
        As for `archive.keep`.

    Raises
    ------
    InvalidInput
        As `archive.keep`; and if it would be larger than 10 MB.
    """
    archive.require_traceable(date=date, commit=commit, dirty=dirty, lock=lock)
    for wanted in figures:
        archive.check_figure(folder / wanted, commit=commit, lock=lock)
    results = read_published(folder, figures)
    with Store(target.parent).publish(target) as publication:
        inside = publication.folder
        (inside / lock.name).write_bytes(lock.read_bytes())
        if (folder / archive.CLAIMS).is_file():
            (inside / archive.CLAIMS).write_bytes((folder / archive.CLAIMS).read_bytes())
        recordings = []
        for name, figure in results.figures.items():
            (inside / name).mkdir()
            for file in figure.files:
                path = folder / name / file
                if file.endswith((".csv", ".json")):
                    _keep_text(path, inside / name / file)
                elif file == "figure.png":
                    (inside / name / "figure.webp").write_bytes(pictures.reduced(path, PICTURE_WIDTH)[0])
                elif file.endswith(".rrd") and path.stat().st_size <= RECORDING_BYTES:
                    recordings.append((path.stat().st_size, name, file))
        agreement.write_rule(inside, results.figures)
        drawn = folder.parent.parent / TUTORIAL
        for path in sorted(drawn.glob("*.svg")) if results.data == "synthetic" else ():
            (inside / TUTORIAL).mkdir(exist_ok=True)
            (inside / TUTORIAL / path.name).write_bytes(path.read_bytes())
        write_page(folder, figures, to=inside)
        left = MOST_BYTES - _size(inside) - 400_000  # for the metadata
        for size, name, file in sorted(recordings):
            if size > left:
                break
            (inside / name / file).write_bytes((folder / name / file).read_bytes())
            left -= size
        write_page(folder, figures, to=inside)  # once more, with links to the recordings
        commands = {
            name: {"title": figure.title, "command": f"make {name} DATA={results.data}"}
            for name, figure in results.figures.items()
        }
        facts = {name: (len(content), folders.digest(content)) for name, content in _contents(inside).items()}
        metadata = crate.crate(
            facts,
            commands,
            name=f"3D motion from 2D motion: {results.data}, {results.scale} scale",
            description="Tables, verdicts, pictures and recordings of the figures of four papers, computed again.",
            date=date,
            commit=commit,
        )
        (inside / crate.CRATE).write_text(json.dumps(metadata, indent=1) + "\n", encoding="utf-8")
        contents = _contents(inside)
        sums = {name: folders.digest(content) for name, content in contents.items()}
        (inside / archive.CHECKSUMS).write_bytes(archive.sums_text(sums))
        if (total := _size(inside)) > MOST_BYTES:
            raise InvalidInput(
                "the light archive would be too large",
                where=str(target),
                expected=f"at most {MOST_BYTES} bytes",
                received=str(total),
            )
        publication.manifest(
            {"light": True, "data": results.data, "scale": results.scale, "commit": commit, "date": date}
        )
    kinds: dict[str, int] = {}
    for name, content in contents.items():
        kind = name.removesuffix(".gz").rpartition(".")[2]
        kinds[kind] = kinds.get(kind, 0) + len(content)
    return kinds


def _keep_text(path: Path, copy: Path) -> None:
    content = path.read_bytes()
    if len(content) > PLAIN_BYTES:
        copy.with_name(f"{copy.name}.gz").write_bytes(gzip.compress(content, mtime=0))
    else:
        copy.write_bytes(content)


def _contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
