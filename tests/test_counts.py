"""Tests that README, page, article, documentation and ``make claims`` show the same numbers of verdicts."""

from __future__ import annotations

import csv
import gzip
import importlib.util
import re
from itertools import cycle
from pathlib import Path

import pytest
import yaml

from pipeline import papers
from pipeline.cli.summary import counts
from pipeline.papers import Agreement, Beyond, Estimate, Evidence, Kind, Verdict
from pipeline.report import first_screen
from pipeline.report.document import write_page
from pipeline.report.published import read_published
from pipeline.storage import tables
from pipeline.studies import published
from pipeline.studies.ledger import write_claims
from tests.report.planted import plant

ROOT = Path(__file__).resolve().parents[1]
LAYOUT = yaml.safe_load((ROOT / "conf" / "readme.yaml").read_text(encoding="utf-8"))
_SPEC = importlib.util.spec_from_file_location("article", ROOT / "docs" / "article" / "build.py")
assert _SPEC is not None
assert _SPEC.loader is not None
article = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(article)

DATA = {"optical": 3, "synthetic": 7}
"""Data sets, each with the period after which its made-up verdicts repeat."""

OF_PAPERS = {key: paper for key, paper in papers.all_papers().items() if paper.figures and paper.claims}

Count = tuple[int, int, int]
"""Numbers of claims that agree, that are judged, and that agree and beat their baseline."""


def verdicts(length: int) -> list[Verdict]:
    """Return made-up verdicts on every testable claim, in which each kind of claim gets each possible verdict."""
    answers = cycle([*Beyond, *[Beyond.YES] * length])
    result = []
    for kind in Kind:
        agreements = cycle([*kind.answers, *[Agreement.CLOSE, Agreement.AGREES] * (kind in papers.OF_PAPERS)])
        for claim in (c for paper in papers.all_papers().values() for c in paper.claims if c.kind is kind):
            if not claim.scope.untestable:
                evidence = Evidence(value=Estimate(1.0, 0.5, 1.5))
                result.append(Verdict(claim, next(agreements), "made up", evidence, next(answers)))
    return result


def on_the_page(folder: Path, data: str, found: list[Verdict]) -> dict[str, Count]:
    """Return the numbers of verdicts on the report page and in its picture of verdicts, by paper."""
    results = folder / data / "full"
    figures = sorted({verdict.claim.figure for verdict in found})
    for figure in figures:
        plant(results / figure, scale="full")
    write_claims(results / "claims.csv", found)
    page = write_page(results, figures).read_text(encoding="utf-8")
    read = read_published(results, figures)
    counted = {}
    for key in OF_PAPERS:
        [section] = re.findall(rf'<section id="{key}".*?</section>', page, re.DOTALL)
        [(agree, judged)] = re.findall(r">(\d+) of (\d+)</span> agree", section)
        bars = first_screen._counts(read.claims_of(paper=key))
        assert sum(number for bar, number in bars.items() if "agrees" in bar) == int(agree)
        counted[key] = (int(agree), int(judged), bars.get("agrees, beyond its baseline", 0))
    return counted


def in_the_terminal(found: list[Verdict]) -> dict[str, Count]:
    """Return the numbers of verdicts that ``make claims`` prints, by paper."""
    lines = "\n".join(counts(found))
    message = re.findall(r"^(\w+): (\d+) of (\d+) agree \((\d+) beyond the baseline\)", lines, re.MULTILINE)
    return {key: (int(agree), int(judged), int(beyond)) for key, agree, judged, beyond in message}


def in_the_tables(rows: dict[tuple[str, str], float]) -> dict[str, dict[str, Count]]:
    """Return the numbers of verdicts in the tables of README and documentation, by data set and paper."""
    columns = {
        "data": [d for d, _ in rows],
        "name": [n for _, n in rows],
        "value": [*map(float, rows.values())],
    }
    head, _, *lines = published.rendered({"counts": LAYOUT["counts"]}, columns)["counts"].splitlines()
    places = head.split("|")
    result: dict[str, dict[str, Count]] = {data: {} for data in DATA}
    for line in lines:
        cells = [cell.strip() for cell in line.split("|")]
        if (key := cells[1].strip("`")) in OF_PAPERS:
            for position, cell in enumerate(cells):
                if message := re.fullmatch(r"(\d+) of (\d+) \((\d+)\)", cell):
                    [data] = [data for data in DATA if f"`{data}`" in places[position]]
                    agree, judged, beyond = map(int, message.groups())
                    result[data][key] = (agree, judged, beyond)
    return result


def in_the_article(rows: dict[tuple[str, str], float]) -> dict[str, dict[str, Count]]:
    """Return the numbers of verdicts in the article, by data set and paper."""
    people = {words: data for data, words in article.PEOPLE.items()}
    keys = {words: key for key, words in article.PAPERS.items()}
    text = article.filled(article.verdict_rows(), rows, "")
    result: dict[str, dict[str, Count]] = {data: {} for data in DATA}
    pattern = r"\[([^\]]+)\], \[(\w+)\], \[(\d+) of (\d+) \((\d+)\)\]"
    for paper, words, *numbers in re.findall(pattern, text):
        agree, judged, beyond = map(int, numbers)
        result[people[words]][keys[paper]] = (agree, judged, beyond)
    return result


def test_every_place_counts_alike(tmp_path: Path) -> None:
    output = {data: verdicts(length) for data, length in DATA.items()}
    rows = {
        (data, name): value
        for data, result in output.items()
        for _, name, value, _ in published.verdict_counts(result, LAYOUT)
    }
    terminal = {data: in_the_terminal(result) for data, result in output.items()}
    assert all(set(owner) == set(OF_PAPERS) for owner in terminal.values())
    assert terminal["optical"] != terminal["synthetic"]
    assert in_the_tables(rows) == terminal
    assert in_the_article(rows) == terminal
    for data, result in output.items():
        assert on_the_page(tmp_path, data, result) == terminal[data]


def test_targets_are_in_no_count_of_a_paper_and_in_a_group_of_their_own() -> None:
    result = verdicts(3)
    without = [verdict for verdict in result if verdict.claim.kind is not Kind.TARGET]
    assert len(without) < len(result)
    assert in_the_terminal(result) == in_the_terminal(without)
    assert published.verdict_counts(result, LAYOUT) == published.verdict_counts(without, LAYOUT)
    ours = [line for line in counts(result) if "(our targets)" in line]
    assert len(ours) == sum(not paper.figures for paper in papers.all_papers().values())


@pytest.mark.parametrize("data", DATA)
def test_the_ledger_that_is_kept_has_the_published_counts(data: str) -> None:
    """The claims in each light archive have the published numbers of verdicts.

    `make archive LIGHT=1 DATA=…` renews an archive.
    """
    rows = tables.read_rows(ROOT / "results" / "archive" / "light" / data / "claims.csv")
    if "short" not in rows[0]:
        pytest.skip("the archive is of before claims had short names")
    listed = tables.read_rows(ROOT / "results" / "published.csv")
    numbers = {row["name"]: float(row["value"]) for row in listed if row["data"] == data}
    for key in OF_PAPERS:
        tally = papers.count((row for row in rows if row["paper"] == key), papers.OF_PAPERS)
        assert numbers[f"{key}, results and sentences, judged"] == tally.judged
        for agreement in papers.JUDGED:
            assert numbers[f"{key}, results and sentences, {agreement}"] == tally.number(agreement)


def test_the_headline_carries_its_sensitivity_wherever_it_stands() -> None:
    """MAP's gain on synthetic people is always quoted with its values for half and none of their static offsets."""
    listed = tables.read_rows(ROOT / "results" / "published.csv")
    name, data = "zhang2007_map_thirty_percent", "synthetic"
    owner = {row["name"]: f"{float(row['value']):.0f}" for row in listed if row["data"] == data}
    gain, half, none = (
        owner[f"{name}{end}"] for end in ("", *(f", offsets of people {x}" for x in ("half", "none")))
    )
    cell = f"{gain} % ({half} % with half, {none} % with none of the assumed static offsets of people)"
    for document in ("README.md", "docs/results.md"):
        assert cell in (ROOT / document).read_text(encoding="utf-8"), document
    template = (ROOT / "docs" / "article" / "article.typ").read_text(encoding="utf-8")
    quoted = [m.end() for m in re.finditer(rf"{{{{{data}:{name}:", template)]
    assert len(quoted) == 3
    for end in quoted:
        assert {"half", "none"} <= set(
            re.findall(rf"{name}, offsets of people (\w+)", template[end : end + 500])
        )
    runs = [run.filled(name, 38.0) for run in papers.claim(name).sensitivity[data]]
    assert [re.findall(r"(\d+) \[", words) for words in runs] == [[half], [none]]


def test_the_words_for_the_curve_of_the_readme_are_those_of_its_table() -> None:
    path = ROOT / "results" / "archive" / "light" / "optical" / "zhang2007_fig5" / "table.csv.gz"
    rows = list(csv.DictReader(gzip.decompress(path.read_bytes()).decode("utf-8").splitlines()))
    errors_mm = {
        method: [float(row["rms_error_mm"]) for row in rows if row["method"] == method]
        for method in ("map", "least_squares", "average_walker")
    }
    low, high = min(errors_mm["map"]), max(errors_mm["map"])
    words = (
        f"{low:.0f} to {high:.0f} mm with a prior, up to {max(errors_mm['least_squares']):.0f} mm by least squares and"
        f" {max(errors_mm['average_walker']):.0f} mm for the average walker"
    )
    assert words in (ROOT / "README.md").read_text(encoding="utf-8")
