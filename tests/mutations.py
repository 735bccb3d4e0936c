"""Generator of small defects in functions, such as changed signs, for mutation testing.

Text is never changed: no docstring, message, annotation or f-string.
"""

from __future__ import annotations

import ast
import random
from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("pipeline", "walk3d")
CALLS_FOR_PEOPLE = {"InvalidInput", "print", "warn"}
NOT_EXCHANGED = {
    "isinstance",
    "getattr",
    "hasattr",
    "setdefault",
    "max",
    "min",
    "maximum",
    "minimum",
    "multiply",
}
"""Functions whose arguments are not exchanged, because the order does not matter or an error is certain."""
COMPARISONS = {
    ast.Lt: ("<=", ">"), ast.LtE: ("<", ">="), ast.Gt: (">=", "<"), ast.GtE: (">", "<="), ast.Eq: ("!=",),
    ast.NotEq: ("==",), ast.Is: ("is not",), ast.IsNot: ("is",), ast.In: ("not in",), ast.NotIn: ("in",),
}  # fmt: skip
AXES = {"0": "1", "1": "0", "2": "1", "-1": "0", "-2": "-1"}
SIDES = {"left": "right", "right": "left"}
Change = tuple[str, ast.AST, str]
"""Name of the operator, syntax-tree node to replace, and new source text."""


class Mutant(NamedTuple):
    """Small defect in a source file: `after` replaces `before` between two positions (line, byte)."""

    file: str
    function: str
    operator: str
    start: tuple[int, int]
    end: tuple[int, int]
    before: str
    after: str

    def apply(self, source: str) -> str:
        """Return the source text with the defect inserted."""
        lines = source.encode().splitlines(keepends=True)
        (first, start), (last, end) = self.start, self.end
        lines[first - 1 : last] = [lines[first - 1][:start] + self.after.encode() + lines[last - 1][end:]]
        return b"".join(lines).decode()


def is_text(node: ast.AST) -> bool:
    """Return whether a syntax-tree node only produces a text for users, or is an assertion."""
    match node:
        case ast.Raise() | ast.Assert() | ast.JoinedStr() | ast.Expr(ast.Constant()):
            return True
        case ast.Call(ast.Name(name) | ast.Attribute(_, name)):
            return name in CALLS_FOR_PEOPLE
        case ast.keyword("strict"):  # a check of zip, as an assertion is
            return True
        case ast.BinOp(left, ast.Add() | ast.Mod() | ast.Mult(), right):
            return any(is_text(n) or isinstance(getattr(n, "value", None), str) for n in (left, right))
    return False


def parts(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the syntax-tree nodes of a function, without texts for users and assertions."""
    for field, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            ignored = field in ("annotation", "returns", "decorator_list") or not isinstance(child, ast.AST)
            if not ignored and not is_text(child):
                yield child
                yield from parts(child)


def exchanged(name: str) -> str:
    """Return a name in which the words ``left`` and ``right`` are exchanged."""
    return "_".join(SIDES.get(word, word) for word in name.split("_"))


def changes(node: ast.AST) -> Iterator[Change]:
    """Yield the defects that can be made at one syntax-tree node."""
    text = ast.unparse
    match node:
        case ast.BinOp(left, operator, right):
            a, b = f"({text(left)})", f"({text(right)})"
            if isinstance(operator, ast.Add | ast.Sub):
                yield "sign", node, f"({a} {'-' if isinstance(operator, ast.Add) else '+'} {b})"
            else:
                yield "dropped term", node, b
            yield "dropped term", node, a
            if isinstance(operator, ast.Sub | ast.Div | ast.MatMult) and a != b:
                symbol = {ast.Sub: "-", ast.Div: "/", ast.MatMult: "@"}[type(operator)]
                yield "exchanged arguments", node, f"({b} {symbol} {a})"
        case ast.AugAssign(target, ast.Add() | ast.Sub() as operator, value):
            yield (
                "sign",
                node,
                f"{text(target)} {'-' if isinstance(operator, ast.Add) else '+'}= {text(value)}",
            )
        case ast.UnaryOp(ast.USub(), operand):
            yield "sign", node, f"({text(operand)})"
        case ast.UnaryOp(ast.Not(), operand):
            yield "comparison", node, f"bool({text(operand)})"
        case ast.BoolOp(operator, values):
            words = [f"({text(value)})" for value in values]
            yield (
                "comparison",
                node,
                f"({(' or ' if isinstance(operator, ast.And) else ' and ').join(words)})",
            )
            joint = " and " if isinstance(operator, ast.And) else " or "
            for n in range(len(words)):
                yield "dropped term", node, f"({joint.join(words[:n] + words[n + 1 :])})"
        case ast.Compare(left, [operator], [right]):
            for symbol in COMPARISONS[type(operator)]:
                yield "comparison", node, f"(({text(left)}) {symbol} ({text(right)}))"
        case ast.Constant(bool() as value):
            yield "constant", node, str(not value)
        case ast.Constant(int() as value):
            yield from (("±1", node, str(value + step)) for step in (1, -1))
        case ast.Constant(float() as value):
            yield "constant", node, repr(2 * value or 1.0)
        case ast.Constant(str() as value) if exchanged(value) != value:
            yield "left for right", node, repr(exchanged(value))
        case ast.Attribute(value, "T"):
            yield "axis", node, text(value)
        case ast.Attribute(value, name) if exchanged(name) != name:
            yield "left for right", node, f"{text(value)}.{exchanged(name)}"
        case ast.Slice(lower, upper):
            for end in (lower, upper):
                if end is not None and not isinstance(end, ast.Constant):
                    yield from (("±1", end, f"({text(end)}) {step} 1") for step in "+-")
        case ast.Call(called, arguments, keywords):
            fixed = getattr(called, "attr", getattr(called, "id", "")) in NOT_EXCHANGED
            fixed |= any(isinstance(a, ast.Starred) or is_text(a) for a in arguments)
            for first, second in pairwise([] if fixed else arguments):
                if text(first) != text(second):
                    order = [{first: second, second: first}.get(a, a) for a in arguments]
                    yield "exchanged arguments", node, text(ast.Call(called, order, keywords))
            for keyword in keywords:
                if keyword.arg == "axis" and text(keyword.value) in AXES:
                    yield "axis", keyword.value, AXES[text(keyword.value)]


def package_of(file: str) -> str:
    """Return the first two parts of a file's path, such as ``pipeline/core``."""
    return "/".join(file.removesuffix(".py").split("/")[:2])


def functions(tree: ast.AST, prefix: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield the functions and methods of a module, with their dotted names."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef):
            yield from functions(node, f"{prefix}.{node.name}")
        elif isinstance(node, ast.FunctionDef):
            yield f"{prefix}.{node.name}", node


def mutants_of(file: str, source: str) -> Iterator[list[Mutant]]:
    """Yield the list of mutants of each function of a file, without functions that have no mutant."""
    module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    for function, tree in functions(ast.parse(source), module):
        mutants = []
        for part in parts(tree):
            for operator, node, after in changes(part):
                start, end = (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)
                mutants.append(Mutant(file, function, operator, start, end, ast.unparse(node), after))
        if mutants:
            yield mutants


def draw(seed: str) -> Iterator[Mutant]:
    """Yield one mutant of each function in random order, with each package in proportion to its number of functions."""
    packages: defaultdict[str, list[list[Mutant]]] = defaultdict(list)
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            file = path.relative_to(ROOT).as_posix()
            packages[package_of(file)] += mutants_of(file, path.read_text(encoding="utf-8"))
    positions: list[tuple[float, Mutant]] = []
    for name, each in packages.items():
        order = random.Random(f"{seed} {name}")
        order.shuffle(each)
        shift = order.random()
        for number, mutants in enumerate(each):
            choice = random.Random(f"{seed} {mutants[0].function}")
            operator = choice.choice(sorted({mutant.operator for mutant in mutants}))
            chosen = choice.choice([mutant for mutant in mutants if mutant.operator == operator])
            positions.append(((number + shift) / len(each), chosen))
    yield from (mutant for _, mutant in sorted(positions))
