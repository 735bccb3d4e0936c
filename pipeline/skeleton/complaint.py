"""Faults of a recording that are reported: by a code, with numbers, and in a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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
    values : mapping of str to float
        Numbers of the sentence.
    rejects : bool
        Whether the recording cannot be used.
    """

    code: str
    sentence: str
    where: tuple[str, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)
    rejects: bool = False
