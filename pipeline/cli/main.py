"""python -m pipeline: 3D motion from 2D motion, the figures of four papers.

  python -m pipeline experiment=FIGURE [OVERRIDE ...]     one figure
  python -m pipeline figures [OVERRIDE ...]               every figure; resumable
  python -m pipeline -m experiment=FIGURE model.components=10,20,30        variants (Hydra multirun)

  python -m pipeline fetch [data=optical]                 download the recordings of data/sources.csv
  python -m pipeline reconstruct input.path=FILE_OR_FOLDER [input.frame_rate_hz=30] [output.path=DIR]
                                                          a 3D walk from 2D keypoints of one camera
  python -m pipeline model [data=optical] [output=DIR]    train the model that reconstructs walks
  python -m pipeline claims [data=...] [scale=...]        the papers' claims beside our numbers
  python -m pipeline equations [PAPER]                    every numbered equation: as printed, as used, its test
  python -m pipeline readme [data=...]                    the README's tables, from results/published.csv
  python -m pipeline view FIGURE [data=...] [scale=...]   open a recording in the rerun viewer
  python -m pipeline archive [data=...]                   archive full-scale results in results/archive
  python -m pipeline verify ARCHIVE                       re-hash an archive and name the files that changed

{figures}

Overrides name any option by its full path; `--cfg job` prints them all with their values, e.g.
  data=synthetic|optical|cmu|hdm05|folder scale=full|smoke          seed=2007     workers=2
  model.components=20                     model.mirror=true         model.omega_scale_mm=1.0
  sweep.view_angle_deg.step=5             sweep.sigma2_mm2.stop=2000
  sweep.noise_variance_mm2=70             sweep.solver=published    sweep.truth=fourier
  dataset.walks=all                       dataset.size=stature      dataset.origin=floor
  model.penalty=as_printed                model.smoothness=0.1      sweep.particles=[100,1000]
  model.basis=soft                        sweep.cameras=[still]     sweep.trials=300
Your own recordings:
  python -m pipeline experiment=FIGURE data=folder data.path=DIR "data.pattern='**/*.c3d'" skeleton=plugin_gait
On a cluster (extra `cluster`):
  python -m pipeline -m hydra/launcher=submitit_slurm experiment=zhang2007_fig5 model.components=10,20,30

A preset writes to results/DATA/SCALE/FIGURE; with other overrides, to results/scratch/TIME/FIGURE.
Exit status: 0 done, 1 refused (with a sentence that says why), 130 interrupted.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.cli.presets import first_comment, presets

if TYPE_CHECKING:
    from pipeline.studies.experiment import Experiment

IDENTITY = {"experiment", "data", "scale", "workers", "results", "data.mirror", "data.raw"}
"""Overrides with which a preset is still published in its own folder."""
OWN_FILES = {"skeleton"} | {
    f"data.{x}" for x in ("path", "pattern", "person", "units", "frame_rate_hz", "name")
}
"""Further ones with data=folder: they define the data set."""


def help_text() -> str:
    """Return the module's docstring with the figures filled in."""
    lines = ["Figures:"]
    for name in presets():
        words = f"  {name:<26} {first_comment(name)}"
        lines += textwrap.wrap(words, 118, subsequent_indent=" " * 29, break_long_words=False)
    return (__doc__ or "").replace("{figures}", "\n".join(lines))


def destination(experiment: Experiment, overrides: Sequence[str], moment: str) -> Path:
    """Return the folder of a figure: its own for a preset without further overrides, else one in scratch."""
    allowed = IDENTITY | (OWN_FILES if "data=folder" in overrides else set())
    names = {item.split("=", 1)[0].lstrip("+~") for item in overrides}
    results = Path(experiment.results)
    if names <= allowed:
        return results / experiment.data.name / experiment.scale.name / experiment.name
    return results / "scratch" / moment / experiment.name


def _moment() -> str:
    return datetime.now().strftime("%Y-%m-%d_%H-%M-%S-%f")


def make_all(arguments: Sequence[str]) -> int:
    """Make several figures in one process and return the exit status.

    ``experiment=a,b`` picks some; by default all that the data set has something for.
    """
    from pipeline.cli.compose import compose
    from pipeline.cli.figures import lacking, make_figures
    from pipeline.cli.summary import open_console

    chosen = [name for item in arguments if item.startswith("experiment=") for name in item[11:].split(",")]
    common = [item for item in arguments if not item.startswith("experiment=")]
    moment = _moment()
    jobs = []
    left_out: dict[str, list[str]] = {}
    for name in chosen or presets():
        experiment = compose([*common, f"experiment={name}"])
        if not chosen and (reason := lacking(experiment)):
            left_out.setdefault(reason, []).append(name)
            continue
        jobs.append((experiment, destination(experiment, common, moment)))
    console = open_console()
    refused = make_figures(jobs, console=console)
    for reason, names in left_out.items():
        console.print(f"Left out: {', '.join(names)}: {reason}", style="yellow", soft_wrap=True)
    return 1 if refused else 0


def _make_one(experiment: Experiment, overrides: Sequence[str], folder: Path | None) -> str:
    """Make one figure; return why it was refused, empty if it was not."""
    from pipeline.cli.figures import make_figures
    from pipeline.cli.summary import open_console

    folder = folder or destination(experiment, overrides, _moment())
    return next(iter(make_figures([(experiment, folder)], console=open_console())), "")


def main(arguments: Sequence[str]) -> int:
    """Run the command line and return the exit status."""
    if not arguments or arguments[0] in ("--help", "-h", "help"):
        print(help_text())
        return 0
    try:
        return _run(arguments)
    except KeyboardInterrupt:
        print("interrupted: finished stages are kept; the same command continues from there", file=sys.stderr)
        return 130
    except Exception as error:
        from pipeline.cli.compose import sentence

        words = sentence(error)
        if not words:
            raise
        print(words, file=sys.stderr)
        return 1


def _run(arguments: Sequence[str]) -> int:
    # Imported here, so that help is printed at once.
    from pipeline.cli.commands import COMMANDS
    from pipeline.validation import InvalidInput

    if arguments[0] == "figures":
        return make_all(arguments[1:])
    if command := COMMANDS.get(arguments[0]):
        return command(arguments[1:])
    if arguments[0].find("=") < 1 and not arguments[0].startswith("-"):
        raise InvalidInput(
            "the command is unknown",
            expected="an override (option=value) or one of " + ", ".join(["figures", *COMMANDS]),
            received=arguments[0],
        )
    from pipeline.cli.compose import run_hydra

    return run_hydra(arguments, _make_one)
