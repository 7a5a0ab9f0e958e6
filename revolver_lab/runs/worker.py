"""A worker: trains one shard of a run, leaves checkpoints, and goes on where it was stopped."""

import argparse
import contextlib
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

from revolver_lab.errors import RevolverError
from revolver_lab.files import write_json
from revolver_lab.methods import Member
from revolver_lab.natural_population import NaturalPopulation
from revolver_lab.policies import Policy
from revolver_lab.population import Population
from revolver_lab.runs import checkpoint, status, store
from revolver_lab.runs.claim import ShardTakenError, claimed
from revolver_lab.runs.plan import Plan

STOPPED = 2
"""What `train` returns where somebody asked it to stop; a checkpoint is written."""

_SIGNALS = (signal.SIGTERM, signal.SIGINT)


class Worker:
    """Trains the members of one shard.

    Args:
        folder: The run's folder.
        shard: Which of its shards.
        every: Seconds between checkpoints [s].
    """

    def __init__(self, folder: Path, shard: int, every: float = 60.0):
        self.folder, self.work, self.every = folder, store.shard_folder(folder, shard), every
        self.plan = store.read_plan(folder)
        self.members = store.shard_members(folder, self.plan, shard)
        self.population = _population(self.plan, folder, self.members)
        self.asked_to_stop, self.message = False, ""
        self._saved = self._told = self._looked = time.monotonic()

    def run(self) -> bool:
        """Trains until all is done or somebody asks to stop; returns whether all is done."""
        for torn in self.work.rglob(".*.tmp"):  # by a worker that was killed as it wrote
            torn.unlink(missing_ok=True)
        checkpoint.restore(self.population, self.work)
        self._tell("running")
        finished = self.population.run(self._pause)
        if self._gone:
            return False
        if finished:
            store.write_shard(self.work, self.population.results(), self.plan.command)
        else:
            self._save()
        self._tell("done" if finished else "stopped")
        return finished

    def _pause(self) -> bool:
        """Between two ticks: saves and tells now and then; says whether to stop."""
        now = time.monotonic()
        if now - self._looked > 0.1:
            self._looked = now
            self.asked_to_stop |= (self.folder / store.STOP).exists() or self._gone
        if now - self._told > 0.5:
            self._told = now
            self._tell("running")
        if now - self._saved > self.every and not self._gone:
            self._save()
            self._saved = time.monotonic()
        return self.asked_to_stop

    @property
    def _gone(self) -> bool:
        """Whether somebody has deleted the run, which is not to come back by bits."""
        return not (self.folder / store.CONFIG).exists()

    def _save(self) -> None:
        """Writes a checkpoint; where the disk is full, says so and keeps the one before."""
        try:
            checkpoint.save(self.population, self.work)
            self.message = ""
            self.population.policy().save(self.work / store.CURRENT)
        except OSError as problem:
            self.message = f"No checkpoint could be written: {problem.strerror}. Make room."

    def _tell(self, state: str) -> None:
        """Writes how things are; an audience is not worth stopping for."""
        if self._gone:
            return
        with contextlib.suppress(OSError):
            write_json(self.work / store.PROGRESS, {
                "state": state, "pid": os.getpid(), "message": self.message,
                "seconds": self.population.seconds,
                "learners": status.describe(self.population),
            })  # fmt: skip


def _population(
    plan: Plan, folder: Path, members: tuple[Member, ...]
) -> Population | NaturalPopulation:
    """Makes the learners of a shard."""
    expert = None
    if any(member.method.needs_expert for member in members):
        expert = plan.check_expert(Policy.load(folder / store.EXPERT))
    if plan.learner is None:
        return NaturalPopulation(
            plan.robot, members, expert=expert, steps=plan.steps, task=plan.task,
            evaluate_episodes=plan.evaluate_episodes,
        )  # fmt: skip
    return Population(
        plan.robot, members, settings=plan.learner, expert=expert, steps=plan.steps,
        task=plan.task, evaluate_every=plan.evaluate_every,
        evaluate_episodes=plan.evaluate_episodes,
    )  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """Trains a shard; see `--help`."""
    parser = argparse.ArgumentParser(prog="python -m revolver_lab.runs.worker", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("shard", type=int)
    parser.add_argument("--every", type=float, default=60.0, help="seconds between checkpoints")
    options = parser.parse_args(arguments)
    try:
        code = train(options.folder, options.shard, options.every)
        return 0 if code == STOPPED else code  # to be stopped is no failure
    except ShardTakenError as problem:  # started twice at once: no failure of the run
        print(f"revolver-lab: {problem}", file=sys.stderr)
        return 0


def train(folder: Path, shard: int, every: float) -> int:
    """Trains a shard in this process; returns 0, STOPPED, or 1 where it left a reason.

    Raises:
        ShardTakenError: If another worker is at it.
    """
    work = store.shard_folder(folder, shard)
    try:
        with claimed(work, patience=1.0):  # who asks whether it is claimed claims it shortly
            if (work / store.DONE).exists():  # by another, since this one was sent
                return 0
            worker = Worker(folder, shard, every)
            with _heeding(lambda *_: setattr(worker, "asked_to_stop", True)):
                finished = worker.run()
            # Who asks as the last step is done is heard as well: a sweep goes on otherwise.
            return 0 if finished and not worker.asked_to_stop else STOPPED
    except ShardTakenError:
        raise
    except (RevolverError, OSError) as problem:
        if (folder / store.CARD).exists():  # done by others, collected and cleared away
            return 0
        return _fail(work, str(problem))
    except Exception as problem:  # whatever it is, whoever watches the folder has to hear of it
        traceback.print_exc()
        return _fail(work, f"{type(problem).__name__}: {problem}")


@contextlib.contextmanager
def _heeding(handler: Callable[..., None]) -> Iterator[None]:
    """Hears of signals for a while; a cluster's threads cannot, and are only ever killed."""
    before = {}
    with contextlib.suppress(ValueError):
        before = {number: signal.signal(number, handler) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, was in before.items():
            signal.signal(number, was)


def _fail(work: Path, message: str) -> int:
    """Leaves the reason where the run looks for it."""
    print(f"revolver-lab: {message}", file=sys.stderr)
    if work.is_dir():  # unless the run has been deleted
        with contextlib.suppress(OSError):
            write_json(work / store.FAILED, {"message": message})
    return 1


if __name__ == "__main__":
    sys.exit(main())
