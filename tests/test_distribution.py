"""Tests of the citation file, and of the source distribution, which must contain the tracked files."""

from __future__ import annotations

import re
import subprocess
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent
PERSON = {
    "family-names",
    "given-names",
    "name-particle",
    "name-suffix",
    "alias",
    "orcid",
    "affiliation",
    "email",
}
ENTITY = {
    "name",
    "address",
    "city",
    "country",
    "date-end",
    "date-start",
    "email",
    "location",
    "orcid",
    "website",
}
KEYS = {
    "abstract", "authors", "cff-version", "commit", "contact", "date-released", "doi", "identifiers", "keywords",
    "license", "license-url", "message", "preferred-citation", "references", "repository", "repository-artifact",
    "repository-code", "title", "type", "url", "version",
}  # fmt: skip
"""Keys that version 1.2.0 of the citation file format allows at the top level, for people and for entities."""

PAPERS = {
    ("Zhang", "conference-paper", 2004),
    ("Zhang", "article", 2007),
    ("Mozerov", "conference-paper", 2006),
    ("Park", "conference-paper", 2011),
}


def require_authors(authors: list[dict[str, str]]) -> None:
    assert authors
    for author in authors:
        assert set(author) <= (ENTITY if "name" in author else PERSON), author
        assert author.get("name") or author.get("family-names"), author
        assert all(isinstance(value, str) and value.strip() for value in author.values()), author


def test_the_citation_file_keeps_its_format_and_names_the_four_papers() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(cited) <= KEYS
    assert cited["cff-version"] == "1.2.0"
    assert cited["type"] == "software"
    assert cited["message"]
    assert project["name"] in cited["title"]
    assert str(cited["version"]) == project["version"]
    assert cited["license"] == project["license"]
    require_authors(cited["authors"])
    for reference in cited["references"]:
        assert reference["title"]
        require_authors(reference["authors"])
    assert {(r["authors"][0]["family-names"], r["type"], r["year"]) for r in cited["references"]} == PAPERS


def _in_sdist(path: str, rules: list[list[str]]) -> bool:
    """Return whether a tracked file is in the source distribution, through MANIFEST.in or through setuptools."""
    first = path.split("/")[0]
    always = re.fullmatch(r"pipeline/.*\.py|pyproject\.toml|setup\.py|README\.md|LICENSE|MANIFEST\.in", path)
    data = re.fullmatch(r"pipeline/(py\.typed|report/page/[^/]+)", path)
    for command, *patterns in rules:
        if command == "graft" and first in patterns:
            return True
        if command == "include" and any(fnmatch(path, pattern) for pattern in patterns):
            return True
        folder, *kinds = patterns
        inside = path.startswith(f"{folder}/") and any(fnmatch(Path(path).name, kind) for kind in kinds)
        if command == "recursive-include" and inside:
            return True
    return bool(always or data)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the tracked files' list")
def test_the_source_distribution_lacks_nothing_that_is_tracked() -> None:
    """The source distribution contains all tracked files except git's own and the results in light archives."""
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    manifest = (ROOT / "MANIFEST.in").read_text(encoding="utf-8").splitlines()
    rules = [line.split() for line in manifest if line.split()]
    lacking = [path for path in tracked.splitlines() if path and not _in_sdist(path, rules)]
    assert [path for path in lacking if not path.startswith("results/archive/light/")] == [".gitignore"]
