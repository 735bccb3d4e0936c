"""Putting the page together: what each paper and each figure shows, from the published folders.

`pipeline/report/page` has the template, the style and the scripts; ``conf/paper`` the sentences on the papers.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline import papers, plugins
from pipeline.reading import as_written
from pipeline.report import entries, ledger_picture, players, templates, verdicts
from pipeline.report.published import Published, read_published
from pipeline.report.templates import packed_json
from pipeline.skeleton import WALKER15
from pipeline.storage.publishing import new_file
from pipeline.validation import InvalidInput

PAGE = "index.html"
"""File name of the page."""

MOST_BYTES = 2_500_000
"""Largest page: larger ones are slow to open and refused by mail."""
TUTORIAL = "tutorial"
"""Folder of the tutorial's pictures, beside those of the data sets and in a light archive."""

_TITLE, _HEAD_BYTES = b"<title>3D motion from 2D motion: ", 1000
"""What a page of ours has in its first bytes: any other is not replaced."""

LEAST_WIDTH = 700
"""Least width of the pictures on it, px, however large the rest is."""

_SCRIPTS = (
    "walker.js",
    "charts.js",
    "ledger.js",
    "experiment.js",
    "players.js",
    "agreement.js",
)
_LAST_SCRIPTS = ("theme.js", "page.js")
"""Run behind those of plug-ins: the second begins the page."""


def write_page(
    folder: Path,
    figures: Sequence[str],
    *,
    to: Path | None = None,
    motion: bool = True,
) -> Path:
    """Write ``index.html`` beside the published figures, pictures smaller if it would be too large; return its path.

    Parameters
    ----------
    folder : Path
        ``results/<data>/<scale>``.
    figures : sequence of str
        All figures that the data set could have; those not made are named on the page.
    to : Path, optional
        Folder of the page, if it is not that of the results: its files are those that the page links to.
    motion : bool
        Whether it has the players, with the motion of walkers and clips in them.

    Raises
    ------
    InvalidInput
        If nothing is published, a placeholder in the sentences is unknown, or the page would be too large.
    """
    results = read_published(folder, figures)
    to, width = to or folder, entries.PICTURE_WIDTH
    with as_written(folder):
        text, pictures = _render(results, to, width, motion)
        # Pictures become smaller until it fits; their bytes go with the area.
        while len(text.encode()) > MOST_BYTES and pictures and width > LEAST_WIDTH:
            room = pictures - (len(text.encode()) - MOST_BYTES)
            share = max(room, 1) / pictures
            width = max(LEAST_WIDTH, int(0.97 * width * share**0.5))
            text, pictures = _render(results, to, width, motion)
    content = text.encode()
    if len(content) > MOST_BYTES:
        raise InvalidInput(
            "the page would be too large to send",
            to / PAGE,
            f"at most {MOST_BYTES} bytes",
            f"{len(content)}, {pictures} of them of pictures",
            code="file_too_large",
        )
    with new_file(to / PAGE, replace=lambda old: _TITLE in old[:_HEAD_BYTES]) as path:
        path.write_bytes(content)
    return to / PAGE


def _render(results: Published, to: Path, width: int, motion: bool) -> tuple[str, int]:
    """Return the page, and the bytes of the pictures in it."""
    environment = templates.environment()
    environment.filters |= {
        "tone": verdicts.tone,
        "beyond_tone": verdicts.beyond_tone,
        "number": entries.number,
    }
    style = templates.style()
    added = [path for page in plugins.pages() for path in page.scripts]
    script = templates.scripts([*_SCRIPTS, *added, *_LAST_SCRIPTS])
    if motion:
        with as_written(results.folder / "zhang2007_fig5"):
            walkers, no_walkers = players.walkers(results.figures.get("zhang2007_fig5"))
        with as_written(results.folder / "park2011_fig4"):
            clips, no_clips = players.clips(results.figures.get("park2011_fig4"))
    else:
        walkers, clips = {}, {}
        no_walkers = no_clips = (
            f"this page gives no recorded motion on; make sweeps DATA={results.data} makes one that plays"
        )
    known = {**results.figures, **results.missing}
    of_papers = {
        key for key, paper in papers.all_papers().items() if known.keys() & {*paper.figures, *paper.beyond}
    }
    reasons = [
        reason
        for key, reason in (("zhang2007", no_walkers), ("park2011", no_clips))
        if reason and key in of_papers
    ]
    terms = entries.terms_of(results)
    figures = {}
    for name, figure in results.figures.items():
        with as_written(figure.folder):
            figures[name] = entries.figure_entry(figure, results, terms, to, width)
    others = {} if results.recorded else ledger_picture.other_sets(results)
    shown = [
        entries.paper_entry(papers.all_papers()[key], results, figures, others)
        for key in papers.all_papers()
        if key in of_papers
    ]
    ledger = ledger_picture.ledger_picture(results)
    for paper in shown:  # a player, or curves of the figure that stands for it
        played = {"zhang2004": walkers, "zhang2007": walkers, "park2011": clips}.get(paper["key"])
        paper["shows_curves"] = bool(not played and paper["touch"] and paper["touch"]["charts"])
    text = environment.get_template("index.html.j2").render(
        results=results,
        papers=shown,
        whom="synthetic people, whose true motion is known"
        if results.data == "synthetic"
        else f"recordings of real people ({results.data})",
        commits=sorted({figure.commit for figure in results.figures.values()}),
        legend=verdicts.legend(results),
        **templates.in_every_page(style, script),
        walkers=len(walkers["names"]) if walkers else 0,
        views=[int(walkers["views_deg"][0]), int(walkers["views_deg"][-1])] if walkers else [],
        clips=bool(clips),
        reasons=list(dict.fromkeys(reasons)),
        options=entries.options_of(results.data, results.scale),
        **entries.published_numbers(results),
        ledger=packed_json(ledger) if ledger else "",
        tutorial=[f"{TUTORIAL}/{path.name}" for path in sorted((to / TUTORIAL).glob("*.svg"))],
        sources=[{"name": name, "terms": words} for name, words in terms.items()],
        packages=_packages(results),
        joints=packed_json(WALKER15.joints),
        walkers_packed=packed_json(walkers),
        clips_packed=packed_json(clips),
        tables={
            name: packed_json(played)
            for name, figure in results.figures.items()
            if (played := entries.played_tables(figure))
        },
    )
    shown = [entry["picture"] for entry in figures.values() if entry["picture"]]
    return text, sum(len(picture.get("uri") or picture["packed"]) for picture in shown)


def _packages(results: Published) -> str:
    found = {
        f"{name} {version}"
        for figure in results.figures.values()
        for name, version in figure.manifest.get("provenance", {}).get("packages", {}).items()
    }
    return "Made with " + ", ".join(sorted(found)) + "." if found else ""
