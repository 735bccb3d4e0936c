"""Page of one reconstructed walk: a single HTML file with a player."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

import numpy as np

from pipeline.report import templates
from pipeline.report.templates import encoded, quantised
from pipeline.validation import InvalidInput
from walk3d.film.video.small import MAX_KEY_CHARACTERS, thinned

MAX_BYTES = 1_000_000 + MAX_KEY_CHARACTERS
MAX_FRAMES = 600
"""Maximum number of frames on the page; frames of longer clips are skipped at regular intervals."""
_FOLDER = Path(__file__).resolve().parents[2] / "page"
"""Template, style sheet and script of the page."""
_SCRIPTS = ("walker.js", "players.js", "theme.js", _FOLDER / "walk.js")


@dataclass(frozen=True)
class Frames:
    """Frames of the film that the page shows, with the reconstructed walk in these frames.

    Attributes
    ----------
    numbers : (T,) int
        Frame numbers in the video.
    rate_hz : float
    observed : (15,) bool
        False for joints that were never seen.
    keypoints_px, reprojection_px : (T, 15, 2)
        Keypoints are NaN where missing.
    image_px : (2,)
        Width and height of the image.
    positions_mm, half_mm : (T, 15, 3)
        About the pelvis, right, away and up; half widths of 95 % bars.
    cycle_percent : (T, 2)
        Position of each side in its gait cycle, per cent.
    """

    numbers: np.ndarray
    rate_hz: float
    observed: np.ndarray
    keypoints_px: np.ndarray
    reprojection_px: np.ndarray
    image_px: np.ndarray
    positions_mm: np.ndarray
    half_mm: np.ndarray
    cycle_percent: np.ndarray


@dataclass(frozen=True)
class Cycle:
    """Gait cycle on the page: curves, stance and gait-cycle numbers.

    Attributes
    ----------
    numbers : dict
        Numbers as in ``summary.json``.
    curves : dict of str to array
        Curves over the cycle, by per cent, degrees.  ``angles`` (C, 2, K): left and right, each from its foot's
        contact;
        ``angles_half``: half widths of their 95 % bars.  ``walkers`` (C, K): the average walker; ``walkers_half``: half
        widths of the range of 95 % of walkers.  ``stance`` (2,): per cent of each foot's toe-off.
    curve_names : sequence of str
        Names of the C angles.
    """

    numbers: Mapping[str, Mapping[str, Any]]
    curves: Mapping[str, np.ndarray]
    curve_names: Sequence[str]


@dataclass(frozen=True)
class Heading:
    """Heading of the walker; 0 is towards the camera, +90° to the right in the image.

    Attributes
    ----------
    deg : float
    interval_deg : (float, float)
    alternatives_deg : sequence of float
        Other headings that the keypoints allow.
    """

    deg: float
    interval_deg: tuple[float, float]
    alternatives_deg: Sequence[float]


@dataclass(frozen=True)
class WalkPage:
    """Content of the page of a reconstructed walk.

    Attributes
    ----------
    title, lead, source, view_words, terms : str
    facts : sequence of (str, sequence of str)
        Titles and sentences.
    files : sequence of str
        Names of the files next to the page.
    frames : Frames
    cycle : Cycle
    heading : Heading
    film : sequence of (int, str)
        Frames of the film: number, one of those on the page, and JPEG in base64.
    film_part : (4,)
        Left, top, right and bottom of the part of the image that they show, as shares of its size.
    """

    title: str
    lead: str
    source: str
    view_words: str
    terms: str
    facts: Sequence[tuple[str, Sequence[str]]]
    files: Sequence[str]
    frames: Frames
    cycle: Cycle
    heading: Heading
    film: Sequence[tuple[int, str]] = ()
    film_part: Sequence[float] = (0.0, 0.0, 1.0, 1.0)


def write_walk_page(path: Path, page: WalkPage) -> None:
    """Write the page of a reconstructed walk.

    Raises
    ------
    InvalidInput
        If the page would be larger than `MAX_BYTES`.
    """
    style, script = templates.style(_FOLDER / "walk.css"), templates.scripts(_SCRIPTS)
    shared = templates.in_every_page(style, script)
    own_words = {
        name: escape(getattr(page, name)) for name in ("title", "lead", "source", "view_words", "terms")
    }
    text = Template((_FOLDER / "walk.html").read_text("utf-8")).substitute(
        {name: shared[name] for name in ("style", "script", "roles", "bones")},
        **own_words,
        policy=escape(shared["policy"]),
        image_words=_image_words(page),
        alternatives="; dashed: also possible" if page.heading.alternatives_deg else "",
        rows="".join(_row(name, numbers) for name, numbers in page.cycle.numbers.items()),
        differences=_differences(page.cycle.numbers),
        facts="".join(_fact(title, sentences) for title, sentences in page.facts),
        files=", ".join(f'<a href="{quote(name)}">{escape(name)}</a>' for name in page.files),
        packed=templates.packed_json(_packed(page)),
    )
    content = text.encode()
    if len(content) > MAX_BYTES:
        raise InvalidInput(
            "the page would be too large", path.name, f"at most {MAX_BYTES} bytes",
            len(content), code="file_too_large"
        )  # fmt: skip
    path.write_bytes(content)


def _image_words(page: WalkPage) -> str:
    """Return the caption of the image on the page."""
    drawn = "keypoints (dots) and the projected reconstruction (lines)"
    if not page.film:
        return f"the image with its {drawn}"
    every = f"{len(page.film)} of {len(page.frames.numbers)} frames"
    return f"the film around the walker at {every}, with the {drawn} of the frame that is displayed"


def _cell(number: Mapping[str, Any]) -> str:
    return f"{number['value']:g} ± {number['half_width_95']:g}".replace("-", "−")


def _row(name: str, numbers: Mapping[str, Any]) -> str:
    """Return an HTML table row for one gait-cycle number: left, right and difference, or one value for both sides."""
    heading = escape(f"{name.replace('_', ' ')}, {numbers['unit']}")
    if "left" in numbers:
        larger = ' class="larger"' if numbers["difference"]["larger_than_its_bar"] else ""
        cells = f"<td>{_cell(numbers['left'])}</td><td>{_cell(numbers['right'])}</td>"
        cells += f"<td{larger}>{_cell(numbers['difference'])}</td>"
    else:
        cells = f'<td colspan="2" class="both">{_cell(numbers["both"])}</td><td></td>'
    low, high = numbers["walkers_95"]
    walkers = f"{low:g} to {high:g}".replace("-", "−")
    return f'<tr><th scope="row">{heading}</th>{cells}<td>{walkers}</td></tr>'


def _differences(numbers: Mapping[str, Mapping[str, Any]]) -> str:
    if any(each["difference"]["larger_than_its_bar"] for each in numbers.values() if "difference" in each):
        return "▲: a difference larger than its bar."
    return "No difference of left and right is larger than its bar."


def _fact(title: str, sentences: Sequence[str]) -> str:
    """Return a term and its sentences as HTML; several sentences become a list."""
    if len(sentences) == 1:
        return f"<dt>{escape(title)}</dt><dd>{escape(sentences[0])}</dd>"
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<dt>{escape(title)}</dt><dd><ul>{items}</ul></dd>"


def _packed(page: WalkPage) -> dict[str, Any]:
    """Return the data of the walk that the page's script draws.

    Frames of a long clip are skipped at regular intervals.
    """
    frames, cycle, heading = page.frames, page.cycle, page.heading
    every = -(-len(frames.numbers) // MAX_FRAMES)
    numbers = thinned(frames.numbers, MAX_FRAMES)

    def packed(values: np.ndarray) -> dict[str, str]:
        return quantised(values[::every].reshape(len(numbers), -1))

    visible = np.isfinite(frames.keypoints_px).all(axis=-1)
    return {
        "frames": len(numbers),
        "frame_numbers": numbers.tolist(),
        "times_s": [round(float(number) / frames.rate_hz, 4) for number in numbers],
        "rate_hz": frames.rate_hz / every,
        "observed": frames.observed.tolist(),
        "seen": encoded(visible[::every], "u1"),
        "keypoints": packed(np.where(visible[..., None], frames.keypoints_px, frames.reprojection_px)),
        "image": packed(frames.reprojection_px),
        "positions": packed(frames.positions_mm),
        "half": packed(frames.half_mm),
        "film": [[int(np.searchsorted(numbers, number)), jpeg] for number, jpeg in page.film],
        "part": [*page.film_part],
        "image_px": frames.image_px.tolist(),
        "curve_names": cycle.curve_names,
        **{name: values.round(2).tolist() for name, values in cycle.curves.items()},
        "percent": frames.cycle_percent[::every].round(2).tolist(),
        "heading_deg": heading.deg,
        "heading_interval_deg": heading.interval_deg,
        "alternatives_deg": heading.alternatives_deg,
    }
