"""Tests that the page's players compute the values in the tables, in numpy and in a browser if there is one."""

from __future__ import annotations

import base64
import html
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline import papers, plugins
from pipeline.cli.compose import compose
from pipeline.cli.figures import make_figure
from pipeline.core import errors, linear_model
from pipeline.core.articulation import ray_sphere
from pipeline.core.limb_chain import WALKER14
from pipeline.core.reconstruction import from_known_views
from pipeline.report import players, templates
from pipeline.report.document import write_page
from pipeline.report.published import read_published
from pipeline.storage.store import Store
from tests.report.planted import limb_clips, plant, shown

FIGURES = ["zhang2007_fig4", "zhang2007_fig5"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results folder with figures 4 and 5 of zhang2007 at smoke scale, and two clips for park2011."""
    results = tmp_path_factory.mktemp("results")
    position = results / "synthetic" / "smoke"
    store = Store(results)
    for name in FIGURES:
        experiment = compose(
            [f"experiment={name}", "scale=smoke", f"results={results}", "figure.recording=false"]
        )
        make_figure(experiment, position / name, store=store)
    plant(
        position / "park2011_fig4",
        arrays={
            name if name == "clip_name" else f"as_chosen.{name}": values
            for name, values in limb_clips().items()
        },
    )
    return position


def decoded(text: str, dtype: str) -> np.ndarray:
    """Return the numbers in a base64 text."""
    return np.frombuffer(base64.b64decode(text), dtype)


def test_the_packed_walkers_give_figure_5_again(folder: Path) -> None:
    figure = read_published(folder, FIGURES).figures["zhang2007_fig5"]
    packed, reason = players.walkers(figure)
    assert reason == ""
    samples = decoded(packed["samples"], "<f4").reshape(len(packed["names"]), 225).astype(float)
    xx, xy, yy = np.moveaxis(
        decoded(packed["residual"], "<f4").reshape(len(samples), 15, 3).astype(float), -1, 0
    )
    views = np.radians(packed["views_deg"])
    s, c = np.sin(views)[:, None], np.cos(views)[:, None]
    table = figure.table("table")
    assert table is not None
    folds = list(linear_model.leave_one_out(samples, packed["components"], groups=np.array(packed["person"])))
    for method, noise in (("least_squares", None), ("map", packed["sigma2_mm2"])):
        mean = np.mean(
            [
                errors.walker_error(
                    errors.absolute_error(
                        from_known_views(fold, samples[r], views, noise_variance=noise).delta,
                        s**2 * xx[r] - 2 * s * c * xy[r] + c**2 * yy[r],
                    )
                )
                for fold, r in folds
            ],
            axis=0,
        )
        np.testing.assert_allclose(mean, table["absolute_error_mm2"][table["method"] == method], rtol=1e-4)


def test_quantised_values_are_within_half_a_step() -> None:
    values = np.random.default_rng(2).uniform(-900.0, 900.0, (50, 7))
    packed = templates.quantised(values)
    offset, scale = (decoded(packed[name], "<f4").astype(float) for name in ("offset", "scale"))
    again = offset + scale * decoded(packed["integers"], "<i2").reshape(values.shape)
    assert np.abs(again - values).max() <= 900.0 / 32767 * 0.51


def test_clips_keep_their_cameras_and_say_how_sure_they_are(folder: Path) -> None:
    figure = read_published(folder, ["park2011_fig4"]).figures["park2011_fig4"]
    packed, reason = players.clips(figure)
    assert reason == ""
    assert [clip["name"] for clip in packed["clips"]] == ["walking_001", "bending_001"]
    observed = packed["clips"][0]["seen"][0]
    assert observed["confidence"] == ["decided"] * 14
    arrays = limb_clips()
    matrix = decoded(observed["matrix"], "<f4").reshape(20, 3, 4)
    np.testing.assert_allclose(matrix, arrays["camera_matrix"][0, 0], rtol=1e-6, atol=1e-6)
    parent, child = WALKER14.ends[3]
    radius = np.linalg.norm(arrays["truth"][0, :, child] - arrays["truth"][0, :, parent], axis=-1)
    hits = ray_sphere(
        matrix[:1].astype(float),
        arrays["images"][0, 0, :1, child],
        arrays["truth"][0, :1, parent],
        float(radius[0]),
    )
    true = arrays["truth"][0, 0, child] - arrays["truth"][0, 0, parent]
    candidates = np.stack([hits.middle + hits.half_chord, hits.middle - hits.half_chord])[:, 0]
    assert np.abs(candidates - true).max(axis=-1).min() < 0.1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["model.divisor=R"], "model.divisor=R-1"),
        (["sweep.truth=fourier"], "sweep.truth=motion"),
        (["model.mirror=true"], "model.mirror=False"),
    ],
)
def test_walkers_of_other_options_are_not_played(tmp_path: Path, options: list[str], words: str) -> None:
    results = tmp_path / "synthetic" / "smoke"
    name = "zhang2007_fig5"
    quick = ["scale=smoke", f"results={tmp_path}", "figure.recording=false", "figure.picture=false"]
    make_figure(compose([f"experiment={name}", *quick, *options]), results / name, store=Store(tmp_path))
    packed, reason = players.walkers(read_published(results, [name]).figures[name])
    assert packed == {}
    assert words in reason


def test_results_without_walkers_say_so(tmp_path: Path) -> None:
    plant(tmp_path / "synthetic" / "smoke" / "zhang2007_fig5")
    figure = read_published(tmp_path / "synthetic" / "smoke", ["zhang2007_fig5"]).figures["zhang2007_fig5"]
    assert players.walkers(figure)[1].startswith("zhang2007_fig5 was made before its walkers were published")
    assert players.walkers(None) == ({}, "zhang2007_fig5 is not made yet")


def test_the_browser_computes_the_tables(
    folder: Path, browser: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The browser computes the values in the tables for the three methods of the papers, without plug-ins."""
    monkeypatch.setattr(plugins, "_installed", lambda: ((), {}))
    page = write_page(folder, [*FIGURES, "park2011_fig4"], to=tmp_path)
    script = """<script>addEventListener("load", () => {
      for (let n = 0; n < 4; n++) document.getElementById("step-next").click();
      document.body.dataset.step = document.getElementById("step-number").textContent;
      document.body.dataset.bars = [...document.querySelectorAll("#means > div:not([hidden]) > span:first-child")]
        .map(at => at.textContent).join(", ");
    });</script></body>"""
    text = re.sub(r"<meta http-equiv[^>]*>", "", page.read_text(encoding="utf-8"))
    page.write_text(text.replace("</body>", script), encoding="utf-8")
    dom = shown(browser, f"{page.as_uri()}#check", tmp_path)
    facts = dict(re.findall(r'data-(\w+)="([^"]*)"', re.findall(r'<output id="agreement"[^>]*>', dom)[0]))
    assert facts["methods"].split() == ["baseline", "least_squares", "map"]
    assert float(facts["worst"]) < 1e-4  # three digits and one more
    assert int(facts["compared"]) == 3 * 13 * 3
    assert float(facts["postures"]) < 0.05  # mm
    assert int(facts["coordinates"]) == 2 * 3 * 5 * 15 * 3
    assert dom.count("<option") > 12  # the players are filled
    assert "3.00 times as much" in dom
    message = dict(re.findall(r'data-(\w+)="([^"]*)"', re.findall(r"<body[^>]*>", dom)[0]))
    assert message == {"step": "5 of 5", "bars": "average walker, least squares, + prior"}


def test_a_link_to_a_figure_opens_and_draws_it_alone(folder: Path, browser: str, tmp_path: Path) -> None:
    page = write_page(folder, FIGURES, to=tmp_path)
    dom = shown(browser, f"{page.as_uri()}#zhang2007_fig4", tmp_path)
    drawn = {name: set(re.findall(rf'data-figure="{name}"[^>]*data-done="(yes)"', dom)) for name in FIGURES}
    assert drawn == {"zhang2007_fig4": {"yes"}, "zhang2007_fig5": set()}
    assert re.findall(r'<details class="figure" id="(\w+)" open', dom) == ["zhang2007_fig4"]


def test_a_link_to_a_claim_opens_its_row_whatever_the_filters_are(
    folder: Path, browser: str, tmp_path: Path
) -> None:
    """A link to a claim opens the claim's row, even if the page's filters hide this row."""
    page = write_page(folder, FIGURES, to=tmp_path)
    hidden = shown(browser, page.as_uri(), tmp_path)
    name = "zhang2007_map_thirty_percent"
    row = rf'<details class="ledger-row" id="claim-{name}"[^>]*>'
    assert 'hidden=""' in re.findall(row, hidden)[0]
    dom = shown(browser, f"{page.as_uri()}#claim-{name}", tmp_path)
    [opened] = re.findall(row, dom)
    assert 'open=""' in opened
    assert "hidden" not in opened
    more = re.findall(rf'{row}.*?<div class="ledger-more">(.*?)</div>', dom, re.DOTALL)[0]
    assert papers.claim(name).text.quote in html.unescape(more)
    assert 'href="#zhang2007_fig5"' in more


def test_clips_have_the_actions_of_the_table(tmp_path: Path) -> None:
    arrays = {
        name if name == "clip_name" else f"as_chosen.{name}": values for name, values in limb_clips().items()
    }
    table = {"table_clips.csv": {"clip": ["bending_001", "walking_001"], "action": ["bend", "walk"]}}
    plant(tmp_path / "synthetic" / "smoke" / "park2011_fig4", arrays=arrays, more=table)
    figure = read_published(tmp_path / "synthetic" / "smoke", ["park2011_fig4"]).figures["park2011_fig4"]
    packed, _ = players.clips(figure)
    assert [clip["action"] for clip in packed["clips"]] == ["walk", "bend"]
