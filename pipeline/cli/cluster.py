"""Figures as jobs of a cluster: a job for each figure, each stage that several figures share, and populations.

All jobs are submitted at once, and Slurm begins each after those whose artefacts it reads: nothing has to stay on the
login node.  What finds an artefact missing, because its job was lost, makes it.  submitit writes the scripts of jobs,
carries what they return, and queues a job again that was preempted or ran out of time.
"""

from __future__ import annotations

import dataclasses
import math
import os
import shutil
import socket
import subprocess
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from pipeline.cli.figures import attempt, make_figures, report
from pipeline.cli.options import filled
from pipeline.cli.pool import Jobs
from pipeline.cli.progress import line
from pipeline.cli.status import CURRENT, JOBS, latest, states, status
from pipeline.cli.summary import Failure, Made, Outcome
from pipeline.cli.tasks import FIGURE, Task, plan
from pipeline.resources import install_hint
from pipeline.storage.store import Store
from pipeline.validation import (
    Count,
    CountOrAll,
    InvalidInput,
    NonNegative,
    Options,
    Positive,
    require_choice,
)

_MOST_WAIT_S = 15.0
_SEEN_GONE = 4
"""Looks after which a job that is not queued and left no result is lost: on a shared disk a file may come later."""


class Interrupt(StrEnum):
    """What Ctrl-C makes of jobs."""

    leave = "leave"
    """They go on; the same command waits for them."""
    cancel = "cancel"


class Launch(Options):
    """Options of jobs."""

    partition: str = ""  # the cluster's own default
    account: str = ""
    cores: Count = 1  # of each job
    minutes: CountOrAll = 0  # of each job; 0: from what its figure costs
    memory_gb: NonNegative = 2.0  # of each job; 0: the partition's default
    task_s: Positive = 60.0  # processor time of a block of further populations, about
    retries: CountOrAll = 2  # of a job that was lost
    interrupt: Interrupt = Interrupt.leave


class _Named(Options):
    launch: Launch = Launch()


def launch_figures(jobs: Jobs, arguments: Sequence[str], *, console: Console) -> list[str]:
    """Make figures as ``launch=`` and its options say, and return why some were not made, a sentence each.

    Raises
    ------
    InvalidInput
        If there is no such scheduler, or an option is unknown or out of range.
    """
    where = [item[7:] for item in arguments if item.startswith("launch=")]
    if require_choice("launch", where[-1] if where else "local", ("local", "slurm")) == "local":
        return make_figures(jobs, console=console)
    options = filled(_Named, [item for item in arguments if item.startswith("launch.")]).launch
    return make_on_cluster(jobs, options, console=console)


@dataclass(frozen=True)
class _Work:
    """What a job does: submitit calls it, and writes it again where the job is to begin once more."""

    task: Task
    folder: Path

    def __call__(self) -> Made | None:
        print(
            f"{self.task.name} on {socket.gethostname()} {os.environ.get('SLURMD_NODENAME', '')}", flush=True
        )
        if self.task.through == FIGURE:
            return attempt(self.task.experiment, self.folder, lambda stage: print(stage, flush=True))
        self.task.run(Store(Path(self.task.experiment.results)))
        return None

    def checkpoint(self) -> Any:
        """Return what begins again: finished stages are in the store."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)


@dataclass
class _Job:
    """A submitted job, and how often it was begun and not seen."""

    task: Task
    handle: Any
    begun: int = 1
    gone: int = 0


class _Queue:
    """Jobs of one folder of results."""

    def __init__(self, folder: Path, options: Launch) -> None:
        try:
            import submitit
        except ModuleNotFoundError as error:
            words = f"this needs {install_hint('submitit')}"
            raise InvalidInput(words, "launch", code="missing_package", package="submitit") from error
        if shutil.which("sbatch") is None:
            raise InvalidInput(
                "there is no sbatch here", "launch", "a login node of a Slurm cluster", code="no_sbatch"
            )
        self._submitit, self.folder, self._options = submitit, folder, options

    def submit(self, task: Task, folder: Path, after: Sequence[str]) -> _Job:
        """Submit a task that begins when other jobs have ended, however they did."""
        options, place = self._options, self.folder / task.name
        place.mkdir(parents=True, exist_ok=True)
        executor = self._submitit.SlurmExecutor(place.resolve())
        wanted = {
            "job_name": task.name,
            "time": options.minutes or 20 + math.ceil(task.cost_s / 6 / options.cores),
            "cpus_per_task": options.cores,
            "partition": options.partition,
            "account": options.account,
            "mem": options.memory_gb and f"{math.ceil(options.memory_gb * 1024)}MB",
            "dependency": after and "afterany:" + ":".join(after),
        }
        executor.update_parameters(**{name: value for name, value in wanted.items() if value})
        mine = dataclasses.replace(task.experiment, workers=options.cores)
        work = _Work(dataclasses.replace(task, experiment=mine), folder)
        try:
            return _Job(task, executor.submit(work))
        except (subprocess.CalledProcessError, self._submitit.core.utils.FailedJobError) as error:
            raise InvalidInput(
                "Slurm refused a job",
                task.name,
                received=" ".join(str(error).split()[-40:]),
                code="job_refused",
            ) from None

    def adopted(self, task: Task, waiting: dict[str, str]) -> _Job | None:
        """Return the job of a task that an earlier run left, if it is queued or running."""
        number = latest(self.folder / task.name)
        if number not in waiting:
            return None
        return _Job(task, self._submitit.SlurmJob((self.folder / task.name).resolve(), number))


def make_on_cluster(jobs: Jobs, options: Launch, *, console: Console) -> list[str]:
    """Make figures as jobs and return why some were not made, a sentence each.

    Parameters
    ----------
    jobs : sequence of (Experiment, Path)
        Each figure's experiment and folder.  Those that are current are not made again.
    options : Launch
    console : Console
    """
    stale = [(one, folder) for one, folder in jobs if status(one, folder).state != CURRENT]
    if not stale:
        console.print(f"{len(jobs)} figures are current")
        return []
    started = time.perf_counter()
    folders = {one.name: folder for one, folder in stale}
    queue = _Queue(stale[0][1].parent / JOBS, options)
    running: dict[str, _Job] = {}
    try:
        _submit(plan([one for one, _ in stale], task_s=options.task_s), folders, queue, running)
        console.print(
            f"{len(jobs) - len(stale)} figures are current; {len(running)} jobs, logs in {queue.folder}/",
            soft_wrap=True,
        )
        made = _watch(running, folders, queue, options.retries, console)
    except KeyboardInterrupt:
        numbers = [job.handle.job_id for job in running.values()]
        if options.interrupt is Interrupt.cancel and numbers:
            subprocess.run(["scancel", *numbers], check=False)
        words = "cancelled" if options.interrupt is Interrupt.cancel else "left: `make status` shows them"
        console.print(f"{len(numbers)} jobs are {words}", soft_wrap=True)
        raise
    return report(stale, made, console, seconds=time.perf_counter() - started)


def _submit(tasks: Sequence[Task], folders: dict[str, Path], queue: _Queue, running: dict[str, _Job]) -> None:
    """Submit each task whose artefacts are not there, after those that it needs."""
    nothing = Store(Path(tasks[0].experiment.results), dry_run=True)
    waiting = states() or {}
    for task in tasks:
        if task.through != FIGURE and not task.run(nothing):
            continue
        after = [running[name].handle.job_id for name in task.needs if name in running]
        job = queue.adopted(task, waiting)
        running[task.name] = job or queue.submit(task, folders.get(task.name, queue.folder), after)


def _watch(
    running: dict[str, _Job], folders: dict[str, Path], queue: _Queue, retries: int, console: Console
) -> list[Made]:
    """Wait until all jobs have ended, submit again those that were lost, and return what became of the figures."""
    made: list[Made] = []
    wait_s, printed = 1.0, ""
    while running:
        seen = states()
        for name, job in list(running.items()):
            if not job.handle.paths.result_pickle.exists():
                job.gone = 0 if seen is None or job.handle.job_id in seen else job.gone + 1
                if job.gone < _SEEN_GONE:
                    continue
                log = f"{queue.folder}/{name}/{job.handle.job_id}_0_log.err"
                if job.begun <= retries:
                    console.print(f"{name} was lost and is submitted again ({log})", soft_wrap=True)
                    again = queue.submit(job.task, folders.get(name, queue.folder), ())
                    running[name] = dataclasses.replace(again, begun=job.begun + 1)
                    continue
                ended: Made | None = Failure(name, f"its job was lost {job.begun} times: {log}")
            else:
                error = job.handle.exception()
                ended = Failure(name, str(error)) if error else job.handle.result()
            del running[name]
            if ended and name in folders:
                made.append(ended)
                if isinstance(ended, Outcome):
                    console.print(Text(line(f"{len(made)}/{len(folders)}", ended)), soft_wrap=True)
            elif isinstance(ended, Failure):  # the figures that need it make it themselves
                console.print(Text(f"{name}: {ended.sentence}", style="yellow"), soft_wrap=True)
        now = ", ".join(f"{n} {state.lower()}" for state, n in sorted(Counter((seen or {}).values()).items()))
        if now and now != printed and console.is_terminal:
            console.print(f"jobs: {now}")
        printed = now
        if running:
            time.sleep(wait_s)
            wait_s = min(wait_s * 1.2, _MOST_WAIT_S)
    return made
