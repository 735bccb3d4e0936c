"""Tests of the command `pointlight` with every source of walks, every output format, and every view."""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from pipeline import formats
from pipeline.cli.main import make_all
from pipeline.cli.walkers import FigureWalkers
from pipeline.formats import fourier_walks
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.storage.tables import read
from pipeline.synthetic import walkers
from tests import made_up_walker
from tests.rejects import rejects
from walk3d import pointlight
from walk3d.export.command import export
from walk3d.pointlight.command import make

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of a person who walks over the ground, without the joint of the head."""
    output = walkers.walking_population(
        np.random.default_rng(3), male=1, female=1, duration_s=4.0, frame_rate_hz=60
    )
    walk = output.positions_mm[0].copy()
    walk[..., 1] += output.people[0].speed * np.arange(len(walk))[:, None] / 60
    path = tmp_path_factory.mktemp("recording") / "anna.trc"
    trc.write(path, WALKER15.joints[1:], walk[:, 1:], 60.0)
    return path


@pytest.fixture(scope="module")
def figure(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the figure zhang2007_fig5 for few people."""
    results = tmp_path_factory.mktemp("results")
    options = ["experiment=zhang2007_fig5", "scale=smoke", f"results={results}", "workers=1"]
    assert make_all([*options, "figure.picture=false", "figure.recording=false"]) == 0
    return next(results.glob("scratch/*/zhang2007_fig5"))


@pytest.mark.parametrize(
    "options",
    [
        ["to=a.svg"],
        ["to=a.csv", "scrambled=true", "seed=4", "cycles=2"],
        ["to=a.gif", "inverted=true", "height_px=120"],
        ["to=a.svg", "noise_dots=20", "noise=uniform", "lifetime_frames=6", "shown=5"],
        ["to=a.svg", "translating=true", "joints=measured"],
        ["to=a.ptd"],
    ],
)
def test_a_display_is_made_the_same_way_twice(
    recording: Path, options: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    digests, words = set(), set()
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        monkeypatch.chdir(tmp_path / folder)
        target, message = make([str(recording), *options])
        digests.add(hashlib.sha256(target.read_bytes()).hexdigest())
        words.add(message)
    assert (len(digests), len(words)) == (1, 1)
    if "to=a.ptd" not in options:
        assert "head" in words.pop()  # an estimated joint is named


def test_a_gif_has_a_picture_for_each_frame(tmp_path: Path) -> None:
    target, words = make(["synthetic", f"to={tmp_path / 'a.gif'}", "height_px=100", "frame_rate_hz=60"])
    with Image.open(target) as picture:
        assert picture.info["duration"] == 20  # hundredths of a second: 60 becomes 50
        assert f"{picture.n_frames} frames at 50 Hz" in words  # type: ignore[attr-defined]
        assert np.asarray(picture.convert("L")).max() > 200


def test_a_recording_translates_at_its_own_speed(recording: Path, tmp_path: Path) -> None:
    options = ["translating=true", "view_angle_deg=90", "cycles=2", "frame_rate_hz=50"]
    target, _ = make([str(recording), f"to={tmp_path / 'a.csv'}", *options])
    table = np.genfromtxt(target, delimiter=",", names=True, dtype=None, encoding="utf-8")
    pelvis = table[table["dot"] == "pelvis"]
    output = walkers.walking_population(
        np.random.default_rng(3), male=1, female=1, duration_s=4.0, frame_rate_hz=60
    )
    slope = np.polyfit(pelvis["time_s"], pelvis["x_mm"], 1)[0]
    assert slope == pytest.approx(output.people[0].speed, rel=0.03)


def test_walkers_of_a_figure_from_any_view(figure: Path, tmp_path: Path) -> None:
    """The model that is trained again for a figure's walker reproduces the reconstructions in the figure."""
    result = FigureWalkers(figure)
    with np.load(figure / "arrays.npz", allow_pickle=False) as arrays:
        names, views = arrays["walker"].tolist(), arrays["demonstration_view_deg"].tolist()
        fixed = arrays["missing"]
        grid = arrays["view_angle_deg"].tolist()
        covariance = arrays["residual_covariance_mm2"]
    stated = pd.DataFrame(read(figure / "table_people.csv")).set_index(["walker", "method", "view_angle_deg"])
    for m, method in enumerate(("least_squares", "map")):
        for r in (0, 5):
            for v, view in enumerate(views):
                again = result._from_view(r, method, view)
                np.testing.assert_allclose(again, fixed[m, r, v], rtol=0, atol=1e-6)
            # From another view: the error that the figure states, computed from the exported motion.
            view = grid[2]
            walk, whole = result.reconstructed(names[r], method, view), result.original(names[r])
            off = walk.coefficients - whole.coefficients
            away = np.array([-np.sin(np.radians(view)), np.cos(np.radians(view)), 0.0])
            power = np.array([1, 0.5, 0.5, 0.5, 0.5]) @ ((off @ away) ** 2)
            beyond = np.einsum("i,jik,k->j", away, covariance[r], away)
            np.testing.assert_allclose(
                (power + beyond).mean(), stated.loc[names[r], method, view].absolute_error_mm2, rtol=1e-6
            )
    target = export([str(figure), "view_angle_deg=47", "motion=reconstructed", f"to={tmp_path / 'a.c3d'}"])
    assert formats.read(target).names[0] == "head_map"
    make([str(figure), "method=map", "from_view_deg=47", "view_angle_deg=90", f"to={tmp_path / 'a.svg'}"])


def test_a_recording_is_exported_as_so_many_cycles(recording: Path, tmp_path: Path) -> None:
    target = export([str(recording), "cycles=4", "frame_rate_hz=120", f"to={tmp_path / 'a.bvh'}"])
    motion = formats.read(target)
    assert motion.frame_rate_hz == pytest.approx(120)
    assert "head_estimated" in motion.names
    few = formats.read(export([str(recording), "frame_rate_hz=20", f"to={tmp_path / 'b.trc'}"]))
    assert (few.frame_rate_hz, len(few.positions_mm)) == (pytest.approx(20, rel=0.01), 80)


@pytest.mark.parametrize(
    ("arguments", "code", "where"),
    [
        ([], "no_source", ""),
        (["synthetic", "to=a.mp4"], "no_films", "to"),
        (["synthetic", "to=a.txt"], "unknown_format", "to"),
        (["RECORDING", "gender=1"], "no_gender", "gender"),
        (["synthetic", "gender=9"], "out_of_range", "gender"),
        (["synthetic", "inverted=maybe"], "unknown_choice", "inverted"),
        (["synthetic", "cycles=1e9"], "out_of_range", "cycles"),
        (["synthetic", "phase_scrambled=true", "cycles=1.5"], "looping_display", ""),
        (["synthetic", "noise_dots=1e7"], "not_a_number", "noise_dots"),
        (["synthetic", "colour=red"], "unknown_option", "colour"),
        (["synthetic", "inverted=true", "to=a.ptd"], "view_alone", "inverted"),
        (["synthetic", "shown=8"], "needs_another", "shown"),
        (["synthetic", "harmonics=1"], "no_effect", "harmonics"),
        (["RECORDING", "walker=ben"], "no_effect", "walker"),
        (["no/such/file.c3d"], "no_file", "no/such/file.c3d"),
    ],
)
def test_what_cannot_be_shown_is_refused(
    recording: Path,
    arguments: list[str],
    code: str,
    where: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    with rejects(code, where):
        make([argument.replace("RECORDING", str(recording)) for argument in arguments])


_PSYCHOPY = """
import sys, types
class Window:
    flips = 0
    def __init__(self, **options): pass
    def flip(self): Window.flips += 1
    def close(self): pass
class Dots:
    def __init__(self, window, **options): self.count = options["nElements"]
    def draw(self): assert len(self.xys) == self.count == 15
made = types.ModuleType("psychopy")
made.visual = types.SimpleNamespace(Window=Window, ElementArrayStim=Dots)
made.event = types.SimpleNamespace(getKeys=lambda: Window.flips >= 80)
made.core = types.SimpleNamespace(Clock=lambda: types.SimpleNamespace(getTime=lambda: Window.flips / 60))
sys.modules["psychopy"] = made
"""


def test_the_loop_in_the_documentation_runs(tmp_path: Path) -> None:
    """The script in the documentation runs with a replacement for the four parts of PsychoPy that it uses."""
    page = (ROOT / "docs" / "pointlight.md").read_text(encoding="utf-8")
    (loop,) = re.findall(r"```py\n(import csv\n.*?)```", page, re.DOTALL)
    assert len(loop.strip().splitlines()) <= 20
    make(["synthetic", f"to={tmp_path / 'walker.csv'}"])
    subprocess.run([sys.executable, "-c", _PSYCHOPY + loop], cwd=tmp_path, check=True, timeout=60)


def test_a_browser_shows_the_svg(tmp_path: Path) -> None:
    """In a browser, half a cycle after the start, the dots of the SVG are at the positions of the table."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("needs Chromium")
    lights = pointlight.walker(*pointlight.synthetic_walker(), view_angle_rad=1.0, frame_rate_hz=60.0)
    places, (width, height) = pointlight.pixels(lights, 400)
    frame = 33
    page = tmp_path / f"{frame}.html"
    page.write_text(
        f"<style>body{{margin:0}}svg{{display:block}}</style>{pointlight.as_svg(lights)}<script>"
        "const s=document.querySelector('svg');s.pauseAnimations();"
        f"s.setCurrentTime({(frame + 0.5) / 60})</script>",
        encoding="utf-8",
    )
    shot = tmp_path / f"{frame}.png"
    subprocess.run(
        [browser, "--headless", "--no-sandbox", f"--window-size={max(width, 500)},{height}",
         f"--screenshot={shot}", "--virtual-time-budget=500", page.as_uri()],
        check=True, capture_output=True, timeout=120,
    )  # fmt: skip
    with Image.open(shot) as picture:
        observed = np.asarray(picture.convert("L"))[:height, :width] > 128
    rows, columns = np.nonzero(observed)
    off = np.hypot(columns[:, None] + 0.5 - places[frame, :, 0], rows[:, None] + 0.5 - places[frame, :, 1])
    assert off.min(axis=1).max() < 5.0  # nothing is white but dots of radius 4
    assert off.min(axis=0).max() < 1.0  # and every dot is


# --- the second author's average walker -------------------------------------------------------------------


@pytest.fixture
def author(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder whose mirror of recordings contains a made-up average walker, and a table that lists its file."""
    text = "// Copyright … and Nikolaus Troje\n" + made_up_walker.javascript()
    shelf, start = tmp_path / "shelf" / "author", tmp_path / "here"
    shelf.mkdir(parents=True)
    start.mkdir()
    (shelf / "bmwalker.js").write_text(text, "utf-8")
    content = text.encode()
    digest = hashlib.sha256(content).hexdigest()
    table = tmp_path / "sources.csv"
    row = f"author/bmwalker.js,author,{len(content)},{digest},,"
    table.write_text(f"path,source,bytes,sha256,address,origin\n{row}\n", "utf-8")
    monkeypatch.setattr("pipeline.ingestion.author.listing_table", lambda _: table)
    monkeypatch.setenv("MOCAP_MIRROR", str(shelf.parent))
    monkeypatch.chdir(start)
    return start


def test_the_authors_walker_along_its_axes(author: Path) -> None:
    displayed = {}
    for weight in (0, 3):
        options = [f"weight={weight}", "view_angle_deg=90", "to=a.csv", "replace=true"]
        target, words = make(["author", *options])
        assert fourier_walks.SOURCE in words
        assert ("weight +3" in words) == (weight == 3)
        table = np.genfromtxt(target, delimiter=",", names=True, dtype=None, encoding="utf-8")
        displayed[weight] = table[table["dot"] == "head"]["y_mm"].mean()
    mean, axes = made_up_walker.walker()
    head, pelvis = (30 + WALKER15.index(joint) for joint in ("head", "pelvis"))
    for weight, height in displayed.items():
        blocks = mean[0] + weight * axes["weight"][0]
        assert height == pytest.approx(blocks[head] - blocks[pelvis], abs=0.01)


def test_its_gender_is_an_axis_of_its_own_and_recordings_have_none(author: Path, recording: Path) -> None:
    ours, _ = make(["synthetic", "gender=1", "to=a.csv"])
    theirs, words = make(["author", "gender=1", "to=b.csv"])
    assert "gender +1" in words
    assert ours.read_text() != theirs.read_text()
    with rejects("no_effect", "weight"):
        make(["synthetic", "weight=1", "to=c.csv"])
    with rejects("no_gender", "gender"):
        make([str(recording), "gender=1", "to=c.csv"])
    with rejects("out_of_range", "happy", value=7.0):
        make(["author", "happy=7", "to=c.csv"])


def test_pictures_of_it_name_source_and_terms(author: Path) -> None:
    target, _ = make(["author", "to=a.svg"])
    assert "CC BY-NC-SA 4.0" in target.read_text("utf-8")
    target, _ = make(["author", "to=a.gif", "height_px=60"])
    with Image.open(target) as picture:
        assert b"CC BY-NC-SA 4.0" in picture.info["comment"]


def test_an_mm_file_is_written_and_read_again(author: Path) -> None:
    target, words = make(["author", "to=a.mm"])
    mean, _ = made_up_walker.walker()
    rows = np.loadtxt(target)
    assert f"{mean[2, -1] * 0.12:.2f} m/s" in words
    np.testing.assert_allclose(rows[-1, :3], mean[:3, -1], atol=1e-3)
    # Mean, cosine 1, sine 1, cosine 2, sine 2, all x, all y, all z: as in the file, but about the mean pelvis.
    inputs = mean[[0, 2, 1, 4, 3], :45].T
    np.testing.assert_allclose(rows[:45, 1:], inputs[:, 1:], atol=1e-3)
    pelvis = WALKER15.index("pelvis") + np.array([0, 15, 30])
    np.testing.assert_allclose(rows[:45, 0], inputs[:, 0] - np.repeat(inputs[pelvis, 0], 15), atol=1e-3)
    again, _ = make([str(target), "to=b.csv", "cycles=2"])
    first, _ = make(["author", "to=c.csv", "cycles=2"])
    names = ("frame", "dot")
    tables = [
        np.genfromtxt(p, delimiter=",", names=True, dtype=None, encoding="utf-8") for p in (again, first)
    ]
    assert all((tables[0][name] == tables[1][name]).all() for name in names)
    with rejects("two_harmonics", "harmonics"):
        make([str(target), "harmonics=3", "to=d.mm"])
    with rejects("view_alone", "inverted"):
        make(["author", "inverted=true", "to=d.mm"])
