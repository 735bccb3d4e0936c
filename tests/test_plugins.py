"""Tests of plug-ins: a method in one file of a user, installed packages, and results that depend on their sources."""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from importlib import metadata
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

from pipeline import papers, plugins
from pipeline.cli.compose import compose
from pipeline.cli.presets import presets
from pipeline.cli.status import status
from pipeline.palette import Style
from pipeline.stages.sources import figure_code
from pipeline.storage import archive, provenance, source_code, tables
from pipeline.storage.publishing import publish
from pipeline.studies.walks import methods
from pipeline.studies.walks.methods import PUBLISHED
from pipeline.validation import InvalidInput
from tests.conftest import CommandResult
from tests.processes import ROOT, finished
from tests.recordings.reading import entities
from tests.rejects import rejects

EXAMPLE = re.search(r"```py\n(.*?)```", (ROOT / "docs" / "extend.md").read_text("utf-8"), re.DOTALL)
assert EXAMPLE
RIDGE = EXAMPLE[1]
"""Source text of the plug-in example in the documentation."""


@pytest.fixture
def no_files() -> Iterator[None]:
    """Unload all plug-in files of users, and restore them after the test."""
    before = dict(plugins._files)
    plugins._files.clear()
    yield
    plugins._files.clear()
    plugins._files.update(before)


@pytest.fixture
def ridge(tmp_path: Path, no_files: None) -> Path:
    """File with the plug-in example of the documentation, saved in the user's folder."""
    path = tmp_path / "ridge.py"
    path.write_text(RIDGE, encoding="utf-8")
    return path


def run(folder: Path, *arguments: str) -> tuple[int, str, str]:
    """Return the exit status, output and errors of a command that runs in a user's folder."""
    done = finished([sys.executable, "-m", "pipeline", *arguments], cwd=folder)
    return done.returncode, done.stdout, done.stderr


def test_the_example_has_at_most_forty_lines() -> None:
    assert len(RIDGE.splitlines()) <= 40


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """User's folder with the plug-in example, and with figure 5 of zhang2007 computed with this plug-in."""
    home = tmp_path_factory.mktemp("home")
    (home / "ridge.py").write_text(RIDGE, encoding="utf-8")
    code, out, err = run(home, "experiment=zhang2007_fig5", "plugins=ridge.py", "scale=smoke")
    assert code == 0, out + err
    return home


def figure_in(home: Path) -> Path:
    """Return the folder of the figure that was computed in a user's folder."""
    (folder,) = (home / "results" / "scratch").glob("*/zhang2007_fig5")
    return folder


def test_a_users_file_adds_a_method_to_a_figure_of_a_paper(made: Path) -> None:
    folder = figure_in(made)
    table = tables.read(folder / "table.csv")
    of_method = table["method"] == "ridge"
    assert table["view_angle_deg"][of_method].tolist() == list(range(-90, 91, 15))
    below = 100.0 * (
        1.0
        - table["absolute_error_mm2"][of_method].mean()
        / table["absolute_error_mm2"][table["method"] == "map"].mean()
    )
    claims = pd.DataFrame(tables.read(folder / "claims.csv")).set_index("claim")
    assert claims.loc["ridge_below_map", "kind"] == "target"
    assert claims.loc["ridge_below_map", "value"] == pytest.approx(below, rel=1e-6)
    assert claims.loc["ridge_below_map", "agreement"] == "not judged at smoke scale"
    assert "world/reconstructed/ridge" in entities(folder / "recording.rrd")
    assert "ridge regression" in (folder / "figure.svg").read_text("utf-8")
    manifest = json.loads((folder / "manifest.json").read_text("utf-8"))
    assert any("ridge" in json.dumps(chart) for chart in manifest["charts"])
    assert manifest["plugins"] == [{"file": "ridge.py", "sha256": hashlib.sha256(RIDGE.encode()).hexdigest()}]
    assert (folder / "plugin_ridge.py").read_text("utf-8") == RIDGE
    assert str(made) not in (folder / "manifest.json").read_text("utf-8")


def test_an_archive_is_computed_again_with_the_users_own_copy_of_the_file_and_not_without_it(
    made: Path,
    say: Callable[..., CommandResult],
    no_files: None,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    folder, archived = figure_in(made), tmp_path / "archived"
    with publish(archived, having="archive") as publication:
        names = [path.name for path in folder.iterdir()]
        archive.write_files(publication.folder, {f"zhang2007_fig5/{name}": folder / name for name in names})
        archive.seal(publication, {"archive": "mine"})
    monkeypatch.chdir(made)
    answer = say("verify", str(archived), "rerun=1")
    assert answer.status == 1
    assert "ridge.py" in answer.err
    assert hashlib.sha256(RIDGE.encode()).hexdigest() in answer.err
    assert "plugins=FILE" in answer.err
    answer = say("verify", str(archived), "rerun=1", "plugins=ridge.py")
    assert answer.status == 0, answer.out + answer.err
    assert "agree" in answer.out


def test_ridge_regression_has_the_error_that_numpy_gives(ridge: Path) -> None:
    """Ridge regression agrees with the normal equations, solved for one penalty and one left-out walk at a time."""
    from tests.walk3d.anatomy.study.test_method import inputs

    plugins.load_files([ridge])
    module = sys.modules["plugin_ridge"]
    arguments, view = inputs(), np.radians([30.0])
    fold, walk = methods.held_out(arguments.dataset, arguments.model, 3, 70.0)
    missing = methods.chosen(["ridge"])[0].apply(fold, walk, view).missing[0]
    cos, sin = np.cos(view[0]), np.sin(view[0])
    x = np.stack([cos * fold.training[..., 0] + sin * fold.training[..., 1], fold.training[..., 2]], axis=-1)
    y = (-sin * fold.training[..., 0] + cos * fold.training[..., 1]).reshape(len(x), -1)
    x = x.reshape(len(x), -1)

    def fitted(rows: np.ndarray, penalty: float, of: np.ndarray) -> np.ndarray:
        x0, y0 = x[rows].mean(axis=0), y[rows].mean(axis=0)
        square = (x[rows] - x0).T @ (x[rows] - x0) + penalty * np.eye(x.shape[1])
        return y0 + (of - x0) @ np.linalg.solve(square, (x[rows] - x0).T @ (y[rows] - y0))

    every = np.arange(len(x))
    errors = [
        np.mean([(fitted(every != r, penalty, x[r]) - y[r]) ** 2 for r in every])
        for penalty in module.PENALTIES
    ]
    best = module.PENALTIES[np.argmin(errors)]
    image = walk.observed(view).ravel()
    np.testing.assert_allclose(missing.ravel(), fitted(every >= 0, best, image), rtol=1e-6, atol=1e-6)


def test_an_edited_line_makes_a_figure_stale(made: Path, ridge: Path) -> None:
    common = ["experiment=zhang2007_fig5", f"results={made / 'results'}", "scale=smoke"]
    arguments = [*common, f"plugins={ridge}"]
    assert status(compose(arguments), figure_in(made)).state == "current"
    plain = figure_code(compose(common))
    ridge.write_text(RIDGE.replace("np.arange(2, 8)", "np.arange(2, 9)"), encoding="utf-8")
    stale = status(compose(arguments), figure_in(made))
    assert (stale.state, stale.to_compute) == ("stale", ("sweep",))
    assert figure_code(compose(common)) == plain, "figures without the file are as they were"


def test_an_edited_plug_in_makes_the_figures_stale_that_use_it(
    no_files: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    import shutil

    experiment = ["experiment=zhang2007_fig5", "scale=smoke"]
    uses = compose([*experiment, "sweep.methods=[map,anatomical]"])
    before = figure_code(uses), figure_code(compose(experiment))
    copy = tmp_path / "walk3d"
    shutil.copytree(ROOT / "walk3d", copy, ignore=shutil.ignore_patterns("__pycache__"))
    path = copy / "anatomy" / "method.py"
    path.write_text(path.read_text("utf-8") + "\nCHANGED = 1\n", encoding="utf-8")
    monkeypatch.setattr(plugins, "_folders", lambda: {"walk3d": copy})
    from pipeline.storage import source_code

    source_code._module.cache_clear()
    after = figure_code(uses), figure_code(compose(experiment))
    source_code._module.cache_clear()
    assert after[0] != before[0]
    assert after[1] == before[1]


@pytest.mark.parametrize(
    "name", ["zhang2007_fig5", pytest.param("zhang2007_fig6", marks=pytest.mark.thorough)]
)
def test_a_figure_of_a_paper_has_the_same_bytes_without_plug_ins(
    name: str, figure: Callable[..., object], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with_them = figure(tmp_path / "with", name, "scale=smoke", quick=False)
    monkeypatch.setattr(plugins, "_installed", lambda: ((), {}))
    monkeypatch.setattr(plugins, "_folders", lambda: {})
    without = figure(tmp_path / "without", name, "scale=smoke", quick=False)
    names = sorted(path.name for path in with_them.folder.iterdir())
    assert names == sorted(path.name for path in without.folder.iterdir())
    for file in set(names) - {"manifest.json", "recording.rrd"}:
        assert (with_them.folder / file).read_bytes() == (without.folder / file).read_bytes(), file
    both = (entities(folder / "recording.rrd") for folder in (with_them.folder, without.folder))
    assert next(both) == next(both)


@pytest.mark.parametrize(
    "preset", sorted((ROOT / "conf" / "experiment").glob("*.yaml")), ids=lambda p: p.stem
)
def test_a_preset_of_the_papers_needs_no_plug_in(preset: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugins, "_installed", lambda: ((), {}))
    assert preset.stem in presets()
    experiment = compose([f"experiment={preset.stem}"])
    experiment.validate()
    assert experiment.name == preset.stem


def test_an_unknown_method_is_an_error_that_lists_the_known_ones() -> None:
    experiment = compose(["experiment=zhang2007_fig5", "sweep.methods=[map,ridgee]"])
    with rejects("unknown_choice", "sweep.methods", value="ridgee") as rejection:
        experiment.validate()
    assert all(name in str(rejection.value) for name in ("least_squares", "map", "anatomical"))


def test_a_method_without_an_estimate_needs_a_known_view(ridge: Path) -> None:
    experiment = compose(["experiment=zhang2007_fig6", f"plugins={ridge}"])
    assert experiment.sweep.methods == list(PUBLISHED)
    named = compose(["experiment=zhang2007_fig6", f"plugins={ridge}", "sweep.methods=[map,ridge]"])
    with rejects("needs_known_view", "sweep.methods", method="ridge"):
        named.validate()


@pytest.mark.parametrize(
    ("text", "rejection"),
    [
        ("import nothing_of_this_name\n", rejects("plugin_fails", "mine.py line 1")),
        ("x = 1\n\n\ny = (\n", rejects("plugin_fails", "mine.py line 4")),
        ("PLUGIN = 3\n", rejects("no_plugin", "mine.py")),
        (
            "from pipeline.plugins import Plugin\nPLUGIN = Plugin(methods=['map'])\n",
            rejects("wrong_type", "mine"),
        ),
    ],
)
def test_a_users_file_that_fails_is_one_sentence(
    text: str, rejection: AbstractContextManager, tmp_path: Path, no_files: None
) -> None:
    path = tmp_path / "mine.py"
    path.write_text(text, encoding="utf-8")
    with rejection as caught:
        compose(["experiment=zhang2007_fig5", f"plugins={path}"])
    assert len(str(caught.value).splitlines()) == 1


def test_a_users_file_that_ends_the_program_is_one_sentence(tmp_path: Path, no_files: None) -> None:
    path = tmp_path / "mine.py"
    path.write_text("raise SystemExit(3)\n", encoding="utf-8")
    with rejects("plugin_fails", "mine.py line 1"):
        plugins.load_files([path])


def test_two_users_files_of_one_name_are_an_error(ridge: Path, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    other = tmp_path / "other" / "ridge.py"
    other.write_text(RIDGE, encoding="utf-8")
    with rejects("not_distinct", "plugins"):
        plugins.load_files([ridge, other])


def test_a_users_file_that_does_not_exist_is_named() -> None:
    with rejects("not_a_file", "plugins") as rejection:
        compose(["experiment=zhang2007_fig5", "plugins=nowhere.py"])
    assert rejection.value.received == "nowhere.py"


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An installed plug-in that cannot be imported."""
    point = metadata.EntryPoint("broken", "nothing_of_this_name:PLUGIN", plugins.GROUP)
    real = plugins._entry_points()
    monkeypatch.setattr(plugins, "_entry_points", lambda: [*real, point])
    plugins._installed.cache_clear()
    yield
    plugins._installed.cache_clear()


def test_a_plug_in_that_fails_to_import_is_one_sentence(
    broken: None, say: Callable[..., CommandResult], tmp_path: Path
) -> None:
    """A plug-in that cannot be imported causes a remark, or an error in one sentence if its method is needed."""
    answer = say("equations", "zhang2004")
    assert answer.status == 0
    assert answer.err.startswith("the plug-in broken is ignored: it cannot be loaded (ModuleNotFoundError")
    figure = ("experiment=zhang2007_fig2", "scale=smoke", "figure.picture=false", f"results={tmp_path}")
    answer = say(*figure)
    assert (answer.status, len(answer.err.splitlines())) == (0, 1)
    with rejects("unknown_choice", "sweep.methods", value="knn") as rejection:
        compose(["experiment=zhang2007_fig5", "sweep.methods=[map,knn]"]).validate()
    assert "the plug-in broken could not be loaded" in str(rejection.value)


def installed(monkeypatch: pytest.MonkeyPatch, **added: object) -> None:
    """Add one more installed plug-in, defined in this module."""
    more = plugins.Loaded("more", plugins.Plugin(**added), __name__)  # type: ignore[arg-type]
    before = plugins._installed()
    monkeypatch.setattr(plugins, "_installed", lambda: ((*before[0], more), before[1]))


def stop(arguments: list[str]) -> int:
    return 3


def test_a_plug_in_takes_the_place_of_no_command(
    monkeypatch: pytest.MonkeyPatch, say: Callable[..., CommandResult]
) -> None:
    installed(monkeypatch, commands={"verify": f"{__name__}:stop"})
    answer = say("verify", "anything")
    words = "more: the plug-in adds a command 'verify', but another command has this name\n"
    assert (answer.status, answer.err) == (1, words)


def test_a_command_without_help_is_listed(
    monkeypatch: pytest.MonkeyPatch, say: Callable[..., CommandResult]
) -> None:
    installed(monkeypatch, commands={"halt": "tests.test_plugins:stop"})
    assert "python -m pipeline halt" in say("--help").out
    assert say("halt").status == 3


def test_a_file_of_any_name_is_followed_by_keys(tmp_path: Path, no_files: None) -> None:
    path, text = tmp_path / "my.own ridge.py", RIDGE.replace(", claims=[CLAIM]", "")
    path.write_text(text, encoding="utf-8")
    (tmp_path / "gains.py").write_text("GAIN = 1.0\n", encoding="utf-8")
    arguments = ["experiment=zhang2007_fig5", f"plugins={path}", "sweep.methods=[map,ridge]"]
    codes = [figure_code(compose(arguments))]
    path.write_text("from gains import GAIN\n" + text, encoding="utf-8")
    sys.modules["gains"] = ModuleType("gains")
    sys.modules["gains"].GAIN = 1.0  # type: ignore[attr-defined]
    try:
        codes.append(figure_code(compose(arguments)))
        (tmp_path / "gains.py").write_text("GAIN = 2.0\n", encoding="utf-8")
        source_code._module.cache_clear()
        codes.append(figure_code(compose(arguments)))
    finally:
        del sys.modules["gains"]
        source_code._module.cache_clear()
    assert len({*codes}) == 3


def test_a_method_made_by_partial_belongs_to_its_file(tmp_path: Path, no_files: None) -> None:
    path = tmp_path / "mine.py"
    text = RIDGE.replace("reconstruct)\nPLUGIN", "partial(reconstruct))\nPLUGIN")
    path.write_text("from functools import partial\n" + text, encoding="utf-8")
    plugins.load_files([path])
    assert "plugin_mine" in methods.modules(["ridge"])


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ('"purple"', '"violet"', "unknown_choice"),
        ("methods=[RIDGE]", "methods=RIDGE", "wrong_type"),
        ('"ridge", Style', '"map", Style', "duplicate_name"),
    ],
)
def test_a_slip_in_a_users_file_is_one_sentence(
    old: str, new: str, code: str, tmp_path: Path, no_files: None
) -> None:
    path = tmp_path / "ridge.py"
    assert old in RIDGE
    path.write_text(RIDGE.replace(old, new), encoding="utf-8")
    with rejects(code):
        compose(["experiment=zhang2007_fig5", f"plugins={path}"])


@pytest.mark.parametrize(
    "result", [[[1.0], [2.0, 3.0]], np.zeros((1, 2, 3)), None, np.full((1, 5, 15), np.nan)]
)
def test_a_result_of_another_form_is_one_sentence(result: object) -> None:
    from tests.walk3d.anatomy.study.test_method import inputs

    arguments = inputs()
    fold, walk = methods.held_out(arguments.dataset, arguments.model, 0, 70.0)
    method = methods.Method("mine", Style("mine", "purple"), lambda *_: result)  # type: ignore[arg-type, return-value]
    with rejects("wrong_result", "mine"):
        method.apply(fold, walk, np.zeros(1))


@pytest.mark.parametrize("used", [5, ["file"], [{"file": "x"}], [{"file": 3, "sha256": []}]])
def test_a_list_of_plug_ins_of_another_form_is_one_sentence(used: object, no_files: None) -> None:
    with pytest.raises(InvalidInput) as caught:
        provenance.require_plugins(used, "an archive")  # type: ignore[arg-type]
    assert caught.value.code in ("other_entries", "plugin_not_loaded")


def test_a_clone_loads_the_plug_ins_next_to_it() -> None:
    """In a clone, the plug-ins listed in pyproject.toml are loaded, not those of an installed version."""
    named = {point.name: point.value for point in plugins._entry_points()}
    assert named["walk3d"] == "walk3d.plugin:PLUGIN"
    assert plugins.source_of("walk3d.plugin") == ROOT / "walk3d" / "plugin.py"


def test_a_folder_of_presets_is_found(tmp_path: Path, no_files: None) -> None:
    (tmp_path / "conf" / "experiment").mkdir(parents=True)
    preset = (ROOT / "conf" / "experiment" / "zhang2007_fig5.yaml").read_text("utf-8")
    name = tmp_path / "conf" / "experiment" / "coarse_fig5.yaml"
    name.write_text(preset.replace("zhang2007_fig5", "coarse_fig5"), encoding="utf-8")
    path = tmp_path / "mine.py"
    path.write_text(
        "from pathlib import Path\nfrom pipeline.plugins import Plugin\n"
        "PLUGIN = Plugin(conf=Path(__file__).parent / 'conf')\n",
        encoding="utf-8",
    )
    experiment = compose([f"plugins={path}", "experiment=coarse_fig5"])
    assert experiment.name == "coarse_fig5"
    assert "coarse_fig5" in presets()


def test_claims_of_a_users_file_are_targets_apart_from_the_papers(ridge: Path) -> None:
    before = {key: len(paper.claims) for key, paper in papers.all_papers().items()}
    plugins.load_files([ridge])
    after = {key: len(paper.claims) for key, paper in papers.all_papers().items()}
    assert after == {**before, "ridge": 1}
