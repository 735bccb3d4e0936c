"""Measurement of a report page in a browser, and comparison of the page's numbers with the tables.

``python -m tests.report.counted FOLDER`` prints the result.

The counts are of a browser at three widths, in light and dark colours, with reduced motion, and in print.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pipeline import papers
from pipeline.palette import COLOURS
from pipeline.report.published import numbered_rows
from pipeline.storage import tables

WIDTHS, HEIGHT = (1440, 768, 390), 900
LOOKS = {
    "light": [],
    "dark": ["--blink-settings=preferredColorScheme=0"],
    "still": ["--force-prefers-reduced-motion"],
}
"""Browser options for the light, the dark and the still appearance of the page."""

LIMITS = {"cut": 0, "ledger": 1.5, "story": 9.0, "appendix": 15.0, "wider": 0, "shift": 0.05}
"""Largest permitted measurements of the page, such as the number of cut labels and the height of each section."""

MAX_PRINTED = 35
"""Largest permitted number of printed pages."""

_SCRIPT = Path(__file__).with_name("counted.js")
_FRAME = """<!doctype html><script>
addEventListener("message", event => {{ document.body.dataset.counted = event.data; }});
</script><body><iframe src="index.html" width="{width}" height="{height}" style="border: 0"></iframe></body>"""
"""HTML page that shows the report page in a frame of exact size."""

_NUMBER = re.compile(r"[−-]?\d+(?:,\d{3})*(?:\.\d+)?")


def run(browser: str, *options: str) -> str:
    """Run the browser without a window for one minute of virtual time, and return its output."""
    with tempfile.TemporaryDirectory() as profile:
        command = [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}"]
        command += ["--virtual-time-budget=60000", *options]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=600).stdout


def counts(browser: str, page: Path, width: int, look: str = "light") -> dict[str, Any]:
    """Return the measurements of a report page in a window of the given width, px."""
    text = re.sub(r"<meta http-equiv[^>]*>", "", page.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        copy, frame = Path(folder) / "index.html", Path(folder) / "frame.html"
        script = _SCRIPT.read_text(encoding="utf-8")
        copy.write_text(text.replace("<head>", f"<head><script>{script}</script>", 1), encoding="utf-8")
        frame.write_text(_FRAME.format(width=width, height=HEIGHT), encoding="utf-8")
        dom = run(
            browser,
            "--window-size=1600,1100",
            "--hide-scrollbars",
            *LOOKS[look],
            "--dump-dom",
            frame.as_uri(),
        )
    [counted] = re.findall(r'data-counted="([^"]*)"', dom)
    return json.loads(html.unescape(counted))


def printed(browser: str, page: Path) -> int:
    """Return the number of pages if the report page is printed."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "page.pdf"
        run(browser, f"--print-to-pdf={path}", page.as_uri())
        return len(re.findall(rb"/Type\s*/Page\b", path.read_bytes()))


def contradictions(
    folder: Path, text: str, counted: Mapping[str, Any], others: Mapping[str, Path]
) -> list[str]:
    """Return the numbers, colours and bands on the page that disagree with the tables, the palette or the charts.

    Parameters
    ----------
    folder : Path
        Published figures, with ``claims.csv``.
    text : str
        The page's source.
    counted : mapping
        Result of `counts`.
    others : mapping of str to Path
        Further tables of claims, or of published numbers, by data set.
    """
    rows = {row["claim"]: row for row in numbered_rows(folder / "claims.csv")}
    problems = []
    for claim, printed_text in counted["values"].items():
        value, number = rows[claim]["value"], _NUMBER.match(printed_text)
        if not (_rounds_to(value, number[0]) if value is not None and number else printed_text == "–"):
            problems.append(f"ledger, {claim}: {printed_text}, table {value}")
    reference = list(_registered())
    reference += list(
        _numbers([*rows.values(), *(r for path in others.values() for r in numbered_rows(path))])
    )
    for sentence in counted["sentences"]:
        words = re.sub(r"\b(DATA|zhang|mozerov|park|figure)\w*|(?<![\d.])[1-9](?![\d.])", "", sentence)
        for number in _NUMBER.findall(words):
            if not any(_rounds_to(value, number) for value in reference):
                problems.append(f"sentence: no {number} in the tables: {sentence.strip()}")
    problems += _alive(folder, counted["alive"])
    return problems + list(_captions(text))


def _registered() -> Iterator[float]:
    """Yield the numbers that the papers print, and our values under other assumptions."""
    for claim in (claim for paper in papers.all_papers().values() for claim in paper.claims):
        if claim.published is not None:
            yield claim.published
        for run in (e.run for explanations in claim.sensitivity.values() for e in explanations if e.run):
            if estimate := run.with_it.get(claim.name):
                yield from (estimate.value, estimate.low, estimate.high)


def _numbers(rows: Iterable[Mapping[str, Any]]) -> Iterator[float]:
    for row in rows:
        for name in ("value", "published", "baseline_value", "n_people"):
            if isinstance(value := row.get(name), int | float):
                yield value
                yield 100.0 * value  # a share, as per cent
        yield from (float(n) for n in re.findall(r"\d+(?:\.\d+)?", str(row.get("why", ""))))


def _rounds_to(value: float, printed_text: str) -> bool:
    digits = len(printed_text.partition(".")[2])
    number = float(printed_text.replace("−", "-").replace(",", ""))
    return abs(value - number) <= 0.5001 * 10**-digits or number == float(f"{value:.3g}")


def _alive(folder: Path, printed_text: str) -> list[str]:
    """Return the errors that the page computes and that differ from the figure's table after rounding."""
    if not printed_text:
        return []
    table = tables.read(folder / "zhang2007_fig5" / "table.csv")
    problems = []
    for number, by, key in re.findall(
        r"([\d.]+) mm (by least squares|with the prior|by the average walker)()", printed_text
    ):
        method = {"by least squares": "least_squares", "with the prior": "map"}.get(
            by, "average_walker"
        ) + key
        [error] = table["rms_error_mm"][(table["method"] == method) & (table["view_angle_deg"] == 0)]
        if abs(float(number) - error) > 0.06:
            problems.append(f"live error {by}: {number}, table {error:.2f}")
    return problems if printed_text.count(" mm ") == 3 else [*problems, f"live errors: {printed_text}"]


def _captions(text: str) -> Iterator[str]:
    """Yield the captions that mention a band or a colour that the charts of the figure do not contain."""
    for name, card in re.findall(
        r'<details class="figure" id="(\w+)">(.*?)<details class="files">', text, re.DOTALL
    ):
        specs = [json.loads(html.unescape(spec)) for spec in re.findall(r'data-spec="([^"]*)"', card)]
        if not specs or 'class="picture"' in card:
            continue
        series = [line for spec in specs for line in spec["series"]]
        caption = " ".join(re.findall(r'<p class="meta">(.*?)</p>', card, re.DOTALL))
        if re.search(r"\b[Bb]ands?\b", caption) and not any({"lo", "low"} & {*line} for line in series):
            yield f"{name}: its caption names bands"
        named = {word for word in re.findall(r"[a-z]+", caption.lower()) if word in COLOURS}
        for colour in named - {line["colour"] for line in series} - {"black"}:
            yield f"{name}: its caption names {colour}"


def main(folder: Path) -> int:
    """Print the measurements and the contradictions of a page; return 1 if a limit is exceeded."""
    folder = folder.resolve()
    browser = next(name for name in ("chromium", "chromium-browser", "google-chrome") if shutil.which(name))
    page, problems = folder / "index.html", []
    for look in LOOKS:
        for width in WIDTHS:
            counted = counts(browser, page, width, look)
            print(f"{width} px, {look}:", ", ".join(f"{name} {counted[name]:.3g}" for name in LIMITS))
            for name, limit in LIMITS.items():
                if counted[name] > limit and (width == WIDTHS[0] or name in ("cut", "wider")):
                    problems.append(f"{name} {counted[name]:.3g} at {width} px, {look}; limit {limit}")
    pages = printed(browser, page)
    print(f"print: {pages} pages; {page.stat().st_size / 1e6:.2f} MB")
    problems += [f"{pages} printed pages"] * (pages > MAX_PRINTED)
    near = {
        path.parent.parent.name: path for path in folder.parent.parent.glob(f"*/{folder.name}/claims.csv")
    }
    counted = counts(browser, page, WIDTHS[0])
    published = {"published": folder.parents[1] / "published.csv"}
    problems += contradictions(folder, page.read_text(encoding="utf-8"), counted, near | published)
    print("\n".join(problems) or f"no contradictions in {len(counted['values'])} claims")
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
