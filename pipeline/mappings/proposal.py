"""A proposed mapping as a file: every guess marked, points that are not used listed."""

from __future__ import annotations

import yaml

from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping


def written(mapping: SourceMapping, motion: MotionCapture) -> str:
    """Return a mapping as YAML that `pipeline.mappings.load` reads; guesses are marked, unused points listed."""
    lines = [
        "# Proposed from names, sides and places of the points of one recording.  Check every line that is marked as",
        "# guessed; weights of a joint sum to one, e.g. {lateral: 0.5, medial: 0.5}.",
        f"name: {_quoted(mapping.name)}",
        f"up: {mapping.up}  # guessed: the axis along which the points spread most",
        "joints:",
    ]
    used = set()
    for joint in WALKER15.joints:
        rules = mapping.rules(joint)
        if not rules:
            lines.append(
                f"  # {joint}: no point was found; without it, it is estimated (not possible for legs)"
            )
            continue
        used |= set(rules[0][0])
        inner = ", ".join(f"{_quoted(point)}: {weight:g}" for point, weight in rules[0][0].items())
        lines.append(f"  {joint}: {{{inner}}}" + ("  # guessed" if joint in mapping.guessed else ""))
    if mapping.guessed:
        lines.append(f"guessed: [{', '.join(mapping.guessed)}]")
    left = [_quoted(name) for name in motion.names if name not in used]
    lines += ["# points not used: " + ", ".join(left[k : k + 8]) for k in range(0, len(left), 8)]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """A word of YAML: in quotes, so that no name is taken for anything else."""
    return str(yaml.safe_dump(text, default_style='"', allow_unicode=True, width=2**31)).strip()
