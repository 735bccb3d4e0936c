"""Published results of a data set, read for the report page.

All values come from the files of ``results/<data>/<scale>``, so a page can be made from the results of an earlier
commit or from an archive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.chart_json import from_json
from pipeline.charts import Chart
from pipeline.reading import as_written, read_arrays
from pipeline.storage import tables
from pipeline.storage.sealed_folders import FIGURE, complaints_about, read_manifest, visible
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class PublishedFigure:
    """A figure with finished results.

    Attributes
    ----------
    name : str
        Name of the figure and of its folder.
    folder : Path
    manifest : dict
    """

    name: str
    folder: Path
    manifest: dict[str, Any]
    _read: dict[str, dict[str, np.ndarray]] = field(default_factory=dict, repr=False)

    @property
    def title(self) -> str:
        """Content of the figure in one sentence."""
        return str(self.option("title") or self.manifest.get("title") or self.name)

    @property
    def expect(self) -> str:
        """Expected outcome of the figure in one sentence."""
        return str(self.manifest.get("expect") or "")

    @property
    def files(self) -> list[str]:
        """Sorted names of the figure's files, including the manifest."""
        return sorted([*self.manifest["files"], "manifest.json"])

    @property
    def commit(self) -> str:
        """First twelve digits of the commit that made the figure."""
        return str(self.manifest.get("provenance", {}).get("commit", "unknown"))[:12]

    def option(self, *path: str) -> Any:
        """Return the value of a configuration option of the figure, or None if the option is absent."""
        value: Any = self.manifest.get("configuration", {})
        for name in path:
            value = value.get(name) if isinstance(value, Mapping) else None
        # A choice is stored as its class and its name.
        return value["name"] if isinstance(value, Mapping) and value.keys() == {"<type>", "name"} else value

    @property
    def charts(self) -> list[Chart]:
        """Charts of the published figure."""
        return [from_json(plain, self.name) for plain in self.manifest.get("charts", [])]

    def table(self, name: str) -> dict[str, np.ndarray] | None:
        """Return the columns of the table with this name, without suffix, or None if the figure has no such table."""
        path = self.folder / f"{name}.csv"
        if name not in self._read and path.name in self.manifest["files"]:
            self._read[name] = tables.read(path)
        return self._read.get(name)

    def tables_of(self, chart: Chart) -> dict[str, dict[str, np.ndarray]]:
        """Return the tables that a chart needs and the figure has, by name."""
        names = [lines.table for lines in (chart, *chart.also) if isinstance(lines.table, str)]
        return {name: table for name in names if (table := self.table(name)) is not None}

    @cached_property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays in the figure's ``arrays.npz``, by name."""
        return read_arrays(self.folder / "arrays.npz")

    @cached_property
    def sources(self) -> list[str]:
        """Sorted data sources of the clips that the figure used."""
        ingested = self.table("table_ingest")
        if ingested is None or "source" not in ingested:
            return []
        ingested_rows = ingested["verdict"] == "kept" if "verdict" in ingested else slice(None)
        return sorted(set(map(str, ingested["source"][ingested_rows])))


@dataclass(frozen=True)
class Published:
    """All results of a data set at one scale.

    Attributes
    ----------
    folder : Path
        ``results/<data>/<scale>``.
    data, scale : str
    figures : dict of str to PublishedFigure
        Finished figures, in the requested order.
    missing : dict of str to str
        Missing or damaged figures, with the reason.
    claims : list of dict
        Rows of ``claims.csv`` in the file's order; numbers as numbers, None where a cell is empty.
    """

    folder: Path
    data: str
    scale: str
    figures: dict[str, PublishedFigure]
    missing: dict[str, str]
    claims: list[dict[str, Any]] = field(default_factory=list)

    @property
    def recorded(self) -> bool:
        """True if at least one figure was made from files with recorded people."""
        return any(figure.manifest.get("inputs") for figure in self.figures.values())

    def claims_of(self, *, figure: str = "", paper: str = "") -> list[dict[str, Any]]:
        """Return the claims of a figure or of a paper."""
        return [row for row in self.claims if row["figure"] == figure or (paper and row["paper"] == paper)]


def read_published(folder: Path, figures: Sequence[str]) -> Published:
    """Return the results in the folder ``results/<data>/<scale>``.

    Parameters
    ----------
    folder : Path
    figures : sequence of str
        Names of all figures to look for, in the order of the page.

    Raises
    ------
    InvalidInput
        If no figure is finished, or a table differs from its manifest.
    """
    finished: dict[str, PublishedFigure] = {}
    missing: dict[str, str] = {}
    for name in figures:
        if not (folder / name).is_dir():
            missing[name] = "not made yet"
        elif complaints := complaints_about(folder / name, hashes=False, needed=FIGURE):
            missing[name] = f"unfinished or damaged: {complaints[0]}"
        else:
            finished[name] = PublishedFigure(name, folder / name, read_manifest(folder / name))
    if not finished:
        raise InvalidInput(
            "the results folder has no published figure", folder, "one or more", code="nothing_published"
        )
    claims = folder / "claims.csv"
    files = [claims] if claims.is_file() else visible(folder, "*/claims.csv")
    with as_written(folder / "claims.csv"):
        rows = [row for path in files for row in numbered_rows(path) if row["figure"] in finished]
    return Published(folder, folder.parent.name, folder.name, finished, missing, rows)


def numbered_rows(path: Path) -> list[dict[str, Any]]:
    """Read a CSV table, and return its rows with numeric cells as numbers and empty cells as None."""
    columns = tables.read(path)
    rows = zip(*(map(_cell, column.tolist()) for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _cell(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value
