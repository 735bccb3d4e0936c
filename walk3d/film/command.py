"""Command `reconstruct`, which reconstructs a 3D walk from a film or from keypoints."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipeline.cli.options import filled
from pipeline.cli.output import exists, tell, tell_section
from walk3d.film.reconstruct import words
from walk3d.film.reconstruct.writing import Reconstruct, run

FAIL = "--fail-if-not-a-walk"
"""Command-line argument that makes the exit status 1 if the clip is not a walk."""


def _progress(done: int, every: int) -> None:
    """Show the number of processed video frames on a terminal."""
    if sys.stderr.isatty() and (done % 10 == 0 or done == every):
        end = "\n" if done == every else ""
        print(f"\r  keypoints: frame {done} of {every or 'many'}", end=end, file=sys.stderr, flush=True)


def reconstruct(arguments: Sequence[str]) -> int:
    """Reconstruct a walk from keypoints or a film: reconstruct FILE_OR_FOLDER [OPTION=VALUE ...].

    The exit status is 0 also if the clip is not a walk, unless --fail-if-not-a-walk asks for 1.

    input.frame_rate_hz=30     frame rate of keypoints whose file does not state it
    input.width=1920, input.height=1080
                               size of the image, px, if the file does not state it
    input.layout=coco17        coco17, halpe26, body25, …; default: recognised from the file
    input.frames=2s:6.5s       first:last, or seconds; default: the frames in which the person walks
    input.person=2             identity in the file, or a number by length of track; default: the longest track
    input.stature_mm=1740      stature of the walker; lengths are then in true millimetres
    input.focal_px=1400        focal length of the camera; default: estimated with the walk
    input.least_confidence=.3  keypoints below this confidence are ignored
    input.labels=as_given      do not try left and right exchanged (default: both)
    output.path=DIR            default: results/reconstructed/<its folder>_<its name>
    output.formats=[c3d,csv]   formats of the 3D walk: c3d, trc, bvh, csv, csv_wide
    output.names=mixamo        joint names of the BVH: ours, mixamo, rokoko
    output.in_place=true       BVH without the path
    output.recording=false, output.page=false, output.overlay=false
                               leave out the viewer's recording, the page, the skeleton over the film
    model_folder=DIR           your own model, as written by `model`
    """
    strict, arguments = FAIL in arguments, [item for item in arguments if item != FAIL]
    if arguments and ("=" not in arguments[0] or exists(arguments[0])):  # a path alone, as in other commands
        arguments = [f"input.path={arguments[0]}", *arguments[1:]]
    _, summary, folder = run(filled(Reconstruct, arguments), lambda words: tell(words, "dim"), _progress)
    (_, reasons), *others = words.facts(summary)
    for title, sentences in [(f"Verdict: {summary['verdict']}", reasons), *others]:
        tell_section(title, sentences)
    tell(f"written to {folder}")
    return int(strict and summary["verdict"] == "not_a_walk")
