"""Tests of the page of one walk: small, a single file, and drawn by a browser without an error."""

from __future__ import annotations

import base64
import html
import json
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.report import templates
from tests.rejects import rejects
from tests.walk3d.film.reconstruct.conftest import model
from tests.walk3d.film.reconstruct.walks import ERROR, alphapose, given, in_layout
from tests.walk3d.film.walk.walkers import clip
from walk3d.film.reconstruct.walk_page import MAX_FRAMES, Cycle, Frames, Heading, WalkPage, write_walk_page
from walk3d.film.reconstruct.writing import Output, Reconstruct, run

__all__ = ["model"]


BLUE = (
    "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABQODxIPDRQSEBIXFRQYHjIhHhwcHj0sLiQySUBMS0dARkVQWnNiUFVtVkVGZIhl"
    "bXd7gYKBTmCNl4x9lnN+gXz/2wBDARUXFx4aHjshITt8U0ZTfHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8"
    "fHx8fHx8fHx8fHx8fHz/wAARCAAQABADASIAAhEBAxEB/8QAHwAAAQUBAQEBAQEAAAAAAAAAAAECAwQFBgcICQoL/8QAtRAA"
    "AgEDAwIEAwUFBAQAAAF9AQIDAAQRBRIhMUEGE1FhByJxFDKBkaEII0KxwRVS0fAkM2JyggkKFhcYGRolJicoKSo0NTY3ODk6"
    "Q0RFRkdISUpTVFVWV1hZWmNkZWZnaGlqc3R1dnd4eXqDhIWGh4iJipKTlJWWl5iZmqKjpKWmp6ipqrKztLW2t7i5usLDxMXG"
    "x8jJytLT1NXW19jZ2uHi4+Tl5ufo6erx8vP09fb3+Pn6/8QAHwEAAwEBAQEBAQEBAQAAAAAAAAECAwQFBgcICQoL/8QAtREA"
    "AgECBAQDBAcFBAQAAQJ3AAECAxEEBSExBhJBUQdhcRMiMoEIFEKRobHBCSMzUvAVYnLRChYkNOEl8RcYGRomJygpKjU2Nzg5"
    "OkNERUZHSElKU1RVVldYWVpjZGVmZ2hpanN0dXZ3eHl6goOEhYaHiImKkpOUlZaXmJmaoqOkpaanqKmqsrO0tba3uLm6wsPE"
    "xcbHyMnK0tPU1dbX2Nna4uPk5ebn6Onq8vP09fb3+Pn6/9oADAMBAAIRAxEAPwDl6KKK+wOc/9k="
)
"""JPEG of 16 by 16 blue pixels, in base64."""

NUMBERS = {
    "stride_time": {"unit": "s", "both": {"value": 1.1, "half_width_95": 0.1}, "walkers_95": [0.9, 1.3]},
    "stance": {
        "unit": "%", "left": {"value": 60, "half_width_95": 2}, "right": {"value": 66, "half_width_95": 2},
        "difference": {"value": -6, "half_width_95": 3, "larger_than_its_bar": True}, "walkers_95": [55, 65],
    },
}  # fmt: skip


def page(frames: int) -> WalkPage:
    """Return a page with joints that swing without being a walk."""
    generator = np.random.default_rng(3)
    phase = np.linspace(0.0, 9.0, frames)[:, None, None] + np.arange(15)[:, None]
    positions = 300.0 * np.sin(phase + np.arange(3)) + np.arange(15)[:, None] * 90.0
    pixels = 500.0 + 0.3 * positions[..., :2]
    keypoints = pixels + generator.normal(size=pixels.shape)
    keypoints[3, 4] = np.nan
    return WalkPage(
        title="<b>&amp;", lead="A walk.", source="a.json", view_words="the walker goes towards the camera",
        terms="Walkers are synthetic.", facts=[("Verdict", ["A walk."]), ("Notes", ["One.", "</script>"])],
        files=["walk.c3d"],
        frames=Frames(
            numbers=10 + np.arange(frames), rate_hz=50.0, observed=np.arange(15) != 1,
            keypoints_px=keypoints, reprojection_px=pixels, image_px=np.array([1000.0, 800.0]),
            positions_mm=positions, half_mm=np.full((frames, 15, 3), 20.0),
            cycle_percent=np.linspace(0.0, 300.0, frames)[:, None] % 100.0 + np.zeros(2),
        ),
        cycle=Cycle(
            numbers=NUMBERS, curve_names=["knee", "trunk"],
            curves={
                "angles": 30.0 + 20.0 * np.sin(np.linspace(0, 6, 101)) * np.ones((2, 2, 1)),
                "angles_half": np.full((2, 2, 101), 5.0), "walkers": np.full((2, 101), 20.0),
                "walkers_half": np.full((2, 101), 9.0), "stance": np.array([60.0, 66.0]),
            },
        ),
        heading=Heading(deg=30.0, interval_deg=(25.0, 35.0), alternatives_deg=[-150.0]),
    )  # fmt: skip


def test_the_page_may_run_its_own_script_and_nothing_else(tmp_path: Path) -> None:
    write_walk_page(tmp_path / "walk.html", page(30))
    text = (tmp_path / "walk.html").read_text(encoding="utf-8")
    parts = [re.search(rf"<{name}>(.*?)</{name}>", text, re.DOTALL) for name in ("style", "script")]
    style, script = (part[1] for part in parts if part is not None)
    policy = templates.policy(style, script)
    assert f'<meta http-equiv="Content-Security-Policy" content="{policy}">' in html.unescape(text)
    assert not re.search(r"<[^>]* (style|on\w+)=", text.replace(style, "").replace(script, ""))


def packed(path: Path) -> dict[str, object]:
    """Return the data that the page draws."""
    result = re.search(
        r'<script type="application/json" id="walk">(.*?)</script>', path.read_text(encoding="utf-8")
    )
    assert result
    return dict(json.loads(result[1]))


def test_a_page_is_small_escaped_and_loads_nothing(tmp_path: Path) -> None:
    path = tmp_path / "walk.html"
    write_walk_page(path, page(1500))
    text = path.read_text(encoding="utf-8")
    assert len(text.encode()) < 1_000_000
    assert "&lt;b&gt;&amp;amp;" in text
    assert not re.search(r'(src|href)="(https?:|//)', text)
    drawn = packed(path)
    assert drawn["frames"] == 500 <= MAX_FRAMES  # every third
    assert drawn["frame_numbers"][:3] == [10, 13, 16]  # type: ignore[index]
    assert drawn["rate_hz"] == pytest.approx(50.0 / 3.0)


def test_what_is_drawn_is_what_was_given(tmp_path: Path) -> None:
    path, inputs = tmp_path / "walk.html", page(60)
    write_walk_page(path, inputs)
    drawn = packed(path)
    part = dict(drawn["positions"])  # type: ignore[call-overload]
    offset, scale = (np.frombuffer(base64.b64decode(part[name]), "<f4") for name in ("offset", "scale"))
    integers = np.frombuffer(base64.b64decode(part["integers"]), "<i2").reshape(60, 45)
    np.testing.assert_allclose(
        offset + scale * integers, inputs.frames.positions_mm.reshape(60, 45), atol=0.02
    )
    observed = np.frombuffer(base64.b64decode(str(drawn["seen"])), "u1").reshape(60, 15)
    assert np.argwhere(observed == 0).tolist() == [[3, 4]]


def test_a_film_is_under_the_skeleton_of_its_frames(browser: str, tmp_path: Path) -> None:
    """The page draws the picture of the film under the skeleton, and states the number of frames with a picture."""
    path, inputs = tmp_path / "walk.html", page(60)
    part = (0.25, 0.0, 0.75, 0.5)
    write_walk_page(path, replace(inputs, film=[(10, BLUE), (40, BLUE)], film_part=part))
    drawn = packed(path)
    assert drawn["film"] == [[0, BLUE], [30, BLUE]]
    assert drawn["part"] == list(part)
    assert "at 2 of 60 frames" in path.read_text(encoding="utf-8")
    probe = """<script>addEventListener("load", () => setTimeout(() => {
      const canvas = document.getElementById("image"), g = canvas.getContext("2d");
      const wide = Math.round(canvas.width / 2), high = Math.round(canvas.height / 2);
      document.body.dataset.blue = [...g.getImageData(wide, high, 1, 1).data].slice(0, 3).join(" ");
    }, 1500));</script></body>"""
    text = path.read_text(encoding="utf-8").replace("</body>", probe)
    path.write_text(re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", text), "utf-8")
    command = [
        browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'user'}",
        "--dump-dom", "--enable-logging=stderr", "--virtual-time-budget=10000", path.as_uri(),
    ]  # fmt: skip
    ran = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600)
    assert "CONSOLE" not in ran.stderr, ran.stderr
    red, _, blue = map(int, re.findall(r'data-blue="(\d+) (\d+) (\d+)"', ran.stdout)[0])
    assert (red, blue) == (pytest.approx(0, abs=12), pytest.approx(255, abs=12))
    assert ran.stdout.count("<image") == 5  # postures for printing


def test_a_page_that_would_be_too_large_is_refused(tmp_path: Path) -> None:
    with rejects("file_too_large"):
        write_walk_page(tmp_path / "walk.html", replace(page(20), lead="a" * 2_000_000))


def test_a_browser_draws_it(browser: str, tmp_path: Path) -> None:
    path = tmp_path / "walk.html"
    write_walk_page(path, page(60))
    for budget_ms in (3_000, 10_000, 30_000, 100_000):  # a busy machine may not come to the first frame
        command = [
            browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'user'}",
            "--dump-dom", "--enable-logging=stderr", f"--virtual-time-budget={budget_ms}", path.as_uri(),
        ]  # fmt: skip
        ran = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600)
        assert "CONSOLE" not in ran.stderr, ran.stderr
        if drawn := re.search(r'id="frame-now">\d+, \d', ran.stdout):
            break
    assert drawn
    assert ran.stdout.count("<polyline") == 2 * 2  # angles, sides
    assert ran.stdout.count('class="walkers"') == 2
    assert re.search(r'class="larger">−6 ± 3<', ran.stdout)
    assert ran.stdout.count("<text") > 5 + 2 * 8  # frames of the strip, and axes


def test_it_prints_on_two_pages(browser: str, model: Path, tmp_path: Path) -> None:
    sim = clip(-30.0, ERROR)
    path = alphapose(tmp_path / "a.json", in_layout(sim, "coco17"))
    output = Output(path=str(tmp_path / "out"), formats=[], recording=False)
    _, _, folder = run(Reconstruct(input=given(path), output=output, model_folder=str(model)))
    command = [
        browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'user'}",
        "--virtual-time-budget=3000", f"--print-to-pdf={tmp_path / 'walk.pdf'}", (folder / "walk.html").as_uri(),
    ]  # fmt: skip
    subprocess.run(command, capture_output=True, check=True, timeout=600)
    assert len(re.findall(rb"/Type\s*/Page\b", (tmp_path / "walk.pdf").read_bytes())) == 2
