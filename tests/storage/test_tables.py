"""Tests of tables: they are read as written, equal numbers give equal bytes, and invalid tables are rejected."""

import csv
import errno
import gzip
import os
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.storage import tables
from tests.rejects import rejects


def test_the_file_is_what_a_person_expects(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    tables.write(
        path,
        {
            "method": ["map", "least_squares", "map"],
            "view_angle_deg": np.array([10, 0, 0]),
            "absolute_error_mm2": [1 / 3, np.nan, 2e-12],
            "proved": [True, False, True],
        },
        sort_by=["method", "view_angle_deg"],
    )
    assert path.read_bytes() == (
        b"method,view_angle_deg,absolute_error_mm2,proved\n"
        b"least_squares,0,,False\n"
        b"map,0,2e-12,True\n"
        b"map,10,0.3333333333,True\n"
    )
    assert [p.name for p in tmp_path.iterdir()] == ["table.csv"]


def test_rows_are_written_in_blocks_as_in_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frame = pd.DataFrame(
        {
            "walker": ["b", "a, quoted", "b", "c", "a, quoted"],
            "error": [1 / 3, np.nan, -0.0, np.inf, 1e300],
            "n": range(5),
        }
    )
    tables.write(tmp_path / "one.csv", frame)
    tables.write(tmp_path / "lists.csv", {name: frame[name].tolist() for name in frame})
    monkeypatch.setattr(tables, "_ROWS_AT_A_TIME", 2)
    tables.write(tmp_path / "blocks.csv", frame)
    first, lists, blocks = ((tmp_path / f"{name}.csv").read_bytes() for name in ("one", "lists", "blocks"))
    assert first == lists == blocks
    assert first.splitlines()[1:4] == [b"b,0.3333333333,0", b'"a, quoted",,1', b"b,0,2"]
    tables.write(tmp_path / "sorted.csv", frame, sort_by=["walker", "n"])
    assert [row["n"] for row in tables.read_rows(tmp_path / "sorted.csv")] == ["1", "4", "0", "2", "3"]


def test_every_type_comes_back(tmp_path: Path) -> None:
    columns = {
        "whole": np.array([-3, 0, 2**53 + 1]),
        "number": np.array([-1.5, np.nan, np.inf]),
        "flag": np.array([True, False, True]),
        "text": np.array(["02", 'a "b", c', ""]),
    }
    tables.write(tmp_path / "t.csv", columns, sort_by=[])
    back = tables.read(tmp_path / "t.csv")
    assert list(back) == list(columns)
    for name, values in columns.items():
        np.testing.assert_array_equal(back[name], values)
        assert back[name].dtype.kind == values.dtype.kind
    assert tables.read_rows(tmp_path / "t.csv")[1] == {
        "whole": "0",
        "number": "",
        "flag": "False",
        "text": 'a "b", c',
    }


@given(
    numbers=st.lists(st.floats(allow_nan=True, width=64), min_size=1, max_size=20),
    texts=st.data(),
)
def test_write_then_read_keeps_ten_digits_and_all_text(
    tmp_path_factory: pytest.TempPathFactory, numbers: list[float], texts: st.DataObject
) -> None:
    alphabet = st.characters(blacklist_categories=["Cs"], blacklist_characters="\r\n\0")
    text = texts.draw(st.lists(st.text(alphabet, max_size=8), min_size=len(numbers), max_size=len(numbers)))
    path = tmp_path_factory.mktemp("table") / "t.csv"
    tables.write(path, {"number": numbers, "text": ["t" + item for item in text]}, sort_by=[])
    back = tables.read(path)
    expected = [float(f"{number:.10g}") for number in numbers]
    np.testing.assert_array_equal(back["number"].astype(float), expected)
    assert [item[1:] for item in back["text"]] == text


def test_a_column_of_nothing_but_gaps_and_a_table_without_rows(tmp_path: Path) -> None:
    tables.write(tmp_path / "gaps.csv", {"x": [np.nan, np.nan]}, sort_by=[])
    assert np.isnan(tables.read(tmp_path / "gaps.csv")["x"]).tolist() == [True, True]
    tables.write(tmp_path / "none.csv", {"x": np.zeros(0), "y": np.zeros(0, int)}, sort_by=["x"])
    assert {name: values.shape for name, values in tables.read(tmp_path / "none.csv").items()} == {
        "x": (0,),
        "y": (0,),
    }


def test_equal_tables_are_equal_bytes_whatever_the_order_of_rows(tmp_path: Path) -> None:
    generator = np.random.default_rng(1)
    a, b = generator.permutation(50), generator.random(50)
    shuffle = generator.permutation(50)
    tables.write(tmp_path / "1.csv", {"a": a, "b": b}, sort_by=["a"])
    tables.write(tmp_path / "2.csv", {"a": a[shuffle], "b": b[shuffle]}, sort_by=["a"])
    assert (tmp_path / "1.csv").read_bytes() == (tmp_path / "2.csv").read_bytes()


def test_minus_zero_is_zero(tmp_path: Path) -> None:
    tables.write(tmp_path / "t.csv", {"x": [-0.0, 0.5]}, sort_by=[])
    assert (tmp_path / "t.csv").read_bytes() == b"x\n0\n0.5\n"


@pytest.mark.parametrize(
    ("columns", "sort_by", "code", "values"),
    [
        ({}, [], "no_columns", {}),
        ({"a": [1, 2], "b": [1]}, [], "other_length", {"lengths": {"a": 2, "b": 1}}),
        ({"a": [1]}, ["b"], "no_column", {"column": "b"}),
        ({"a": [[1, 2]]}, [], "wrong_shape", {"column": "a"}),
        ({"a": ["x", 1]}, [], "mixed_types", {"column": "a", "type": "text and other types"}),
        ({"a": [None, 1.0]}, [], "mixed_types", {"column": "a", "type": "object"}),
        ({"a": [1j]}, [], "mixed_types", {"column": "a", "type": "complex128"}),
        ({"": [1]}, [], "no_name", {}),
        ({"a": ["two\nlines"]}, [], "several_lines", {"column": "a"}),
    ],
)
def test_what_is_no_table_is_refused_and_nothing_written(
    tmp_path: Path, columns: dict[str, Any], sort_by: list[str], code: str, values: dict[str, Any]
) -> None:
    with rejects(code, "t.csv", **values):
        tables.write(tmp_path / "t.csv", columns, sort_by=sort_by)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "code", "where", "values"),
    [
        (b"", "empty_table", "t.csv", {}),
        (b"\n", "empty_table", "t.csv", {}),
        (b"a,b\n1,2\n3\n", "row_length", "t.csv, line 3", {"columns": 2, "cells": 1}),
        (b"a,b\n1,2,3\n", "row_length", "t.csv, line 2", {"columns": 2, "cells": 3}),
        (b"a,b\n1,2\n\n", "row_length", "t.csv, line 3", {"columns": 2, "cells": 0}),
        (b"a,a\n1,2\n", "duplicate_name", "t.csv", {"column": "a"}),
        (b"a\n\xff\n", "not_utf8", "t.csv, byte 2", {}),
        (b'a\n"b\n', "not_csv", "t.csv, line 2", {}),
    ],
)
def test_a_broken_table_is_refused(
    tmp_path: Path, content: bytes, code: str, where: str, values: dict[str, Any]
) -> None:
    (tmp_path / "t.csv").write_bytes(content)
    for reader in (tables.read, tables.read_rows):
        with rejects(code, where, **values):
            reader(tmp_path / "t.csv")


def test_a_missing_table_is_refused(tmp_path: Path) -> None:
    with rejects("no_file", "t.csv"):
        tables.read(tmp_path / "t.csv")


def test_a_full_disk_leaves_the_older_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "t.csv"
    tables.write(path, {"a": [1]}, sort_by=[])

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with rejects("cannot_write", errno=errno.ENOSPC):
        tables.write(path, {"a": [2]}, sort_by=[])
    assert [p.name for p in tmp_path.iterdir()] == ["t.csv"]
    assert path.read_bytes() == b"a\n1\n"


def test_compare_names_the_cells_that_differ(tmp_path: Path) -> None:
    base: dict[str, list[Any]] = {
        "angle": [0, 1, 2],
        "error": [1.0, np.nan, 3e6],
        "method": ["map", "map", "ls"],
    }
    tables.write(tmp_path / "a.csv", base, sort_by=[])

    def against(**changes: Any) -> list[str]:
        tables.write(tmp_path / "b.csv", {**base, **changes}, replace=True)
        return tables.compare(tmp_path / "a.csv", tmp_path / "b.csv")

    assert against() == []
    assert against(error=[1.0 + 1e-7, np.nan, 3e6 + 1]) == []
    assert against(error=[1.00001, np.nan, 3e6]) == ["line 2, error: 1.0 is not 1.00001"]
    assert against(error=[1.0, 0.0, 3e6]) == ["line 3, error: nan is not 0"]
    assert against(error=[1.0, np.inf, np.nan]) == [
        "line 3, error: nan is not inf",
        "line 4, error: 3000000.0 is not nan",
    ]
    assert against(method=["map", "ls", "ls"]) == ["line 3, method: map is not ls"]
    assert against(angle=[0.0, 1.5, 2.0]) == ["line 3, angle: 1 is not 1.5"]
    assert against(more=[1, 2, 3]) == [
        "the columns differ: angle, error, method and angle, error, method, more"
    ]
    tables.write(tmp_path / "c.csv", {k: v[:2] for k, v in base.items()}, sort_by=[])
    assert tables.compare(tmp_path / "a.csv", tmp_path / "c.csv") == ["the numbers of rows differ: 3 and 2"]


def test_the_relative_difference_is_the_least_tolerance_that_compare_accepts(tmp_path: Path) -> None:
    a, b = tmp_path / "a.csv", tmp_path / "b.csv"
    same = {"word": ["x", "y", "z"], "gap": [np.nan, np.inf, 0.0]}
    tables.write(a, {**same, "error": [1.0, 200.0, 0.0], "flag": [True, False, True]}, sort_by=[])
    tables.write(b, {**same, "error": [1.001, 200.02, 5e-10], "flag": [True, True, True]}, sort_by=[])
    result = tables.relative_differences(a, b)
    assert result == {"word": 0.0, "gap": 0.0, "error": pytest.approx(1e-3, rel=2e-3), "flag": np.inf}
    at, below = (
        [
            described
            for described in tables.compare(a, b, relative=factor * result["error"])
            if "error" in described
        ]
        for factor in (1.0, 0.999)
    )
    assert at == []
    assert below == ["line 2, error: 1 is not 1.001"]
    tables.write(b, {**same, "error": [1.0, 200.0, np.nan], "flag": [True, False, True]}, sort_by=[])
    assert tables.relative_differences(a, b)["error"] == np.inf
    tables.write(b, {"word": ["x"]}, replace=True)
    assert set(tables.relative_differences(a, b).values()) == {np.inf}


def test_compare_accepts_equal_infinities_and_tells_how_many_more(tmp_path: Path) -> None:
    tables.write(tmp_path / "a.csv", {"x": [np.inf, *range(20)]}, sort_by=[])
    tables.write(tmp_path / "b.csv", {"x": [np.inf, *range(1, 21)]}, sort_by=[])
    described = tables.compare(tmp_path / "a.csv", tmp_path / "b.csv")
    assert len(described) == 11
    assert described[0] == "line 3, x: 0.0 is not 1.0"
    assert described[-1] == "and 10 more cells"
    assert tables.compare(tmp_path / "a.csv", tmp_path / "b.csv", absolute=1.0) == []


def test_no_cell_is_a_formula_and_every_text_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    clips = [
        "=1+1.bvh",
        "+cmd|'/C calc'!A0",
        "@SUM(A1)",
        "-2+3",
        " =x",
        "'=x",
        "''=x",
        "'quoted'",
        "-1.5",
        "+2",
        "-inf",
        "a=b",
    ]
    tables.write(path, {"clip": clips, "=title": clips, "number": np.arange(12.0) - 6.0})
    written = list(csv.reader(path.read_text("utf-8").splitlines()))
    assert [row[0] for row in written] == [
        "clip", "'=1+1.bvh", "'+cmd|'/C calc'!A0", "'@SUM(A1)", "'-2+3", "' =x", "''=x", "'''=x", "'quoted'", "-1.5",
        "+2", "-inf", "a=b",
    ]  # fmt: skip
    assert written[0][1] == "'=title"
    assert written[1][2] == "-6"
    assert tables.read(path)["clip"].tolist() == tables.read(path)["=title"].tolist() == clips
    assert [row["=title"] for row in tables.read_rows(path)] == clips
    before = path.read_bytes()
    rows = [{"clip": "=new", "=title": "-3", "number": 1.0}]
    columns = ["clip", "=title", "number"]
    tables.renew(path, rows, lambda row: row["clip"] == "=1+1.bvh", columns=columns, sort_by=["clip"])
    again = tables.read_rows(path)
    assert {row["clip"] for row in again} == {*clips, "=new"} - {"=1+1.bvh"}
    assert {row["number"] for row in again} == {*(row[2] for row in written[2:]), "1"}
    tables.write(
        path, pd.DataFrame({"clip": clips, "=title": clips, "number": np.arange(12.0) - 6.0}), replace=True
    )
    assert path.read_bytes() == before


@given(st.lists(st.text(st.sampled_from("'=+-@ a1"), min_size=1, max_size=4), min_size=1, max_size=8))
def test_texts_of_signs_and_apostrophes_come_back(
    tmp_path_factory: pytest.TempPathFactory, texts: list[str]
) -> None:
    path = tmp_path_factory.mktemp("table") / "t.csv"
    tables.write(path, {"text": ["b", *texts]})
    assert [row["text"] for row in tables.read_rows(path)] == ["b", *texts]
    cells = path.read_text("utf-8").splitlines()
    assert not [cell for cell in cells if cell.lstrip()[:1] in "=@" and cell.strip()]


def test_a_compressed_table_that_unpacks_to_much_more_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "table.csv.gz"
    path.write_bytes(gzip.compress(b"a,b\n" + b"1,2\n" * 14_500_000))
    assert path.stat().st_size < 60_000
    for reader in (tables.read, tables.read_rows):
        with rejects("too_large_unpacked", "table.csv.gz", at_most=2**23):
            reader(path)
    path.write_bytes(gzip.compress(b"a,b\n1,2\n")[:-5])
    with rejects("broken_gzip", "table.csv.gz"):
        tables.read(path)


@pytest.mark.parametrize("width", [10_000, 1_000_000])
def test_a_table_of_very_many_columns_is_refused(tmp_path: Path, width: int) -> None:
    (tmp_path / "t.csv").write_text("," * width + "\n")
    with rejects("too_many_columns", "t.csv"):
        tables.read(tmp_path / "t.csv")


def test_tables_agree_to_a_millionth_and_to_a_billionth_near_zero() -> None:
    first = {"x": np.array([1000.0, 0.0])}
    for off, near_zero, count in (
        (0.9e-3, 0.9e-9, 0),
        (1.1e-3, 0.9e-9, 1),
        (0.9e-3, 1.1e-9, 1),
        (1.9e-3, 1.9e-9, 2),
    ):
        assert len(tables.compare(first, {"x": np.array([1000.0 + off, near_zero])})) == count
    assert tables.relative_differences(first, {"x": np.array([1000.0, 0.9e-9])}) == {"x": 0.0}
    assert tables.relative_differences(first, {"x": np.array([1000.0, 1.9e-9])})["x"] > 0.0
    assert tables.relative_differences({"x": np.array([])}, {"x": np.array([])}) == {"x": 0.0}


def test_numbers_and_text_agree_as_text() -> None:
    words, numbers = np.array(["1", "x"]), np.array([1, 2])
    assert tables.needed(numbers, words, 0.0).tolist() == [0.0, np.inf]
    assert tables.needed(words, numbers, 0.0).tolist() == [0.0, np.inf]


@pytest.mark.parametrize(
    ("a", "b", "absolute", "needed"),
    [(10.0, 9.0, 0.0, 0.1), (-9.0, -10.0, 0.5, 0.05), (1.0, 1.4, 0.5, 0.0), (np.nan, np.nan, 0.0, 0.0),
     (np.inf, np.inf, 0.0, 0.0), (np.nan, 1.0, 9.0, np.inf), (1.0, np.inf, 9.0, np.inf)],
)  # fmt: skip
def test_the_tolerance_that_two_numbers_need(a: float, b: float, absolute: float, needed: float) -> None:
    assert tables.needed(np.array([a]), np.array([b]), absolute)[0] == pytest.approx(needed)
