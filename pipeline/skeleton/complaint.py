"""Faults and remarks on a recording: by a code, with numbers, and in a sentence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Complaint:
    """Fault of a body or of a mapping.

    Attributes
    ----------
    code : str
        Kind of the fault, one word.
    sentence : str
    where : tuple of str
        Joints.
    values : mapping of str
        Numbers and names in the sentence.
    rejects : bool
        Whether the recording cannot be used.
    """

    code: str
    sentence: str
    where: tuple[str, ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)
    rejects: bool = False


class Remark(str):
    """Sentence on what is odd in a recording, with a code that other code reads.

    Examples
    --------
    >>> remark = Remark("The times are taken as milliseconds.", "times")
    >>> print(remark, remark.code)
    The times are taken as milliseconds. times
    """

    code: str

    def __new__(cls, sentence: str, code: str = "") -> Remark:
        remark = super().__new__(cls, sentence)
        remark.code = code
        return remark


def remarks_of(code: str, notes: Iterable[str]) -> list[str]:
    """Return the remarks that have a code, among notes with and without."""
    return [note for note in notes if isinstance(note, Remark) and note.code == code]
