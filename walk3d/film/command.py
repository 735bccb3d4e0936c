"""The command `reconstruct`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipeline.cli.options import filled
from pipeline.cli.output import tell, tell_section
from walk3d.film.reconstruct import words
from walk3d.film.reconstruct.writing import Reconstruct, run


def _progress(done: int, every: int) -> None:
    """Show on a terminal how many frames of a film are done."""
    if sys.stderr.isatty() and (done % 10 == 0 or done == every):
        end = "\n" if done == every else ""
        print(f"\r  keypoints: frame {done} of {every or 'many'}", end=end, file=sys.stderr, flush=True)


def reconstruct(arguments: Sequence[str]) -> int:
    """Reconstruct a walk from keypoints or film: reconstruct FILE_OR_FOLDER [OPTION=VALUE ...].

    Return 0 also if it was no walk, which the summary says.

    input.frame_rate_hz=30     of keypoints that do not state their rate
    input.width=1920, input.height=1080
                               of the image, px, where the file does not say
    input.layout=coco17        coco17, halpe26, body25, …; recognised unless it is given
    input.frames=2s:6.5s       first:last, or seconds; where somebody walks unless it is given
    input.person=2             identity in the file, or a number by length of track; the longest track unless given
    input.stature_mm=1740      of the walker: lengths are then in true millimetres
    input.focal_px=1400        of the camera; found with the walk unless it is given
    input.least_confidence=.3  keypoints below it are not used
    input.labels=as_given      left and right are not tried exchanged (both)
    output.path=DIR            results/reconstructed/<its folder>_<its name> unless it is given
    output.formats=[c3d,csv]   of the walk in 3D: c3d, trc, bvh, csv, csv_wide
    output.names=mixamo        of a BVH's joints: ours, mixamo, rokoko
    output.in_place=true       a BVH without the path
    output.recording=false, output.page=false, output.overlay=false
                               without the viewer's recording, the page, the skeleton over the film
    model_folder=DIR           of a model of your own, as `model` writes it
    """
    if arguments and "=" not in arguments[0]:  # a file or folder alone, as other commands take it
        arguments = [f"input.path={arguments[0]}", *arguments[1:]]
    _, summary, folder = run(filled(Reconstruct, arguments), lambda words: tell(words, "dim"), _progress)
    (_, reasons), *others = words.facts(summary)
    for title, sentences in [(f"Verdict: {summary['verdict']}", reasons), *others]:
        tell_section(title, sentences)
    tell(f"written to {folder}")
    return 0
