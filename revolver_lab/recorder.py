"""The bookkeeping of a transfer: counts, evaluates, reports, and says when to go on."""

import dataclasses
import time
from collections.abc import Callable

import numpy as np

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
    """Counts what a transfer does, for its log.

    Args:
        schedule: Says how many episodes a phase has.
        episode_steps: Steps of an episode that does not end early [steps].
        steps: Environment steps to end after, or None to end with the schedule.
        snapshot: Returns a copy of the current policy.
        evaluate: Plays episodes with a policy on the last robot and returns their returns.
        evaluate_every: Environment steps between evaluations; 0 is only at the end.
        report: Called with a `Progress` whenever episodes end.

    Attributes:
        best: The policy of the best evaluation so far.
    """

    def __init__(
        self, schedule: Schedule, episode_steps: int, *, steps: int | None = None,
        snapshot: Callable[[], Policy] | None = None,
        evaluate: Callable[[Policy], np.ndarray] | None = None, evaluate_every: int = 0,
        report: Callable[[Progress], None] | None = None,
    ):  # fmt: skip
        self.schedule, self.limit, self.report = schedule, steps, report
        self._snapshot, self._evaluate, self._every = snapshot, evaluate, evaluate_every
        self.best: Policy | None = None
        self._start = time.monotonic()
        self._expected = steps or episode_steps * sum(map(schedule.episodes, schedule.alphas))
        self.steps, self.evaluation_steps, self._episode_steps = 0, 0, episode_steps
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
        return self.schedule.phase_over(alpha, self._returns, previous)

    def count(self, alpha: float, steps: int, returns: np.ndarray, betas: np.ndarray) -> None:
        """Counts one tick.

        Args:
            alpha: Alpha of the phase.
            steps: Environment steps in it, one for each simulation that moved.
            returns: Unshaped returns of the episodes that ended in it.
            betas: Their robots.
        """
        before, self.steps = self.steps, self.steps + steps
        if self._every and before // self._every != self.steps // self._every:
            self.evaluate()
        if len(returns):
            self._returns.extend(map(float, returns))
            self._betas.extend(map(float, betas))
            if self.report:
                self.report(self._progress(alpha))

    def evaluate(self) -> None:
        """Evaluates the current policy on the last robot, once per number of steps."""
        done = bool(self.evaluations) and self.evaluations[-1].steps == self.steps
        if done or self._evaluate is None or self._snapshot is None:
            return
        policy = self._snapshot()
        returns = tuple(map(float, self._evaluate(policy)))
        robot = self.schedule.alphas[-1]
        record = Evaluation(steps=self.steps, alpha=robot, returns=returns)
        if record.mean > max((earlier.mean for earlier in self.evaluations), default=-np.inf):
            self.best = policy
        self.evaluation_steps += len(returns) * self._episode_steps
        self.evaluations.append(record)

    def close(self, alpha: float) -> None:
        """Writes down the phase at alpha and begins the next."""
        last = self.schedule.episodes(alpha)
        self.phases.append(Phase(
            phase=len(self.phases), alpha=alpha, episodes=len(self._returns), steps=self.steps,
            episode_return=_mean(self._returns[-last:]), mean_beta=_mean(self._betas[-last:]),
            wall_time=round(self.seconds, 3),
        ))  # fmt: skip
        self._returns, self._betas = [], []

    @property
    def seconds(self) -> float:
        """Returns the time since the start [s]."""
        return time.monotonic() - self._start

    def _progress(self, alpha: float) -> Progress:
        """Describes how far things have come."""
        left = max(self._expected - self.steps, 0) * self.seconds / max(self.steps, 1)
        return Progress(
            phase=len(self.phases), phases=len(self.schedule.alphas), alpha=alpha,
            steps=self.steps, episode_return=_mean(self._returns[-8:]), seconds=self.seconds,
            seconds_left=left,
        )  # fmt: skip


def _mean(values: list[float]) -> float:
    """Returns the mean, nan where there is nothing to average."""
    return float(np.mean(values)) if values else float("nan")
