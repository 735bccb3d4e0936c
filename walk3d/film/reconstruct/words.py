"""Sentences that summarise a reconstructed walk, for the terminal, the page and the recording."""

from __future__ import annotations

from typing import Any

from walk3d.film.walk.sagittal_angles import SIDES

_AUDIENCE = {"measured_as_ours": "people measured as the model's were", "anybody": "any person"}
VERDICTS = {"walk": "A walk.", "doubtful": "Perhaps a walk.", "not_a_walk": "Not a walk."}


def facts(summary: dict[str, Any]) -> list[tuple[str, list[str]]]:
    """Return titles and sentences for the content of ``summary.json``.

    Examples
    --------
    >>> summary = {"verdict": "not_a_walk", "why": ["the legs hardly move"], "notes": []}
    >>> facts({**summary, "recognised": {"layout": "coco17"}})
    [('Verdict', ['Not a walk.', 'The legs hardly move.']), ('Recognised', ['Keypoint layout coco17.'])]
    """
    sections = [("Verdict", [VERDICTS[summary["verdict"]], *summary["why"], *summary.get("usable", ())])]
    if "view_angle_deg" in summary:
        sections += [("View", _view(summary)), ("Steps", _steps(summary)), ("Gait cycle", _cycle(summary))]
        sections.append(("Labels", _labels(summary)))
        lengths = f"lengths are in {summary['units']}"
        sections.append(("Bars", [*_bars(summary["bars"]), lengths]))
        if summary["estimated_joints"]:
            names = ", ".join(joint.replace("_", " ") for joint in summary["estimated_joints"])
            sections.append(("Estimated", [f"never seen, estimated from the other joints: {names}"]))
    sections.append(("Recognised", [f"keypoint layout {summary['recognised']['layout']}", *summary["notes"]]))
    if summary.get("next_time"):
        sections.append(("Next time", summary["next_time"]))
    return [(title, [_sentence(text) for text in texts]) for title, texts in sections]


def as_markdown(summary: dict[str, Any]) -> str:
    """Return the titles and sentences of the summary as Markdown."""
    parts = [f"**{title}.** {' '.join(texts)}" for title, texts in facts(summary)]
    return "\n\n".join(["# A walk from keypoints of one camera", *parts])


def _sentence(text: str) -> str:
    text = text.rstrip(".")
    return f"{text[:1].upper()}{text[1:]}."


def _view(summary: dict[str, Any]) -> list[str]:
    view = summary["view_angle_deg"]
    low, high = view["interval_95"]
    sentences = [f"the walker goes {view['words']}; 95 % interval: ±{(high - low) / 2:.0f}°"]
    return [*sentences, *(alternative(other) for other in view["alternatives"])]


def alternative(other: dict[str, Any]) -> str:
    """Return the sentence about alternative views that agree with the keypoints."""
    exchanged = " with left and right exchanged" if other["left_and_right_exchanged"] else ""
    return f"also possible{exchanged}: {other['words']}, with a cost {other['cost_above_best']:g} higher"


def _bars(bars: dict[str, Any]) -> list[str]:
    wide = [
        f"±{wide:g} mm for {_AUDIENCE[audience]}" for audience, wide in bars["mean_half_width_95_mm"].items()
    ]
    return [
        f"95 % bars of joints, in the mean: {', '.join(wide)}; shown are those for {_AUDIENCE[bars['for']]}"
    ]


def _cycle(summary: dict[str, Any]) -> list[str]:
    numbers, unsure = summary["gait_cycle"]["numbers"], summary["labels"]["unsure"]
    named = dict(zip(SIDES, ("one", "the other") if unsure else SIDES, strict=True))
    stance = [f"{name} {numbers['stance'][side]['value']:g}" for side, name in named.items()]
    knees = [
        f"{name} knee {least['value']:g}° (±{least['half_width_95']:g}°) to"
        f" {most['value']:g}° (±{most['half_width_95']:g}°)"
        for side, name in named.items()
        for least, most in [(numbers["least_knee_flexion"][side], numbers["greatest_knee_flexion"][side])]
    ]
    larger = [
        name.replace("_", " ")
        for name, sides in numbers.items()
        if sides.get("difference", {}).get("larger_than_its_bar")
    ]
    differ = f"left-right differences larger than their bars: {', '.join(larger) or 'none'}"
    return [
        ", ".join(knees),
        f"stance {', '.join(stance)} % of the cycle, double support {numbers['double_support']['both']['value']:g} %",
        *([] if unsure else [differ]),
        summary["gait_cycle"]["variability"],
    ]


def _steps(summary: dict[str, Any]) -> list[str]:
    cadence, step, speed = summary["cadence"], summary["step_length"], summary["speed"]
    low, high = cadence["interval_95_steps_per_min"]
    length = f"step length {step['per_stature']:g} of the stature"
    length += f" ({step['mm']:g} mm)" if "mm" in step else ""
    length += f", speed {speed['statures_per_s']:g} statures a second"
    length += f" ({speed['mm_per_s']:g} mm/s)" if "mm_per_s" in speed else ""
    return [
        f"{cadence['steps_per_min']:g} steps a minute (95 %: {low:g} to {high:g})",
        length,
        summary["locomotion"],
    ]


def _labels(summary: dict[str, Any]) -> list[str]:
    labels = summary["labels"]
    sentences = []
    if labels["exchanged_throughout"]:
        sentences.append("the detector's left and right labels were exchanged throughout and are corrected")
    if labels["unsure"]:
        sentences.append("left and right exchanged would explain the keypoints about as well")
    for limb, frames in labels["exchanged_frames"].items():
        if frames:
            sentences.append(f"{limb}: labels exchanged in {len(frames)} frames and corrected")
    return sentences or ["left and right are as the detector labelled them"]
