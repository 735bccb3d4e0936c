"""Results of stages as typed values in the store."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, cast

from pipeline.storage.source_code import sources_digest
from pipeline.storage.store import Artefact, Store
from pipeline.storage.typed import pack, unpack

Value = TypeVar("Value")


@dataclass(frozen=True)
class Stored(Generic[Value]):
    """Result of a stage, computed now or read from the store.

    Attributes
    ----------
    value : dataclass
    artefact : Artefact
        Stage and key of the result, and the reason for computing it.
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
    sources: Sequence[str],
) -> Stored[Value]:
    """Return the result of a stage for the given options and inputs; compute it if it is not in the store.

    Parameters
    ----------
    store : Store
    stage : str
    options : dataclass or mapping
        Options that change the result.
    inputs : sequence of Stored
    compute : callable
        Returns the value.
    result : type
        Dataclass of the value.
    sources : sequence of str
        Modules that compute the result; a change in them, or in what they import, changes the key.
    """
    artefact = store.artefact(
        stage,
        options,
        [item.artefact for item in inputs],
        lambda: pack(compute()),
        code=sources_digest(sources),
        fits=lambda cached: unpack(result, cached.arrays, cached.notes),
    )
    if store.dry_run:
        return Stored(cast(Value, None), artefact)  # dry run: the value is not used
    # A new value is rebuilt from its arrays too, so that it equals a cached one.
    return Stored(unpack(result, artefact.arrays, artefact.notes), artefact)
