"""Complaints and remarks about a recording, each with a code, values and a sentence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Complaint:
    """Complaint about the body in a recording, or about its mapping to joints.

    Attributes
    ----------
    code : str
        Kind of the fault.
    sentence : str
    where : tuple of str
        Joints with the fault.
    values : mapping of str
        Numbers and names in the sentence.
    rejects : bool
        True if the recording cannot be used.
    """

    code: str
    sentence: str
    where: tuple[str, ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)
    rejects: bool = False


class Remark(str):
    """Sentence about an unusual property of a recording, with a code that programs can test.

    Examples
    --------
    >>> remark = Remark("The times are read as milliseconds.", "times")
    >>> print(remark, remark.code)
    The times are read as milliseconds. times
    """

    code: str

    def __new__(cls, sentence: str, code: str = "") -> Remark:
        remark = super().__new__(cls, sentence)
        remark.code = code
        return remark


def remarks_of(code: str, notes: Iterable[str]) -> list[str]:
    """Return those notes that are remarks with a given code."""
    return [note for note in notes if isinstance(note, Remark) and note.code == code]
