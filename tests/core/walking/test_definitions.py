"""Tests of the definitions of pelvis and sternum, which move only these two joints."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline import mappings
from pipeline.core import walking
from pipeline.core.walking.definitions import stature
from pipeline.skeleton import ANKLES, PELVIS, WALKER15
from pipeline.skeleton.source_mapping import Lowering, Rule, SourceMapping
from tests.rejects import rejects
from tests.strategies import angles, seeds

STERNUM, HEAD = WALKER15.index("sternum"), WALKER15.index("head")
HIPS = [WALKER15.index("left_hip"), WALKER15.index("right_hip")]
SHOULDERS = [WALKER15.index("left_shoulder"), WALKER15.index("right_shoulder")]

PELVES, STERNA = ("measured", "hips", "above"), ("measured", "below_shoulders")
definitions = st.fixed_dictionaries({"pelvis": st.sampled_from(PELVES), "sternum": st.sampled_from(STERNA)})


def standing() -> np.ndarray:
    """Return two frames of a standing person of 1500 mm from ankles to head, who leans forward in the second frame."""
    positions = np.zeros((2, 15, 3))
    heights = {"head": 1600.0, "sternum": 1380.0, "shoulder": 1330.0, "pelvis": 930.0, "hip": 900.0}
    for j, name in enumerate(WALKER15.joints):
        side = {"left": -1.0, "right": 1.0}.get(name.split("_")[0], 0.0)
        positions[:, j] = (100.0 * side, 10.0, heights.get(name.split("_")[-1], 100.0))
    positions[:, WALKER15.index("left_hip")] += (0.0, 30.0, 20.0)
    positions[1, SHOULDERS, 1] += 50.0
    return positions


def random_walker(seed: int) -> np.ndarray:
    """Return twenty frames of random joint positions, with the head above the ankles."""
    positions = 300.0 * np.random.default_rng(seed).standard_normal((20, 15, 3))
    positions[:, HEAD, 2] += 2000.0
    return positions


def test_definitions_worked_out_in_the_head() -> None:
    person = standing()
    assert walking.stature(person) == 1500.0
    between = walking.redefine(person, pelvis="hips")
    np.testing.assert_allclose(between[:, PELVIS], [[0.0, 25.0, 910.0]] * 2)
    above = walking.redefine(person, pelvis="above")
    np.testing.assert_allclose(above[:, PELVIS], [[0.0, 25.0, 1016.0]] * 2)
    below = walking.redefine(person, sternum="below_shoulders")
    np.testing.assert_allclose(below[:, STERNUM], [[0.0, 10.0, 1294.0], [0.0, 60.0, 1294.0]])


def test_as_measured_nothing_moves() -> None:
    person = standing()
    np.testing.assert_array_equal(walking.redefine(person), person)


@given(seed=seeds, by=definitions)
def test_only_the_pelvis_and_the_sternum_move(seed: int, by: dict[str, str]) -> None:
    person = random_walker(seed)
    as_measured = person.copy()
    moved = walking.redefine(person, **by)
    np.testing.assert_array_equal(person, as_measured)
    may_move = {"pelvis": PELVIS, "sternum": STERNUM}
    expected = {joint for name, joint in may_move.items() if by[name] != "measured"}
    assert set(np.flatnonzero((moved != person).any(axis=(0, 2)))) == expected


@given(seed=seeds, by=definitions, scale=st.floats(0.5, 2.0), turn=angles)
def test_size_heading_and_place_of_a_walker_make_no_difference(
    seed: int, by: dict[str, str], scale: float, turn: float
) -> None:
    person, shift = random_walker(seed), np.array([400.0, -300.0, 90.0])

    def elsewhere(positions: np.ndarray) -> np.ndarray:
        return walking.turn_about_vertical(scale * positions, turn) + shift

    of_other = walking.redefine(elsewhere(person), **by)
    np.testing.assert_allclose(of_other, elsewhere(walking.redefine(person, **by)), atol=1e-8)


@given(seed=seeds, by=definitions)
def test_a_redefined_walker_stays(seed: int, by: dict[str, str]) -> None:
    once = walking.redefine(random_walker(seed), **by)
    np.testing.assert_allclose(walking.redefine(once, **by), once, atol=1e-9)


@pytest.mark.parametrize(("where", "value"), [("pelvis", "sacrum"), ("sternum", "notch")])
def test_an_unknown_definition_is_rejected(where: str, value: str) -> None:
    with rejects("unknown_choice", where, value=value):
        walking.redefine(standing(), **{where: value})


# The definition that ships

OWN_PELVIS = {"walker15": {"pelvis": 1.0}, "plugin_gait": {"PELO": 1.0}}
"""Rules for the pelvis in mappings whose files contain a pelvis point of their own."""


def halved(left: tuple[Rule, Lowering | None], right: tuple[Rule, Lowering | None]) -> object:
    """Return the mapping rule for the midpoint of two joints, and the distance by which the midpoint is lowered."""
    points = {*left[0], *right[0]}
    rule = {p: round((left[0].get(p, 0.0) + right[0].get(p, 0.0)) / 2.0, 9) for p in points}
    return ({p: w for p, w in rule.items() if w}, left[1]) if left[1] == right[1] else None


@pytest.mark.parametrize("mapping", mappings.shipped().values(), ids=lambda mapping: mapping.name)
def test_every_mapping_that_ships_has_the_pelvis_midway_between_the_hips(mapping: SourceMapping) -> None:
    middles = [halved(*pair) for pair in product(mapping.rules("left_hip"), mapping.rules("right_hip"))]
    rules = [rule for rule in mapping.rules("pelvis") if rule[0] != OWN_PELVIS.get(mapping.name)]
    assert all(rule in middles for rule in rules)
    assert bool(rules) != (mapping.name == "walker15")


def test_stature_ends_at_the_lowest_two_per_cent_of_the_ankles() -> None:
    walk = np.full((101, 15, 3), np.nan)
    walk[:, WALKER15.index("head"), 2] = 1000.0
    walk[0, WALKER15.index("head"), 2] = np.nan
    walk[:, ANKLES, 2] = np.arange(101.0)[:, None]
    assert stature(walk) == pytest.approx(998.0)
