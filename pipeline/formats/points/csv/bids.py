"""Motion of BIDS (``*_motion.tsv``): the titles of its columns and its rate stand in two files beside it."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from pipeline.formats.contract import damaged
from pipeline.formats.text import read_text
from pipeline.validation import require_range


def beside(path: Path) -> list[Path]:
    """Return the table of channels and the settings of a motion file of BIDS, those that are there."""
    stem = path.name.removesuffix("_motion.tsv")
    files = (path.with_name(stem + ending) for ending in ("_channels.tsv", "_motion.json"))
    return [file for file in files if file.is_file()]


def titles_and_rate(path: Path) -> tuple[str, float | None]:
    """Return the line of titles that the file lacks and its rate, Hz; nothing of a table that is not of BIDS.

    Raises
    ------
    InvalidInput
        If one of them is missing, or lacks a column or the rate.
    """
    if not (files := beside(path)):
        return "", None
    titles = []
    try:
        channels, settings = (read_text(file)[0] for file in files)
        for row in csv.DictReader(channels.split("\n"), delimiter="\t"):
            coordinate = f"{row['tracked_point']}_{row['component']}_{row['units']}".removesuffix("_n/a")
            other = f"{row['name']} {row['type']}"
            titles.append({"POS": coordinate, "LATENCY": "time"}.get(row["type"], other))
        rate = require_range("", float(json.loads(settings)["SamplingFrequency"]), above=0)
    except (LookupError, TypeError, ValueError):
        expected = (
            "beside it _channels.tsv with columns name, type, component, tracked_point, units"
            " and _motion.json with a number SamplingFrequency"
        )
        received = ", ".join(file.name for file in files)
        raise damaged("the channels or the rate cannot be read", path.name, expected, received) from None
    return "\t".join(titles) + "\n", rate
