"""Assertions that an input is rejected with a given code and given values, whatever the wording of the message."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from pipeline.cli.composition import in_words
from pipeline.cli.errors import sentence
from pipeline.validation import InvalidInput

PYTHON = re.compile(
    r"\b\w+Error\b|\bBadZipFile\b|\bNoneType\b|\bTraceback\b|negative seek|cannot reshape|has no attribute|unhashable|"
    r"subscriptable|codec can't|out of bounds|not iterable|invalid literal|could not convert|unsupported operand|"
    r"index out of range|positional argument|object is not|<class |__\w+__"
)
"""Terms of Python that no message to a user may contain."""


@contextmanager
def rejects(code: str, where: str = "", **values: Any) -> Iterator[pytest.ExceptionInfo[InvalidInput]]:
    """Assert that an `InvalidInput` is raised with this code, these values, and a location that contains this text."""
    with pytest.raises(InvalidInput) as caught:
        yield caught
    assert (caught.value.code, values) == (
        code,
        {name: caught.value.values.get(name) for name in values},
    ), str(caught.value)
    assert where in str(caught.value.where), str(caught.value)


@contextmanager
def rejects_options(code: str, where: str, *shown: str) -> Iterator[pytest.ExceptionInfo[Exception]]:
    """Assert that wrong options are rejected with this code and location, and that the message contains these names."""
    with pytest.raises(Exception) as caught:  # Hydra's, OmegaConf's or ours
        yield caught
    error = caught.value if isinstance(caught.value, InvalidInput) else in_words(caught.value)
    assert isinstance(error, InvalidInput)
    assert (error.code, error.where) == (code, where), str(error)
    assert [name for name in shown if name not in str(error)] == [], str(error)
    assert sentence(caught.value) == str(error)
    assert "\n" not in str(error)
