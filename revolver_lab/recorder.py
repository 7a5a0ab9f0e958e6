"""The bookkeeping of a transfer: counts, evaluates, reports, and says when to go on."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from revolver_lab.evaluation import episodes_played
from revolver_lab.logs import Evaluation, Phase
from revolver_lab.policies import Policy
from revolver_lab.schedule import Schedule


@dataclasses.dataclass(frozen=True, kw_only=True)
class Progress:
    """How far a transfer has come; handed to the progress callback as episodes end.

    Attributes:
        phase: k, from 0.
        phases: Number of phases of the schedule.
        alpha: alpha_k.
        steps: Environment steps so far [steps].
        episode_return: Mean unshaped return of the latest episodes; nan before the first.
        seconds: Time since the start [s].
        seconds_left: Expected time to the end [s].
    """

    phase: int
    phases: int
    alpha: float
    steps: int
    episode_return: float
    seconds: float
    seconds_left: float


class Recorder:
    """Counts what the transfer of one learner does, for its log.

    Args:
        schedule: Says how long a phase is.
        episode_steps: Steps of an episode that does not end early [steps].
        steps: Environment steps to end after, or None to end with the schedule.
        evaluate_every: Environment steps between evaluations; 0 is only at the end.
        report: Called with a `Progress` whenever episodes end.

    Attributes:
        best: The policy of the best evaluation so far.
        kept: Transitions that the last cleaning left.
        failure: Why the learner was stopped before its end, or "".
    """

    def __init__(
        self, schedule: Schedule, episode_steps: int, *, steps: int | None = None,
        evaluate_every: int = 0, report: Callable[[Progress], None] | None = None,
    ):  # fmt: skip
        self.schedule, self.limit, self.report = schedule, steps, report
        self._every, self._due = evaluate_every, False
        self.best: Policy | None = None
        self.kept, self.failure = 0, ""
        self._start = time.monotonic()
        self._expected = steps or episode_steps * sum(map(schedule.episodes, schedule.alphas))
        self.steps, self.evaluation_steps, self._episode_steps = 0, 0, episode_steps
        self._before = 0  # steps at the beginning of the running phase
        self.phases: list[Phase] = []
        self.evaluations: list[Evaluation] = []
        self._returns: list[float] = []  # of the running phase, unshaped
        self._betas: list[float] = []

    def phase_over(self, alpha: float) -> bool:
        """Says whether the phase at alpha is over; the last lasts until the steps are spent."""
        last = alpha == self.schedule.alphas[-1]
        if self.limit is not None and (last or self.steps >= self.limit):
            return self.steps >= self.limit
        previous = [phase.episode_return for phase in self.phases]
        steps = self.steps - self._before
        return self.schedule.phase_over(alpha, self._returns, previous, steps)

    def count(self, alpha: float, steps: int, returns: np.ndarray, betas: np.ndarray) -> None:
        """Counts one tick.

        Args:
            alpha: Alpha of the phase.
            steps: Environment steps in it, one for each simulation that moved.
            returns: Unshaped returns of the episodes that ended in it.
            betas: Their robots.
        """
        before, self.steps = self.steps, self.steps + steps
        self._due |= self._every > 0 and before // self._every != self.steps // self._every
        if len(returns):
            self._returns.extend(map(float, returns))
            self._betas.extend(map(float, betas))
            if self.report:
                self.report(self._progress(alpha))

    @property
    def evaluation_due(self) -> bool:
        """Whether an evaluation is due between the first step and the last."""
        return self._due

    @property
    def recent_return(self) -> float:
        """Mean unshaped return of the latest episodes, as trained; nan before the first."""
        if self._returns or not self.phases:
            return _mean(self._returns[-8:])
        return self.phases[-1].episode_return

    @property
    def evaluated_last(self) -> bool:
        """Whether the policy has been evaluated since its last step."""
        return bool(self.evaluations) and self.evaluations[-1].steps == self.steps

    def evaluated(self, returns: np.ndarray, policy: Policy) -> None:
        """Writes down an evaluation of the current policy on the last robot.

        Args:
            returns: Unshaped returns, (episodes,).
            policy: The policy.
        """
        self._due = False
        record = Evaluation(steps=self.steps, alpha=self.schedule.alphas[-1],
                            returns=tuple(map(float, returns)))  # fmt: skip
        if record.mean > max((earlier.mean for earlier in self.evaluations), default=-np.inf):
            self.best = policy
        self.evaluation_steps += episodes_played(len(returns)) * self._episode_steps
        self.evaluations.append(record)

    def close(self, alpha: float) -> None:
        """Writes down the phase at alpha and begins the next."""
        last = self.schedule.episodes(alpha)
        self.phases.append(Phase(
            phase=len(self.phases), alpha=alpha, episodes=len(self._returns), steps=self.steps,
            episode_return=_mean(self._returns[-last:]), mean_beta=_mean(self._betas[-last:]),
            kept=self.kept, wall_time=round(self.seconds, 3),
        ))  # fmt: skip
        self._returns, self._betas, self._before = [], [], self.steps

    @property
    def seconds(self) -> float:
        """Returns the time since the start [s]."""
        return time.monotonic() - self._start

    def state(self) -> dict[str, Any]:
        """Returns the counts as plain values; the best policy is kept elsewhere."""
        plain = {name: getattr(self, name) for name in _COUNTS}
        plain["phases"] = [dataclasses.asdict(phase) for phase in self.phases]
        plain["evaluations"] = [dataclasses.asdict(record) for record in self.evaluations]
        return plain | {"seconds": self.seconds}

    def restore(self, plain: dict[str, Any]) -> None:
        """Puts back what `state` returned."""
        for name in _COUNTS:
            setattr(self, name, plain[name])
        self.phases = [Phase(**phase) for phase in plain["phases"]]
        self.evaluations = [Evaluation(**{**record, "returns": tuple(record["returns"])})
                            for record in plain["evaluations"]]  # fmt: skip
        self._start = time.monotonic() - plain["seconds"]

    def _progress(self, alpha: float) -> Progress:
        """Describes how far things have come."""
        left = max(self._expected - self.steps, 0) * self.seconds / max(self.steps, 1)
        return Progress(
            phase=len(self.phases), phases=len(self.schedule.alphas), alpha=alpha,
            steps=self.steps, episode_return=_mean(self._returns[-8:]), seconds=self.seconds,
            seconds_left=left,
        )  # fmt: skip


_COUNTS = ("steps", "evaluation_steps", "kept", "failure", "_before", "_due", "_returns", "_betas")


def _mean(values: list[float]) -> float:
    """Returns the mean, nan where there is nothing to average."""
    return float(np.mean(values)) if values else float("nan")
