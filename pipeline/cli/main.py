"""python -m pipeline: 3D motion from 2D motion, the figures of four papers.

  python -m pipeline experiment=FIGURE [OVERRIDE ...]     one figure
  python -m pipeline figures [OVERRIDE ...]               every figure; resumable
  python -m pipeline status [OVERRIDE ...]                each figure: current, stale and why, or missing
  python -m pipeline -m experiment=FIGURE model.components=10,20,30        variants (Hydra multirun)

  python -m pipeline fetch [data=optical]                 download the recordings of data/sources.csv
  python -m pipeline report [data=...] [scale=...]        one page over all figures, results/DATA/SCALE/index.html
  python -m pipeline claims [data=...] [scale=...]        the papers' claims beside our numbers
  python -m pipeline sensitivity [data=...] [GROUP]       each switch of conf/sensitivity.yaml: which verdict it moves
                     [SWITCH ...]                         these alone, with _ for spaces
  python -m pipeline equations [PAPER]                    every numbered equation: as printed, as used, its test
  python -m pipeline readme [data=...]                    the tables of results in docs/, from results/published.csv
  python -m pipeline view FIGURE [data=...] [scale=...]   open a recording in the rerun viewer
  python -m pipeline archive [data=...] [light=1]         archive full-scale results in results/archive
                     [only=FIGURE] [name=NAME [run=DIR]]  of one figure; of a run with changed options
  python -m pipeline verify ARCHIVE                       re-hash an archive and name the files that changed
                     [rerun=1 [only=FIGURE]]              compute its figures again and compare the digits that hold
  python -m pipeline inspect PATH [write=my_lab.yaml]     what recordings hold, which mapping fits, what to type next
{commands}
  python -m pipeline COMMAND --help, python -m pipeline --version

{figures}

Overrides name any option by its full path; `--cfg job` prints them all with their values, e.g.
  data=synthetic|optical|many|cmu|hdm05|folder scale=full|smoke          seed=2007     workers=2
  model.components=20                     model.mirror=true         model.omega_scale_mm=1.0
  sweep.view_angle_deg.step=5             sweep.sigma2_mm2.stop=2000
  sweep.noise_variance_mm2=70             sweep.solver=published    sweep.truth=fourier
  dataset.walks=all                       dataset.size=stature      dataset.origin=floor
  model.penalty=as_printed                model.smoothness=0.1      sweep.particles=[100,1000]
  model.basis=soft                        sweep.cameras=[still]     sweep.trials=300
Your own recordings (skeleton=auto recognises the marker set; skeleton=my_lab.yaml is a mapping of your own):
  python -m pipeline experiment=FIGURE data=folder data.path=DIR data.pattern='**/*.c3d' skeleton=auto
On a cluster (extra `cluster`; docs/cluster.md):
  python -m pipeline figures launch=slurm launch.partition=short launch.cores=4 launch.minutes=60
  python -m pipeline -m hydra/launcher=submitit_slurm experiment=zhang2007_fig5 model.components=10,20,30

A preset writes to results/DATA/SCALE/FIGURE; with other overrides, to results/scratch/TIME/FIGURE.
Figures are made side by side in `workers` processes: every core by default, and no more than there are.
Exit status: 0 done, 1 refused (with a sentence that says why), 130 interrupted (Ctrl-C or SIGTERM).
"""

from __future__ import annotations

import ast
import atexit
import errno
import os
import signal
import sys
import textwrap
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline import plugins
from pipeline.cli.presets import first_comment, presets, split_named
from pipeline.resources import version

if TYPE_CHECKING:
    from pipeline.studies.experiment import Experiment

IDENTITY = {"experiment", "data", "scale", "workers", "results", "data.mirror", "data.raw"}
"""Overrides with which a preset is still published in its own folder."""
OWN_FILES = {"skeleton", "skeleton.mapping", "skeleton.missing"} | {
    f"data.{x}" for x in ("path", "pattern", "person", "subject", "units", "up", "frame_rate_hz", "name")
}
"""Further ones with data=folder: they define the data set."""


_INTERRUPTED = 130
_NO_OUTPUT = {errno.EPIPE, errno.ENOSPC, errno.EIO, errno.EBADF}

COMMANDS = {
    "figures": "pipeline.cli.main:make_all",
    "status": "pipeline.cli.main:show_status",
    "fetch": "pipeline.cli.commands:fetch",
    "report": "pipeline.cli.commands:report",
    "claims": "pipeline.cli.commands:claims",
    "sensitivity": "pipeline.cli.sensitivity:sensitivity",
    "equations": "pipeline.cli.equations:equations",
    "readme": "pipeline.cli.commands:readme",
    "view": "pipeline.cli.commands:view",
    "archive": "pipeline.cli.commands:keep",
    "verify": "pipeline.cli.verify:verify",
    "inspect": "pipeline.cli.inspect:look",
}
"""Place of the function of each command, imported when it is called; its docstring is the help."""

LIGHT = ("inspect", "equations")
"""Commands of `COMMANDS` that start at once; the others load the libraries of every study to compose experiments."""


def commands() -> dict[str, str]:
    """Return the places of all commands by name: the package's, then those of plug-ins."""
    places = dict(COMMANDS)
    for each in plugins.loaded():
        for name, place in each.plugin.commands.items():
            if name in places:
                from pipeline.validation import InvalidInput

                raise InvalidInput(f"there is another command {name!r}", each.name, code="duplicate_name")
            places[name] = place
    return places


def command(name: str) -> Callable[[Sequence[str]], int]:
    """Return the function of a command, with the modules that it alone needs."""
    function: Callable[[Sequence[str]], int] = plugins.resolve(commands()[name])
    return function


def _help_of(name: str) -> str:
    """Return the docstring of a command, without the modules that it needs."""
    module, _, function = commands()[name].partition(":")
    source = plugins.source_of(module)
    tree = ast.parse(source.read_text("utf-8") if source else "")
    found = (node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == function)
    return next((ast.get_docstring(node) or "" for node in found), "")


def script() -> int:
    """Run ``python -m pipeline``, or the console command ``gait-pipeline``, and return the exit status."""
    # Many small solves: BLAS threads would wait for each other.  Before numpy is loaded; the user's own wish wins.
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    if sys.stdout is None or sys.stderr is None:  # the next file to be opened would take its place
        with suppress(OSError):
            os.write(
                2, b"standard output or standard error is closed: redirect it to a file or to /dev/null\n"
            )
        return 1
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # σ² and ° on a terminal without them
    status = main(sys.argv[1:])
    try:
        sys.stdout.flush()
    except OSError as error:
        status = _cannot_write(error)
    if status == _INTERRUPTED:
        # An interrupt inside `exec`, which imports use, would otherwise end the process by the signal.
        atexit._run_exitfuncs()
        os._exit(status)
    return status


def _cannot_write(error: OSError) -> int:
    """Say that the output cannot be written, and let nobody try again."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    with suppress(OSError):
        print(f"output cannot be written: {error.strerror or error}", file=sys.stderr)
    return 1


def _first_words(docstring: str) -> str:
    """Return the first line of a command's help up to its usage, in at most 60 characters."""
    return textwrap.shorten(docstring.partition("\n")[0].split(":")[0], 60, placeholder=" …")


def help_text() -> str:
    """Return the module's docstring with the figures filled in."""
    lines = ["Figures:"]
    for name in presets():
        words = f"  {name:<26} {first_comment(name)}"
        lines += textwrap.wrap(words, 118, subsequent_indent=" " * 29, break_long_words=False)
    added = [name for name in commands() if name not in COMMANDS]
    first = [f"  {'python -m pipeline ' + name:<55} {_first_words(_help_of(name))}" for name in added]
    text = (__doc__ or "").replace("{figures}", "\n".join(lines))
    return text.replace("{commands}\n", "".join(f"{line}\n" for line in first))


def destination(experiment: Experiment, overrides: Sequence[str], moment: str) -> Path:
    """Return the folder of a figure: its own for a preset without further overrides, else one in scratch."""
    allowed = IDENTITY | (OWN_FILES if "data=folder" in overrides else set())
    names = {item.split("=", 1)[0].lstrip("+~") for item in overrides}
    run = experiment.published_in if names <= allowed else Path(experiment.results) / "scratch" / moment
    return run / experiment.name


def _moment() -> str:
    return datetime.now().strftime("%Y-%m-%d_%H-%M-%S-%f")


def make_all(arguments: Sequence[str]) -> int:
    """Make figures side by side: figures [experiment=A,B] [data=...] [scale=...] [launch=slurm]
    [OVERRIDE ...] [--dry-run].

    Without experiment=, all for which the data set has clips.  Finished stages are found again: the same command
    continues a run that was interrupted.  --dry-run says what would be made.  launch=slurm makes them as jobs of a
    cluster (launch.partition, .minutes, .cores; docs/cluster.md).
    """
    from pipeline.cli.compose import compose_figures, lacking, order
    from pipeline.cli.summary import open_console

    launched, arguments = _apart(arguments, lambda item: item.startswith(("launch=", "launch.")))
    dry, arguments = _apart(arguments, lambda item: item == "--dry-run")
    chosen, common = split_named(arguments)
    experiments = compose_figures(chosen, common)
    left_out: dict[str, list[str]] = {}
    for one in () if chosen else experiments:
        left_out.setdefault(lacking(one), []).append(one.name)
    names = left_out.pop("", chosen)
    ordered = experiments if chosen else sorted((e for e in experiments if e.name in names), key=order)
    moment, console = _moment(), open_console()
    from pipeline.cli.status import CURRENT, print_status, status
    from pipeline.storage.sealed_folders import MANIFEST

    folders = [destination(one, common, moment) for one in ordered]
    if dry:
        print_status([*map(status, ordered, folders)], console, folders[0].parent if folders else None)
        return 0
    whole = bool(folders) and not chosen and all(map(_is_presets_own, ordered, folders))
    current, refused = whole and all((folder / MANIFEST).is_file() for folder in folders), []
    if current and all(one.state == CURRENT for one in map(status, ordered, folders)):
        words = "figures are current; experiment=NAME makes one again"
        console.print(f"{folders[0].parent}: {len(folders)} {words}", soft_wrap=True)
    else:
        jobs = [*zip(ordered, folders, strict=True)]
        if launched:
            from pipeline.cli.cluster import launch_figures

            refused = launch_figures(jobs, launched, console=console)
        else:
            from pipeline.cli.figures import make_figures

            refused = make_figures(jobs, console=console)
    if whole and any((folder / MANIFEST).is_file() for folder in folders):
        from pipeline.cli.commands import make_page

        page = make_page(folders[0].parent, ordered[0].data.name, names)
        console.print(page, soft_wrap=True)
    for reason, without in left_out.items():
        console.print(f"Left out: {', '.join(without)}: {reason}", style="yellow", soft_wrap=True)
    return 1 if refused else 0


def show_status(arguments: Sequence[str]) -> int:
    """Say of each figure, without computing, whether it is current, stale and why, or missing.

    status [experiment=A,B] [data=...] [scale=...] [OVERRIDE ...]
    """
    return make_all([*arguments, "--dry-run"])


def _apart(arguments: Sequence[str], chosen: Callable[[str], bool]) -> tuple[list[str], list[str]]:
    """Return the arguments that are chosen, and the others."""
    return [item for item in arguments if chosen(item)], [item for item in arguments if not chosen(item)]


def _is_presets_own(one: Experiment, folder: Path) -> bool:
    """Return whether a figure goes to its preset's own folder, without changed options."""
    return folder == one.published_in / one.name


def _make_one(experiment: Experiment, overrides: Sequence[str], folder: Path | None) -> str:
    """Make one figure; return why it was refused, empty if it was not."""
    from pipeline.cli.figures import make_figures
    from pipeline.cli.summary import open_console

    folder = folder or destination(experiment, overrides, _moment())
    return next(iter(make_figures([(experiment, folder)], console=open_console())), "")


def _make_variant(experiment: Experiment, overrides: Sequence[str], folder: Path | None) -> str:
    """Make one figure of a multirun; a preset without further overrides in its own folder."""
    own = destination(experiment, overrides, _moment())
    return _make_one(experiment, overrides, own if _is_presets_own(experiment, own) else folder)


def main(arguments: Sequence[str]) -> int:
    """Run the command line and return the exit status."""
    try:
        with _ended_by_signals():
            status = _run(arguments)
            sys.stdout.flush()
            return status
    except KeyboardInterrupt:
        with suppress(OSError):
            print(
                "interrupted: what was finished is kept; the same command continues from there",
                file=sys.stderr,
            )
        return _INTERRUPTED
    except Exception as error:
        if isinstance(error, OSError) and error.errno in _NO_OUTPUT and not error.filename:
            return _cannot_write(error)
        from pipeline.cli.errors import sentence

        words = sentence(error)
        if not words:
            raise
        print(words, file=sys.stderr)
        return 1


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM raise KeyboardInterrupt."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {kind: signal.signal(kind, interrupt) for kind in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)


def _run(arguments: Sequence[str]) -> int:
    if not arguments or arguments[0] in ("--help", "-h", "help"):
        print(help_text())
        return 0
    first, *others = arguments
    if first == "--version":
        print(f"gait-pipeline {version()}")
        return 0
    plugins.load_files(plugins.named_files(arguments))
    for name, why in plugins.failures().items():
        print(f"the plug-in {name} is left out: it cannot be loaded ({why})", file=sys.stderr)
    if first in commands():
        if {"--help", "-h"} & set(others):
            print(_help_of(first))
            return 0
        if first in COMMANDS and first not in LIGHT:
            _announce(first, others)
        return command(first)(others)
    if first.find("=") < 1 and not first.startswith("-"):
        from pipeline.validation import InvalidInput

        raise InvalidInput(
            "the command is unknown",
            expected="an override (option=value) or one of " + ", ".join(commands()),
            received=first,
            code="unknown_command",
        )
    if not any(item.startswith("-") and item not in ("-m", "--multirun") for item in arguments):
        _announce("the figure", arguments)
    from pipeline.cli.compose import compose, on_this_machine
    from pipeline.storage.publishing import require_new
    from pipeline.validation import InvalidInput

    if not any(item.startswith(("-", "hydra")) for item in arguments):
        return 1 if _make_one(compose(arguments), arguments, None) else 0
    from pipeline.cli.composition import run_hydra

    several = {"-m", "--multirun"} & set(arguments)
    given = [Path(item[16:]) for item in arguments if item.startswith("hydra.sweep.dir=")]
    for folder in given if several else ():
        if folder.is_dir():  # Hydra writes its own file there
            require_new(folder / "multirun.yaml", replace=lambda old: old.startswith(b"hydra:"))
    if not several or given:
        return run_hydra(arguments, _make_one, on_this_machine)
    moment = _moment()
    results = next((item[8:] for item in reversed(arguments) if item.startswith("results=")), "results")
    if not results.strip(" \"'"):
        raise InvalidInput("must name a folder", "results", received="nothing", code="no_folder_named")
    try:
        arguments = [*arguments, f"hydra.sweep.dir=${{results}}/scratch/{moment}"]
        return run_hydra(arguments, _make_variant, on_this_machine)
    finally:
        _compare(Path(results) / "scratch" / moment)
        _tell_presets(arguments)


def _announce(work: str, arguments: Sequence[str]) -> None:
    """Print what is being set up, before the libraries that compose it are loaded."""
    named, _ = split_named(arguments)
    print("setting up " + (", ".join(named) or work), flush=True)


def _compare(run: Path) -> None:
    """Put the variants of a multirun that are finished side by side, and say where."""
    from pipeline.cli.summary import open_console
    from pipeline.report.variants import compare_variants

    if run.is_dir() and (written := compare_variants(run)):
        open_console().print("compared in " + ", ".join(map(str, written)), soft_wrap=True)


def _tell_presets(arguments: Sequence[str]) -> None:
    """Say where a multirun of presets, without further overrides, has put them."""
    from pipeline.cli.compose import compose
    from pipeline.storage.sealed_folders import MANIFEST

    given = [item.partition("=") for item in arguments if "=" in item and not item.startswith("hydra")]
    if not {key for key, _, _ in given} <= IDENTITY:
        return
    for overrides in product(*([f"{key}={value}" for value in text.split(",")] for key, _, text in given)):
        folder = destination(compose(overrides), overrides, "")
        print(f"{folder}/" if (folder / MANIFEST).is_file() else f"{folder}/ was not made")
