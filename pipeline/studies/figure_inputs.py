"""What each kind of figure is made of: its tables, its picture and its recordings, from the stages' artefacts.

One module to a kind; zhang2004 and zhang2007 share theirs.  The report stage calls `tables` first and hands
the result to `picture` and `recordings`, so that nothing is drawn that is not tabulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.storage.store import Artefact
from pipeline.studies.options import Config

Table = tuple[dict[str, Any], Sequence[str]]
"""Columns and what to sort by."""

Tables = dict[str, Table]
"""By file name without suffix: ``table``, ``table_walkers``, …"""

METHOD_NAMES = {"least_squares": "approach I (least squares)", "map": "approach II (MAP)"}
METHOD_STYLES = {"least_squares": "solid", "map": "dashed"}
METHOD_COLOURS = {"least_squares": "orange", "map": "blue"}

ANKLE_HEIGHT_MM = 80.0
"""Of the joint above the sole, about; only for showing walkers on the ground."""

SAMPLE = {"walks": "walker", "performances": "performance", "clips": "clip_name"}
"""What names the samples in ``arrays.npz``, by purpose."""

WORLD = {
    "walks": "World: right-handed, metres, z up, the walk along +y, +x to the walker's right; walkers are lifted from "
    "the tables' origin, the mean pelvis, to stand on the ground.\n"
    "View angle 0 is the frontal view, -90 the left profile, +90 the right profile; image right is the walker's right "
    "at 0, so a video taken from the front has to be mirrored.",
    "performances": "World: right-handed, metres, z up; actors stand over the origin, facing +y at the first frame.",
    "clips": "World: right-handed, metres, z up, as recorded.",
}
"""How the recording's world lies, by purpose."""

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
    def artefacts(self) -> tuple[Artefact, ...]:
        """In the order of the stages."""
        return self.ingest, self.dataset, self.model, self.sweep

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
        """Data set, samples and model in one line."""
        sources = ", ".join(sorted(set(map(str, self.dataset.arrays["source"])) - {self.config.data.name}))
        name = self.config.data.name + (f" ({sources})" if sources else "")
        return f"{name}, {self.dataset.notes['words']}, {self.model.notes['words']}"

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """What is published as ``arrays.npz``: per walker and joint, per performance, per trial."""
        learnt = self.model.arrays if self.config.purpose == "performances" else {}
        return {**learnt, **self.sweep.arrays, SAMPLE[self.config.purpose]: np.array(self.walkers)}

    @property
    def caption(self) -> str:
        """The picture's caption."""
        return f"{self.config.title}. Data: {self.summary}."

    @property
    def about(self) -> str:
        """The recording's description, Markdown."""
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
                f"| seed | {self.config.seed} |",
                "",
                WORLD[self.config.purpose],
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
