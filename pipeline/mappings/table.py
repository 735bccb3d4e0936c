"""Reader and writer of mappings as YAML files.

The files are read as data and are never run.  An error gives its line.  A written proposal marks guesses and lists
unused points.
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
"""Value of the option `skeleton` with which the best mapping is selected for each recording."""

MAX_FILE_BYTES = 1_000_000
"""Largest size of a mapping file in bytes."""

_MAX_DEPTH = 10
"""Largest nesting depth of a mapping file, because the parsing time grows with the square of the depth."""

_KEYS = ("name", "up", "units", "recognised_by", "points", "joints", "otherwise", "lowered", "guessed")


def _names() -> list[str]:
    return list(plugins.conf_files("skeleton"))


@functools.cache
def _shipped(name: str) -> SourceMapping:
    return load(plugins.conf_files("skeleton")[name])


def shipped() -> dict[str, SourceMapping]:
    """Return the mappings that are installed with the package, by name."""
    return {name: _shipped(name) for name in _names()}


def chosen(name: str) -> SourceMapping | None:
    """Return the mapping that the option `skeleton` names, from the package or a YAML file; None for ``auto``.

    Raises
    ------
    InvalidInput
        If the mapping does not exist, or the file is not a mapping.
    """
    if name == AUTO:
        return None
    if name in _names():
        return _shipped(name)
    if "/" in name or "\\" in name or name.lower().endswith((".yaml", ".yml")):
        return load(Path(name))
    names = " or ".join([AUTO, *_names()])
    raise InvalidInput(
        "the mapping does not exist",
        "skeleton",
        f"{names}, or the path of a YAML file",
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
        If the file cannot be read, is not YAML, or is not a mapping of points to joints; the message gives the line.
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
    if len(data) > MAX_FILE_BYTES:
        raise InvalidInput(
            "the file is too large for a mapping",
            path.name,
            f"at most {MAX_FILE_BYTES} bytes",
            code="file_too_large",
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InvalidInput(
            "the mapping is not UTF-8: save it as UTF-8",
            f"{path.name}, line {line}",
            received=f"byte {data[error.start]:#x}",
            code="not_utf8",
            line=line,
        ) from None
    return _mapping(_composed(text, path.name), path.stem)


def _composed(text: str, where: str) -> yaml.Node:
    """Parse a YAML text to a tree of nodes, and reject custom tags, anchors and aliases."""

    class Loader(yaml.SafeLoader):
        """YAML loader whose error positions include the name of the file."""

        def __init__(self, stream: str) -> None:
            super().__init__(stream)
            self.name = where

    if "# @package" in text:
        line = text[: text.index("# @package")].count("\n") + 1
        raise InvalidInput(
            "a mapping must not have a line `# @package`: delete the line",
            f"{where}, line {line}",
            code="package_line",
        )
    depth = 0
    try:
        for event in yaml.parse(text, Loader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _MAX_DEPTH:
                raise _wrong("the file is nested too deeply for a mapping", event, code="nested_too_deeply")
            if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
                raise _wrong("anchors and aliases are not allowed in mappings", event, code="anchor")
        node = yaml.compose(text, Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        at = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "it cannot be read"
        if "'\\t'" in str(problem):
            problem = "it has a tab, but YAML requires blanks"
        raise InvalidInput(
            f"the file is not valid YAML: {' '.join(str(problem).split())[:120]}",
            f"{where}{at}",
            code="not_yaml",
        ) from None
    if node is None:
        raise InvalidInput("the mapping is empty", where, code="empty_file")
    return node


def _wrong(
    what: str, at: Any, expected: str = "", received: str = "", *, code: str, **values: Any
) -> InvalidInput:
    """Return an error about a node of a YAML file, with the file name and the line."""
    mark = at.start_mark
    return InvalidInput(what, f"{mark.name}, line {mark.line + 1}", expected, received, code=code, **values)


def _items(node: yaml.Node, what: str) -> list[tuple[str, yaml.Node, yaml.Node]]:
    """Return the keys and values of a YAML node. Raises InvalidInput if a key is repeated."""
    if not isinstance(node, yaml.MappingNode):
        raise _wrong(f"{what} must have keys with values", node, "key: value", code="not_keys")
    items: dict[str, tuple[yaml.Node, yaml.Node]] = {}
    for key_node, value in node.value:
        key = _text(key_node, f"a key of {what}")
        if key in items:
            first = items[key][0].start_mark.line + 1
            raise _wrong(
                f"the key {key!r} is repeated in {what}",
                key_node,
                f"only the key in line {first}",
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
            "the joint does not exist",
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
    """Return the mapping that a YAML file defines; without a name in the file, the file name is used."""
    values: dict[str, Any] = {"name": stem}
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
            values[key] = UpAxis(axis)
        elif key in ("name", "units"):
            values[key] = _text(value, key)
            if key == "units" and values[key].partition("/")[0] not in MILLIMETRES:
                raise _wrong(
                    "the unit is unknown", value, ", ".join(MILLIMETRES), _shown(value), code="unknown_unit"
                )
        elif key in ("recognised_by", "guessed"):
            values[key] = _texts(value, key)
        elif key == "points":
            values[key] = {
                point: _texts(names, f"the names of {point}") for point, _, names in _items(value, key)
            }
        elif key == "lowered":
            values[key] = {
                _joint(joint, at): _lowering(lowering, joint) for joint, at, lowering in _items(value, key)
            }
        else:
            values[key] = _rules(value, key)
    if not values.get("joints") and not values.get("otherwise"):
        raise _wrong(
            "the mapping has no rules for joints",
            root,
            "joints: {head: {LFHD: 0.5, RFHD: 0.5}, …}",
            code="no_joints",
        )
    return SourceMapping(**values)


def _shown(node: yaml.Node) -> str:
    return repr(node.value)[:60] if isinstance(node, yaml.ScalarNode) else type(node).__name__[:-4].lower()


def written(mapping: SourceMapping, motion: MotionCapture) -> str:
    """Return a mapping as YAML text, with marks on guessed lines and a list of unused points."""
    lines = [
        "# Proposed from names, sides and positions of the points of a recording.  Check every line marked as guessed.",
        "# The weights of a joint sum to one, for example {lateral: 0.5, medial: 0.5}.",
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
        f"# {joint}: no point was found; the joint is estimated (not possible for legs)"
        for joint in WALKER15.joints
        if not mapping.rules(joint)
    ]
    if mapping.guessed:
        lines.append(f"guessed: [{', '.join(mapping.guessed)}]")
    unused = [_quoted(name) for name in motion.names if name not in used]
    lines += ["# points not used: " + ", ".join(unused[k : k + 8]) for k in range(0, len(unused), 8)]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """Return a name as a YAML scalar in quotes, so that it is read as text."""
    return str(yaml.safe_dump(text, default_style='"', allow_unicode=True, width=2**31)).strip()
