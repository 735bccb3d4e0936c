"""Tests of mapping files: each mistake is rejected in a sentence with its line, and no code in a file is run."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline import mappings
from pipeline.resources import CONF
from pipeline.skeleton.mapped_joints import LOWER_BODY
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from tests.rejects import rejects

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
    ("text", "code", "where", "values"),
    [
        (GOOD.replace("  head:", "\thead:"), "not_yaml", "line 6", {}),
        (GOOD.replace("H2: 0.5}", "H2: 0.5"), "not_yaml", "line 7", {}),
        (GOOD + "  head: {H1: 1}\n", "key_twice", "line 8", {"key": "head"}),
        (GOOD + "up: z\n", "key_twice", "line 8", {"key": "up"}),
        (GOOD.replace("H1: 0.5", "H1: half"), "not_number", "line 6", {}),
        (GOOD.replace("H1: 0.5", "H1: [1]"), "not_number", "line 6", {}),
        (GOOD.replace("H1: 0.5", "H1: 0.4"), "weights_off", "line 6", {"joint": "head", "total": 0.9}),
        (GOOD.replace("H1: 0.5", "H1: .nan"), "not_number", "line 6", {}),
        (GOOD.replace("up: y", "up: w"), "unknown_axis", "line 2", {}),
        (GOOD.replace("up: y", "upp: y"), "unknown_key", "line 2", {"key": "upp"}),
        (GOOD.replace("head:", "haed:"), "unknown_joint", "line 6", {"joint": "haed"}),
        (GOOD.replace("[left asis]", "left asis"), "not_list", "line 4", {}),
        ("defaults: [base_skeleton]\n" + GOOD, "unknown_key", "line 1", {"key": "defaults"}),
        ("# @package _global_\n" + GOOD, "package_line", "line 1", {}),
        (
            GOOD + "hydra:\n  callbacks: {a: {_target_: builtins.print}}\n",
            "unknown_key",
            "line 8",
            {"key": "hydra"},
        ),
        (GOOD + "_target_: builtins.print\n", "unknown_key", "line 8", {"key": "_target_"}),
        (GOOD.replace("up: y", "up: !!python/object/apply:os.system [x]"), "not_word", "line 2", {}),
        (GOOD.replace("up: y", "up: &a y"), "anchor", "line 2", {}),
        ("a: &a [1]\nb: *a\n", "anchor", "line 1", {}),
        ("[" * 5000, "nested_too_deeply", "line 1", {}),
        ("", "empty_file", "", {}),
        ("- a\n", "not_keys", "line 1", {}),
        ("up: z\n", "no_joints", "line 1", {}),
        (GOOD.encode().replace(b"left asis", "Hüfte".encode("latin-1")), "not_utf8", "line 4", {}),
        (GOOD + "lowered: {head: {by: 1}}\n", "unreadable_lowering", "line 8", {"joint": "head"}),
        (GOOD + "units: parsec\n", "unknown_unit", "line 8", {}),
    ],
)
def test_a_slip_is_one_sentence_with_its_line(
    text: str | bytes, code: str, where: str, values: dict[str, object], tmp_path: Path
) -> None:
    with rejects(code, where, **values) as caught:
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
    with rejects("unknown_option", "skeleton", value="my_lab"):
        mappings.chosen("my_lab")
    with rejects("unreadable"):
        mappings.chosen("nowhere/my_lab.yaml")
    with rejects("unreadable"):
        mappings.chosen("a\0.yaml")
