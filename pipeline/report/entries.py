"""What the page shows of each paper, figure, claim and table, as plain values for its template."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import papers, pictures
from pipeline.report import page_charts, players
from pipeline.report.published import Published, PublishedFigure, Table, first_rows
from pipeline.report.verdicts import answers, counts_by_kind, tally
from pipeline.storage import provenance, tables
from pipeline.studies.published import filled

TABLE_BYTES = 20_000
"""Tables up to this size are in the page as they are; of larger ones the first rows."""

FIRST_ROWS = 50
PICTURE_WIDTH, SHOT_WIDTH = 1400, 640

WIDE = 1.6
"""Pictures wider than this times their height stand above their curves."""


def paper_entry(
    paper: papers.Paper, results: Published, entries: Mapping[str, dict[str, Any]]
) -> dict[str, Any]:
    """Return what the page shows of a paper: sentences with our numbers, a picture, verdicts, and its figures."""
    shot = results.figures.get(paper.page.figure)
    wanted = (*paper.figures, *paper.beyond)
    return {
        "key": paper.key,
        "title": paper.title,
        "authors": _surnames(paper.authors),
        "year": paper.year,
        "venue": paper.venue,
        "ours": not paper.figures,
        "sentences": [
            sentence.format_map(_Ours(results.ours)).replace(" %", "\u00a0%").replace(" mm", "\u00a0mm")
            for sentence in paper.page.sentences
        ],
        "shot": _picture(shot, SHOT_WIDTH, paper.page.part) if shot else None,
        "shot_title": shot.title if shot else "",
        "counts": counts_by_kind(results.claims_of(paper=paper.key)),
        "verdicts": [agreement for agreement, _, _ in tally(results.claims_of(paper=paper.key))],
        "figures": [entries[name] for name in wanted if name in entries],
        "missing": [(name, results.missing[name]) for name in wanted if name in results.missing],
    }


class _Ours(dict[str, float]):
    """Our numbers by claim; those without a value are written as such."""

    def __missing__(self, name: str) -> _NoNumber:
        papers.quantity(name)  # refuses a name that no paper's file has
        return _NoNumber()


class _NoNumber:
    def __format__(self, specification: str) -> str:
        return "(no number here)"


def _surnames(authors: str) -> str:
    names = [part.split()[-1] for part in authors.replace(" and ", ", ").split(",") if part.strip()]
    return names[0] + " et al." if len(names) > 2 else " & ".join(names)


def figure_entry(
    figure: PublishedFigure,
    results: Published,
    terms: Mapping[str, str],
    to: Path,
    width: int = PICTURE_WIDTH,
) -> dict[str, Any]:
    """Return what the page shows of a figure; links are to the files that lie beside a page in `to`."""
    claims = [_claim_entry(row) for row in results.claims_of(figure=figure.name)]
    made = figure.manifest.get("provenance", {})
    seconds = sum(stage.get("seconds", 0.0) for stage in figure.manifest.get("stages", {}).values())
    dirty = " with changes" if made.get("dirty") is True else ""
    picture, curves = _picture(figure, width), page_charts.charts_of(figure)
    return {
        "name": figure.name,
        "title": figure.title,
        "expect": figure.expect,
        "words": figure.name,
        "quotes": list(
            dict.fromkeys(
                claim["quote"]
                for claim in claims
                if claim["published"] is not None and claim["kind"] in ("", papers.Kind.RESULT)
            )
        )[:4],
        "picture": picture,
        # Beside its curves a picture has half the page's width, in which a wide one is too small to read.
        "stacked": not curves or picture is None or picture["width"] > WIDE * picture["height"],
        "charts": [json.dumps(chart, ensure_ascii=False) for chart in curves],
        "claims": claims,
        "open": False,
        "ours": bool(claims) and all(claim["kind"] == papers.Kind.TARGET for claim in claims),
        "has_kind": any(claim["kind"] for claim in claims),
        "has_baseline": any(claim["baseline"] for claim in claims),
        "tally": tally(claims),
        "tables": [_table_entry(table) for table in figure.tables],
        "command": f"make {figure.name}{options_of(results)}",
        "sources": [f"{name}: {terms.get(name, 'terms not known here')}" for name in figure.sources]
        or ["not stated"],
        "provenance": f"commit {figure.commit}{dirty}, seed {figure.manifest.get('seed', '?')}, Python"
        f" {made.get('python', '?')} on {made.get('system', '?')} {made.get('machine', '?')},"
        f" {seconds:.1f} s to compute",
        "files": [
            {"name": name, "link": _link(to / figure.name, name), "size": _size(figure, name)}
            for name in figure.files
        ],
    }


def _claim_entry(row: Mapping[str, Any]) -> dict[str, Any]:
    agreement, beyond = answers(row)
    same = ("quote", "section", "published", "value", "unit", "why", "help", "same_as")
    return {
        **{name: row.get(name) for name in same},
        "kind": row.get("kind") or "",
        "agreement": agreement,
        "beyond_baseline": beyond,
        "interval": _interval(row, "value"),
        "one_sample": _interval(row, "one_sample"),
        "paper_in_prediction": row.get("paper_in_prediction") or "",
        "baseline": row.get("baseline") or "",
        "knows": row.get("baseline_knows") or "",
        "of_baseline": row.get("baseline_value"),
        "gain": _interval(row, "gain"),
    }


def _interval(row: Mapping[str, Any], name: str) -> str:
    low, high = row.get(f"{name}_low"), row.get(f"{name}_high")
    return f"{number(low)} to {number(high)}" if low is not None and high is not None else ""


def curve_tables(figure: PublishedFigure) -> dict[str, str]:
    """Return what charts and players read of tables that are too large for the page: these rows and columns.

    Numbers have six digits; intervals go with their quantity.
    """
    needed = page_charts.columns_of(figure)
    for name, wanted in players.COLUMNS.get(figure.name, {}).items():
        needed.setdefault(name, set()).update(wanted)
    played = players.COLUMNS.get(figure.name, {})
    made = {}
    for table in figure.tables:
        if table.name in needed and not _whole(table):
            kept = [name for name in table.header if name in needed[table.name]]
            made[table.name] = _columns(figure, table, kept, every_row=table.name in played)
    return made


def _columns(figure: PublishedFigure, table: Table, names: Sequence[str], *, every_row: bool) -> str:
    stem = Path(table.name).stem
    rows = figure.table(stem) or {}
    drawn = slice(None) if every_row else page_charts.drawn_rows(figure, stem, rows)
    texts = [
        [f"{v:.6g}" if isinstance(v, float) else str(v) for v in np.asarray(rows[name])[drawn].tolist()]
        for name in names
    ]
    lines = [names, *zip(*texts, strict=True)]
    return "".join(f"{','.join(line)}\n" for line in lines)


def _table_entry(table: Table) -> dict[str, Any]:
    cut = 0 if _whole(table) else FIRST_ROWS
    return {"name": table.name, "rows": f"{table.rows:,}", "columns": len(table.header), "cut": cut}


def embedded_tables(figure: PublishedFigure) -> dict[str, str]:
    """Return the text of each table of a figure by file name, of large ones the first rows."""
    return {
        table.name: table.text if _whole(table) else first_rows(table.text, FIRST_ROWS)
        for table in figure.tables
    }


def _whole(table: Table) -> bool:
    return len(table.text) <= TABLE_BYTES


def _picture(
    figure: PublishedFigure | None, width: int, part: Sequence[float] | None = None
) -> dict[str, Any] | None:
    if figure is None or not (figure.folder / "figure.png").is_file():
        return None
    return pictures.embedded(figure.folder / "figure.png", width, part)


def variant_entry(variant: Mapping[str, Any]) -> dict[str, Any]:
    """Return a comparison of variants with its picture as text."""
    path = variant.get("picture")
    return {**variant, "picture": pictures.embedded(path, PICTURE_WIDTH) if path else None}


PUBLISHED = "published.csv"
"""File name of the published numbers of all data sets, in ``results`` and as it is downloaded from the page."""


def published_rows(results: Published) -> str:
    """Return the text of the published numbers, beside full-scale results of one of their data sets; else nothing."""
    listed = provenance.PROJECT / "results" / PUBLISHED
    if results.scale != "full" or not listed.is_file() or results.data not in tables.read(listed)["data"]:
        return ""
    return listed.read_text(encoding="utf-8")


def published_commits(results: Published) -> list[dict[str, str]]:
    """Return, for each data set of the published numbers, their commit, and whether it made this page's figures."""
    here = {figure.commit for figure in results.figures.values()}
    made = {
        (row["data"], row["commit"]) for row in tables.read_rows(provenance.PROJECT / "results" / PUBLISHED)
    }
    return [
        {
            "data": data,
            "commit": commit,
            "other": ""
            if data != results.data or commit in here
            else "the figures here are of another commit",
        }
        for data, commit in sorted(made)
    ]


def published_tables(results: Published) -> list[dict[str, Any]]:
    """Return the tables of published numbers over data sets."""
    numbers = tables.read(provenance.PROJECT / "results" / PUBLISHED)
    layout = papers.read_mapping(provenance.PROJECT / "conf" / "readme.yaml")
    found = filled({name: table for name, table in layout.items() if name != "headline"}, numbers)
    return [
        {"title": layout[name]["title"], "heads": heads, "rows": rows}
        for name, (heads, rows) in found.items()
        if rows
    ]


def terms_of(results: Published) -> dict[str, str]:
    """Return the terms of each source that some figure uses."""
    listed = provenance.PROJECT / "data" / "sources.csv"
    rows = tables.read_rows(listed) if listed.is_file() else []
    known = {row["source"]: row["terms"] for row in rows}
    known["synthetic"] = "made by this software from its seed: no recording of anybody"
    used = sorted({source for figure in results.figures.values() for source in figure.sources})
    return {source: known.get(source, "your own recordings") for source in used}


def number(value: Any) -> str:
    """Return a number to four digits, empty for none.

    Examples
    --------
    >>> number(28.7792742), number(None), number(123456.7), number(2.1e-15)
    ('28.78', '', '123,457', '2.1e-15')
    """
    if value is None or value == "" or isinstance(value, str):
        return value or ""
    return f"{value:,.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"


def options_of(results: Published) -> str:
    """Return the options of a make command for these results, with a space before each."""
    data = "" if results.data == "synthetic" else f" DATA={results.data}"
    return data + ("" if results.scale == "full" else f" SCALE={results.scale}")


def _link(folder: Path, name: str) -> str:
    """Return the address of a file, or of what is kept instead of it, relative to the page; empty if there is none."""
    kept = (name, f"{name}.gz", name.replace(".png", ".webp"))
    return next((f"{folder.name}/{one}" for one in kept if (folder / one).is_file()), "")


def _size(figure: PublishedFigure, name: str) -> str:
    size = figure.manifest["files"].get(name, {}).get("bytes")
    return "the record" if size is None else f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.0f} kB"
