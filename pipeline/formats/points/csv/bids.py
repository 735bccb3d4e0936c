"""Motion of BIDS (``*_motion.tsv``): the titles of its columns and its rate stand in two files beside it or above."""

from __future__ import annotations

import csv
import json
from collections import ChainMap
from pathlib import Path

from pipeline.formats.contract import damaged
from pipeline.formats.text import read_text
from pipeline.validation import require_range

_LEVELS = 4
"""Folders of a dataset, a person, a session and of motion."""


def beside(path: Path) -> list[Path]:
    """Return the table of channels and the settings of a motion file of BIDS, those that are there.

    In its folder or up to that of the dataset, of no other person, task, …, than the file, the nearest first; of two in
    a folder the one that says more.  Of the channels the nearest, of the settings all.
    """
    if not path.name.endswith("_motion.tsv"):
        return []
    words, files = path.name.split("_"), []
    for ending, most in (("channels.tsv", 1), ("motion.json", None)):
        files += [
            file
            for folder in path.absolute().parents[:_LEVELS]
            for file in sorted(folder.glob(f"*{ending}"), key=lambda file: -len(file.name))
            if {*file.name.split("_")} <= {*words, ending}
        ][:most]
    return files


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
        channels, *settings = (read_text(file)[0] for file in files)
        for row in csv.DictReader(channels.split("\n"), delimiter="\t"):
            coordinate = f"{row['tracked_point']}_{row['component']}_{row['units']}".removesuffix("_n/a")
            other = f"{row['name']} {row['type']}"
            titles.append({"POS": coordinate, "LATENCY": "time"}.get(row["type"], other))
        rate = require_range("", float(ChainMap(*map(json.loads, settings))["SamplingFrequency"]), above=0)
    except (LookupError, TypeError, ValueError):
        expected = (
            "beside it or above _channels.tsv with columns name, type, component, tracked_point, units"
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
