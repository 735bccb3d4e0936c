"""Call graph of the project's functions, estimated from the names in the syntax trees.

A function reaches what its body names: functions and classes of its module, what is imported (through the
re-exports of packages), attributes of modules, and the methods of classes that are reached, wherever an attribute
of that name is read.  Nothing is run, so a call that is never made counts too; a function that is not reached is
certainly not called.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

Node = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


class CallGraph:
    """Functions, classes and methods of the packages by dotted name, with the names that each of them uses."""

    def __init__(self, *packages: Path) -> None:
        self.modules: dict[str, dict[str, str]] = {}
        self.bodies: dict[str, tuple[str, list[ast.AST]]] = {}
        self.methods: dict[str, list[str]] = {}
        for package in packages:
            for path in sorted(package.rglob("*.py")):
                parts = path.relative_to(package.parent).with_suffix("").parts
                name = ".".join(parts).removesuffix(".__init__")
                self._read(name, ast.parse(path.read_text(encoding="utf-8")))

    def _read(self, module: str, tree: ast.Module) -> None:
        names: dict[str, str] = {}
        top: list[ast.AST] = []
        for node in _statements(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                names[node.name] = f"{module}.{node.name}"
                self._define(module, f"{module}.{node.name}", node)
            else:
                top.append(node)
                for target in _assigned(node):
                    names.setdefault(target, f"{module}.{target}")
                    self.bodies.setdefault(f"{module}.{target}", (module, []))[1].append(node)
        for node in ast.walk(tree):  # imports inside functions too: a name means one thing in a module
            if isinstance(node, ast.ImportFrom):
                names.update({a.asname or a.name: f"{node.module}.{a.name}" for a in node.names})
            elif isinstance(node, ast.Import):
                names.update({a.asname or a.name.split(".")[0]: (a.asname and a.name) or a.name.split(".")[0]
                              for a in node.names})  # fmt: skip
        self.modules[module] = names
        self.bodies[f"{module}.<module>"] = (module, top)

    def _define(self, module: str, name: str, node: Node) -> None:
        if not isinstance(node, ast.ClassDef):
            self.bodies[name] = (module, [node])
            return
        reference: list[ast.AST] = [*node.bases, *node.decorator_list]
        for part in node.body:
            if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef):
                self.bodies[f"{name}.{part.name}"] = (module, [part])
                self.methods.setdefault(part.name, []).append(name)
                if part.name.startswith("__"):
                    reference.append(part)
            else:
                reference.append(part)
        self.bodies[name] = (module, reference)

    def resolve(self, name: str) -> str:
        """Return the dotted name under which an object is defined, or the given name if it is not in the project."""
        for _ in range(20):
            head, _, last = name.rpartition(".")
            finite = self.modules.get(head, {}).get(last)
            if finite == name or (finite is None and name in self.bodies):
                return name
            if finite is not None:  # what a package exports comes before a module of the same name
                name = finite
            elif head and (result := self.resolve(head)) != head:
                name = f"{result}.{last}"
            else:
                return name
        return name

    def reached(self, starts: Iterable[str]) -> set[str]:
        """Return the dotted names of all functions that the given functions may call, including themselves."""
        waiting, result, attributes = list(starts), set(), set()
        while waiting:
            name = waiting.pop()
            if name in result or name not in self.bodies:
                continue
            result.add(name)
            module, nodes = self.bodies[name]
            for node in nodes:
                for kind, used in _references(node):
                    if kind == "attribute":
                        attributes.add(used)
                    waiting.append(self.resolve(f"{module}.{used}"))
            waiting += [
                f"{owner}.{attribute}"
                for attribute in attributes
                for owner in self.methods.get(attribute, ())
                if owner in result
            ]
        return result


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the top-level statements of a module, including the statements under `if` and `try`."""
    for node in tree.body:
        if isinstance(node, ast.If | ast.Try):
            yield from (n for n in ast.iter_child_nodes(node) if isinstance(n, ast.stmt))
        else:
            yield node


def _assigned(node: ast.AST) -> Iterator[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    yield from (target.id for target in targets if isinstance(target, ast.Name))


def _references(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield the names that a syntax tree reads: plain names, dotted names and attribute names."""
    for part in ast.walk(node):
        if isinstance(part, ast.Name):
            yield "name", part.id
        elif isinstance(part, ast.Attribute):
            yield "attribute", part.attr
            if (dotted := ast.unparse(part)).replace(".", "").isidentifier():
                yield "name", dotted
