"""The two ways out: `publish` replaces a folder of ours as a whole, `new_file` writes one file.

Nothing else that a person may have put somewhere is ever replaced: a folder only if it carries our sealed manifest, a
file only where that is asked for; never what is read, never through a symbolic link, never inside a published folder.
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
"""Whether a file may be replaced, or whether one with this content may."""


@dataclass
class Publication:
    """The temporary folder of what is being published.

    Attributes
    ----------
    folder : Path
        Write the files here.
    facts : mapping or None
        Content of the manifest, to be set; the size and digest of every file are added at the end.
    """

    folder: Path
    facts: Mapping[str, Any] | None = None


@contextmanager
def publish(folder: Path, *, having: str = "") -> Iterator[Publication]:
    """Fill a temporary folder that replaces `folder` when the ``with`` block ends without an exception.

    The block writes files into ``publication.folder`` and sets ``publication.facts``.  If it raises,
    `folder` is not changed.  Files in `folder` that its manifest does not list move into the new folder.

    Parameters
    ----------
    folder : Path
    having : str
        Entry of the manifest by which a folder of this kind is known: one of another kind is not replaced.

    Raises
    ------
    InvalidInput
        If the results cannot be written, `folder` holds something and has no sealed manifest, or it is inside a
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
    """Yield a temporary name; the file that the ``with`` block writes there is renamed to `path` when it is on disk.

    Parameters
    ----------
    path : Path
    replace : bool or callable
        Whether a file that is there may be replaced; or, given its content, whether it is one of ours.
    sources : iterable of str or Path
        What is read, which is never replaced.

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
    """Require that a file may be written; the parameters are those of `new_file`.

    Raises
    ------
    InvalidInput
        If its folder is missing or published, or what stands there may not be replaced.
    """
    if not path.parent.is_dir():
        raise InvalidInput("cannot write results: there is no such folder", path.parent)
    _require_outside(path)
    expected = "another name"
    if path.is_symlink():
        reason = "it is a symbolic link"
    elif not os.path.lexists(path):
        return
    elif not path.is_file():
        reason = "it is no file"
    elif any(Path(source).exists() and path.samefile(source) for source in sources):
        reason = "it is what is read"
    elif callable(replace):
        if replace(read_file(path)):
            return
        reason, expected = "this program did not write it", "that it is moved away"
    elif replace:
        return
    else:
        reason, expected = "the file exists", "another name, or replace=true"
    raise InvalidInput(f"{reason}, so it is not replaced", path, expected)


def _require_outside(path: Path) -> None:
    """Require that no folder above a path is a published one."""
    for folder in (above := path.parent.resolve(), *above.parents):
        if is_sealed(folder):
            raise InvalidInput("must not be inside a published folder", path, received=folder)
