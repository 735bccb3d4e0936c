"""Tests that the article quotes only published numbers, and that ``codecheck.yml`` names the sweep's outputs."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest
import yaml

from pipeline import papers

ROOT = Path(__file__).resolve().parents[1]
ARTICLE = ROOT / "docs" / "article"
_SPEC = importlib.util.spec_from_file_location("article", ARTICLE / "build.py")
assert _SPEC is not None
assert _SPEC.loader is not None
article = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(article)

NO_RESULTS = {
    "2D", "3D", "06",  # names
    "81", "225", "226", "1",  # equations, and numbers of a representation; R - 1
    "240", "95", "95.5",  # of quotations and of intervals
}  # fmt: skip
"""Numbers in the article's text that are not results, such as the 225 dimensions of the representation."""


def template() -> str:
    return (ARTICLE / "article.typ").read_text(encoding="utf-8")


def test_every_number_of_ours_is_a_placeholder() -> None:
    text = article.PLACEHOLDER.sub("", template()).replace("{{commit}}", "")
    text = text[text.index("#block(") : text.index("#bibliography")]
    text = re.sub(
        r"#[a-z.]+\([^)]*\)|#block\([^)]*\)|[a-z-]+: [^,\n]*(?:pt|mm|%)\b|columns: .*|align: .*|@\w+|`[^`]*`",
        "",
        text,
    )
    published = {
        f"{c.published:g}" for p in papers.all_papers().values() for c in p.claims if c.published is not None
    }
    years = {str(paper.year) for paper in papers.all_papers().values()}
    typed = set(re.findall(r"(?<![\w.])\d+(?:\.\d+)?D?(?![\w])", text))
    of_ours = {
        n for n in typed if n not in NO_RESULTS | years and f"{float(n.rstrip('D')):g}" not in published
    }
    assert not of_ours


def test_a_number_that_is_not_published_is_refused_by_name() -> None:
    numbers = {("synthetic", "one"): 2.345}
    assert article.filled("a {{synthetic:one:.1f}} of {{commit}}", numbers, "abc") == "a 2.3 of abc"
    assert article.filled("{{synthetic:one:.0%}}", {("synthetic", "one"): -0.5}, "") == "−50%"
    with pytest.raises(ValueError, match="lacks 'two' of cmu"):
        article.filled("{{synthetic:one:.1f}} {{cmu:two:.0f}}", numbers, "")


def test_the_article_has_all_its_numbers_and_becomes_a_pdf(tmp_path: Path) -> None:
    with (ROOT / "results" / "published.csv").open(encoding="utf-8", newline="") as lines:
        numbers, commit = article.read_published(lines)
    text = article.filled(template(), numbers, commit)
    assert "{{" not in text
    assert commit
    pytest.importorskip("typst")
    article.build(tmp_path / "article.pdf")
    assert (tmp_path / "article.pdf").read_bytes().startswith(b"%PDF-")
    assert [path.name for path in ARTICLE.iterdir() if path.name.startswith(".")] == []


def test_the_manifest_names_every_figure_of_the_papers_once() -> None:
    manifest = yaml.safe_load((ROOT / "codecheck.yml").read_text(encoding="utf-8"))["manifest"]
    files = [entry["file"] for entry in manifest]
    figures = [
        f"results/synthetic/full/{f}/figure.svg" for p in papers.all_papers().values() for f in p.figures
    ]
    assert len(set(files)) == len(files)
    assert sorted(name for name in files if name.endswith(".svg")) == sorted(figures)
    assert all(entry["comment"] for entry in manifest)
