"""Progress of figures: a live display on a terminal, otherwise a line for each finished figure."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from pipeline.cli.summary import STAGES, Made, Outcome
from pipeline.studies.experiment import Experiment

_PACE_S = 3600.0
"""Period, s, over which the speed is averaged to estimate the remaining time. A single figure may take minutes."""


class Display:
    """Context manager that shows the progress of several figures, each weighted by the cost of its preset.

    Parameters
    ----------
    experiments : sequence of Experiment
    console : Console
    slots : int
        Number of figures at a time.
    """

    def __init__(self, experiments: Sequence[Experiment], console: Console, *, slots: int) -> None:
        self._experiments, self._console, self._ended = experiments, console, 0
        self._progress = Progress(
            TextColumn("{task.description}", justify="left"),
            BarColumn(),
            TextColumn("{task.fields[count]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
            transient=True,
            speed_estimate_period=_PACE_S,
        )
        total = sum(experiment.cost_s for experiment in experiments)
        self._all = self._progress.add_task("figures", total=total, count=self._count)
        self._slots = [
            self._progress.add_task("", total=len(STAGES), count="", visible=False) for _ in range(slots)
        ]

    @property
    def _count(self) -> str:
        return f"{self._ended}/{len(self._experiments)}"

    def __enter__(self) -> Display:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def began(self, slot: int, figure: int) -> None:
        """Show that a figure, given by its index, has started in a process slot of the display."""
        name = self._experiments[figure].name
        self._progress.reset(self._slots[slot], description=name, visible=True, figure=name, count="")

    def at(self, slot: int, stage: str) -> None:
        """Show that the figure in a process slot of the display has started a stage."""
        task = self._slots[slot]
        name = self._progress.tasks[slot + 1].fields["figure"]
        self._progress.update(task, description=f"{name}: {stage}", completed=STAGES.index(stage))

    def note(self, words: str) -> None:
        """Show a text next to the common progress of all figures."""
        self._progress.update(self._all, description=words)

    def ended(self, slot: int, figure: int, made: Made) -> None:
        """Show that a figure has ended; if the output is not a terminal, print a line instead."""
        self._ended += 1
        self._progress.update(self._slots[slot], visible=False)
        self._progress.update(self._all, advance=self._experiments[figure].cost_s, count=self._count)
        if isinstance(made, Outcome) and not self._console.is_terminal and len(self._experiments) > 1:
            self._console.print(Text(line(self._count, made)), soft_wrap=True)


def line(count: str, made: Outcome) -> str:
    """Return the line that reports a finished figure; it begins with `count`, such as ``3/12``."""
    reused = f", reused {' '.join(made.reused)}" if made.reused else ""
    return (
        f"{count} {made.figure}: {sum(made.seconds.values()):.1f} s, "
        f"{made.processor_s:.1f} s of processor time{reused}, {made.folder}/"
    )
