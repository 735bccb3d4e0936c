"""Tests of `reconstruct`, `inspect`, `export` and the Python interface with only the four base packages installed."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
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
from tests.wheels import build, install
from walk3d.export.c3d import write as write_c3d

BASE = ("numpy", "scipy", "pyyaml", "threadpoolctl")

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs links to folders")


@dataclass(frozen=True)
class Environment:
    """Python environment that contains only the four base packages and this project."""

    command: tuple[str, ...]
    variables: dict[str, str]
    wheel: bool

    def run(self, cwd: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run ``python ARGUMENTS`` in this environment; return the output."""
        return subprocess.run(
            [*self.command, *arguments],
            cwd=cwd,
            env={**os.environ, **self.variables},
            capture_output=True,
            text=True,
            timeout=WAIT_S,
        )

    def hint(self, package: str, extra: str, target: str) -> str:
        """Return the expected end of the message about a missing package, with the command that installs it."""
        command = f"pip install 'gait-pipeline[{extra}]'" if self.wheel else target
        return f"{package} (extra `{extra}`), which is not installed: {command}"


def linked(folder: Path) -> Path:
    """Fill a folder with links to the four base packages only."""
    for name in BASE:
        installed = metadata.distribution(name)
        for first in {file.parts[0] for file in installed.files or []} - {"..", "__pycache__"}:
            (folder / first).symlink_to(Path(str(installed.locate_file(first))))
    return folder


NEEDS_BUILD = pytest.mark.skipif(
    not os.environ.get("BUILD_PACKAGE"),
    reason="needs BUILD_PACKAGE: pip installs the light lock and the wheel",
)


@pytest.fixture(scope="module", params=["clone", pytest.param("wheel", marks=NEEDS_BUILD)])
def base(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """Environment with the four base packages, and the project as a clone or as an installed wheel."""
    folder = tmp_path_factory.mktemp("base")
    if request.param == "clone":
        path = f"{linked(folder)}{os.pathsep}{ROOT}"
        return Environment((sys.executable, "-S"), {"PYTHONPATH": path}, wheel=False)
    wheel = build(folder / "source", folder, 0o022)
    return Environment((str(install(wheel, folder / "environment")),), {"PYTHONPATH": ""}, wheel=True)


@pytest.fixture(scope="module")
def walks(base: Environment, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with recordings of four people, ``my_walks``, and with keypoints, ``film.json``."""
    folder = tmp_path_factory.mktemp("walks")
    output = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    (folder / "my_walks").mkdir()
    for k, walk in enumerate(output.positions_mm):
        write_c3d(folder / "my_walks" / f"p{k}.c3d", WALKER15.joints, walk, 40.0)
    alphapose(folder / "film.json", in_layout(clip(60.0, ERROR), "coco17"))
    return folder


def test_only_the_four_packages_are_there(base: Environment, walks: Path) -> None:
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
    message = base.run(
        walks, "-c", f"import importlib.util as u; print([n for n in {absent} if u.find_spec(n)])"
    )
    assert message.stdout.strip() == "[]", message.stderr


def test_a_walk_is_reconstructed_and_what_is_not_written_is_said(base: Environment, walks: Path) -> None:
    message = base.run(
        walks, "-m", "pipeline", "reconstruct", "film.json", "input.frame_rate_hz=30", "input.width=1920",
        "input.height=1080", "output.path=out",
    )  # fmt: skip
    assert (message.returncode, message.stderr) == (0, "")
    written = {path.name for path in (walks / "out").iterdir()}
    assert written == {
        "manifest.json",
        "summary.json",
        *("joints.csv", "angles.csv", "cycle.csv", "numbers.csv"),
        *("walk.c3d", "walk.trc", "walk.csv", "walk.bvh", "walk_cycle.bvh", "motion.txt", "walk.html"),
    }
    hint = base.hint("rerun-sdk", "papers", "make install")
    assert f"No recording.rrd: it needs {hint}." in message.stdout
    message = base.run(walks, "-m", "pipeline", "export", "out", "to=cycles.trc")
    assert (message.returncode, message.stderr) == (0, "")
    assert (walks / "cycles.trc").is_file()


def test_recordings_are_inspected_and_exported(base: Environment, walks: Path) -> None:
    message = base.run(walks, "-m", "pipeline", "inspect", "my_walks")
    assert (message.returncode, message.stderr) == (0, "")
    assert "4 of 4 files contain walks" in message.stdout
    message = base.run(walks, "-m", "pipeline", "export", "my_walks/p0.c3d", "skeleton=auto", "to=p0.csv")
    assert (message.returncode, message.stderr) == (0, "")
    message = base.run(walks, "-m", "pipeline", "pointlight", "my_walks/p0.c3d", "to=p0.svg")
    assert (message.returncode, message.stderr) == (0, "")


def test_the_first_example_in_python_runs(base: Environment, walks: Path) -> None:
    (code,) = (block for block in blocks("README.md", "py") if "from gait_pipeline import" in block)
    message = base.run(walks, "-c", code + "\nprint(coefficients.shape)")
    assert (message.stdout.strip(), message.stderr) == ("(5, 15, 3)", "")


@pytest.mark.parametrize(
    ("arguments", "package"),
    [
        (["experiment=zhang2007_fig2"], "hydra-core"),
        (["figures"], "hydra-core"),
        (["pointlight", "my_walks/p0.c3d", "to=walker.gif"], "pillow"),
    ],
)
def test_what_needs_more_says_which_package(
    base: Environment, walks: Path, arguments: list[str], package: str
) -> None:
    message = base.run(walks, "-m", "pipeline", *arguments)
    assert message.returncode == 1
    assert message.stderr == f"this needs {base.hint(package, 'papers', 'make install')}\n"
    assert message.stdout in (
        "setting up figures\n",
        "setting up zhang2007_fig2\n",
        "reading my_walks/p0.c3d\n",
    )


def test_a_film_says_which_package_reads_it(base: Environment, walks: Path) -> None:
    (walks / "film.mp4").write_bytes(b"no film, which is not read either")
    message = base.run(walks, "-m", "pipeline", "reconstruct", "film.mp4")
    assert message.returncode == 1
    (line,) = message.stderr.splitlines()
    assert base.hint("opencv-python-headless", "video", "make video") in line


def test_the_help_and_the_equations_are_printed(base: Environment, walks: Path) -> None:
    for arguments in (["--help"], ["--version"], ["figures", "--help"], ["equations", "zhang2007"]):
        message = base.run(walks, "-m", "pipeline", *arguments)
        assert (message.returncode, message.stderr) == (0, ""), arguments
        assert message.stdout


IN_CLONE = "pip install '.[xarray]'"
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


def test_functions_that_need_more_say_which_package(base: Environment, walks: Path) -> None:
    message = base.run(walks, "-c", LIBRARY)
    assert message.stderr == ""
    assert message.stdout.splitlines() == [
        f"this needs {base.hint('pandas', 'papers', 'make install')}",
        f"this needs {base.hint('xarray', 'xarray', IN_CLONE)}",
        "this needs numba (extra `papers`), which is not installed:"
        " pip install 'gait-pipeline[papers]', in a clone make install",
    ]
