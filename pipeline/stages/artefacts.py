"""What a stage keeps in the store: a typed value, with the key that the next stage depends on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from pipeline.storage.source_code import sources_digest
from pipeline.storage.store import Artefact, Store
from pipeline.storage.typed import pack, unpack

Value = TypeVar("Value")


@dataclass(frozen=True)
class Stored(Generic[Value]):
    """The value that a stage made, or found in the store.

    Attributes
    ----------
    value : dataclass
    artefact : Artefact
        Its stage, key, seconds, and why it was computed.
    """

    value: Value
    artefact: Artefact


def stored(
    store: Store,
    stage: str,
    options: Any,
    inputs: Sequence[Stored],
    compute: Callable[[], Value],
    *,
    result: type[Value],
    source: str,
) -> Stored[Value]:
    """Return what a stage makes of these options and inputs, computed only if need be.

    Parameters
    ----------
    store : Store
    stage : str
    options : dataclass or mapping
        Whatever changes the result, beside the inputs.
    inputs : sequence of Stored
    compute : callable
        Returns the value.
    result : type
        Its dataclass.
    source : str
        The module that does the work; a change in it, or in what it imports, is another key.
    """
    artefact = store.artefact(
        stage,
        options,
        [kept.artefact for kept in inputs],
        lambda: pack(compute()),
        code=sources_digest([source]),
    )
    # Read from the arrays, also when just computed: the same value whether computed now or found.
    return Stored(unpack(result, artefact.arrays, artefact.notes), artefact)
