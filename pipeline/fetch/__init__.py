"""Real recordings, fetched by a table of addresses and checked by their sha256."""

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
