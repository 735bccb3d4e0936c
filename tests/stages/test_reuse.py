"""Tests of reuse: stored results are reused, changed results are recomputed, and threads change no digit."""

from __future__ import annotations

import ast
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from pipeline import plugins
from pipeline.cli.compose import compose
from pipeline.cli.figures import make_figure
from pipeline.cli.presets import presets
from pipeline.cli.summary import Outcome
from pipeline.resources import CONF
from pipeline.storage import source_code, tables
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment
from tests.conftest import QUICK
from tests.recordings import reading

pytestmark = pytest.mark.thorough

STAGES = ("ingest", "dataset", "model", "sweep")


def made(folder: Path, *suffixes: str) -> dict[str, bytes]:
    """Return the content of those files of a figure that have the given suffixes."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.suffix in suffixes}


def keys(outcome: Outcome) -> dict[str, str]:
    """Return the cache key of each stage of a figure."""
    manifest: dict[str, Any] = json.loads((outcome.folder / "manifest.json").read_bytes())
    return {stage: described["key"] for stage, described in manifest["stages"].items()}


@pytest.fixture(scope="module")
def keys_before(smoke_results: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Cache keys of figure 5 of zhang2007, with unchanged options and sources."""
    experiment = compose(["experiment=zhang2007_fig5", f"results={smoke_results}", *QUICK])
    folder = tmp_path_factory.mktemp("before") / experiment.name
    return keys(make_figure(experiment, folder, store=Store(smoke_results)))


@pytest.mark.parametrize("name", presets())
def test_the_second_run_computes_nothing_and_gives_the_same_tables(
    figure: Callable[..., Outcome], smoke_results: Path, name: str
) -> None:
    outcome = figure(smoke_results, name)
    assert outcome.reused == STAGES
    first = smoke_results / "synthetic" / "smoke" / name
    again, once = made(outcome.folder, ".csv", ".npz"), made(first, ".csv", ".npz")
    # The ledger explains differences of presets only, and the second run is not one.
    assert again.pop("claims.csv")
    assert once.pop("claims.csv")
    assert again == once


def test_drawing_and_logging_again_gives_the_same_picture_and_recording(
    figure: Callable[..., Outcome], smoke_results: Path
) -> None:
    outcome = figure(smoke_results, "zhang2007_fig5", "scale=smoke", quick=False)
    first = smoke_results / "synthetic" / "smoke" / "zhang2007_fig5"
    assert made(outcome.folder, ".svg", ".png") == made(first, ".svg", ".png")
    digests = {reading.digest(folder / "recording.rrd") for folder in (outcome.folder, first)}
    assert len(digests) == 1


@pytest.mark.parametrize(
    ("override", "remade"),
    [
        ("sweep.sigma2_mm2.step=46", ("sweep",)),
        ("sweep.view_angle_deg.step=30", ("sweep",)),
        ("sweep.noise_variance_mm2=100", ("sweep",)),
        ("model.components=5", ("model", "sweep")),
        ("dataset.origin=floor", STAGES),  # walks are represented as they are made
        ("data.marker_noise_mm=1", STAGES),
        ("seed=1", STAGES),
        ("workers=1", ()),
        ("figure.picture=true", ()),
    ],
)
def test_a_changed_option_remakes_its_stage_and_what_follows(
    figure: Callable[..., Outcome],
    smoke_results: Path,
    keys_before: dict[str, str],
    override: str,
    remade: tuple[str, ...],
) -> None:
    after = keys(figure(smoke_results, "zhang2007_fig5", override))
    assert tuple(stage for stage in STAGES if keys_before[stage] != after[stage]) == remade


@pytest.mark.parametrize("name", ["zhang2007_fig3", "zhang2007_fig5", "zhang2007_fig6", "zhang2004_fig4"])
def test_one_worker_and_three_give_the_same_bits(
    figure: Callable[..., Outcome], tmp_path: Path, name: str
) -> None:
    few = "scale.walkers=7"  # which neither two nor three processes share evenly
    alone, together = (figure(tmp_path / workers, name, few, f"workers={workers}") for workers in ("1", "3"))
    assert alone.reused == together.reused == ()
    assert made(alone.folder, ".csv", ".npz") == made(together.folder, ".csv", ".npz")


def test_another_seed_makes_other_walkers(figure: Callable[..., Outcome], smoke_results: Path) -> None:
    ingested, paces = [], []
    for seed in (1, 2):
        outcome = figure(smoke_results, "zhang2007_fig2", f"seed={seed}")
        ingested.append(keys(outcome)["ingest"])
        paces.append(set(tables.read(outcome.folder / "table_harmonics.csv")["frequency_hz"]))
    assert ingested[0] != ingested[1]
    assert not paces[0] & paces[1]


def test_a_damaged_artefact_is_set_aside_and_made_again(
    figure: Callable[..., Outcome], tmp_path: Path
) -> None:
    first = figure(tmp_path, "zhang2007_fig5")
    before = made(first.folder, ".csv")
    (arrays,) = (tmp_path / "cache").glob("model-*/arrays.npz")
    content = bytearray(arrays.read_bytes())
    content[len(content) // 2] ^= 1
    arrays.write_bytes(content)
    again = figure(tmp_path, "zhang2007_fig5")
    assert again.reused == ("ingest", "dataset", "sweep")
    assert made(again.folder, ".csv") == before
    assert len(list((tmp_path / "cache" / "damaged").iterdir())) == 1


def test_without_a_cache_the_figure_stands_and_is_made_again(
    figure: Callable[..., Outcome], tmp_path: Path
) -> None:
    first = figure(tmp_path, "zhang2007_fig2")
    before = made(first.folder, ".csv", ".npz")
    shutil.rmtree(tmp_path / "cache")
    again = figure(tmp_path, "zhang2007_fig2")
    assert again.reused == ()
    assert made(again.folder, ".csv", ".npz") == before


# --- sources ----------------------------------------------------------------------------------------------


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Copy of the sources of the package, from which the cache keys are then computed."""
    copy = tmp_path / "pipeline"
    shutil.copytree(plugins.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(plugins, "PACKAGE", copy)
    source_code._module.cache_clear()
    yield copy
    source_code._module.cache_clear()


def reword(path: Path) -> None:
    """Replace every docstring and all comments of a module, without a change of its code."""
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree):
        match node:
            case ast.Expr(ast.Constant(str())):
                node.value = ast.Constant("In other words.")
    path.write_text(f"# Another remark.\n{ast.unparse(tree)}\n", encoding="utf-8")


def change(files: list[Path]) -> None:
    """Add a line of code to each of the given modules."""
    assert files
    for path in files:
        path.write_text(f"{path.read_text(encoding='utf-8')}\nCHANGED = 1\n", encoding="utf-8")


def test_a_word_changed_anywhere_recomputes_nothing(
    figure: Callable[..., Outcome], smoke_results: Path, sources: Path
) -> None:
    for path in sources.rglob("*.py"):
        before = path.read_bytes()
        reword(path)
        assert path.read_bytes() != before
    for name in ("zhang2007_fig5", "mozerov2006_fig2", "park2011_fig3b"):
        assert figure(smoke_results, name).reused == STAGES


@pytest.mark.parametrize(
    ("changed", "remade"),
    [
        (("studies/limbs", "studies/actions"), ()),
        (("cli", "stages", "papers", "pictures", "recordings"), ()),
        (("core/articulated_trajectory", "core/synchronization", "core/binary_quadratic"), ()),
        (("studies/walks/figures",), ()),
        (("studies/walks/known_view.py",), ("sweep",)),
        (("core/viewpoint/search.py",), ()),
        (("core/reconstruction/known_view.py",), ("ingest", "sweep")),  # estimates missing joints as well
        (("studies/eigenwalkers/model.py",), ("model", "sweep")),
        (("studies/eigenwalkers/samples.py",), STAGES),
        (("clips/walks.py",), ("ingest",)),  # its clips come out equal
        (("formats", "mappings", "fetch", "ingestion"), ()),
    ],
)
def test_changed_code_remakes_what_is_computed_with_it(
    figure: Callable[..., Outcome],
    smoke_results: Path,
    keys_before: dict[str, str],
    sources: Path,
    changed: tuple[str, ...],
    remade: tuple[str, ...],
) -> None:
    for name in changed:
        change([sources / name] if name.endswith(".py") else sorted((sources / name).rglob("*.py")))
    source_code._module.cache_clear()
    after = keys(figure(smoke_results, "zhang2007_fig5"))
    assert tuple(stage for stage in STAGES if keys_before[stage] != after[stage]) == remade


@pytest.fixture(scope="module")
def experiments() -> list[Experiment]:
    """Return the experiments of all presets."""
    return [compose([f"experiment={name}"]) for name in presets()]


@pytest.mark.parametrize(
    ("study", "figures"),
    [
        ("walks", ("zhang2004_", "zhang2007_")),
        ("actions", ("mozerov2006_",)),
        ("limbs", ("park2011_",)),
    ],
)
def test_code_of_a_study_is_in_the_keys_of_its_own_figures(
    sources: Path, experiments: list[Experiment], study: str, figures: tuple[str, ...]
) -> None:
    def digests() -> dict[str, list[str]]:
        source_code._module.cache_clear()
        return {
            e.name: [
                source_code.sources_digest([type(option).__module__])
                for option in (e.dataset, e.model, e.sweep, e.figure)
            ]
            for e in experiments
        }

    before = digests()
    change(sorted((sources / "studies" / study).rglob("*.py")))
    after = digests()
    changed = {name for name in before if before[name] != after[name]}
    of_study = {name for name in before if name.startswith(figures)}
    of_paper = {name for name in of_study if (CONF / "experiment" / f"{name}.yaml").is_file()}
    assert of_paper <= changed <= of_study  # our own figures may do without the study's code
