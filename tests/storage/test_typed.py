"""Dataclasses of arrays survive the way through the store."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.storage.store import Store
from pipeline.storage.typed import pack, result_type, unpack


@dataclass(frozen=True)
class Inner:
    """A part."""

    values: np.ndarray
    words: str


@dataclass(frozen=True)
class Whole:
    """Everything that a stage may hand on."""

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
    found = Store(tmp_path).artefact("model", {}, [], lambda: pytest.fail("it is there"), code="0")
    for artefact in (computed, found):
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
