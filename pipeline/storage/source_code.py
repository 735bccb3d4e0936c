"""Digests of source code: of a module together with every module of the package and of plug-ins that it imports.

The key of an artefact contains the digest of the sources that its study imports, so that a change elsewhere
recomputes nothing.  Comments and docstrings are not part of it.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterable

from pipeline.plugins import edition, source_of
from pipeline.storage.sealed_folders import digest

Code = tuple[str, frozenset[tuple[str, str]]]
"""The digest of a module's syntax tree, and each name that it imports with the module it comes from."""


def sources_digest(modules: Iterable[str]) -> str:
    """Return the sha256 of these modules and of all that they import, directly or not.

    Parameters
    ----------
    modules : iterable of str
        Dotted names of modules of the package or of plug-ins, e.g. ``"pipeline.core.fourier"``.
    """
    lines = (f"{name}\0{_module(name, edition())[0]}\n" for name in sorted(reached(modules)))
    return digest("".join(lines).encode())


def reached(modules: Iterable[str]) -> set[str]:
    """Return these modules and all that they import, directly or not, of the package and of plug-ins."""
    reached: set[str] = set()
    waiting = [name for name in modules if source_of(name)]
    while waiting:
        name = waiting.pop()
        if name in reached:
            continue
        reached.add(name)
        waiting += _module(name, edition())[1] - reached
    return reached


@functools.cache
def _module(name: str, _: object) -> tuple[str, frozenset[str]]:
    """Return the digest of a module's code, and the modules of the package that it imports names from.

    Their parent packages are left out, for no name is imported from them.
    """
    path = source_of(name)
    assert path is not None
    seal, imports = _parsed(path.read_bytes())
    # From a package, a name is a module of it, or one that its __init__ has.
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    absolute = {tuple(_absolute(each, package) for each in pair) for pair in imports}
    imported = {full if source_of(full) else module for full, module in absolute}
    return seal, frozenset(found for found in imported if found != name and source_of(found))


@functools.cache
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
            of = "." * node.level + (node.module or "")
            between = "" if of.endswith(".") else "."
            imports |= {(f"{of}{between}{alias.name}", of) for alias in node.names}
        elif isinstance(node, ast.Import):
            imports |= {(alias.name, alias.name) for alias in node.names}
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [line for line in node.body if not _is_text(line)] or [ast.Pass()]
    return digest(ast.dump(tree).encode()), frozenset(imports)


def _absolute(module: str, package: str) -> str:
    """Return the full name of a module that a module of a package imports."""
    dots = len(module) - len(module.lstrip("."))
    if not dots:
        return module
    above = package.split(".")[: len(package.split(".")) - dots + 1]
    return ".".join([*above, *filter(None, [module.lstrip(".")])])


def _is_text(line: ast.stmt) -> bool:
    return (
        isinstance(line, ast.Expr)
        and isinstance(line.value, ast.Constant)
        and isinstance(line.value.value, str)
    )
