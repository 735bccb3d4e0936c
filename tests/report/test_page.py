"""Tests of the report page: it shows all results, loads nothing from elsewhere, and has no broken links."""

from __future__ import annotations

import base64
import gzip
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline import papers, plugins
from pipeline.chart_json import from_json, to_json
from pipeline.charts import Axis, Chart, Lines, Reference, Sheet, lines_of
from pipeline.palette import Style
from pipeline.pictures.embedding import packed_vector, reduced
from pipeline.report import templates, verdicts
from pipeline.report.document import MAX_BYTES, PAGE, write_page
from pipeline.report.page_charts import _band_words, charts_of
from pipeline.report.published import read_published
from pipeline.storage.sealed_folders import read_manifest, write_manifest
from pipeline.storage.tables import read, write
from pipeline.studies.captions import PUBLISHED
from tests.rejects import rejects
from tests.report.planted import CLAIM, VIEW_CHARTS, plant, view_errors

FIGURES = ["zhang2007_fig5", "zhang2007_fig6", "mozerov2006_fig1", "park2011_fig4"]
GOLDEN = Path(__file__).resolve().parents[1] / "golden"


class Elements(HTMLParser):
    """Parser that collects the elements of a page with their attributes, and the text outside of scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str]]] = []
        self.texts: list[str] = []
        self.inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.inside = tag
        self.found.append((tag, {name: value or "" for name, value in attrs}))

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""

    def handle_data(self, data: str) -> None:
        if self.inside not in ("script", "style"):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())

    def values(self, attribute: str) -> list[str]:
        return [attributes[attribute] for _, attributes in self.found if attribute in attributes]


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Results folder with two figures, one of them with a claim."""
    folder = tmp_path / "synthetic" / "smoke"
    plant(folder / "zhang2007_fig5", claims=CLAIM)
    plant(folder / "mozerov2006_fig1", table={"sample": [0, 1], "note": ['a "b", c', "</script>"]})
    return folder


def page_of(folder: Path) -> tuple[str, Elements]:
    """Write the report page, and return its source text and its parsed elements."""
    path = write_page(folder, FIGURES)
    text = path.read_text(encoding="utf-8")
    assert path.stat().st_size < MAX_BYTES
    return text, Elements(text)


def test_every_figure_is_there_and_those_missing_are_named(results: Path) -> None:
    _, page = page_of(results)
    ids = page.values("id")
    assert set(FIGURES) <= set(ids)
    assert len(ids) == len(set(ids))
    assert "park2011_fig4 : not made yet" in page.text
    assert "2 of 4 figures made" in page.text
    assert "make zhang2007_fig5 SCALE=smoke" in page.text


def test_a_figure_that_was_changed_is_not_shown_as_made(results: Path) -> None:
    (results / "mozerov2006_fig1" / "table.csv").write_text("sample\n1\n")
    _, page = page_of(results)
    assert "unfinished or damaged: table.csv has" in page.text


def test_nothing_is_loaded_and_no_link_is_dead(results: Path) -> None:
    text, page = page_of(results)
    without_names = text.replace("http://www.w3.org/2000/svg", "")  # a name, which is not loaded
    assert re.findall(r"""(?:https?:)?//[\w.]+\.\w+""", re.sub(r"base64,[\w+/=]+", "", without_names)) == []
    assert all(source.startswith("data:") for source in page.values("src"))
    ids = set(page.values("id"))
    for link in page.values("href"):
        assert link[1:] in ids if link.startswith("#") else (results / link).is_file(), link


def test_what_the_files_say_cannot_become_part_of_the_page(results: Path) -> None:
    text, page = page_of(results)
    assert "</script>" not in re.sub(r"<script[^>]*>.*?</script>", "", text, flags=re.DOTALL)
    assert "Errors <against> view" in page.text
    assert 'about <b>30</b>% smaller & "less"' in page.text
    assert ("b", {}) not in page.found


def test_the_page_may_run_its_own_script_and_nothing_else(results: Path) -> None:
    text, page = page_of(results)
    [policy] = [a["content"] for tag, a in page.found if tag == "meta" and "http-equiv" in a]
    style, script = (re.search(rf"<{name}>(.*?)</{name}>", text, re.DOTALL) for name in ("style", "script"))
    assert style is not None
    assert script is not None
    assert policy == templates.policy(style[1], script[1])
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert not page.values("style")
    assert not [name for _, attributes in page.found for name in attributes if name.startswith("on")]


def test_our_numbers_and_verdicts_come_from_the_claims(results: Path) -> None:
    _, page = page_of(results)
    assert "ours is 29 % smaller" in page.text
    assert "(no number here)" in page.text  # of a figure that is not made
    assert "1 of 1 agree" in page.text


def test_kinds_intervals_and_both_answers_are_shown_where_they_are_known(tmp_path: Path) -> None:
    folder = tmp_path / "synthetic" / "smoke"
    finite = {
        "kind": ["result"],
        "value_low": [25.25],
        "value_high": [31.5],
        "one_sample_low": [19.5],
        "one_sample_high": [38.5],
        "paper_in_prediction": ["yes"],
        "baseline": ["the average walker"],
        "baseline_knows": ["nothing of the person"],
        "baseline_value": [12.125],
        "gain_low": [-3.25],
        "gain_high": [-1.5],
        "agreement": ["close"],
        "beyond_baseline": ["worse"],
        "help": ["the true heading"],
        "same_as": ["zhang2007_other"],
    }
    plant(folder / "zhang2007_fig5", claims={**CLAIM, **finite})
    text, page = page_of(folder)
    [packed] = re.findall(r'id="ledger-data">(.*?)</script>', text, re.DOTALL)
    ledger = json.loads(packed)
    [claim] = ledger["claims"]
    name = claim["name"]
    assert f"claim-{name}" in page.values("id")
    assert (claim["help"], claim["same_as"]) == ("the true heading", "zhang2007_other")
    assert (claim["baseline"], claim["baseline_knows"]) == ("the average walker", "nothing of the person")
    numbers = ledger["sets"]["synthetic"][name]
    assert (numbers["verdict"], numbers["beyond"]) == ("close", "worse")
    assert (numbers["ends"], numbers["gain"], numbers["one_sample"]) == (
        [25.25, 31.5],
        [-3.25, -1.5],
        [19.5, 38.5],
    )
    assert (numbers["simple"], numbers["possible"]) == (12.125, "yes")


def test_the_alternative_text_says_what_a_picture_shows(results: Path) -> None:
    _, page = page_of(results)
    pictures = [attributes for tag, attributes in page.found if tag == "img"]
    thumbnails = [attributes for attributes in pictures if attributes.get("class") == "thumbnail"]
    for thumbnail in thumbnails:  # the title is next to it
        assert (thumbnail["alt"], thumbnail["width"], thumbnail["height"]) == ("", "240", "40")
    [picture] = [attributes for attributes in pictures if attributes not in thumbnails]
    assert picture["alt"].startswith("Errors <against> view")
    assert (picture["width"], picture["height"]) == ("1400", "233")


def test_a_figure_is_shown_once(results: Path) -> None:
    # A figure with charts alone has no picture; a figure with more, or without charts, has its picture.
    for charts, more, pictured in ((True, False, 0), (True, True, 1), (False, False, 1)):
        figure = results / "zhang2007_fig5"
        retained = {k: v for k, v in read_manifest(figure).items() if k != "files"}
        finite = [to_json(chart) for chart in VIEW_CHARTS] if charts else []
        write_manifest(figure, {**retained, "charts": finite, "picture_beside_charts": more})
        path = write_page(results, ["zhang2007_fig5"])
        page = Elements(path.read_text(encoding="utf-8"))
        pictures = [a for tag, a in page.found if tag == "img" and a.get("class") != "thumbnail"]
        assert len(pictures) == pictured
        drawn = [json.dumps(json.loads(spec)) for spec in page.values("data-spec")]
        assert len(drawn) == len(set(drawn)) == (2 if charts else 0)


def test_a_vector_picture_is_packed_with_its_size_unless_it_is_large(tmp_path: Path) -> None:
    path = tmp_path / "figure.svg"
    path.write_text('<?xml version="1.0"?><svg xmlns:x="y" width="518.4pt" height="322.4pt"><path/></svg>')
    drawn = packed_vector(path, 1000)
    assert drawn is not None
    assert gzip.decompress(base64.b64decode(drawn["packed"])) == path.read_bytes()
    assert (drawn["width"], drawn["height"]) == (518, 322)
    assert packed_vector(path, 10) is None


def test_controls_are_labelled_and_headings_in_order(results: Path) -> None:
    _, page = page_of(results)
    labels = {attributes.get("for") for tag, attributes in page.found if tag == "label"}
    for tag, attributes in page.found:
        if tag in ("select", "input") and attributes.get("id") != "theme":
            assert attributes["id"] in labels
    levels = [int(tag[1]) for tag, _ in page.found if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_of_tables_the_page_holds_what_is_drawn_and_what_players_compare_with(tmp_path: Path) -> None:
    rows = 3000
    large = {
        "method": ["map"] * rows,
        "view_angle_deg": list(range(rows)),
        "absolute_error_mm2": [n / 3.0 for n in range(rows)],
        "absolute_error_sd_mm2": [1.0] * rows,
        "of_no_curve": [1] * rows,
    }
    folder = tmp_path / "synthetic" / "smoke"
    plant(folder / "zhang2007_fig5", table=large)
    text, page = page_of(folder)
    embedded = re.search(r'id="tables-zhang2007_fig5">(.*?)</script>', text, re.DOTALL)
    assert embedded is not None
    lines = json.loads(embedded[1])["table.csv"].splitlines()
    assert lines[0] == "method,view_angle_deg,absolute_error_mm2"
    assert lines[2] == "map,1,0.333333"
    assert len(lines) == rows + 1
    [spec] = page.values("data-spec")
    assert spec is not None
    [drawn] = json.loads(spec)["series"]
    assert (drawn["key"], drawn["x"][:3], drawn["y"][:3]) == ("map", [0, 1, 2], [0, 0.333333, 0.666667])
    assert (drawn["low"][1], drawn["high"][1]) == (-0.666667, 1.33333)
    assert "of_no_curve" not in text


def test_numbers_over_data_sets_stand_beside_full_results_only(tmp_path: Path, results: Path) -> None:
    plant(tmp_path / "synthetic" / "full" / "zhang2007_fig5", claims=CLAIM, scale="full")
    _, page = page_of(tmp_path / "synthetic" / "full")
    assert "Numbers, by data set" in page.text
    assert "rank correlation of error and η" in page.text
    assert len(page.values("id")) == len(set(page.values("id")))
    # Every data set with the commit of its numbers, which here are not those of the page's figures.
    assert re.search(
        r"synthetic at commit [0-9a-f]{12} \(the figures on this page come from another commit\)", page.text
    )
    assert "Numbers, by data set" not in page_of(results)[1].text


def test_a_picture_is_reduced_to_a_width(results: Path) -> None:
    content, wide, high = reduced(results / "zhang2007_fig5" / "figure.png", 700)
    assert content
    assert (wide, high) == (700, 117)


def test_pictures_shrink_before_a_page_is_too_large(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (900, 1800, 3), dtype=np.uint8)
    figure = results / "zhang2007_fig5"
    Image.fromarray(noise).save(figure / "figure.png")
    retained = {k: v for k, v in read_manifest(figure).items() if k != "files"}
    write_manifest(figure, {**retained, "picture_beside_charts": True})
    whole = write_page(results, FIGURES).stat().st_size
    monkeypatch.setattr("pipeline.report.document.MAX_BYTES", whole - 100_000)
    assert write_page(results, FIGURES).stat().st_size < whole - 100_000


def test_the_same_results_make_the_same_page(results: Path) -> None:
    assert page_of(results)[0] == page_of(results)[0]


def test_a_page_too_large_to_send_is_refused(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.report.document.MAX_BYTES", 1000)
    with rejects("file_too_large", PAGE):
        write_page(results, FIGURES)
    assert not (results / PAGE).exists()


def test_no_results_are_refused(tmp_path: Path) -> None:
    with rejects("nothing_published", "full"):
        write_page(tmp_path / "synthetic" / "full", FIGURES)


def test_every_paper_has_three_sentences_and_a_figure_of_its_own() -> None:
    for paper in papers.all_papers().values():
        assert len(paper.page.sentences) == 3
        assert paper.page.question.endswith("?")
        assert paper.page.figure in (paper.figures or paper.beyond)
        for sentence in paper.page.sentences:
            for name in papers.placeholders(sentence):
                assert papers.claim(name.removeprefix(PUBLISHED)).name in name


def test_a_chart_of_columns_that_are_not_there_is_left_out(results: Path) -> None:
    figure = read_published(results, ["zhang2007_fig5"]).figures["zhang2007_fig5"]
    drawn = charts_of(figure)
    assert [chart["y_label"] for chart in drawn] == ["mean square error (mm²)", "relative error"]
    assert {"missing_variance_mm2"}.isdisjoint(view_errors())
    assert [line["key"] for line in drawn[0]["series"]] == ["least_squares", "map"]
    assert drawn[0]["x_label"] == "view angle (°)"


def test_bands_are_called_what_the_caption_calls_them(results: Path) -> None:
    figure = read_published(results, ["zhang2007_fig5"]).figures["zhang2007_fig5"]
    chart = replace(figure.charts[0], band="")
    table = {**figure.tables_of(chart), "table": {"absolute_error_mm2_low": [1.0]}}
    for caption, words in (
        ("Bands: range of all populations.", "range of all populations"),
        ("", "95 % interval"),
    ):
        assert _band_words(chart, table, caption) == f"bands: {words}"


def test_series_that_are_named_by_numbers_are_found_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    output = {"view_deg": [0.0, 0.0, 30.0, 30.0], "x": [1.0, 2.0, 1.0, 2.0], "error_mm": [1.0, 2.0, 3.0, 4.0]}
    write(path, output)
    styles = {"0.0": Style("0°"), "30.0": Style("30°")}
    chart = Chart(x="x", y="error_mm", by="view_deg", styles=styles)
    for table in (output, read(path)):
        assert {line.key: line.y.tolist() for line in lines_of(chart, {"table": table})} == {
            "0.0": [1.0, 2.0],
            "30.0": [3.0, 4.0],
        }


def test_charts_are_kept_as_they_are_declared() -> None:
    chart = replace(
        VIEW_CHARTS[0],
        abscissa=Axis(words={"b": "last", "a": "first"}),
        also=[Lines(y="mean", table={"x": np.array([1.0, 2.0])}, styles=Style("mean"))],
        references=[
            Reference(x=0.0, y=30.0, label="published", published=True),
            Reference(below="map", percent=30.0),
        ],
        limits=(0.0, 1.0),
    )
    retained = from_json(json.loads(json.dumps(to_json(chart), sort_keys=True)))
    assert list(retained.abscissa.words) == ["b", "a"]
    assert to_json(retained) == to_json(chart)
    assert retained.references == chart.references
    assert retained.styles == chart.styles
    with rejects("other_version", "fig5"):
        from_json({**to_json(chart), "colour_of_the_sky": "blue"}, "fig5")


def test_published_numbers_stand_in_the_ledger_alone() -> None:
    sheet = Sheet(charts=[replace(VIEW_CHARTS[0], references=[Reference(y="some_claim"), Reference(y=1.0)])])
    named, plain = sheet.with_published({"some_claim": 30.0}.__getitem__).charts[0].references
    assert (named.y, named.label, named.published) == (30.0, "published", True)
    assert plain == Reference(y=1.0)


def test_verdicts_are_counted_by_kind_agreement_first_and_a_repeated_number_once() -> None:
    answers = [
        ("condition", "met", "not applicable", ""),
        ("result", "differs", "worse", ""),
        ("result", "untestable", "not applicable", ""),
        ("result", "agrees", "yes", ""),
        ("result", "agrees", "yes", "zhang2007_first"),
        ("result", "agrees", "no", ""),
        ("result", "agrees", "not applicable", ""),
    ]
    names = ("kind", "agreement", "beyond_baseline", "same_as")
    counts = papers.count_by_kind([dict(zip(names, each, strict=True)) for each in answers])
    assert {kind: tally.rows for kind, tally in counts.items()} == {
        "result": [
            ("agrees", 3, [("yes", 1), ("no", 1)]),
            ("differs", 1, [("worse", 1)]),
            ("untestable", 1, []),
        ],
        "condition": [("met", 1, [])],
    }


def test_every_answer_has_a_sign_and_words() -> None:
    assert set(verdicts.AGREEMENTS) == set(papers.Agreement)
    assert {*verdicts.BEYOND, papers.Beyond.NOT_APPLICABLE} == set(papers.Beyond)
    style = templates.style()
    for name, _ in (*verdicts.AGREEMENTS.values(), *verdicts.BEYOND.values()):
        assert f".{name}::before" in style, name


def test_figures_of_our_own_claims_stand_under_them_and_none_stands_twice(tmp_path: Path) -> None:
    """A figure that supports targets of our own work is shown once, under the paper that it belongs to."""
    from pipeline.report import entries

    made_for = {"zhang2007_occlusion": "zhang2007", "zhang2007_structure": "anatomy"}
    for name in made_for:
        plant(tmp_path / name)
    results = read_published(tmp_path, list(made_for))
    for name, paper in made_for.items():
        results.figures[name].manifest["paper"] = paper
    displayed = {name: {"name": name} for name in results.figures}
    owner = {
        key: [
            figure["name"] for figure in entries.paper_entry(papers.paper(key), results, displayed)["figures"]
        ]
        for key in ("zhang2007", "anatomy")
    }
    assert owner == {"zhang2007": ["zhang2007_occlusion"], "anatomy": ["zhang2007_structure"]}


def test_a_plug_in_brings_scripts_and_the_columns_that_they_read(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report page contains the scripts and table columns of a plug-in only if the plug-in is loaded."""
    plain = page_of(results)[0]
    script = tmp_path / "mine.js"
    script.write_text("const Mine = 2007;\n", encoding="utf-8")
    added = plugins.Page(scripts=[script], columns={"mozerov2006_fig1": {"table.csv": ("sample",)}})
    loaded = (*plugins.loaded(), plugins.Loaded("mine", plugins.Plugin(page=added), "mine"))
    monkeypatch.setattr(plugins, "loaded", lambda: loaded)
    text, _ = page_of(results)
    assert (
        text.index("const Players") < text.index("const Mine = 2007;") < text.index("Players.start(tables)")
    )
    assert 'id="tables-mozerov2006_fig1">{"table.csv":"sample\\n0\\n1\\n"}' in text
    assert "Mine" not in plain
    assert "tables-mozerov2006_fig1" not in plain


def test_the_page_of_the_papers_names_no_method_of_ours(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plugins, "loaded", lambda: ())
    text, page = page_of(results)
    assert "anatomical" not in text.lower()
    assert "own-walk" not in text
    assert "zhang2007_joint_angles" not in page.values("id")
