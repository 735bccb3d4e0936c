"""Tests of the parts of a study: grids, sizes by scale, options that fit together, and unique names."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import MISSING, fields, is_dataclass, replace
from functools import cache
from itertools import chain
from typing import Any, ClassVar, get_type_hints

import numpy as np
import pytest

from pipeline.cli.compose import compose, reason_without_clips
from pipeline.clips.kinds import Corpus
from pipeline.storage.typed import result_type
from pipeline.studies import registry
from pipeline.studies.experiment import Experiment, Scale
from pipeline.studies.study import Grid, NoResult, NoSweep, SweepInputs
from pipeline.studies.walks.figures.noise_variance import NoiseVariance
from pipeline.studies.walks.figures.view_errors import ViewErrors
from pipeline.studies.walks.known_view import KnownView
from pipeline.validation import InvalidInput
from tests.rejects import rejects

OPTIONS = [
    pytest.param(group, option, id=f"{group}={word}")
    for group in registry.GROUPS
    for word, option in registry.options(group).items()
]


# --- grids ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "stop", "step", "values"),
    [
        (-90, 90, 45, [-90, -45, 0, 45, 90]),
        (0, 1, 0.1, [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]),
        (0, 0.3, 0.1, [0, 0.1, 0.2, 0.3]),  # 0.3 / 0.1 is a little less than 3
        (1, 6, 2, [1, 3, 5]),  # whole steps do not reach 6
        (0, 1, 5, [0]),
    ],
)
def test_a_grid_includes_both_ends(start: float, stop: float, step: float, values: list[float]) -> None:
    np.testing.assert_allclose(Grid(start=start, stop=stop, step=step).values("grid"), values, atol=1e-12)


@pytest.mark.parametrize(
    ("start", "stop", "step", "rejection"),
    [
        (0, 0, 1, rejects("out_of_range", "sweep.view.stop", value=0)),
        (1, 0, 1, rejects("out_of_range", "sweep.view.stop", value=0)),
        (0, 1, 0, rejects("out_of_range", "sweep.view.step", value=0)),
        (0, 1, -1, rejects("out_of_range", "sweep.view.step", value=-1)),
        (0, float("inf"), 1, rejects("out_of_range", "sweep.view.stop")),
        (float("nan"), 1, 1, rejects("out_of_range", "sweep.view.start")),
        (0, 1, float("nan"), rejects("out_of_range", "sweep.view.step")),
        (0, 1, 1e-9, rejects("out_of_range", "the number of values of sweep.view", value=1000000000.0)),
    ],
)
def test_a_grid_without_values_is_refused(
    start: float, stop: float, step: float, rejection: AbstractContextManager
) -> None:
    with rejection:
        Grid(start=start, stop=stop, step=step).values("sweep.view")


# --- sizes that the scale sets ----------------------------------------------------------------------------


@pytest.mark.parametrize(("group", "option"), OPTIONS)
def test_the_sizes_that_the_scale_sets_are_fields_of_the_scale(group: str, option: type[Any]) -> None:
    sizes = {field.name for field in fields(Scale)}
    hints = get_type_hints(option)
    for field in fields(option):
        if set_by := field.metadata.get("scale"):
            assert {name for name in set_by.values() if isinstance(name, str)} <= sizes, field.name
            reference = [{*size} for size in set_by.values() if isinstance(size, Mapping)]
            assert all(scales == {"full", "smoke"} for scales in reference), field.name
            assert set(set_by) == ({"start", "stop", "step"} if hints[field.name] is Grid else {"value"})
            assert field.default is MISSING, f"{field.name} has a value of its own"


def test_a_size_follows_the_scale_unless_it_is_given() -> None:
    def sweep(*overrides: str, name: str = "zhang2007_fig5") -> Any:
        return compose([f"experiment={name}", *overrides]).sweep

    coarse = ["scale.view_step_deg=30", "scale.trials=7"]
    assert sweep(*coarse).view_angle_deg == Grid(start=-90, stop=90, step=30)
    assert sweep(*coarse, "sweep.view_angle_deg.step=10").view_angle_deg == Grid(start=-90, stop=90, step=10)
    assert sweep(*coarse, "sweep.view_angle_deg.start=0").view_angle_deg == Grid(start=0, stop=90, step=30)
    assert sweep(*coarse, name="park2011_fig3b").trials == 7
    assert sweep(*coarse, "sweep.trials=2", name="park2011_fig3b").trials == 2


# --- recordings that count --------------------------------------------------------------------------------


def known_view(start: float = -90, step: float = 45) -> KnownView:
    return KnownView(
        view_angle_deg=Grid(start=start, stop=90, step=step),
        sigma2_mm2=Grid(start=0.5, stop=625, step=100),
    )


def test_a_recording_counts_in_whole_numbers() -> None:
    displayed = ViewErrors()
    displayed.check_sequence(known_view())
    for start, step in ((-90, 7.5), (-89.5, 1)):
        sweep = known_view(start, step)
        with rejects("not_whole", "sweep.view_angle_deg", start=start, step=step):
            displayed.check_sequence(sweep)
        ViewErrors(recording=False).check_sequence(sweep)
    with rejects("not_whole", "sweep.sigma2_mm2", start=0.5):
        NoiseVariance().check_sequence(known_view())
    displayed.check_sequence(NoSweep())


# --- experiments ------------------------------------------------------------------------------------------


@cache
def preset(name: str) -> Experiment:
    """Return a preset at smoke scale."""
    return compose(["scale=smoke", f"experiment={name}"])


ACTION, LIMBS = "mozerov2006_tracking", "park2011_fig3b"


@pytest.mark.parametrize(
    ("group", "other", "rejection"),
    [
        ("model", ACTION, rejects("cannot_combine", "model", wanted="EigenwalkersModel")),
        ("sweep", LIMBS, rejects("cannot_combine", "sweep", wanted="KnownView")),
        ("sweep", "zhang2007_fig6", rejects("cannot_combine", "sweep", option="UnknownView")),
        ("sweep", "zhang2007_fig2", rejects("cannot_combine", "sweep", option="NoSweep")),
        ("dataset", ACTION, rejects("cannot_combine", "dataset", wanted="FourierDataset")),
        ("figure", LIMBS, rejects("cannot_combine", "model", option="EigenwalkersModel")),
    ],
)
def test_options_of_different_studies_are_not_mixed(
    group: str, other: str, rejection: AbstractContextManager
) -> None:
    mine = preset("zhang2007_fig5")
    mine.validate()
    with rejection:
        replace(mine, **{group: getattr(preset(other), group)}).validate()


@pytest.mark.parametrize(
    ("name", "override", "rejection"),
    [
        ("zhang2007_fig5", "workers=0", rejects("out_of_range", "workers", value=0)),
        ("zhang2007_fig5", "data.walkers=-1", rejects("out_of_range", "data.walkers", value=-1)),
        ("zhang2007_fig5", "dataset.harmonics=0", rejects("out_of_range", "dataset.harmonics", value=0)),
        ("zhang2007_fig5", "model.components=0", rejects("out_of_range", "model.components", value=0)),
        (
            "zhang2007_fig5",
            "sweep.noise_variance_mm2=0",
            rejects("out_of_range", "sweep.noise_variance_mm2", value=0.0),
        ),
        ("zhang2007_fig4", "figure.walker=-1", rejects("out_of_range", "figure.walker", value=-1)),
        ("zhang2007_fig5", "sweep.view_angle_deg.step=7.5", rejects("not_whole", "sweep.view_angle_deg")),
        (LIMBS, "sweep.trials=0", rejects("out_of_range", "sweep.trials", value=0)),
    ],
)
def test_options_of_every_group_are_validated(
    name: str, override: str, rejection: AbstractContextManager
) -> None:
    with rejection:
        compose([f"experiment={name}", override]).validate()


@pytest.mark.parametrize(
    ("code", "where", "lacks"),
    [
        ("no_clips_of_this_kind", "data", True),
        ("truth_not_known", "data", True),
        ("no_clips_of_this_kind", "elsewhere", True),
        ("unknown_choice", "data", False),
    ],
)
def test_the_code_says_that_a_data_set_has_no_clips(
    monkeypatch: pytest.MonkeyPatch, code: str, where: str, *, lacks: bool
) -> None:
    def validate(self: Experiment) -> None:
        raise InvalidInput("cannot be used", where, code=code)

    monkeypatch.setattr(Experiment, "validate", validate)
    assert bool(reason_without_clips(preset("zhang2007_fig5"))) is lacks


def test_a_data_set_without_clips_of_a_kind_is_rejected_by_code() -> None:
    with rejects("no_clips_of_this_kind", "data"):
        compose(["experiment=zhang2007_fig5", "data=hdm05"]).validate()


# --- the registry -----------------------------------------------------------------------------------------


def test_lists_of_a_class_are_no_options_and_a_default_without_a_type_is_refused() -> None:
    class Own(Grid):
        colours = ["red"]
        words: ClassVar[list[str]] = ["views"]

    assert (Own(start=0.0, stop=1.0, step=1.0).words, Own.colours) == (["views"], ["red"])
    with pytest.raises(TypeError, match=r"Wrong.stop needs a type"):

        class Wrong(Grid):
            stop = 3.0


@pytest.mark.parametrize("group", registry.GROUPS)
def test_a_word_chooses_one_option_of_one_study(group: str) -> None:
    words = list(chain.from_iterable(getattr(study, f"{group}s") for study in registry.studies()))
    assert len(set(words)) == len(words)
    result = registry.options(group)
    assert set(result) - {"none"} == set(words)
    assert len(set(result.values())) == len(result), "one word for each option"


def test_a_study_is_called_like_its_folder() -> None:
    for study in registry.STUDIES:
        options = chain.from_iterable(getattr(study, f"{group}s").values() for group in registry.GROUPS)
        modules = {option.__module__ for option in options}
        reference = {module for module in modules if module.startswith(f"pipeline.studies.{study.name}.")}
        assert reference
        others = {module.split(".")[2] for module in modules - reference}
        assert not others & {first.name for first in registry.STUDIES}, (
            "what several studies stand on is of none of them"
        )


@pytest.mark.parametrize(("group", "option"), OPTIONS)
def test_an_option_says_what_it_returns_and_what_it_is_made_of(group: str, option: type[Any]) -> None:
    """Each option class declares the type of its result, which the cache reads; a figure declares its model."""
    finite = {name: set(registry.options(name).values()) for name in registry.GROUPS}
    if group == "figure":
        assert option.model in finite["model"]
        sequence = option.traits.sequence
        assert not sequence or sequence in {field.name for field in fields(option.sweep)}
        return
    returned = result_type(getattr(option, {"dataset": "build", "model": "learn", "sweep": "measure"}[group]))
    assert is_dataclass(returned)
    assert returned.__dataclass_params__.frozen
    names = {field.name for field in fields(returned)}
    if group == "dataset":
        assert isinstance(option.corpus, Corpus)
        assert {"clip", "source", "words"} <= names
    if group == "model":
        assert option.dataset in finite["dataset"]
        assert "words" in names


def test_without_a_sweep_nothing_is_measured() -> None:
    inputs = SweepInputs(None, None, None, None, workers=1, seed=1)
    assert NoSweep().measure(inputs) == NoResult()
    assert type(preset("zhang2007_fig2").sweep) is NoSweep


def test_a_sweep_draws_the_same_numbers_for_one_seed_and_purpose_alone() -> None:
    single, other = (SweepInputs(None, None, None, None, workers=1, seed=seed) for seed in (1, 2))
    first = single.generator().random(3)
    np.testing.assert_array_equal(single.generator().random(3), first)
    for generator in (other.generator(), single.generator("a part")):
        assert not np.isin(generator.random(3), first).any()
