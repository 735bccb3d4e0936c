"""Rules of plain English that a program can judge, and their allowances in ``plain_english.csv``.

``python -m tests.plain_english`` prints each violation in a folder or file, such as ``pipeline/cli``.
``python -m tests.plain_english --lower`` lowers the allowances to the present counts; nothing raises them.
"""

from __future__ import annotations

import ast
import csv
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ALLOWANCES = Path(__file__).with_suffix(".csv")

RARE_WORDS = re.compile(
    r"\b(told|said|nobody|somebody|whom|so many|that is no|is no walk|beside|of which|made of|takes? turns|"
    r"each its own|has none|if there is none|to be had|is refused|are refused)\b",
    re.IGNORECASE,
)
"""Words and phrases that are hard to understand for readers outside the project."""

FIRST_WORDS = re.compile(r"(Of|As|What|Whether|How|Who|Whom|Where|So)\b")
"""Words that must not begin a docstring, because a docstring begins with a noun or a verb."""

VAGUE_NAMES = frozenset({
    "found", "made", "given", "known", "of", "own", "one", "there", "here", "beside", "kept", "held", "wanted", "said",
    "told", "heard", "taken", "asked", "shown", "tried", "seen", "apart", "place",
})  # fmt: skip
"""Names of variables or functions that contain no noun."""

MAX_WORDS = 30
"""Largest number of words of a sentence in the documentation, and in the first paragraph of a docstring."""

MAX_MESSAGE = 300
"""Largest number of characters of a message, where `PLACEHOLDER` stands for each value."""

PLACEHOLDER = "x" * 10
MESSAGES = frozenset({"InvalidInput", "damaged", "Remark", "Complaint", "tell", "SystemExit"})
"""Functions and classes whose text arguments are shown to users in the terminal."""

EXCEPTIONS = {
    "tests/plain_english.py": "it contains the word list",
    "tests/test_plain_english.py": "its examples break the rules on purpose",
}
"""Files that are not checked, each with the reason."""


@dataclass(frozen=True)
class Violation:
    """Passage that breaks a rule of plain English.

    Attributes
    ----------
    rule : str
        One of `RULES`.
    where : str
        File and line.
    text : str
    """

    rule: str
    where: str
    text: str


RULES = ("words", "names", "first_words", "sentences", "brackets", "messages")


# --- pages of the documentation ----------------------------------------------------------------------------


def paragraphs(markdown: str) -> Iterator[tuple[int, str]]:
    """Yield line number and text of each paragraph and list item, without code, tables, comments and headings."""
    text = re.sub(
        r"^```.*?^```", lambda match: "\n" * match[0].count("\n"), markdown, flags=re.DOTALL | re.MULTILINE
    )
    text = re.sub(r"<!--.*?-->", lambda match: "\n" * match[0].count("\n"), text, flags=re.DOTALL)
    lines: list[str] = []
    start = 0
    for number, line in enumerate([*text.splitlines(), ""], 1):
        item = re.match(r"\s*(?:[-*]|\d+\.) +", line)
        ends = not line.strip() or line.startswith(("#", "|", "<", "!["))
        if (ends or item) and lines:
            yield start, " ".join(lines)
            lines = []
        if not ends:
            start = start if lines else number
            lines.append(line[item.end() :] if item else line.strip())


def sentences(prose: str) -> list[str]:
    """Return the sentences of a paragraph, with inline code replaced by one word and links by their text."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`", "code", prose))
    plain = re.sub(r"\b(e\.g|i\.e|et al|cf|vs)\.", r"\1", plain.replace("*", ""))
    return [part for part in re.split(r"(?<=[.!?])[)\"”]?\s+(?=[A-Z0-9(\"“]|code)", plain) if part.strip()]


def length(sentence: str) -> int:
    """Return the number of words of a sentence, without numbers and signs."""
    return len(re.findall(r"[^\W\d_][\w'’.-]*", sentence))


def judge_page(path: Path) -> list[Violation]:
    """Return the passages of a Markdown page that break a rule."""
    name = path.relative_to(ROOT).as_posix()
    markdown = path.read_text(encoding="utf-8")
    broken: list[Violation] = []
    for number, line in enumerate(markdown.splitlines(), 1):
        broken += [Violation("words", f"{name}:{number}", match[0]) for match in RARE_WORDS.finditer(line)]
    for number, prose in paragraphs(markdown):
        for sentence in sentences(prose):
            if length(sentence) > MAX_WORDS:
                broken.append(Violation("sentences", f"{name}:{number}", sentence))
            if len(re.findall(r"\((?!code\))[^()]*\)", sentence)) > 1:
                broken.append(Violation("brackets", f"{name}:{number}", sentence))
    return broken


# --- sources ----------------------------------------------------------------------------------------------


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield line number and text of the docstrings of modules, classes, functions, constants and fields."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if not isinstance(body, list):
            continue
        documented = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        for before, statement in pairwise([None, *body]):
            first = before is None and documented
            if (
                isinstance(statement, ast.Expr)
                and isinstance(statement.value, ast.Constant)
                and isinstance(statement.value.value, str)
                and (first or isinstance(before, ast.Assign | ast.AnnAssign))
            ):
                yield statement.lineno, statement.value.value


def message_length(call: ast.Call) -> int:
    """Return the number of characters of the texts in a call, with a placeholder for each value."""
    arguments = [
        *call.args,
        *(keyword.value for keyword in call.keywords if keyword.arg in ("expected", "received")),
    ]
    return sum(_length(argument) for argument in arguments)


def _length(node: ast.expr) -> int:
    if isinstance(node, ast.Constant):
        return len(str(node.value))
    if isinstance(node, ast.JoinedStr):
        return sum(_length(value) for value in node.values)
    if isinstance(node, ast.IfExp):
        return max(_length(node.body), _length(node.orelse))
    if isinstance(node, ast.BinOp):
        return _length(node.left) + _length(node.right)
    return len(PLACEHOLDER)


def judge_source(path: Path) -> list[Violation]:
    """Return the passages of a Python file that break a rule."""
    name = path.relative_to(ROOT).as_posix()
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    broken: list[Violation] = []
    for number, line in enumerate(text.splitlines(), 1):
        broken += [Violation("words", f"{name}:{number}", match[0]) for match in RARE_WORDS.finditer(line)]
    for number, docstring in docstrings(tree):
        if match := FIRST_WORDS.match(docstring):
            broken.append(Violation("first_words", f"{name}:{number}", match[0]))
        first = " ".join(docstring.strip().split("\n\n")[0].split()).replace("``", "`")
        broken += [
            Violation("sentences", f"{name}:{number}", sentence)
            for sentence in sentences(first)
            if length(sentence) > MAX_WORDS
        ]
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id in VAGUE_NAMES:
            broken.append(Violation("names", f"{name}:{node.lineno}", node.id))
        elif (
            isinstance(node, ast.Call)
            and ast.unparse(node.func).split(".")[-1] in MESSAGES
            and message_length(node) > MAX_MESSAGE
        ):
            broken.append(Violation("messages", f"{name}:{node.lineno}", ast.unparse(node.args[0])))
    return broken


# --- packages and their allowances ------------------------------------------------------------------------


def package(path: Path) -> str:
    """Return the package under which a file is counted: ``pipeline/cli``, ``tests``, ``docs`` or the name of a page."""
    parts = path.relative_to(ROOT).parts
    if parts[0] in ("pipeline", "walk3d") and len(parts) > 2:
        return "/".join(parts[:2])
    return parts[0]


def files() -> list[Path]:
    """Return the source files and pages that are checked."""
    folders = ("pipeline", "walk3d", "gait_pipeline", "tests", "docs")
    sources = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    pages = [
        ROOT / name
        for name in (
            "README.md",
            "CHANGELOG.md",
            "CONTRIBUTING.md",
            "data/README.md",
            "results/archive/README.md",
        )
    ]
    listed = [*sources, ROOT / "tutorial.py", *pages, *(ROOT / "docs").glob("*.md")]
    return sorted(path for path in listed if path.relative_to(ROOT).as_posix() not in EXCEPTIONS)


@cache
def violations() -> dict[str, list[Violation]]:
    """Return the passages that break a rule, by package."""
    broken: dict[str, list[Violation]] = {}
    for path in files():
        judge = judge_page if path.suffix == ".md" else judge_source
        broken.setdefault(package(path), []).extend(judge(path))
    return broken


def counts() -> dict[tuple[str, str], int]:
    """Return the number of violations by package and rule."""
    return {
        (name, rule): sum(violation.rule == rule for violation in listed)
        for name, listed in violations().items()
        for rule in RULES
    }


def allowances() -> dict[tuple[str, str], int]:
    """Return the allowed number of violations by package and rule; 0 for a package without a row."""
    with ALLOWANCES.open(encoding="utf-8", newline="") as table:
        return {(row["package"], rule): int(row[rule]) for row in csv.DictReader(table) for rule in RULES}


def lower() -> None:
    """Lower the allowances to the present numbers of violations."""
    present, allowed = counts(), allowances()
    lowered = {key: min(number, present.get(key, 0)) for key, number in allowed.items()}
    with ALLOWANCES.open("w", encoding="utf-8", newline="") as table:
        writer = csv.writer(table, lineterminator="\n")
        writer.writerow(["package", *RULES])
        for name in sorted({name for name, _ in lowered}):
            row = [lowered[name, rule] for rule in RULES]
            if any(row):
                writer.writerow([name, *row])


if __name__ == "__main__":
    if sys.argv[1:] == ["--lower"]:
        lower()
    else:
        prefixes = tuple(sys.argv[1:]) or ("",)
        for listed in violations().values():
            for violation in listed:
                if violation.where.startswith(prefixes):
                    print(f"{violation.where}: {violation.rule}: {violation.text}")
