"""The command `reconstruct`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipeline.cli.options import filled
from pipeline.cli.output import tell
from pipeline.reconstruct import words
from pipeline.reconstruct.writing import Reconstruct, run


def _progress(done: int, every: int) -> None:
    """Show on a terminal how many frames of a film are done."""
    if sys.stderr.isatty() and (done % 10 == 0 or done == every):
        end = "\n" if done == every else ""
        print(f"\r  keypoints: frame {done} of {every or 'many'}", end=end, file=sys.stderr, flush=True)


def reconstruct(arguments: Sequence[str]) -> int:
    """Reconstruct a walk from keypoints; return 0 also if it was none, which the summary says."""
    if arguments and "=" not in arguments[0]:  # a file or folder alone, as other commands take it
        arguments = [f"input.path={arguments[0]}", *arguments[1:]]
    _, summary, folder = run(filled(Reconstruct, arguments), lambda words: tell(words, "dim"), _progress)
    tell(f"{summary['verdict']}{''.join(f': {why}' for why in summary['why'])}", "bold")
    if "view_angle_deg" in summary:
        view, cadence = summary["view_angle_deg"], summary["cadence"]
        low, high = view["interval_95"]
        tell(f"  walks {view['words']}; ±{(high - low) / 2:.0f}°")
        for other in view["alternatives"]:
            tell(f"  {words.alternative(other)}")
        tell(f"  {cadence['steps_per_min']} steps a minute, {summary['locomotion']}")
        for sentence in summary["usable"]:
            tell(f"  {sentence}")
        for name in ("left_knee", "right_knee"):
            knee = summary["angles_deg"][name]
            tell(f"  {name.replace('_', ' ')} {knee['least']} to {knee['most']}°, ±{knee['half_width_95']}°")
    tell(f"  {summary['recognised']['layout']}")
    for note in summary["notes"]:
        tell(f"  {note}", "dim")
    for sentence in summary.get("next_time", ()):
        tell(f"  next time: {sentence}", "dim")
    tell(f"written to {folder}")
    return 0
