"""Column titles and frame rate of BIDS motion files (``*_motion.tsv``), read from two sidecar files."""

from __future__ import annotations

import csv
import json
from collections import ChainMap
from pathlib import Path

from pipeline.formats.contract import damaged
from pipeline.formats.text import read_text
from pipeline.validation import require_range

_LEVELS = 4
"""Number of folder levels that BIDS uses: dataset, person, session, motion."""


def sidecar_files(path: Path) -> list[Path]:
    """Return the existing sidecar files of a BIDS motion file: the channel table, then the settings.

    They are in the folder of the file or above it, and their names must not contradict it (person, task…).  The nearest
    come first, and longer names within a folder.  The nearest channel table is returned, and all settings.
    """
    if not path.name.endswith("_motion.tsv"):
        return []
    words, files = path.name.split("_"), []
    for ending, max_count in (("channels.tsv", 1), ("motion.json", None)):
        files += [
            file
            for folder in path.absolute().parents[:_LEVELS]
            for file in sorted(folder.glob(f"*{ending}"), key=lambda file: -len(file.name))
            if {*file.name.split("_")} <= {*words, ending}
        ][:max_count]
    return files


def titles_and_rate(path: Path) -> tuple[str, float | None]:
    """Return the column titles of a BIDS file as one line of text, and its frame rate, Hz.

    For other tables, the line is empty and the rate is None.

    Raises
    ------
    InvalidInput
        If a sidecar file is missing, or lacks a column or the rate.
    """
    if not (files := sidecar_files(path)):
        return "", None
    titles = []
    try:
        channels, *settings = (read_text(file)[0] for file in files)
        for row in csv.DictReader(channels.split("\n"), delimiter="\t"):
            coordinate = f"{row['tracked_point']}_{row['component']}_{row['units']}".removesuffix("_n/a")
            other_title = f"{row['name']} {row['type']}"
            titles.append({"POS": coordinate, "LATENCY": "time"}.get(row["type"], other_title))
        rate = require_range("", float(ChainMap(*map(json.loads, settings))["SamplingFrequency"]), above=0)
    except (LookupError, TypeError, ValueError):
        expected = (
            "in its folder or above: _channels.tsv with columns name, type, component, tracked_point, units,"
            " and _motion.json with a number SamplingFrequency"
        )
        received = ", ".join(file.name for file in files)
        raise damaged(
            "the channels or the rate cannot be read",
            path.name,
            expected,
            received,
            code="unreadable_channels",
            files=[file.name for file in files],
        ) from None
    return "\t".join(titles) + "\n", rate
