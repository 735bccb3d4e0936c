"""Downloading the public recordings: addresses from a table, every file verified by its sha256."""

from pipeline.fetch.sources import (
    NEEDED_COLUMNS,
    FetchReport,
    Progress,
    fetch,
    open_http,
    read_sources,
    resolve,
)

__all__ = ["NEEDED_COLUMNS", "FetchReport", "Progress", "fetch", "open_http", "read_sources", "resolve"]
