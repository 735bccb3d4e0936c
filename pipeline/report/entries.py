"""Entries of the report page for papers, figures, claims and tables, as plain values for the HTML template."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline import papers
from pipeline.papers import Agreement, Kind
from pipeline.pictures.embedding import embedded, packed_vector
from pipeline.report import page_charts, players
from pipeline.report.agreement import Numbers, numbers_of, numbers_of_others, sentences
from pipeline.report.published import Published, PublishedFigure
from pipeline.report.verdicts import answers
from pipeline.storage import provenance, tables
from pipeline.studies.captions import filled_caption
from pipeline.studies.published import filled

PICTURE_WIDTH = 1400
"""Largest width of a raster picture on the page, px."""

MAX_VECTOR_BYTES = 120_000
"""Size limit of a compressed vector picture on the page, bytes. A larger picture becomes a raster picture."""

THUMBNAIL_WIDTH = 240
"""Width, px, of the preview pictures of collapsed figures, which the page shows at half this width."""


def paper_entry(
    paper: papers.Paper,
    results: Published,
    entries: Mapping[str, dict[str, Any]],
    others: Mapping[str, Sequence[Mapping[str, Any]]] | None = None,
) -> dict[str, Any]:
    """Return the page's entry of a paper, with sentences that quote our values, verdicts, and figures.

    `others` are the claims of other data sets: sentences on recorded people, and counts for comparison.
    """
    made_for = {name: figure.manifest.get("paper", paper.key) for name, figure in results.figures.items()}
    # A claim on another paper's figure is listed here; the figure itself is under the other paper.
    figure_names = [n for n in (*paper.figures, *paper.beyond) if made_for.get(n, paper.key) == paper.key]
    claims = [row for row in results.claims_of(paper=paper.key) if not row.get("same_as")]
    kinds = counted_kinds(paper)
    counts = papers.count(claims, kinds)
    page_numbers = numbers_of(results)
    tallies = {
        data: papers.count((r for r in rows if r["paper"] == paper.key), kinds)
        for data, rows in (others or {}).items()
    }
    return {
        "key": paper.key,
        "title": paper.title,
        "authors": _surnames(paper.authors),
        "year": paper.year,
        "venue": paper.venue,
        "ours": not paper.figures,
        "question": paper.page.question,
        "sentences": [
            _unbroken(_sentence(template, results.data, page_numbers)) for template in paper.page.sentences
        ],
        "agrees": [
            {**entry, "text": _unbroken(entry["text"])}
            for entry in sentences(paper, page_numbers, numbers_of_others(others or {}, published_rows()))
        ],
        "touch": entries.get(paper.page.figure),
        "fails": [
            _claim_entry(row)
            for row in claims
            if row["agreement"] == Agreement.DIFFERS and Kind(row.get("kind") or Kind.RESULT) in kinds
        ],
        "judged": counts.judged,
        "agree": counts.number(Agreement.AGREES),
        "differ": counts.number(Agreement.DIFFERS),
        "others": [
            (data, tally.number(Agreement.AGREES), tally.judged)
            for data, tally in tallies.items()
            if tally.judged and not results.recorded
        ],
        "figures": [entries[name] for name in figure_names if name in entries],
        "missing": [(name, results.missing[name]) for name in figure_names if name in results.missing],
    }


def _unbroken(sentence: str) -> str:
    """Return a sentence with a non-breaking space before each unit."""
    return re.sub(r"(?<=\d) ?%", "\u00a0%", sentence).replace(" mm", "\u00a0mm")


def _sentence(template: str, data: str, numbers: Numbers) -> str:
    """Return a sentence with our values, followed in brackets by our values under other assumptions."""
    other = [
        run.filled(name, numbers(name))
        for name in papers.placeholders(template)
        if math.isfinite(numbers.rows.get(name, {}).get("value") or math.nan)
        for run in papers.claim(name).sensitivity.get(data, ())
    ]
    sentence = filled_caption(template, numbers)
    return f"{sentence.removesuffix('.')} ({'; '.join(other)})." if other else sentence


def counted_kinds(paper: papers.Paper) -> tuple[papers.Kind, ...]:
    """Return the kinds of claims that the page counts: results and sentences of a paper, or targets of our own work."""
    return papers.OF_PAPERS if paper.figures else (papers.Kind.TARGET,)


def _surnames(authors: str) -> str:
    names = [part.split()[-1] for part in authors.replace(" and ", ", ").split(",") if part.strip()]
    return names[0] + " et al." if len(names) > 2 else " & ".join(names)


def figure_entry(
    figure: PublishedFigure,
    results: Published,
    terms: Mapping[str, str],
    to: Path,
    width: int,
) -> dict[str, Any]:
    """Return the page's entry of a figure, with links relative to the folder of the page, `to`."""
    claims = results.claims_of(figure=figure.name)
    origin = figure.manifest.get("provenance", {})
    dirty = " with changes" if origin.get("dirty") is True else ""
    curves, raster = page_charts.charts_of(figure), figure.folder / "figure.png"
    # Charts replace the picture, unless the picture shows more than they do.
    pictured = not curves or figure.manifest.get("picture_beside_charts", False)
    return {
        "name": figure.name,
        "title": figure.title,
        "expect": figure.expect,
        "quotes": list(
            dict.fromkeys(
                claim["quote"]
                for claim in claims
                if claim["published"] is not None and (claim.get("kind") or Kind.RESULT) == Kind.RESULT
            )
        )[:4],
        "caption": figure.manifest.get("caption", "").removeprefix(f"{figure.title}. "),
        "thumbnail": embedded(raster, THUMBNAIL_WIDTH) if raster.is_file() else None,
        "picture": _picture(figure, width) if pictured else None,
        "charts": [
            json.dumps(chart, ensure_ascii=False, allow_nan=False, separators=(",", ":")) for chart in curves
        ],
        "claims": [_claim_entry(row) for row in claims],
        "tally": papers.count(claims).rows,
        "command": f"make {figure.name}{options_of(results.data, results.scale)}",
        "sources": [f"{name}: {terms.get(name, 'terms unknown')}" for name in figure.sources]
        or ["not stated"],
        "provenance": f"commit {figure.commit}{dirty}, seed {figure.manifest.get('seed', '?')}, Python"
        f" {origin.get('python', '?')} on {origin.get('system', '?')} {origin.get('machine', '?')}",
        "files": [
            {"name": name, "link": _link(to / figure.name, name), "size": _size(figure, name)}
            for name in figure.files
        ],
    }


def _claim_entry(row: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "name": row["claim"],
        "short": row.get("short") or row["claim"],
        "agreement": answers(row)[0],
    }


def played_tables(figure: PublishedFigure) -> dict[str, str]:
    """Return the table columns with which the interactive players check their results, as CSV text by file name.

    Numbers have six digits.
    """
    texts_of = {}
    for name, read_columns in players.columns_of(figure.name).items():
        table = figure.table(Path(name).stem) or {}
        columns = [column for column in table if column in read_columns]
        texts = [
            [f"{v:.6g}" if isinstance(v, float) else str(v) for v in table[column].tolist()]
            for column in columns
        ]
        if columns:
            texts_of[name] = "".join(f"{','.join(line)}\n" for line in (columns, *zip(*texts, strict=True)))
    return texts_of


def _picture(figure: PublishedFigure, width: int) -> dict[str, Any] | None:
    """Return the vector picture of a figure, or the raster picture if the vector picture is missing or too large.

    Return None if the figure has neither.
    """
    vector = figure.folder / "figure.svg"
    if vector.is_file() and (drawn := packed_vector(vector, MAX_VECTOR_BYTES)):
        return drawn
    raster = figure.folder / "figure.png"
    return embedded(raster, width) if raster.is_file() else None


PUBLISHED = "published.csv"
"""File name, in the folder ``results``, of the published numbers of all data sets."""


def published_rows() -> list[dict[str, str]]:
    """Return the rows of ``published.csv``, or an empty list if the file does not exist."""
    listed = provenance.PROJECT / "results" / PUBLISHED
    return tables.read_rows(listed) if listed.is_file() else []


def published_numbers(results: Published) -> dict[str, list[dict[str, Any]]]:
    """Return the tables of published numbers of all data sets, and the commit of each data set.

    Both are empty unless the results are full-scale and their data set is among the published ones.  A commit has a
    note if the figures of this page come from another one.
    """
    rows = published_rows() if results.scale == "full" else []
    if results.data not in {row.get("data") for row in rows}:
        return {"published": [], "published_commits": []}
    page_commits = {results.data: {figure.commit for figure in results.figures.values()}}
    layout = papers.read_mapping(provenance.PROJECT / "conf" / "readme.yaml")
    del layout["headline"]
    return {
        "published": [
            {"title": layout[name]["title"], "heads": heads, "rows": cells}
            for name, (heads, cells) in filled(
                layout, tables.read(provenance.PROJECT / "results" / PUBLISHED)
            ).items()
            if cells
        ],
        "published_commits": [
            {
                "data": data,
                "commit": commit,
                "other": ""
                if commit in page_commits.get(data, {commit})
                else "the figures on this page come from another commit",
            }
            for data, commit in sorted({(row["data"], row["commit"]) for row in rows})
        ],
    }


def terms_of(results: Published) -> dict[str, str]:
    """Return the terms of use of every data source of the figures, by source."""
    listed = provenance.PROJECT / "data" / "sources.csv"
    rows = tables.read_rows(listed) if listed.is_file() else []
    terms = {row["source"]: row["terms"] for row in rows}
    terms["synthetic"] = "generated by this software from a seed, without recordings of people"
    used = sorted({source for figure in results.figures.values() for source in figure.sources})
    return {source: terms.get(source, "your own recordings") for source in used}


def options_of(data: str, scale: str) -> str:
    """Return the options ``DATA`` and ``SCALE`` of the make commands on the page, each after a space."""
    options = "" if data == "synthetic" else f" DATA={data}"
    return options + ("" if scale == "full" else f" SCALE={scale}")


def _link(folder: Path, name: str) -> str:
    """Return the link to a file or to its compressed version, relative to the page.

    The link is empty if neither exists.
    """
    candidates = (name, f"{name}.gz", name.replace(".png", ".webp"))
    return next(
        (f"{folder.name}/{candidate}" for candidate in candidates if (folder / candidate).is_file()), ""
    )


def _size(figure: PublishedFigure, name: str) -> str:
    size = figure.manifest["files"].get(name, {}).get("bytes")
    return "manifest" if size is None else f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.0f} kB"
