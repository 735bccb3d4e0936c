"""Download of the public recordings from a table of addresses, with sha256 verification."""

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
