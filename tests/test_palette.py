"""Tests that the palette's colours can be distinguished, and that plotting libraries are loaded only for drawing."""

import subprocess
import sys
from importlib import import_module
from itertools import combinations

import numpy as np
import pytest

from pipeline.palette import COLOURS, CYCLE, ON_DARK, ROLES, rgb_colour


def luminance(colour: tuple[int, int, int]) -> float:
    """Return the relative luminance of a colour, 0 to 1, by the Web Content Accessibility Guidelines."""
    v = np.array(colour) / 255
    linear = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_roles_and_replacements_are_colours() -> None:
    assert {*ROLES.values(), *CYCLE, *ON_DARK, *ON_DARK.values()} <= set(COLOURS)
    assert not set(ROLES) & set(COLOURS), "a name is a colour or a role"


def test_no_two_colours_look_alike() -> None:
    for first, other in combinations(COLOURS, 2):
        assert np.abs(np.subtract(rgb_colour(first), rgb_colour(other))).max() > 60, (first, other)


@pytest.mark.parametrize("name", [*CYCLE, *ROLES])
def test_every_colour_of_a_series_stands_out_from_the_ground(name: str) -> None:
    on_white, on_dark = rgb_colour(name), rgb_colour(name, dark_ground=True)
    assert 1.05 / (luminance(on_white) + 0.05) > 1.9
    assert (luminance(on_dark) + 0.05) / (luminance((24, 26, 31)) + 0.05) > 3


def test_every_public_name_of_recordings_is_there() -> None:
    module = import_module("pipeline.recordings")
    for name in module.__all__:
        assert getattr(module, name).__name__ == name
    with pytest.raises(AttributeError, match="nothing_such"):
        _ = module.nothing_such


def test_what_is_slow_to_import_waits_until_something_is_drawn() -> None:
    names = "pipeline.recordings, pipeline.report.document, pipeline.report.variants, pipeline.stages.figure"
    code = f"import sys, {names}; print({{'matplotlib', 'rerun'}} & set(sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "set()"
