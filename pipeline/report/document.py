"""Putting the page together: what each paper and each figure shows, from the published folders.

`pipeline/report/page` has the template, the style and the scripts; ``conf/report.yaml`` the sentences on the papers and
which columns are drawn as curves.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline import papers, pictures
from pipeline.palette import COLOURS, ROLES
from pipeline.report import players, templates
from pipeline.report.published import (
    Published,
    PublishedFigure,
    Table,
    first_rows,
    packed_json,
    read_published,
)
from pipeline.skeleton import WALKER15
from pipeline.storage import provenance, tables
from pipeline.storage.sealed_folders import replace_file, writing
from pipeline.validation import InvalidInput

PAGE = "index.html"
"""File name of the page."""

MOST_BYTES = 5_000_000
"""Largest page: larger ones are slow to open and refused by mail."""

TABLE_BYTES = 52_000
"""Tables up to this size are in the page as they are; of larger ones the first rows."""

FIRST_ROWS = 50
PICTURE_WIDTH, SHOT_WIDTH = 1400, 640

_SCRIPTS = ("walker.js", "charts.js", "players.js", "theme.js", "page.js")

TONES = {
    "good": "our number is within bounds of the paper's.",
    "empty": "it is, but it would be without the method too.",
    "half": "the paper's direction holds, not its size.",
    "bad": "it does not; the ledger says why.",
    "none": "our data cannot decide.",
    "met": "a condition of the paper's experiment, a count or a setting, is ours as well.",
    "unmet": "it is not: see the ledger.",
}
"""What a verdict means, by the sign that it has on the page."""


def write_page(
    folder: Path,
    figures: Sequence[str],
    *,
    variants: Sequence[Mapping[str, Any]] = (),
    to: Path | None = None,
) -> tuple[Path, dict[str, int]]:
    """Write ``index.html`` beside the published figures; return its path and the bytes of each part.

    Parameters
    ----------
    folder : Path
        ``results/<data>/<scale>``.
    figures : sequence of str
        All figures that the data set could have; those not made are named on the page.
    variants : sequence of mappings
        Comparisons of variants: title, folder, header, rows and, optionally, a picture's path.
    to : Path, optional
        Folder of the page, if it is not that of the results: its files are those that the page links to.

    Raises
    ------
    InvalidInput
        If nothing is published, a placeholder in the sentences is unknown, or the page would be too large.
    """
    results = read_published(folder, figures)
    to = to or folder
    layout = papers.read_mapping(provenance.PROJECT / "conf" / "report.yaml")
    text, parts = _render(results, layout, variants, to)
    content = text.encode()
    if len(content) > MOST_BYTES:
        raise InvalidInput(
            "the page would be too large to send",
            where=str(to / PAGE),
            expected=f"at most {MOST_BYTES} bytes",
            received=f"{len(content)}: " + ", ".join(f"{name} {size}" for name, size in parts.items()),
        )
    with writing(to / PAGE):
        replace_file(to / PAGE, content)
    return to / PAGE, {**parts, "page": len(content)}


def _render(
    results: Published, layout: Mapping[str, Any], variants: Sequence[Mapping[str, Any]], to: Path
) -> tuple[str, dict[str, int]]:
    environment = templates.environment()
    environment.filters["tone"] = tone
    environment.filters["number"] = number
    style = templates.style()
    script = templates.scripts(_SCRIPTS)
    walkers, no_walkers = players.walkers(results.figures.get("zhang2007_fig5"))
    clips, no_clips = players.clips(results.figures.get("park2011_fig4"))
    of_papers = {key for key in papers.PAPERS if any(f.startswith(key) for f in _all_figures(results))}
    reasons = [
        reason
        for key, reason in (("zhang2007", no_walkers), ("park2011", no_clips))
        if reason and key in of_papers
    ]
    terms = _terms(results)
    entries = {
        name: _figure_entry(figure, results, layout, terms, to) for name, figure in results.figures.items()
    }
    shown = [
        _paper_entry(papers.PAPERS[key], results, layout, entries)
        for key in papers.PAPERS
        if key in of_papers
    ]
    packed = {name: packed_json(_embedded(figure)) for name, figure in results.figures.items()}
    walkers_packed, clips_packed = packed_json(walkers), packed_json(clips)
    text = environment.get_template("index.html.j2").render(
        results=results,
        papers=shown,
        whom=_whom(results),
        commits=sorted({figure.commit for figure in results.figures.values()}),
        legend=_legend(results),
        style=style,
        script=script,
        walkers=len(walkers["names"]) if walkers else 0,
        views=[int(walkers["views_deg"][0]), int(walkers["views_deg"][-1])] if walkers else [],
        clips=bool(clips),
        reasons=reasons,
        options=_options(results),
        variants=[_variant_entry(variant) for variant in variants],
        sources=[{"name": name, "terms": words} for name, words in terms.items()],
        packages=_packages(results),
        roles=packed_json({**{name: name for name in COLOURS}, **ROLES, **layout["colours"]}),
        bones=packed_json([list(bone) for bone in WALKER15.bones]),
        joints=packed_json(list(WALKER15.joints)),
        walkers_packed=walkers_packed,
        clips_packed=clips_packed,
        tables=packed,
    )
    pictured = sum(len(entry["picture"]["uri"]) for entry in entries.values() if entry["picture"])
    parts = {
        "pictures": pictured + sum(len(p["shot"]["uri"]) for p in shown if p["shot"]),
        "tables": sum(len(text.encode()) for text in packed.values()),
        "walkers": len(walkers_packed),
        "clips": len(clips_packed),
        "scripts and style": len(script.encode()) + len(style.encode()),
    }
    return text, parts


def _all_figures(results: Published) -> list[str]:
    return [*results.figures, *results.missing]


def tone(verdict: str) -> str:
    """Return the class of a verdict for the style: a key of `TONES`.

    Examples
    --------
    >>> [tone(v) for v in ("reproduced", "holds, also of the null", "direction only", "differs", "undecided")]
    ['good', 'empty', 'half', 'bad', 'none']
    >>> tone("met"), tone("not met")
    ('met', 'unmet')
    """
    words = verdict.lower()
    if "null" in words:
        return "empty"
    beginnings = {
        "reproduced": "good", "direction": "half", "differs": "bad", "met": "met", "not met": "unmet"
    }  # fmt: skip
    return next((kind for start, kind in beginnings.items() if words.startswith(start)), "none")


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


class _Ours(dict[str, float]):
    """Our numbers by claim; those without a value are written as such."""

    def __missing__(self, name: str) -> _NoNumber:
        papers.quantity(name)  # refuses a name that no paper's file has
        return _NoNumber()


class _NoNumber:
    def __format__(self, specification: str) -> str:
        return "(no number here)"


def _paper_entry(
    paper: papers.Paper, results: Published, layout: Mapping[str, Any], entries: Mapping[str, dict[str, Any]]
) -> dict[str, Any]:
    said = layout["papers"].get(paper.key, {})
    shot = results.figures.get(said.get("figure", ""))
    wanted = (*paper.figures, *paper.beyond)
    return {
        "key": paper.key,
        "title": paper.title,
        "authors": _surnames(paper.authors),
        "year": paper.year,
        "venue": paper.venue,
        "sentences": [
            sentence.format_map(_Ours(results.ours)).replace(" %", "\u00a0%").replace(" mm", "\u00a0mm")
            for sentence in said.get("sentences", [])
        ],
        "shot": _picture(shot, SHOT_WIDTH) if shot else None,
        "shot_title": shot.title if shot else "",
        "counts": counts_by_kind(results.claims_of(paper=paper.key)),
        "verdicts": [
            verdict for verdict, _ in _tally(c["verdict"] for c in results.claims_of(paper=paper.key))
        ],
        "figures": [entries[name] for name in wanted if name in entries],
        "missing": [(name, results.missing[name]) for name in wanted if name in results.missing],
    }


def counts_by_kind(claims: Iterable[Mapping[str, Any]]) -> list[tuple[str, list[tuple[str, int]]]]:
    """Return how many claims of each kind have each verdict.

    Examples
    --------
    >>> counts_by_kind([{"kind": "result", "verdict": "reproduced"}, {"kind": "result", "verdict": "differs"}])
    [('results', [('reproduced', 1), ('differs', 1)])]
    """
    kinds: dict[str, list[str]] = {}
    for claim in claims:
        kinds.setdefault(str(claim.get("kind") or "claim"), []).append(str(claim["verdict"]))
    order = [kind.value for kind in papers.Kind]
    return [
        (f"{kind}s", _tally(kinds[kind]))
        for kind in sorted(kinds, key=lambda kind: order.index(kind) if kind in order else len(order))
    ]


def _tally(verdicts: Iterable[str]) -> list[tuple[str, int]]:
    known = {outcome.value: place for place, outcome in enumerate(papers.Outcome)}
    return sorted(
        Counter(verdict.removesuffix(" on this data") for verdict in verdicts).items(),
        key=lambda item: (known.get(item[0], len(known)), item[0]),
    )


def _legend(results: Published) -> list[tuple[str, str, str]]:
    """Return sign, verdicts and meaning of the verdicts that the page has."""
    there = [verdict for verdict, _ in _tally(claim["verdict"] for claim in results.claims)]
    named = {kind: ", ".join(verdict for verdict in there if tone(verdict) == kind) for kind in TONES}
    return [(kind, named[kind], words) for kind, words in TONES.items() if named[kind]]


def _figure_entry(
    figure: PublishedFigure,
    results: Published,
    layout: Mapping[str, Any],
    terms: Mapping[str, str],
    to: Path,
) -> dict[str, Any]:
    claims = [_claim_entry(row) for row in results.claims_of(figure=figure.name)]
    made = figure.manifest.get("provenance", {})
    seconds = sum(stage.get("seconds", 0.0) for stage in figure.manifest.get("stages", {}).values())
    dirty = " with changes" if made.get("dirty") is True else ""
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
        "picture": _picture(figure, PICTURE_WIDTH),
        "charts": [json.dumps(chart, ensure_ascii=False) for chart in charts_of(figure, layout)],
        "claims": claims,
        "open": False,
        "has_kind": any(claim["kind"] for claim in claims),
        "has_null": any(claim["null"] is not None for claim in claims),
        "tally": _tally(claim["verdict"] for claim in claims),
        "tables": [_table_entry(table) for table in figure.tables],
        "command": f"make {figure.name}{_options(results)}",
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
    low, high = row.get("value_low"), row.get("value_high")
    return {
        **{name: row.get(name) for name in ("quote", "section", "published", "value", "unit", "why", "null")},
        "kind": row.get("kind") or "",
        "verdict": str(row["verdict"]),
        "interval": f"{number(low)} to {number(high)}" if low is not None and high is not None else "",
    }


def charts_of(figure: PublishedFigure, layout: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the curves of a figure that its tables have the columns for."""
    headers = {Path(table.name).stem: table.header for table in figure.tables if _whole(table)}
    found = []
    for chart in layout["charts"].get(figure.name, []):
        header = headers.get(chart["table"], [])
        several = chart["y"] if isinstance(chart["y"], list) else [chart["y"]]
        there = [name for name in several if name in header]
        needed = {chart["x"], *chart.get("by", []), *chart.get("where", {})}
        if there and needed <= set(header):
            found.append({**chart, "y": there if isinstance(chart["y"], list) else chart["y"]})
    return found


def _whole(table: Table) -> bool:
    return len(table.text) <= TABLE_BYTES


def _table_entry(table: Table) -> dict[str, Any]:
    cut = 0 if _whole(table) else FIRST_ROWS
    return {"name": table.name, "rows": f"{table.rows:,}", "columns": len(table.header), "cut": cut}


def _embedded(figure: PublishedFigure) -> dict[str, str]:
    return {
        table.name: table.text if _whole(table) else first_rows(table.text, FIRST_ROWS)
        for table in figure.tables
    }


def _picture(figure: PublishedFigure | None, width: int) -> dict[str, Any] | None:
    if figure is None or not (figure.folder / "figure.png").is_file():
        return None
    return pictures.embedded(figure.folder / "figure.png", width)


def _variant_entry(variant: Mapping[str, Any]) -> dict[str, Any]:
    path = variant.get("picture")
    return {**variant, "picture": pictures.embedded(path, PICTURE_WIDTH) if path else None}


def _terms(results: Published) -> dict[str, str]:
    """Return the terms of each source that some figure uses."""
    listed = provenance.PROJECT / "data" / "sources.csv"
    rows = tables.read_rows(listed) if listed.is_file() else []
    known = {row["source"]: row["terms"] for row in rows}
    known["synthetic"] = "made by this software from its seed: no recording of anybody"
    used = sorted({source for figure in results.figures.values() for source in figure.sources})
    return {source: known.get(source, "your own recordings") for source in used}


def _whom(results: Published) -> str:
    if results.data == "synthetic":
        return "synthetic people, whose true motion is known"
    return f"recordings of real people ({results.data})"


def _options(results: Published) -> str:
    data = "" if results.data == "synthetic" else f" DATA={results.data}"
    return data + ("" if results.scale == "full" else f" SCALE={results.scale}")


def _packages(results: Published) -> str:
    found = {
        f"{name} {version}"
        for figure in results.figures.values()
        for name, version in figure.manifest.get("provenance", {}).get("packages", {}).items()
    }
    return "Made with " + ", ".join(sorted(found)) + "." if found else ""


def _surnames(authors: str) -> str:
    names = [part.split()[-1] for part in authors.replace(" and ", ", ").split(",") if part.strip()]
    return names[0] + " et al." if len(names) > 2 else " & ".join(names)


def _link(folder: Path, name: str) -> str:
    """Return the address of a file, or of what is kept instead of it, relative to the page; empty if there is none."""
    kept = (name, f"{name}.gz", name.replace(".png", ".webp"))
    return next((f"{folder.name}/{one}" for one in kept if (folder / one).is_file()), "")


def _size(figure: PublishedFigure, name: str) -> str:
    size = figure.manifest["files"].get(name, {}).get("bytes")
    return "the record" if size is None else f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.0f} kB"
