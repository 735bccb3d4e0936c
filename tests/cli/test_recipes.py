"""What `status` and `claims` know from the user's cache is what the sources, options and tables say now."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.cli import recipes as module
from pipeline.cli.compose import _rests_on, compose
from pipeline.cli.presets import presets
from pipeline.cli.recipes import recipe, recipes
from pipeline.resources import CONF, PACKAGE
from pipeline.storage import user_cache
from pipeline.validation import InvalidInput
from tests.processes import copy_tree, finished

FIGURE = ["experiment=zhang2007_fig2", "scale=smoke"]


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The figures whose recipes were made, in turn, with a cache of the test's own, which knows compositions alone."""
    composed = user_cache.place() / _rests_on()
    if composed.is_dir():
        copy_tree(composed, tmp_path / "cache" / composed.name, ".*")
    monkeypatch.setenv("GAIT_PIPELINE_CACHE", str(tmp_path / "cache"))
    names: list[str] = []

    def counted(experiment, **more):  # type: ignore[no-untyped-def]
        names.append(experiment.name)
        return recipe(experiment, **more)

    monkeypatch.setattr(module, "recipe", counted)
    return names


def test_a_kept_recipe_is_that_of_the_experiment(asked: list[str]) -> None:
    first, second = recipes([], ["scale=smoke"]), recipes([], ["scale=smoke"])
    assert sorted(asked) == presets()
    assert second == first == [recipe(compose(["scale=smoke", f"experiment={one.name}"])) for one in first]
    assert all(one.steps and not one.lacking for one in first)


def test_of_recordings_nothing_is_kept_that_may_change(asked: list[str], tmp_path: Path) -> None:
    nowhere = ["data=hdm05", f"data.raw={tmp_path}", "data.mirror="]
    for _ in range(2):
        without, lacking = recipes(["mozerov2006_fig3", "zhang2007_fig5"], nowhere)
        assert (without.steps, without.lacking) == (None, "")
        assert "holds no walks" in lacking.lacking
    assert len(asked) == 2
    for _ in range(2):
        with pytest.raises(InvalidInput, match="none of the 32 recordings"):
            recipes(["mozerov2006_fig3"], nowhere, steps=True)
    assert len(asked) == 2 + 3
    with pytest.raises(InvalidInput, match="holds no walks"):
        recipes(["zhang2007_fig5"], nowhere, steps=True)


def test_a_folder_is_named_as_it_is_called_now(asked: list[str], tmp_path: Path) -> None:
    link, names = tmp_path / "walks", []
    for name in ("mine", "yours"):
        (tmp_path / name).mkdir()
        link.unlink(missing_ok=True)
        link.symlink_to(tmp_path / name)
        names += [one.data for one in recipes(["zhang2007_fig5"], ["data=folder", f"data.path={link}"])]
    assert names == ["folder_mine", "folder_yours"]


def test_recipes_of_other_sources_and_damaged_ones_are_made_anew(
    asked: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = recipes(["zhang2007_fig2"], [])
    (kept,) = [path for path in (tmp_path / "cache").rglob("*.json") if b'"lacking"' in path.read_bytes()]
    whole = kept.read_bytes()
    for damaged in (b"", whole[:-1], whole.replace(b"model", b"muddle", 1)):
        kept.write_bytes(damaged)
        assert recipes(["zhang2007_fig2"], []) == first
        assert kept.read_bytes() != damaged
    assert len(asked) == 4
    for digest in ("edition", "_digest"):
        monkeypatch.setattr(user_cache, digest, lambda: "0" * 32)
    recipes(["zhang2007_fig2"], [])
    assert len(asked) == 5


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources with few presets, the figure of one made and known to `status`, and a cache of its own."""
    folder = tmp_path_factory.mktemp("copy")
    for source in (PACKAGE, CONF, PACKAGE.parent / "data"):
        copy_tree(source, folder / source.name, "raw")
    for preset in (folder / "conf" / "experiment").iterdir():
        if not preset.name.startswith("zhang2007_fig"):
            preset.unlink()
    shutil.copy(PACKAGE.parent / "pyproject.toml", folder)
    done = run(folder, "figures", *FIGURE)
    assert done.returncode == 0, done.stderr
    assert "1 current" in run(folder, "status", *FIGURE).stdout
    return folder


def run(folder: Path, *arguments: str):  # type: ignore[no-untyped-def]
    """Run a command in a copy; what it says ends in the heavy libraries that it loaded."""
    code = (
        "import sys\nfrom pipeline.cli.main import main\nstatus = main(sys.argv[1:])\n"
        "print(sorted({'hydra', 'pandas', 'scipy', 'matplotlib', 'rerun', 'yaml'} & set(sys.modules)))\n"
        "sys.exit(status)\n"
    )
    cache = {"GAIT_PIPELINE_CACHE": str(folder / "user_cache")}
    return finished([sys.executable, "-c", code, *arguments], cwd=folder, environment=cache)


@pytest.mark.thorough
def test_where_nothing_changed_status_and_claims_load_no_library(copied: Path) -> None:
    for command in (["status", *FIGURE], ["claims", "scale=smoke"]):
        first, second = run(copied, *command), run(copied, *command)
        assert second.stdout.splitlines()[-1] == "[]"
        assert second.stdout.splitlines()[:-1] == first.stdout.splitlines()[:-1]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("file", "edit", "told"),
    [
        ("pipeline/core/linear_model.py", "\nUNUSED = 1\n", "code changed"),
        ("pipeline/studies/walks/figures/spectrum.py", "\nUNUSED = 1\n", "figure: code changed"),
        ("conf/experiment/zhang2007_fig2.yaml", "\nseed: 3\n", "seed changed 2007 -> 3"),
        ("results/synthetic/smoke/zhang2007_fig2/table.csv", "x", "table.csv has"),
    ],
)
def test_status_sees_every_edit_and_that_it_was_taken_back(
    copied: Path, file: str, edit: str, told: str
) -> None:
    path = copied / file
    whole = path.read_text(encoding="utf-8")
    try:
        path.write_text(whole + edit, encoding="utf-8")
        assert told in run(copied, "status", *FIGURE).stdout
    finally:
        path.write_text(whole, encoding="utf-8")
    assert "1 current" in run(copied, "status", *FIGURE).stdout


@pytest.mark.thorough
def test_claims_see_edited_claims(copied: Path) -> None:
    said = run(copied, "claims", "scale=smoke").stdout
    paper = copied / "conf" / "paper" / "zhang2007.yaml"
    whole = paper.read_bytes()
    paper.write_bytes(whole.replace(b"published: 70", b"published: 71"))
    assert whole != paper.read_bytes()
    assert run(copied, "claims", "scale=smoke").stdout.splitlines()[:-1] != said.splitlines()[:-1]
    paper.write_bytes(whole)
    assert run(copied, "claims", "scale=smoke").stdout.splitlines()[:-1] == said.splitlines()[:-1]


@pytest.mark.thorough
def test_claims_see_edited_tables_and_a_ledger_that_is_gone(copied: Path, say: Callable) -> None:
    folder = copied / "results" / "synthetic" / "smoke"
    claims = ("claims", "scale=smoke", f"results={copied / 'results'}")
    said = say(*claims).out
    written = (folder / "claims.csv").read_bytes()
    (folder / "claims.csv").unlink()
    assert say(*claims).out == said
    assert (folder / "claims.csv").read_bytes() == written
    (folder / "claims.csv").write_bytes(written[:-200])
    say(*claims)
    assert (folder / "claims.csv").read_bytes() == written
    table = folder / "zhang2007_fig2" / "table.csv"
    whole = table.read_bytes()
    table.write_bytes(whole.replace(b"1", b"2", 1))
    assert "the table was changed after it was published" in say(*claims).err
    table.write_bytes(whole)
    assert say(*claims).out == said
