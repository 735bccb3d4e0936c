"""Comparison of the variants of a multirun: the table ``variants.csv``, and pictures with all curves.

A variant is a folder of the run with figures in it.  Variants are named by the options in which their manifests differ.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.charts import Chart, Lines, Sheet
from pipeline.palette import CYCLE, Style
from pipeline.report.published import PublishedFigure, read_published
from pipeline.storage import tables
from pipeline.storage.sealed_folders import MANIFEST, visible

VARIANTS = "variants.csv"
_IGNORED_OPTIONS = {"name", "results", "workers"}
"""Options that are ignored when variants are compared with each other."""

_LINES = ("solid", "dashed", "dotted")


@dataclass(frozen=True)
class Variant:
    """One variant of a figure in a multirun.

    Attributes
    ----------
    options : dict of str to str
        Options that differ between the variants, by their dotted names.
    figure : PublishedFigure
    claims : list of dict
        Rows of the figure's ``claims.csv``.
    """

    options: dict[str, str]
    figure: PublishedFigure
    claims: list[dict[str, Any]]

    @property
    def name(self) -> str:
        """Name of the variant: the options that differ between variants, e.g. ``components=20``."""
        return ", ".join(f"{option.rpartition('.')[2]}={value}" for option, value in self.options.items())


def variants_of(run: Path) -> dict[str, list[Variant]]:
    """Return the finished variants of a multirun by figure, in the order of the jobs.

    Figures with only one variant are left out.
    """
    figures_of: dict[str, list[PublishedFigure]] = {}
    claims: dict[Path, list[dict[str, Any]]] = {}
    for folder in sorted({path.parent.parent for path in visible(run, f"*/*/{MANIFEST}")}, key=_job):
        for figure in sorted(path.parent.name for path in visible(folder, f"*/{MANIFEST}")):
            results = read_published(folder, [figure])
            figures_of.setdefault(figure, []).append(results.figures[figure])
            claims[folder / figure] = results.claims
    several = {name: figures for name, figures in figures_of.items() if len(figures) > 1}
    return {
        name: [
            Variant(options, figure, claims[figure.folder])
            for options, figure in zip(_differing(figures), figures, strict=True)
        ]
        for name, figures in several.items()
    }


def _job(folder: Path) -> tuple[int, str]:
    """Return the sort key of a variant: the job number at the start of its folder's name."""
    number = folder.name.partition("_")[0]
    return (int(number) if number.isdigit() else 0, folder.name)


def _differing(figures: Sequence[PublishedFigure]) -> list[dict[str, str]]:
    flat = [_flat(figure.manifest["configuration"]) for figure in figures]
    names = sorted({name for options in flat for name in options})
    differ = [
        n
        for n in names
        if len({options.get(n) for options in flat}) > 1 and n.split(".")[0] not in _IGNORED_OPTIONS
    ]
    return [{name: options.get(name, "") for name in differ} for options in flat]


def _flat(value: Any, path: str = "") -> dict[str, str]:
    if isinstance(value, Mapping):
        if value.keys() == {"<type>", "name"}:
            return {path: str(value["name"])}
        parts = {name: _flat(part, f"{path}.{name}" if path else name) for name, part in value.items()}
        return {name: text for part in parts.values() for name, text in part.items()}
    return {path: value if isinstance(value, str) else json.dumps(value)}


def compare_variants(run: Path) -> list[Path]:
    """Write ``variants.csv``, and a picture for each figure that has curves, to a run's folder; return the paths.

    The table has a row for each variant and claim: differing options, published number, our number, and both verdicts.
    No file is written unless some figure has two finished variants.
    """
    by_figure = variants_of(run)
    rows = [
        (variant, name, claim)
        for name, variants in by_figure.items()
        for variant in variants
        for claim in variant.claims
    ]
    if not rows:
        return []
    options = sorted({option for variant, _, _ in rows for option in variant.options})
    columns: dict[str, Any] = {"figure": [name for _, name, _ in rows]}
    columns |= {option: [variant.options.get(option, "") for variant, _, _ in rows] for option in options}
    columns |= {
        name: [str(claim[name]) for _, _, claim in rows] for name in ("claim", "agreement", "beyond_baseline")
    }
    columns["unit"] = [claim["unit"] or "" for _, _, claim in rows]
    for name in ("published", "value", "value_low", "value_high"):
        columns[name] = [np.nan if claim[name] in (None, "") else float(claim[name]) for _, _, claim in rows]
    tables.write(run / VARIANTS, columns)
    written = [run / VARIANTS]
    for name, variants in by_figure.items():
        charts = [
            chart
            for chart in variants[0].figure.charts
            if isinstance(chart.table, str) and not chart.abscissa.words
        ]
        if charts:
            written += _draw(run / f"variants_{name}", variants, charts[0])
    return written


def _draw(stem: Path, variants: Sequence[Variant], chart: Chart) -> list[Path]:
    """Draw the lines of all variants in one chart: a colour for each variant, a line pattern for each series."""
    tables_of, lines = {}, []
    for number, variant in enumerate(variants):
        table = variant.figure.table(str(chart.table))
        if table is None or not {chart.x, chart.y, *filter(None, [chart.by])} <= table.keys():
            return []
        tables_of[str(number)] = table
        rows = table[chart.by].astype(str) if chart.by else np.array([""])
        styles_of_chart = (
            chart.styles if isinstance(chart.styles, Mapping) else dict.fromkeys(rows.tolist(), Style())
        )
        styles = {
            key: Style(
                f"{variant.name} {style.label or key}".strip(),
                CYCLE[number % len(CYCLE)],
                line=_LINES[n % len(_LINES)],
                banded=False,
                interval=False,
            )
            for n, (key, style) in enumerate(styles_of_chart.items())
        }
        source: dict[str, Any] = {"table": str(number), "y": chart.y, "by": chart.by, "where": chart.where}
        lines.append({**source, "times": chart.times, "less": chart.less, "styles": styles})
    also = [Lines(**options) for options in lines[1:]]
    every = replace(chart, **lines[0], also=also, references=[], band="", strands="", title="")
    from pipeline.pictures.charts import draw_charts
    from pipeline.pictures.style import Canvas

    caption = f"{variants[0].figure.title}. Variants."
    draw_charts(Canvas(stem, Sheet(charts=[every]), tables_of, caption))
    return [stem.with_suffix(".svg"), stem.with_suffix(".png")]
