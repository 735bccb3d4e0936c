"""Tests of the store: results are found by key, written completely or not at all, and checked when read."""

import errno
import hashlib
import importlib.metadata
import io
import json
import os
import platform
import shutil
import signal
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline import locks
from pipeline.storage import provenance as provenance_module
from pipeline.storage import sealed_folders
from pipeline.storage import store as store_module
from pipeline.storage.artefacts import content_digest
from pipeline.storage.provenance import versions
from pipeline.storage.publishing import new_file, publish, require_new
from pipeline.storage.sealed_folders import canonical, complaints_about, write_manifest
from pipeline.storage.store import Artefact
from pipeline.storage.store import Store as PlainStore
from pipeline.validation import InvalidInput
from tests.processes import WAIT_S, finished, is_complete, python, started
from tests.rejects import rejects


class Store(PlainStore):
    """Store that assumes unchanged source code, unless a test passes another digest of the code."""

    def artefact(self, *arguments: Any, code: str = "0" * 64) -> Artefact:
        return super().artefact(*arguments, code=code)


class Method(Enum):
    MAP = "map"
    LEAST_SQUARES = "ls"


@dataclass(kw_only=True)
class Grid:
    start: float = -90.0
    stop: float = 90.0
    step: float = 1.0


@dataclass(kw_only=True)
class Options:
    sigma2: float = 70.0
    components: int = 15
    method: Method = Method.MAP
    view_angle_deg: Grid = field(default_factory=Grid)


@dataclass(kw_only=True)
class OtherOptions(Options):
    pass


class Work:
    """Computation that counts how often it runs."""

    def __init__(self, seed: int = 0) -> None:
        self.times = 0
        self.seed = seed

    def __call__(self) -> tuple[dict[str, Any], dict[str, Any]]:
        self.times += 1
        numbers = np.random.default_rng(self.seed).normal(size=(7, 5))
        arrays = {
            "numbers": numbers,
            "transposed": numbers.T,
            "every_other": numbers[::2, ::2],
            "zero": np.float64(3.0),
            "names": np.array(["head", "sternum"]),
            "none": np.zeros((0, 3)),
            "trial/02_01": np.arange(3, dtype=np.int8),
        }
        return arrays, {"clips": ["a", "b"], "rate_hz": 120.0, "pair": (1, 2)}


def same(a: Artefact, b: Artefact) -> None:
    """Assert that two artefacts contain the same bits in the same memory layout."""
    assert (a.stage, a.key, a.notes, list(a.arrays)) == (b.stage, b.key, b.notes, list(b.arrays))
    for name, array in a.arrays.items():
        other = b.arrays[name]
        assert array.dtype == other.dtype
        assert array.shape == other.shape
        assert array.strides == other.strides or not array.size
        assert array.tobytes() == other.tobytes()


def leftovers(results: Path) -> list[str]:
    return [p.name for p in results.rglob(".*")]


# --- what is found again ---------------------------------------------------------------------------------


def test_the_second_request_computes_nothing(tmp_path: Path) -> None:
    work = Work()
    first = Store(tmp_path).artefact("dataset", Options(), ["aa"], work)
    assert (first.computed, first.why, work.times) == (True, "first time", 1)
    store = Store(tmp_path)
    again = store.artefact("dataset", Options(), ["aa"], work)
    assert (again.computed, again.why, work.times) == (False, "", 1)
    same(first, again)
    assert first.notes == {"clips": ["a", "b"], "rate_hz": 120.0, "pair": [1, 2]}
    assert sorted(p.name for p in (tmp_path / "cache").iterdir()) == [first.name]
    assert is_complete(tmp_path / "cache" / first.name)


def test_a_dry_run_computes_and_writes_nothing(tmp_path: Path) -> None:
    work = Work()
    planned = Store(tmp_path, dry_run=True).artefact("model", {"n": 1}, [], work)
    assert (planned.computed, planned.content, work.times, [*tmp_path.iterdir()]) == (True, "", 0, [])
    output = Store(tmp_path).artefact("model", {"n": 1}, [], work)
    dry = Store(tmp_path, dry_run=True, before={"model": (output.key, output.content)})
    again, other = (dry.artefact("model", {"n": n}, [], work) for n in (1, 2))
    assert (again.key, again.content, again.computed, again.why) == (output.key, output.content, False, "")
    assert (other.computed, other.content, other.why) == (True, "", "options.n changed 1 -> 2")
    assert [step["options"] for step in dry.steps] == [{"n": 1}, {"n": 2}]
    assert work.times == 1


def test_within_one_process_even_the_disk_is_not_asked(tmp_path: Path) -> None:
    store, work = Store(tmp_path), Work()
    first = store.artefact("dataset", {}, [], work)
    (tmp_path / "cache" / first.name).rename(tmp_path / "elsewhere")
    again = store.artefact("dataset", {}, [], work)
    assert (again.computed, work.times) == (False, 1)
    assert again.arrays["numbers"] is first.arrays["numbers"]
    again.notes["clips"].append("c")
    assert store.artefact("dataset", {}, [], work).notes["clips"] == ["a", "b"]


def test_arrays_cannot_be_changed(tmp_path: Path) -> None:
    mine = np.zeros(3)
    for _ in range(2):
        output = Store(tmp_path).artefact("dataset", {}, [], lambda: ({"x": mine}, {}))
        with pytest.raises(ValueError, match="read-only"):
            output.arrays["x"][0] = 1
        with pytest.raises(TypeError):
            output.arrays["y"] = mine  # type: ignore[index]
    mine[0] = 1  # the caller's own array stays the caller's


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (Options(sigma2=80.0), "options.sigma2 changed 70.0 -> 80.0"),
        (Options(view_angle_deg=Grid(step=5.0)), "options.view_angle_deg.step changed 1.0 -> 5.0"),
        (Options(method=Method.LEAST_SQUARES), 'options.method.name changed "MAP" -> "LEAST_SQUARES"'),
        (OtherOptions(), 'options.<type> changed "Options" -> "OtherOptions"'),
        (
            Options(sigma2=1.0, components=2),
            "options.components changed 15 -> 2; options.sigma2 changed 70.0 -> 1.0",
        ),
    ],
)
def test_another_option_is_another_key_and_the_reason_is_named(
    tmp_path: Path, options: Options, why: str
) -> None:
    before = Store(tmp_path).artefact("model", Options(), [], Work())
    now = Store(tmp_path).artefact("model", options, [], Work())
    assert now.key != before.key
    assert now.computed
    assert now.why == why


def test_the_reason_compares_with_the_most_alike(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.artefact("model", {"a": 1, "b": 1, "c": 1}, [], Work())
    store.artefact("model", {"a": 2, "b": 2, "c": 2}, [], Work())
    store.artefact("other", {"a": 1, "b": 1, "c": 3}, [], Work())
    assert store.artefact("model", {"a": 1, "b": 1, "c": 3}, [], Work()).why == "options.c changed 1 -> 3"
    why = store.artefact("model", {"a": 9, "b": 9, "d": 9, "e": 9}, [], Work()).why
    assert why.endswith("and 2 more")


def test_another_seed_is_another_key(tmp_path: Path) -> None:
    store = Store(tmp_path)
    keys = {store.artefact("dataset", {"seed": seed}, [], Work(seed)).key for seed in range(4)}
    assert len(keys) == 4


def test_another_input_is_another_key(tmp_path: Path) -> None:
    store = Store(tmp_path)
    data = store.artefact("dataset", {"seed": 0}, [], Work())
    other = store.artefact("dataset", {"seed": 1}, [], Work(1))
    model = store.artefact("model", {}, [data, "f" * 64], Work())
    changed = store.artefact("model", {}, [other, "f" * 64], Work())
    assert changed.key != model.key
    assert changed.why == f"input dataset-{other.content} changed"
    assert store.artefact("model", {}, [data, "0" * 64], Work()).why == "input 000000000000… changed"
    fewer = store.artefact("model", {}, [data], Work())
    assert fewer.why == "inputs changed in number or order (2 -> 1)"
    assert store.artefact("model", {}, ["a", "b", "c"], Work()).why == (
        "input a changed; input b changed; input c changed"
    )


def test_an_input_that_comes_out_equal_changes_nothing(tmp_path: Path) -> None:
    before = Store(tmp_path).artefact("dataset", {}, [], Work())
    work = Work()
    model = Store(tmp_path).artefact("model", {}, [before], work)
    again = Store(tmp_path).artefact("dataset", {}, [], Work(), code="1" * 64)
    assert (again.computed, again.why) == (True, "code changed")
    assert again.key != before.key
    assert again.content == before.content == Store(tmp_path).artefact("dataset", {}, [], Work()).content
    result = Store(tmp_path).artefact("model", {}, [again], work)
    assert (result.computed, result.key, work.times) == (False, model.key, 1)


def test_other_sources_are_another_key(tmp_path: Path) -> None:
    before = Store(tmp_path).artefact("model", {}, [], Work())
    now = Store(tmp_path).artefact("model", {}, [], Work(), code="1" * 64)
    assert now.key != before.key
    assert now.why == "code changed"


@pytest.mark.parametrize("library", ["numpy", "scipy", "pandas", "numba"])
def test_another_version_of_a_library_that_computes_is_another_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: str
) -> None:
    Store(tmp_path).artefact("model", {}, [], Work())
    monkeypatch.setattr(store_module, "versions", lambda packages: versions(packages) | {library: "0"})
    again = Store(tmp_path).artefact("model", {}, [], Work())
    assert again.why == f'libraries.{library} changed "{importlib.metadata.version(library)}" -> "0"'


def test_the_key_does_not_depend_on_the_process_or_on_order(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from pipeline.storage.store import Store\n"
        "print(Store(Path(sys.argv[1])).artefact('s', {'b': 0.1, 'a': {'y': 1, 'x': (2, None)}}, ['i'],"
        " lambda: ({}, {}), code='0' * 64).key)"
    )
    keys = {
        python("-c", script, str(tmp_path / seed), PYTHONHASHSEED=seed).stdout.strip() for seed in ("0", "1")
    }
    before = Store(tmp_path / "here").artefact(
        "s", {"a": {"x": [np.int64(2), None], "y": 1}, "b": np.float64(0.1)}, ["i"], lambda: ({}, {})
    )
    assert keys == {before.key}
    assert len(before.key) == 16


def test_values_that_are_equal_to_python_are_still_told_apart(tmp_path: Path) -> None:
    store = Store(tmp_path)
    values = [1, 1.0, True, "1", None, [1], {"1": 1}, 1 + 2**-52, [], {}]
    keys = {store.artefact("s", {"value": value}, [], lambda: ({}, {})).key for value in values}
    assert len(keys) == len(values)


@pytest.mark.parametrize(
    ("options", "code", "where", "values"),
    [
        ({"a": float("nan")}, "not_finite", "options.a", {}),
        ({"a": {"b": [0.0, float("inf")]}}, "not_finite", "options.a.b[1]", {}),
        ({"a": np.zeros(2)}, "not_storable", "options.a", {"type": "ndarray"}),
        ({"a": {1, 2}}, "not_storable", "options.a", {"type": "set"}),
        ({"a": Path("/somewhere")}, "not_storable", "options.a", {"type": "PosixPath"}),
        ({"a": lambda: 1}, "not_storable", "options.a", {"type": "function"}),
        ({"a": Options}, "not_storable", "options.a", {"type": "type"}),
        ({1: 2}, "key_not_text", "options", {}),
        (Options(view_angle_deg=Grid(step=float("nan"))), "not_finite", "options.view_angle_deg.step", {}),
    ],
)
def test_options_without_a_canonical_form_are_refused(
    tmp_path: Path, options: Any, code: str, where: str, values: dict[str, str]
) -> None:
    work = Work()
    with rejects(code, where, **values):
        Store(tmp_path).artefact("model", options, [], work)
    assert work.times == 0


def test_the_canonical_form_is_its_own() -> None:
    form = canonical(Options())
    assert canonical(form) == form
    assert json.loads(json.dumps(form)) == form


@pytest.mark.parametrize(
    ("arrays", "notes", "code", "where", "values"),
    [
        ({"x": np.array([None, {}])}, {}, "not_storable", "model", {"array": "x", "type": "ndarray"}),
        (
            {"x": np.ma.masked_array([1, 2], [True, False])},
            {},
            "not_storable",
            "model",
            {"array": "x", "type": "MaskedArray"},
        ),
        ({"../x": np.zeros(1)}, {}, "unusable_name", "model", {}),
        ({"x": np.zeros(1)}, {"residual": float("nan")}, "not_finite", "notes.residual", {}),
    ],
)
def test_results_that_cannot_be_kept_are_refused(
    tmp_path: Path,
    arrays: dict[str, Any],
    notes: dict[str, Any],
    code: str,
    where: str,
    values: dict[str, str],
) -> None:
    with rejects(code, where, **values):
        Store(tmp_path).artefact("model", {}, [], lambda: (arrays, notes))
    assert list((tmp_path / "cache").iterdir()) == []


# --- what is damaged -------------------------------------------------------------------------------------


def test_a_flipped_byte_is_noticed_set_aside_and_computed_again(tmp_path: Path) -> None:
    reference = Store(tmp_path).artefact("model", Options(), [], Work())
    folder = tmp_path / "cache" / reference.name
    noticed = 0
    for name, step in (("arrays.npz", 97), ("manifest.json", 13)):
        for position in range(0, (folder / name).stat().st_size, step):
            content = bytearray((folder / name).read_bytes())
            content[position] ^= 1 << position % 8
            (folder / name).write_bytes(content)
            again = Store(tmp_path).artefact("model", Options(), [], Work())
            same(again, reference)
            if name == "arrays.npz":
                assert again.why == "artefact damaged: the sha256 of arrays.npz differs"
            elif again.computed:
                assert again.why.startswith("artefact damaged: manifest.json ")
            else:  # a blank for another: the manifest has the same content
                manifest = json.loads(content)
                assert manifest["notes"] == reference.notes
            noticed += again.computed
            assert (tmp_path / "cache" / "damaged" / f"{reference.name}-{noticed}").is_dir() or not noticed
    assert noticed > 60
    assert len(list((tmp_path / "cache" / "damaged").iterdir())) == noticed
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda f: (f / "manifest.json").unlink(), "manifest.json is missing"),
        (lambda f: (f / "arrays.npz").unlink(), "arrays.npz is missing"),
        (lambda f: os.truncate(f / "arrays.npz", 100), "arrays.npz has 100 bytes, not "),
        (lambda f: os.truncate(f / "manifest.json", 100), "manifest.json is not valid JSON"),
        (lambda f: (f / "manifest.json").write_text("[]"), "manifest.json has missing or unexpected entries"),
    ],
)
def test_a_half_made_artefact_is_computed_again(
    tmp_path: Path, spoil: Callable[[Path], Any], why: str
) -> None:
    reference = Store(tmp_path).artefact("model", {}, [], Work())
    spoil(tmp_path / "cache" / reference.name)
    assert not is_complete(tmp_path / "cache" / reference.name)
    again = Store(tmp_path).artefact("model", {}, [], Work())
    assert again.why.startswith(f"artefact damaged: {why}")
    same(again, reference)


def test_an_artefact_under_another_name_is_not_taken(tmp_path: Path) -> None:
    store = Store(tmp_path)
    first, two = (store.artefact("model", {"n": n}, [], Work(n)) for n in (1, 2))
    folder = tmp_path / "cache" / first.name
    folder.rename(tmp_path / "gone")
    (tmp_path / "cache" / two.name).rename(folder)
    again = Store(tmp_path).artefact("model", {"n": 1}, [], Work(1))
    assert again.why == f"artefact damaged: manifest.json belongs to {two.name}"
    same(again, first)


def test_nothing_is_ever_unpickled(tmp_path: Path) -> None:
    reference = Store(tmp_path).artefact("model", {}, [], Work())
    folder = tmp_path / "cache" / reference.name
    np.savez(folder / "arrays.npz", x=np.array([{"a": 1}], dtype=object))
    facts = json.loads((folder / "manifest.json").read_bytes())
    for added in ("files", "seal"):
        del facts[added]
    sealed_folders.write_manifest(folder, facts)  # the seal is right, and still
    again = Store(tmp_path).artefact("model", {}, [], Work())
    assert again.why.startswith("artefact damaged: arrays.npz cannot be read: an array has objects")
    same(again, reference)


# --- what is interrupted ---------------------------------------------------------------------------------


class Faults:
    """Let the n-th disk operation fail: mkdir, open, write (half of the data), fsync or rename."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, make: Callable[[], BaseException]) -> None:
        self.make, self.calls, self.at, self.lasting = make, 0, 0, False
        self.mkdir, real_open = os.mkdir, io.open

        class Stream:
            def __init__(self, stream: Any) -> None:
                self.stream = stream

            def __enter__(self) -> "Stream":
                return self

            def __exit__(self, *_: object) -> None:
                self.stream.close()

            def __getattr__(self, name: str) -> Any:
                return getattr(self.stream, name)

            def write(stream, content: Any) -> int:
                try:
                    self.count()
                except BaseException:
                    stream.stream.write(content[: len(content) // 2])
                    stream.stream.flush()
                    raise
                return stream.stream.write(content)

        def opened(path: Any, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
            if "w" not in mode:
                return real_open(path, mode, *args, **kwargs)
            self.count()
            return Stream(real_open(path, mode, *args, **kwargs))

        monkeypatch.setattr(Path, "open", opened)
        for name in ("mkdir", "fsync", "replace", "rename"):
            monkeypatch.setattr(os, name, self.counted(getattr(os, name)))

    def counted(self, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            if real is not self.mkdir or not Path(args[0]).is_dir():  # to make what is there may fail
                self.count()
            return real(*args, **kwargs)

        return call

    def count(self) -> None:
        self.calls += 1
        if self.at and (self.calls == self.at or (self.lasting and self.calls > self.at)):
            raise self.make()

    def arm(self, at: int, *, lasting: bool = False) -> None:
        self.calls, self.at, self.lasting = 0, at, lasting


def run(results: Path, edition: int) -> tuple[list[Artefact], Path]:
    """Compute two stages and publish a figure, as the program does; return the artefacts and the figure's folder."""
    store = Store(results)
    data = store.artefact("dataset", {"edition": edition}, [], Work(edition))
    model = store.artefact("model", {"edition": edition}, [data], Work(edition + 10))
    figure = results / "synthetic" / "full" / "zhang2007_fig5"
    with publish(figure) as publication:
        for name in ("table.csv", "figure.svg"):
            with (publication.folder / name).open("wb") as stream:
                stream.write(f"{name} of edition {edition}, {model.key}".encode())
        publication.facts = {"figure": "zhang2007_fig5", "edition": edition}
    return [data, model], figure


def contents(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


@pytest.mark.parametrize(
    ("make", "raised", "lasting"),
    [
        (lambda: OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), InvalidInput, False),
        (lambda: OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), InvalidInput, True),
        (lambda: OSError(errno.EACCES, os.strerror(errno.EACCES)), InvalidInput, False),
        (KeyboardInterrupt, KeyboardInterrupt, False),
    ],
    ids=["disk full once", "disk full", "forbidden once", "ctrl-c"],
)
def test_whatever_operation_fails_the_next_run_finishes(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    make: Callable[[], BaseException],
    raised: type[BaseException],
    lasting: bool,
) -> None:
    reference, figure = run(tmp_path / "reference", 2)
    expected = contents(figure)
    run(tmp_path / "older", 1)
    older = contents(tmp_path / "older" / figure.relative_to(tmp_path / "reference"))
    faults = Faults(monkeypatch, make)
    run(tmp_path / "count", 1)
    faults.arm(0)
    run(tmp_path / "count", 2)
    operations = faults.calls
    assert operations > 20
    for n in range(1, operations + 2):
        results = tmp_path / str(n)
        faults.arm(0)
        run(results, 1)  # an older edition stands there already
        published = results / figure.relative_to(tmp_path / "reference")
        assert contents(published) == older

        faults.arm(n, lasting=lasting)
        if n <= operations:
            with pytest.raises(raised) as caught:
                run(results, 2)
            if isinstance(caught.value, InvalidInput):
                assert caught.value.code == "cannot_write"
                assert "\n" not in str(caught.value)
        else:
            run(results, 2)
        faults.arm(0)
        if published.exists():
            assert contents(published) in (older, expected)
            assert is_complete(published)
        if not lasting:  # a disk that works again lets us tidy up, and the older figure stand
            assert leftovers(results) == []
            assert published.exists()
        for folder in (results / "cache").glob("*-*"):
            assert is_complete(folder) or folder.name.startswith(".")

        resumed, figure_again = run(results, 2)
        for a, b in zip(resumed, reference, strict=True):
            same(a, b)
        assert contents(figure_again) == expected
        assert leftovers(results) == []
        assert not (results / "cache" / "damaged").exists()


def test_a_killed_process_leaves_what_the_next_run_can_use(tmp_path: Path) -> None:
    script = textwrap.dedent("""
        import os, signal, sys
        from pathlib import Path
        import numpy as np
        from pipeline.storage.publishing import publish
        from pipeline.storage.store import Store
        results, name, n = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
        real, calls = getattr(os, name), 0
        def call(*args):
            global calls
            calls += 1
            if calls == n:
                os.kill(os.getpid(), signal.SIGKILL)
            return real(*args)
        setattr(os, name, call)
        store = Store(results)
        made = [store.artefact("s", {"i": i}, [], lambda: ({"x": np.arange(9.0) * i}, {}), code="0" * 64)
                for i in range(2)]
        with publish(results / "figure") as publication:
            (publication.folder / "table.csv").write_text("new")
            publication.facts = {"edition": "new"}
        print(*(a.computed for a in made))
        """)

    for name, points in (("fsync", (1, 3, 6, 10, 12)), ("replace", (1, 2, 3, 4))):
        for n in points:
            results = tmp_path / f"{name}{n}"
            with publish(results / "figure") as publication:
                (publication.folder / "table.csv").write_text("old")
                publication.facts = {"edition": "old"}
            killed = python("-c", script, str(results), name, str(n))
            assert killed.returncode == -signal.SIGKILL, (name, n)
            finished = {p.name for p in (results / "cache").glob("s-*")}
            assert all(is_complete(results / "cache" / name) for name in finished)
            if (results / "figure").exists():
                assert is_complete(results / "figure")
            else:
                assert (name, n) == ("replace", 4)  # between the two renames
            store = Store(results)
            again = [
                store.artefact("s", {"i": i}, [], lambda i=i: ({"x": np.arange(9.0) * i}, {}))  # type: ignore[misc]
                for i in range(2)
            ]
            assert [a.name in finished for a in again] == [not a.computed for a in again]
            np.testing.assert_array_equal(again[1].arrays["x"], np.arange(9.0))
            with pytest.raises(RuntimeError, match="stop"), publish(results / "other"):
                raise RuntimeError("stop")  # publishing any other figure in the folder clears up
            assert (results / "figure" / "table.csv").read_text() in ("old", "new")
            assert is_complete(results / "figure")
            assert leftovers(results) == []


def test_ctrl_c_while_computing_leaves_nothing(tmp_path: Path) -> None:
    def interrupted() -> tuple[dict, dict]:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Store(tmp_path).artefact("model", {}, [], interrupted)
    assert list((tmp_path / "cache").iterdir()) == []


def test_an_error_of_the_computation_is_not_taken_for_a_full_disk(tmp_path: Path) -> None:
    def failing() -> tuple[dict, dict]:
        raise OSError(errno.ENOSPC, "somewhere else")

    with pytest.raises(OSError, match="somewhere else") as caught:
        Store(tmp_path).artefact("model", {}, [], failing)
    assert not isinstance(caught.value, InvalidInput)


def test_of_two_processes_that_ask_for_the_same_one_computes_it(tmp_path: Path) -> None:
    script = textwrap.dedent("""
        import os, sys, time
        from contextlib import contextmanager
        from pathlib import Path
        import numpy as np
        from pipeline.storage.store import Store
        results, me, other = Path(sys.argv[1]), sys.argv[2], sys.argv[3]

        @contextmanager
        def waiting():
            (results / f"{me}{i} waits").touch()
            yield

        store = Store(results, waiting)
        for i in range(8):
            (results / f"{me}{i} asks").touch()
            while not (results / f"{other}{i} asks").exists():
                time.sleep(0.0005)
            def compute():
                while not (results / f"{other}{i} waits").exists():  # the test ends both if one of them fails
                    time.sleep(0.0005)
                return {"x": np.array([float(os.getpid()), i])}, {}
            made = store.artefact("s", {"i": i}, [], compute, code="0" * 64)
            print(made.computed, made.arrays["x"].tolist())
        """)
    command = [sys.executable, "-c", script, str(tmp_path)]
    with started([*command, "a", "b"]) as first, started([*command, "b", "a"]) as other:
        answers = [process.communicate(timeout=WAIT_S) for process in (first, other)]
        assert [process.returncode for process in (first, other)] == [0, 0], answers
    message = [[line.split(" ", 1) for line in out.splitlines()] for out, _ in answers]
    assert len(message[0]) == len(message[1]) == 8
    for (computed, numbers), (computed_too, same_numbers) in zip(*message, strict=True):
        assert {computed, computed_too} == {"True", "False"}
        assert numbers == same_numbers
    assert leftovers(tmp_path) == []
    assert all(complaints_about(folder) == [] for folder in (tmp_path / "cache").iterdir())


def test_a_process_that_is_killed_while_it_computes_is_not_waited_for(tmp_path: Path) -> None:
    script = textwrap.dedent("""
        import os, signal, sys
        from pathlib import Path
        from pipeline.storage.store import Store
        Store(Path(sys.argv[1])).artefact(
            "s", {}, [], lambda: os.kill(os.getpid(), signal.SIGKILL), code=sys.argv[2]
        )
        """)
    for code in ("0" * 64, "1" * 64):
        assert python("-c", script, str(tmp_path), code).returncode == -signal.SIGKILL
    assert len(list((tmp_path / "cache").glob(".lock-*"))) == 1, "the second run removed that of the first"
    output = Store(tmp_path).artefact("s", {}, [], lambda: ({"x": np.ones(2)}, {}), code="1" * 64)
    assert output.computed
    assert [path.name for path in (tmp_path / "cache").iterdir()] == [output.name]


@pytest.mark.skipif(sys.platform == "win32", reason="needs locks on files")
def test_a_lock_that_is_removed_while_it_is_waited_for_is_taken_anew(tmp_path: Path) -> None:
    path, order = tmp_path / ".lock-s", []

    @contextmanager
    def waiting() -> Iterator[None]:
        path.unlink()  # as the owner does when it ends
        first.close()
        yield

    first = ExitStack()
    first.enter_context(locks.exclusive(path))
    with locks.exclusive(path, waiting):
        order.append(path.exists())
        locks.remove_unheld(tmp_path, ".lock-*")
        order.append(path.exists())
    assert order == [True, True]
    assert not path.exists()


def test_without_locks_the_first_to_finish_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locks, "fcntl", None)

    def overtaken() -> tuple[dict, dict]:
        faster = Store(tmp_path).artefact("s", {}, [], lambda: ({"x": np.ones(2)}, {}), code="0" * 64)
        assert faster.computed
        return {"x": np.zeros(2)}, {}

    output = Store(tmp_path).artefact("s", {}, [], overtaken, code="0" * 64)
    assert output.computed
    np.testing.assert_array_equal(output.arrays["x"], 1)


def test_the_slower_one_replaces_a_damaged_winner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locks, "fcntl", None)  # or it would be waited for
    folder = {}

    def overtaken() -> tuple[dict, dict]:
        faster = Store(tmp_path).artefact("s", {}, [], lambda: ({"x": np.ones(2)}, {}))
        folder["winner"] = tmp_path / "cache" / faster.name
        (folder["winner"] / "arrays.npz").write_bytes(b"no")
        return {"x": np.zeros(2)}, {}

    output = Store(tmp_path).artefact("s", {}, [], overtaken)
    np.testing.assert_array_equal(output.arrays["x"], 0)
    assert complaints_about(folder["winner"]) == []
    assert len(list((tmp_path / "cache" / "damaged").iterdir())) == 1


def test_a_results_folder_that_cannot_be_written_is_told_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    work = Work()
    with rejects("cannot_write", errno=errno.ENOTDIR):
        Store(tmp_path / "file").artefact("model", {}, [], work)
    with (
        rejects("cannot_write", errno=errno.EEXIST),
        publish(tmp_path / "file" / "figure"),
    ):
        pytest.fail("the body must not begin")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with rejects("cannot_write", errno=errno.EACCES):
        Store(tmp_path).artefact("model", {}, [], work)
    assert work.times == 0


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_read_only_folder_still_gives_what_it_holds(tmp_path: Path) -> None:
    reference = Store(tmp_path).artefact("model", {}, [], Work())
    (tmp_path / "cache").chmod(0o500)
    try:
        same(Store(tmp_path).artefact("model", {}, [], Work()), reference)
        with rejects("cannot_write", errno=errno.EACCES):
            Store(tmp_path).artefact("model", {"other": 1}, [], Work())
    finally:
        (tmp_path / "cache").chmod(0o700)


@pytest.fixture
def dead_pid() -> int:
    with started([sys.executable, "-c", ""]) as process:
        process.communicate(timeout=WAIT_S)
        return process.pid


def test_only_what_dead_processes_left_is_removed(tmp_path: Path, dead_pid: int) -> None:
    before, elsewhere = sealed_folders._HERE, "000000" if sealed_folders._HERE != "000000" else "111111"
    cache = tmp_path / "cache"
    names = {
        f".tmp-{dead_pid}-{before}00000001": False,
        f".tmp-{os.getpid()}-{before}00000002": False,  # this number, but before our time
        f".tmp-{os.getppid()}-{before}00000003": True,
        f".tmp-{dead_pid}-{elsewhere}00000004": True,  # another machine's process may well live
        f".tmp-{dead_pid}-{elsewhere}00000005": False,  # not for two days
        ".tmp-mine": True,
    }
    for name in names:
        (cache / name).mkdir(parents=True)
        (cache / name / "arrays.npz").write_bytes(b"half")
    two_days_ago = time.time() - 2 * 86400
    os.utime(cache / f".tmp-{dead_pid}-{elsewhere}00000005", (two_days_ago, two_days_ago))
    Store(tmp_path)
    assert {name: (cache / name).exists() for name in names} == names


def test_a_temporary_folder_in_use_is_not_stale(tmp_path: Path) -> None:
    with sealed_folders.temporary_folder(tmp_path) as temporary:
        sealed_folders.remove_stale(tmp_path)
        assert temporary.is_dir()
    assert not temporary.exists()


# --- what is published -----------------------------------------------------------------------------------


def test_a_publication_takes_the_place_of_the_older(tmp_path: Path) -> None:
    figure = tmp_path / "synthetic" / "full" / "zhang2007_fig5"
    for edition in (1, 2):
        with publish(figure) as publication:
            assert publication.folder.parent == figure.parent
            (publication.folder / "table.csv").write_text(f"{edition}")
            (publication.folder / "more").mkdir()
            (publication.folder / "more" / f"arrays{edition}.npz").write_bytes(b"12345")
            publication.facts = {"edition": edition, "options": Options()}
        manifest = json.loads((figure / "manifest.json").read_bytes())
        assert manifest["edition"] == edition
        assert manifest["options"]["view_angle_deg"]["step"] == 1.0
        assert manifest["files"].keys() == {"table.csv", f"more/arrays{edition}.npz"}
        assert manifest["files"]["table.csv"] == {
            "bytes": 1,
            "sha256": sealed_folders.digest(f"{edition}".encode()),
        }
        assert {p.name for p in figure.iterdir()} == {"table.csv", "more", "manifest.json"}
        assert complaints_about(figure) == []
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize("error", [RuntimeError("drawn badly"), KeyboardInterrupt(), FileNotFoundError("x")])
def test_a_publication_that_fails_leaves_the_older(tmp_path: Path, error: BaseException) -> None:
    _, figure = run(tmp_path, 1)
    before = contents(figure)
    publishing = publish(figure)
    publication = publishing.__enter__()
    (publication.folder / "table.csv").write_text("new")
    publication.facts = {}
    assert not publishing.__exit__(type(error), error, None)
    assert contents(figure) == before
    assert leftovers(tmp_path) == []


def test_a_publication_needs_a_manifest(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="no manifest"), publish(tmp_path / "figure"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_manifest_says_only_what_json_can(tmp_path: Path) -> None:
    with (
        rejects("not_finite", "manifest.error"),
        publish(tmp_path / "figure") as publication,
    ):
        publication.facts = {"error": np.float64("nan")}
    assert list(tmp_path.iterdir()) == []


def test_two_publications_of_one_figure_at_once(tmp_path: Path) -> None:
    figure = tmp_path / "figure"
    with publish(figure) as slower:
        slower.facts = {"by": "slower"}
        with publish(figure) as faster:
            faster.facts = {"by": "faster"}
        assert json.loads((figure / "manifest.json").read_bytes())["by"] == "faster"
    assert json.loads((figure / "manifest.json").read_bytes())["by"] == "slower"
    assert leftovers(tmp_path) == []


def test_complaints_name_every_file(tmp_path: Path) -> None:
    _, figure = run(tmp_path, 1)
    assert complaints_about(figure) == []
    content = (figure / "table.csv").read_bytes()
    (figure / "table.csv").write_bytes(content[::-1])
    (figure / "figure.svg").unlink()
    assert complaints_about(figure) == ["figure.svg is missing", "the sha256 of table.csv differs"]
    sealed_ns = (figure / "manifest.json").stat().st_mtime_ns
    os.utime(figure / "table.csv", ns=(sealed_ns, sealed_ns))
    assert complaints_about(figure, hashes=False) == ["figure.svg is missing"]
    os.utime(figure / "table.csv", ns=(sealed_ns, sealed_ns + 1))
    assert complaints_about(figure, hashes=False) == [
        "figure.svg is missing",
        "the sha256 of table.csv differs",
    ]
    assert not is_complete(figure)
    assert not is_complete(tmp_path / "nowhere")


def publish_files(figure: Path, **files: str) -> None:
    """Publish a figure with the given files, where ``table_csv`` is the file ``table.csv``."""
    with publish(figure) as publication:
        for name, content in files.items():
            path = publication.folder / name.replace("__", "/").replace("_csv", ".csv")
            path.parent.mkdir(exist_ok=True)
            path.write_text(content)
        publication.facts = {}


def of_the_reader(figure: Path) -> dict[str, str]:
    """Write files of the user next to the published ones, and return their contents by name."""
    mine = {"notes.txt": "a", "more/notes.txt": "b", "own/folder/notes.txt": "c", ".hidden": "d"}
    for name, content in mine.items():
        (figure / name).parent.mkdir(parents=True, exist_ok=True)
        (figure / name).write_text(content)
    (figure / "link").symlink_to("notes.txt")
    return mine | {"link": "a"}


def test_files_that_are_not_ours_survive_a_replacement(tmp_path: Path) -> None:
    figure = tmp_path / "figure"
    publish_files(figure, table_csv="1", more__part_csv="1")
    mine = of_the_reader(figure)
    (figure / "nothing").mkdir()
    publish_files(figure, table_csv="2")
    assert {name: (figure / name).read_text() for name in mine} == mine
    assert (figure / "link").is_symlink()
    assert (figure / "nothing").is_dir()
    assert (figure / "table.csv").read_text() == "2"
    assert not (figure / "more" / "part.csv").exists(), "what was ours and is no more is gone"
    assert complaints_about(figure) == []
    assert json.loads((figure / "manifest.json").read_bytes())["files"].keys() == {"table.csv"}
    assert [p.name for p in tmp_path.iterdir()] == ["figure"]


@pytest.mark.parametrize("after", ["aside", "swapped", "half"])
def test_files_that_are_not_ours_survive_a_kill(tmp_path: Path, dead_pid: int, after: str) -> None:
    """If a process is killed between two renames, the next publication restores the files of the user."""
    figure, aside = tmp_path / "figure", tmp_path / f".old-{dead_pid}-{sealed_folders._HERE}00000001-figure"
    publish_files(figure, table_csv="1")
    mine = of_the_reader(figure)
    figure.rename(aside)
    if after != "aside":
        publish_files(tmp_path / "elsewhere" / "figure", table_csv="2")
        (tmp_path / "elsewhere" / "figure").rename(figure)
    if after == "half":
        (aside / "notes.txt").rename(figure / "notes.txt")
    publish_files(tmp_path / "other")
    assert {name: (figure / name).read_text() for name in mine} == mine
    assert complaints_about(figure) == []
    assert not aside.exists()


def test_a_file_of_the_readers_is_never_overwritten(tmp_path: Path) -> None:
    figure = tmp_path / "figure"
    publish_files(figure, table_csv="1")
    (figure / "picture.csv").write_text("mine")
    with rejects("not_ours", "figure/picture.csv"):
        publish_files(figure, table_csv="2", picture_csv="ours")
    assert (figure / "picture.csv").read_text() == "mine"
    assert (figure / "table.csv").read_text() == "1"
    assert complaints_about(figure) == []
    assert [p.name for p in tmp_path.iterdir()] == ["figure"]


def _no_manifest(folder: Path) -> None:
    (folder / "manifest.json").unlink()


def _edited(folder: Path) -> None:
    manifest = json.loads((folder / "manifest.json").read_bytes())
    (folder / "manifest.json").write_text(json.dumps({**manifest, "mine": 1}))


def _of_another_program(folder: Path) -> None:
    (folder / "manifest.json").write_text('{"name": "an extension", "files": ["thesis.tex"], "seal": "x"}')


def _linked(folder: Path) -> None:
    folder.rename(folder.with_name("elsewhere"))
    folder.symlink_to(folder.with_name("elsewhere"))


def _a_file(folder: Path) -> None:
    shutil.rmtree(folder)
    folder.write_text("mine")


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (_no_manifest, "no_file"),
        (_edited, "changed"),
        (_of_another_program, "other_entries"),
        (_linked, "link"),
        (_a_file, "no_file"),
    ],
)
@pytest.mark.parametrize("when", ["before", "meanwhile"])
def test_only_a_folder_with_our_manifest_is_replaced(
    tmp_path: Path, change: Callable[[Path], None], why: str, when: str
) -> None:
    figure = tmp_path / "figure"
    publish_files(figure, table_csv="1")

    def everything() -> dict[str, str]:
        return {p.relative_to(tmp_path).as_posix(): p.read_text() for p in tmp_path.rglob("*") if p.is_file()}

    if when == "before":
        change(figure)
    expected = everything()
    begun = False

    def again() -> None:
        nonlocal begun, expected
        with publish(figure) as publication:
            begun = True
            change(figure)
            expected = everything()
            publication.facts = {}

    with rejects("not_replaced", "figure", why=why):
        again()
    assert begun == (when == "meanwhile")
    assert everything() == expected
    assert leftovers(tmp_path) == []


def test_an_empty_folder_is_filled(tmp_path: Path) -> None:
    (tmp_path / "figure").mkdir()
    publish_files(tmp_path / "figure", table_csv="1")
    assert complaints_about(tmp_path / "figure") == []


def test_a_folder_of_another_kind_is_kept(tmp_path: Path) -> None:
    publish_files(tmp_path / "figure", table_csv="1")
    with rejects("not_replaced", why="other_command"):
        publish(tmp_path / "figure", having="walkers").__enter__()
    with rejects("inside_published"):
        publish(tmp_path / "figure" / "more").__enter__()


@pytest.mark.parametrize("look", [1, 2], ids=["may it be replaced", "what else is in it"])
@pytest.mark.parametrize("away", [False, True])
def test_a_publication_between_two_looks_is_no_foreign_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, look: int, away: bool
) -> None:
    """A publication succeeds if another process replaces the same folder while its manifest is being read."""
    figure, aside, calls = tmp_path / "figure", tmp_path / "aside", 0
    publish_files(figure, table_csv="1")
    really = sealed_folders.read_manifest

    def read_manifest(folder: Path, needed: Iterable[str] = ()) -> dict[str, Any]:
        nonlocal calls
        calls += folder == figure
        if folder != figure or calls != look:
            return really(folder, needed)
        calls = 10
        if away:
            figure.rename(aside)
        try:
            return really(folder)
        finally:
            if away:
                aside.rename(figure)
            publish_files(figure, table_csv="2", table_more_csv="2")

    with publish(figure) as publication:
        for name in ("table.csv", "table_more.csv"):
            (publication.folder / name).write_text("3")
        publication.facts = {}
        monkeypatch.setattr(sealed_folders, "read_manifest", read_manifest)
    assert calls > 10
    assert (figure / "table_more.csv").read_text() == "3"
    assert complaints_about(figure) == []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_a_process_that_nobody_waited_for_does_not_run(tmp_path: Path) -> None:
    zombie = os.fork()
    if not zombie:
        os._exit(0)
    os.waitid(os.P_PID, zombie, os.WEXITED | os.WNOWAIT)
    try:
        left = tmp_path / f".tmp-{zombie}-{sealed_folders._HERE}01234567"
        left.mkdir()
        sealed_folders.remove_stale(tmp_path)
        assert not left.exists()
    finally:
        os.waitpid(zombie, 0)
    assert sealed_folders._is_alive(os.getppid())


# --- a file -----------------------------------------------------------------------------------------------


def write_file(path: Path, **options: Any) -> None:
    with new_file(path, **options) as partial:
        assert partial.name == path.name
        partial.write_text("new")


def test_a_new_file_is_written_and_an_old_one_only_if_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    write_file(path)
    assert path.read_text() == "new"
    path.write_text("old")
    with rejects("not_replaced", "walk.csv", why="exists"):
        write_file(path)
    with rejects("not_replaced", "walk.csv", why="not_ours"):
        write_file(path, replace=lambda old: old == b"ours")
    assert path.read_text() == "old"
    for replace in (True, lambda old: old == b"old"):
        path.write_text("old")
        write_file(path, replace=replace)
        assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["walk.csv"]


def test_source_link_folder_and_published_file_are_never_replaced(tmp_path: Path) -> None:
    source, link, other = tmp_path / "walk.csv", tmp_path / "link.csv", tmp_path / "same.csv"
    source.write_text("mine")
    link.symlink_to(source)
    other.hardlink_to(source)
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "nowhere.csv").symlink_to(tmp_path / "not there")
    publish_files(tmp_path / "figure", table_csv="1")
    for path, code, values in (
        (source, "not_replaced", {"why": "source"}),
        (other, "not_replaced", {"why": "source"}),
        (link, "not_replaced", {"why": "link"}),
        (tmp_path / "nowhere.csv", "not_replaced", {"why": "link"}),
        (tmp_path / "folder.csv", "not_replaced", {"why": "not_a_file"}),
        (tmp_path / "figure" / "table.csv", "inside_published", {}),
        (tmp_path / "figure" / "new.csv", "inside_published", {}),
        (tmp_path / "no" / "new.csv", "no_folder", {}),
    ):
        with rejects(code, **values):
            write_file(path, replace=True, sources=[source, tmp_path / "gone"])
    assert source.read_text() == "mine"
    assert complaints_about(tmp_path / "figure") == []
    assert not (tmp_path / "not there").exists()


@pytest.mark.parametrize("error", [RuntimeError("no"), KeyboardInterrupt()])
def test_a_file_that_fails_leaves_the_older(tmp_path: Path, error: BaseException) -> None:
    path = tmp_path / "walk.csv"
    path.write_text("old")

    def fail() -> None:
        with new_file(path, replace=True) as partial:
            partial.write_text("half")
            raise error

    with pytest.raises(type(error)):
        fail()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["walk.csv"]


def test_a_file_that_comes_meanwhile_is_kept(tmp_path: Path) -> None:
    def write() -> None:
        with new_file(tmp_path / "walk.csv") as partial:
            partial.write_text("new")
            (tmp_path / "walk.csv").write_text("mine")

    with rejects("not_replaced", "walk.csv", why="exists"):
        write()
    assert (tmp_path / "walk.csv").read_text() == "mine"


# --- with what it was made -------------------------------------------------------------------------------


def test_provenance_names_versions_and_no_person(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lock = tmp_path / "requirements.lock"
    lock.write_text("numpy==2\n")
    monkeypatch.setattr(provenance_module, "LOCK", lock)
    facts = provenance_module.provenance()
    assert facts["python"] == platform.python_version()
    assert facts["packages"]["numpy"] == np.__version__
    assert facts["packages"].keys() >= {
        "scipy",
        "pandas",
        "hydra-core",
        "omegaconf",
        "rerun-sdk",
        "matplotlib",
    }
    assert facts["lock_sha256"] == sealed_folders.file_digest(lock)
    assert facts["commit"] == "unknown" or len(facts["commit"]) == 40
    assert facts["dirty"] in (True, False, "unknown")
    text = json.dumps(facts)
    assert "/" not in text
    if len(platform.node()) > 3:
        assert platform.node() not in text
    lock.unlink()
    assert provenance_module.provenance()["lock_sha256"] == "absent"


def test_provenance_without_git_is_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    facts = provenance_module.provenance()
    assert (facts["commit"], facts["dirty"]) == ("unknown", "unknown")


def test_provenance_reads_the_projects_own_repository_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def git(*arguments: str) -> str:
        identity = ["-c", "user.name=n", "-c", "user.email=e"]
        command = ["git", "-C", str(tmp_path), *identity, *arguments]
        done = finished(command)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    try:
        git("init", "--quiet")
    except FileNotFoundError:
        pytest.skip("needs git")
    (tmp_path / "inner").mkdir()
    (tmp_path / "a").write_text("1")
    git("add", "a")
    git("commit", "--quiet", "--no-verify", "-m", "m")
    monkeypatch.setattr(provenance_module, "PROJECT", tmp_path.resolve())
    facts = provenance_module.provenance()
    assert (facts["commit"], facts["dirty"]) == (git("rev-parse", "HEAD"), False)
    (tmp_path / "a").write_text("2")
    assert provenance_module.provenance()["dirty"] is True
    monkeypatch.setattr(provenance_module, "PROJECT", tmp_path.resolve() / "inner")
    assert provenance_module.provenance()["commit"] == "unknown"


def test_the_content_of_an_artefact_has_sixteen_digits() -> None:
    manifest = {"files": {"arrays.npz": {"sha256": "ab"}}, "notes": {"n": 1}}
    assert content_digest(manifest) == hashlib.sha256(b'["ab",{"n":1}]').hexdigest()[:16]


@pytest.mark.parametrize(
    ("hashes", "newer", "is_reported"), [(True, False, True), (False, True, True), (False, False, False)]
)
def test_a_changed_file_of_the_same_size_is_found_by_its_hash_or_its_time(
    tmp_path: Path, hashes: bool, newer: bool, is_reported: bool
) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before")
    write_manifest(tmp_path, {})
    sealed = (tmp_path / "manifest.json").stat().st_mtime_ns
    assert complaints_about(tmp_path) == []
    path.write_text("after!")
    os.utime(path, ns=(sealed + newer, sealed + newer))
    assert complaints_about(tmp_path, hashes=hashes) == (
        ["the sha256 of a.txt differs"] if is_reported else []
    )


def test_an_existing_file_is_not_replaced_unless_it_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    require_new(path)
    path.write_text("a")
    require_new(path, replace=True)
    with rejects("not_replaced", why="exists"):
        require_new(path)


@pytest.mark.parametrize("dry_run", [True, False])
def test_a_dry_run_removes_nothing(tmp_path: Path, dry_run: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    removed: list[Path] = []
    monkeypatch.setattr("pipeline.storage.store.remove_stale", removed.append)
    Store(tmp_path, dry_run=dry_run)
    Store(tmp_path, None)
    assert removed == ([] if dry_run else [tmp_path / "cache"])
