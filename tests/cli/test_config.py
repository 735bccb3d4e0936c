"""Tests of the options: every preset is valid with every choice of options, and typing errors name the full option."""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser
from hypothesis import given
from hypothesis import strategies as st

from pipeline import mappings, papers, plugins
from pipeline.cli.compose import compose
from pipeline.cli.errors import sentence
from pipeline.cli.main import destination
from pipeline.cli.overrides import quoted
from pipeline.cli.presets import presets
from pipeline.ingestion.data import FolderData
from pipeline.skeleton.mapped_joints import LOWER_BODY
from pipeline.studies import registry
from pipeline.studies.experiment import Experiment
from pipeline.studies.study import Figure
from tests.rejects import rejects, rejects_options

CONF = Path(__file__).resolve().parents[2] / "conf"
DEFAULTS = {"scale": "full", "data": "synthetic"}


@functools.cache
def composed(*overrides: str) -> Experiment:
    """Return an experiment that several tests share without changing it."""
    return compose(list(overrides))


def option_files(group: str) -> list[str]:
    """Return the names of the choices of an option group, from files and from the studies."""
    registered = registry.options(group) if group in registry.GROUPS else {}
    return sorted({path.stem for path in (CONF / group).glob("*.yaml")} | set(registered))


# --- presets ----------------------------------------------------------------------------------------------


def _check_types(value: Any, path: str = "config") -> None:
    """Assert that every dataclass field has a value of its annotated type."""
    hints = get_type_hints(type(value))
    for field in dataclasses.fields(value):
        fixed, hint = getattr(value, field.name), hints[field.name]
        where = f"{path}.{field.name}"
        if dataclasses.is_dataclass(fixed):
            assert isinstance(fixed, hint), where
            _check_types(fixed, where)
        elif hint in (int, float, str, bool):
            assert type(fixed) is hint, f"{where}: {fixed!r} is not {hint.__name__}"
        elif hint == list[str] or hint == list[float]:
            assert all(type(item) is hint.__args__[0] for item in fixed), where


@pytest.mark.parametrize(
    ("figure", "scale", "data"),
    [
        *((figure, scale, "synthetic") for figure in presets() for scale in option_files("scale")),
        ("zhang2007_fig5", "full", "cmu"),
        *(
            (figure, "smoke", data)
            for figure in ("zhang2007_fig5", "mozerov2006_tracking", "park2011_fig4")
            for data in option_files("data")
        ),
    ],
)
def test_every_preset_composes_at_every_scale_every_purpose_with_all_data(
    figure: str, scale: str, data: str
) -> None:
    chosen = {"scale": scale, "data": data}
    inputs = [f"{group}={name}" for group, name in chosen.items() if name != DEFAULTS[group]]
    config = composed(*inputs, f"experiment={figure}")
    assert type(config) is Experiment
    assert (config.name, config.scale.name, config.data.name) == (figure, scale, data)
    assert config.paper in papers.all_papers()
    assert config.title
    assert config.expect.endswith(".")
    _check_types(config)


def test_the_presets_are_the_papers_figures_and_those_that_go_beyond() -> None:
    figures = {figure for paper in papers.all_papers().values() for figure in paper.figures}
    beyond = {figure for paper in papers.all_papers().values() for figure in paper.beyond}
    assert set(presets()) == figures | beyond, "all four papers are whole"
    assert all("_fig" in figure for figure in figures)
    assert not any("_fig" in figure for figure in beyond)


@pytest.mark.parametrize("figure", presets())
def test_the_first_comment_of_a_preset_names_paper_and_figure(figure: str) -> None:
    path = plugins.conf_files("experiment")[figure]
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "# @package _global_"
    paper = papers.all_papers()[papers.read_mapping(path)["paper"]]
    number = re.search(r"_fig(\d+\w?)$", figure)
    assert str(paper.year) in lines[1]
    assert (f"figure {number[1]}:" if number else "ours:") in lines[1]
    family_name = re.match(r"[\w ]*?(\w+)(,|$| and)", paper.authors)
    assert family_name is not None
    assert family_name[1] in lines[1]


@pytest.mark.parametrize("figure", presets())
def test_a_preset_wears_the_scale(figure: str) -> None:
    """The option `scale=smoke` changes every size of a preset, such as the numbers of people and views."""
    small = composed("scale=smoke", f"experiment={figure}")
    assert small.data.walkers == small.scale.walkers > 0
    for field in fields(small.sweep):
        for part, size in field.metadata.get("scale", {}).items():
            value = getattr(small.sweep, field.name)
            value = value if part == "value" else getattr(value, part)
            if isinstance(size, Mapping):
                assert value == size["smoke"] != size["full"]
            else:
                assert value == (getattr(small.scale, size) if isinstance(size, str) else size)


def test_an_option_with_sizes_of_its_own_is_required_at_another_scale() -> None:
    other = ["experiment=zhang2007_structure", "scale.name=medium"]
    with rejects_options("no_size", "sweep.seen_from_deg.step", "scale=full|smoke", "medium"):
        compose(other)
    sweep = compose([*other, "sweep.seen_from_deg.step=9", "sweep.partners=4"]).sweep
    assert (sweep.seen_from_deg.step, sweep.partners) == (9, 4)


def test_the_full_scale_is_the_papers() -> None:
    config = compose(["experiment=zhang2007_fig3"])
    assert (config.data.population, round(config.data.population * config.data.male_share)) == (80, 32)
    assert config.data.walkers == 0
    np.testing.assert_array_equal(config.sweep.view_angle_deg.values("view"), np.arange(-90.0, 91.0))
    np.testing.assert_array_equal(config.sweep.sigma2_mm2.values("sigma2"), np.arange(1.0, 626.0))
    assert config.model.components == 30
    earlier = compose(["experiment=zhang2004_fig4"])
    assert earlier.model.components == 28
    assert earlier.dataset.frequency
    assert earlier.sweep.methods == ["least_squares"]


@pytest.mark.parametrize("name", option_files("skeleton"))
def test_every_skeleton_is_a_mapping(name: str) -> None:
    chosen = compose(["experiment=zhang2007_fig2", "data=folder", f"skeleton={name}"]).skeleton
    assert chosen.mapping == name
    mapping = mappings.chosen(name)
    assert mapping is not None
    assert mapping.name == name
    assert set(mapping.joints) | set(mapping.otherwise) >= set(LOWER_BODY)


def test_text_of_a_shell_needs_no_second_quotes() -> None:
    inputs = [
        "data.path=/daten/müller/it's [1]",
        "data.person=^(.{4})",
        "data.pattern=**/*.c3d",
        "skeleton=auto",
    ]
    experiment = compose(["experiment=zhang2007_fig2", "data=folder", *inputs])
    assert isinstance(experiment.data, FolderData)
    assert (experiment.data.path, experiment.data.person) == ("/daten/müller/it's [1]", "^(.{4})")
    assert (experiment.data.pattern, experiment.skeleton.mapping) == ("**/*.c3d", "auto")
    assert quoted(["data.pattern='**/*.c3d'"]) == ["data.pattern='**/*.c3d'"]


@given(st.text(st.characters(codec="utf-8", exclude_categories=("C",), exclude_characters="$"), max_size=12))
def test_any_path_arrives_as_it_was_typed(text: str) -> None:
    if text[:1] in ("'", '"'):  # already quoted
        return
    (item,) = quoted([f"data.path=/x{text}/y"])
    assert OverridesParser.create().parse_override(item).value() == f"/x{text}/y"


@pytest.mark.parametrize("group", ["data", "dataset", "model", "figure", "scale", "skeleton", "sweep"])
def test_every_option_says_what_it_is(group: str) -> None:
    for path in (CONF / group).glob("*.yaml"):
        assert path.read_text(encoding="utf-8").startswith("# "), path.name


# --- slips of the pen -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("override", "code", "where", "shown"),
    [
        ("model.component=3", "unknown_option", "model.component", "components"),
        ("+model.component=3", "unknown_option", "model.component", "components"),
        ("modell=eigenwalkers", "unknown_option", "modell", "model"),
        ("+sweep.view_angle_deg.stepp=3", "unknown_option", "sweep.view_angle_deg.stepp", "step"),
        ("sweep.sigma2.step=3", "unknown_option", "sweep.sigma2", "sigma2_mm2"),
        ("model.components=many", "invalid_value", "model.components", "'many'"),
        ("model.components=2.5", "invalid_value", "model.components", "'2.5'"),
        ("model.components=", "invalid_value", "model.components", "''"),
        ("model.mirror=perhaps", "invalid_value", "model.mirror", "'perhaps'"),
        ("sweep.noise_variance_mm2=some", "invalid_value", "sweep.noise_variance_mm2", "'some'"),
        ("sweep.view_angle_deg=5", "invalid_value", "sweep.view_angle_deg", "Grid"),
        ("sweep.methods=map", "invalid_value", "sweep.methods", "list"),
        ("seed=null", "invalid_value", "seed", "Optional"),
        ("seed=???", "missing_value", "seed", ""),
        ("sweep.view_angle_deg.start=???", "missing_value", "sweep.view_angle_deg.start", ""),
        ("model.components=10,20", "several_values", "", "model.components=10,20"),
        ("data.name=${nowhere}", "invalid_value", "data.name", "nowhere"),
        ("=3", "not_an_override", "", "'=3'"),
        ("model.components", "not_an_override", "", "model.components"),
        ("model.components=[1,", "not_an_override", "", "model.components=[1,"),
        ("~model", "missing_value", "model", ""),
    ],
)
def test_a_slip_of_the_pen_names_the_full_key(override: str, code: str, where: str, shown: str) -> None:
    with rejects_options(code, where, shown):
        compose(["experiment=zhang2007_fig5", override])


@pytest.mark.parametrize(
    "group", ["data", "dataset", "model", "figure", "scale", "skeleton", "sweep", "experiment"]
)
def test_an_unknown_option_of_a_group_lists_those_there_are(group: str) -> None:
    with rejects_options("unknown_option", group, "nothing_of_the_kind", *option_files(group)) as caught:
        compose(["experiment=zhang2007_fig5", f"{group}=nothing_of_the_kind"])
    assert "base_" not in sentence(caught.value)


def test_no_figure_is_a_refusal_that_lists_them() -> None:
    with rejects("no_experiment") as caught:
        compose(["scale=smoke"])
    assert all(figure in str(caught.value) for figure in presets())


def test_an_error_of_ours_keeps_its_traceback() -> None:
    assert sentence(KeyError("path_walker_mm2")) == ""
    assert sentence(TypeError("no option")) == ""
    assert sentence(MemoryError("40 GiB")) == "there is not enough memory: 40 GiB"
    assert sentence(PermissionError(13, "Permission denied", "folder")) == "folder: Permission denied"


# --- where a figure goes ----------------------------------------------------------------------------------


FOLDER = ["data=folder", "data.path=walks", "data.pattern='**/*.c3d'", "skeleton=plugin_gait"]


@pytest.mark.parametrize(
    ("overrides", "folder"),
    [
        ([], "results/synthetic/full/zhang2007_fig5"),
        (["scale=smoke"], "results/synthetic/smoke/zhang2007_fig5"),
        (["data=cmu"], "results/cmu/full/zhang2007_fig5"),
        (["data=optical", "scale=smoke", "workers=1"], "results/optical/smoke/zhang2007_fig5"),
        (["results=elsewhere"], "elsewhere/synthetic/full/zhang2007_fig5"),
        (["data=cmu", "data.mirror=shelf", "data.raw=raw"], "results/cmu/full/zhang2007_fig5"),
        (FOLDER, "results/folder_walks/full/zhang2007_fig5"),
        ([*FOLDER, "data.name=clinic"], "results/clinic/full/zhang2007_fig5"),
        ([*FOLDER, "data.steady.cycles=3"], "results/scratch/now/zhang2007_fig5"),
        (["skeleton=plugin_gait"], "results/scratch/now/zhang2007_fig5"),
        (["model.components=20"], "results/scratch/now/zhang2007_fig5"),
        (["scale=smoke", "scale.walkers=5"], "results/scratch/now/zhang2007_fig5"),
        (["figure.picture=false"], "results/scratch/now/zhang2007_fig5"),
        (["seed=1"], "results/scratch/now/zhang2007_fig5"),
        (["data.population=20"], "results/scratch/now/zhang2007_fig5"),
        (["model=eigenwalkers2004"], "results/scratch/now/zhang2007_fig5"),
    ],
)
def test_only_a_preset_as_it_stands_goes_to_its_own_folder(overrides: list[str], folder: str) -> None:
    config = compose(["experiment=zhang2007_fig5", *overrides])
    assert destination(config, ["experiment=zhang2007_fig5", *overrides], "now") == Path(folder)


def test_the_mirror_of_the_environment_does_not_make_a_scratch_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MOCAP_MIRROR", "shelf")
    config = compose(["experiment=zhang2007_fig5", "data=cmu"])
    assert config.data.mirror == "shelf"
    assert destination(config, ["data=cmu"], "now") == Path("results/cmu/full/zhang2007_fig5")


@pytest.mark.parametrize("name", presets())
def test_a_preset_puts_together_what_belongs_together(name: str) -> None:
    """Figure, sweep, model and dataset of a preset belong to the same study."""
    experiment = composed(f"experiment={name}")
    experiment.validate()
    assert isinstance(experiment.figure, Figure)
    assert isinstance(experiment.sweep, experiment.figure.sweep)


def test_an_option_without_a_value_of_its_own_has_no_file() -> None:
    """Every YAML file of options contains more than the schema that it extends."""
    empty = [
        str(path.relative_to(CONF))
        for path in sorted(CONF.rglob("*.yaml"))
        if all(
            not line.strip() or line.startswith(("#", "defaults:"))
            for line in path.read_text(encoding="utf-8").splitlines()
        )
    ]
    assert empty == []
