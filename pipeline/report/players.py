"""Compact data of walkers and film clips for the page's players, which reconstruct them in the browser.

`walkers` returns the Fourier representations of all walkers in single precision, a tenth of the bytes of all folds.
The browser trains each fold from them like `core.linear_model`, and reconstructs like `core.reconstruction`; plug-ins
bring scripts for their methods.  No result is computed beforehand.  `clips` returns clips of park2011's figure 4 in 16
bits: images, cameras and reconstructions, from which the browser intersects rays and spheres.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pipeline import plugins
from pipeline.core.choice import nearest_to_medians
from pipeline.core.limb_chain import WALKER14
from pipeline.core.reconstructibility import confidence_of_mirror_margin
from pipeline.palette import CONFIDENCES
from pipeline.report.published import PublishedFigure
from pipeline.report.templates import encoded, quantised

WALKER_ARRAYS = (
    "samples",
    "residual_covariance_mm2",
    "temporal_covariance_mm2",
    "walker_frequency_hz",
    "person",
)
CLIP_ARRAYS = (
    "truth",
    "positions",
    "images",
    "camera_matrix",
    "mirror_margin",
    "cameras",
    "stretch",
)
AS_CHOSEN = "as_chosen."
"""Prefix of the arrays of park2011's figure 4 in which each limb selects its mirror image independently."""

MAX_CLIPS = 4

COLUMNS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "zhang2007_fig5": {
        "table.csv": ("method", "view_angle_deg", "absolute_error_mm2", "rms_error_mm", "relative_error")
    },
    "zhang2007_fig4": {
        "table.csv": (
            *("walker", "view_angle_deg", "method", "instant", "joint"),
            *(f"reconstructed_{axis}_mm" for axis in "xyz"),
        )
    },
}
"""Table columns with which the browser checks the results that it computes, by figure and table."""


def columns_of(figure: str) -> dict[str, set[str]]:
    """Return the columns that scripts read from the tables of a figure, by file name.

    Scripts of plug-ins are included.
    """
    columns_by_table: dict[str, set[str]] = {}
    for columns in (COLUMNS, *(page.columns for page in plugins.pages())):
        for name, read_columns in columns.get(figure, {}).items():
            columns_by_table.setdefault(name, set()).update(read_columns)
    return columns_by_table


def walkers(figure: PublishedFigure | None) -> tuple[dict[str, Any], str]:
    """Return the data of walkers for the browser, or an empty dict with the reason why no walker is available.

    Parameters
    ----------
    figure : PublishedFigure, optional
        Figure ``zhang2007_fig5``.
    """
    if figure is None:
        return {}, "zhang2007_fig5 is not made yet"
    arrays, people = figure.arrays, figure.table("table_people")
    absent = [name for name in WALKER_ARRAYS if name not in arrays]
    if absent or people is None:
        lacking = (*absent, "table_people")[0]
        return (
            {},
            f"zhang2007_fig5 was made before its walkers were published ({lacking}): make the figure again",
        )
    for option, expected in _AS_COMPUTED.items():
        group, name = option.split(".")
        if (value := figure.option(group, name)) != expected:
            return (
                {},
                f"the browser computes with {option}={expected}, but these results have {option}={value}",
            )
    if arrays["samples"].shape[1] != 225:
        return (
            {},
            f"the browser computes with 225 numbers per walker, but these results have {arrays['samples'].shape[1]}",
        )
    _, person = np.unique(arrays["person"], return_inverse=True)
    return {
        "shown": nearest_to_medians(errors_of_walkers(people, arrays["walker"], 0.0)),
        "names": arrays["walker"].tolist(),
        "person": person.tolist(),
        "estimated": arrays["unmeasured"].astype(int).tolist()
        if np.any(arrays.get("unmeasured", False))
        else [],
        "frequency_hz": np.round(arrays["walker_frequency_hz"], 4).tolist(),
        "samples": encoded(arrays["samples"], "<f4"),
        "residual": encoded(_horizontal(arrays["residual_covariance_mm2"]), "<f4"),
        "temporal": encoded(_horizontal(arrays["temporal_covariance_mm2"]), "<f4"),
        "components": int(figure.option("model", "components")),
        "sigma2_mm2": float(figure.option("sweep", "noise_variance_mm2")),
        "sigma2_range_mm2": arrays["sigma2_mm2"][[0, -1]].tolist(),
        "views_deg": arrays["view_angle_deg"].tolist(),
    }, ""


_AS_COMPUTED: Mapping[str, Any] = {
    "model.divisor": "R-1",
    "model.mirror": False,
    "sweep.truth": "motion",
    "sweep.missing_variance": "temporal",
    "dataset.harmonics": 2,
}
"""Values of the options that the computation in the browser assumes."""


def _horizontal(covariance: np.ndarray) -> np.ndarray:
    """Return the horizontal entries xx, xy and yy, (R, 15, 3), of covariances (R, 15, 3, 3)."""
    return np.stack([covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]], axis=-1)


def errors_of_walkers(
    people: Mapping[str, np.ndarray], walkers: np.ndarray, view_deg: float
) -> dict[str, np.ndarray]:
    """Return each method's depth errors (R,) of the walkers, mm, at the available view nearest to a given view.

    Parameters
    ----------
    people : mapping of str to array
        Table ``table_people`` of zhang2007_fig5.
    walkers : (R,) str
    view_deg : float
    """
    views = people["view_angle_deg"]
    rows = np.flatnonzero(views == views[np.abs(views - view_deg).argmin()])
    error = {(people["method"][n], people["walker"][n]): people["rms_error_mm"][n] for n in rows}
    methods = dict.fromkeys(people["method"].tolist())
    return {method: np.array([error[method, walker] for walker in walkers]) for method in methods}


def clips(figure: PublishedFigure | None) -> tuple[dict[str, Any], str]:
    """Return one clip of each action of park2011_fig4 for the browser, or an empty dict with the reason."""
    if figure is None:
        return {}, "park2011_fig4 is not made yet"
    if absent := [name for name in CLIP_ARRAYS if AS_CHOSEN + name not in figure.arrays]:
        return (
            {},
            f"park2011_fig4 was made before its cameras were published ({absent[0]}): make the figure again",
        )
    arrays = {name: figure.arrays[AS_CHOSEN + name] for name in CLIP_ARRAYS}
    names = figure.arrays["clip_name"][arrays["stretch"]].tolist()
    action = _actions(figure)
    numbers = list({action.get(name, name): n for n, name in reversed(list(enumerate(names)))}.values())
    return {
        "cameras": arrays["cameras"].tolist(),
        "limbs": WALKER14.limbs,
        "ends": WALKER14.ends.tolist(),
        "clips": [
            {"name": names[n], "action": action.get(names[n], ""), **_clip(arrays, n)}
            for n in sorted(numbers)[:MAX_CLIPS]
        ],
    }, ""


def _actions(figure: PublishedFigure) -> dict[str, str]:
    table = figure.table("table_clips") or {}
    if not {"clip", "action"} <= table.keys():
        return {}
    return dict(zip(map(str, table["clip"]), map(str, table["action"]), strict=True))


def _clip(arrays: Mapping[str, np.ndarray], n: int) -> dict[str, Any]:
    frames = arrays["truth"].shape[1]
    cameras = [
        {
            "positions": quantised(arrays["positions"][n, c].reshape(frames, -1)),
            "images": quantised(arrays["images"][n, c].reshape(frames, -1)),
            "matrix": encoded(arrays["camera_matrix"][n, c], "<f4"),
            "margin": [round(min(margin, 999.0), 3) for margin in margins],
            "confidence": [CONFIDENCES[confidence_of_mirror_margin(margin)] for margin in margins],
        }
        for c, margins in enumerate(arrays["mirror_margin"][n].tolist())
    ]
    truth = quantised(arrays["truth"][n].reshape(frames, -1))
    return {"frames": frames, "truth": truth, "seen": cameras}
