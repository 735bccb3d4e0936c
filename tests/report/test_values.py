"""Tests of numbers, words and links on the report page against small figures with values computed by hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline import papers
from pipeline.chart_json import to_json
from pipeline.charts import Axis, Chart, Lines, Reference
from pipeline.palette import Style
from pipeline.papers.intervals import Interval
from pipeline.report import agreement, entries, ledger_picture, players, templates, variants, verdicts
from pipeline.report.ledger_picture import Abscissa
from pipeline.report.page_charts import charts_of
from pipeline.report.published import Published, PublishedFigure, numbered_rows, read_published
from pipeline.storage import tables
from pipeline.storage.sealed_folders import write_manifest
from tests.report.planted import CLAIM, plant

ROW: dict[str, Any] = {
    "claim": "zhang2007_map_thirty_percent", "paper": "zhang2007", "figure": "zhang2007_fig5", "quote": "about 30 %",
    "kind": "result", "published": 30.0, "value": 28.7792742, "value_low": 22.5, "value_high": 35.0, "unit": "%",
    "agreement": "agrees", "beyond_baseline": "yes", "bounds": "20 to 40", "section": "4.2", "same_as": "",
    "why": "28.8 %, bounds 20 to 40: a reason", "help": "",
}  # fmt: skip


def figure(folder: Path, charts: list[Chart] | None = None, **facts: Any) -> PublishedFigure:
    """Return a published figure with a table of two curves and the given facts in its manifest."""
    folder.mkdir(parents=True)
    tables.write(
        folder / "table.csv", {"x": [0.0, 1.0], "y": [2.0, 3.5], "y_low": [1.0, np.nan], "y_high": [4, 5]}
    )
    manifest = {"figure": folder.name, "charts": [to_json(chart) for chart in charts or []], **facts}
    write_manifest(folder, manifest)
    manifest["files"] = {"table.csv": {"bytes": 1234}}
    return PublishedFigure(folder.name, folder, manifest)


def published(folder: Path, *rows: dict[str, Any], **figures: PublishedFigure) -> Published:
    """Return the results of a data set with the given figures and claims."""
    return Published(folder, "optical", "smoke", figures, {}, list(rows))


# --- published results -------------------------------------------------------------------------------------


def test_a_figure_says_what_its_manifest_states(tmp_path: Path) -> None:
    drawn = figure(
        tmp_path / "a", title="of the manifest", expect="lower", provenance={"commit": "0123456789abcdef"},
        configuration={"title": "of the options", "model": {"kind": {"<type>": "K", "name": "R-1"}, "size": 3}},
    )  # fmt: skip
    assert (drawn.title, drawn.expect, drawn.commit) == ("of the options", "lower", "0123456789ab")
    assert (drawn.option("model", "kind"), drawn.option("model", "size")) == ("R-1", 3)
    assert drawn.option("model", "none") is drawn.option("none", "size") is None
    assert drawn.files == ["manifest.json", "table.csv"]
    bare = figure(tmp_path / "b", title="of the manifest")
    assert (bare.title, bare.expect, bare.commit) == ("of the manifest", "", "unknown")
    assert figure(tmp_path / "c").title == "c"


def test_the_sources_are_those_of_clips_that_were_kept(tmp_path: Path) -> None:
    folder = tmp_path / "synthetic" / "smoke"
    plant(folder / "zhang2007_fig5", claims=CLAIM, inputs={"a.c3d": "0"})
    plant(folder / "mozerov2006_fig1")
    results = read_published(folder, ["zhang2007_fig5", "mozerov2006_fig1", "park2011_fig4"])
    assert (results.data, results.scale) == ("synthetic", "smoke")
    assert results.missing == {"park2011_fig4": "not made yet"}
    assert results.figures["zhang2007_fig5"].sources == ["synthetic"]
    assert results.figures["zhang2007_fig5"].table("none") is None
    assert results.recorded
    assert not read_published(folder, ["mozerov2006_fig1"]).recorded
    assert [row["claim"] for row in results.claims] == CLAIM["claim"]
    assert read_published(folder, ["mozerov2006_fig1"]).claims == []
    bare = figure(tmp_path / "bare")
    assert bare.sources == []


def test_claims_are_chosen_by_figure_or_paper(tmp_path: Path) -> None:
    other = ROW | {"claim": "park2011_x", "paper": "park2011", "figure": "park2011_fig4", "value": None}
    results = published(tmp_path, ROW, other)
    assert results.claims_of(figure="park2011_fig4") == results.claims_of(paper="park2011") == [other]
    assert results.claims_of(paper="none") == []


def test_numbers_of_a_table_are_numbers_and_empty_cells_none(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("name,value,count\nfirst,1.5,3\nsecond,,4\n")
    assert numbered_rows(tmp_path / "a.csv") == [
        {"name": "first", "value": 1.5, "count": 3},
        {"name": "second", "value": None, "count": 4},
    ]


# --- charts of the page --------------------------------------------------------------------------------------


def test_a_chart_has_its_numbers_bands_and_names(tmp_path: Path) -> None:
    lines = Chart(
        x="x", y="y", styles=Style("series", "blue", line="dashed"), title="Title", unit="mm", log_y=True, least=2.5,
        references=[Reference(y=3.0, label="r")], zero=True, limits=(1.0, 9.0),
        also=[Lines(y="y", times=2.0, styles=Style("twice", "orange"))],
    )  # fmt: skip
    names = Chart(x="x", y="y", styles=Style("y"), abscissa=Axis(words={"0": "zero", "1": "one"}))
    first, second = charts_of(figure(tmp_path / "a", [lines, names]))
    series = first["series"][0]
    assert (series["x"], series["y"], series["lo"], series["hi"]) == ([0, 1], [2, 3.5], [1, None], [4, None])
    assert [(s["name"], s["colour"], s["line"]) for s in first["series"]] == [
        ("series", "blue", "dashed"),
        ("twice", "orange", "solid"),
    ]
    assert first["series"][1]["y"] == [4, 7]
    assert (first["y_label"], first["x_label"], first["note"]) == (
        "Title: y (mm)",
        "x",
        "bands: 95 % interval",
    )
    assert (first["log_y"], first["log_x"], first["zero"], first["least"]) == (True, False, True, 2.5)
    assert tuple(first["limits"]) == (1.0, 9.0)
    assert [reference["y"] for reference in first["references"]] == [3.0]
    assert (first["names"], second["names"]) == (None, ["zero", "one"])
    assert (second["series"][0]["name"], second["least"], second["limits"]) == ("", None, [0.85, 4.15])


# --- entries -------------------------------------------------------------------------------------------------


def test_options_of_the_command_that_makes_a_figure() -> None:
    assert entries.options_of("synthetic", "full") == ""
    assert entries.options_of("optical", "full") == " DATA=optical"
    assert entries.options_of("synthetic", "smoke") == " SCALE=smoke"
    assert entries.options_of("cmu", "smoke") == " DATA=cmu SCALE=smoke"


@pytest.mark.parametrize(
    ("authors", "names"),
    [
        ("Z. Zhang", "Zhang"),
        ("Z. Zhang and N. F. Troje", "Zhang & Troje"),
        ("M. Mozerov, I. Rius, X. Roca and J. Gonzàlez", "Mozerov et al."),
    ],
)
def test_surnames_of_authors(authors: str, names: str) -> None:
    assert entries._surnames(authors) == names


def test_the_entry_of_a_figure(tmp_path: Path) -> None:
    drawn = figure(
        tmp_path / "zhang2007_fig5", title="A title", caption="A title. A caption", seed=7, expect="lower",
        charts=[Chart(x="x", y="y", styles=Style("y"))],
        stages={"sweep": {"seconds": 1.25}, "model": {"seconds": 0.5}},
        provenance={"commit": "f" * 40, "dirty": True, "python": "3.11", "system": "Linux", "machine": "x86_64"},
    )  # fmt: skip
    rows = [
        ROW,
        ROW | {"claim": "b", "quote": "other", "published": None},
        ROW | {"claim": "c", "kind": "target"},
    ]
    entry = entries.figure_entry(drawn, published(tmp_path, *rows, zhang2007_fig5=drawn), {}, tmp_path, 100)
    assert entry["provenance"] == ("commit ffffffffffff with changes, seed 7, Python 3.11 on Linux x86_64")
    assert (entry["quotes"], entry["caption"]) == (["about 30 %"], "A caption")
    assert entry["command"] == "make zhang2007_fig5 DATA=optical SCALE=smoke"
    assert entry["files"] == [
        {"name": "manifest.json", "link": "zhang2007_fig5/manifest.json", "size": "manifest"},
        {"name": "table.csv", "link": "zhang2007_fig5/table.csv", "size": "1 kB"},
    ]
    assert entry["sources"] == ["not stated"]
    assert [json.loads(chart)["x_label"] for chart in entry["charts"]] == ["x"]
    assert entry["picture"] is None


def test_sizes_and_links_of_files(tmp_path: Path) -> None:
    drawn = figure(tmp_path / "a")
    drawn.manifest["files"] = {
        "x.csv": {"bytes": 99_999},
        "y.csv": {"bytes": 100_000},
        "z.csv": {"bytes": 2_345_678},
    }
    assert [entries._size(drawn, name) for name in ("x.csv", "y.csv", "z.csv", "manifest.json")] == [
        "100 kB", "0.1 MB", "2.3 MB", "manifest",
    ]  # fmt: skip
    (tmp_path / "a" / "only.csv.gz").touch()
    (tmp_path / "a" / "figure.webp").touch()
    assert [entries._link(tmp_path / "a", name) for name in ("table.csv", "only.csv", "figure.png", "none")] == [
        "a/table.csv", "a/only.csv.gz", "a/figure.webp", "",
    ]  # fmt: skip


def test_words_and_classes_of_verdicts(tmp_path: Path) -> None:
    assert verdicts.answers({"agreement": "agrees"}) == ("agrees", "not applicable")
    assert verdicts.answers({"agreement": "agrees", "beyond_baseline": ""}) == ("agrees", "not applicable")
    assert [verdicts.beyond_tone(v) for v in ("yes", "no", "worse", "unknown", "not applicable", "x")] == [
        "better", "even", "worse", "unsure", "", "",
    ]  # fmt: skip
    assert verdicts.tone("an earlier word") == "none"
    assert verdicts.reason({"bounds": "exactly 15"}) == ""
    differs = ROW | {"agreement": "differs"}
    assert [(tone, name) for tone, name, _ in verdicts.legend(published(tmp_path, differs, ROW))] == [
        ("good", "agrees"),
        ("bad", "differs"),
    ]


# --- the ledger ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("axis", "positions"),
    [
        # Two ends: the middle is at 1, the ends at 0.
        (Abscissa(Interval(10.0, 20.0)), {15.0: 1.0, 10.0: 0.0, 20.0: 0.0, 25.0: -1.0, 30.0: -2.0}),
        # One end: the unit is the largest distance of the other numbers, then that of wider bounds, then the bound.
        (Abscissa(Interval(low=20.0), others=[30.0, 60.0]), {20.0: 0.0, 60.0: 1.0, 0.0: -0.5}),
        (Abscissa(Interval(low=20.0), Interval(low=15.0)), {20.0: 0.0, 25.0: 1.0, 15.0: -1.0}),
        (Abscissa(Interval(high=-4.0)), {-4.0: 0.0, -8.0: 1.0, 0.0: -1.0}),
        (Abscissa(Interval(low=0.0)), {0.0: 0.0, 2.0: 2.0}),
        # One number: the unit is the distance of the baseline.
        (Abscissa(Interval(8.0, 8.0), others=[4.0]), {8.0: 1.0, 4.0: 0.0, 10.0: 0.5}),
    ],
)
def test_a_number_has_its_place_on_the_axis_of_its_claim(
    axis: Abscissa, positions: dict[float, float]
) -> None:
    assert {value: axis.place(value) for value in positions} == pytest.approx(positions)


def test_an_interval_over_the_middle_reaches_the_best_place() -> None:
    axis = Abscissa(Interval(10.0, 20.0))
    assert axis.interval(12.0, 25.0) == pytest.approx((-1.0, 1.0))
    assert axis.interval(16.0, 18.0) == pytest.approx((0.4, 0.8))
    assert Abscissa(Interval(low=20.0)).interval(10.0, 30.0) == pytest.approx((-0.5, 0.5))


def test_places_are_per_cent_of_the_width_with_the_bound_at_45() -> None:
    assert [ledger_picture._at(position) for position in (0.0, 1.0, -1.0, 3.0, -3.0)] == [
        45.0,
        71.5,
        23.5,
        84.8,
        12.8,
    ]


def test_numbers_of_a_claim_with_and_without_an_axis() -> None:
    axes = {ROW["claim"]: Abscissa(Interval(20.0, 40.0))}
    row = ROW | {"baseline_value": 50.0}
    assert ledger_picture._claim_numbers(row, axes) == {
        "value": 28.7793, "verdict": "agrees", "tone": "good", "at": 69.8, "ends": [22.5, 35.0],
        "reach": [55.6, 71.5], "beyond": "yes", "simple": 50.0, "ring": 23.5,
    }  # fmt: skip
    bare = ledger_picture._claim_numbers(row | {"value_low": None, "beyond_baseline": ""}, {})
    assert bare == {"value": 28.7793, "verdict": "agrees", "tone": "good", "simple": 50.0}
    assert ledger_picture._claim_numbers(row | {"value": None}, axes) == {}


def test_names_of_papers() -> None:
    names = {key: ledger_picture.name_of(paper) for key, paper in papers.all_papers().items()}
    assert {name: names[name] for name in ("zhang2004", "mozerov2006", "park2011")} == {
        "zhang2004": "Zhang 2004",
        "mozerov2006": "Mozerov 2006",
        "park2011": "Park 2011",
    }


# --- players and variants ------------------------------------------------------------------------------------


def test_the_errors_of_walkers_are_those_of_the_nearest_view() -> None:
    people = {
        "view_angle_deg": np.array([-30.0, -30.0, 10.0, 10.0, 10.0, 10.0]),
        "method": np.array(["map", "map", "map", "map", "null", "null"]),
        "walker": np.array(["a", "b", "b", "a", "a", "b"]),
        "rms_error_mm": np.array([9.0, 9.0, 2.0, 1.0, 3.0, 4.0]),
    }
    errors_of = players.errors_of_walkers(people, np.array(["a", "b"]), 0.0)
    assert {method: error.tolist() for method, error in errors_of.items()} == {
        "map": [1.0, 2.0],
        "null": [3.0, 4.0],
    }


def test_the_typical_walk_is_near_all_medians_by_the_ratio() -> None:
    # The last walk is 2 from the median, but half of it; the second is 3 from it, which is the smaller ratio.
    assert (
        players.nearest_to_medians(
            {"map": np.array([1.0, 7.0, 4.0, 2.0, 11.0]), "null": np.array([9.0, 5.0, 1.0, 5.0, 5.0])}
        )
        == 1
    )


def test_the_columns_of_a_covariance_that_the_browser_needs() -> None:
    covariance = np.arange(2 * 15 * 9.0).reshape(2, 15, 3, 3)
    np.testing.assert_array_equal(players._horizontal(covariance)[1, 2], 135 + 18 + np.array([0.0, 1.0, 4.0]))


def test_constant_values_are_quantised_exactly() -> None:
    packed = templates.quantised(np.full((3, 2), 7.5))
    assert np.frombuffer(templates.base64.b64decode(packed["scale"]), "<f4").tolist() == [1.0, 1.0]
    assert np.frombuffer(templates.base64.b64decode(packed["offset"]), "<f4").tolist() == [7.5, 7.5]
    assert np.frombuffer(templates.base64.b64decode(packed["integers"]), "<i2").tolist() == [0] * 6


def test_variants_are_in_the_order_of_their_jobs_and_named_by_what_differs(tmp_path: Path) -> None:
    options = {"model": {"components": 20, "divisor": {"<type>": "D", "name": "R"}}, "sweep": {"step": 1}}
    other = {"model": {"components": 5, "divisor": {"<type>": "D", "name": "R-1"}}, "sweep": {"step": 1}}
    for job, configuration in (("10_b", other), ("2_a", options)):
        plant(tmp_path / "run" / job / "zhang2007_fig5", claims=CLAIM, configuration=configuration)
    plant(tmp_path / "run" / "2_a" / "mozerov2006_fig1")
    by_figure = variants.variants_of(tmp_path / "run")
    assert list(by_figure) == ["zhang2007_fig5"]
    assert [variant.options for variant in by_figure["zhang2007_fig5"]] == [
        {"model.components": "20", "model.divisor": "R"},
        {"model.components": "5", "model.divisor": "R-1"},
    ]
    assert [variant.name for variant in by_figure["zhang2007_fig5"]] == [
        "components=20, divisor=R",
        "components=5, divisor=R-1",
    ]
    assert [variant.claims[0]["claim"] for variant in by_figure["zhang2007_fig5"]] == CLAIM["claim"] * 2


def test_packed_json_keeps_letters_and_refuses_what_is_not_json() -> None:
    assert templates.packed_json({"ü": [1, "<"]}) == '{"ü":[1,"\\u003c"]}'
    with pytest.raises(ValueError, match="JSON"):
        templates.packed_json(float("nan"))


@pytest.mark.parametrize(
    ("position", "at"), [(0.0, 45.0), (1.0, 71.5), (-1.0, 23.5), (1e9, 98.0), (-1e9, 2.0)]
)
def test_places_on_the_axis_of_a_claim(position: float, at: float) -> None:
    assert ledger_picture._at(position) == at


def test_numbers_of_other_data_sets_are_those_of_their_rows() -> None:
    others = {"optical": [{"claim": "c", "agreement": "agrees"}]}
    listed = [{"data": "optical", "name": "q", "value": "2.5"}, {"data": "cmu", "name": "q", "value": "7"}]
    [numbers] = agreement.numbers_of_others(others, listed)
    assert (numbers.data, numbers.rows, numbers.quantity("q")) == (
        "optical", {"c": others["optical"][0]}, 2.5,
    )  # fmt: skip
    assert np.isnan(numbers.quantity("other"))
