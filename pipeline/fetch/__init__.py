"""Download of the public recordings in a table of addresses, with verification by sha256."""

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
