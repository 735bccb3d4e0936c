"""Tests that the commands in the README and the documentation pages work as printed."""

from __future__ import annotations

import re
import shlex
from dataclasses import fields
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from pipeline import formats, papers
from pipeline.cli.commands import FILLED_PAGES
from pipeline.cli.compose import compose
from pipeline.cli.durations import durations, insert_durations
from pipeline.cli.main import commands
from pipeline.cli.presets import listed, presets
from pipeline.core import camera_paths
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.storage import tables
from pipeline.storage.sealed_folders import write_manifest
from pipeline.studies import published
from pipeline.studies.registry import all_measures, options
from pipeline.synthetic import limbs, walkers
from pipeline.synthetic.bending import bending_performances
from tests.pages import PAGES, blocks
from tests.rejects import rejects
from tests.walk3d.film.reconstruct.walks import ERROR, alphapose, in_layout
from tests.walk3d.film.walk.walkers import clip
from walk3d.export.c3d import write as write_c3d

MEASURES = all_measures()

ROOT = Path(__file__).resolve().parent.parent
README = PAGES["README.md"]
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) <= 110


def test_the_readme_counts_the_claims_that_can_be_tested() -> None:
    claims = [claim for paper in papers.all_papers().values() for claim in paper.claims]
    counted = [
        claim
        for claim in claims
        if claim.kind in papers.OF_PAPERS and not claim.same_as and not claim.scope.untestable
    ]
    assert f"checks {len(counted)} of their numbers and sentences" in README


def test_each_duration_is_the_measured_one() -> None:
    """Each duration on the pages is the measured one; `make bench ARGS=commands` and `make readme` renew them."""
    measured_s = durations(tables.read_rows(ROOT / "results" / "durations.csv"))
    stated = [page for page in PAGES if "(about " in PAGES[page]]
    assert set(stated) <= set(FILLED_PAGES)
    for page in stated:
        assert insert_durations(PAGES[page], measured_s) == PAGES[page], page
    for command in measured_s:
        assert any(f"\n{command} " in PAGES[page] for page in stated), command


def test_a_duration_that_is_not_measured_is_rejected() -> None:
    with rejects("no_duration", "durations.csv"):
        insert_durations("make sweeps  # figures (about 9 minutes)", {"make test": 180.0})


def test_the_figures_whose_loops_are_compiled_ahead_are_presets() -> None:
    named = re.search(r"^LOOPS +:= (\S+)$", MAKEFILE, re.MULTILINE)
    assert named
    assert set(named[1].split(",")) <= set(presets())


@pytest.mark.parametrize(
    ("example", "expected", "within"), [(0, 30.0, 5.0), (1, 0.27, 0.1), (2, 0.5, 0.5)], ids=str
)
def test_the_library_examples_do_what_they_say(
    capsys: pytest.CaptureFixture[str], example: int, expected: float, within: float
) -> None:
    codes = blocks("docs/python.md", "python")
    assert len(codes) == 3
    exec(compile(codes[example], "python.md", "exec"), {})
    message = capsys.readouterr().out
    assert abs(float(message.split()[-1]) - expected) <= within
    assert "red" not in message


def test_the_examples_on_files_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All Python examples of the pages except the PsychoPy loop run in their order in one folder."""
    pytest.importorskip("xarray")
    people = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    (tmp_path / "my_walks").mkdir()
    for k, walk in enumerate(people.positions_mm):
        write_c3d(tmp_path / "my_walks" / f"p{k}.c3d", WALKER15.joints, walk, 40.0)
    (tmp_path / "my_laboratory").mkdir()
    theirs = walkers.walking_population(
        np.random.default_rng(9), male=2, female=1, duration_s=3.0, frame_rate_hz=40.0
    )
    for k, walk in enumerate(theirs.positions_mm):
        write_c3d(tmp_path / "my_laboratory" / f"q{k}.c3d", WALKER15.joints, walk, 40.0)
    (tmp_path / "my_bends").mkdir()
    for k, bend in enumerate(bending_performances(np.random.default_rng(1), performances=6).positions_mm):
        trc.write(tmp_path / "my_bends" / f"r{k}.trc", WALKER15.joints, bend, 30.0)
    (tmp_path / "walk.c3d").write_bytes((tmp_path / "my_walks" / "p0.c3d").read_bytes())
    alphapose(tmp_path / "walk.json", in_layout(clip(60.0, ERROR), "coco17"))
    body = limbs.synthetic_body(np.random.default_rng(1), 100)
    film = camera_paths.around(100, target=body.root_mm, sweep_rad=2.0)
    leg = [WALKER15.index(joint) for joint in ("left_hip", "left_knee", "left_ankle")]
    np.savez(
        tmp_path / "film.npz",
        pixels=film.project(body.positions_mm)[:, leg],
        K=film.intrinsics,
        R=film.rotation,
        t=-(film.rotation @ film.centre[..., None])[..., 0],
        root=body.positions_mm[:, leg[0]],
    )
    turned = np.broadcast_to(film.rotation, (100, 3, 3))
    moved = -(turned @ film.centre[..., None])[..., 0]
    x, y, z, w = Rotation.from_matrix(turned).as_quat().T
    poses = np.column_stack([w, x, y, z, moved])
    lines = [
        f"{k + 1} {' '.join(map(repr, pose.tolist()))} 1 frame_{k:03d}.jpg\n0.5 0.5 -1"
        for k, pose in enumerate(poses)
    ]
    (tmp_path / "images.txt").write_text("\n".join(["# Image list", *lines[::-1]]), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for page in ("README.md", "docs/keypoints.md", "docs/python.md"):
        names: dict[str, object] = {}
        for code in blocks(page, "py"):
            exec(compile(code, page, "exec"), names)
        assert names, page
    assert names["walker"].coefficients.shape == (5, 15, 3)  # type: ignore[attr-defined]
    assert np.abs(names["estimate"].positions - body.positions_mm[:, leg]).max() < 10  # type: ignore[attr-defined]
    np.testing.assert_allclose(names["camera"].rotation, turned, atol=1e-12)  # type: ignore[attr-defined]
    np.testing.assert_allclose(names["camera"].centre, film.centre, atol=1e-6)  # type: ignore[attr-defined]
    leg_again = formats.read(tmp_path / "leg.c3d").positions_mm
    np.testing.assert_allclose(leg_again, names["estimate"].positions, atol=0.01)  # type: ignore[attr-defined]
    assert np.shape(names["warp"]) == (5, 100)
    assert np.mean(names["inside"]) > 0.2  # type: ignore[arg-type]
    assert np.nanmax(tables.read(tmp_path / "angles.csv")["left_knee_deg"]) > 40
    others = {page for page in PAGES if blocks(page, "py")} - {
        "README.md",
        "docs/keypoints.md",
        "docs/python.md",
    }
    assert others == {"docs/extend.md", "docs/pointlight.md"}  # the first is tests/test_plugins.py's


@pytest.mark.parametrize("page", PAGES)
def test_every_make_target_named_exists(page: str) -> None:
    named = set(re.findall(r"(?:^|`)make ([a-z][a-z0-9_-]*)", PAGES[page], re.MULTILINE))
    targets = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE)) | set(presets())
    assert named <= targets, named - targets
    assert page != "README.md" or {"sweeps", "test", "data"} <= named


MADE_LATER = ("results/archive/light/synthetic/", "gallery/")
"""Link targets that do not exist in a fresh clone, because `make archive LIGHT=1` or `make docs` writes them."""


@pytest.mark.parametrize("page", PAGES)
def test_every_file_and_section_that_a_page_links_to_exists(page: str) -> None:
    linked = re.findall(r"\]\(([^)\s]+)\)|(?:src|srcset)=\"([^\"]+)\"", PAGES[page])
    for position in {first or other for first, other in linked}:
        file, _, section = position.partition("#")
        path = (ROOT / page).parent / file if file else ROOT / page
        assert file.startswith(MADE_LATER) or path.is_file(), position
        if section:
            titles = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
            assert section in {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}, (
                position
            )


def test_the_first_screen_is_light() -> None:
    pictures = set(re.findall(r"(?:src|srcset)=\"([^\"]+)\"", README))
    assert sum((ROOT / position).stat().st_size for position in pictures) <= 300_000


@pytest.mark.parametrize("page", PAGES)
def test_every_command_can_be_typed(page: str) -> None:
    """Every displayed command is a `make` command, or a command of the program with valid overrides."""
    lines = [line.split("#")[0].strip() for block in blocks(page, "") for line in block.splitlines()]
    for line in filter(None, lines):
        if line.startswith("make "):
            continue
        assert line.startswith("python -m pipeline "), line
        words = [word for word in shlex.split(line)[3:] if not word.startswith("plugins=")]
        if words[0] not in commands():
            assert compose(words).name in presets(), line


@pytest.mark.parametrize("page", PAGES)
def test_every_override_named_composes(page: str) -> None:
    for line in re.findall(r"^make run ARGS=\"([^\"]+)\"", PAGES[page], re.MULTILINE):
        if line.split()[0] in commands():  # whose options are their own
            continue
        words = [w for w in line.split() if "=" in w and not w.startswith(("hydra/", "hydra."))]
        plain = [re.sub(r"=(\w+),.*", r"=\1", w.replace("'", "")) for w in words]
        assert not plain or compose(plain).name in presets(), line


OPTIONS = sorted(
    {name for text in PAGES.values() for name in re.findall(r"`((?:sweep|model|dataset)\.\w+)`", text)}
)


@pytest.mark.parametrize("option", OPTIONS)
def test_every_option_of_the_table_exists(option: str) -> None:
    group, name = option.split(".")
    assert any(name in {field.name for field in fields(choice)} for choice in options(group).values())


# --- the result tables ------------------------------------------------------------------------------------

LAYOUT = papers.read_mapping(ROOT / "conf" / "readme.yaml")
PUBLISHED = tables.read(ROOT / "results" / "published.csv")


def test_the_result_tables_are_those_of_the_published_numbers() -> None:
    """The result tables on the pages contain the published numbers; `make readme` renews them."""
    quoted = {name: LAYOUT[name] for name in ("headline", "first", "counts")}
    filled = {"figures": listed(), **published.rendered(quoted, PUBLISHED)}
    for page, names in FILLED_PAGES.items():
        assert published.insert(PAGES[page], {name: filled[name] for name in names}) == PAGES[page]
    [error_mm] = [
        value
        for data, name, value in zip(*(PUBLISHED[c] for c in ("data", "name", "value")), strict=True)
        if (data, name) == ("optical", "keypoints_error")
    ]
    assert f"joints are {error_mm:.0f} mm off" in filled["first"]


def test_every_published_number_is_quoted_and_has_a_figure_and_a_commit() -> None:
    quoted = set(published.names_quoted(LAYOUT))
    for figure, name, commit in zip(
        *(PUBLISHED[c].tolist() for c in ("figure", "name", "commit")), strict=True
    ):
        assert re.fullmatch(r"[0-9a-f]{12}", commit)
        if figure:
            claim, _, switch = name.partition(published.SEPARATOR)
            assert papers.quantity(claim).figure == figure
            assert claim in quoted, "a number that no table shows"
            assert not switch or switch in {
                e.run.switch for _, e in papers.claim(claim).explanations if e.run
            }
    assert quoted <= set(PUBLISHED["name"].tolist())


LITTLE = {
    "walks": {
        "corner": "",
        "paper": "paper",
        "columns": {"synthetic": "{zhang2007_walkers:.0f} walkers", "cmu": "`cmu`"},
        "rows": [
            {"label": "error", "paper": "30", "cell": ["{zhang2007_error_of_map:,.0f} mm²", "unknown"]},
            {"label": "counts", "kind": "condition", "verdicts": ["zhang2007"]},
            {"label": "sentences", "kind": "sentence", "verdicts": ["zhang2007"]},
        ],
    }
}


def test_a_table_is_rendered_row_by_row() -> None:
    counts = {
        f"zhang2007, conditions, {answer}": 3 - n for n, answer in enumerate(papers.Kind.CONDITION.answers)
    }
    counts |= {f"zhang2007, sentences, {answer}": n for n, answer in enumerate(papers.Kind.SENTENCE.answers)}
    counts["zhang2007, sentences, agrees, beyond the baseline yes"] = 9
    numbers = {"zhang2007_walkers": 2, "zhang2007_error_of_map": -1234.4, **counts}
    rows = [("synthetic", name, value) for name, value in numbers.items()] + [("cmu", "zhang2007_walkers", 1)]
    output = published.rendered(LITTLE, pd.DataFrame(rows, columns=["data", "name", "value"]))["walks"]
    assert output.splitlines() == [
        "| | paper | 2 walkers | `cmu` |",
        "|---|---|---|---|",
        "| error | 30 | −1 234 mm² | unknown |",
        "| counts | | 3, 2, 1 | |",
        "| sentences | | 0 (9), 1, 2, 3, 4 | |",
    ]


def test_counts_of_an_earlier_rule_leave_their_rows_out() -> None:
    """Published counts of verdicts in an earlier format are left out of the tables."""
    old = {"met": 3, "not met": 0, "cannot be tested on this data": 1}
    rows = [("synthetic", f"zhang2007, conditions, {name}", value) for name, value in old.items()]
    rows += [("synthetic", "zhang2007, sentences, reproduced", 3), ("synthetic", "zhang2007_walkers", 80)]
    output = published.rendered(LITTLE, pd.DataFrame(rows, columns=["data", "name", "value"]))["walks"]
    assert "counts" not in output
    assert "sentences" not in output


def test_a_number_that_is_printed_twice_counts_once() -> None:
    yes = (papers.Agreement.AGREES, "", None, papers.Beyond.YES)
    verdicts = [papers.Verdict(c, *yes) for c in papers.paper("park2011").claims if not c.scope.untestable]
    layout = {"": {"rows": [{"verdicts": ["park2011"]}]}}
    counts = {name: value for _, name, value, _ in published.verdict_counts(verdicts, layout)}
    for kinds in ((papers.Kind.RESULT,), (papers.Kind.SENTENCE,), papers.OF_PAPERS):
        reference = sum(not v.claim.same_as for v in verdicts if v.claim.kind in kinds)
        named = f"park2011, {' and '.join(f'{kind}s' for kind in kinds)}, agrees"
        assert counts[named] == reference
        assert counts[f"{named}, beyond the baseline yes"] == reference
        assert counts[f"{named}, beyond the baseline no"] == 0
    assert any(v.claim.same_as for v in verdicts)


FACTS = {"data": "synthetic", "scale": "full", "provenance": {"commit": "a" * 40, "dirty": False}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Folder with two published figures of two walkers."""
    walkers = {"walker": ["a", "b"], "method": ["map", "map"], "absolute_error_mm2": [1.0, 3.0]}
    for figure, name, table in (
        ("zhang2007_fig5", "table_walkers", walkers),
        ("zhang2007_fig5", "table", {"method": ["map"] * 2, "absolute_error_mm2": [10.0, 30.0]}),
        ("zhang2007_fig3", "table", {"sigma2_mm2": [1.0, 625.0], "absolute_error_mm2": [2.0, 1.0]}),
    ):
        (tmp_path / figure).mkdir(exist_ok=True)
        tables.write(tmp_path / figure / f"{name}.csv", table, sort_by=[])
    for figure in ("zhang2007_fig3", "zhang2007_fig5"):
        write_manifest(tmp_path / figure, FACTS)
    return tmp_path


def test_published_figures_are_measured_and_replace_those_of_the_same_data(folder: Path) -> None:
    rows = published.measured(folder, ["zhang2007_fig3"], LAYOUT, MEASURES)
    values = dict(zip(rows["name"], rows["value"], strict=True))
    assert values["zhang2007_optimal_variance"] == 625.0
    assert values["zhang2007, results, untestable"] == 1.0, "a statistic of people that we generate"
    assert values["zhang2007, conditions, met"] == 1.0
    assert set(rows["commit"]) == {"a" * 12}
    path = folder / "published.csv"
    published.renew(path, rows.assign(data="cmu"))
    published.renew(path, rows.assign(value=0.0))
    published.renew(path, rows)
    result = pd.DataFrame(dict(tables.read(path)))
    assert set(result["data"]) == {"cmu", "synthetic"}
    assert len(result) == 2 * len(rows)
    assert result[result["data"] == "synthetic"]["value"].max() == 625.0


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"scale": "smoke"}, "mixed_figures"),
        ({"provenance": {"commit": "b" * 40, "dirty": False}}, "mixed_figures"),
        ({"provenance": {"commit": "a" * 40, "dirty": True}}, "uncommitted_changes"),
    ],
)
def test_figures_that_do_not_belong_together_are_refused(folder: Path, changes: dict, code: str) -> None:
    write_manifest(folder / "zhang2007_fig3", FACTS | changes)
    with rejects(code):
        published.measured(folder, ["zhang2007_fig3", "zhang2007_fig5"], LAYOUT, MEASURES)
    with rejects("nothing_published"):
        published.measured(folder, ["zhang2007_fig6"], LAYOUT, MEASURES)


def test_small_figures_and_damaged_values_do_not_reach_the_documentation(folder: Path) -> None:
    for figure in ("zhang2007_fig3", "zhang2007_fig5"):
        write_manifest(folder / figure, FACTS | {"scale": "smoke"})
    with rejects("unknown_choice", "scale", value="smoke"):
        published.measured(folder, ["zhang2007_fig3", "zhang2007_fig5"], LAYOUT, MEASURES)
    damaged = {"data": ["cmu"], "name": ["one"], "value": np.array(["1O"])}
    with rejects("not_a_number", "published.csv"):
        published.rendered(LAYOUT, damaged)


def test_a_place_without_a_table_is_refused() -> None:
    with rejects("markers_differ"):
        published.insert("no place", {"walks": "| |"})
