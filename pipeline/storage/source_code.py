"""Digests of source code: of a module together with every module of the package that it imports.

The key of an artefact contains the digest of the sources that its study imports, so that a change elsewhere
recomputes nothing.  Comments and docstrings are not part of it.
"""

from __future__ import annotations

import ast
import functools
import json
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from pipeline.reading import read_json
from pipeline.resources import PACKAGE
from pipeline.storage import user_cache
from pipeline.storage.sealed_folders import digest

_CODE, _MOST = f"code-{sys.version_info[0]}.{sys.version_info[1]}.json", 4000
"""File of the user's cache, whose syntax trees are those of one Python, and the most modules in it."""

Code = tuple[str, frozenset[tuple[str, str]]]
"""The digest of a module's syntax tree, and each name that it imports with the module it comes from."""


def sources_digest(modules: Iterable[str]) -> str:
    """Return the sha256 of these modules and of all that they import, directly or not.

    Parameters
    ----------
    modules : iterable of str
        Dotted names below the package, e.g. ``"pipeline.core.fourier"``.
    """
    reached: set[str] = set()
    waiting = [name for name in modules if _path(name)]
    before = len(_known())
    while waiting:
        name = waiting.pop()
        if name in reached:
            continue
        reached.add(name)
        waiting += _module(name)[1] - reached
    if len(_known()) > before:
        latest = list(_known().items())[-_MOST:]
        content = {of: (seal, sorted(names)) for of, (seal, names) in latest}
        user_cache.write(_CODE, json.dumps(content).encode())
    lines = (f"{name}\0{_module(name)[0]}\n" for name in sorted(reached))
    return digest("".join(lines).encode())


def _path(name: str) -> Path | None:
    """Return the file of a module of this package, None if there is none."""
    first, _, rest = name.partition(".")
    if first != PACKAGE.name:
        return None
    base = PACKAGE.joinpath(*rest.split(".")) if rest else PACKAGE
    candidates = (base / "__init__.py", base.with_suffix(".py"))
    return next((path for path in candidates if path.is_file()), None)


@functools.cache
def _module(name: str) -> tuple[str, frozenset[str]]:
    """Return the digest of a module's code, and the modules of the package that it imports names from.

    Their parent packages are left out, for no name is imported from them.
    """
    path = _path(name)
    assert path is not None
    content, known = path.read_bytes(), _known()
    if (of := digest(content)) not in known:
        known[of] = _parsed(content)
    seal, imports = known[of]
    # From a package, a name is a module of it, or one that its __init__ has.
    imported = {full if _path(full) else module for full, module in imports}
    return seal, frozenset(found for found in imported if found != name and _path(found))


@functools.cache
def _known() -> dict[str, Code]:
    """Return what is known of modules by the digest of their content; new ones are added."""
    with suppress(ValueError, TypeError, AttributeError):
        found = read_json(user_cache.place() / _CODE, content=user_cache.read(_CODE) or b"{}")
        return {
            of: (seal, frozenset((full, module) for full, module in names))
            for of, (seal, names) in found.items()
        }
    return {}


def _parsed(content: bytes) -> Code:
    """Return a module's code; its docstrings, and those in it and of attributes, do not count."""
    tree = ast.parse(content)
    imports: set[tuple[str, str]] = set()
    # What is imported for annotations alone does not run.
    unread = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        for line in node.body
        for inner in ast.walk(line)
    }
    for node in ast.walk(tree):
        if id(node) in unread:
            continue
        if isinstance(node, ast.ImportFrom):
            imports |= {(f"{node.module}.{alias.name}", str(node.module)) for alias in node.names}
        elif isinstance(node, ast.Import):
            imports |= {(alias.name, alias.name) for alias in node.names}
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [line for line in node.body if not _is_text(line)] or [ast.Pass()]
    return digest(ast.dump(tree).encode()), frozenset(imports)


def _is_text(line: ast.stmt) -> bool:
    return (
        isinstance(line, ast.Expr)
        and isinstance(line.value, ast.Constant)
        and isinstance(line.value.value, str)
    )
