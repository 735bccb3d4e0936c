"""Tests of the verdicts on claims, which are computed from published tables."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline import papers
from pipeline.papers import Measure
from pipeline.storage import tables
from pipeline.storage.sealed_folders import write_manifest
from pipeline.studies import evaluation
from pipeline.studies.ledger import judge, judge_figure, judge_folder, write_claims
from pipeline.studies.registry import all_measures
from pipeline.studies.replicated import Replicated, replicate
from tests.rejects import rejects

MEASURES = all_measures()

GOLDEN = Path(__file__).parents[1] / "golden"
SPECTRUM = {
    "table": {
        "component": np.arange(1, 32),
        "eigenvalue_mm2": np.ones(31),
        "variance_fraction": np.full(31, 1 / 31),
        "cumulative_fraction": np.concatenate([np.linspace(0.5, 0.955, 30), [1.0]]),
    },
    "table_harmonics": {
        "walker": ["a", "a", "b", "b"],
        "harmonic": [1, 2, 1, 2],
        "variance_fraction": [0.92, 0.06, 0.918, 0.06],
        "residual_fraction": [0.02, 0.02, 0.022, 0.022],
        "frequency_hz": [1.0, 1.0, 0.9, 0.9],
    },
}


def by_name(verdicts: list[papers.Verdict]) -> dict[str, papers.Verdict]:
    return {v.claim.name: v for v in verdicts}


def test_a_figure_is_judged_on_its_own_tables() -> None:
    result = by_name(judge_figure("zhang2007_fig2", SPECTRUM, "optical", measures=MEASURES))
    thirty = result["zhang2007_thirty_components"]
    assert thirty.value == pytest.approx(95.5)
    assert thirty.agreement == "undecided", "no interval is known of two walkers' spectrum"
    assert result["zhang2007_fundamental_share"].value == pytest.approx(91.9)


def test_verdicts_on_some_figures_leave_those_on_others(tmp_path: Path) -> None:
    path = tmp_path / "claims.csv"
    spectrum = judge_figure("zhang2007_fig2", SPECTRUM, "synthetic", measures=MEASURES)
    others = [papers.Verdict(papers.claim("zhang2007_walkers"), papers.Agreement.UNTESTABLE, "no people")]
    write_claims(path, others)
    write_claims(path, spectrum, judged=["zhang2007_fig2"])
    both = path.read_bytes()
    assert len(tables.read_rows(path)) == len(spectrum) + len(others)
    write_claims(path, spectrum, judged=["zhang2007_fig2"])
    assert path.read_bytes() == both
    write_claims(path, [], judged=["zhang2007_fig2"])
    assert {row["figure"] for row in tables.read_rows(path)} == {verdict.claim.figure for verdict in others}
    write_claims(path, spectrum)
    assert len(tables.read_rows(path)) == len(spectrum)


def test_a_folder_is_judged_like_its_figures(tmp_path: Path) -> None:
    folder = tmp_path / "zhang2007_fig2"
    folder.mkdir()
    for name, columns in SPECTRUM.items():
        tables.write(folder / f"{name}.csv", columns)
    write_manifest(folder, {})
    alone = by_name(judge_figure("zhang2007_fig2", SPECTRUM, "optical", measures=MEASURES))
    result = by_name(
        judge_folder(tmp_path, "optical", ["zhang2007_fig2", "zhang2007_fig5"], measures=MEASURES)
    )
    for name, verdict in alone.items():
        assert result[name].agreement == verdict.agreement
    assert result["zhang2007_map_thirty_percent"].agreement == "untestable"

    write_claims(tmp_path / "claims.csv", list(result.values()))
    written = tables.read(tmp_path / "claims.csv")
    row = written["claim"].tolist().index("zhang2007_thirty_components")
    assert written["published"][row] == 95.5
    assert written["agreement"][row] == "undecided"
    assert written["value"][row] == pytest.approx(95.5)
    assert written["class"][row] == "statistic_of_people"
    assert written["beyond_baseline"][row] == "not applicable"
    expected = """claim short paper section kind same_as figure quote published unit measure help agreement value
        value_low value_high bounds close_bounds one_sample_low one_sample_high paper_in_prediction beyond_baseline
        class baseline baseline_knows baseline_value baseline_low baseline_high gain gain_low gain_high why n_people
        written"""
    assert list(written) == expected.split()


def test_a_claim_on_one_figure_reads_the_table_of_another(tmp_path: Path) -> None:
    for name in ("zhang2007_fig3", "zhang2007_fig5"):
        (tmp_path / name).mkdir()
        shutil.copyfile(GOLDEN / f"{name}.csv", tmp_path / name / "table.csv")
        write_manifest(tmp_path / name, {"scale": "smoke"})
    result = by_name(judge_folder(tmp_path, "synthetic", ["zhang2007_fig5"], measures=MEASURES))
    assert result["zhang2007_error_at_seventy"].agreement == "met"


def test_small_figures_are_not_judged_wherever_they_stand(tmp_path: Path) -> None:
    for scale, described in (("smoke", "not judged at smoke scale"), ("full", "undecided")):
        folder = tmp_path / f"2026-11-22_{scale}" / "zhang2007_fig2"
        folder.mkdir(parents=True)
        for name, columns in SPECTRUM.items():
            tables.write(folder / f"{name}.csv", columns)
        write_manifest(folder, {"scale": scale})
        verdicts = by_name(judge_folder(folder.parent, "optical", ["zhang2007_fig2"], measures=MEASURES))
        assert verdicts["zhang2007_thirty_components"].agreement == described


@pytest.mark.parametrize(
    ("measure", "code"),
    [
        (papers.Measure("distinkt", {}), "unknown_measure"),
        (papers.Measure("distinct", {"tabel": "t"}), "wrong_arguments"),
    ],
)
def test_a_slip_in_a_claim_is_named(measure: papers.Measure, code: str) -> None:
    claim = replace(papers.claim("zhang2007_walkers"), measure=measure)
    with rejects(code, "zhang2007_walkers"):
        judge([claim], {}, "synthetic", measures=MEASURES)


@pytest.mark.parametrize("made_as", [{"figure": "zhang2004_fig2"}, {"data": "optical"}])
def test_a_folder_that_holds_another_result_is_not_judged(made_as: dict[str, str], tmp_path: Path) -> None:
    folder = tmp_path / "zhang2007_fig2"
    folder.mkdir()
    for name, columns in SPECTRUM.items():
        tables.write(folder / f"{name}.csv", columns)
    write_manifest(folder, {"figure": "zhang2007_fig2", "data": "synthetic"} | made_as)
    with rejects("other_result", "zhang2007_fig2"):
        judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"], measures=MEASURES)


def test_a_table_that_was_edited_after_publication_is_not_judged(tmp_path: Path) -> None:
    folder = tmp_path / "zhang2007_fig2"
    folder.mkdir()
    for name, columns in SPECTRUM.items():
        tables.write(folder / f"{name}.csv", columns)
    with rejects("no_file", "zhang2007_fig2"):
        judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"], measures=MEASURES)
    write_manifest(folder, {})
    (folder / "table_mine.csv").write_text("not,a table\n1\n")
    assert by_name(judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"], measures=MEASURES)), (
        "a file of the reader's is not ours"
    )
    table = folder / "table_harmonics.csv"
    table.write_text(table.read_text().replace("0.92", "0.99"))
    with rejects("changed", "table_harmonics.csv"):
        judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"], measures=MEASURES)
    table.unlink()
    with rejects("no_file", "table_harmonics.csv"):
        judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"], measures=MEASURES)


def test_timings_are_judged_by_nothing(tmp_path: Path) -> None:
    seconds = {"what": np.array(["pair", "onto_pattern"]), "performances": np.array([2, 40])}
    fast, slow = (seconds | {"seconds": np.full(2, value)} for value in (1e-6, 1e6))
    verdicts = []
    for number, columns in enumerate((fast, slow)):
        output = {"table_timing": columns}
        folder = tmp_path / str(number) / "mozerov2006_fig3"
        folder.mkdir(parents=True)
        tables.write(folder / "table_timing.csv", columns)
        write_manifest(folder, {})
        verdicts.append(judge_figure("mozerov2006_fig3", output, "synthetic", measures=MEASURES))
        verdicts.append(judge_folder(folder.parent, "synthetic", ["mozerov2006_fig3"], measures=MEASURES))
    described = [{name: v.agreement for name, v in by_name(result).items()} for result in verdicts]
    assert described[0] == described[2]
    assert described[1] == described[3]
    assert "agrees" not in {*described[0].values(), *described[1].values()}


# --- intervals and baselines ----------------------------------------------------------------------------------

LS, MAP, NOTHING, ONE = "least_squares", "map", "average_walker", "map_1"


def errors_of(people: int, gains: np.ndarray, nothing: float) -> dict[str, dict[str, np.ndarray]]:
    """Return tables of figure 5 of zhang2007 in which MAP has a given relative gain over least squares."""
    level = np.linspace(80.0, 120.0, people)
    owner = {LS: level, MAP: level * (1 - gains), NOTHING: level * (1 - nothing), ONE: level}
    names = np.array([f"p{n:02d}" for n in range(people)])
    rows = {
        "person": np.tile(names, 4),
        "method": np.repeat(list(owner), people),
        "view_angle_deg": np.zeros(4 * people),
        "absolute_error_mm2": np.concatenate(list(owner.values())),
    }
    table = {
        "method": np.array(list(owner)),
        "view_angle_deg": np.zeros(4),
        "absolute_error_mm2": np.array([errors.mean() for errors in owner.values()]),
    }
    ingest = {"person": names, "verdict": np.full(people, "kept")}
    return {"table": table, "table_people": rows, "table_ingest": ingest}


def thirty_percent(tables: dict[str, dict[str, np.ndarray]], *, smoke: bool = False) -> papers.Verdict:
    name = "zhang2007_map_thirty_percent"
    output = {
        f"zhang2007_fig5/{table}" if table != "table" else "zhang2007_fig5": t for table, t in tables.items()
    }
    (verdict,) = judge([papers.claim(name)], output, "synthetic", smoke=smoke, measures=MEASURES)
    return verdict


def test_a_gain_that_all_people_share_agrees_and_is_beyond_the_average_walker() -> None:
    gains = 0.3 + 0.05 * np.sin(np.arange(20))
    verdict = thirty_percent(errors_of(20, gains, -0.2))
    assert (verdict.agreement, verdict.beyond) == ("agrees", "yes")
    assert verdict.evidence is not None
    value, baseline, gain = verdict.evidence.value, verdict.evidence.baseline, verdict.evidence.gain
    assert baseline is not None
    assert gain is not None
    assert 20 < value.low < value.value < value.high < 40
    assert baseline.value == pytest.approx(-20.0), "the average walker's error is a fifth larger"
    assert gain.value == pytest.approx(value.value - baseline.value)
    assert gain.low <= gain.value <= gain.high
    assert verdict.evidence.people == 20


@pytest.mark.parametrize(("nothing", "expected"), [(-0.2, "yes"), (0.3, "no"), (0.45, "worse")])
def test_another_baseline_changes_nothing_but_what_is_said_of_it(nothing: float, expected: str) -> None:
    gains = 0.3 + 0.05 * np.sin(np.arange(20))
    verdict = thirty_percent(errors_of(20, gains, nothing))
    assert (verdict.agreement, verdict.beyond) == ("agrees", expected)
    assert verdict.evidence is not None
    plain = thirty_percent(errors_of(20, gains, 0.0)).evidence
    assert plain is not None
    assert verdict.evidence.value == plain.value


def test_planted_cases_do_not_agree() -> None:
    gains = 0.3 + 0.05 * np.sin(np.arange(20))
    assert thirty_percent(errors_of(20, gains + 0.1, -0.2)).agreement == "close", "40 is the edge"
    assert thirty_percent(errors_of(9, gains[:9], -0.2)).agreement == "untestable"
    assert thirty_percent(errors_of(20, gains, -0.2), smoke=True).agreement == "not judged at smoke scale"
    assert thirty_percent(errors_of(20, gains + 0.4, -0.2)).agreement == "close"
    assert thirty_percent(errors_of(20, -gains, -0.9)).agreement == "differs"
    first = errors_of(20, gains, -0.2)
    first["table_people"]["person"] = np.full(80, "p00")
    assert thirty_percent(first).agreement == "undecided", "clips are not people"


def test_a_claim_whose_condition_is_not_met_cannot_be_tested() -> None:
    gains = 0.3 + 0.05 * np.sin(np.arange(20))
    tables = errors_of(20, gains, -0.2)
    for difference, described in ((0.0, "agrees"), (0.01, "untestable")):
        anew = {"method": np.array(["map"]), "relative_difference": np.array([difference])}
        verdict = thirty_percent({**tables, "table_recomputed": anew})
        assert verdict.agreement == described
    assert "zhang2007_leave_one_out is not met (expected at most 1e-06, found 0.01)" in verdict.why


def test_an_extreme_near_a_bound_does_not_agree_though_no_person_drawn_again_exceeds_it() -> None:
    name = "zhang2007_no_difference_in_any_demonstration"

    def verdict(worst: float) -> papers.Verdict:
        distance = np.linspace(worst - 9.0, worst, 12)
        table = {
            "person": [f"p{r:02d}" for r in range(12)],
            "rms_between_methods_mm": distance,
            "rms_map_from_average_walker_mm": distance + 40.0,
        }
        output = {"zhang2007_fig4/table_demonstrations": table}
        return judge([papers.claim(name)], output, "synthetic", measures=MEASURES)[0]

    far, near = verdict(12.0), verdict(19.0)
    assert far.agreement == "agrees"
    assert near.agreement == "close", "its interval ends within the wider bounds"
    for first, worst in ((far, 12.0), (near, 19.0)):
        assert first.evidence is not None
        value = first.evidence.value
        assert value.value == worst
        assert value.high - worst == pytest.approx(worst - value.low)


@pytest.mark.parametrize(("people", "expected"), [(12, "close"), (400, "agrees")])
def test_what_nobody_showed_has_the_exact_interval_of_that_many(people: int, expected: str) -> None:
    """A percentage of 0 % of n rows has a Clopper-Pearson interval up to 1 - 0.025^(1/n)."""
    rows = 3 * people
    table = {
        "person": np.repeat([f"p{r:03d}" for r in range(people)], 3),
        "method": ["least_squares"] * rows,
        "failed": np.zeros(rows),
    }
    claim = papers.claim("zhang2004_view_angle_failures")
    (verdict,) = judge([claim], {"zhang2004_fig5/table_people": table}, "synthetic", measures=MEASURES)
    assert verdict.evidence is not None
    value = verdict.evidence.value
    assert (value.value, value.low) == (0.0, 0.0)
    assert (1.0 - value.high / 100.0) ** rows == pytest.approx(0.025)
    assert verdict.agreement == expected


def test_the_interval_of_a_share_ends_at_all() -> None:
    few = ["p1", "p1", "p1", "p1", "p2", "p2", "p3", "p3"]
    table = {"person": few, "method": ["least_squares"] * 8, "failed": [0, 0, 0, 1, 1, 1, 1, 1]}
    claim = papers.claim("zhang2004_view_angle_failures")
    (verdict,) = judge([claim], {"zhang2004_fig5/table_people": table}, "synthetic", measures=MEASURES)
    assert verdict.evidence is not None
    value = verdict.evidence.value
    assert 0.0 <= value.low < value.value == 62.5
    assert value.high == 100.0


def test_the_interval_of_a_baseline_that_is_a_share_ends_at_all_too() -> None:
    """The interval of a percentage ends at 100 %, although Student's interval would end at 110.1 %."""
    people = np.repeat([f"p{n}" for n in range(5)], 36)
    table = {
        "person": people,
        "performance": np.arange(180),
        "rate_sd": np.full(180, 0.3),
        "rate_sd_baseline": np.where((people == "p0") & (np.arange(180) < 10), 0.1, 0.3),
    }
    claim = papers.claim("mozerov2006_rate_rarely_constant")
    (verdict,) = judge([claim], {"mozerov2006_fig1/table_rates": table}, "optical", measures=MEASURES)
    assert verdict.evidence is not None
    baseline = verdict.evidence.baseline
    assert baseline is not None
    assert baseline.value == pytest.approx(100.0 * 170 / 180)
    spread = 100.0 * 10 / 36 * np.sqrt(0.2 * 0.8 / 5)
    assert baseline.value - baseline.low == pytest.approx(2.776 * np.sqrt(5 / 4) * spread, rel=0.05)
    assert baseline.high == 100.0


def test_the_prediction_of_a_share_ends_at_all() -> None:
    """The prediction interval of a percentage ends at 100 %, although its formula gives 96.5 % ± 5.3 %."""
    parts = (0.90, 0.96, 1.0, 1.0)
    each = pd.DataFrame({"population": [1, 2, 3, 4], "variance_fraction": parts})
    table = pd.DataFrame({"variance_fraction": [parts[0]]})
    measure = Measure("mean_percent", {"table": "any/table_shares", "column": "variance_fraction"})
    claim = replace(papers.claim("zhang2007_fundamental_share"), measure=measure)
    (verdict,) = judge(
        [claim],
        {"any/table_shares": table, "any/table_shares_populations": each},
        "synthetic",
        measures=MEASURES,
    )
    assert verdict.evidence is not None
    first = verdict.evidence.one_sample
    assert first is not None
    assert first.value == pytest.approx(96.5)
    assert first.low == pytest.approx(96.5 - 3.182 * np.sqrt(5 / 4) * 100 * np.std(parts, ddof=1), abs=0.01)
    assert first.high == 100.0


@pytest.mark.parametrize(("by", "low"), [("walker", 100.0 * 0.025 ** (1 / 20)), ("view_angle_deg", 100.0)])
def test_a_share_of_walkers_has_it_and_one_of_views_does_not(by: str, low: float) -> None:
    """A percentage of walkers has an interval, because walkers are sampled; a percentage of views has no interval."""
    error = np.concatenate([np.full(20, 5.0), np.full(20, 3.0)])
    table = {
        "person": 2 * [f"p{r:02d}" for r in range(20)],
        "walker": 2 * [f"w{r:02d}" for r in range(20)],
        "view_angle_deg": 2 * list(range(20)),
        "method": ["least_squares"] * 20 + ["map"] * 20,
        "absolute_error_mm2": error,
    }
    measure = Measure("percent_below", {
        "table": "errors", "column": "absolute_error_mm2", "by": by, "of": "map", "than": "least_squares"
    })  # fmt: skip
    claim = replace(papers.claim("zhang2007_map_better_for_most_walkers"), measure=measure)
    (verdict,) = judge([claim], {"errors": table}, "synthetic", measures=MEASURES)
    assert verdict.evidence is not None
    assert verdict.evidence.value.value == 100.0
    assert verdict.evidence.value.low == pytest.approx(low)


def test_populations_take_the_place_of_people() -> None:
    gains = 0.3 + 0.05 * np.sin(np.arange(20))
    tables = errors_of(20, gains, -0.2)
    each = [errors_of(20, gains + shift, -0.2)["table"] for shift in (-0.25, 0.0, 0.1, 0.25)]
    tables["table_populations"] = {
        "population": np.repeat([1, 2, 3, 4], 4),
        **{name: np.concatenate([table[name] for table in each]) for name in each[0]},
    }
    verdict = thirty_percent(tables)
    assert verdict.evidence is not None
    value, first = verdict.evidence.value, verdict.evidence.one_sample
    each_gain = 100.0 * np.array([np.mean(gains) + shift for shift in (-0.25, 0.0, 0.1, 0.25)])
    assert value.value == pytest.approx(each_gain.mean(), abs=0.5), (
        "their mean, not the published population's"
    )
    se = each_gain.std(ddof=1) / 2.0
    assert value.high - value.value == pytest.approx(3.182 * se, rel=0.05), "Student's, of four"
    assert value.value - value.low == pytest.approx(value.high - value.value)
    assert first is not None
    assert first.high - first.value == pytest.approx(3.182 * se * np.sqrt(5.0), rel=0.05), "and of one more"
    assert verdict.paper_in_prediction
    assert verdict.agreement == "undecided"


def test_an_interval_does_not_move_to_hold_its_value() -> None:
    """The value and its interval come from the other populations, even if the published population is an outlier."""
    gains = 0.3 + 0.05 * np.sin(np.arange(20))
    tables = errors_of(20, gains - 0.25, -0.2)
    each = [errors_of(20, gains + shift, -0.2)["table"] for shift in (-0.01, 0.0, 0.01, 0.0)]
    tables["table_populations"] = {
        "population": np.repeat([1, 2, 3, 4], 4),
        **{name: np.concatenate([table[name] for table in each]) for name in each[0]},
    }
    verdict = thirty_percent(tables)
    assert verdict.evidence is not None
    assert verdict.agreement == "agrees"
    assert verdict.evidence.value.value == pytest.approx(30.0, abs=1.5)
    assert verdict.evidence.value.low > 25


def test_every_replicate_is_what_its_rows_give() -> None:
    """The replicates of each measure equal its values on tables whose rows are drawn one replicate after the other."""
    rng = np.random.default_rng(4)
    people = np.repeat([f"p{n}" for n in range(7)], 6)
    table = pd.DataFrame(
        {
            "person": people,
            "walker": people,
            "method": np.tile([LS, LS, LS, MAP, MAP, MAP], 7),
            "view_angle_deg": np.tile([-45.0, 0.0, 45.0], 14),
            "x": rng.lognormal(size=42),
            "error_deg": rng.normal(0, 20, size=42),
        }
    )
    drawn = replicate(["fig"], {"fig": table}, seed=3)
    assert drawn is not None
    rows = drawn.tables["fig"]
    assert isinstance(rows, Replicated)
    target = [
        Measure("mean", {"table": "fig", "column": "x", "where": f"method == '{LS}'"}),
        Measure("median", {"table": "fig", "column": "x"}),
        Measure("largest", {"table": "fig", "column": "x"}),
        Measure("smallest", {"table": "fig", "column": "x"}),
        Measure("variation_percent", {"table": "fig", "column": "x"}),
        Measure("percent", {"table": "fig", "of": "x > 1", "where": f"method == '{MAP}'"}),
        Measure("at_smallest", {"table": "fig", "column": "view_angle_deg", "of": "x"}),
        Measure("mean_in_band", {"table": "fig", "column": "x", "method": LS, "band": "frontal"}),
        Measure("angle_bias_deg", {"table": "fig", "method": LS}),
        Measure("angle_spread_deg", {"table": "fig", "method": LS}),
        Measure("angle_error_median_deg", {"table": "fig", "method": LS}),
    ]
    first, two = target[0], target[5]
    target += [Measure(name, {"of": first, "to": two}) for name in ("ratio", "ratio_percent")] + [
        Measure("percent_less", {"of": first, "than": two}),
        Measure("larger", {"of": (first, two)}),
        Measure("root", {"of": first}),
    ]
    for measure in target:
        fast = evaluation.evaluate(measure, MEASURES, drawn.tables, drawn.size)
        assert np.shape(fast) == (drawn.size,) == (2000 + 7,), "and each person left out"
        for b in (0, 1, 2, 2000, 2006):
            slow = evaluation.evaluate(measure, MEASURES, {"fig": rows.drawn(b)})
            assert np.asarray(fast)[b] == pytest.approx(slow, rel=1e-9, nan_ok=True), measure.name
    counted = Measure("distinct", {"table": "fig", "columns": ("walker",)})
    assert evaluation.evaluate(counted, MEASURES, drawn.tables, drawn.size) == 7, "a count of what was done"


def test_a_measure_that_knows_no_replicates_is_computed_one_after_the_other() -> None:
    table = pd.DataFrame({"person": ["a", "b", "c"], "sample": [0, 1, 2], "rate_to_rate": [0.0, 2.0, 1.0]})
    drawn = replicate(["fig"], {"fig": table})
    assert drawn is not None
    broken = Measure("broken_time_constraints", {"table": "fig"})
    result = np.asarray(evaluation.evaluate(broken, MEASURES, drawn.tables, drawn.size))
    assert result.shape == (2003,)
    rows = drawn.tables["fig"]
    assert isinstance(rows, Replicated)
    assert result[7] == pytest.approx(evaluation.evaluate(broken, MEASURES, {"fig": rows.drawn(7)}))


def test_people_drawn_again_already_are_the_replicates() -> None:
    space = {"components": [4.0]}
    draws = {"draw": np.arange(1, 6), "components": [3.0, 4.0, 5.0, 4.0, 3.0]}
    frames = {"fig/table_space": pd.DataFrame(space), "fig/table_space_draws": pd.DataFrame(draws)}
    drawn = replicate(["fig/table_space"], frames)
    assert drawn is not None
    result = evaluation.evaluate(
        Measure("mean", {"table": "fig/table_space", "column": "components"}), MEASURES, drawn.tables, 5
    )
    assert np.asarray(result).tolist() == [3.0, 4.0, 5.0, 4.0, 3.0]
