"""Choice of the tests that may detect a defect in a function, ordered by their distance in the call graph.

The distance from a test to a function is the number of names on the shortest way through the graph of calls and
fixtures.  A method that is called through an unknown object is two names away.  Tests that mention the function, or
stand in its folder, come first among those at the same distance.
"""

from __future__ import annotations

import ast
import heapq
import re
from collections import defaultdict
from pathlib import Path

from tests.call_graph import CallGraph, _references

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("pipeline", "walk3d")
NOT_LINKED = 20.0
"""Distance of a test that is not connected to the function in the call graph."""
WHOLE_FIGURES = ("smoke_results", "synthetic_tables")
"""Fixtures that compute all figures. Tests that use them take minutes and are not chosen."""
NOT_CHOSEN = re.compile(
    r"golden|test_every_preset|cluster|thorough|"
    r"\.test_(architecture|article|distribution|documentation|pages|plain_english|small_base|tutorial)\."
)
"""Tests that are not chosen: of golden tables, of the repository's structure, and those outside `make test`."""


class NearestTests:
    """All tests, with their distances in the call graph from the functions of both packages."""

    def __init__(self) -> None:
        self.graph = CallGraph(*(ROOT / name for name in (*PACKAGES, "tests")))
        self.callers: defaultdict[str, list[tuple[str, float]]] = defaultdict(list)
        self.tests: dict[str, tuple[str, str]] = {}
        for name, (module, nodes) in self.graph.bodies.items():
            attributes = set()
            for node in nodes:
                for kind, used in _references(node):
                    attributes |= {used} if kind == "attribute" else set()
                    self.callers[self.graph.resolve(f"{module}.{used}")].append((name, 1.0))
                if isinstance(node, ast.FunctionDef) and module.startswith("tests."):
                    self._read_test(name, module, node)
            for attribute in attributes:
                for owner in self.graph.methods.get(attribute, ()):
                    self.callers[f"{owner}.{attribute}"].append((name, 2.0))

        for method, owners in self.graph.methods.items():
            for owner in owners:
                self.callers[f"{owner}.{method}"].append((owner, 1.0 if method.startswith("__") else 3.0))

        self.slow = {
            name for fixture in WHOLE_FIGURES for name in self.distances(f"tests.conftest.{fixture}")
        }

    def _read_test(self, name: str, module: str, node: ast.FunctionDef) -> None:
        fixtures = [argument.arg for argument in node.args.args]
        for fixture in fixtures:
            at = next((m for m in (module, "tests.conftest") if f"{m}.{fixture}" in self.graph.bodies), "")
            self.callers[f"{at}.{fixture}"].append((name, 1.0))
        decorators = " ".join(ast.unparse(decorator) for decorator in node.decorator_list)
        if node.name.startswith("test_") and not NOT_CHOSEN.search(f"{name} {decorators}"):
            path = module.replace(".", "/") + ".py"
            self.tests[name] = (f"{path}::{node.name}", ast.unparse(node))

    def distances(self, function: str) -> dict[str, float]:
        """Return the distance in the call graph from each caller to the function, by caller."""
        waiting, result = [(0.0, function)], dict[str, float]()
        while waiting:
            distance, name = heapq.heappop(waiting)
            if name not in result:
                result[name] = distance
                for caller, step in self.callers[name]:
                    heapq.heappush(waiting, (distance + step, caller))
        return result

    def nearest(self, function: str, *, files: int) -> list[str]:
        """Return the module's doctests and the nearest tests in at most `files` files, nearest first."""
        distances = self.distances(function)
        module = function
        while module not in self.graph.modules:
            module = module.rpartition(".")[0]
        *folders, stem = module.split(".")
        words = re.compile(rf"(?<![a-z])({function.split('.')[-1]}|{stem})(?![a-z])")
        path = f"{module.replace('.', '/')}.py"
        doctests = [path] if (ROOT / path).is_file() and ">>> " in (ROOT / path).read_text("utf-8") else []
        scores = {}
        for name, (identifier, source) in self.tests.items():
            score = distances.get(name, NOT_LINKED) - 3 * bool(words.search(name + source))
            neighbour = set(name.split(".")[1:-2]) & set(folders[1:])
            score -= 2 * bool(neighbour)
            if score < NOT_LINKED and name not in self.slow:
                scores[identifier] = score
        by_file: dict[str, list[str]] = {}
        for identifier in sorted(scores, key=lambda key: (scores[key], key)):
            by_file.setdefault(identifier.partition("::")[0], []).append(identifier)
        return doctests + [identifier for path in list(by_file)[:files] for identifier in by_file[path]]
