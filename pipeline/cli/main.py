"""python -m pipeline: reconstruct 3D motion from 2D motion, and compute the figures of four papers.

  python -m pipeline experiment=FIGURE [OVERRIDE ...]     make one figure
  python -m pipeline figures [OVERRIDE ...]               make every figure; an interrupted run can be continued
  python -m pipeline status [OVERRIDE ...]                show for each figure: current, stale (and why) or missing
  python -m pipeline -m experiment=FIGURE model.components=10,20,30        make variants (Hydra multirun)

  python -m pipeline fetch [data=optical]                 download the recordings that data/sources.csv lists
  python -m pipeline report [data=...] [scale=...]        write a page over all figures, results/DATA/SCALE/index.html
  python -m pipeline claims [data=...] [scale=...]        print the papers' claims next to our numbers
  python -m pipeline sensitivity [data=...] [GROUP]       test how switches of conf/sensitivity.yaml change verdicts
                     [SWITCH ...]                         test only these switches (write _ for spaces)
  python -m pipeline equations [PAPER]                    print every equation: where it is printed, used and tested
  python -m pipeline readme [data=...]                    write the result tables in docs/ from results/published.csv
  python -m pipeline view FIGURE [data=...] [scale=...]   open the recording of a figure in the rerun viewer
  python -m pipeline archive [data=...] [light=1]         archive full-scale results in results/archive
                     [only=FIGURE] [name=NAME [run=DIR]]  archive one figure, or a run with changed options
  python -m pipeline verify ARCHIVE                       check the files of an archive against their checksums
                     [rerun=1 [only=FIGURE]]              also compute its figures again and compare their numbers
  python -m pipeline inspect PATH [write=my_lab.yaml]     show points, mapping and walk of recordings, and the next step
{commands}
  python -m pipeline COMMAND --help, python -m pipeline --version
  --quiet prints errors only; --json prints the result of inspect, status, claims and verify for other programs

{figures}

An override sets an option by its full name; `--cfg job` prints all options with their values.  Examples:
  data=synthetic|optical|many|cmu|hdm05|folder scale=full|smoke          seed=2007     workers=2
  model.components=20                     model.mirror=true         model.omega_scale_mm=1.0
  sweep.view_angle_deg.step=5             sweep.sigma2_mm2.stop=2000
  sweep.noise_variance_mm2=70             sweep.solver=published    sweep.truth=fourier
  dataset.walks=all                       dataset.size=stature      dataset.origin=floor
  model.penalty=as_printed                model.smoothness=0.1      sweep.particles=[100,1000]
  model.basis=soft                        sweep.cameras=[still]     sweep.trials=300
Figures of your own recordings (skeleton=auto recognises the marker set; skeleton=my_lab.yaml is your own mapping):
  python -m pipeline experiment=FIGURE data=folder data.path=DIR data.pattern='**/*.c3d' skeleton=auto
Figures on a cluster (needs the extra `cluster`; see docs/cluster.md):
  python -m pipeline figures launch=slurm launch.queue=short launch.cores=4 launch.jobs=20
  python -m pipeline figures launch=dask launch.scheduler=tls://host:8786

A figure with the options of its preset is written to results/DATA/SCALE/FIGURE, with changed options to
results/scratch/TIME/FIGURE.  Figures are made in parallel by `workers` processes, by default one per core.
Exit status: 0 success, 1 failure (a message says why), 130 interrupted (Ctrl-C or SIGTERM); `status`: 0 in any case.
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
from contextlib import contextmanager, nullcontext, redirect_stdout, suppress
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
"""Names of options that can be overridden without moving a figure from its preset's folder to the scratch folder."""
OWN_FILES = {"skeleton", "skeleton.mapping", "skeleton.missing"} | {
    f"data.{x}" for x in ("path", "pattern", "person", "subject", "units", "up", "frame_rate_hz", "name")
}
"""Names of options that define the user's data set; with ``data=folder``, they do not change a figure's folder."""


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
"""Import path of the function of each command; its docstring is the help of the command."""


def commands() -> dict[str, str]:
    """Return the import path of each command by name: commands of the package, then commands of plug-ins."""
    targets = dict(COMMANDS)
    for each in plugins.loaded():
        for name, target in each.plugin.commands.items():
            if name in targets:
                from pipeline.validation import InvalidInput

                raise InvalidInput(
                    f"the plug-in adds a command {name!r}, but another command has this name",
                    each.name,
                    code="duplicate_name",
                )
            targets[name] = target
    return targets


def command(name: str) -> Callable[[Sequence[str]], int]:
    """Return the function that implements a command, after importing its modules."""
    function: Callable[[Sequence[str]], int] = plugins.resolve(commands()[name])
    return function


def _help_of(name: str) -> str:
    """Return the docstring of a command without importing its modules."""
    module, _, function = commands()[name].partition(":")
    source = plugins.source_of(module)
    tree = ast.parse(source.read_text("utf-8") if source else "")
    functions = (node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == function)
    return next((ast.get_docstring(node) or "" for node in functions), "")


def script() -> int:
    """Run ``python -m pipeline``, or the console command ``gait-pipeline``; return the exit status."""
    # BLAS threads would wait for each other in many small solves.  Set before numpy loads; the user's setting wins.
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    if sys.stdout is None or sys.stderr is None:  # the next opened file would take the free descriptor
        with suppress(OSError):
            os.write(
                2, b"standard output or standard error is closed: redirect it to a file or to /dev/null\n"
            )
        return 1
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # a terminal may lack σ² and °
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
    """Report that the output cannot be written, discard further output, and return the exit status."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    with suppress(OSError):
        print(f"output cannot be written: {error.strerror or error}", file=sys.stderr)
    return 1


def _first_words(docstring: str) -> str:
    """Return the first line of a command's help, without the usage, shortened to 60 characters."""
    return textwrap.shorten(docstring.partition("\n")[0].split(":")[0], 60, placeholder=" …")


def help_text() -> str:
    """Return the help text: this module's docstring, with the list of figures and the commands of plug-ins."""
    lines = ["Figures:"]
    for name in presets():
        words = f"  {name:<26} {first_comment(name)}"
        lines += textwrap.wrap(words, 118, subsequent_indent=" " * 29, break_long_words=False)
    added = [name for name in commands() if name not in COMMANDS]
    first = [f"  {'python -m pipeline ' + name:<55} {_first_words(_help_of(name))}" for name in added]
    text = (__doc__ or "").replace("{figures}", "\n".join(lines))
    return text.replace("{commands}\n", "".join(f"{line}\n" for line in first))


def destination(experiment: Experiment, overrides: Sequence[str], moment: str) -> Path:
    """Return the folder of a figure: the preset's folder, or a scratch folder if options were changed."""
    allowed = IDENTITY | (OWN_FILES if "data=folder" in overrides else set())
    names = {item.split("=", 1)[0].lstrip("+~") for item in overrides}
    run = experiment.published_in if names <= allowed else Path(experiment.results) / "scratch" / moment
    return run / experiment.name


def _moment() -> str:
    return datetime.now().strftime("%Y-%m-%d_%H-%M-%S-%f")


def make_all(arguments: Sequence[str]) -> int:
    """Make figures in parallel: figures [experiment=A,B] [data=...] [scale=...] [launch=slurm|pbs|...|dask]
    [OVERRIDE ...] [--dry-run].

    Without experiment=, the command makes all figures for which the data set has clips.  Finished stages are cached:
    the same command continues an interrupted run.  --dry-run only prints what would be made.  launch=slurm makes the
    figures by the workers of a cluster (launch.queue, .jobs, .cores, .walltime; docs/cluster.md).
    """
    from pipeline.cli.compose import compose_figures, order, reason_without_clips
    from pipeline.cli.output import tell_json
    from pipeline.cli.summary import open_console

    launched, arguments = _split(arguments, lambda item: item.startswith(("launch=", "launch.")))
    dry, arguments = _split(arguments, lambda item: item == "--dry-run")
    as_json, arguments = _split(arguments, lambda item: item == "--json")
    named, common = split_named(arguments)
    experiments = compose_figures(named, common)
    left_out: dict[str, list[str]] = {}
    for experiment in () if named else experiments:
        left_out.setdefault(reason_without_clips(experiment), []).append(experiment.name)
    names = left_out.pop("", named)
    ordered = experiments if named else sorted((e for e in experiments if e.name in names), key=order)
    moment, console = _moment(), open_console()
    from pipeline.cli.status import CURRENT, print_status, status
    from pipeline.storage.sealed_folders import MANIFEST

    folders = [destination(experiment, common, moment) for experiment in ordered]
    if as_json:
        tell_json([vars(status(*job)) for job in zip(ordered, folders, strict=True)])
        return 0
    if dry:
        print_status([*map(status, ordered, folders)], console)
        return 0
    complete = bool(folders) and not named and all(map(_is_presets_own, ordered, folders))
    current, failures = complete and all((folder / MANIFEST).is_file() for folder in folders), []
    if current and all(experiment.state == CURRENT for experiment in map(status, ordered, folders)):
        words = "figures are current; experiment=NAME makes a figure again"
        console.print(f"{folders[0].parent}: {len(folders)} {words}", soft_wrap=True)
    else:
        jobs = [*zip(ordered, folders, strict=True)]
        if launched:
            from pipeline.cli.engine import make

            failures = make(jobs, launched, console=console)
        else:
            from pipeline.cli.figures import make_figures

            failures = make_figures(jobs, console=console)
    if complete and any((folder / MANIFEST).is_file() for folder in folders):
        from pipeline.cli.commands import make_page

        page = make_page(folders[0].parent, ordered[0].data.name, names)
        console.print(page, soft_wrap=True)
    for reason, without in left_out.items():
        console.print(f"Left out: {', '.join(without)}: {reason}", style="yellow", soft_wrap=True)
    return 1 if failures else 0


def show_status(arguments: Sequence[str]) -> int:
    """Show without computing whether each figure is current, stale (and why) or missing.

    status [experiment=A,B] [data=...] [scale=...] [OVERRIDE ...] [--json]
    """
    return make_all([*arguments, "--dry-run"])


def _split(arguments: Sequence[str], chosen: Callable[[str], bool]) -> tuple[list[str], list[str]]:
    """Return two lists: the arguments that meet a condition, and the other arguments."""
    return [item for item in arguments if chosen(item)], [item for item in arguments if not chosen(item)]


def _is_presets_own(one: Experiment, folder: Path) -> bool:
    """Return True if a folder is the preset's folder, that is, if no option was changed."""
    return folder == one.published_in / one.name


def _make_one(experiment: Experiment, overrides: Sequence[str], folder: Path | None) -> str:
    """Make one figure and return the error message, which is empty on success."""
    from pipeline.cli.figures import make_figures
    from pipeline.cli.summary import open_console

    folder = folder or destination(experiment, overrides, _moment())
    return next(iter(make_figures([(experiment, folder)], console=open_console())), "")


def _make_variant(experiment: Experiment, overrides: Sequence[str], folder: Path | None) -> str:
    """Make one figure of a multirun, in the preset's folder if no option was changed; return the error message."""
    target = destination(experiment, overrides, _moment())
    return _make_one(experiment, overrides, target if _is_presets_own(experiment, target) else folder)


def main(arguments: Sequence[str]) -> int:
    """Run the command line and return the exit status."""
    try:
        with _interrupted_by_signals():
            with suppress_output() if "--quiet" in arguments else nullcontext():
                status = _run([item for item in arguments if item != "--quiet"])
            sys.stdout.flush()
            return status
    except KeyboardInterrupt:
        with suppress(OSError):
            print(
                "interrupted: finished work is kept, and the same command continues from there",
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
def suppress_output() -> Iterator[None]:
    """Discard what is printed to standard output during the ``with`` block."""
    with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):  # noqa: PTH123
        yield


@contextmanager
def _interrupted_by_signals() -> Iterator[None]:
    """Raise KeyboardInterrupt on Ctrl-C and SIGTERM during the ``with`` block."""

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
        print(f"the plug-in {name} is ignored: it cannot be loaded ({why})", file=sys.stderr)
    if first in commands():
        if {"--help", "-h"} & set(others):
            print(_help_of(first))
            return 0
        # The method of Path raises for names that are too long.
        if others and os.path.exists(others[0]) and "--json" not in others:  # noqa: PTH110
            print(f"reading {others[0]}", flush=True)
        elif "--json" not in others:
            _announce(first, others)
        return command(first)(others)
    if first.find("=") < 1 and not first.startswith("-"):
        from pipeline.validation import InvalidInput

        raise InvalidInput(
            "the command is unknown",
            expected="an override (option=value) or one of " + ", ".join(commands()),
            received=first,
            code="unknown_command",
            typed=True,
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
    sweep_folders = [Path(item[16:]) for item in arguments if item.startswith("hydra.sweep.dir=")]
    for folder in sweep_folders if several else ():
        if folder.is_dir():  # Hydra will write multirun.yaml in this folder
            require_new(folder / "multirun.yaml", replace=lambda old: old.startswith(b"hydra:"))
    if not several or sweep_folders:
        return run_hydra(arguments, _make_one, on_this_machine)
    moment = _moment()
    results = next((item[8:] for item in reversed(arguments) if item.startswith("results=")), "results")
    if not results.strip(" \"'"):
        raise InvalidInput(
            "must name a folder for the results", "results", received="nothing", code="no_folder_named"
        )
    try:
        arguments = [*arguments, f"hydra.sweep.dir=${{results}}/scratch/{moment}"]
        return run_hydra(arguments, _make_variant, on_this_machine)
    finally:
        _compare(Path(results) / "scratch" / moment)
        _print_preset_folders(arguments)


def _announce(work: str, arguments: Sequence[str]) -> None:
    """Print what is being set up (the named figures, or `work`) before slow libraries are loaded."""
    named, _ = split_named(arguments)
    print("setting up " + (", ".join(named) or work), flush=True)


def _compare(run: Path) -> None:
    """Compare the finished variants of a Hydra multirun, and print the paths of the comparison files."""
    from pipeline.cli.summary import open_console
    from pipeline.report.variants import compare_variants

    if run.is_dir() and (written := compare_variants(run)):
        open_console().print("compared in " + ", ".join(map(str, written)), soft_wrap=True)


def _print_preset_folders(arguments: Sequence[str]) -> None:
    """Print the preset folders of a multirun's figures, if the multirun changed no option."""
    from pipeline.cli.compose import compose
    from pipeline.storage.sealed_folders import MANIFEST

    pairs = [item.partition("=") for item in arguments if "=" in item and not item.startswith("hydra")]
    if not {key for key, _, _ in pairs} <= IDENTITY:
        return
    for overrides in product(*([f"{key}={value}" for value in text.split(",")] for key, _, text in pairs)):
        folder = destination(compose(overrides), overrides, "")
        print(f"{folder}/" if (folder / MANIFEST).is_file() else f"{folder}/ was not made")
