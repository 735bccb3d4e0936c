"""What comes from the user's cache is what composing and judging give, and never of other sources or tables."""

from __future__ import annotations

import dataclasses
import itertools
import os
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from hydra.errors import ConfigCompositionException

from pipeline.cli import composition
from pipeline.cli.compose import _classes, _rests_on, _schema, compose, on_this_machine
from pipeline.cli.errors import sentence
from pipeline.cli.figures import judged
from pipeline.cli.presets import CONF, presets
from pipeline.storage import tables, user_cache
from pipeline.storage.sealed_folders import write_manifest
from pipeline.studies.ledger import judge_folder
from pipeline.studies.registry import all_measures
from pipeline.validation import InvalidInput
from tests.studies.test_ledger import SPECTRUM

MEASURES = all_measures()


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("GAIT_PIPELINE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def composed(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The overrides that were composed, in turn."""
    asked: list[list[str]] = []
    real = composition.composed

    def counted(overrides: list[str]) -> object:
        asked.append(list(overrides))
        return real(overrides)

    monkeypatch.setattr(composition, "composed", counted)
    return asked


@pytest.mark.parametrize("data", ["synthetic", "optical", "many", "folder"])
def test_the_second_time_it_is_the_same(data: str, tmp_path: Path, composed: list[list[str]]) -> None:
    for name in presets() if data == "synthetic" else ["zhang2007_sources", "park2011_fig4"]:
        overrides = [f"experiment={name}", f"data={data}", f"data.path={tmp_path}"][: 2 + (data == "folder")]
        first, second = compose(overrides), compose(overrides)
        assert composed == [overrides], "the second comes from the cache"
        assert second == first
        assert repr(second) == repr(first), "in the order of its parts, too"
        del composed[:]


def test_the_first_time_it_is_what_is_composed() -> None:
    overrides = ["experiment=zhang2007_fig5", "scale=smoke"]
    assert compose(overrides) == on_this_machine(composition.composed(overrides))


def test_what_it_rests_on_is_asked_again(monkeypatch: pytest.MonkeyPatch, composed: list[list[str]]) -> None:
    overrides = ["experiment=zhang2007_fig5", "data=cmu"]
    for mirror, cores, of in (("a", 1, "x"), ("b", 1, "x"), ("b", 2, "x"), ("b", 2, "y"), ("b", 2, "y")):
        monkeypatch.setenv("MOCAP_MIRROR", mirror)
        monkeypatch.setattr("pipeline.cli.compose.usable_cores", lambda cores=cores: cores)
        monkeypatch.setattr("pipeline.cli.compose._rests_on", lambda of=of: of)
        assert compose(overrides).data.mirror == mirror  # type: ignore[attr-defined]
    assert len(composed) == 4


def test_what_was_composed_while_somebody_edited_is_not_kept(
    monkeypatch: pytest.MonkeyPatch, composed: list[list[str]]
) -> None:
    editions = map(str, itertools.count())
    monkeypatch.setattr("pipeline.cli.compose._rests_on", lambda: next(editions))
    for _ in range(2):
        compose(["experiment=zhang2007_fig5"])
    assert len(composed) == 2


def test_a_damaged_file_is_composed_again(own_cache: Path, composed: list[list[str]]) -> None:
    overrides = ["experiment=zhang2007_fig5"]
    first = compose(overrides)
    (kept,) = [path for path in own_cache.rglob("*.json") if b'"zhang2007_fig5"' in path.read_bytes()]
    whole = kept.read_bytes()
    for damaged in (whole[:100], b"[]", b"", whole.replace(b"2007", b"2008", 1), b"\xff" * 100):
        assert damaged != whole
        kept.write_bytes(damaged)
        del composed[:]
        assert compose(overrides) == first
        assert len(composed) == 1


def test_the_last_folder_of_results_counts() -> None:
    assert compose(["experiment=zhang2007_fig5", "results=one", "results=two"]).results == "two"
    assert (
        compose(["experiment=zhang2007_fig5", "results=one", "results='two and a half'"]).results[:4]
        == "two "
    )
    for nowhere in ("results=", "results=null", "results=~/three"):
        with pytest.raises((InvalidInput, ConfigCompositionException), match="results"):
            compose(["experiment=zhang2007_fig5", "results=one", nowhere])


def test_a_refusal_is_not_kept(composed: list[list[str]]) -> None:
    for _ in range(2):
        with pytest.raises(InvalidInput, match="results must name a folder"):
            compose(["experiment=zhang2007_fig5", "results=' '"])
    assert len(composed) == 1, "the options are kept, and refused on this machine each time"


def test_what_cannot_be_kept_is_composed_each_time(composed: list[list[str]]) -> None:
    for _ in range(2):
        experiment = compose(["experiment=zhang2007_fig5", "sweep.view_angle_deg.step=nan"])
        with pytest.raises(InvalidInput, match="must be above 0"):
            experiment.validate()
    assert len(composed) == 2


def test_it_rests_on_the_files_of_options_and_not_on_those_of_papers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "conf"
    shutil.copytree(CONF, copy)
    monkeypatch.setattr("pipeline.cli.compose.CONF", copy)
    before = _rests_on()
    for name in ("paper/zhang2007.yaml", "experiment/zhang2007_fig5.yaml", "config.yaml", "scale/smoke.yaml"):
        path = copy / name
        whole = path.read_bytes()
        path.write_bytes(whole + b"# edited\n")
        assert (_rests_on() == before) == name.startswith("paper")
        path.write_bytes(whole)
    assert _rests_on() == before
    (copy / "model" / "of_mine.yaml").write_text("a: 1\n")
    assert _rests_on() != before


@pytest.mark.parametrize(
    ("preset", "words"),
    [
        ("defaults:\n", "conf: .*broken', defaults must be a list"),
        ("name: [a\n", r"while parsing .*broken\.yaml"),
        ("foo: 1\n", "Key 'foo' not in 'Experiment'"),
        ("title: \udce9\n", r"broken\.yaml \(save it as UTF-8\): 'utf-8' codec can't decode byte 0xe9"),
        (
            "defaults:\n  - zhang2004_fig2\n",
            r"experiment/broken\.yaml, name must be that of the file \(expected broken, got zhang2004_fig2\)",
        ),
    ],
)
def test_a_broken_preset_is_refused_in_a_sentence(
    preset: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(CONF, tmp_path / "conf")
    monkeypatch.setattr("pipeline.cli.composition.CONF", tmp_path / "conf")
    (tmp_path / "conf" / "experiment" / "broken.yaml").write_text(
        f"# @package _global_\n{preset}", encoding="utf-8", errors="surrogateescape"
    )
    with pytest.raises(Exception) as caught:
        composition.composed(["experiment=broken"])
    assert re.search(words, sentence(caught.value))


def test_a_preset_may_stand_in_brackets() -> None:
    assert composition.composed(["experiment=[zhang2007_fig5]"]).name == "zhang2007_fig5"


def test_a_paper_that_does_not_exist_is_refused() -> None:
    experiment = compose(["experiment=zhang2007_fig5"])
    experiment.paper = "nobody1999"
    with pytest.raises(InvalidInput, match=r"paper must be one of .*zhang2007 \(got nobody1999\)"):
        on_this_machine(experiment)


@pytest.mark.parametrize(
    "changed",
    [
        {"components": dataclasses.field(default=7)},
        {"components": dataclasses.field(default_factory=lambda: 30)},
        {"components": dataclasses.field(default=30, metadata={"scale": {"value": "walkers"}})},
        {"further": dataclasses.field(default=1)},
    ],
)
def test_it_rests_on_the_classes_of_options(changed: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    def schema(fields: dict[str, Any]) -> str:
        of = {"components": dataclasses.field(default=30)} | fields
        made = dataclasses.make_dataclass("Model", [(name, int, field) for name, field in of.items()])
        with monkeypatch.context() as patch:
            patch.setattr("pipeline.studies.registry.options", lambda group: {"one": made})
            patch.setattr("pipeline.cli.compose._classes", _classes.__wrapped__)
            return _schema.__wrapped__()

    assert schema({}) == schema({})
    made = "components" in changed and changed["components"].default is dataclasses.MISSING
    assert (schema(changed) == schema({})) == made, "a factory's value counts, not that it is made"


def test_without_a_cache_it_is_composed_each_time(
    monkeypatch: pytest.MonkeyPatch, composed: list[list[str]]
) -> None:
    monkeypatch.setenv("GAIT_PIPELINE_CACHE", "/dev/null")
    assert compose(["experiment=zhang2007_fig5"]) == compose(["experiment=zhang2007_fig5"])
    assert len(composed) == 2


def test_old_editions_go_and_files_of_others_stay(own_cache: Path) -> None:
    mine = own_cache / ("a" * 32)
    mine.mkdir(parents=True)
    (mine / "thesis.json").write_text("mine")
    (own_cache / "photographs-of-thirty-two-letters").mkdir()
    for path in own_cache.iterdir():
        os.utime(path, (0, 0))
    for number in range(user_cache.KEPT + 3):
        user_cache.write("0" * 32 + ".json", b"1", of=f"{number:032d}")
        os.utime(own_cache / f"{number:032d}", (number + 1, number + 1))
    assert user_cache.read("0" * 32 + ".json", of=f"{user_cache.KEPT + 2:032d}") == b"1"
    assert user_cache.read("0" * 32 + ".json", of=f"{0:032d}") is None
    assert (mine / "thesis.json").read_text() == "mine"
    assert len(list(own_cache.iterdir())) <= user_cache.KEPT + 3


def test_verdicts_are_remembered_by_the_content_of_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "full" / "zhang2007_fig2"
    folder.mkdir(parents=True)

    def publish(first_share: float) -> None:
        (folder / "manifest.json").unlink(missing_ok=True)
        person = {"person": ["a", "a", "b", "b"], "variance_fraction": [first_share, 0.06, 0.918, 0.06]}
        for name, columns in SPECTRUM.items():
            more = person if name == "table_harmonics" else {}
            tables.write(folder / f"{name}.csv", {**columns, **more}, replace=lambda old: True)
        write_manifest(folder, {"scale": "full"})

    publish(0.92)
    asked = (folder.parent, "synthetic", ["zhang2007_fig2"])
    first = judged(*asked)
    assert repr(first) == repr(judge_folder(*asked, measures=MEASURES))
    assert any(one.evidence and one.evidence.value.known for one in first)
    with monkeypatch.context() as patched:
        patched.setattr("pipeline.cli.figures.judge_folder", None)
        assert repr(judged(*asked)) == repr(first)
    table = folder / "table.csv"
    kept = table.read_bytes()
    table.write_bytes(kept.replace(b"1", b"2", 1))
    with pytest.raises(InvalidInput, match="the table was changed after it was published"):
        judged(*asked)
    table.write_bytes(kept)
    assert repr(judged(*asked)) == repr(first)
    publish(0.5)
    assert repr(judged(*asked)) != repr(first)
