"""What is shown while figures are made: on a terminal one live display, elsewhere a line for each finished figure."""

from __future__ import annotations

import time
from collections.abc import Sequence

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from pipeline.cli.summary import STAGES, Failure, Outcome
from pipeline.studies.experiment import Experiment

_PRIOR_S = 5.0
"""Seconds after which the pace of this run counts as much as the costs that presets name."""


def seconds_left(
    done: Sequence[tuple[float, float]],
    running: Sequence[tuple[float, float]],
    waiting: Sequence[float],
    cores: int,
) -> float:
    """Return about how many seconds are left, if the figures keep their relative costs.

    Parameters
    ----------
    done, running : sequence of (float, float)
        Cost of each figure, s, and the seconds that it took, or that it runs.
    waiting : sequence of float
        Costs, s.
    cores : int

    Examples
    --------
    >>> seconds_left([], [], [20.0, 40.0], cores=2)
    30.0
    >>> seconds_left([(5.0, 15.0)], [(10.0, 4.0)], [20.0], cores=1)  # takes twice as long as its costs say
    56.0
    """
    pace = (_PRIOR_S + sum(took for _, took in done)) / (_PRIOR_S + sum(cost for cost, _ in done))
    rest = sum(max(pace * cost - ran, 0.0) for cost, ran in running)
    return (rest + pace * sum(waiting)) / cores


def in_words(seconds: float) -> str:
    """Return a duration that nobody knows exactly.

    Examples
    --------
    >>> in_words(8.2), in_words(70.0), in_words(1000.0)
    ('about 10 s left', 'about 1 min left', 'about 17 min left')
    """
    if seconds < 60.0:
        return f"about {10 * max(round(seconds / 10), 1)} s left"
    return f"about {round(seconds / 60)} min left"


class Display:
    """Progress of several figures, to be used as a context.

    Parameters
    ----------
    experiments : sequence of Experiment
    console : Console
    slots : int
        Figures at a time.
    cores : int
    """

    def __init__(
        self, experiments: Sequence[Experiment], console: Console, *, slots: int, cores: int
    ) -> None:
        self._experiments, self._console, self._cores = experiments, console, cores
        self._done: list[tuple[float, float]] = []
        self._began: dict[int, float] = {}
        self._left = set(range(len(experiments)))
        self._progress = Progress(
            TextColumn("{task.description}", justify="left"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]}"),
            console=console,
            disable=not console.is_terminal,
            transient=True,
        )
        self._all = self._progress.add_task("figures", total=len(experiments), left="")
        self._slots: list[TaskID] = [
            self._progress.add_task("", total=len(STAGES), left="", visible=False) for _ in range(slots)
        ]

    def __enter__(self) -> Display:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def began(self, slot: int, figure: int) -> None:
        """Show that a figure, by its number, is made in a slot."""
        self._began[figure] = time.monotonic()
        name = self._experiments[figure].name
        self._progress.reset(
            self._slots[slot], total=len(STAGES), description=name, visible=True, figure=name, left=""
        )
        self._estimate()

    def at(self, slot: int, stage: str) -> None:
        """Show that a stage begins."""
        task = self._slots[slot]
        name = self._progress.tasks[slot + 1].fields["figure"]
        self._progress.update(task, description=f"{name}: {stage}", completed=STAGES.index(stage))
        self._estimate()

    def ended(self, slot: int, figure: int, made: Outcome | Failure) -> None:
        """Show that a figure is finished; where there is no terminal, in a line."""
        del self._began[figure]
        self._left.discard(figure)
        self._progress.update(self._slots[slot], visible=False)
        self._progress.update(self._all, completed=len(self._experiments) - len(self._left))
        if isinstance(made, Outcome) and len(made.reused) < len(STAGES) - 1:
            self._done.append((self._experiments[figure].cost_s, made.processor_s))
        self._estimate()
        if isinstance(made, Outcome) and not self._console.is_terminal and len(self._experiments) > 1:
            count = f"{len(self._experiments) - len(self._left)}/{len(self._experiments)}"
            reused = f", reused {' '.join(made.reused)}" if made.reused else ""
            self._console.print(
                Text(
                    f"{count} {made.figure}: {sum(made.seconds.values()):.1f} s, "
                    f"{made.processor_s:.1f} s of processor time{reused}, {made.folder}/"
                ),
                soft_wrap=True,
            )

    def _estimate(self) -> None:
        now = time.monotonic()
        costs = [experiment.cost_s for experiment in self._experiments]
        running = [(costs[figure], now - since) for figure, since in self._began.items()]
        waiting = [costs[figure] for figure in self._left - self._began.keys()]
        left = in_words(seconds_left(self._done, running, waiting, self._cores)) if self._left else ""
        self._progress.update(self._all, left=left)
