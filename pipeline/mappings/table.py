"""Mappings as YAML files: read as data, of which nothing is ever run, a slip being one sentence with its line.

In a proposal every guess is marked, and points that are not used are listed.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any

import yaml

from pipeline import plugins
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MILLIMETRES, MotionCapture
from pipeline.skeleton.source_mapping import Lowering, Rule, SourceMapping, UpAxis
from pipeline.validation import InvalidInput

AUTO = "auto"
"""The choice by which each recording gets the mapping that fits it best."""

LARGEST_FILE = 1_000_000
"""Bytes of a mapping; larger files are not mappings."""

_DEEPEST = 10
"""Levels of a mapping; what is nested deeper is none, and takes a time that grows with the square of the depth."""

_KEYS = ("name", "up", "units", "recognised_by", "points", "joints", "otherwise", "lowered", "guessed")


def _names() -> list[str]:
    return list(plugins.conf_files("skeleton"))


@functools.cache
def _shipped(name: str) -> SourceMapping:
    return load(plugins.conf_files("skeleton")[name])


def shipped() -> dict[str, SourceMapping]:
    """Return the mappings that ship, by name."""
    return {name: _shipped(name) for name in _names()}


def chosen(name: str) -> SourceMapping | None:
    """Return the mapping that an option names: one that ships, or a YAML file; None for ``auto``.

    Raises
    ------
    InvalidInput
        If there is no such mapping, or the file holds none.
    """
    if name == AUTO:
        return None
    if name in _names():
        return _shipped(name)
    if "/" in name or "\\" in name or name.lower().endswith((".yaml", ".yml")):
        return load(Path(name))
    listed = " or ".join([AUTO, *_names()])
    raise InvalidInput(
        "there is no such option",
        "skeleton",
        f"{listed} or a path.yaml",
        name[:60],
        code="unknown_option",
        typed=True,
        value=name,
    )


def load(path: Path) -> SourceMapping:
    """Read a mapping from a YAML file.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InvalidInput
        If the file cannot be read, is not YAML, or holds anything but a mapping of points to joints; the sentence
        names the line.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InvalidInput(
            "the mapping cannot be read",
            path,
            received=error.strerror or type(error).__name__,
            code="unreadable",
        ) from None
    except ValueError:
        raise InvalidInput("the mapping cannot be read", repr(str(path)), code="unreadable") from None
    if len(data) > LARGEST_FILE:
        raise InvalidInput(
            "this is no mapping", path.name, f"{LARGEST_FILE} bytes at most", code="file_too_large"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InvalidInput(
            "the mapping is not UTF-8 (save it as UTF-8)",
            f"{path.name}, line {line}",
            received=f"byte {data[error.start]:#x}",
            code="not_utf8",
            line=line,
        ) from None
    return _mapping(_composed(text, path.name), path.stem)


def _composed(text: str, where: str) -> yaml.Node:
    """The tree of a YAML text, without tags that would build anything and without anchors."""

    class Loader(yaml.SafeLoader):
        """Puts the file's name beside the line of everything."""

        def __init__(self, stream: str) -> None:
            super().__init__(stream)
            self.name = where

    if "# @package" in text:
        line = text[: text.index("# @package")].count("\n") + 1
        raise InvalidInput(
            "a mapping is data and goes into no package of options",
            f"{where}, line {line}",
            code="package_line",
        )
    depth = 0
    try:
        for event in yaml.parse(text, Loader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _DEEPEST:
                raise _wrong("this is no mapping: it is nested too deeply", event, code="nested_too_deeply")
            if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
                raise _wrong("anchors and aliases are not used in mappings", event, code="anchor")
        node = yaml.compose(text, Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        at = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "it cannot be read"
        if "'\\t'" in str(problem):
            problem = "a tab where blanks must be"
        raise InvalidInput(
            f"this is not YAML: {' '.join(str(problem).split())[:120]}", f"{where}{at}", code="not_yaml"
        ) from None
    if node is None:
        raise InvalidInput("the mapping is empty", where, code="empty_file")
    return node


def _wrong(
    what: str, at: Any, expected: str = "", received: str = "", *, code: str, **values: Any
) -> InvalidInput:
    """The refusal of a node or an event, with its line."""
    mark = at.start_mark
    return InvalidInput(what, f"{mark.name}, line {mark.line + 1}", expected, received, code=code, **values)


def _items(node: yaml.Node, what: str) -> list[tuple[str, yaml.Node, yaml.Node]]:
    """Keys and values of a node, each key once."""
    if not isinstance(node, yaml.MappingNode):
        raise _wrong(f"{what} must be keys with values", node, "key: value", code="not_keys")
    items: dict[str, tuple[yaml.Node, yaml.Node]] = {}
    for key_node, value in node.value:
        key = _text(key_node, f"a key of {what}")
        if key in items:
            first = items[key][0].start_mark.line + 1
            raise _wrong(
                f"the key {key!r} stands twice in {what}",
                key_node,
                f"once, as in line {first}",
                code="key_twice",
                key=key,
            )
        items[key] = (key_node, value)
    return [(key, key_node, value) for key, (key_node, value) in items.items()]


def _text(node: yaml.Node, what: str) -> str:
    standard = node.tag.startswith("tag:yaml.org,2002:") and node.tag.rpartition(":")[2] in (
        "str", "int", "float", "bool", "null", "timestamp",
    )  # fmt: skip
    if not isinstance(node, yaml.ScalarNode) or not standard or not node.value:
        raise _wrong(f"{what} must be a word", node, received=_shown(node), code="not_word")
    return str(node.value)


def _number(node: yaml.Node, what: str) -> float:
    try:
        value = float(_text(node, what))
    except ValueError:
        value = math.nan
    if not abs(value) <= 1e6:
        raise _wrong(f"{what} must be a number", node, received=_shown(node), code="not_number")
    return value


def _texts(node: yaml.Node, what: str) -> list[str]:
    if not isinstance(node, yaml.SequenceNode):
        raise _wrong(f"{what} must be a list", node, "[A, B]", _shown(node), code="not_list")
    return [_text(item, f"an item of {what}") for item in node.value]


def _rule(node: yaml.Node, joint: str) -> Rule:
    what = f"the rule of {joint}"
    rule = {point: _number(value, f"the weight of {point}") for point, _, value in _items(node, what)}
    if abs(sum(rule.values()) - 1.0) > 1e-6:
        raise _wrong(
            f"the weights of {joint} must sum to one",
            node,
            received=f"{sum(rule.values()):g}",
            code="weights_off",
            joint=joint,
            total=sum(rule.values()),
        )
    return rule


def _rules(node: yaml.Node, group: str) -> dict[str, Rule | list[Rule]]:
    return {
        _joint(joint, key): [_rule(item, joint) for item in value.value]
        if isinstance(value, yaml.SequenceNode)
        else _rule(value, joint)
        for joint, key, value in _items(node, group)
    }


def _joint(joint: str, node: yaml.Node) -> str:
    if joint not in WALKER15.joints:
        raise _wrong(
            "there is no such joint",
            node,
            ", ".join(WALKER15.joints),
            f"{joint!r:.60}",
            code="unknown_joint",
            joint=joint,
        )
    return joint


def _lowering(node: yaml.Node, joint: str) -> Lowering:
    items = {key: value for key, _, value in _items(node, f"the lowering of {joint}")}
    if set(items) != {"by", "between"}:
        raise _wrong(
            f"the lowering of {joint} needs by and between",
            node,
            "{by: 0.1, between: [A, B]}",
            code="unreadable_lowering",
            joint=joint,
        )
    between = _texts(items["between"], "between")
    if len(between) != 2:
        raise _wrong(
            "between must name two points",
            items["between"],
            received=str(len(between)),
            code="not_two_points",
            count=len(between),
        )
    return Lowering(by=_number(items["by"], "by"), between=between)


def _mapping(root: yaml.Node, stem: str) -> SourceMapping:
    """The mapping of a whole file; its name is the file's if it states none."""
    found: dict[str, Any] = {"name": stem}
    for key, node, value in _items(root, "a mapping"):
        if key not in _KEYS:
            hint = " (no longer needed: delete the line)" if key == "defaults" else ""
            raise _wrong(
                f"a mapping has no key {key!r:.60}{hint}",
                node,
                "one of " + ", ".join(_KEYS),
                code="unknown_key",
                key=key,
            )
        if key == "up":
            axis = {"true": "y", "True": "y", "TRUE": "y"}.get(_text(value, key), value.value)
            if axis not in list(UpAxis):
                raise _wrong(
                    "up must be an axis", value, ", ".join(UpAxis), _shown(value), code="unknown_axis"
                )
            found[key] = UpAxis(axis)
        elif key in ("name", "units"):
            found[key] = _text(value, key)
            if key == "units" and found[key].partition("/")[0] not in MILLIMETRES:
                raise _wrong(
                    "the unit is unknown", value, ", ".join(MILLIMETRES), _shown(value), code="unknown_unit"
                )
        elif key in ("recognised_by", "guessed"):
            found[key] = _texts(value, key)
        elif key == "points":
            found[key] = {
                point: _texts(names, f"the names of {point}") for point, _, names in _items(value, key)
            }
        elif key == "lowered":
            found[key] = {
                _joint(joint, at): _lowering(lowering, joint) for joint, at, lowering in _items(value, key)
            }
        else:
            found[key] = _rules(value, key)
    if not found.get("joints") and not found.get("otherwise"):
        raise _wrong(
            "the mapping gives no joint", root, "joints: {head: {LFHD: 0.5, RFHD: 0.5}, …}", code="no_joints"
        )
    return SourceMapping(**found)


def _shown(node: yaml.Node) -> str:
    return repr(node.value)[:60] if isinstance(node, yaml.ScalarNode) else type(node).__name__[:-4].lower()


def written(mapping: SourceMapping, motion: MotionCapture) -> str:
    """Return a mapping as YAML that `pipeline.mappings.load` reads; guesses are marked, unused points listed."""
    lines = [
        "# Proposed from names, sides and places of the points of one recording.  Check every line that is marked as",
        "# guessed; weights of a joint sum to one, e.g. {lateral: 0.5, medial: 0.5}.",
        f"name: {_quoted(mapping.name)}",
        f"up: {mapping.up}  # guessed: the axis along which the points spread most",
    ]
    used = set()
    for section, rules in (("joints", mapping.joints), ("otherwise", mapping.otherwise)):
        lines += [f"{section}:"] if rules else []
        for joint in (joint for joint in WALKER15.joints if joint in rules):
            rule = next(rule for rule, _ in mapping.rules(joint))
            used |= {*rule}
            inner = ", ".join(f"{_quoted(point)}: {weight:g}" for point, weight in rule.items())
            lines.append(f"  {joint}: {{{inner}}}" + ("  # guessed" if joint in mapping.guessed else ""))
    lines += ["lowered:"] if mapping.lowered else []
    for joint, lowering in mapping.lowered.items():
        between = ", ".join(map(_quoted, lowering.between))
        lines.append(f"  {joint}: {{by: {lowering.by:g}, between: [{between}]}}")
    lines += [
        f"# {joint}: no point was found; without it, it is estimated (not possible for legs)"
        for joint in WALKER15.joints
        if not mapping.rules(joint)
    ]
    if mapping.guessed:
        lines.append(f"guessed: [{', '.join(mapping.guessed)}]")
    left = [_quoted(name) for name in motion.names if name not in used]
    lines += ["# points not used: " + ", ".join(left[k : k + 8]) for k in range(0, len(left), 8)]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """A word of YAML: in quotes, so that no name is taken for anything else."""
    return str(yaml.safe_dump(text, default_style='"', allow_unicode=True, width=2**31)).strip()
