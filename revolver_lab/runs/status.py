"""How a run is doing: one record a learner, written by the workers and read by everybody."""

import dataclasses
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from revolver_lab.methods import Member
from revolver_lab.natural_loop import NaturalTransfer
from revolver_lab.natural_population import NaturalPopulation
from revolver_lab.population import Population
from revolver_lab.runs import shapes


@dataclasses.dataclass(frozen=True, kw_only=True)
class LearnerStatus:
    """How far one learner is.

    Attributes:
        method: Name of its method.
        seed: Its seed.
        alpha: alpha of its phase.
        phase: k, from 0; of a natural method the number of iterations.
        phases: Number of phases.
        steps: Environment steps so far [steps].
        episode_return: Mean unshaped return of its latest phase's episodes, as trained, on the
            robots E(beta); None before the first.
        evaluations: Steps and mean unshaped return on the target, of each evaluation so far.
        over: Whether it has come to its end.
        failure: Why it was stopped before, or "".
        success: Fraction of its latest iteration's trajectories that succeeded; None before the
            first, and for methods that have none.
    """

    method: str
    seed: int
    alpha: float
    phase: int
    phases: int
    steps: int
    episode_return: float | None
    evaluations: tuple[tuple[int, float], ...]
    over: bool
    failure: str
    success: float | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Status:
    """How a run is doing.

    Attributes:
        state: "new", "running", "stopped", "finished", or "failed".
        learners: One record each; empty while the run is new.
        steps: Environment steps of all learners so far [steps].
        steps_planned: Those of the whole run [steps].
        seconds: Training time so far, of the worker that has worked longest [s].
        message: What went wrong, or "".
    """

    state: str
    learners: tuple[LearnerStatus, ...]
    steps: int
    steps_planned: int
    seconds: float
    message: str = ""

    @property
    def seconds_left(self) -> float:
        """Returns the expected time to the end [s]; infinite while nothing is known."""
        if self.steps == 0:
            return float("inf")
        return self.seconds * max(self.steps_planned - self.steps, 0) / self.steps

    @property
    def fraction(self) -> float:
        """Returns how much of the run is done, in [0, 1]."""
        return min(self.steps / max(self.steps_planned, 1), 1.0)


def describe(population: Population | NaturalPopulation) -> list[dict[str, Any]]:
    """Returns the status of every learner that has begun as plain values."""
    if isinstance(population, NaturalPopulation):
        some = map(_natural, population.members, population.loops)
        return [dataclasses.asdict(status) for status in some]
    return [dataclasses.asdict(_learner(population, p)) for p in range(len(population.members))]


def _learner(population: Population, p: int) -> LearnerStatus:
    """Looks at one learner."""
    log, member, loop = population.logs[p], population.members[p], population.loop
    recent = log.recent_return
    return LearnerStatus(
        method=member.method.name, seed=member.seed, alpha=loop.alpha(p),
        phase=int(loop.phase[p]), phases=len(member.method.schedule.alphas), steps=log.steps,
        episode_return=recent if recent == recent else None,
        evaluations=tuple((record.steps, record.mean) for record in log.evaluations),
        over=bool(loop.over[p]), failure=log.failure,
    )  # fmt: skip


def _natural(member: Member, loop: NaturalTransfer) -> LearnerStatus:
    """Looks at one learner by natural policy gradient; its iterations are the phases."""
    done = loop.iterations
    target = [trial for trial in loop.trials if trial.alpha == 1.0]
    return LearnerStatus(
        method=member.method.name, seed=member.seed, alpha=loop.position.alpha, phase=len(done),
        phases=len(done), steps=loop.steps,
        episode_return=done[-1].episode_return if done else None,
        evaluations=tuple((trial.steps, trial.mean) for trial in target), over=loop.over,
        failure=loop.failure, success=done[-1].success if done else None,
    )  # fmt: skip


def read(path: Path, names: Collection[str]) -> tuple[tuple[LearnerStatus, ...], Mapping[str, Any]]:
    """Reads what a worker wrote; nothing where it has not written yet, or not well.

    Args:
        path: Its progress file.
        names: Of the learners that it may speak of.

    Returns:
        One record a learner, and what the worker says of itself.
    """
    try:
        value = shapes.check(json.loads(path.read_text()), shapes.PROGRESS, path)
        learners = tuple(
            LearnerStatus(**{**one, "evaluations": tuple(map(tuple, one["evaluations"]))})
            for one in value["learners"]
        )
    except (OSError, ValueError, TypeError, RecursionError):
        return (), {}
    known = all(f"{one.method}-{one.seed}" in names for one in learners)
    return (learners, value) if known else ((), {})
