"""Algorithm 1 of the paper: policies follow their robots along a continuous evolution."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from revolver_lab.policies import Policy
from revolver_lab.recorder import Recorder
from revolver_lab.schedule import Schedule

if TYPE_CHECKING:
    from revolver_lab.envs.vector import RobotVectorEnv


class Learner(Protocol):
    """What the loop asks of P learners that share n simulations, n / P each, in order."""

    broken: np.ndarray
    """Whose numbers are no longer finite, (P,) bool."""

    def enter(self, p: int, alpha: float) -> int:
        """Begins a phase of learner p: cleans its replay; returns how many transitions stay."""
        ...

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Draws actions, (n, A), for observations, (n, O)."""
        ...

    def store(
        self, moved: np.ndarray, observation: np.ndarray, action: np.ndarray, reward: np.ndarray,
        following: np.ndarray, terminated: np.ndarray, betas: np.ndarray,
    ) -> None:  # fmt: skip
        """Remembers the transitions of the simulations that moved; rewards come unshaped."""
        ...

    def update(self, active: np.ndarray) -> None:
        """Improves the policies of the active learners, (P,) bool, from what they remember."""
        ...

    def policy(self, p: int) -> Policy:
        """Returns a copy of learner p's policy."""
        ...


Examine = Callable[[Sequence[int], Sequence[Policy]], np.ndarray]
"""Plays episodes on the target: learners and their policies -> unshaped returns, (m, episodes)."""


class Algorithm1:
    """The loop; numbers are its lines in the paper.

    All simulations go through lines 14 to 25 side by side, each with its own beta, and every
    learner is in a phase of its own. An episode that ended starts anew at the next step, which
    is therefore no transition. A variant of the method is a schedule, not another loop.

    Args:
        learner: P learners, each with pi as it starts and the replay R empty (line 10).
        env: Simulations in NextStep mode.
        schedules: alpha, l_k, xi, N_e and the window of each learner.
        logs: One a learner; they see unshaped returns only.
        examine: Plays evaluations; None plays none.

    Attributes:
        phase: k of each learner, (P,).
        over: Who has come to the end, (P,) bool.
    """

    def __init__(
        self, learner: Learner, env: "RobotVectorEnv", schedules: Sequence[Schedule],
        logs: Sequence[Recorder], examine: Examine | None = None,
    ):  # fmt: skip
        self.learner, self.env, self.logs, self._examine = learner, env, logs, examine
        self.schedules = schedules
        self.owner = np.repeat(np.arange(len(schedules)), env.num_envs // len(schedules))
        self.phase, self.over = np.zeros(len(logs), dtype=int), np.zeros(len(logs), dtype=bool)
        self._running = np.ones(env.num_envs, dtype=bool)
        self._state = np.empty(0)
        env.draw_alpha = self._draw

    def alpha(self, p: int) -> float:
        """Returns alpha of learner p's phase."""
        return self.schedules[p].alphas[self.phase[p]]

    def _draw(self, simulation: int, rng: np.random.Generator) -> float:
        """Draws beta, for M_beta <- E(beta) (14, 15)."""
        p = self.owner[simulation]
        return self.schedules[p].draw(self.alpha(p), rng)

    def begin(self, seeds: Sequence[int]) -> None:
        """Starts every learner at its first alpha (10) and every episode at s_0 (16).

        Args:
            seeds: Of the robots and starts of each learner.
        """
        for p in range(len(self.logs)):
            self._enter(p)
        self._state, _ = self.env.reset(seed=list(seeds))

    def _enter(self, p: int) -> None:
        """Begins a phase (31: keep beta in [alpha, alpha + xi])."""
        self.logs[p].kept = self.learner.enter(p, self.alpha(p))

    def tick(self) -> None:
        """Takes one step of every simulation and one update of every learner (17 to 25)."""
        for p in np.flatnonzero(~self.over).tolist():
            self._progress(p)
        if self.over.all():
            return
        action = self.learner.act(self._state)  # 19: a ~ pi(. | s)
        following, reward, terminated, truncated, info = self.env.step(action)  # 20 (and 16)
        moved = self._running & ~self.env.halted
        active = np.bincount(self.owner, moved) > 0
        self.learner.store(moved, self._state, action, reward, following, terminated,
                           info["alpha"])  # 22, 23: r' when it is sampled  # fmt: skip
        self.learner.update(active)  # 24, 25
        ended = moved & (terminated | truncated)
        self._count(moved, ended, info)
        self._state, self._running = following, ~ended
        for p in np.flatnonzero(self.learner.broken & ~self.over).tolist():
            self._stop(p, "its numbers are no longer finite")

    def _progress(self, p: int) -> None:
        """Moves a learner whose phase is over to the next (11, 12, 29)."""
        log = self.logs[p]
        while not self.over[p] and log.phase_over(self.alpha(p)):
            log.close(self.alpha(p))
            if self.phase[p] + 1 == len(self.schedules[p].alphas):
                self._stop(p)
            else:
                self.phase[p] += 1  # alpha <- alpha + l_k
                self._enter(p)

    def _stop(self, p: int, failure: str = "") -> None:
        """Lets a learner's simulations stand still; the others go on."""
        if failure:
            self.logs[p].close(self.alpha(p))
            self.logs[p].failure = failure
        self.over[p] = True
        self.env.halted[self.owner == p] = True

    def _count(self, moved: np.ndarray, ended: np.ndarray, info: dict[str, Any]) -> None:
        """Tells each log what happened, and plays the evaluations that are due."""
        steps = np.bincount(self.owner, moved).astype(int)
        moving = np.flatnonzero(steps).tolist()
        for p in moving:
            log, mine = self.logs[p], ended & (self.owner == p) if ended.any() else ended
            returns = info["episode"]["r"][mine] if mine.any() else np.empty(0)
            log.count(self.alpha(p), int(steps[p]), returns, info["alpha"][mine])
        self.evaluate([p for p in moving if self.logs[p].evaluation_due])

    def evaluate(self, learners: Sequence[int]) -> None:
        """Evaluates some learners on the target, side by side."""
        if not learners or self._examine is None:
            return
        policies = [self.learner.policy(p) for p in learners]
        for p, policy, returns in zip(learners, policies, self._examine(learners, policies)):
            self.logs[p].evaluated(returns, policy)

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns where the loop is: arrays by name, and plain values."""
        arrays = {"observation": self._state.copy(), "running": self._running.copy()}
        return arrays, {"phase": self.phase.tolist(), "over": self.over.tolist()}

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned."""
        self._state, self._running = arrays["observation"].copy(), arrays["running"].copy()
        self.phase[:], self.over[:] = plain["phase"], plain["over"]
