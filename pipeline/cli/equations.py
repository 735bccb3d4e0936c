"""Command `equations`, which prints the papers' equations and the functions that implement them."""

from __future__ import annotations

from collections.abc import Sequence

from pipeline import papers
from pipeline.cli.output import tell
from pipeline.resources import PACKAGE


def equations(arguments: Sequence[str]) -> int:
    """Print each equation in words, with its test and the functions that implement it as printed and as used."""
    chosen = [papers.paper(key) for key in arguments] or list(papers.all_papers().values())
    for paper in chosen:
        tell(f"{paper.key}: {paper.authors} ({paper.year}). {paper.title}.", "bold")
        for equation in (*paper.equations, *paper.unnumbered):
            printed = _where(equation.printed)
            used = _where(equation.used) if equation.used else "by no result"
            tell(f"  ({equation.number}) {equation.words}")
            tell(f"      printed: {printed}  {equation.test}", "dim")
            tell(f"      used:    {used}", "dim")
            if equation.note:
                tell(f"      note: {equation.note}", "dim")
    return 0


def _where(dotted: str) -> str:
    """Return file, line and name of a function from its dotted name."""
    path, line = papers.locate(dotted)
    return f"{path.relative_to(PACKAGE.parent).as_posix()}:{line} {dotted.rpartition('.')[2]}"
