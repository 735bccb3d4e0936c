"""Safe writing of results: `publish` replaces a whole folder, `new_file` writes a single file.

A folder is replaced only if it has this package's sealed manifest, a file only if the caller allows it.  Input files,
symbolic links and the content of published folders are never replaced.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.reading import read_file
from pipeline.storage.sealed_folders import (
    CANNOT_WRITE,
    is_sealed,
    remove_stale,
    require_replaceable,
    swap_in,
    sync,
    temporary_folder,
    write_manifest,
    writing,
)
from pipeline.validation import InvalidInput

Replace = bool | Callable[[bytes], bool]
"""Permission to replace a file: True, False, or a function of the file's present content."""


@dataclass
class Publication:
    """Folder of results that is being prepared for publication.

    Attributes
    ----------
    folder : Path
        Temporary folder into which the caller writes the files.
    facts : mapping or None
        Content of the manifest, set by the caller; size and digest of every file are added at the end.
    """

    folder: Path
    facts: Mapping[str, Any] | None = None


@contextmanager
def publish(folder: Path, *, having: str = "") -> Iterator[Publication]:
    """Yield a publication whose temporary folder replaces `folder` when the ``with`` block succeeds.

    The block writes files into ``publication.folder`` and sets ``publication.facts``.  If it raises, `folder` is not
    changed.  Files in `folder` that its manifest does not list move into the new folder.

    Parameters
    ----------
    folder : Path
    having : str
        Entry that the manifest of a folder must have to be replaced.

    Raises
    ------
    InvalidInput
        If the results cannot be written, `folder` has content without a sealed manifest, or `folder` is inside a
        published folder.
    """
    if folder.name in ("", ".."):
        folder = folder.resolve()
    _require_outside(folder)
    with writing(folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
    remove_stale(folder.parent)
    require_replaceable(folder, having=having)
    with writing(folder, only=CANNOT_WRITE), temporary_folder(folder.parent) as temporary:
        publication = Publication(temporary)
        yield publication
        if publication.facts is None:
            raise RuntimeError("the publication has no manifest: set its facts before it ends")
        write_manifest(temporary, publication.facts)
        swap_in(temporary, folder)


@contextmanager
def new_file(path: Path, *, replace: Replace = False, sources: Iterable[str | Path] = ()) -> Iterator[Path]:
    """Yield a temporary path; the file written there in the ``with`` block is synced and renamed to `path`.

    Parameters
    ----------
    path : Path
    replace : bool or callable
        Whether an existing file may be replaced, or a function that decides by its content.
    sources : iterable of str or Path
        Input files, which are never replaced.

    Raises
    ------
    InvalidInput
        As `require_new`, and if the file cannot be written.
    """
    require_new(path, replace=replace, sources=sources)
    remove_stale(path.parent)
    with writing(path, only=CANNOT_WRITE), temporary_folder(path.parent) as temporary:
        yield temporary / path.name
        sync(temporary / path.name)
        require_new(path, replace=replace, sources=sources)
        (temporary / path.name).replace(path)
        sync(path.parent)


def require_new(path: Path, *, replace: Replace = False, sources: Iterable[str | Path] = ()) -> None:
    """Raise InvalidInput unless the file at `path` may be written; the parameters are the same as for `new_file`.

    Raises
    ------
    InvalidInput
        If the folder is missing or published, or an existing file may not be replaced.
    """
    if not path.parent.is_dir():
        raise InvalidInput("cannot write results: the folder does not exist", path.parent, code="no_folder")
    _require_outside(path)
    advice = "use another name"
    if path.is_symlink():
        reason, why = "it is a symbolic link", "link"
    elif not os.path.lexists(path):
        return
    elif not path.is_file():
        reason, why = "it is not a regular file", "not_a_file"
    elif any(Path(source).exists() and path.samefile(source) for source in sources):
        reason, why = "it is an input of this command", "source"
    elif callable(replace):
        if replace(read_file(path)):
            return
        reason, why, advice = "this program did not write it", "not_ours", "move it away"
    elif replace:
        return
    else:
        reason, why, advice = "it exists", "exists", "use another name, or replace=true"
    raise InvalidInput(
        f"the file is not replaced, since {reason}: {advice}", path, code="not_replaced", why=why
    )


def _require_outside(path: Path) -> None:
    """Raise InvalidInput if a path is inside a published folder."""
    for folder in (above := path.parent.resolve(), *above.parents):
        if is_sealed(folder):
            raise InvalidInput(
                "must not be a path inside a published folder", path, received=folder, code="inside_published"
            )
