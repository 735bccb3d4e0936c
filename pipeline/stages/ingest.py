"""Ingest: recordings, or what is synthesised in their place, to the clips that a figure is made of.

What for is told by the purpose: walks (zhang2004, zhang2007), performances of one action (mozerov2006) or clips of
varied motion (park2011).  How each becomes usable is in `pipeline.clips`.
"""

from __future__ import annotations

from typing import Any

from pipeline.clips import performances, varied, walks
from pipeline.clips.corpus import clips_of
from pipeline.skeleton import SourceMapping
from pipeline.storage.store import Artefact, Store
from pipeline.studies.options import Data, FolderData, RecordedData, SyntheticData


def run(
    options: Data, skeleton: SourceMapping, seed: int, workers: int, store: Store, *, purpose: str = "walks"
) -> Artefact:
    """Artefact with the clips, end to end, and the report on each in its notes.

    Arrays of all purposes: ``positions`` (sum of T, 15, 3) mm, ``first`` (W + 1,) where each clip starts,
    ``frame_rate_hz``, ``leg_length_mm`` (W,), ``person``, ``clip``, ``source`` (W,) text.  Walks: also
    ``frequency_hz``, ``residual_share``, ``stature_mm`` (W,).  Synthetic performances: also ``phase`` (sum of T,)
    the true course of the action and ``moving_phase`` (2,).  Clips: also ``action`` (W,) text.
    """
    match options, purpose:
        case SyntheticData(), "walks":
            made_of: dict[str, Any] = {"data": _walks_alone(options), "seed": seed}
            return store.artefact(
                "ingest", made_of, [], lambda: walks.synthetic_walks(options, seed, workers)
            )
        case SyntheticData(), "performances":
            chosen = options.performances
            made_of = {"performances": chosen, "seed": seed}
            return store.artefact(
                "ingest", made_of, [], lambda: performances.synthetic_performances(chosen, seed)
            )
        case RecordedData() | FolderData(), "walks":
            clips = clips_of(options, skeleton, purpose)
            made_of = {"steady": options.steady, "clips": [c.identity for c in clips]}
            return store.artefact(
                "ingest", made_of, [], lambda: walks.recorded_walks(clips, options.steady, workers)
            )
        case RecordedData() | FolderData(), "performances":
            clips = clips_of(options, skeleton, purpose)
            wanted = options.performances
            made_of = {
                "performances": wanted,
                "steady": options.steady,
                "clips": [c.identity for c in clips],
            }
            return store.artefact(
                "ingest",
                made_of,
                [],
                lambda: performances.recorded_performances(clips, wanted, options.steady, workers),
            )
        case SyntheticData(), "clips":
            limbs = options.clips
            made_of = {"clips": limbs, "seed": seed}
            return store.artefact("ingest", made_of, [], lambda: varied.synthetic_clips(limbs, seed))
        case RecordedData() | FolderData(), "clips":
            clips = clips_of(options, skeleton, purpose)
            gap_s = options.steady.gap_s
            made_of = {"gap_s": gap_s, "clips": [c.identity for c in clips]}
            return store.artefact("ingest", made_of, [], lambda: varied.recorded_clips(clips, gap_s, workers))
        case _:
            raise TypeError(f"no {purpose} for {type(options).__name__}")


def _walks_alone(options: SyntheticData) -> dict[str, Any]:
    """What synthetic walks depend on, the other corpora left out."""
    return {name: value for name, value in vars(options).items() if name not in ("performances", "clips")}
