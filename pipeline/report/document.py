"""Assembly of the report page, which has an entry for each paper and each published figure.

`pipeline/report/page` has the template, the style and the scripts.  ``conf/paper`` has the sentences on the papers.
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
"""File name of the report page."""

MAX_BYTES = 2_200_000
"""Size limit of the report page, bytes. A larger page is slow to open and too large for mail."""
TUTORIAL = "tutorial"
"""Folder of the tutorial's pictures, in ``results`` and in a light archive."""

_TITLE, _HEAD_BYTES = b"<title>3D motion from 2D motion: ", 1000
"""Text that identifies a report page, and number of bytes at the start of a file that are searched for it.

A file without this text is not replaced.
"""

MIN_PICTURE_WIDTH = 700
"""Smallest width of the pictures on the report page, px, even if the page then exceeds its size limit."""

_SCRIPTS = (
    "walker.js",
    "charts.js",
    "ledger.js",
    "experiment.js",
    "strips.js",
    "players.js",
    "agreement.js",
)
_LAST_SCRIPTS = ("theme.js", "page.js")
"""Scripts of the page that run after the scripts of plug-ins; ``page.js`` starts the page."""


def write_page(
    folder: Path,
    figures: Sequence[str],
    *,
    to: Path | None = None,
    motion: bool = True,
) -> Path:
    """Write ``index.html`` next to the published figures; pictures are reduced to keep the size limit.

    Parameters
    ----------
    folder : Path
        ``results/<data>/<scale>``.
    figures : sequence of str
        All figures that the data set could have; the page lists those that are missing.
    to : Path, optional
        Folder of the page and of the files that it links to; by default `folder`.
    motion : bool
        Include the players, which contain the motion of walkers and clips.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InvalidInput
        If nothing is published, a placeholder in the sentences is unknown, or the page would be too large.
    """
    results = read_published(folder, figures)
    to, width = to or folder, entries.PICTURE_WIDTH
    with as_written(folder):
        text, pictures = _render(results, to, width, motion)
        # Shrink the pictures until the page fits; their bytes are proportional to their area.
        while len(text.encode()) > MAX_BYTES and pictures and width > MIN_PICTURE_WIDTH:
            room = pictures - (len(text.encode()) - MAX_BYTES)
            share = max(room, 1) / pictures
            width = max(MIN_PICTURE_WIDTH, int(0.97 * width * share**0.5))
            text, pictures = _render(results, to, width, motion)
    content = text.encode()
    if len(content) > MAX_BYTES:
        raise InvalidInput(
            "the report page would be too large to send by mail",
            to / PAGE,
            f"at most {MAX_BYTES} bytes",
            f"{len(content)} bytes, {pictures} of them in pictures",
            code="file_too_large",
        )
    with new_file(to / PAGE, replace=lambda old: _TITLE in old[:_HEAD_BYTES]) as path:
        path.write_bytes(content)
    return to / PAGE


def _render(results: Published, to: Path, width: int, motion: bool) -> tuple[str, int]:
    """Return the HTML text of the page, and the number of bytes that the embedded pictures take."""
    environment = templates.environment()
    environment.filters["tone"] = verdicts.tone
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
            f"this page may not pass recorded motion on; `make sweeps DATA={results.data}` makes a page with players"
        )
    named_figures = {**results.figures, **results.missing}
    paper_keys = {
        key
        for key, paper in papers.all_papers().items()
        if named_figures.keys() & {*paper.figures, *paper.beyond}
    }
    reasons = [
        reason
        for key, reason in (("zhang2007", no_walkers), ("park2011", no_clips))
        if reason and key in paper_keys
    ]
    terms = entries.terms_of(results)
    figures = {}
    for name, figure in results.figures.items():
        with as_written(figure.folder):
            figures[name] = entries.figure_entry(figure, results, terms, to, width)
    others = ledger_picture.other_sets(results)
    paper_entries = [
        entries.paper_entry(papers.all_papers()[key], results, figures, others)
        for key in papers.all_papers()
        if key in paper_keys
    ]
    ledger = ledger_picture.ledger_picture(results)
    for paper in paper_entries:  # a player, or else the curves of the paper's main figure
        player_data = {"zhang2004": walkers, "zhang2007": walkers, "park2011": clips}.get(paper["key"])
        paper["shows_curves"] = bool(not player_data and paper["touch"] and paper["touch"]["charts"])
    text = environment.get_template("index.html.j2").render(
        results=results,
        papers=paper_entries,
        people="synthetic people, whose true motion is known"
        if results.data == "synthetic"
        else f"recordings of real people ({results.data})",
        commits=sorted({figure.commit for figure in results.figures.values()}),
        legend=verdicts.legend(results),
        **templates.in_every_page(style, script),
        walkers=len(walkers["names"]) if walkers else 0,
        estimated=bool(walkers and walkers["estimated"]),
        views=[int(walkers["views_deg"][0]), int(walkers["views_deg"][-1])] if walkers else [],
        clips=bool(clips),
        reasons=list(dict.fromkeys(reasons)),
        options=entries.options_of(results.data, results.scale),
        **entries.published_numbers(results),
        ledger=ledger,
        ledger_packed=packed_json(ledger),
        tutorial=[f"{TUTORIAL}/{path.name}" for path in sorted((to / TUTORIAL).glob("*.svg"))],
        sources=[{"name": name, "terms": words} for name, words in terms.items()],
        packages=_packages(results),
        joints=packed_json(WALKER15.joints),
        walkers_packed=packed_json(walkers),
        clips_packed=packed_json(clips),
        tables={
            name: packed_json(player_tables)
            for name, figure in results.figures.items()
            if (player_tables := entries.played_tables(figure))
        },
    )
    pictures = [
        entry["picture"] for entry in figures.values() if entry["picture"]
    ]  # thumbnails keep their size
    return text, sum(len(picture.get("uri") or picture["packed"]) for picture in pictures)


def _packages(results: Published) -> str:
    packages = {
        f"{name} {version}"
        for figure in results.figures.values()
        for name, version in figure.manifest.get("provenance", {}).get("packages", {}).items()
    }
    return "Made with " + ", ".join(sorted(packages)) + "." if packages else ""
