"""What each kind of figure is made of: its tables, its picture and its recordings, from the stages' artefacts.

One module to a kind; zhang2004 and zhang2007 share all five.  The report stage calls `tables` first and hands
the result to `picture` and `recordings`, so that nothing is drawn that is not tabulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.config import Config, EigenwalkerModel
from pipeline.store import Artefact

Table = tuple[dict[str, Any], Sequence[str]]
"""Columns and what to sort by."""

Tables = dict[str, Table]
"""By file name without suffix: ``table``, ``table_walkers``, …"""

METHOD_NAMES = {"least_squares": "approach I (least squares)", "map": "approach II (MAP)"}
METHOD_STYLES = {"least_squares": "solid", "map": "dashed"}
METHOD_COLOURS = {"least_squares": "orange", "map": "blue"}

ANKLE_HEIGHT_MM = 80.0
"""Of the joint above the sole, about; only for showing walkers on the ground."""

ABSCISSA_OF_VIEWS = "Viewpoint (degree)"


@dataclass(frozen=True)
class Made:
    """What the stages made for one figure."""

    config: Config
    ingest: Artefact
    dataset: Artefact
    model: Artefact
    sweep: Artefact

    @property
    def methods(self) -> list[str]:
        """The sweep's methods, in order."""
        return [str(m) for m in self.sweep.arrays["methods"]]

    @property
    def walkers(self) -> list[str]:
        """Name of each sample: its clip."""
        return [str(name) for name in self.dataset.arrays["clip"]]

    @property
    def summary(self) -> str:
        """Data set, walkers and components in one line."""
        walks, people = self.dataset.notes["walks"], self.dataset.notes["walkers"]
        count = f"{people} walkers" if walks == people else f"{walks} walks of {people} walkers"
        sources = ", ".join(sorted(set(map(str, self.dataset.arrays["source"])) - {self.config.data.name}))
        asked, kept = self.model.notes["components_asked"], self.model.notes["components"]
        fewer = f" (of {asked} asked for)" if kept < asked else ""
        name = self.config.data.name + (f" ({sources})" if sources else "")
        return f"{name}, {count}, {kept} eigenwalkers{fewer}"

    @property
    def caption(self) -> str:
        """The picture's caption."""
        return f"{self.config.title}. Data: {self.summary}."

    @property
    def about(self) -> str:
        """The recording's description, Markdown."""
        model = self.config.model
        components = model.components if isinstance(model, EigenwalkerModel) else ""
        return "\n".join(
            [
                f"# {self.config.figure}",
                "",
                f"**{self.config.title}**",
                "",
                self.config.expect,
                "",
                "| | |",
                "|---|---|",
                f"| data | {self.summary} |",
                f"| scale | {self.config.scale.name} |",
                f"| components asked for | {components} |",
                f"| seed | {self.config.seed} |",
                "",
                "World: right-handed, metres, z up, the walk along +y, +x to the walker's right; walkers are "
                "lifted from the tables' origin, the mean pelvis, to stand on the ground.",
                "View angle 0 is the frontal view, -90 the left profile, +90 the right profile; image right is the "
                "walker's right at 0, so a video taken from the front has to be mirrored.",
                "",
            ]
        )


def walker_words(name: str) -> str:
    """A walker's name as the path of an entity can hold it."""
    return "".join(ch if ch.isalnum() else "_" for ch in name)


def lift(motion: np.ndarray) -> np.ndarray:
    """(3,) mm to add to (T, 15, 3) and to its reconstructions, so that the lower ankle stands on the ground."""
    return np.array([0.0, 0.0, ANKLE_HEIGHT_MM - motion[..., 2].min()])


def sd(values: np.ndarray, axis: int) -> np.ndarray:
    """Standard deviation over walkers, divisor n - 1 (0 for a single walker)."""
    return values.std(axis=axis, ddof=1) if values.shape[axis] > 1 else np.zeros_like(values.mean(axis=axis))
