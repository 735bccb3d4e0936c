"""The library in five functions, from files to a reconstructed view; and the package as it is installed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from pipeline import fit, from_view, joints, read, represent
from pipeline.core import errors, fourier
from pipeline.formats import c3d
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from pipeline.validation import InvalidInput

ROOT = Path(__file__).resolve().parent.parent


def test_from_files_to_a_reconstruction(tmp_path: Path) -> None:
    made = walkers.walking_population(
        np.random.default_rng(8), male=6, female=6, duration_s=3.0, frame_rate_hz=40.0
    )
    for k, walk in enumerate(made.positions_mm):
        trc.write(tmp_path / f"p{k:02d}.trc", WALKER15.joints, walk, 40.0)
    files = sorted(tmp_path.glob("*.trc"))
    positions, valid = joints(read(files[0]))
    np.testing.assert_allclose(positions, made.positions_mm[0])
    assert valid.all()
    walks = [represent(path) for path in files]
    model = fit(walks[1:])
    found = from_view(model, walks[0], 30.0)
    off = np.sqrt(errors.absolute_error(np.moveaxis(found - walks[0].coefficients, -1, 0)).sum(axis=0).mean())
    average = model.mean.reshape(5, 15, 3)
    without = np.sqrt(
        errors.absolute_error(np.moveaxis(average - walks[0].coefficients, -1, 0)).sum(axis=0).mean()
    )
    assert off < 0.8 * without
    with pytest.raises(InvalidInput, match="no such file"):
        represent(tmp_path / "nobody.trc")


def test_what_is_no_recording_no_view_or_no_other_walk_is_refused(tmp_path: Path) -> None:
    made = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    walks = [fourier.represent(positions, 40.0) for positions in made.positions_mm]
    model = fit(walks[1:])
    for angle in (float("nan"), float("inf")):
        with pytest.raises(InvalidInput, match=r"view_angle_deg must be a finite number"):
            from_view(model, walks[0], angle)
    for walk in walks[1:]:
        with pytest.raises(InvalidInput, match="model must be learnt from other walks"):
            from_view(model, walk, 30.0)
    assert from_view(model, walks[0], 30.0).shape == (5, 15, 3)
    for few in ([], walks[:1]):
        with pytest.raises(InvalidInput, match="at least two walkers"):
            fit(few)
    with pytest.raises(InvalidInput, match=r"must be what read\(path\) returns \(got .*walk.c3d"):
        joints(tmp_path / "walk.c3d")  # type: ignore[arg-type]


def test_the_ten_lines_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    (tmp_path / "my_walks").mkdir()
    for k, walk in enumerate(made.positions_mm):
        c3d.write(tmp_path / "my_walks" / f"p{k}.c3d", WALKER15.joints, walk, 40.0)
    blocks = re.findall(r"```py\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    (code,) = (block for block in blocks if "from pipeline import" in block)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert np.shape(names["coefficients"]) == (5, 15, 3)


def test_numpy_is_not_loaded_before_somebody_asks() -> None:
    code = "import sys, pipeline; assert 'numpy' not in sys.modules; assert not hasattr(pipeline, 'nothing')"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def build(source: Path, to: Path, umask: int) -> Path:
    """Build a wheel of what is tracked, copied and built under a umask."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    before = os.umask(umask)
    try:
        for name in listed.splitlines():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
        pip = [
            sys.executable,
            "-m",
            "pip",
            "wheel",
            "--quiet",
            "--no-deps",
            "--wheel-dir",
            str(to),
            str(source),
        ]
        subprocess.run(pip, check=True, env=os.environ | {"SOURCE_DATE_EPOCH": "1700000000"})
    finally:
        os.umask(before)
    (wheel,) = to.glob("*.whl")
    return wheel


@pytest.mark.skipif(not os.environ.get("BUILD_PACKAGE"), reason="needs BUILD_PACKAGE: pip fetches setuptools")
def test_the_wheel_works_in_an_empty_folder_and_has_the_same_bytes_twice(tmp_path: Path) -> None:
    wheel = build(tmp_path / "source", tmp_path / "one", 0o022)
    again = build(tmp_path / "copied elsewhere", tmp_path / "two", 0o077)
    assert again.read_bytes() == wheel.read_bytes()
    empty, installed = tmp_path / "empty", tmp_path / "installed"
    empty.mkdir()
    zipfile.ZipFile(wheel).extractall(installed)
    assert (installed / "pipeline" / "py.typed").is_file()
    run = [sys.executable, "-m", "pipeline", "experiment=zhang2007_fig2", "scale=smoke"]
    subprocess.run(run, cwd=empty, env=os.environ | {"PYTHONPATH": str(installed)}, check=True)
    assert (empty / "results" / "synthetic" / "smoke" / "zhang2007_fig2" / "table.csv").is_file()
