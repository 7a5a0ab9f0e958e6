"""Whole trajectories, one a robot, side by side: what was seen, done, earned and achieved."""

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.given import count_of, is_number

if TYPE_CHECKING:
    from revolver_lab.envs.vector import RobotVectorEnv
    from revolver_lab.tasks.base import Task

Act = Callable[[int, np.ndarray], np.ndarray]
"""(step, observations (n, O)) -> actions (n, A), not clipped."""


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Trajectories:
    """n trajectories of at most T steps, each from the start of an episode.

    Attributes:
        observations: (T + 1, n, O) float32, the state behind the last step included.
        actions: As the policy gave them, not clipped, (T, n, A) float32.
        rewards: Never shaped, (T, n); 0 beyond a trajectory's end.
        lengths: Steps of each, (n,).
        terminated: Which ended by failing; the others ran out of time, (n,) bool.
        betas: Their robots, (n,).
        goal_steps: In how many steps of each the task's goal held, (n,); -1 without a goal.
    """

    observations: np.ndarray
    actions: np.ndarray
    rewards: np.ndarray
    lengths: np.ndarray
    terminated: np.ndarray
    betas: np.ndarray
    goal_steps: np.ndarray

    @property
    def steps(self) -> int:
        """Returns the environment steps of all together."""
        return int(self.lengths.sum())

    @property
    def returns(self) -> np.ndarray:
        """Returns the unshaped return of each, (n,)."""
        return self.rewards.sum(axis=0)

    @property
    def inside(self) -> np.ndarray:
        """Returns which steps are part of a trajectory, (T, n) bool."""
        return np.arange(len(self.rewards))[:, None] < self.lengths


def sample(env: "RobotVectorEnv", act: Act, length: int) -> Trajectories:
    """Plays one trajectory in every simulation, its robot drawn by the environment.

    Args:
        env: Simulations in NextStep mode; their streams go on.
        act: What acts.
        length: Steps of a trajectory at most; an episode may be over before.
    """
    observation, _ = env.reset()
    env.halted[:] = False
    n, steps = env.num_envs, min(length, env.task.episode_steps)
    observations = np.zeros((steps + 1, n, observation.shape[1]), np.float32)
    actions = np.zeros((steps, n, env.single_action_space.shape[0]), np.float32)  # type: ignore[index]
    rewards = np.zeros((steps, n))
    lengths, failed = np.full(n, steps), np.zeros(n, dtype=bool)
    observations[0] = observation
    for t in range(steps):
        actions[t] = act(t, observation)
        observation, rewards[t], terminated, truncated, infos = env.step(actions[t])
        observations[t + 1] = observation
        if "episode" in infos:
            ended = terminated | truncated
            failed |= terminated
            lengths[ended] = t + 1
            env.halted |= ended
            if env.halted.all():
                break
    env.halted[:] = False
    goals = np.full(n, -1) if env.task.goal_steps is None else env.held.copy()
    return Trajectories(observations=observations, actions=actions, rewards=rewards,
                        lengths=lengths, terminated=failed, betas=env.alphas.copy(),
                        goal_steps=goals)  # fmt: skip


def half_of_home(home: float, idle: float = 0.0) -> float:
    """Returns from which unshaped return on an episode of a task without a goal is a success.

    Half of what the expert gains on its own robot over one that does nothing.

    Args:
        home: What the expert returns there.
        idle: What a robot returns that does nothing, `Task.idle_return`.

    Raises:
        SettingsError: If the expert gains nothing: half of that would be no success.

    Example:
        >>> half_of_home(160.0), half_of_home(3000.0, idle=1000.0)
        (80.0, 2000.0)
    """
    if home <= idle:
        raise SettingsError(
            f"an expert that returns {home:.4g} at home",
            f"more than the {idle:.4g} of a robot that does nothing: half of that is a success",
            "Train it longer, or give the NaturalMethod a least_return of its own.",
        )
    return (home + idle) / 2


@dataclasses.dataclass(frozen=True, kw_only=True)
class Success:
    """When a trajectory counts as a success.

    Attributes:
        goal_steps: The task's goal held in more steps than this; None is the task's own number
            (25 of the hands' 200 steps, the paper's).
        least_return: For a task without a goal, the unshaped return from which on it counts.
    """

    goal_steps: int | None = None
    least_return: float | None = None

    def __post_init__(self) -> None:
        """Refuses what is no number."""
        if self.goal_steps is not None:
            count_of("goal_steps", self.goal_steps, 0, "Leave it out: the task has its own.")
        if self.least_return is not None and not is_number(self.least_return):
            raise SettingsError(f"least_return = {self.least_return!r}", "a finite number, or None",
                                "half_of_home of what the expert returns is a start.")  # fmt: skip

    def __call__(self, env: "RobotVectorEnv", played: Trajectories) -> np.ndarray:
        """Returns which trajectories succeeded, (n,) bool."""
        if self.least_return is not None:
            return played.returns >= self.least_return
        needed = env.task.goal_steps if self.goal_steps is None else self.goal_steps
        return played.goal_steps > (needed or 0)

    def check(self, task: "Task") -> "Success":
        """Returns itself, if it can be told of this task.

        Raises:
            SettingsError: If the task has no goal and no return was given.
        """
        if self.least_return is None and task.goal_steps is None:
            raise SettingsError(
                f"least_return = None with the task {type(task).__name__}, which has no goal",
                "an unshaped return, or a task with success() and goal_steps",
                "Give it to Success or NaturalMethod: half_of_home of the expert's return there "
                "is a start.",
            )
        return self
