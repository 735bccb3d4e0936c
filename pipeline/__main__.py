"""python -m pipeline: 3D walking from 2D, four papers figure by figure.

  python -m pipeline experiment=FIGURE [OVERRIDE ...]     one figure
  python -m pipeline figures [OVERRIDE ...]               every figure, one after another; resumable
  python -m pipeline -m experiment=FIGURE model.components=10,20,30        variants (Hydra multirun)

  python -m pipeline fetch [data=optical]                 the public recordings, listed in data/sources.csv
  python -m pipeline claims [data=...] [scale=...]        the papers' claims beside our numbers
  python -m pipeline equations [PAPER]                    every numbered equation: its home and its test
  python -m pipeline view FIGURE [data=...] [scale=...]   open a recording in the rerun viewer
  python -m pipeline archive [data=...]                   keep full-scale results under results/archive
  python -m pipeline verify ARCHIVE                       re-hash an archive, name any file that changed

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

A preset alone writes to results/DATA/SCALE/FIGURE; anything overridden goes to results/scratch/TIME/FIGURE.
Exit status: 0 done, 1 refused (one sentence says what, where, expected, received), 130 interrupted.
"""

from __future__ import annotations

import os
import re

# Many small solves: BLAS threads would wait for each other.  Before numpy is loaded; the user's own wish wins.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import textwrap
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

CONF = Path(__file__).resolve().parent.parent / "conf"
IDENTITY = {"experiment", "data", "scale", "workers", "results", "data.mirror", "data.raw"}
"""Overrides that leave a preset what it is."""
OWN_FILES = {
    "data.path",
    "data.pattern",
    "data.person",
    "data.units",
    "data.frame_rate_hz",
    "data.name",
    "skeleton",
}
"""With data=folder, these too: they say which data set it is."""


def presets() -> list[str]:
    """Names of the figures, from conf/experiment."""
    return sorted(path.stem for path in (CONF / "experiment").glob("*.yaml"))


def help_text() -> str:
    """The module's docstring with the figures filled in."""
    lines = ["Figures:"]
    for name in presets():
        about = [
            line[2:].strip()
            for line in (CONF / "experiment" / f"{name}.yaml").read_text(encoding="utf-8").splitlines()
            if line.startswith("# ") and "@package" not in line
        ]
        words = f"  {name:<26} {about[0] if about else ''}"
        lines += textwrap.wrap(words, 118, subsequent_indent=" " * 29, break_long_words=False)
    return (__doc__ or "").replace("{figures}", "\n".join(lines))


def register() -> None:
    """Tell Hydra the classes of `pipeline.config`, so that a typo dies at composition."""
    from hydra.core.config_store import ConfigStore

    from pipeline import skeleton
    from pipeline.studies import options as config

    store = ConfigStore.instance()
    store.store(name="config_schema", node=config.Config)
    store.store(group="scale", name="base_scale", node=config.Scale)
    store.store(group="skeleton", name="base_skeleton", node=skeleton.SourceMapping)
    # One schema to each option of a group: base_known_view is KnownViewSweep.
    for group, ending in (
        ("data", "Data"),
        ("dataset", "Dataset"),
        ("model", "Model"),
        ("sweep", "Sweep"),
        ("report", "Report"),
    ):
        for name, node in vars(config).items():
            if isinstance(node, type) and name.endswith(ending) and name != ending:
                words = re.findall("[A-Z][a-z]*", name.removesuffix(ending))
                store.store(group=group, name="base_" + "_".join(words).lower(), node=node)


def compose(overrides: Sequence[str]) -> Any:
    """A `pipeline.config.Config` from overrides, as on the command line."""
    from hydra import compose as hydra_compose
    from hydra import initialize_config_dir
    from hydra.core.global_hydra import GlobalHydra

    register()
    GlobalHydra.instance().clear()
    with initialize_config_dir(version_base="1.3", config_dir=str(CONF), job_name="pipeline"):
        return _typed(hydra_compose("config", overrides=list(overrides)))


def _typed(composed: Any) -> Any:
    from omegaconf import OmegaConf

    from pipeline.validation import InvalidInput

    missing = OmegaConf.missing_keys(composed)
    if "figure" in missing:
        raise InvalidInput(
            "no figure is chosen", expected="experiment=" + "|".join(presets()), received="none"
        )
    if missing:
        raise InvalidInput("a value is missing", where=", ".join(sorted(missing)))
    OmegaConf.resolve(composed)
    config = OmegaConf.to_object(composed)
    _refuse_additions(config, "")
    _name_folder(config)
    return config


def _name_folder(config: Any) -> None:
    """Call the user's own data after their folder, so that two folders do not share results."""
    import re

    from pipeline.studies.options import FolderData

    if isinstance(config.data, FolderData) and config.data.name == "folder" and config.data.path:
        config.data.name = "folder_" + re.sub(r"[^\w.-]+", "_", Path(config.data.path).resolve().name)


def _refuse_additions(options: Any, path: str) -> None:
    """Refuse keys that ``+key=value`` added: no stage would ever read them."""
    from dataclasses import fields, is_dataclass

    from pipeline.validation import InvalidInput

    if not is_dataclass(options):
        return
    known = [field.name for field in fields(options)]
    for name, value in vars(options).items():
        if name not in known:
            raise InvalidInput(
                "there is no such option", where=path + name, expected="one of " + ", ".join(known)
            )
        _refuse_additions(value, f"{path}{name}.")


def sentence(error: Exception) -> str:
    """What a person should read of an error in place of a traceback; empty for one that is ours to mend."""
    from pipeline.validation import InvalidInput

    if isinstance(error, InvalidInput):
        return str(error)
    if type(error).__module__.partition(".")[0] in ("hydra", "omegaconf"):
        return str(_of_composition(error))
    if isinstance(error, OSError) and error.strerror and error.filename:
        return f"{error.filename}: {error.strerror}"
    return ""


def _of_composition(error: Exception) -> Exception:
    """A InvalidInput that says what Hydra or OmegaConf found wrong with an override, naming the full key."""
    from dataclasses import fields, is_dataclass

    from hydra.errors import MissingConfigException, OverrideParseException
    from omegaconf.errors import ConfigAttributeError, ConfigKeyError, OmegaConfBaseException

    from pipeline.validation import InvalidInput

    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        group, _, name = error.missing_cfg_file.rpartition("/")
        options = " or ".join(o for o in error.options or () if not o.startswith("base_"))
        if group == "hydra/launcher":
            options += "; joblib needs the extra `joblib`, submitit_* the extra `cluster`"
        return InvalidInput("there is no such option", where=group, expected=options, received=name)
    if isinstance(error, OverrideParseException):
        return InvalidInput(
            "this is not an override", expected="option=value", received=repr(error.override or error.message)
        )
    cause = error if isinstance(error, OmegaConfBaseException) else error.__cause__
    if isinstance(cause, OmegaConfBaseException) and cause.full_key:
        if isinstance(cause, ConfigAttributeError | ConfigKeyError) and is_dataclass(cause.object_type):
            known = "one of " + ", ".join(field.name for field in fields(cause.object_type))
            return InvalidInput("there is no such option", where=cause.full_key, expected=known)
        return InvalidInput(str(cause).splitlines()[0], where=cause.full_key)
    first = str(error).splitlines()[0]
    several = "one value; several values are a multirun: -m in front" if first.startswith("Ambiguous") else ""
    return InvalidInput(first, expected=several)


def destination(config: Any, overrides: Sequence[str], moment: str) -> Path:
    """Where a figure goes: its own folder for a preset as it stands, scratch for anything else."""
    allowed = IDENTITY | (OWN_FILES if "data=folder" in overrides else set())
    names = {item.split("=", 1)[0].lstrip("+~") for item in overrides}
    results = Path(config.results)
    if names <= allowed:
        return results / config.data.name / config.scale.name / config.figure
    return results / "scratch" / moment / config.figure


def _moment() -> str:
    return datetime.now().strftime("%Y-%m-%d_%H-%M-%S-%f")


def figures(arguments: Sequence[str]) -> int:
    """Make several figures in one process; `experiment=a,b` picks some, by default all."""
    from pipeline.cli.figures import make_figures, not_for, open_console

    chosen = [name for item in arguments if item.startswith("experiment=") for name in item[11:].split(",")]
    common = [item for item in arguments if not item.startswith("experiment=")]
    moment = _moment()
    jobs = []
    left_out: dict[str, list[str]] = {}
    for name in chosen or presets():
        config = compose([*common, f"experiment={name}"])
        if not chosen and (reason := not_for(config)):
            left_out.setdefault(reason, []).append(name)
            continue
        jobs.append((config, destination(config, common, moment)))
    console = open_console()
    refused = make_figures(jobs, console=console)
    for reason, names in left_out.items():
        console.print(f"Left out: {', '.join(names)}: {reason}", style="yellow", soft_wrap=True)
    return 1 if refused else 0


def hydra_main(arguments: Sequence[str]) -> int:
    """One figure, or a multirun of variants, through Hydra's own command line."""
    import hydra
    from hydra.core.hydra_config import HydraConfig
    from hydra.types import RunMode

    from pipeline.validation import InvalidInput

    register()
    status = 0

    @hydra.main(version_base="1.3", config_path=str(CONF), config_name="config")
    def one(composed: Any) -> None:
        nonlocal status
        from pipeline.cli.figures import make_figures, open_console

        settings = HydraConfig.get()
        multirun = settings.mode == RunMode.MULTIRUN
        try:
            config = _typed(composed)
        except InvalidInput as refusal:
            if multirun:
                raise
            status = 1
            print(refusal, file=sys.stderr)
            return
        folder = (
            Path(settings.runtime.output_dir) / config.figure
            if multirun
            else destination(config, settings.overrides.task, _moment())
        )
        refused = make_figures([(config, folder)], console=open_console())
        if refused and multirun:
            # The other variants are made all the same; the launcher hands this one's error to `main`.
            raise InvalidInput(refused[0], where=settings.job.override_dirname)
        status = 1 if refused else 0

    os.environ["HYDRA_FULL_ERROR"] = "1"  # errors come to `main`, which puts them into a sentence
    sys.argv[1:] = arguments
    one()
    return status


def main(arguments: Sequence[str]) -> int:
    """Exit status of the command line."""
    if not arguments or arguments[0] in ("--help", "-h", "help"):
        print(help_text())
        return 0
    from pipeline.validation import InvalidInput

    try:
        if arguments[0] == "figures":
            return figures(arguments[1:])
        from pipeline.cli import commands

        if arguments[0] in commands.VERBS:
            return commands.VERBS[arguments[0]](arguments[1:], compose)
        if arguments[0].find("=") < 1 and not arguments[0].startswith("-"):
            raise InvalidInput(
                "the command is unknown",
                expected="an override (option=value) or one of " + ", ".join(["figures", *commands.VERBS]),
                received=arguments[0],
            )
        return hydra_main(arguments)
    except KeyboardInterrupt:
        print("interrupted: what was finished is kept, the same command goes on from there", file=sys.stderr)
        return 130
    except Exception as error:
        words = sentence(error)
        if not words:
            raise
        print(words, file=sys.stderr)
        return 1


if __name__ == "__main__":
    for _stream in (sys.stdout, sys.stderr):
        _stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # σ² and ° on a terminal without them
    sys.exit(main(sys.argv[1:]))
