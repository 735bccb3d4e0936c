"""Digests of source code: of a module, and of all modules of the package and of plug-ins that it imports.

The key of an artefact contains the digest of the sources that its study imports.  A change in other modules therefore
does not invalidate it.  The digest ignores comments and docstrings.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterable

from pipeline.plugins import edition, source_of
from pipeline.storage.sealed_folders import digest

Code = tuple[str, frozenset[tuple[str, str]]]
"""Digest of a module's syntax tree, and the imported names, each with the module from which it is imported."""


def sources_digest(modules: Iterable[str]) -> str:
    """Return the sha256 of the sources of modules, including all modules that they import directly or indirectly.

    Parameters
    ----------
    modules : iterable of str
        Dotted names of modules of the package or of plug-ins, e.g. ``"pipeline.core.fourier"``.
    """
    lines = (f"{name}\0{_module(name, edition())[0]}\n" for name in sorted(reached(modules)))
    return digest("".join(lines).encode())


def reached(modules: Iterable[str]) -> set[str]:
    """Return the given modules and all modules that they import directly or indirectly.

    Only modules of the package and of plug-ins are included.
    """
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
    """Return the digest of a module's code, and the modules of the package from which it imports names.

    Parent packages are not included, since no name is imported from them.
    """
    path = source_of(name)
    assert path is not None
    seal, imports = _parsed(path.read_bytes())
    # A name imported from a package is one of its modules, or a name in its __init__.
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    absolute = {tuple(_absolute(each, package) for each in pair) for pair in imports}
    imported = {full if source_of(full) else module for full, module in absolute}
    return seal, frozenset(
        imported_module
        for imported_module in imported
        if imported_module != name and source_of(imported_module)
    )


@functools.cache
def _parsed(content: bytes) -> Code:
    """Return the digest of a module's code without docstrings, and the names that the code imports."""
    tree = ast.parse(content)
    imports: set[tuple[str, str]] = set()
    # Imports for type checking do not run.
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
            origin = "." * node.level + (node.module or "")
            between = "" if origin.endswith(".") else "."
            imports |= {(f"{origin}{between}{alias.name}", origin) for alias in node.names}
        elif isinstance(node, ast.Import):
            imports |= {(alias.name, alias.name) for alias in node.names}
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [line for line in node.body if not _is_text(line)] or [ast.Pass()]
    return digest(ast.dump(tree).encode()), frozenset(imports)


def _absolute(module: str, package: str) -> str:
    """Return the absolute name of an imported module; the import in `package` may be relative."""
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
