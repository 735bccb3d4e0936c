"""The library, `reconstruct`, `inspect` and `export` with numpy, scipy, pyyaml and threadpoolctl alone."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from tests.pages import blocks
from tests.processes import ROOT, WAIT_S
from tests.walk3d.film.reconstruct.walks import ERROR, alphapose, in_layout
from tests.walk3d.film.walk.walkers import clip
from walk3d.export.c3d import write as write_c3d

BASE = ("numpy", "scipy", "pyyaml", "threadpoolctl")

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs links to folders")


@pytest.fixture(scope="session")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of packages with these four alone."""
    folder = tmp_path_factory.mktemp("base")
    for name in BASE:
        installed = metadata.distribution(name)
        for first in {file.parts[0] for file in installed.files or []} - {"..", "__pycache__"}:
            (folder / first).symlink_to(Path(str(installed.locate_file(first))))
    return folder


def run(base: Path, cwd: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """What ``python ARGUMENTS`` said with the four packages and this project."""
    return subprocess.run(
        [sys.executable, "-S", *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": f"{base}{os.pathsep}{ROOT}"},
        capture_output=True,
        text=True,
        timeout=WAIT_S,
    )


@pytest.fixture(scope="module")
def walks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``my_walks``, recordings of four people, and ``film.json``, keypoints of one."""
    folder = tmp_path_factory.mktemp("walks")
    made = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    (folder / "my_walks").mkdir()
    for k, walk in enumerate(made.positions_mm):
        write_c3d(folder / "my_walks" / f"p{k}.c3d", WALKER15.joints, walk, 40.0)
    alphapose(folder / "film.json", in_layout(clip(60.0, ERROR), "coco17"))
    return folder


def test_only_the_four_packages_are_there(base: Path) -> None:
    absent = (
        "hydra",
        "rich",
        "pandas",
        "matplotlib",
        "rerun",
        "jinja2",
        "numba",
        "PIL",
        "omegaconf",
        "pyarrow",
    )
    said = run(
        base, ROOT, "-c", f"import importlib.util as u; print([n for n in {absent} if u.find_spec(n)])"
    )
    assert said.stdout.strip() == "[]", said.stderr


def test_a_walk_is_reconstructed_and_what_is_not_written_is_said(base: Path, walks: Path) -> None:
    said = run(
        base, walks, "-m", "pipeline", "reconstruct", "film.json", "input.frame_rate_hz=30", "input.width=1920",
        "input.height=1080", "output.path=out",
    )  # fmt: skip
    assert (said.returncode, said.stderr) == (0, "")
    written = {path.name for path in (walks / "out").iterdir()}
    assert written == {
        "manifest.json",
        "summary.json",
        *("joints.csv", "angles.csv", "cycle.csv", "numbers.csv"),
        *("walk.c3d", "walk.trc", "walk.csv", "walk.bvh", "walk_cycle.bvh", "motion.txt"),
    }
    for file, package in (
        ("recording.rrd", "rerun-sdk"),
        ("walk.html", "jinja2"),
    ):
        words = f"No {file}: it needs {package} (extra `papers`), which is not installed: make install."
        assert words in said.stdout
    said = run(base, walks, "-m", "pipeline", "export", "out", "to=cycles.trc")
    assert (said.returncode, said.stderr) == (0, "")
    assert (walks / "cycles.trc").is_file()


def test_recordings_are_inspected_and_exported(base: Path, walks: Path) -> None:
    said = run(base, walks, "-m", "pipeline", "inspect", "my_walks")
    assert (said.returncode, said.stderr) == (0, "")
    assert "4 of 4 files hold walks" in said.stdout
    said = run(base, walks, "-m", "pipeline", "export", "my_walks/p0.c3d", "skeleton=auto", "to=p0.csv")
    assert (said.returncode, said.stderr) == (0, "")
    said = run(base, walks, "-m", "pipeline", "pointlight", "my_walks/p0.c3d", "to=p0.svg")
    assert (said.returncode, said.stderr) == (0, "")


def test_the_first_example_in_python_runs(base: Path, walks: Path) -> None:
    (code,) = (block for block in blocks("README.md", "py") if "from gait_pipeline import" in block)
    said = run(base, walks, "-c", code + "\nprint(coefficients.shape)")
    assert (said.stdout.strip(), said.stderr) == ("(5, 15, 3)", "")


@pytest.mark.parametrize(
    ("arguments", "package"),
    [
        (["experiment=zhang2007_fig2"], "hydra-core"),
        (["figures"], "hydra-core"),
        (["pointlight", "my_walks/p0.c3d", "to=walker.gif"], "pillow"),
    ],
)
def test_what_needs_more_says_which_package(
    base: Path, walks: Path, arguments: list[str], package: str
) -> None:
    said = run(base, walks, "-m", "pipeline", *arguments)
    assert said.returncode == 1
    assert said.stderr == f"this needs {package} (extra `papers`), which is not installed: make install\n"
    assert said.stdout in ("", "setting up figures\n", "setting up zhang2007_fig2\n")


def test_a_film_says_which_package_reads_it(base: Path, walks: Path) -> None:
    (walks / "film.mp4").write_bytes(b"no film, which is not read either")
    said = run(base, walks, "-m", "pipeline", "reconstruct", "film.mp4")
    assert said.returncode == 1
    (line,) = said.stderr.splitlines()
    assert "opencv-python-headless (extra `video`), which is not installed: make video" in line


def test_the_help_and_the_equations_are_printed(base: Path, walks: Path) -> None:
    for arguments in (["--help"], ["--version"], ["figures", "--help"], ["equations", "zhang2007"]):
        said = run(base, walks, "-m", "pipeline", *arguments)
        assert (said.returncode, said.stderr) == (0, ""), arguments
        assert said.stdout


LIBRARY = """
import numpy as np
from pipeline import read, to_dataframe, to_xarray
from pipeline.core.binary_quadratic import minimise
from pipeline.core.trajectory_basis import cosine_basis
motion = read("my_walks/p0.c3d")
for call in (
    lambda: to_dataframe(motion),
    lambda: to_xarray(motion),
    lambda: minimise(cosine_basis(6, 2), np.zeros((6, 3)), np.ones((6, 3))),
):
    try:
        call()
    except ModuleNotFoundError as error:
        print(error)
"""


def test_functions_that_need_more_say_which_package(base: Path, walks: Path) -> None:
    said = run(base, walks, "-c", LIBRARY)
    assert said.stderr == ""
    assert said.stdout.splitlines() == [
        "this needs pandas (extra `papers`), which is not installed: make install",
        "this needs xarray (extra `xarray`), which is not installed: pip install '.[xarray]'",
        "this needs numba (extra `papers`), which is not installed: make install",
    ]
