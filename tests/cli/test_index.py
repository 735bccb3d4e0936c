"""The index of options refuses what composing refuses, and nothing else; without it nothing changes."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.cli import index
from pipeline.cli.compose import compose
from pipeline.cli.errors import sentence
from pipeline.cli.main import COMMANDS, _help_of, command
from pipeline.cli.presets import presets
from pipeline.storage import user_cache
from pipeline.studies.experiment import Experiment
from pipeline.validation import InvalidInput
from tests.conftest import Said
from tests.processes import finished

SLIPS = [
    "experiment=zhang2007_fig55",
    "data=opticall",
    "data=recorded",
    "scale=large",
    "sweep=known_views",
    "swep.truth=motion",
    "sweep.truht=motion",
    "sweep.truth=fourrier",
    "sweep.view_angle_deg.stepp=1",
    "sweep.view_angle_deg.step=abc",
    "model.components=0",
    "model.components=many",
    "data.population=0",
    "seed.x=1",
    "skeleton.maping=auto",
    "data.walkers.x=1",
]


@pytest.fixture
def indexed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The index, in a cache of the test's own."""
    monkeypatch.setenv("GAIT_PIPELINE_CACHE", str(tmp_path))
    index.write_index()
    (path,) = (tmp_path / user_cache.edition()).iterdir()
    return path


def judged(*overrides: str) -> str:
    """What the index says of overrides of a figure; empty if nothing."""
    try:
        index.refuse_slips(["experiment=zhang2007_fig5", *overrides])
    except InvalidInput as error:
        return str(error)
    return ""


def composed(*overrides: str) -> str:
    """What composing and validating say."""
    try:
        compose(["experiment=zhang2007_fig5", *overrides]).validate()
    except Exception as error:
        return sentence(error)
    return ""


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_refused_by_both_and_names_the_same_option(slip: str, indexed: Path) -> None:
    quick, slow = judged(slip), composed(slip)
    named = quick.split()[0].rstrip(":")
    assert quick
    assert slip.partition("=")[0].startswith(named)
    assert named.split(".")[0] in slow


@pytest.fixture(scope="module")
def small() -> dict[str, Experiment]:
    """Every preset at smoke scale: before a test has a cache of its own."""
    return {name: compose(["scale=smoke", f"experiment={name}"]) for name in presets()}


@pytest.mark.parametrize("figure", presets())
def test_every_value_of_every_preset_passes(figure: str, small: dict[str, Experiment], indexed: Path) -> None:
    def values(options: object, path: str) -> list[str]:
        found = []
        for name, value in vars(options).items():
            if hasattr(value, "__dataclass_fields__"):
                found += values(value, f"{path}{name}.")
            elif not isinstance(value, list | dict) and value is not None:
                found.append(f"{path}{name}={getattr(value, 'name', value)}")
        return found

    given = values(small[figure], "")
    assert len(given) > 40
    index.refuse_slips([f"experiment={figure}", *given])


@pytest.mark.parametrize(
    "override",
    [
        "data=hdm05_squat", "dataset=fourier_of_all_walks", "sweep=none", "skeleton=auto", "model.components=null",
        "sweep.methods=[map]", "+sweep.new=1", "~model", "data.path='a b'", "model.components=1e1", "hydra.job.name=x",
        "data=optical data.mirror=/x", "sweep=unknown_view figure=view_angles sweep.solver=published",
    ],
)  # fmt: skip
def test_what_it_cannot_judge_passes(override: str, indexed: Path) -> None:
    assert judged(*override.split(" ") if "'" not in override else [override]) == ""


def test_an_index_of_other_sources_or_none_judges_nothing(
    indexed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert judged("swep=1")
    monkeypatch.setattr(user_cache, "edition", lambda: "of other sources")
    assert judged("swep=1") == ""
    monkeypatch.undo()
    monkeypatch.setenv("GAIT_PIPELINE_CACHE", str(indexed.parent.parent))
    for content in ("{", "[]", ""):
        indexed.write_text(content)
        assert judged("swep=1") == ""
    index.write_index()
    assert judged("swep=1")
    indexed.unlink()
    assert judged("swep=1") == ""
    monkeypatch.setenv("GAIT_PIPELINE_CACHE", "/dev/null")
    index.write_index()
    assert judged("swep=1") == ""


def test_a_slip_and_help_load_no_library(indexed: Path, tmp_path: Path) -> None:
    slip = ["experiment=zhang2007_fig5", "sweep.truht=motion"]
    for arguments, status in ((slip, 1), (["figures", *slip], 1), (["--help"], 0), (["claims", "--help"], 0)):
        code = (
            f"import sys\nfrom pipeline.cli.main import main\nstatus = main({arguments!r})\n"
            "heavy = {'hydra', 'pandas', 'scipy', 'numba', 'matplotlib', 'rerun'} & set(sys.modules)\n"
            f"assert (status, heavy) == ({status}, set()), (status, heavy)\n"
        )
        done = finished([sys.executable, "-c", code], environment={"GAIT_PIPELINE_CACHE": str(tmp_path)})
        assert done.returncode == 0, done.stderr


def test_help_of_a_command_is_its_docstring() -> None:
    for name in COMMANDS:
        assert _help_of(name).split() == (command(name).__doc__ or "").split()


def test_a_multirun_is_left_to_composing(indexed: Path) -> None:
    index.refuse_slips(["-m", "experiment=zhang2007_fig5,zhang2007_fig55"])


def test_the_command_line_asks_the_index(
    indexed: Path, say: Callable[..., Said], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.cli.compose.compose", None)
    said = say("status", "experiment=zhang2007_fig5", "sweep.truht=motion")
    assert (said.status, said.out) == (1, "")
    assert said.err.startswith("sweep.truht: there is no such option")


def test_a_preset_that_is_not_utf8_is_left_to_its_composition(
    indexed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(index.CONF, tmp_path / "conf")
    (tmp_path / "conf" / "experiment" / "mine.yaml").write_bytes(b"title: caf\xe9\n")
    for module in ("index", "presets"):
        monkeypatch.setattr(f"pipeline.cli.{module}.CONF", tmp_path / "conf")
    index.refuse_slips(["experiment=mine"])
