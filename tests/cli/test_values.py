"""Tests of small functions of the command line against results that were computed by hand."""

from __future__ import annotations

import signal
import threading
from dataclasses import dataclass, field
from enum import Enum
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from pipeline.cli import composition, earlier_names, inspect, main, options, sensitivity, walkers
from pipeline.cli.compose import compose
from pipeline.cli.durations import durations, in_words, insert_durations
from pipeline.cli.earlier_names import Change, EarlierNames
from pipeline.cli.errors import sentence
from pipeline.cli.output import tell, tell_section
from pipeline.cli.overrides import quoted
from pipeline.cli.presets import split_named, split_options
from pipeline.cli.progress import Display, line
from pipeline.cli.summary import Outcome, claim_rows, counts, summarise
from pipeline.papers import Agreement, Beyond, Estimate, Evidence, Kind, Verdict
from pipeline.validation import InvalidInput
from tests.papers.test_values import claim
from tests.rejects import rejects


class Colour(Enum):
    red = 1
    blue = 2


@dataclass(kw_only=True)
class Inner:
    size: int = 3
    share: float = 0.5


@dataclass(kw_only=True)
class Outer:
    inner: Inner = field(default_factory=Inner)
    name: str = ""
    names: list[str] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    sure: bool = False
    colour: Colour = Colour.red


# --- durations and arguments ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.0, "2 seconds"), (2.6, "3 seconds"), (49.4, "49 seconds"), (50.0, "a minute"), (89.0, "a minute"),
        (91.0, "2 minutes"), (3600.0, "60 minutes"),
    ],
)  # fmt: skip
def test_durations_in_words(seconds: float, words: str) -> None:
    assert in_words(seconds) == words


def test_durations_are_put_into_every_line_of_a_command() -> None:
    page = "make a  # one (about …)\nmake a X=1  # two (about 9 hours)\nmake b  # none\ntext (about …)\n"
    measured = durations([{"command": "make a", "wall_s": "17"}, {"command": "make a X=1", "wall_s": "600"}])
    assert insert_durations(page, measured) == (
        "make a  # one (about 17 seconds)\nmake a X=1  # two (about 10 minutes)\nmake b  # none\ntext (about …)\n"
    )
    with rejects("no_duration", "durations.csv"):
        insert_durations(page, {"make a": 1.0})


def test_figures_and_options_are_split_from_the_other_arguments() -> None:
    arguments = ["experiment=a,b", "seed=3", "experiment=b,c", "word", "light=1=2", "keep"]
    assert split_named(arguments) == (["a", "b", "c"], ["seed=3", "word", "light=1=2", "keep"])
    assert split_options(arguments, ["light", "keep"]) == (
        {"light": "1=2"},
        ["experiment=a,b", "seed=3", "experiment=b,c", "word", "keep"],
    )


def test_commas_separate_variants_with_m_alone() -> None:
    assert quoted(["data.person=a,b"]) == ["data.person='a,b'"]
    assert quoted(["-m", "data.person=a,b"]) == ["-m", "data.person=a,b"]
    assert quoted(["--multirun", "data.person=a,b"]) == ["--multirun", "data.person=a,b"]
    assert quoted(["skeleton=x", "skeleton"]) == ["skeleton.mapping=x", "skeleton"]
    assert quoted(["scale=True", "scale=-1.5e3", "scale=v2"]) == [
        "scale='True'",
        "scale='-1.5e3'",
        "scale=v2",
    ]
    with rejects("not_an_override"):
        quoted(["=3"])


def test_options_of_a_light_command_have_the_types_of_their_fields() -> None:
    result = options.filled(
        Outer,
        [
            "inner.size=5",
            "inner.share=1e-3",
            "name='a b'",
            "names=[x, y,]",
            "sizes=[1,2]",
            "sure=TRUE",
            "colour=blue",
        ],
    )
    assert result == Outer(
        inner=Inner(size=5, share=1e-3),
        name="a b",
        names=["x", "y"],
        sizes=[1, 2],
        sure=True,
        colour=Colour.blue,
    )
    assert options.filled(Outer, ["name='"]).name == "'"
    assert options.filled(Outer, ["name='a\""]).name == "'a\""
    assert options.filled(Outer, ["name=a'a"]).name == "a'a"


@pytest.mark.parametrize(
    ("item", "code", "where"),
    [
        ("inner.size=x", "not_a_number", "inner.size"), ("inner=3", "several_options", "inner"),
        ("size=3", "unknown_option", "size"), ("inner.name=3", "unknown_option", "inner.name"),
        ("names=x", "not_a_list", "names"), ("sure=1", "unknown_choice", "sure"),
        ("colour=green", "unknown_choice", "colour"),
    ],
)  # fmt: skip
def test_options_that_do_not_fit_are_refused(item: str, code: str, where: str) -> None:
    with rejects(code, where):
        options.filled(Outer, [item])


def test_a_source_and_the_options_of_a_walker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a=b").touch()
    assert walkers.options_of(["a=b", "name=x"], Outer, usage="u") == ("a=b", Outer(name="x"))
    for arguments in (["name=x"], ["one", "two"]):
        with rejects("no_source"):
            walkers.options_of(arguments, Outer, usage="u")
    (tmp_path / "folder").mkdir()
    assert [walkers.kind_of(source, [], {}) for source in ("synthetic", "author", "walk.c3d", "folder")] == [
        "synthetic", "author", "recording", "figure",
    ]  # fmt: skip
    (tmp_path / "folder" / walkers.SUMMARY).touch()
    assert walkers.kind_of("folder", ["fps=3"], {"fps": "film, recording"}) == "film"
    with rejects("no_effect", "fps"):
        walkers.kind_of("synthetic", ["fps=3"], {"fps": "film"})
    assert walkers.target_file("x.CSV", (".c3d", ".csv"), "u", "s", replace=False) == Path("x.CSV")
    Path("x.csv").touch()
    for to, code in (("", "no_target"), ("x.txt", "unknown_format"), ("x.csv", "not_replaced")):
        with pytest.raises(InvalidInput) as caught:
            walkers.target_file(to, (".c3d", ".csv"), "u", "s", replace=False)
        assert caught.value.code == code


def test_recordings_of_a_folder_and_what_else_is_in_it(tmp_path: Path) -> None:
    for name in ("b.c3d", "a/c.BVH", "a/notes.txt", "a/.hidden", "skeleton.asf", "README", "x.pdf", "y.PDF"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("x")
    (tmp_path / "folder.c3d").mkdir()
    files = inspect.recordings(tmp_path)
    assert [path.relative_to(tmp_path).as_posix() for path in files if path.suffix != ".txt"] == [
        "a/c.BVH",
        "b.c3d",
    ]
    assert inspect.recordings(tmp_path / "x.pdf") == [tmp_path / "x.pdf"]
    others = inspect._other_files(tmp_path)
    assert others.startswith("2 .pdf")
    assert others.endswith("1 no suffix")
    assert "asf" not in others
    (tmp_path / "empty").mkdir()
    for folder, code in (("empty", "no_recordings"), ("none", "no_file")):
        with rejects(code, folder):
            inspect.recordings(tmp_path / folder)
    assert inspect._other_files(tmp_path / "empty") == ""


# --- messages --------------------------------------------------------------------------------------------------


def test_errors_that_a_user_can_correct_have_a_sentence() -> None:
    missing = FileNotFoundError(2, "No such file", "a.c3d")
    assert sentence(missing) == "a.c3d: No such file"
    assert sentence(OSError("no number")) == sentence(OSError(2, "No such file")) == ""
    assert sentence(MemoryError("3 GB")) == "there is not enough memory: 3 GB"
    assert sentence(ValueError("a bug")) == sentence(ModuleNotFoundError("x")) == ""
    assert "papers" in sentence(ModuleNotFoundError("x", name="numba"))
    assert sentence(InvalidInput("is wrong", "here")) == "here: is wrong"


def test_styles_are_for_terminals_alone(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    tell_section("title", ["one", "two\x1b"])
    assert capsys.readouterr().out.splitlines()[:2] == ["title", "  one"]
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    tell("plain")
    tell("strong", "bold")
    tell("weak", "dim")
    assert capsys.readouterr().out == "plain\n\x1b[1mstrong\x1b[0m\n\x1b[2mweak\x1b[0m\n"


def outcome(folder: Path, name: str, **changes: Any) -> Outcome:
    """Return the outcome of a figure that took 10 s."""
    seconds = {"ingest": 1.0, "dataset": 2.0, "model": 3.0, "sweep": 3.5, "figure": 0.5}
    settings: dict[str, Any] = {"figure": name, "folder": folder, "seconds": seconds, "processor_s": 12.25}
    return Outcome(**{**settings, "reused": (), "remarks": (), "verdicts": [], **changes})


def test_the_summary_of_figures(tmp_path: Path) -> None:
    for name in ("table.csv", "table_walkers.csv", "figure.png", "recording.rrd", "notes.txt"):
        (tmp_path / name).touch()
    outcomes = [
        outcome(tmp_path, "one", reused=("ingest", "model"), remarks=("look",)),
        outcome(tmp_path, "two", remarks=("look", "again")),
    ]
    assert line("3/12", outcomes[0]) == (
        f"3/12 one: 10.0 s, 12.2 s of processor time, reused ingest model, {tmp_path}/"
    )
    console = Console(file=StringIO(), width=300)
    summarise(outcomes, [], console, seconds=11.5)
    text = console.file.getvalue()  # type: ignore[attr-defined]
    rows = [row.split() for row in text.splitlines()]
    assert ["one", "10.00", "0.50", "12.25", "ingest", "model"] in rows
    assert ["two", "10.00", "0.50", "12.25", "-"] in rows
    assert text.count(f"{tmp_path}/") == 1
    assert "Files: 4 tables, 2 recordings." in text
    assert "Made in 11.5 s with 24.5 s of processor time" in text
    assert "ingest 2.0, dataset 4.0, model 6.0, sweep 7.0, figure 1.0" in text
    assert text.count("look") == text.count("again") == 1


def verdict(kind: Kind, agreement: Agreement, beyond: Beyond, **changes: Any) -> Verdict:
    """Return a verdict on a claim of zhang2007."""
    judged = claim(kind=kind, paper="zhang2007", **changes)
    evidence = Evidence(value=Estimate(8.0, 7.0, 9.0), baseline=Estimate(20.0))
    return Verdict(judged, agreement, "a reason", evidence, beyond)


def test_rows_and_counts_of_claims() -> None:
    verdicts = [
        verdict(Kind.TARGET, Agreement.AGREES, Beyond.YES),
        verdict(Kind.RESULT, Agreement.AGREES, Beyond.YES),
        verdict(Kind.RESULT, Agreement.DIFFERS, Beyond.NOT_APPLICABLE, published=None),
        verdict(Kind.RESULT, Agreement.AGREES, Beyond.NO),
        Verdict(claim(kind=Kind.RESULT, paper="zhang2007"), Agreement.UNTESTABLE, "no data"),
    ]
    rows = claim_rows(verdicts)
    assert [row["kind"] for row in rows] == ["result"] * 4 + ["target"]
    assert [(row["beyond baseline"], row["why"], row["published"]) for row in rows] == [
        ("yes", "", "10"), ("", "a reason", ""), ("no", "", "10"), ("", "", "10"), ("yes", "", "10"),
    ]  # fmt: skip
    assert [(row["ours"], row["baseline"], row["quote"]) for row in rows[2:]] == [
        ("8 [7, 9]", "20", "“about 10 mm”"), ("", "", "“about 10 mm”"), ("8 [7, 9]", "20", "about 10 mm"),
    ]  # fmt: skip
    lines = counts(verdicts)
    assert lines[:2] == [
        "results: 2 agrees (1 beyond the baseline, 1 not), 1 differs, 1 untestable",
        "targets: 1 agrees (1 beyond the baseline)",
    ]
    assert [text for text in lines[2:] if text.startswith("zhang2007")]


# --- earlier names and switches ---------------------------------------------------------------------------


def test_columns_of_an_archive_have_todays_names() -> None:
    names = EarlierNames(
        columns={
            "fig/table.csv/old": Change(now="new"), "table.csv/gone": Change(gone="why"),
            "table.csv/late": Change(added="why"),
            "fig/table.csv/words": Change(text="why"), "other/table.csv/kept": Change(gone="why"),
        }
    )  # fmt: skip
    archived: dict[str, Any] = {"old": 1, "gone": 2, "words": 3, "kept": 4}
    today: dict[str, Any] = {"new": 5, "late": 6, "words": 7, "kept": 8}
    assert names.alike("fig", "table.csv", archived, today) == ({"new": 1, "kept": 4}, {"new": 5, "kept": 8})
    assert names.alike("fig", "table.csv", {"late": 1}, today)[1] == {"new": 5, "late": 6, "kept": 8}
    assert names.alike("fig", "table_more.csv", archived, today) == (archived, today)


def test_presets_and_options_that_were_renamed() -> None:
    names = EarlierNames(
        files={"experiment/a": Change(now="experiment/b")}, classes={"A": Change(now="B")},
        options={"Inner.length": Change(now="size"), "Colour.green": Change(now="blue")},
    )  # fmt: skip
    assert (names.todays_preset("a").now, names.todays_preset("c").now) == ("b", "c")
    assert (names.todays_class("A"), names.todays_class("C")) == ("B", "C")
    assert (names.todays_choice(Colour, "green"), names.todays_choice(Colour, "red")) == ("blue", "red")
    rejection = names.option_rejection(Inner, "sweep.length")
    assert rejection is not None
    assert (rejection.where, "sweep.size" in str(rejection)) == ("sweep.length", True)
    assert names.option_rejection(Inner, "sweep.size") is None
    assert names.rejection("experiment", "c") is None
    assert "b" in str(names.rejection("experiment", "a"))
    assert earlier_names.earlier_names().files


def test_switches_of_a_data_set() -> None:
    group = {
        "common": ["a=1"], "figures": ["f", "g"],
        "switches": {
            "longer walk": {"overrides": ["b=2"]},
            "optical one": {"overrides": ["c=3"], "data": ["optical"], "figures": ["g"]},
        },
    }  # fmt: skip
    plain, longer, optical = sensitivity.switches(group, "optical")
    assert (plain.common, plain.overrides, plain.figures) == (("a=1",), (), ("f", "g"))
    assert (longer.overrides, longer.figures, optical.figures) == (("b=2",), ("f", "g"), ("g",))
    assert [switch.name for switch in sensitivity.switches(group, "synthetic")] == [plain.name, "longer walk"]
    first, only = sensitivity._selected([plain, longer, optical], {"optical_one"})
    assert (first.figures, only.name) == (("g",), "optical one")


@pytest.mark.parametrize(("value", "outside"), [(6.9, True), (7.0, False), (9.0, False), (9.1, True)])
def test_a_switch_moves_an_answer_or_a_value(value: float, outside: bool) -> None:
    before = verdict(Kind.RESULT, Agreement.AGREES, Beyond.YES)
    after = Verdict(before.claim, Agreement.AGREES, "", Evidence(value=Estimate(value)), Beyond.NO)
    (row,) = sensitivity.compare([before], [after], "a switch")
    assert (row["value"], row["value_as_it_is"], row["outside_the_interval"]) == (value, 8.0, outside)
    assert (row["answer_moves"], row["beyond_baseline"], row["beyond_baseline_as_it_is"]) == (
        True,
        "no",
        "yes",
    )
    (row,) = sensitivity.compare([before], [before], "a switch")
    assert not row["answer_moves"]
    unjudged = Verdict(before.claim, Agreement.UNTESTABLE, "")
    assert (
        sensitivity.compare([before], [unjudged], "") == sensitivity.compare([unjudged], [before], "") == []
    )
    assert sensitivity.compare([], [before], "") == []
    assert sensitivity._answers(row) == "agrees, beyond its baseline: yes"
    assert sensitivity.moved_table([row]).row_count == 0
    assert sensitivity.moved_table([row | {"answer_moves": True}]).row_count == 1


def test_a_duration_is_not_negative() -> None:
    assert durations([{"command": "make a", "wall_s": "0"}]) == {"make a": 0.0}
    with rejects("out_of_range", "make a"):
        durations([{"command": "make a", "wall_s": "-0.5"}])


@pytest.mark.parametrize("main_thread", [True, False])
def test_signals_interrupt_the_main_thread_alone_and_are_given_back(main_thread: bool) -> None:
    handlers: list[str] = []

    def run() -> None:
        with main._interrupted_by_signals():
            handlers.append("changed" if signal.getsignal(signal.SIGTERM) is not before else "kept")

    before = signal.getsignal(signal.SIGTERM)
    if main_thread:
        run()
        with pytest.raises(KeyboardInterrupt), main._interrupted_by_signals():
            signal.raise_signal(signal.SIGTERM)
    else:
        thread = threading.Thread(target=run)
        thread.start()
        thread.join()
    assert handlers == ["changed" if main_thread else "kept"]
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize("named", [True, False])
def test_a_figure_without_a_folder_is_made_in_that_of_its_options(
    named: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders: list[Path] = []

    def make_figures(jobs: list[tuple[Any, Path]], *, console: Console) -> list[str]:
        folders.extend(folder for _, folder in jobs)
        return ["a", "b"]

    monkeypatch.setattr("pipeline.cli.figures.make_figures", make_figures)
    overrides = ["experiment=zhang2007_fig5", "scale=smoke", f"results={tmp_path}"]
    assert main._make_one(compose(overrides), overrides, tmp_path / "here" if named else None) == "a"
    assert folders == [tmp_path / ("here" if named else "synthetic/smoke/zhang2007_fig5")]


def test_a_display_counts_figures_and_hides_those_that_ended() -> None:
    console = Console(file=StringIO(), force_terminal=True, width=100)
    experiments = [compose([f"experiment={name}"]) for name in ("zhang2007_fig2", "zhang2007_fig5")]
    with Display(experiments, console, slots=1) as display:
        whole, slot = display._progress.tasks
        assert (whole.total, slot.visible) == (sum(each.cost_s for each in experiments), False)
        display.began(0, 1)
        display.at(0, "sweep")
        assert (slot.description, slot.completed, slot.total) == ("zhang2007_fig5: sweep", 3, 5)
        assert slot.visible
        display.ended(0, 1, Outcome("zhang2007_fig5", Path("x"), {"sweep": 1.0}, (), [], (), 1.0))
        assert not slot.visible
        assert (whole.completed, whole.fields["count"]) == (experiments[1].cost_s, "1/2")
        display.note("words")
        assert whole.description == "words"
    assert isinstance(console.file, StringIO)
    assert "1/2 zhang2007_fig5" not in console.file.getvalue()


def test_arguments_are_split_by_a_condition_in_their_order() -> None:
    assert main._split(["a", "b=1", "c"], lambda item: "=" in item) == (["b=1"], ["a", "c"])


@pytest.mark.parametrize("own", [True, False])
def test_the_folder_of_a_preset_is_its_own(own: bool, tmp_path: Path) -> None:
    experiment = compose(["experiment=zhang2007_fig5", "scale=smoke", f"results={tmp_path}"])
    folder = tmp_path / "synthetic" / "smoke" / ("zhang2007_fig5" if own else "other")
    assert main._is_presets_own(experiment, folder) is own


@pytest.mark.parametrize(("exists", "called"), [(True, True), (False, False)])
def test_variants_are_compared_where_there_are_any(
    exists: bool,
    called: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    compared: list[Path] = []

    def compare_variants(run: Path) -> list[Path]:
        compared.append(run)
        return [Path("one"), Path("two")]

    monkeypatch.setattr("pipeline.report.variants.compare_variants", compare_variants)
    run = tmp_path if exists else tmp_path / "none"
    main._compare(run)
    assert compared == ([run] if called else [])
    assert capsys.readouterr().out == ("compared in one, two\n" if called else "")


def test_commas_are_quoted_unless_they_separate_variants() -> None:
    assert quoted(["data.path=/a,b"]) == ["data.path='/a,b'"]
    for word in ("-m", "--multirun"):
        assert quoted([word, "data.path=/a,b"])[1] == "data.path=/a,b"


def test_an_option_that_a_class_does_not_have_is_refused_at_any_depth() -> None:
    options_of_inner = Inner()
    composition._reject_additions(options_of_inner, "")
    options_of_inner.more = 1  # type: ignore[attr-defined]
    with rejects("unknown_option", "outer.more"):
        composition._reject_additions(options_of_inner, "outer.")
    composition._reject_additions(3, "a")
