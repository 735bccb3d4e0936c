"""Tests that dataclasses of arrays are unchanged after they are stored and read."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.stages.artefacts import Stored, stored
from pipeline.storage.sealed_folders import read_manifest, write_manifest
from pipeline.storage.store import Store, packed
from pipeline.storage.typed import _axes, pack, result_type, unpack
from pipeline.studies.eigenwalkers.samples import FourierSamples
from tests.rejects import rejects


def test_the_shapes_of_a_data_set_are_compared_with_its_docstring() -> None:
    sizes = {"R": 4, "H": 2, "1 + 2H": 5}
    arrays = {
        name: np.full([sizes.get(axis) or int(axis) for axis in axes], "a" if text else 1)
        for name, (axes, text) in _axes(FourierSamples).items()
    }
    notes = {"frequency": True, "words": "4 walks"}
    assert unpack(FourierSamples, arrays, notes).clip.shape == (4,)
    for name, wrong in (
        ("clip", np.full(3, "a")),
        ("scale", np.full(4, "a")),
        ("scale", np.ones(4, complex)),
    ):
        with rejects("wrong_shape", name):
            unpack(FourierSamples, arrays | {name: wrong}, notes)


@dataclass(frozen=True)
class Inner:
    """Small dataclass, used as a field of another dataclass."""

    values: np.ndarray
    words: str


@dataclass(frozen=True)
class Whole:
    """Dataclass with a field of every type that a stage may return."""

    positions: np.ndarray
    inner: Inner
    by_name: dict[str, np.ndarray]
    parts: dict[str, Inner]
    absent: np.ndarray | None
    no_part: Inner | None
    count: int
    share: float
    names: tuple[str, ...]
    table: pd.DataFrame
    rows: list[dict[str, Any]]
    notes: dict[str, str]
    remarks: list[str] = field(default_factory=list)


def whole() -> Whole:
    return Whole(
        positions=np.arange(6.0).reshape(2, 3),
        inner=Inner(np.array([True, False]), "σ²"),
        by_name={"linear": np.zeros((2, 0)), "synchronized": np.ones(3)},
        parts={"hip": Inner(np.array(["a", "bc"]), "x"), "knee": Inner(np.array(4), "y")},
        absent=None,
        no_part=None,
        count=3,
        share=0.1 + 0.2,
        names=("one", "two"),
        table=pd.DataFrame(
            {"trial": [2, 1], "clip": ["a", "ümlaut"], "error": [0.1, np.nan], "proved": [True, False]}
        ),
        rows=[{"clip": "walk", "frames": 7, "reason": ""}],
        notes={"a.c3d": "0f"},
    )


def assert_equal(a: Any, b: Any) -> None:
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    elif isinstance(a, pd.DataFrame):
        pd.testing.assert_frame_equal(a, b)
    elif hasattr(a, "__dataclass_fields__"):
        assert type(a) is type(b)
        for part in fields(a):
            assert_equal(getattr(a, part.name), getattr(b, part.name))
    elif isinstance(a, Mapping):
        assert list(a) == list(b)
        for name in a:
            assert_equal(a[name], b[name])
    else:
        assert a == b
        assert type(a) is type(b)


def test_what_is_packed_is_unpacked_as_it_was() -> None:
    arrays, notes = pack(whole())
    again = unpack(Whole, arrays, json.loads(json.dumps(notes)))
    assert_equal(whole(), again)


def test_arrays_are_named_by_the_path_to_their_field() -> None:
    arrays, _ = pack(whole())
    assert set(arrays) == {
        "positions", "inner.values", "by_name.linear", "by_name.synchronized", "parts.hip.values", "parts.knee.values",
        "table.trial", "table.clip", "table.error", "table.proved",
    }  # fmt: skip


def test_the_way_through_files_changes_nothing(tmp_path: Path) -> None:
    computed = Store(tmp_path).artefact("model", {}, [], lambda: pack(whole()), code="0")
    result = Store(tmp_path).artefact("model", {}, [], lambda: pytest.fail("it is there"), code="0")
    for artefact in (computed, result):
        assert_equal(whole(), unpack(Whole, artefact.arrays, artefact.notes))


def test_the_result_is_what_a_method_is_annotated_to_return() -> None:
    class Model:
        def learn(self) -> Whole:
            raise AssertionError

    assert result_type(Model().learn) is Whole


def test_a_table_without_rows_keeps_its_columns_and_one_of_texts_lists_each_once() -> None:
    table = pd.DataFrame({"clip": ["b", "a", "b"], "error": [1.0, 2.0, 3.0]})
    arrays, notes = pack(Rows(table))
    assert notes["table"] == [("clip", ["b", "a"]), ("error", None)]
    assert arrays["table.clip"].tolist() == [0, 1, 0]
    for part in (table, table[:0]):
        arrays, notes = pack(Rows(part))
        again = unpack(Rows, arrays, json.loads(json.dumps(notes)))
        assert again.table["clip"].tolist() == part["clip"].tolist()
        assert list(again.table) == ["clip", "error"]


@dataclass(frozen=True)
class Rows:
    table: pd.DataFrame


@dataclass(frozen=True)
class Shaped:
    """Dataclass of arrays with annotated shapes.

    Attributes
    ----------
    positions : (N, 15, 3)
    time, phase : (N,), (N, 2)
    person : (P,) text
    inner : Inner
    """

    positions: np.ndarray
    time: np.ndarray
    phase: np.ndarray
    person: np.ndarray
    inner: Inner
    count: int = 3


SHAPED = Shaped(
    np.zeros((2, 15, 3)), np.array([0.0, 1.0]), np.ones((2, 2)), np.array(["a"]), Inner(np.zeros(2), "x")
)


def spoilt(**arrays: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return the packed form of `SHAPED` with some arrays replaced, or removed if None is given."""
    retained, notes = pack(SHAPED)
    return {name: array for name, array in (retained | arrays).items() if array is not None}, notes


@pytest.mark.parametrize(
    ("arrays", "notes", "code", "where", "values"),
    [
        ({"positions": np.zeros((2, 14, 3))}, {}, "wrong_shape", "positions", {"axes": ["N", "15", "3"]}),
        ({"positions": np.zeros(3)}, {}, "wrong_shape", "positions", {}),
        ({"positions": np.array([[["a"] * 3] * 15])}, {}, "wrong_shape", "positions", {}),
        ({"phase": np.zeros(2)}, {}, "wrong_shape", "phase", {}),
        ({"person": np.zeros(2)}, {}, "wrong_shape", "person", {"axes": ["P"], "text": True}),
        ({"positions": None}, {}, "wrong_type", "positions", {}),
        ({"inner.values": None}, {}, "wrong_type", "inner.values", {}),
        ({"inner.words": np.zeros(2)}, {}, "wrong_type", "inner.words", {}),
        ({}, {"count": "3"}, "wrong_type", "count", {}),
        ({}, {"count": None}, "wrong_type", "count", {}),
        ({"time": np.zeros(3)}, {}, "wrong_shape", "time", {"axes": ["N"], "text": False}),
        ({}, {"inner": [1]}, "does_not_fit", "", {"type": "Shaped"}),
        ({}, {"inner": {"words": 3}}, "wrong_type", "inner.words", {}),
    ],
    ids=itertools.count(),
)
def test_what_is_of_another_shape_or_type_is_rejected(
    arrays: dict[str, Any], notes: dict[str, Any], code: str, where: str, values: dict[str, Any]
) -> None:
    retained, plain = spoilt(**arrays)
    if "inner.words" in arrays:
        del plain["inner"]["words"]
    with rejects(code, where, **values):
        unpack(Shaped, retained, plain | notes)
    assert_equal(unpack(Shaped, *spoilt()), SHAPED)


def test_columns_of_a_table_have_one_length(tmp_path: Path) -> None:
    arrays, notes = pack(Rows(pd.DataFrame({"clip": ["b", "a"], "error": [1.0, 2.0]})))
    for change in ({"table.error": np.zeros(3)}, {"table.clip": np.array([0, 7], np.uint8)}):
        with rejects("does_not_fit", type="Rows"):
            unpack(Rows, arrays | change, notes)


@pytest.mark.parametrize(
    "spoil", [{"positions": np.zeros((2, 14, 3))}, {"inner.values": None}], ids=["axes", "missing"]
)
def test_an_artefact_with_a_right_seal_and_another_shape_is_computed_again(
    tmp_path: Path, spoil: dict[str, Any]
) -> None:
    def asked() -> Stored[Shaped]:
        return stored(
            Store(tmp_path), "model", {}, [], lambda: SHAPED, result=Shaped, sources=["pipeline.seeding"]
        )

    first = asked()
    folder = tmp_path / "cache" / first.artefact.name
    facts = read_manifest(folder)
    del facts["files"]
    (folder / "arrays.npz").write_bytes(packed(spoilt(**spoil)[0]))
    write_manifest(folder, facts)
    again = asked()
    assert again.artefact.computed
    assert re.match(r"artefact damaged: (positions|inner\.values): ", again.artefact.why)
    assert_equal(again.value, SHAPED)
    assert not asked().artefact.computed
