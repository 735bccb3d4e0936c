"""Tests of the figures of mozerov2006 at smoke scale: columns of the tables, and relations between numbers.

Smoke scale has six performances by five people; recorded ones take part where they are.
"""

from __future__ import annotations

import json
import os
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.cli.compose import compose, reason_without_clips
from pipeline.cli.figures import make_figure
from pipeline.cli.summary import Outcome
from pipeline.clips.options import SyntheticPerformances
from pipeline.clips.performances import synthetic_performances
from pipeline.core.synchronization import allowed_disparities
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.storage import tables
from pipeline.storage.store import Store
from pipeline.studies.actions.figures import other_paths
from pipeline.validation import InvalidInput
from tests.contents import columns_of
from tests.rejects import rejects

FIGURES = tuple(f"mozerov2006_{name}" for name in ("fig1", "fig2", "fig3", "warp_error"))
STAGES = ["raw", "linear", "keyframe", "synchronized"]
Columns = dict[str, np.ndarray]


def read(folder: Path, name: str, table: str = "table") -> Columns:
    """Return one table of one figure as columns by name."""
    return tables.read(folder / name / f"{table}.csv")


def of(columns: Columns, name: str, **labels: str) -> np.ndarray:
    """Return the entries of a column in the rows where other columns have the given labels."""
    start = np.ones(len(columns[name]), dtype=bool)
    for column, label in labels.items():
        start &= columns[column] == label
    return columns[name][start]


@pytest.fixture
def store(smoke_results: Path) -> Store:
    """Cache with the stage results of all figures at smoke scale."""
    return Store(smoke_results)


def make(store: Store, name: str, *overrides: str) -> Outcome:
    """Make one figure at smoke scale, and return its outcome."""
    inputs = [f"experiment={name}", "scale=smoke", f"results={store.results}", *overrides]
    config = compose(inputs)
    return make_figure(config, store.results / config.data.name / name, store=store)


@pytest.fixture
def made(smoke_results: Path) -> Path:
    """Folder of the smoke-scale figures of synthetic performances, with pictures and recordings."""
    return smoke_results / "synthetic" / "smoke"


@pytest.mark.parametrize("name", FIGURES)
def test_a_second_run_computes_nothing(made: Path, store: Store, name: str) -> None:
    quick = ("figure.picture=false", "figure.recording=false")
    config = compose([f"experiment={name}", "scale=smoke", f"results={store.results}", *quick])
    again = make_figure(config, store.results / "again" / name, store=Store(store.results))
    assert again.reused == ("ingest", "dataset", "model", "sweep")
    for table in columns_of(name):
        first = (made / name / f"{table}.csv").read_bytes()
        assert (again.folder / f"{table}.csv").read_bytes() == first


# --- figure 1 ---------------------------------------------------------------------------------------------


def test_raw_performances_have_their_own_lengths_and_the_others_common_ends(made: Path) -> None:
    columns, rates = read(made, FIGURES[0]), read(made, FIGURES[0], "table_rates")
    ends: dict[str, set[float]] = {}
    starts: dict[str, list[float]] = {}
    for stage in STAGES:
        for name, duration in zip(rates["performance"], rates["duration_s"], strict=True):
            time = of(columns, "time_s", stage=stage, performance=name)
            assert time[0] == 0
            assert (np.diff(time) > 0).all()
            ends.setdefault(stage, set()).add(float(time[-1]))
            starts.setdefault(stage, []).extend(
                of(columns, "value", stage=stage, performance=name)[[0, -1]].tolist()
            )
            if stage == "raw":
                assert time[-1] == pytest.approx(duration)
    assert len(ends["raw"]) > 1
    for stage in STAGES[1:]:
        np.testing.assert_allclose(list(ends[stage]), rates["duration_s"].mean(), rtol=1e-9)
        np.testing.assert_allclose(starts[stage], starts["raw"], atol=1e-9)  # both ends are kept


def test_rates_are_those_that_the_steps_allow(made: Path) -> None:
    rates = read(made, FIGURES[0], "table_rates")
    assert set(rates["rate_min"]) <= {0, 1}
    assert set(rates["rate_max"]) <= {1, 2}
    still = rates["disparity_max_abs"] == 0
    assert 1 <= still.sum() < len(still), "the median sequence at least, and not all"
    assert (rates["rate_sd"][still] == 0).all()
    assert (rates["at_rate_limit_fraction"][~still] > 0).all()
    assert (rates["at_rate_limit_longest"] <= rates["at_rate_limit_fraction"] * 99 + 1e-9).all()
    assert (rates["distance"] <= rates["distance_linear"] * (1 + 1e-9)).all()


# --- figure 2 ---------------------------------------------------------------------------------------------


def test_the_path_lies_inside_the_trellis_and_is_fixed_at_both_ends(made: Path) -> None:
    nodes, path = read(made, FIGURES[1]), read(made, FIGURES[1], "table_path")
    samples = len(path["sample"])
    assert path["disparity"][0] == path["disparity"][-1] == 0
    assert (np.abs(np.diff(path["disparity"])) <= 1).all()
    on = nodes["on_path"]
    np.testing.assert_array_equal(nodes["sample"][on], path["sample"])
    np.testing.assert_array_equal(nodes["disparity"][on], path["disparity"])
    room = np.minimum(nodes["sample"], samples - 1 - nodes["sample"])
    assert (np.abs(nodes["disparity"]) <= np.minimum(room, 49)).all()
    assert len(nodes["sample"]) == sum(2 * min(p, samples - 1 - p, 49) + 1 for p in range(samples))
    np.testing.assert_array_equal(path["rate_to_rate"], path["sample"] + path["disparity"])


def test_the_distance_is_the_sum_along_the_path_and_the_least(made: Path) -> None:
    nodes, path = read(made, FIGURES[1]), read(made, FIGURES[1], "table_path")
    pair = {name: values[0] for name, values in read(made, FIGURES[1], "table_pair").items()}
    by_hand = nodes["cost"][nodes["on_path"]].sum()
    by_hand += pair["smoothness"] * np.abs(np.diff(path["disparity"])).sum()
    assert pair["distance"] == pytest.approx(by_hand, rel=1e-8)
    assert path["accumulated_cost"][-1] == pytest.approx(by_hand, rel=1e-8)
    assert pair["distance"] < pair["least_other_distance"]
    assert pair["distance"] < pair["distance_linear"]
    assert pair["other_paths"] > 9_000
    distances = read(made, FIGURES[2], "distances")
    assert np.isclose(distances["distance"], pair["distance"], rtol=1e-8).any()


@pytest.mark.parametrize("start", ["fixed", "free"])
@pytest.mark.parametrize("steps", [(-1, 0, 1), (-2, 0), (-3, 0, 1)])
def test_random_paths_are_admissible_and_corner_changes_are_all_there_are(
    start: str, steps: tuple[int, ...]
) -> None:
    nodes = allowed_disparities(8, max_disparity=5, smoothness=0.1, start=start, steps=steps)
    paths = other_paths.random_paths(nodes, 500, np.random.default_rng(1))
    assert (paths[:, -1] == 0).all()
    assert ((paths >= nodes.low) & (paths <= nodes.high)).all()
    assert np.isin(-np.diff(paths, axis=1), steps).all()
    if start == "fixed":
        assert (paths[:, 0] == 0).all()
    drawn = {tuple(path) for path in paths.tolist()}
    near = other_paths.single_corner_changes(nodes, paths[0])
    # Every drawn path that differs by one at one sample must be among them.
    expected = {p for p in drawn if np.abs(np.subtract(p, paths[0])).sum() == 1}
    assert expected <= {tuple(path) for path in near.tolist()}
    assert np.isin(-np.diff(near, axis=1), steps).all()


def test_a_pair_can_be_chosen_but_not_the_median_with_itself(made: Path, store: Store) -> None:
    is_median = read(made, FIGURES[2], "table_performances")["is_median"]
    median = int(np.flatnonzero(is_median)[0])
    other = (median + 1) % len(is_median)
    plain = ("figure.picture=false", "figure.recording=false", "data.name=chosen")
    outcome = make(store, FIGURES[1], f"figure.performance={other}", *plain)
    names = read(made, FIGURES[2], "table_performances")["performance"]
    assert tables.read(outcome.folder / "table_pair.csv")["performance"][0] == names[other]
    unknown = "unknown_performance"
    for wrong, code in ((median, unknown), (len(is_median), unknown), (-2, "out_of_range")):
        with rejects(code, "figure.performance"):
            make(store, FIGURES[1], f"figure.performance={wrong}", *plain)


# --- figure 3 ---------------------------------------------------------------------------------------------


def test_distances_are_asymmetric_with_a_zero_diagonal_and_the_median_has_the_least(made: Path) -> None:
    columns, performances = (read(made, FIGURES[2], t) for t in ("distances", "table_performances"))
    size = len(performances["performance"])
    matrix = np.full((size, size), np.nan)
    matrix[columns["n"], columns["m"]] = columns["distance"]
    assert (np.diag(matrix) == 0).all()
    assert (matrix[~np.eye(size, dtype=bool)] > 0).all()
    assert np.abs(matrix - matrix.T).max() > 1e-6
    np.testing.assert_allclose(matrix.sum(axis=1), performances["global_distance"], rtol=1e-8)
    assert performances["is_median"].sum() == 1
    assert performances["is_median"][performances["global_distance"].argmin()]
    (asymmetry,) = read(made, FIGURES[2], "table_posture")["asymmetry"]
    off = ~np.eye(size, dtype=bool)
    assert asymmetry == pytest.approx(np.abs(matrix - matrix.T)[off].mean() / matrix[off].mean())


def test_synchronization_leaves_less_variance_and_key_frames_differ_from_themselves_by_nothing(
    made: Path,
) -> None:
    stages = read(made, FIGURES[2], "table_stages")
    assert stages["stage"].tolist() == STAGES
    left = dict(zip(STAGES, stages["variance_left"], strict=True))
    assert left["synchronized"] < left["linear"] < left["raw"]
    columns = read(made, FIGURES[2])
    for name in ("rms_from_keyframe", "rms_of_mean_from_keyframe", "warp_from_keyframe_frames"):
        raw, linear, keyframe, synchronized = stages[name]
        assert np.isnan(raw)
        assert keyframe == pytest.approx(0.0, abs=1e-9)
        assert min(linear, synchronized) > 0
    per_sample = np.stack(
        [
            of(columns, "value", stage="synchronized", performance=name).reshape(-1, 100)
            for name in np.unique(columns["performance"])
        ]
    )
    retained = read(made, FIGURES[2], "table_spectrum")["kept"].sum()
    assert per_sample.shape[1] == retained, (
        "all dimensions are drawn, so the variance can be had from the table"
    )
    by_hand = per_sample.var(axis=0, ddof=1).sum(axis=0).mean()
    assert left["synchronized"] == pytest.approx(by_hand, rel=1e-8)


def test_the_model_is_the_mean_and_spread_of_the_synchronized_performances(made: Path) -> None:
    model, columns = read(made, FIGURES[2], "table_model"), read(made, FIGURES[2])
    for component in (1, 2):
        start = (columns["stage"] == "synchronized") & (columns["component"] == component)
        values = columns["value"][start].reshape(-1, 100)
        of_model = model["component"] == component
        np.testing.assert_allclose(model["mean"][of_model], values.mean(axis=0), rtol=1e-7, atol=1e-9)
        free = ~model["floored"][of_model]
        spread = model["standard_deviation"][of_model]
        np.testing.assert_allclose(spread[free], values.std(axis=0, ddof=1)[free], rtol=1e-7)


def test_a_posture_is_what_the_paper_says_and_the_times_are_times(made: Path) -> None:
    posture = {name: values[0] for name, values in read(made, FIGURES[2], "table_posture").items()}
    assert (posture["limbs"], posture["joints"], posture["numbers"]) == (12, 15, 37)
    assert posture["numbers_per_limb"] == 3
    assert posture["limb_norm_error_max"] < 1e-9
    assert 0 < posture["cosine_change_max"] < 1
    timing = read(made, FIGURES[2], "table_timing")
    assert timing["what"].tolist() == ["pair", "onto_pattern", "all_pairs"]
    assert (timing["seconds"] > 0).all()
    assert timing["performances"].tolist() == [2, 6, 6]


def test_two_runs_of_figure_3_differ_in_the_table_of_timings_alone(tmp_path: Path) -> None:
    def run(name: str) -> dict[str, bytes]:
        folder = make(Store(tmp_path / name), FIGURES[2], "figure.recording=false").folder
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    def without_timing(content: bytes) -> dict[str, Any]:
        manifest = json.loads(content)
        del manifest["files"]["table_timing.csv"], manifest["seal"], manifest["stages"]["sweep"]["content"]
        manifest["configuration"].pop("results")
        return manifest

    first, second = run("first"), run("second")
    differ = {name for name in first | second if first.get(name) != second.get(name)}
    assert differ == {"table_timing.csv", "manifest.json"}
    assert without_timing(first["manifest.json"]) == without_timing(second["manifest.json"])


def test_figure_3_without_a_timing_is_refused(store: Store) -> None:
    with rejects("cannot_combine", "sweep", option="NoSweep"):
        make(store, FIGURES[2], "sweep=none")


# --- ours -------------------------------------------------------------------------------------------------


def test_recovered_time_is_nearer_the_truth_than_linear_time(made: Path) -> None:
    columns = read(made, FIGURES[3])
    (linear,) = of(columns, "error_moving_frames", stage="linear")
    change = of(columns, "error_moving_frames", stage="synchronized", penalty="change")
    printed = of(columns, "error_moving_frames", stage="synchronized", penalty="as_printed")
    mu = of(columns, "smoothness", stage="synchronized", penalty="change")
    assert change[mu == 0.02] < linear
    assert change[mu == 0] == printed[mu == 0], "without a penalty there is nothing to read in two ways"
    assert printed[mu == 10] == pytest.approx(linear), "a pull towards no disparity ends there"
    assert (printed[mu >= 0.1] >= change[mu >= 0.1] - 1e-9).all()
    assert np.isnan(columns["smoothness"][columns["stage"] == "linear"]).all()


def test_errors_at_the_models_own_smoothness_are_those_of_the_sweep(made: Path) -> None:
    columns, each = read(made, FIGURES[3]), read(made, FIGURES[3], "table_performances")
    median = read(made, FIGURES[2], "table_performances")["is_median"]
    reference = columns["smoothness"] == 0.02
    for stage in ("linear", "keyframe", "synchronized"):
        errors = of(each, "error_moving_frames", stage=stage)
        assert errors[median] == pytest.approx(0.0, abs=1e-9), "the pattern's time is its own"
        start = (columns["stage"] == stage) & (reference | (stage != "synchronized"))
        start &= columns["penalty"] != "as_printed"
        (mean,) = columns["error_moving_frames"][start]
        assert errors[~median].mean() == pytest.approx(mean, rel=1e-8)


def test_a_free_start_is_tried_beside_the_fixed_one(made: Path) -> None:
    starts, columns = read(made, FIGURES[3], "table_starts"), read(made, FIGURES[3])
    assert set(starts["start"]) == {"fixed", "free"}
    for penalty in ("change", "as_printed"):
        np.testing.assert_array_equal(
            of(starts, "error_frames", start="fixed", penalty=penalty),
            of(columns, "error_frames", stage="synchronized", penalty=penalty),
        )


def test_intervals_of_means_are_over_people_and_hold_the_means(made: Path) -> None:
    for name, table, means in (
        ("mozerov2006_warp_error", "table", ("error_frames", "error_moving_frames")),
        ("mozerov2006_fig3", "table_model", ("mean",)),
    ):
        columns = read(made, name, table)
        for mean in means:
            low, high = columns[f"{mean}_low"], columns[f"{mean}_high"]
            # Of synthetic bends the first samples are all but the same: there, rounding is left.
            assert (low <= columns[mean] + 1e-9).all()
            assert (columns[mean] <= high + 1e-9).all()
            assert (high > low).mean() > 0.9
    tracked, each = (read(made, "mozerov2006_tracking", t) for t in ("table", "table_performances"))
    assert np.isnan(tracked["error_mm_low"]).all() == (len(set(each["person"])) == 1)


# --- recorded ---------------------------------------------------------------------------------------------


RECORDED = pytest.mark.skipif(
    not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR"
)


@RECORDED
def test_recorded_bends_make_every_figure_but_the_one_that_needs_the_truth(store: Store) -> None:
    quick = ("data=hdm05", "figure.picture=false", "figure.recording=false")
    folder = store.results / "hdm05"
    for name in FIGURES:
        if name == "mozerov2006_warp_error":
            config = compose([f"experiment={name}", "data=hdm05"])
            assert "synthetic performances alone" in reason_without_clips(config)
            with rejects("truth_not_known"):
                make(store, name, *quick)
            continue
        make(store, name, *quick)
        for table, columns in columns_of(name).items():
            assert list(read(folder, name, table)) == columns
    stages = read(folder, FIGURES[2], "table_stages")
    assert stages["stage"].tolist() == STAGES
    assert of(stages, "variance_left_to_linear", stage="synchronized") < 1
    pair = read(folder, FIGURES[1], "table_pair")
    assert pair["distance"] <= pair["least_other_distance"]


@pytest.mark.parametrize(
    ("name", "override", "rejection"),
    [
        ("mozerov2006_fig1", "figure.dimension=99", rejects("out_of_range", "figure.dimension", value=99)),
        (
            "mozerov2006_fig1",
            "figure.performances=0",
            rejects("out_of_range", "figure.performances", value=0),
        ),
        ("mozerov2006_fig3", "figure.dimensions=0", rejects("out_of_range", "figure.dimensions", value=0)),
        ("mozerov2006_fig3", "sweep.repeats=0", rejects("out_of_range", "sweep.repeats", value=0)),
        ("mozerov2006_warp_error", "sweep.smoothness=[]", rejects("not_distinct", "sweep.smoothness")),
        (
            "mozerov2006_warp_error",
            "sweep.penalties=[change,change]",
            rejects("not_distinct", "sweep.penalties"),
        ),
    ],
)
def test_options_that_make_no_figure_are_refused(
    store: Store, name: str, override: str, rejection: AbstractContextManager
) -> None:
    with rejection:
        make(store, name, override, "figure.picture=false", "figure.recording=false")


@pytest.mark.parametrize(
    ("override", "rejection"),
    [
        ("model.smoothness=0", rejects("out_of_range", "model.smoothness", value=0.0)),
        ("model.smoothness=-1", rejects("out_of_range", "model.smoothness", value=-1.0)),
        ("model.max_disparity=100", rejects("out_of_range", "model.max_disparity", value=100)),
        ("model.max_disparity=0", rejects("out_of_range", "model.max_disparity", value=0)),
        ("model.samples=30", rejects("out_of_range", "model.max_disparity", value=49)),
        ("model.variance=0", rejects("out_of_range", "model.variance", value=0.0)),
        ("model.dimensions=40", rejects("out_of_range", "model.dimensions", value=40)),
        ("model.key_frames=0", rejects("out_of_range", "model.key_frames", value=0)),
        ("model.steps=[-1,1]", rejects("invalid_steps", "model.steps")),
        (
            "data.performances.limit=1",
            pytest.raises(InvalidInput, match=r"1 of the 1 clips can be used .*3 or more"),
        ),
    ],
)
def test_options_that_cannot_be_are_refused_in_a_sentence(
    store: Store, override: str, rejection: AbstractContextManager
) -> None:
    with rejection:
        make(store, "mozerov2006_fig3", "figure.picture=false", "figure.recording=false", override)


def test_too_few_performances_are_refused_with_the_reasons_of_those_that_are(
    store: Store, tmp_path: Path
) -> None:
    output = synthetic_performances(SyntheticPerformances(performances=3), 3)
    for n in range(2):
        trc.write(tmp_path / f"p{n}_1.trc", WALKER15.joints, output.motion(n)[: 90 * n or 5], 30.0)
    with pytest.raises(
        InvalidInput, match=r"\(expected 3 or more, found p0_1\.trc: the clip is too short [^;]*\)$"
    ):
        make(store, "mozerov2006_fig2", "data=folder", f"data.path={tmp_path}", "skeleton=auto")
