"""The players compute what the tables hold: in numpy from the packed walkers, and in a browser where there is one."""

from __future__ import annotations

import base64
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.compose import compose
from pipeline.cli.figures import make_figure
from pipeline.core import errors, fourier, linear_model
from pipeline.core.articulation import ray_sphere
from pipeline.core.camera_paths import around
from pipeline.core.limb_chain import WALKER14
from pipeline.core.reconstruction import from_known_views
from pipeline.report import players
from pipeline.report.document import write_page
from pipeline.report.published import read_published
from pipeline.skeleton import WALKER15
from pipeline.storage.store import Store
from tests.report.planted import plant
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.study.sweeps.held_out import NORMAL_95, PHASES

FIGURES = ["zhang2007_fig4", "zhang2007_fig5", "zhang2007_joint_angles"]
ALL_METHODS = "sweep.methods=[least_squares,map,anatomical]"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Figures 4, 5 and joint angles of zhang2007 at smoke scale, by every method, and two clips for park2011."""
    results = tmp_path_factory.mktemp("results")
    place = results / "synthetic" / "smoke"
    store = Store(results)
    for name in FIGURES:
        experiment = compose(
            [f"experiment={name}", "scale=smoke", f"results={results}", "figure.recording=false", ALL_METHODS]
        )
        make_figure(experiment, place / name, store=store)
    plant(
        place / "park2011_fig4",
        arrays={
            name if name == "clip_name" else f"as_chosen.{name}": values for name, values in clips().items()
        },
    )
    return place


def clips() -> dict[str, np.ndarray]:
    """Two clips of twenty frames before one camera, reconstructed without error."""
    generator = np.random.default_rng(1)
    truth = 300.0 * generator.standard_normal((2, 20, 15, 3)) + np.array([0.0, 0.0, 1000.0])
    camera = around(20, target=np.array([0.0, 0.0, 1000.0]), sweep_rad=1.0)
    images = np.stack([camera.project(clip) for clip in truth])
    return {
        "cameras": np.array(["moving"]),
        "stretch": np.array([0, 1]),
        "clip_name": np.array(["walking_001", "bending_001"]),
        "truth": truth,
        "positions": truth[:, None],
        "images": images[:, None],
        "camera_matrix": np.broadcast_to(camera.matrix, (2, 1, 20, 3, 4)),
        "mirror_margin": np.full((2, 1, 14), 3.0),
    }


def decoded(text: str, dtype: str) -> np.ndarray:
    """The numbers in a base64 text."""
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
    packed = players.quantised(values)
    offset, scale = (decoded(packed[name], "<f4").astype(float) for name in ("offset", "scale"))
    again = offset + scale * decoded(packed["integers"], "<i2").reshape(values.shape)
    assert np.abs(again - values).max() <= 900.0 / 32767 * 0.51


def test_clips_keep_their_cameras_and_say_how_sure_they_are(folder: Path) -> None:
    figure = read_published(folder, ["park2011_fig4"]).figures["park2011_fig4"]
    packed, reason = players.clips(figure)
    assert reason == ""
    assert [clip["name"] for clip in packed["clips"]] == ["walking_001", "bending_001"]
    seen = packed["clips"][0]["seen"][0]
    assert seen["confidence"] == ["decided"] * 14
    arrays = clips()
    matrix = decoded(seen["matrix"], "<f4").reshape(20, 3, 4)
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


def test_the_browser_computes_the_tables(folder: Path, browser: str, tmp_path: Path) -> None:
    page = write_page(folder, [*FIGURES, "park2011_fig4"])
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
    assert dom.count("<option") > 12  # the players are filled
    assert "3.00 times as much" in dom


def shown(browser: str, address: str, profile: Path) -> str:
    """The page as text after two minutes of the browser's own time."""
    command = [
        browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}", "--dump-dom",
        "--virtual-time-budget=120000", address,
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=600).stdout


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
    said = dict(re.findall(r'data-(\w+)="([^"]*)"', re.findall(r"<body[^>]*>", dom)[0]))
    assert said["ours"].startswith("Its own 95 % bars reach ±")
    assert said["papers"] == ""  # absent if the player did not come back


def test_a_link_into_the_page_draws_what_stands_above_it(folder: Path, browser: str, tmp_path: Path) -> None:
    dom = shown(browser, f"{write_page(folder, FIGURES, to=tmp_path).as_uri()}#about", tmp_path)
    assert dom.count("data-spec=") == dom.count('data-done="yes"') > 1


def bars_of_the_middle_walker(folder: Path) -> tuple[float, float]:
    """Mean half width of the anatomical method's 95 % bars from 30 degrees, mm, and the share that they cover."""
    figure = read_published(folder, FIGURES).figures["zhang2007_fig5"]
    walkers = figure.arrays["samples"].reshape(-1, 5, 15, 3)
    middle = len(walkers) // 2
    kept = figure.arrays["person"] != figure.arrays["person"][middle]
    weights = anatomical.person_weights(figure.arrays["person"][kept])
    prior = anatomical.fit(walkers[kept], weights, anatomical.Shrinkage())
    view = np.radians([30.0])
    given = anatomical.condition(prior, view, noise=anatomical.Noise())
    axes = anatomical.image_axes(view)
    whole = np.einsum("aij,kjb->akib", axes, anatomical.by_joint(walkers[middle])).reshape(1, 1, -1)
    found = anatomical.fit_lengths(
        given, whole[..., ~given.unknown], anatomical.tolerances(prior), with_covariance=True
    )
    half = NORMAL_95 * anatomical.deviation_at_instants(found.covariance[0, 0], 5, PHASES)
    off = (whole[..., given.unknown] - found.unknown)[0, 0].reshape(15, 5)
    return float(half.mean()), float((np.abs(anatomical.at_instants(off, PHASES)) <= half).mean())


@pytest.mark.thorough
def test_ones_own_walk_is_read_as_the_library_reads_it(folder: Path, browser: str, tmp_path: Path) -> None:
    # A walk at phase zero, walked obliquely and dropped as a file: its representation comes back.
    figure = read_published(folder, FIGURES).figures["zhang2007_fig5"]
    wanted, times = figure.arrays["samples"][0].reshape(5, 15, 3), np.arange(150) / 60.0
    motion = fourier.synthesise(wanted, 0.93, times)
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
      try { Yours.read("a,b\\n1,2\\n"); } catch (error) { document.body.dataset.complaint = error.message; }
    });</script></body>"""
    page = write_page(folder, FIGURES, to=tmp_path)
    text = re.sub(r"<meta http-equiv[^>]*>", "", page.read_text(encoding="utf-8"))
    csv = "\n".join(["frame,time_s,joint,x_mm,y_mm,z_mm", *rows])
    content = f'<script type="text/csv" id="csv">{csv}</script>{script}'
    page.write_text(text.replace("</body>", content), encoding="utf-8")
    dom = shown(browser, page.as_uri(), tmp_path)
    said = dict(re.findall(r'data-(\w+)="([^"]*)"', re.findall(r"<body[^>]*>", dom)[0]))
    assert float(said["hz"]) == pytest.approx(0.93, abs=2e-3)
    found = np.array(said["samples"].split(), dtype=float).reshape(5, 15, 3)
    given = fourier.represent(fourier.synthesise(wanted, 0.93, times), 60.0, frequency_hz=0.93).coefficients
    shifted = given - np.eye(5, 1)[:, :, None] * given[0, 8]  # about the pelvis
    assert np.abs(found - shifted).max() < 12.0
    assert said["complaint"].startswith("the file has no columns time_s, joint, x_mm")
