"""Rejections that tests expect, by code and values: the sentence may be written anew."""

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
"""Words of Python, which no message to a user contains."""


@contextmanager
def rejects(code: str, where: str = "", **values: Any) -> Iterator[pytest.ExceptionInfo[InvalidInput]]:
    """Require an InvalidInput with this code, text in `where` and these of its values."""
    with pytest.raises(InvalidInput) as caught:
        yield caught
    assert (caught.value.code, values) == (
        code,
        {name: caught.value.values.get(name) for name in values},
    ), str(caught.value)
    assert where in str(caught.value.where), str(caught.value)


@contextmanager
def rejects_options(code: str, where: str, *shown: str) -> Iterator[pytest.ExceptionInfo[Exception]]:
    """Require an error of the options, ours or of a library, that has this code and place and shows these names."""
    with pytest.raises(Exception) as caught:  # Hydra's, OmegaConf's or ours
        yield caught
    error = caught.value if isinstance(caught.value, InvalidInput) else in_words(caught.value)
    assert isinstance(error, InvalidInput)
    assert (error.code, error.where) == (code, where), str(error)
    assert [name for name in shown if name not in str(error)] == [], str(error)
    assert sentence(caught.value) == str(error)
    assert "\n" not in str(error)
