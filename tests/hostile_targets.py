"""Undamaged files of each kind that the project writes, and the commands that read them, for `tests.hostile`."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import formats
from pipeline.cli import commands, verify
from pipeline.cli import compose as composing
from pipeline.cli import main as program
from pipeline.cli.errors import sentence
from pipeline.report.light import PLAIN_BYTES
from pipeline.storage import agreement, archive, provenance
from pipeline.storage.publishing import publish
from pipeline.storage.sealed_folders import MANIFEST
from tests.hostile import Target, reseal
from tests.processes import ROOT
from tests.report.planted import CLAIM, plant
from walk3d.film import keypoints
from walk3d.film.reconstruct import model_file
from walk3d.film.video import cached

FIGURE = "zhang2007_fig2"
SMALL = ["scale=smoke", f"experiment={FIGURE}"]
COMMIT = "f" * 40
BIDS = """name\tcomponent\ttype\ttracked_point\tunits
t\tn/a\tLATENCY\tn/a\ts
h_x\tx\tPOS\tHead\tm
h_y\ty\tPOS\tHead\tm
h_z\tz\tPOS\tHead\tm
"""


def targets(folder: Path) -> list[Target]:
    """Return all targets of the damage test; a figure and its artefacts are computed once, in `folder`."""
    whole = make_figure(folder / "whole")
    figure = whole / "synthetic" / "smoke" / FIGURE
    of_commit(figure)
    shutil.copyfile(figure / "claims.csv", figure.parent / "claims.csv")

    def published(to: Path) -> None:
        shutil.copytree(figure.parent, to / "synthetic" / "smoke")

    def with_cache(to: Path) -> None:
        shutil.copytree(whole / "cache", to / "cache")

    def kept(to: Path) -> None:
        _archive(figure, to)

    result = [
        Target("manifest: status", published, f"*/*/*/{MANIFEST}", partial(command, "status", *SMALL)),
        Target("figure: report", published, "*/*/*/[!r]*", partial(command, "report", "scale=smoke")),
        Target("figure: claims", published, "*/*/*/[mtc]*", partial(command, "claims", "scale=smoke")),
        Target("claims of all: report", published, "*/*/claims.csv", partial(command, "report", "scale=smoke")),
        Target("figure: archive", published, "*/*/*/*", kept_run),
        Target("artefact: status", with_cache, f"cache/*/{MANIFEST}", partial(command, "status", *SMALL)),
        Target("artefact: figure", with_cache, "cache/*/*", partial(command, *SMALL, "figure.recording=false",
                                                                    "figure.picture=false")),
        Target("archive: verify", kept, "**/*", lambda inside: program.main(["verify", str(inside)])),
        Target("archive: rerun", kept, "**/*[!k]", partial(again, figure)),
        Target("variants: compare", variants, "*/*/[mtc]*", compared),
        Target("published.csv: readme", cloned, "results/*.csv", readme),
        Target("model: reconstruct", partial(filmed, model=True), "model/*[nz]", reconstruct),
        Target("about a film: reconstruct", filmed, "out/*", reconstruct),
        Target("BIDS: inspect", bids, "**/*[nv]", inspected),
    ]  # fmt: skip
    if importlib.util.find_spec("cv2"):
        result.append(Target("video: reconstruct", video, "walk.mp4", reconstruct_video))
    return result


def make_figure(results: Path) -> Path:
    """Compute one figure in this process, so that forked processes have its modules; return the results folder."""
    assert program.main([*SMALL, f"results={results}"]) == 0
    return results


def of_commit(figure: Path) -> None:
    """Change the manifest of a figure so that it names a commit without local changes."""
    facts = json.loads((figure / MANIFEST).read_text())
    facts["provenance"] |= {"commit": COMMIT, "dirty": False}
    (figure / MANIFEST).write_text(json.dumps(facts))
    reseal(figure)


def command(*arguments: str | Path) -> int:
    *words, inside = arguments
    composing.built_figures = lambda: [FIGURE]  # to compose all would take seconds
    return program.main([*map(str, words), f"results={inside}"])


def in_sentences(run: Callable[[], Any]) -> int:
    """Run a function and print its error as `main` of the command line does; return the exit status."""
    try:
        run()
    except Exception as error:
        if not (words := sentence(error)):
            raise
        print(words)
        return 1
    return 0


def kept_run(inside: Path) -> int:
    """Archive the figure as a run with changed options, from a commit without local changes."""
    composing.built_figures = lambda: [FIGURE]
    facts = provenance.provenance() | {"commit": COMMIT, "dirty": False}
    commands.provenance.provenance = lambda: facts
    return program.main(["archive", "name=a", f"run={inside / 'synthetic'}", f"results={inside}"])


def again(figure: Path, inside: Path) -> int:
    """Verify an archive against a copy of the figure that is presented as recomputed."""

    def make(jobs: list[tuple[Any, Path]], **_: Any) -> list[str]:
        for experiment, to in jobs:
            experiment.validate()
            shutil.copytree(figure, to)
        return []

    verify.make_figures = make  # type: ignore[assignment]
    return program.main(["verify", str(inside), "rerun=1"])


def _archive(figure: Path, to: Path) -> None:
    """Write an archive of one figure in the layout of `archive light=1`."""
    with publish(to, having="archive") as publication:
        inside = publication.folder
        (inside / FIGURE).mkdir()
        for path in figure.glob("*.csv"):
            shutil.copyfile(path, inside / FIGURE / path.name)
        shutil.copyfile(figure / MANIFEST, inside / FIGURE / MANIFEST)
        agreement.write_rule(inside, [FIGURE])
        import gzip

        for path in (inside / FIGURE).glob("table*.csv"):
            if path.name == "table.csv" or path.stat().st_size > PLAIN_BYTES:
                path.with_name(f"{path.name}.gz").write_bytes(gzip.compress(path.read_bytes(), mtime=0))
                path.unlink()
        archive.seal(
            publication, {"archive": "a", "data": "synthetic", "date": "2026-11-22", "commit": COMMIT}
        )


def variants(to: Path) -> None:
    for job, components in ((0, 10), (1, 20)):
        folder = to / f"{job}_model.components={components}" / FIGURE
        plant(folder, claims=CLAIM, configuration={"model": {"components": components}})


def compared(inside: Path) -> int:
    return in_sentences(lambda: program._compare(inside))


def cloned(to: Path) -> None:
    for name in (
        *commands.FILLED_PAGES,
        "conf/readme.yaml",
        "results/published.csv",
        "results/durations.csv",
    ):
        (to / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, to / name)


def readme(inside: Path) -> int:
    provenance.PROJECT = inside
    return program.main(["readme"])


def filmed(to: Path, *, model: bool = False) -> None:
    """Write a dummy film with the keypoints of an earlier run, or keypoints with a model of walkers."""
    to.mkdir()
    names = keypoints.MEDIAPIPE
    heading = ",".join(f"{name}_{part}" for name in names for part in ("x", "y", "visibility"))
    draw = np.random.default_rng(0)
    points = np.concatenate([draw.uniform(0, 400, (20, len(names), 2)), np.ones((20, len(names), 1))], axis=2)
    lines = [f"{n},0,{','.join(f'{v:.2f}' for v in row.ravel())}" for n, row in enumerate(points)]
    text = "\n".join([f"frame,person,{heading}", *lines]) + "\n"
    (to / "walk.mp4").write_bytes(b"never decoded")
    digest = hashlib.sha256(b"never decoded").hexdigest()
    about = {"sha256": digest, "frame_rate_hz": 30.0, "width": 640, "height": 480, "uneven": False}
    with publish(to / "out", having="verdict") as publication:
        (publication.folder / cached.TABLE).write_text(text)
        (publication.folder / cached.ABOUT).write_text(json.dumps(about))
        publication.facts = {"command": "reconstruct", "verdict": "not a walk"}
    if model:
        shutil.copytree(model_file.SHIPPED, to / "model")


def reconstruct(inside: Path) -> int:
    model = [f"model_folder={inside / 'model'}"] if (inside / "model").exists() else []
    options = [
        f"output.path={inside / 'out'}",
        "output.formats=[csv]",
        "output.recording=false",
        "output.page=false",
    ]
    return program.main(["reconstruct", str(inside / "walk.mp4"), "output.overlay=false", *options, *model])


def bids(to: Path) -> None:
    (to / "walk").mkdir(parents=True)
    rows = "".join(f"{n / 100}\t1\t{1 + n / 50}\t3\n" for n in range(60))
    (to / "walk" / "sub-1_motion.tsv").write_text(rows)
    (to / "walk" / "sub-1_channels.tsv").write_text(BIDS)
    (to / "walk" / "sub-1_motion.json").write_text('{"SamplingFrequency": 100, "TaskName": "walk"}')


def inspected(inside: Path) -> int:
    program.main(["inspect", str(inside / "walk")])  # 1, since one point is not a walk
    return in_sentences(lambda: formats.read(inside / "walk" / "sub-1_motion.tsv"))


def video(to: Path) -> None:
    """Write a film of 20 frames."""
    import cv2

    to.mkdir()
    writer = cv2.VideoWriter(str(to / "walk.mp4"), cv2.VideoWriter_fourcc(*"mp4v"), 30, (160, 120))
    for number in range(20):
        writer.write(np.full((120, 160, 3), 10 * number, np.uint8))
    writer.release()


class _SameBody:
    """Replacement for the detection networks, which finds the same upright person in every picture."""

    def __init__(self, _: Path) -> None:
        self.points = np.column_stack([np.full(33, 60.0), np.linspace(20.0, 110.0, 33), np.ones(33)])

    def detect(self, picture: np.ndarray, *, closer: bool = False) -> list[np.ndarray]:
        return [np.array([60.0, 60.0, 50.0, 0.0])]

    def place(self, picture: np.ndarray, region: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        return self.points, region, 1.0


def reconstruct_video(inside: Path) -> int:
    from walk3d.film.video import networks, pose

    pose.Pose, networks.networks = _SameBody, lambda *_: Path()  # type: ignore[assignment,misc]
    options = [
        "output.formats=[csv]",
        "output.recording=false",
        "output.page=false",
        f"output.path={inside / 'out'}",
    ]
    return program.main(["reconstruct", str(inside / "walk.mp4"), *options])
