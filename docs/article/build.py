"""Build of the article as PDF, with numbers of ``results/published.csv``: ``python docs/article/build.py TO.pdf``."""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PLACEHOLDER = re.compile(r"\{\{(\w+):([^:{}]+):([^{}]+)\}\}")

Numbers = Mapping[tuple[str, str], float]
"""Published numbers by data set and name."""


def read_published(lines: Iterable[str]) -> tuple[dict[tuple[str, str], float], str]:
    """Return the numbers of a table of published numbers, and the commit of the synthetic ones."""
    rows = list(csv.DictReader(lines))
    commits = {row["commit"] for row in rows if row["data"] == "synthetic"}
    return {(row["data"], row["name"]): float(row["value"]) for row in rows}, " and ".join(sorted(commits))


PAPERS = {
    "zhang2004": "Zhang 2004",
    "zhang2007": "Zhang 2007",
    "mozerov2006": "Mozerov 2006",
    "park2011": "Park 2011",
}
PEOPLE = {"optical": "recorded", "synthetic": "synthetic"}


def verdict_rows() -> str:
    """Return the rows of the table of verdicts, with placeholders: a row to each paper and data set."""
    rows = []
    for key, paper in PAPERS.items():
        for data, people in PEOPLE.items():

            def number(name: str, kinds: str = "results and sentences", of: str = f"{data}:{key}") -> str:
                return f"{{{{{of}, {kinds}, {name}:.0f}}}}"

            agrees = f"{number('agrees')} of {number('judged')} ({number('agrees, beyond the baseline yes')})"
            others = [number(name) for name in ("close", "undecided", "differs", "untestable")]
            cells = [paper, people, agrees, number("agrees", "results"), *others]
            rows.append("    " + ", ".join(f"[{cell}]" for cell in cells) + ",")
    return "\n".join(rows)


def filled(text: str, numbers: Numbers, commit: str) -> str:
    """Return the text with its placeholders filled in, also the rows of the table of verdicts.

    Raises
    ------
    ValueError
        If a number is not published.
    """
    text = text.replace("{{verdicts}}", verdict_rows())
    if missing := sorted({groups[:2] for groups in PLACEHOLDER.findall(text)} - set(numbers)):
        absent = ", ".join(f"{name!r} of {data}" for data, name in missing)
        raise ValueError(
            f"results/published.csv lacks {absent}: `make readme ARGS=data=…` after a full sweep"
        )

    def number(match: re.Match[str]) -> str:
        return format(numbers[match[1], match[2]], match[3]).replace("-", "−")

    text = PLACEHOLDER.sub(number, text).replace("{{commit}}", commit)
    return text.replace("[0 of 0 (0)]", "[none can be judged]")


def build(to: Path) -> None:
    """Write the article; needs the ``typst`` package, and no network."""
    import typst

    with (ROOT / "results" / "published.csv").open(encoding="utf-8", newline="") as lines:
        numbers, commit = read_published(lines)
    text = filled((HERE / "article.typ").read_text(encoding="utf-8"), numbers, commit)
    to.parent.mkdir(parents=True, exist_ok=True)
    source = HERE / f".article-{to.stem}.typ"  # next to its bibliography, which it names by a relative path
    try:
        source.write_text(text, encoding="utf-8")
        typst.compile(str(source), output=str(to), root=str(ROOT))
    finally:
        source.unlink(missing_ok=True)


if __name__ == "__main__":
    try:
        build(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "results" / "article" / "article.pdf")
    except ValueError as error:
        sys.exit(str(error))
