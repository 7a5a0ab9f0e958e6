"""Many runs at once: every learner a job of its own, on this machine's cores or on a cluster."""

import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path

from revolver_lab.errors import MissingExtraError, SettingsError
from revolver_lab.given import count_of, require, require_call, require_time
from revolver_lab.robots.own import VARIABLE
from revolver_lab.runs import shapes, store, worker
from revolver_lab.runs.claim import ShardTakenError, is_claimed
from revolver_lab.runs.plan import Plan
from revolver_lab.runs.run import EVERY, PROCESSES, ROOT, Run

_TRIES = 5  # of a machine on which no learner gets anywhere

Job = tuple[Path, int]
"""A run's folder and one of its shards."""


def sweep(
    plans: Sequence[Plan], *, root: str | Path = ROOT, jobs: int = PROCESSES,
    cluster: str | None = None, every: float = EVERY,
    told: Callable[[int, int], None] | None = None,
) -> tuple[Run, ...]:  # fmt: skip
    """Trains everything that is not yet trained, and returns the runs.

    A job that is killed loses what it did since its last checkpoint and is given out again; one
    that another sweep is at is waited for. So a sweep can be killed, repeated, and started twice.

    Args:
        plans: What to train.
        root: Folder of the runs; on a cluster, one that all machines share.
        jobs: Processes on this machine; a learner by natural policy gradient takes one.
        cluster: Address of a Dask scheduler, whose workers take the jobs; None stays here.
        every: Seconds between checkpoints [s].
        told: Called with the jobs that are done and all of them, whenever there are more.

    Raises:
        SettingsError: If something cannot be, a learner failed, or jobs are killed again and
            again.
        MissingExtraError: If there is a cluster to talk to, and no Dask.
    """
    require("plans", plans, Iterable, "Pass a list of Plan, or read_sweep(path).")
    require_call("told", told, "Pass a function of two numbers.")
    require("cluster", cluster, (str, type(None)), "Leave it out to stay on this machine.")
    jobs = count_of("jobs", jobs, 1, f"Try {PROCESSES}.")
    require_time("every", every)
    runs = [Run(plan, root=root) for plan in plans]
    waiting = [job for run in runs for job in _jobs(run, jobs)]
    total, tries, heard = len(waiting), 0, -1
    while waiting := [job for job in waiting if not _is_done(job)]:
        before = total - len(waiting)
        for done in _hand_out(waiting, jobs, cluster, every):
            if told is not None and before + done > heard:
                heard = before + done
                told(heard, total)
        stopped = [run for run in runs if (run.folder / store.STOP).exists()]
        if stopped:
            raise SettingsError(f"{stopped[0].folder}, which was stopped", "a run that goes on",
                                "The same sweep goes on from there.")  # fmt: skip
        failed = _failures(waiting)
        if failed:
            raise SettingsError(f"jobs that failed: {'; '.join(failed)}", "jobs that end",
                                "Mend what they say; the same sweep goes on.")  # fmt: skip
        moving = any(_is_done(job) or is_claimed(_work(job)) for job in waiting)
        tries = 0 if moving else tries + 1
        if tries >= _TRIES:
            raise SettingsError(
                f"{len(waiting)} jobs that are killed again and again", "jobs that end",
                "Is there enough memory? Ask for fewer jobs.",
            )  # fmt: skip
    for run in runs:
        run.status()  # which collects what its jobs have left
    return tuple(runs)


def _jobs(run: Run, jobs: int) -> list[Job]:
    """Makes a run's folder, and returns its jobs."""
    if run.status().state == "finished":
        return []
    members = len(run.plan.members)
    run.prepare(members if run.plan.learner is None else min(jobs, members))
    (run.folder / store.STOP).unlink(missing_ok=True)
    return [(run.folder, shard) for shard in range(store.count_shards(run.folder))]


def _work(job: Job) -> Path:
    """Returns the folder of a job."""
    return store.shard_folder(*job)


def _is_done(job: Job) -> bool:
    """Whether a job's learners have come to their end."""
    return (_work(job) / store.DONE).exists() or (job[0] / store.CARD).exists()


def _hand_out(
    waiting: Sequence[Job], jobs: int, cluster: str | None, every: float
) -> Iterator[int]:
    """Lets every job be done once, as far as nobody kills it; tells how many are done."""
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    for job in waiting:
        if not is_claimed(_work(job)):
            (_work(job) / store.FAILED).unlink(missing_ok=True)
    yield 0
    # Workers may have begun before a robot was registered.
    here = os.getpid(), os.environ.get(VARIABLE, "")
    try:
        with _where(jobs, cluster):
            ended = Parallel(return_as="generator_unordered")
            for _ in ended(delayed(_train)(*job, every, *here) for job in waiting):
                yield sum(map(_is_done, waiting))
    except TerminatedWorkerError:
        pass  # whoever was killed left a checkpoint: the rest is given out again
    if any(not _is_done(job) and is_claimed(_work(job)) for job in waiting):  # elsewhere
        time.sleep(min(every, 1.0))


def _failures(jobs: Sequence[Job]) -> list[str]:
    """Returns what went wrong, and where."""
    return [f"{_work(job)}: {store.read_json(_work(job) / store.FAILED, shapes.FAILED)['message']}"
            for job in jobs if (_work(job) / store.FAILED).exists()]  # fmt: skip


@contextmanager
def _where(jobs: int, cluster: str | None) -> Iterator[None]:
    """Lets joblib give jobs out for a while: here, or to a cluster."""
    from joblib import parallel_config

    if cluster is None:
        with parallel_config(backend="loky", n_jobs=jobs, inner_max_num_threads=1):
            yield
        return
    with _client(cluster), parallel_config(backend="dask", n_jobs=-1):
        yield


def _client(cluster: str) -> AbstractContextManager:
    """Returns a connection to a cluster, which is closed at its end."""
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingExtraError("a cluster, and no distributed", "the cluster extra",
                                "pip install 'revolver-lab[cluster]'") from error  # fmt: skip
    try:
        return Client(cluster, timeout=20)
    except (OSError, ValueError, TimeoutError) as error:
        raise SettingsError(
            f"cluster {cluster!r}, which does not answer ({error})",
            "the address of a Dask scheduler", "Start one: dask scheduler.",
        ) from error  # fmt: skip


def _train(folder: Path, shard: int, every: float, sweeper: int, robots: str) -> None:
    """Does a job, in whatever process it is, unless another sweep is at it.

    Raises:
        KeyboardInterrupt: If it was stopped in the sweep's own process: that ends the sweep.
    """
    os.environ[VARIABLE] = robots
    with suppress(ShardTakenError):
        stopped = worker.train(folder, shard, every) == worker.STOPPED
        if stopped and os.getpid() == sweeper:
            raise KeyboardInterrupt
