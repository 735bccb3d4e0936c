"""Tests of intervals, gains, verdicts, counts and texts, on small example claims with hand-computed results."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from pipeline.papers.claims import Agreement, Baseline, Beyond, Bounds, Claim, ClaimText, Kind, Scope
from pipeline.papers.counts import count, count_by_kind
from pipeline.papers.explanations import Explanation, Run, Support, read_runs
from pipeline.papers.intervals import Estimate, Interval
from pipeline.papers.measure import Measure
from pipeline.papers.verdicts import Evidence, Verdict, gain, judge

TEN = Interval(9.0, 11.0)


def claim(bounds: Interval | None = TEN, close: Interval | None = None, **changes: Any) -> Claim:
    """Return an example claim with a published value of 10 mm."""
    settings: dict[str, Any] = {
        "name": "little2000_claim", "paper": "little2000", "kind": Kind.RESULT, "published": 10.0, "unit": "mm",
        "measure": Measure("mean", {"table": "fig1", "column": "map_mm"}), "scope": Scope(people=0),
        "text": ClaimText(short="little claim", section="1", quote="about 10 mm", how="mean"),
        "bounds": Bounds(agrees=bounds, close=close, reason="near"),
    }  # fmt: skip
    return Claim(**{**settings, **changes})


def verdict(value: Estimate, judged: Claim | None = None, **evidence: Any) -> Verdict:
    """Return the verdict on a value, for a data set without assumptions."""
    return judge(judged or claim(), Evidence(value=value, **evidence), "optical")


# --- intervals -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bounds", "low", "high", "covers", "meets"),
    [
        (TEN, 9.0, 11.0, True, True),
        (TEN, 9.5, 11.5, False, True),
        (TEN, 8.5, 10.0, False, True),
        (TEN, 8.0, 9.0, False, True),
        (TEN, 11.0, 12.0, False, True),
        (TEN, 11.1, 12.0, False, False),
        (TEN, 8.0, 8.9, False, False),
        (Interval(9.0, 11.0, low_open=True), 8.0, 9.0, False, False),
        (Interval(9.0, 11.0, low_open=True), 9.0, 10.0, False, True),
        (Interval(9.0, 11.0, high_open=True), 11.0, 12.0, False, False),
        (Interval(9.0, 11.0, high_open=True), 10.0, 11.0, False, True),
    ],
)
def test_bounds_cover_and_meet_an_interval(
    bounds: Interval, low: float, high: float, covers: bool, meets: bool
) -> None:
    estimate = Estimate(0.5 * (low + high), low, high)
    assert (bounds.covers(estimate), bounds.meets(estimate)) == (covers, meets)


@pytest.mark.parametrize(("value", "side"), [(8.0, 1), (9.0, 1), (10.0, 0), (11.0, -1), (12.0, -1)])
def test_bounds_lie_on_one_side_of_a_value(value: float, side: int) -> None:
    assert TEN.side(value) == side


def test_an_interval_is_known_by_both_ends() -> None:
    assert Estimate(1.0, 0.0, 2.0).known
    assert not Estimate(1.0, 0.0).known
    assert not Estimate(1.0, high=2.0).known
    assert [str(bounds) for bounds in (Interval(1.0, 2.0, low_open=True), Interval(low=1.0), Interval())] == [
        "over 1 and at most 2",
        "at least 1",
        "",
    ]


# --- verdicts ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("low", "high", "agreement"),
    [
        (9.2, 10.8, Agreement.AGREES),
        (8.2, 10.8, Agreement.CLOSE),
        (7.2, 7.8, Agreement.CLOSE),
        (6.2, 7.8, Agreement.UNDECIDED),
        (4.2, 4.8, Agreement.DIFFERS),
        (math.nan, 10.8, Agreement.UNDECIDED),
    ],
)
def test_agreement_follows_from_the_interval(low: float, high: float, agreement: Agreement) -> None:
    judged = claim(close=Interval(7.0, 13.0))
    assert verdict(Estimate(high - 0.1, low, high), judged).agreement is agreement


@pytest.mark.parametrize(
    ("low", "high", "beyond"),
    [
        (0.1, 1.0, Beyond.YES),
        (0.0, 1.0, Beyond.NO),
        (-1.0, 0.0, Beyond.NO),
        (-1.0, -0.1, Beyond.WORSE),
        (math.nan, math.nan, Beyond.UNKNOWN),
    ],
)
def test_the_gain_decides_about_the_baseline(low: float, high: float, beyond: Beyond) -> None:
    inside = Estimate(10.0, 9.5, 10.5)
    result = verdict(inside, baseline=Estimate(20.0, 19.0, 21.0), gain=Estimate(0.5, low, high))
    assert result.beyond is beyond
    assert "baseline 20 [19, 21]" in result.why
    assert verdict(inside, gain=Estimate(0.5, low, high)).beyond is Beyond.NOT_APPLICABLE
    assert result.row == {
        "paper": "little2000", "kind": "result", "agreement": "agrees", "beyond_baseline": str(beyond), "same_as": "",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("bounds", "baseline", "better", "ours", "theirs", "advantage"),
    [
        (Interval(high=11.0), 20.0, 0, 10.0, 20.0, 10.0),
        (Interval(low=9.0), 20.0, 0, 10.0, 20.0, -10.0),
        (TEN, 20.0, 0, 10.0, 20.0, 10.0),
        (TEN, 5.0, 0, 10.0, 5.0, 5.0),
        (TEN, 20.0, 1, 10.0, 20.0, -10.0),
        (TEN, 10.5, 0, 10.2, 10.5, 0.3),
    ],
)
def test_the_better_side_is_that_of_the_bounds(
    bounds: Interval, baseline: float, better: int, ours: float, theirs: float, advantage: float
) -> None:
    judged = claim(bounds, baseline=Baseline(measures="errors", reason="a reason", better=better))
    assert gain(judged, baseline)(ours, theirs) == pytest.approx(advantage)


def test_without_a_published_number_the_middle_of_the_bounds_is_best() -> None:
    assert gain(claim(published=None), 10.5)(10.1, 10.5) == pytest.approx(0.4)


def test_the_papers_number_lies_in_the_prediction_or_not() -> None:
    inside = Estimate(10.0, 9.5, 10.5)
    for low, high, lies in ((9.0, 11.0, True), (10.0, 10.0, True), (10.1, 12.0, False), (8.0, 9.9, False)):
        assert verdict(inside, one_sample=Estimate(10.0, low, high)).paper_in_prediction is lies
    assert verdict(inside, one_sample=Estimate(10.0)).paper_in_prediction is None
    assert verdict(inside).paper_in_prediction is None
    nameless = verdict(inside, claim(published=None), one_sample=Estimate(10.0, 9.0, 11.0))
    assert nameless.paper_in_prediction is None


@pytest.mark.parametrize(("people", "untestable"), [(4, True), (5, False), (None, False)])
def test_fewer_people_than_the_claim_needs_decide_nothing(people: int | None, untestable: bool) -> None:
    result = verdict(Estimate(10.0, 9.5, 10.5), claim(scope=Scope(people=5)), people=people)
    assert (result.agreement is Agreement.UNTESTABLE) == untestable


@pytest.mark.parametrize(("drawn", "untestable"), [(0, False), (1, True), (11, True), (12, False)])
def test_an_interval_over_a_few_people_decides_nothing(drawn: int, untestable: bool) -> None:
    result = verdict(Estimate(10.0, 9.5, 10.5), drawn=drawn)
    assert (result.agreement is Agreement.UNTESTABLE) == untestable


def test_conditions_are_met_or_not_also_in_a_small_run() -> None:
    condition = claim(kind=Kind.CONDITION)
    for value, agreement in ((10.0, Agreement.MET), (12.0, Agreement.NOT_MET)):
        assert judge(condition, Evidence(value=Estimate(value)), "optical", smoke=True).agreement is agreement
    assert judge(claim(), Evidence(value=Estimate(10.0, 9.5, 10.5)), "optical", smoke=True).agreement is (
        Agreement.NOT_JUDGED
    )


# --- baselines, counts and explanations ----------------------------------------------------------------------


def test_a_baseline_is_a_constant_or_the_measure_with_other_words() -> None:
    measure = Measure("mean", {"column": "map_mm", "where": ("map", "sigma")})
    assert Baseline(measures="errors", reason="a reason", value=0.0).of(measure) == 0.0
    assert (
        Baseline(measures="errors", reason="a reason", value=3.0, replace={"map_mm": "mean_mm"}).of(measure)
        == 3.0
    )
    assert Baseline(measures="errors", reason="a reason").of(measure) is None
    assert Baseline(measures="errors", reason="a reason", replace={"other": "word"}).of(measure) is None
    changed = Baseline(measures="errors", reason="a reason", replace={"map_mm": "mean_mm", "map": "null"}).of(
        measure
    )
    assert str(changed) == "mean(column=mean_mm, where=[null, sigma])"
    judged = claim(baseline=Baseline(measures="errors", reason="a reason", replace={"map_mm": "mean_mm"}))
    assert str(judged.of_baseline) == "mean(table=fig1, column=mean_mm)"
    assert judged.tables == ("fig1",)
    assert claim(measure=None, baseline=judged.baseline).of_baseline is None


def test_verdicts_are_counted_once_by_kind_and_answer() -> None:
    rows: list[dict[str, str]] = [
        {"kind": "result", "agreement": "agrees", "beyond_baseline": "yes"},
        {"kind": "result", "agreement": "agrees", "beyond_baseline": ""},
        {"kind": "result", "agreement": "agrees", "beyond_baseline": "yes", "same_as": "another"},
        {"kind": "", "agreement": "differs", "beyond_baseline": "no"},
        {"kind": "target", "agreement": "agrees", "beyond_baseline": "worse"},
        {"kind": "result", "agreement": "an earlier word", "beyond_baseline": "no"},
    ]
    tally = count(rows, [Kind.RESULT])
    assert tally.rows == [("agrees", 2, [("yes", 1)]), ("differs", 1, [("no", 1)])]
    assert tally.judged == 3
    assert tally.number(Agreement.AGREES, Agreement.DIFFERS, beyond=Beyond.NO) == 1
    assert tally.number(Agreement.CLOSE) == 0
    assert {kind: each.judged for kind, each in count_by_kind(rows).items()} == {
        Kind.RESULT: 3,
        Kind.TARGET: 1,
    }


def test_an_explanation_quotes_numbers_and_says_how_it_was_tested() -> None:
    run = Run(
        "optical", "walks", "longer", ("a=1",), "full", {"x": Estimate(2.0)}, {"x": Estimate(3.0, 2.5, 3.5)}
    )
    text = "{value:.0f} is {with:.1f} instead of {without:.1f}, {other:.0f} and {with_other:.0f}"
    words = "7 is 3.0 [2.5, 3.5] instead of 2.0, 42 and (no number)"
    for support, sentence in (
        (Support.UNTESTED, f"not tested: {words}"),
        (Support.SHOWN, words),
        (Support.TESTED, f"{words} (tested: optical, longer: a=1)"),
    ):
        explanation = Explanation(support=support, text=text, run=run)
        assert explanation.in_words("x", 7.0, {"other": 42.0}.__getitem__) == sentence
    assert Explanation(support=Support.SHOWN, text="{other:.0f}").in_words("x", 7.0, None) == "(no number)"


def test_a_table_of_runs_is_read_with_its_intervals(tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    path.write_text(
        "data,group,switch,overrides,scale,name,without,without_low,without_high,with,with_low,with_high\n"
        "optical,walks,longer,a=1 b=2,full,x,2,1,3,4,,\n"
        "optical,walks,longer,a=1 b=2,full,y,,,,0,-1,1\n"
    )
    ((key, run),) = read_runs(path).items()
    assert key == ("optical", "walks", "longer")
    assert (run.overrides, run.scale) == (("a=1", "b=2"), "full")
    assert (run.without["x"], run.with_it["y"]) == (Estimate(2.0, 1.0, 3.0), Estimate(0.0, -1.0, 1.0))
    assert (run.with_it["x"].value, run.with_it["x"].known) == (4.0, False)
    assert math.isnan(run.without["y"].value)
    assert read_runs(tmp_path / "none.csv") == {}
