"""Tests of the players on the page of all figures: anatomical method, joint angles, and a user's own walk."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.compose import compose
from pipeline.cli.figures import make_figure
from pipeline.core import fourier
from pipeline.report.document import write_page
from pipeline.report.published import read_published
from pipeline.skeleton import WALKER15
from pipeline.storage.store import Store
from tests.report.planted import shown
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.study.sweeps.held_out import NORMAL_95, PHASES

FIGURES = ["zhang2007_fig4", "zhang2007_fig5", "zhang2007_joint_angles"]
ALL_METHODS = "sweep.methods=[least_squares,map,anatomical]"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of figures 4, 5 and joint angles of zhang2007, with all methods at the smoke scale."""
    results = tmp_path_factory.mktemp("results")
    position = results / "synthetic" / "smoke"
    store = Store(results)
    for name in FIGURES:
        experiment = compose(
            [f"experiment={name}", "scale=smoke", f"results={results}", "figure.recording=false", ALL_METHODS]
        )
        make_figure(experiment, position / name, store=store)
    return position


def test_the_browser_computes_the_tables(folder: Path, browser: str, tmp_path: Path) -> None:
    page = write_page(folder, FIGURES)
    dom = shown(browser, f"{page.as_uri()}#check", tmp_path)
    facts = dict(re.findall(r'data-(\w+)="([^"]*)"', re.findall(r'<output id="agreement"[^>]*>', dom)[0]))
    assert facts["methods"].split() == ["anatomical", "baseline", "least_squares", "map"]
    assert float(facts["worst"]) < 1e-4  # three digits and one more
    assert int(facts["compared"]) == 4 * 13 * 3
    assert float(facts["angles"]) < 1e-4
    assert int(facts["angled"]) == 4 * 4 * 3
    assert float(facts["postures"]) < 0.05  # mm
    assert int(facts["coordinates"]) == 3 * 3 * 5 * 15 * 3
    half, covered = bars_of_the_middle_walker(folder)
    assert float(facts["half"]) == pytest.approx(half, rel=1e-4)
    assert float(facts["covered"]) == pytest.approx(covered, abs=0.01)
    assert "Anatomical is ours" in dom
    assert 'id="own-walk-status"' in dom.partition('<form id="player"')[2]


def test_back_to_the_paper_from_our_method(folder: Path, browser: str, tmp_path: Path) -> None:
    page = write_page(folder, FIGURES, to=tmp_path)
    script = """<script>addEventListener("load", () => {
      const chosen = () => document.querySelector("#numbers .chosen th")?.textContent ?? "";
      const bars = () => document.getElementById("bars").textContent;
      const once = (name, then) => {
        const timer = setInterval(() => { if (chosen().startsWith(name)) { clearInterval(timer); then(); } }, 20);
      };
      once("MAP", () => {
        document.querySelector("input[value=anatomical]").click();
        once("anatomical", () => {
          document.body.dataset.ours = bars();
          document.querySelector("#player [type=reset]").click();
          once("MAP", () => { document.body.dataset.papers = bars(); });
        });
      });
    });</script></body>"""
    # Frames come by the browser's own time: a busy machine draws few.  The policy would let no other script run.
    frames = "<script>requestAnimationFrame = then => setTimeout(() => then(performance.now()), 100)</script>"
    text = re.sub(r"<meta http-equiv[^>]*>", frames, page.read_text(encoding="utf-8"))
    page.write_text(text.replace("</body>", script), encoding="utf-8")
    dom = shown(browser, page.as_uri(), tmp_path)
    message = dict(re.findall(r'data-(\w+)="([^"]*)"', re.findall(r"<body[^>]*>", dom)[0]))
    assert message["ours"].startswith("The method's 95 % bars are ±")
    assert message["papers"] == ""  # absent if the player did not come back


def bars_of_the_middle_walker(folder: Path) -> tuple[float, float]:
    """Return the mean half width, mm, and the coverage of the anatomical method's 95 % error bars at 30 degrees."""
    figure = read_published(folder, FIGURES).figures["zhang2007_fig5"]
    walkers = figure.arrays["samples"].reshape(-1, 5, 15, 3)
    middle = len(walkers) // 2
    retained = figure.arrays["person"] != figure.arrays["person"][middle]
    weights = anatomical.person_weights(figure.arrays["person"][retained])
    prior = anatomical.fit(walkers[retained], weights, anatomical.Shrinkage())
    view = np.radians([30.0])
    inputs = anatomical.condition(prior, view, noise=anatomical.Noise())
    axes = anatomical.image_axes(view)
    whole = np.einsum("aij,kjb->akib", axes, anatomical.by_joint(walkers[middle])).reshape(1, 1, -1)
    result = anatomical.fit_lengths(
        inputs, whole[..., ~inputs.unknown], anatomical.tolerances(prior), with_covariance=True
    )
    half = NORMAL_95 * anatomical.deviation_at_instants(result.covariance[0, 0], 5, PHASES)
    off = (whole[..., inputs.unknown] - result.unknown)[0, 0].reshape(15, 5)
    return float(half.mean()), float((np.abs(anatomical.at_instants(off, PHASES)) <= half).mean())


@pytest.mark.thorough
def test_ones_own_walk_is_read_as_the_library_reads_it(folder: Path, browser: str, tmp_path: Path) -> None:
    # A walk at phase zero, walked obliquely and dropped as a file: its representation comes back.
    figure = read_published(folder, FIGURES).figures["zhang2007_fig5"]
    target, times = figure.arrays["samples"][0].reshape(5, 15, 3), np.arange(150) / 60.0
    motion = fourier.synthesise(target, 0.93, times)
    motion[..., 1] += 1200.0 * times[:, None]
    c, s = np.cos(0.7), np.sin(0.7)
    x, y = c * motion[..., 0] - s * motion[..., 1], s * motion[..., 0] + c * motion[..., 1]
    rows = [
        f"{t},{time:.6f},{name},{x[t, j]:.4f},{y[t, j]:.4f},{motion[t, j, 2]:.4f}"
        for t, time in enumerate(times)
        for j, name in enumerate(WALKER15.joints)
    ]
    script = """<script>addEventListener("load", () => {
      const walk = Yours.represent(Yours.read(document.getElementById("csv").textContent));
      document.body.dataset.hz = walk.hz;
      document.body.dataset.samples = [...walk.samples].map(v => v.toFixed(3)).join(" ");
      const lines = document.getElementById("csv").textContent.split("\\n");
      const short = lines.filter((row, n) => n === 0 || Number(row.split(",")[1]) < 1.25);
      document.body.dataset.short = Yours.represent(Yours.read(short.join("\\n"))).hz;
      try { Yours.read("a,b\\n1,2\\n"); } catch (error) { document.body.dataset.complaint = error.message; }
    });</script></body>"""
    page = write_page(folder, FIGURES, to=tmp_path)
    text = re.sub(r"<meta http-equiv[^>]*>", "", page.read_text(encoding="utf-8"))
    csv = "\n".join(["frame,time_s,joint,x_mm,y_mm,z_mm", *rows])
    content = f'<script type="text/csv" id="csv">{csv}</script>{script}'
    page.write_text(text.replace("</body>", content), encoding="utf-8")
    dom = shown(browser, page.as_uri(), tmp_path)
    message = dict(re.findall(r'data-(\w+)="([^"]*)"', re.findall(r"<body[^>]*>", dom)[0]))
    assert float(message["hz"]) == pytest.approx(0.93, abs=2e-3)
    assert float(message["short"]) == pytest.approx(0.93, abs=5e-3), (
        "a film of 1.2 s has a little more than one stride"
    )
    result = np.array(message["samples"].split(), dtype=float).reshape(5, 15, 3)
    inputs = fourier.represent(fourier.synthesise(target, 0.93, times), 60.0, frequency_hz=0.93).coefficients
    shifted = inputs - np.eye(5, 1)[:, :, None] * inputs[0, 8]  # about the pelvis
    assert np.abs(result - shifted).max() < 12.0
    assert message["complaint"].startswith("the file needs the columns time_s, joint, x_mm")
