"""Figures as jobs of a cluster: a job for each figure, each stage that several figures share, and populations.

All jobs are submitted at once, and Slurm starts each after the jobs whose artefacts it reads.  No process has to run on
the login node.  If a job was lost, the jobs that need its artefact compute it.  The library submitit writes the job
scripts, returns the results, and requeues jobs that were preempted or timed out.
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

_MAX_WAIT_S = 15.0
_MAX_MISSES = 4
"""Number of checks without queue entry and result after which a job counts as lost; shared disks show files late."""


class Interrupt(StrEnum):
    """Action on Ctrl-C for running jobs."""

    leave = "leave"
    """Jobs continue, and the same command waits for them again."""
    cancel = "cancel"


class Launch(Options):
    """Options of cluster jobs, ``launch.*``."""

    partition: str = ""  # empty: the cluster's default
    account: str = ""
    cores: Count = 1  # per job
    minutes: CountOrAll = 0  # per job; 0: estimated from the cost of the figure
    memory_gb: NonNegative = 2.0  # per job; 0: the partition's default
    task_s: Positive = 60.0  # approximate processor time of a block of further populations
    retries: CountOrAll = 2  # resubmissions of a lost job
    interrupt: Interrupt = Interrupt.leave


class _Named(Options):
    launch: Launch = Launch()


def launch_figures(jobs: Jobs, arguments: Sequence[str], *, console: Console) -> list[str]:
    """Make figures with the scheduler and options of ``launch``, and return an error message for each failure.

    Raises
    ------
    InvalidInput
        If the scheduler or an option is unknown, or a value is out of range.
    """
    where = [item[7:] for item in arguments if item.startswith("launch=")]
    if require_choice("launch", where[-1] if where else "local", ("local", "slurm")) == "local":
        return make_figures(jobs, console=console)
    options = filled(_Named, [item for item in arguments if item.startswith("launch.")]).launch
    return make_on_cluster(jobs, options, console=console)


@dataclass(frozen=True)
class _Work:
    """Work of a job, which submitit calls, and saves again to restart the job."""

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
        """Return the submission that restarts this job; finished stages are in the store."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)


@dataclass
class _Job:
    """Submitted job, with the number of its submissions and of the latest checks that missed it."""

    task: Task
    handle: Any
    submissions: int = 1
    misses: int = 0


class _Queue:
    """Job queue for one folder of results."""

    def __init__(self, folder: Path, options: Launch) -> None:
        try:
            import submitit
        except ModuleNotFoundError as error:
            words = f"this needs {install_hint('submitit')}"
            raise InvalidInput(words, "launch", code="missing_package", package="submitit") from error
        if shutil.which("sbatch") is None:
            raise InvalidInput(
                "the command sbatch was not found: run this on a login node of a Slurm cluster",
                "launch",
                code="no_sbatch",
            )
        self._submitit, self.folder, self._options = submitit, folder, options

    def submit(self, task: Task, folder: Path, after: Sequence[str]) -> _Job:
        """Submit a task that starts when other jobs have ended, successfully or not."""
        options, job_folder = self._options, self.folder / task.name
        job_folder.mkdir(parents=True, exist_ok=True)
        executor = self._submitit.SlurmExecutor(job_folder.resolve())
        parameters = {
            "job_name": task.name,
            "time": options.minutes or 20 + math.ceil(task.cost_s / 6 / options.cores),
            "cpus_per_task": options.cores,
            "partition": options.partition,
            "account": options.account,
            "mem": options.memory_gb and f"{math.ceil(options.memory_gb * 1024)}MB",
            "dependency": after and "afterany:" + ":".join(after),
        }
        executor.update_parameters(**{name: value for name, value in parameters.items() if value})
        mine = dataclasses.replace(task.experiment, workers=options.cores)
        work = _Work(dataclasses.replace(task, experiment=mine), folder)
        try:
            return _Job(task, executor.submit(work))
        except (subprocess.CalledProcessError, self._submitit.core.utils.FailedJobError) as error:
            raise InvalidInput(
                "Slurm rejected a job",
                task.name,
                received=" ".join(str(error).split()[-40:]),
                code="job_refused",
            ) from None

    def adopted(self, task: Task, waiting: dict[str, str]) -> _Job | None:
        """Return the job of a task from an earlier run, if it is still queued or running."""
        number = latest(self.folder / task.name)
        if number not in waiting:
            return None
        return _Job(task, self._submitit.SlurmJob((self.folder / task.name).resolve(), number))


def make_on_cluster(jobs: Jobs, options: Launch, *, console: Console) -> list[str]:
    """Make figures as cluster jobs, and return an error message for each failure.

    Parameters
    ----------
    jobs : sequence of (Experiment, Path)
        Experiment and folder of each figure; current figures are not made again.
    options : Launch
    console : Console
    """
    stale = [
        (experiment, folder) for experiment, folder in jobs if status(experiment, folder).state != CURRENT
    ]
    if not stale:
        console.print(f"{len(jobs)} figures are current")
        return []
    started = time.perf_counter()
    folders = {experiment.name: folder for experiment, folder in stale}
    queue = _Queue(stale[0][1].parent / JOBS, options)
    running: dict[str, _Job] = {}
    try:
        _submit(plan([experiment for experiment, _ in stale], task_s=options.task_s), folders, queue, running)
        console.print(
            f"{len(jobs) - len(stale)} figures are current; {len(running)} jobs, logs in {queue.folder}/",
            soft_wrap=True,
        )
        results = _watch(running, folders, queue, options.retries, console)
    except KeyboardInterrupt:
        numbers = [job.handle.job_id for job in running.values()]
        if options.interrupt is Interrupt.cancel and numbers:
            subprocess.run(["scancel", *numbers], check=False)
        words = (
            "are cancelled" if options.interrupt is Interrupt.cancel else "continue: `make status` shows them"
        )
        console.print(f"{len(numbers)} jobs {words}", soft_wrap=True)
        raise
    return report(stale, results, console, seconds=time.perf_counter() - started)


def _submit(tasks: Sequence[Task], folders: dict[str, Path], queue: _Queue, running: dict[str, _Job]) -> None:
    """Submit each task whose artefacts are missing, to start after the tasks that it needs."""
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
    """Wait until all jobs have ended, resubmit lost jobs, and return the result of each figure."""
    results: list[Made] = []
    wait_s, printed = 1.0, ""
    while running:
        active = states()
        for name, job in list(running.items()):
            if not job.handle.paths.result_pickle.exists():
                job.misses = 0 if active is None or job.handle.job_id in active else job.misses + 1
                if job.misses < _MAX_MISSES:
                    continue
                log = f"{queue.folder}/{name}/{job.handle.job_id}_0_log.err"
                if job.submissions <= retries:
                    console.print(f"the job {name} was lost and is submitted again ({log})", soft_wrap=True)
                    again = queue.submit(job.task, folders.get(name, queue.folder), ())
                    running[name] = dataclasses.replace(again, submissions=job.submissions + 1)
                    continue
                ended: Made | None = Failure(name, f"the job was lost {job.submissions} times: see {log}")
            else:
                error = job.handle.exception()
                ended = Failure(name, str(error)) if error else job.handle.result()
            del running[name]
            if ended and name in folders:
                results.append(ended)
                if isinstance(ended, Outcome):
                    console.print(Text(line(f"{len(results)}/{len(folders)}", ended)), soft_wrap=True)
            elif isinstance(ended, Failure):  # the figures that need this task compute it themselves
                console.print(Text(f"{name}: {ended.sentence}", style="yellow"), soft_wrap=True)
        now = ", ".join(
            f"{n} {state.lower()}" for state, n in sorted(Counter((active or {}).values()).items())
        )
        if now and now != printed and console.is_terminal:
            console.print(f"jobs: {now}")
        printed = now
        if running:
            time.sleep(wait_s)
            wait_s = min(wait_s * 1.2, _MAX_WAIT_S)
    return results
