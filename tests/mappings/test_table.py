"""Mappings as data: the slips of whoever writes one, each refused in a sentence with its line; nothing is run."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline import mappings
from pipeline.resources import CONF
from pipeline.skeleton.mapped_joints import LOWER_BODY
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from pipeline.validation import InvalidInput

GOOD = """\
# my laboratory
up: y
points:
  LASI: [left asis]
joints:
  head: {H1: 0.5, H2: 0.5}
  left_hip: [{LHJC: 1}, {LASI: 0.7, RASI: 0.3}]
"""


def load(folder: Path, text: str | bytes) -> object:
    path = folder / "my_lab.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return mappings.load(path)


def test_a_mapping_of_ones_own(tmp_path: Path) -> None:
    mapping = load(tmp_path, GOOD)
    assert isinstance(mapping, SourceMapping)
    assert (mapping.name, mapping.up) == ("my_lab", UpAxis.y)
    assert mapping.rules("left_hip") == [({"LHJC": 1.0}, None), ({"LASI": 0.7, "RASI": 0.3}, None)]
    assert mappings.chosen(str(tmp_path / "my_lab.yaml")) == mapping


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD.replace("  head:", "\thead:"), r"line 6: this is not YAML: .*"),
        (GOOD.replace("H2: 0.5}", "H2: 0.5"), r"line \d: this is not YAML"),
        (GOOD + "  head: {H1: 1}\n", "line 8: the key 'head' stands twice in joints .*line 6"),
        (GOOD + "up: z\n", "line 8: the key 'up' stands twice"),
        (GOOD.replace("H1: 0.5", "H1: half"), "line 6: the weight of H1 must be a number .*'half'"),
        (GOOD.replace("H1: 0.5", "H1: [1]"), "line 6: the weight of H1 must be a number"),
        (GOOD.replace("H1: 0.5", "H1: 0.4"), "line 6: the weights of head must sum to one .*0.9"),
        (GOOD.replace("H1: 0.5", "H1: .nan"), "line 6: the weight of H1 must be a number"),
        (GOOD.replace("up: y", "up: w"), "line 2: up must be an axis"),
        (GOOD.replace("up: y", "upp: y"), "line 2: a mapping has no key 'upp'"),
        (GOOD.replace("head:", "haed:"), "line 6: there is no such joint .*'haed'"),
        (GOOD.replace("[left asis]", "left asis"), "line 4: the names of LASI must be a list"),
        ("defaults: [base_skeleton]\n" + GOOD, "line 1: .*no longer needed"),
        ("# @package _global_\n" + GOOD, "line 1: a mapping is data"),
        (
            GOOD + "hydra:\n  callbacks: {a: {_target_: builtins.print}}\n",
            "line 8: a mapping has no key 'hydra'",
        ),
        (GOOD + "_target_: builtins.print\n", "line 8: a mapping has no key '_target_'"),
        (GOOD.replace("up: y", "up: !!python/object/apply:os.system [x]"), "line 2: up must be a word"),
        (GOOD.replace("up: y", "up: &a y"), "line 2: anchors and aliases"),
        ("a: &a [1]\nb: *a\n", "line 1: anchors and aliases"),
        ("[" * 5000, "line 1: this is no mapping: it is nested too deeply"),
        ("", "the mapping is empty"),
        ("- a\n", "line 1: a mapping must be keys with values"),
        ("up: z\n", "line 1: the mapping gives no joint"),
        (GOOD.encode().replace(b"left asis", "Hüfte".encode("latin-1")), "line 4: the mapping is not UTF-8"),
        (GOOD + "lowered: {head: {by: 1}}\n", "line 8: the lowering of head needs by and between"),
        (GOOD + "units: parsec\n", "line 8: the unit is unknown"),
    ],
)
def test_a_slip_is_one_sentence_with_its_line(text: str | bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=words) as caught:
        load(tmp_path, text)
    assert str(caught.value).startswith("my_lab.yaml")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_what_ships_gives_legs_and_says_what_it_is() -> None:
    for name, mapping in mappings.shipped().items():
        assert mapping.name == name
        assert all(mapping.rules(joint) for joint in LOWER_BODY), name
        text = ((CONF / "skeleton") / f"{name}.yaml").read_text(encoding="utf-8")
        assert text.startswith("# ")


def test_a_mapping_that_does_not_exist_is_refused_with_those_that_do() -> None:
    with pytest.raises(
        InvalidInput, match=r"skeleton: there is no such option .*auto or .*plugin_gait.*received my_lab"
    ):
        mappings.chosen("my_lab")
    with pytest.raises(InvalidInput, match="the mapping cannot be read"):
        mappings.chosen("nowhere/my_lab.yaml")
    with pytest.raises(InvalidInput, match="the mapping cannot be read"):
        mappings.chosen("a\0.yaml")
