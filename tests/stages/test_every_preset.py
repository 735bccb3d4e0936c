"""Tests of every preset at smoke scale: files, columns, manifest, picture and recording equal the golden ones."""

from __future__ import annotations

import functools
import getpass
import json
import platform
import struct
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.chart_json import from_json
from pipeline.charts import lines_of
from pipeline.cli.compose import compose
from pipeline.cli.presets import presets
from pipeline.clips import performances, varied, walks
from pipeline.skeleton import WALKER15
from pipeline.storage import tables
from pipeline.storage.agreement import TIMING
from pipeline.storage.sealed_folders import complaints_about
from tests import golden_digits
from tests.contents import GOLDEN, columns_of, contents, golden
from tests.recordings import reading, viewer

WALKERS, VIEWS = 12, 13
"""Numbers of walkers and of views at smoke scale."""

COMPARES_LABORATORIES = "keypoints_laboratories"
"""Figure that needs two laboratories; synthetic walkers are from one laboratory."""

ABSCISSA = {"zhang2007_fig3": "sigma2_mm2"} | dict.fromkeys(
    ("zhang2004_fig4", "zhang2004_fig5", "zhang2007_fig5", "zhang2007_fig6"), "view_angle_deg"
)


@pytest.fixture(params=presets())
def folder(request: pytest.FixtureRequest, smoke_results: Path) -> Path:
    """Folder of the figure of one preset."""
    return smoke_results / "synthetic" / "smoke" / str(request.param)


def test_the_files_are_those_that_are_golden_and_as_they_were_sealed(folder: Path) -> None:
    target = {f"{table}.csv" for table in columns_of(folder.name)} | {
        "table_ingest.csv", "claims.csv", "arrays.npz", "figure.svg", "figure.png", "recording.rrd", "manifest.json"
    }  # fmt: skip
    if folder.name == COMPARES_LABORATORIES:
        target -= {"figure.svg", "figure.png"}
    assert {path.name for path in folder.iterdir()} == target
    assert complaints_about(folder) == []


def test_tables_and_recording_hold_what_is_golden(folder: Path) -> None:
    """Rows, columns and recorded entities equal the golden ones, which `make golden FIGURE=…` renews."""
    assert contents(folder) == golden(folder.name)


def test_the_values_are_what_their_names_say(folder: Path) -> None:
    for name in columns_of(folder.name):
        table = tables.read(folder / f"{name}.csv")
        for column, values in table.items():
            values = values[~np.isnan(values)] if values.dtype.kind == "f" else values
            if column.endswith(("_mm2", "_sd", "_error", "_fraction", "_hz", "failures")):
                assert (values >= 0).all(), column
            if column.endswith("_fraction"):
                assert (values <= 1 + 1e-9).all(), column
            if column == "view_angle_deg" and folder.name.startswith("zhang"):
                assert set(values) <= set(range(-90, 91, 15))
            if column == "walker":
                assert set(values) <= {f"synthetic_{r:03d}" for r in range(1, WALKERS + 1)}
            if column == "joint":
                assert set(values) <= set(WALKER15.joints)
                assert len(set(values)) >= 14, "all, or all but the root"


def test_the_players_of_the_page_find_what_the_figures_hold(smoke_results: Path) -> None:
    page = (smoke_results / "synthetic" / "smoke" / "index.html").read_text(encoding="utf-8")
    assert "make it again" not in page
    assert "is not made yet" not in page


@functools.cache
def purpose(figure: str) -> str:
    """Return the kind of clips from which a figure is computed."""
    return compose([f"experiment={figure}"]).dataset.corpus.name


def test_every_clip_has_its_row_in_the_ingest_report(folder: Path) -> None:
    report = tables.read(folder / "table_ingest.csv")
    columns, clips = {
        "walks": (walks.REPORT_COLUMNS, [f"synthetic_{r:03d}" for r in range(1, WALKERS + 1)]),
        "performances": (performances.REPORT_COLUMNS, [f"bending_{m:03d}" for m in range(1, 7)]),
        "clips": (varied.REPORT_COLUMNS, ["bending_001", "smooth_angles_001", "walking_001"]),
    }[purpose(folder.name)]
    assert tuple(report) == columns
    assert sorted(report["clip"]) == clips
    assert set(report["verdict"]) == {"kept"}
    if "fundamental_share" in report:
        np.testing.assert_array_less(0.9, report["fundamental_share"] + report["second_share"])


def test_the_arrays_hold_every_walker_and_joint(folder: Path) -> None:
    with np.load(folder / "arrays.npz", allow_pickle=False) as arrays:
        owner = purpose(folder.name)
        names = {"walks": "walker", "performances": "performance", "clips": "clip_name"}[owner]
        first = {"walks": "synthetic_001", "performances": "bending_001", "clips": "walking_001"}[owner]
        assert arrays[names][0] == first
        assert owner != "walks" or len(arrays[names]) == WALKERS
        assert owner != "performances" or arrays["synchronized"].shape[0] == len(arrays[names]) == 6
        if "joint_error_mm2" in arrays:
            error, walkers = arrays["joint_error_mm2"], tables.read(folder / "table_walkers.csv")
            assert error.shape == (WALKERS, len(arrays["joint_error_methods"]), 15)
            np.testing.assert_allclose(error.mean(axis=2).ravel(), walkers["absolute_error_mm2"])
            assert walkers["method"][: error.shape[1]].tolist() == arrays["joint_error_methods"].tolist()
        else:
            assert folder.name not in ("zhang2004_fig4", "zhang2007_fig5")


def test_every_interval_holds_its_value(folder: Path) -> None:
    for path in folder.glob("table*.csv"):
        columns = tables.read(path)
        for name in [name.removesuffix("_low") for name in columns if name.endswith("_low")]:
            if name in columns and columns[name].dtype.kind == "f":
                value, low, high = columns[name], columns[f"{name}_low"], columns[f"{name}_high"]
                finite = np.isfinite(value + low + high)
                slack = 1e-9 * np.abs(value[finite])
                assert (low[finite] - slack <= value[finite]).all(), (path.name, name)
                assert (value[finite] <= high[finite] + slack).all(), (path.name, name)


def test_the_manifest_says_with_what_it_was_made(folder: Path, smoke_results: Path) -> None:
    text = (folder / "manifest.json").read_text(encoding="utf-8")
    manifest: dict[str, Any] = json.loads(text)
    assert manifest["figure"] == folder.name
    assert (manifest["data"], manifest["scale"], manifest["seed"]) == ("synthetic", "smoke", 2007)
    assert manifest["configuration"]["scale"]["walkers"] == WALKERS
    assert set(manifest["stages"]) == {"ingest", "dataset", "model", "sweep"}
    for stage in manifest["stages"].values():
        assert len(stage["key"]) == 16
        assert set(stage) == {"key", "content"}  # no seconds, so that two runs have equal manifests
    provenance = manifest["provenance"]
    assert provenance["python"] == platform.python_version()
    assert provenance["packages"]["numpy"] == np.__version__
    assert provenance["threads"]["OPENBLAS_NUM_THREADS"] == "1"
    assert len(provenance["lock_sha256"]) == 64
    assert provenance["commit"] == "unknown" or len(provenance["commit"]) == 40
    assert manifest["inputs"] == {}, "an embedded population has no files"


def test_nothing_that_is_published_names_the_machine(folder: Path, smoke_results: Path) -> None:
    strange = [str(smoke_results), str(Path.home()), str(Path(__file__).resolve().parents[2])]
    if len(platform.node()) > 3:
        strange.append(platform.node())
    if len(getpass.getuser()) > 4:  # "root" is a word too
        strange.append(getpass.getuser())
    for path in folder.iterdir():
        content = path.read_bytes()
        assert [word for word in strange if word.encode() in content and len(word) > 1] == [], path.name


def test_the_picture_is_there_as_vectors_and_as_points(folder: Path) -> None:
    if folder.name == COMPARES_LABORATORIES:
        return
    png = (folder / "figure.png").read_bytes()
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", png[16:24])
    assert min(width, height) >= 300  # a few rows of bars are not high
    svg = ElementTree.parse(folder / "figure.svg").getroot()
    assert svg.tag.endswith("svg")
    assert len(list(svg.iter())) > 50


def test_the_recording_is_whole_and_says_what_it_is(folder: Path) -> None:
    path = folder / "recording.rrd"
    viewer.verify(path)
    text = reading.read_column(path, "about", "TextDocument:text")[1]
    words = str(text.ravel()[0])
    assert folder.name in words
    assert "smoke" in words
    expect = json.loads((folder / "manifest.json").read_text("utf-8"))["expect"]
    assert expect in words
    assert "{" not in expect, "its numbers and colours are filled in"
    assert reading.views(path), "the layout opens on something"


def test_the_recordings_curves_are_the_tables(folder: Path) -> None:
    """Curves in the recording equal the columns of the first table, if both have the same abscissa."""
    timeline, path = ABSCISSA.get(folder.name), folder / "recording.rrd"
    if timeline is None:
        return
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    charts = [from_json(plain) for plain in manifest["charts"]]
    finite = {"table": pd.DataFrame(tables.read(folder / "table.csv"))}
    entities = set(reading.entities(path))
    compared = 0
    for chart in charts:
        if chart.table != "table" or chart.x != timeline:
            continue
        for line in lines_of(chart, finite):
            entity = f"curves/{'log10_' if chart.log_y else ''}{chart.quantity}/{line.key}"
            assert entity in entities
            component = "Measurements:values" if line.band is not None else "Scalars:scalars"
            at, values = reading.read_column(path, entity, component, timeline)
            np.testing.assert_array_equal(at, line.x)
            np.testing.assert_allclose(values.ravel(), np.log10(line.y) if chart.log_y else line.y, rtol=1e-6)
            compared += 1
    assert compared


def test_the_smoke_table_is_the_golden_one(folder: Path) -> None:
    """The table equals the golden table; changed numbers need `make golden` and a line under "Scientific changes"."""
    relative = golden_digits.read_tolerances().get((folder.name, "table"), golden_digits.LEAST)
    assert tables.compare(GOLDEN / f"{folder.name}.csv", folder / "table.csv", relative=relative) == []


@pytest.mark.parametrize("suffix", ["csv", "txt"])
def test_there_is_a_golden_file_for_each_preset_and_no_other(suffix: str) -> None:
    assert {path.stem for path in GOLDEN.glob(f"*.{suffix}")} - {"digits"} == set(presets())


def test_the_digits_that_hold_are_stated_for_tables_that_there_are() -> None:
    for figure, table in golden_digits.read_tolerances():
        assert table in {*columns_of(figure), "table_ingest"}, (figure, table)
        assert table != TIMING


def test_the_claims_are_judged_where_the_figures_are(say: Callable, smoke_results: Path) -> None:
    message = say("claims", "scale=smoke", f"results={smoke_results}")
    assert message.status == 0
    assert "variance of two harmonics" in message.out
    assert len(tables.read(smoke_results / "synthetic" / "smoke" / "claims.csv")["claim"]) > 0
