"""Rejections that tests expect, by code and values: the sentence may be written anew."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from pipeline.validation import InvalidInput


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
