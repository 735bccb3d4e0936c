"""Options that several sweeps share, refused in one sentence if they cannot be: names and ranges of values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core.articulation import Adjustment
from pipeline.studies.options import LimbSweep, RadiusScaleSweep
from pipeline.validation import InvalidInput

CAMERAS = ("still", "moving", "shaky")
ADJUSTMENTS: tuple[Adjustment, ...] = ("per_frame", "global", "robust")


def check_sweep(options: LimbSweep, *, adjusts: Sequence[str] | None = None) -> None:
    """Nothing; a InvalidInput if the options are none.

    Parameters
    ----------
    options : LimbSweep
    adjusts : sequence of str, optional
        Adjustments of the radius that are asked for.
    """
    for where, value, least in (
        ("trials", options.trials, 1),
        ("distance_mm", options.distance_mm, 1.0),
        ("focal_px", options.focal_px, 1.0),
        ("time_limit_s", options.time_limit_s, 0.0),
    ):
        if not least <= value < np.inf:
            raise InvalidInput(
                "a limb cannot be tried so",
                where=f"sweep.{where}",
                expected=f"{least:g} or more",
                received=f"{value:g}",
            )
    check_names("cameras", options.cameras, CAMERAS)
    if adjusts is not None:
        check_names("adjusts" if isinstance(options, RadiusScaleSweep) else "adjust", adjusts, ADJUSTMENTS)


def check_names(where: str, names: Sequence[str], known: Sequence[str]) -> None:
    """Nothing; a InvalidInput if names are none, unknown or stand twice.

    Parameters
    ----------
    where : str
        The option of the sweep.
    names, known : sequence of str
    """
    if len(names) == 1 and names[0] not in known:
        raise InvalidInput(
            "the name is unknown",
            where=f"sweep.{where}",
            expected="one of " + ", ".join(known),
            received=names[0],
        )
    if not names or len(set(names)) < len(names) or not set(names) <= set(known):
        raise InvalidInput(
            "names are none, unknown or stand twice",
            where=f"sweep.{where}",
            expected="some of " + ", ".join(known),
            received=", ".join(names) or "none",
        )


def check_values(where: str, values: Sequence[float], least: float, most: float = np.inf) -> None:
    """Nothing; a InvalidInput if values are none, out of range, or do not increase.

    Parameters
    ----------
    where : str
        The option of the sweep.
    values : sequence of float
    least, most : float
        Ends of the range, both allowed.
    """
    given = np.asarray(values, dtype=float)
    if not given.size or not ((given >= least) & (given <= most)).all() or (np.diff(given) <= 0).any():
        raise InvalidInput(
            "values to be tried are none, out of range, or do not increase",
            where=f"sweep.{where}",
            expected=f"{least:g} " + ("or more" if most == np.inf else f"to {most:g}"),
            received=", ".join(f"{v:g}" for v in given) or "none",
        )
