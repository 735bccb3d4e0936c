"""Computation of figures by processes of this machine, or by the workers of a Dask cluster.

On Dask each figure and each shared stage is a task.  In a task, `map_processes` sends blocks of items to all workers.
A task whose worker was lost runs again and finds the finished stages.  No other module knows Dask.
"""

from __future__ import annotations

import dataclasses
import logging
import os
import shlex
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from pipeline import plugins
from pipeline.cli.figures import attempt, make_figures, report
from pipeline.cli.options import filled
from pipeline.cli.pool import Jobs
from pipeline.cli.progress import Display
from pipeline.cli.status import CURRENT, status
from pipeline.cli.summary import Failure, Made, Outcome
from pipeline.processes import map_processes, mapped_by, one_thread
from pipeline.stages import chain, ingest, populations
from pipeline.storage.provenance import versions
from pipeline.storage.sealed_folders import compact, digest, remove_stale
from pipeline.storage.source_code import sources_digest
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment
from pipeline.studies.study import NoSweep
from pipeline.validation import Count, InvalidInput, Options, Positive, require_choice

QUEUES = ("slurm", "pbs", "moab", "lsf", "sge", "oar", "htcondor")  # batch systems; three have accounts
_IGNORE_CTRL_C = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)"
_LOST = "too many workers were lost ({}); finished stages are kept, and the same command continues"


class Launch(Options):
    """Options ``launch.*`` of Dask clusters."""

    scheduler: str = ""  # address of a running scheduler, with launch=dask; empty: workers on this machine
    queue: str = ""  # partition or queue; empty: the default of the batch system
    account: str = ""
    cores: Count = 1  # of a job, each with a worker
    memory_gb: Positive = 4.0  # of a job
    walltime: str = "04:00:00"  # of a job
    jobs: Count = 10  # number of jobs
    extra: list[str] = []  # further directives of the job script
    tls: bool = True
    dashboard: bool = False


class _Named(Options):
    launch: Launch = Launch()


def make(jobs: Jobs, arguments: Sequence[str], *, console: Console) -> list[str]:
    """Make figures on this machine or on the cluster that ``launch=`` names, and return the error messages.

    Parameters
    ----------
    jobs : sequence of (Experiment, Path)
        Experiment and folder of each figure.  On Dask, current figures are not made again.
    arguments : sequence of str, such as ``launch=slurm`` and ``launch.jobs=20``
    console : Console
    """
    names = [item.partition("=")[2] for item in arguments if item.startswith("launch=")]
    name = require_choice("launch", names[-1] if names else "local", ("local", "dask", *QUEUES))
    options = filled(_Named, [item for item in arguments if item.startswith("launch.")]).launch
    if name == "local":
        return make_figures(jobs, console=console)
    stale = [job for job in jobs if status(*job).state != CURRENT]
    if not stale:
        console.print(f"{len(jobs)} figures are current")
        return []
    started, folder = time.perf_counter(), stale[0][1].parent
    try:
        with _client(name, options, folder / "jobs", stale[0][0].workers, console) as client:
            _prepare_workers(client, stale)
            figures = _submit(client, stale)
            if name != "dask":  # with fewer at times, Dask cancels jobs whose workers have not connected yet
                client.cluster.adapt(minimum_jobs=options.jobs, maximum_jobs=options.jobs)
            results = _watch(client, figures, stale, console)
    finally:
        Store(Path(stale[0][0].results))  # a new store removes stale files from its cache
        remove_stale(folder)
    return report(stale, results, console, seconds=time.perf_counter() - started)


@contextmanager
def _client(name: str, options: Launch, folder: Path, workers: int, console: Console) -> Iterator[Any]:
    """Yield a client of a running Dask cluster, or of a Dask cluster that runs during the ``with`` block."""
    import dask
    from distributed import Client, LocalCluster

    dashboard = f"127.0.0.1:{8787 if options.dashboard else 0}"
    config: dict[str, Any] = {} if options.dashboard else {"distributed.scheduler.http.routes": []}
    config["distributed.scheduler.active-memory-manager.start"] = False  # it would move functions
    config["distributed.worker.preload"] = [_IGNORE_CTRL_C]  # a terminal sends it to all processes
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(config))
        where: Any = options.scheduler
        if name != "dask":
            where = stack.enter_context(job_queue(name, options, folder, stack, dashboard))
            where.worker_spec |= where.new_worker_spec()
            risk = "" if options.tls else "; without TLS, any user of the cluster can run code as you"
            console.print(f"{options.jobs} jobs of {name}, logs in {folder}/{risk}", soft_wrap=True)
        elif not where:
            where = stack.enter_context(LocalCluster(
                n_workers=workers, threads_per_worker=1, memory_limit=0, host="127.0.0.1", security=True,
                dashboard_address=dashboard, silence_logs=logging.CRITICAL,
            ))  # fmt: skip
        try:
            if name != "dask":  # `scale` would only log that a job is rejected
                where.sync(where._correct_state)
            client = stack.enter_context(Client(where))
        except (OSError, ValueError, RuntimeError, TypeError) as error:
            getattr(where, "_created", set()).clear()  # otherwise the end of the cluster fails too
            words, target = " ".join(str(error).rpartition("stderr:")[2].split()), options.scheduler or name
            raise InvalidInput(
                "the Dask cluster cannot be used", target, received=words, code="no_cluster"
            ) from None
        if options.dashboard:
            console.print(f"dashboard (needs bokeh): {client.dashboard_link}")
        yield client


def job_queue(name: str, options: Launch, folder: Path, stack: ExitStack, dashboard: str) -> Any:
    """Return the Dask cluster of a batch system, still without jobs; `stack` deletes its certificates at the end."""
    ctrl_c = signal.getsignal(signal.SIGINT)
    import dask_jobqueue  # which exits on Ctrl-C, with status 0

    signal.signal(signal.SIGINT, ctrl_c)
    (kind,) = (kind for kind in vars(dask_jobqueue) if kind.lower() == f"{name}cluster")
    logs, account = str(folder.resolve()), "account" if name in QUEUES[:3] else "project"
    if shlex.quote(logs) != logs:
        raise InvalidInput(
            "must be a path without spaces or special characters",
            "results",
            received=logs,
            code="unsafe_path",
        )
    folder.mkdir(parents=True, exist_ok=True)
    variables = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    variables |= {"PYTHONPATH": str(plugins.PACKAGE.parent), "DASK_DISTRIBUTED__WORKER__HTTP__ROUTES": "[]"}
    parameters: dict[str, Any] = {
        "walltime": options.walltime,
        "queue": options.queue,
        account: options.account,
    }
    extra: Any = options.extra
    if name == "htcondor":  # has no queues, and its directives are assignments
        parameters, extra = {"disk": "1GB"}, dict(text.partition("=")[::2] for text in extra)
    if options.tls:
        certificates = stack.enter_context(tempfile.TemporaryDirectory(prefix=".tls-", dir=logs))  # mode 0700
        parameters |= {"security": True, "shared_temp_directory": certificates}
    queue = getattr(dask_jobqueue, kind)(
        cores=options.cores, processes=options.cores, memory=f"{options.memory_gb}GB", log_directory=logs,
        job_name="gait-pipeline", python=shlex.quote(sys.executable), worker_extra_args=["--no-dashboard"],
        job_script_prologue=[f"export {key}={shlex.quote(value)}" for key, value in variables.items()],
        scheduler_options={"dashboard_address": dashboard}, job_extra_directives=extra,
        **{key: value for key, value in parameters.items() if value},
    )  # fmt: skip
    for key in ("ca_file", "cert", "key") if options.tls else ():  # temporary files in the folder
        stack.callback(getattr(queue, f"_job_{key}").close)
    return queue


def _prepare_workers(client: Any, jobs: Jobs) -> None:
    """Make each worker of the cluster enter the current folder, load the users' files, and compare package versions."""
    from distributed import WorkerPlugin

    def environment() -> dict[str, str]:
        libraries = versions(
            ["numpy", "scipy", "pandas", "numba", "matplotlib", "distributed", "cloudpickle"]
        )
        sources = sources_digest([__name__, *sorted(each.module for each in plugins.loaded())])[:12]
        return {"sources": sources, "Python": sys.version.split()[0], **libraries}

    class Ready(WorkerPlugin):
        def setup(self, worker: Any) -> None:
            os.chdir(folder)
            plugins.load_files(files)
            if changes := environment().items() - expected.items():
                worker.loop.add_callback(worker.close)  # the client does not see the error of a later worker
                words = ", ".join(f"{name} {value}, not {expected[name]}" for name, value in changes)
                raise InvalidInput(
                    "a worker has other versions than this process",
                    worker.address,
                    received=words,
                    code="worker_differs",
                )

    folder, expected, files = Path.cwd(), environment(), {file for job in jobs for file in job[0].plugins}
    client.register_plugin(Ready())


def stage_keys(experiment: Experiment) -> dict[str, str]:
    """Return a digest of the inputs of each stage of a figure, including stages of further synthetic populations."""
    store, alone = Store(Path(experiment.results), dry_run=True), isinstance(experiment.sweep, NoSweep)
    chain.run(experiment, store, through="model" if alone else "sweep")
    if populations.count(experiment):
        (ingest.run if alone else populations.sweep_population)(experiment, store, 0)
    keys: dict[str, str] = {}
    for step in store.steps:
        keys[step["stage"]] = digest(compact([step, *(keys[stage] for stage in step["reads"])]))
    return keys


def _submit(client: Any, jobs: Jobs) -> list[Any]:
    """Submit a task for each stage that several figures share, then for each figure; return the figures' futures."""
    all_keys = [stage_keys(experiment) for experiment, _ in jobs]
    users = Counter(key for keys in all_keys for key in keys.values())
    figures: list[Any] = []
    for (experiment, folder), keys in zip(jobs, all_keys, strict=True):
        mapping = dataclasses.replace(experiment, workers=max(experiment.workers, 2))  # 1: never maps
        needs: list[Any] = []
        for stage in [stage for stage, key in keys.items() if users[key] > 1]:  # Dask computes each key once
            needs = [*needs, client.submit(_stage, mapping, stage, needs, key=keys[stage] + client.id)]
        figures.append(client.submit(_figure, mapping, folder, needs, pure=False))
    return figures


def _stage(experiment: Experiment, stage: str, needs: list[Any]) -> None:
    """Compute a stage on a worker; ignore an error, because each figure that needs the stage raises it again."""
    store, numbers = Store(Path(experiment.results), None), range(populations.count(experiment))
    step = ingest.run if stage == "population" else populations.sweep_population
    with suppress(Exception), mapped_by(_Workers()):
        if stage in chain.STAGES:
            chain.run(experiment, store, through=stage)
        else:
            map_processes(lambda n: bool(step(experiment, store, n)), numbers, experiment.workers)


def _figure(experiment: Experiment, folder: Path, needs: list[Any]) -> Made:
    """Make a figure on a worker, and return the outcome or the failure."""
    log = partial(logging.getLogger("distributed.worker").info, f"{experiment.name}: %s")
    workers, started = _Workers(), time.thread_time()
    with mapped_by(workers):
        outcome = attempt(experiment, folder, log, store=Store(Path(experiment.results), None))
    seconds = time.thread_time() - started + workers.seconds
    return dataclasses.replace(outcome, processor_s=seconds) if isinstance(outcome, Outcome) else outcome


class _Workers:
    """Mapper that distributes blocks of items over all workers of a Dask cluster, and sums their processor time."""

    seconds = 0.0

    def __call__(self, function: Callable[[Any], Any], items: Sequence[Any]) -> list[Any]:
        from distributed import KilledWorker, get_worker, worker_client

        def block(some: Sequence[Any], function: Callable[[Any], Any]) -> tuple[list[Any], float]:
            started = time.thread_time()
            with mapped_by(lambda inner, inner_items: [inner(item) for item in inner_items]), one_thread():
                return [function(item) for item in some], time.thread_time() - started

        size = -(-len(items) // 256)  # at most 256 blocks
        blocks = [items[start : start + size] for start in range(0, len(items), size)]
        with worker_client() as client:  # the worker computes other tasks meanwhile
            # On the figure's own worker: the function is lost only with the figure, which then runs again.
            (sent,) = client.scatter([function], workers=[get_worker().address], hash=False)
            futures = client.map(block, blocks, function=sent, pure=False, priority=1)  # before other figures
            try:
                parts = client.gather(futures)
            except KilledWorker as error:
                raise InvalidInput(_LOST.format(error.last_worker.address), code="workers_lost") from None
        self.seconds += sum(seconds for _, seconds in parts)
        return [result for results, _ in parts for result in results]


def _watch(client: Any, futures: Sequence[Any], jobs: Jobs, console: Console) -> list[Made]:
    """Wait for the outcome of each figure; meanwhile show the numbers of tasks, workers and lost workers."""
    lost, connected, results = list[str](), set[str](), dict[int, Made]()

    def heed(event: tuple[float, dict[str, Any]]) -> None:
        if event[1].get("action") == "remove-worker" and not event[1]["expected"]:
            lost.append(event[1]["worker"])
            console.print(f"the worker {lost[-1]} was lost; its tasks run again", style="yellow")

    client.subscribe_topic("all", heed)
    with ExitStack() as stack, Display([experiment for experiment, _ in jobs], console, slots=1) as display:
        stack.callback(client.unsubscribe_topic, "all")
        while len(results) < len(jobs):
            time.sleep(0.5)
            for number, future in enumerate(futures):
                if number not in results and future.status != "pending":
                    lost_figure = Failure(jobs[number][0].name, _LOST.format(future.status))
                    results[number] = future.result() if future.status == "finished" else lost_figure
                    display.ended(0, number, results[number])
            tasks = client.processing()
            display.note(f"{sum(map(len, tasks.values()))} tasks, {len(tasks)} workers, {len(lost)} lost")
            addresses = client.scheduler_info()["workers"].values()
            names = {str(worker["name"]).rpartition("-")[0] for worker in addresses}
            for job in (connected - names) & set(client.cluster.workers if client.cluster else ()):
                client.sync(client.cluster.workers.pop(job).close)  # Dask replaces jobs of one worker only
                client.cluster.loop.add_callback(client.cluster._correct_state)
                connected.discard(job)  # until its new workers connect
            connected |= names
    return [results[number] for number in range(len(jobs))]
