"""What a policy did: poses and rewards over time, recorded once and shown as often as one likes."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.evolution.evolution import Evolution, checked_alpha
from revolver_lab.given import count_of, seed_of

if TYPE_CHECKING:
    from revolver_lab.envs.single import RobotEnv
    from revolver_lab.tasks.base import Task

Acting = Callable[[np.ndarray], np.ndarray]
"""A policy, as far as a film is concerned: observation (O,) -> action (A,) in [-1, 1]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Rollout:
    """Poses and unshaped rewards of one episode on E(alpha).

    Attributes:
        evolve: The evolution that the robot is of.
        alpha: Which of its robots, in [0, 1].
        qpos: Poses, (T, nq); the first is the pose before the first action.
        rewards: Unshaped rewards, (T,); the first is 0.
        places: Where the mocap bodies were, (nmocap, 3) [m]; None where the robot has them.
        title: What to write under its picture.
        dt: Time between poses [s].
        held: In how many steps the task's goal had held by each pose, (T,); None without a goal.
        goal_steps: The episode is a success once it held in more steps than this.
    """

    evolve: Evolution = field(repr=False)
    alpha: float
    qpos: np.ndarray = field(repr=False)
    rewards: np.ndarray = field(repr=False)
    places: np.ndarray | None = field(default=None, repr=False)
    title: str = ""
    dt: float = 0.05
    held: np.ndarray | None = field(default=None, repr=False)
    goal_steps: int = 0

    def __post_init__(self) -> None:
        checked_alpha(self.alpha)
        poses, rewards = np.shape(self.qpos), np.shape(self.rewards)
        if len(poses) != 2 or not poses[0] or rewards != poses[:1]:
            raise SettingsError(
                f"qpos of shape {poses} and rewards of shape {rewards}",
                "(T, nq) and (T,), T at least 1",
                "Make rollouts with rvl.lab.record.",
            )
        if self.held is not None and np.shape(self.held) != rewards:
            raise SettingsError(f"held of shape {np.shape(self.held)}", f"one a pose, {rewards}",
                                "Make rollouts with rvl.lab.record.")  # fmt: skip
        if not self.dt > 0:
            raise SettingsError(f"dt = {self.dt}", "seconds above 0", "Take the step of the task.")

    @property
    def score(self) -> float:
        """Unshaped return: the sum of the rewards."""
        return float(np.sum(self.rewards))

    @property
    def seconds(self) -> float:
        """Length in simulated time [s]."""
        return len(self.rewards) * self.dt

    def success(self, row: int = -1) -> bool:
        """Whether the goal had held for long enough by a row of `qpos`, by default the last."""
        return self.held is not None and bool(self.held[row] > self.goal_steps)

    def row(self, time: float) -> int:
        """Row of `qpos` that shows the robot at a time [s]; the last one from the end on."""
        return min(int(time / self.dt + 1e-6), len(self.rewards) - 1)


def acting(policy: Acting) -> Acting:
    """Returns what acts, if it does.

    Raises:
        SettingsError: If it cannot be called, a name for example.
    """
    if not callable(policy):
        raise SettingsError(f"policy = {policy!r:.80}", "a Policy, or a function of an observation",
                            "Pass rvl.load_expert(name), or Policy.load(path).")  # fmt: skip
    return policy


def playable(
    policy: Acting, evolve: Evolution | str, alpha: float, task: "str | Task | None"
) -> "RobotEnv":
    """Returns the environment in which a policy can act, if it can.

    Raises:
        PolicyFileError: If the policy is of another robot.
        SettingsError: If it is no policy.
        UnknownNameError: If there is no such robot or task.
    """
    from revolver_lab.envs.single import RobotEnv
    from revolver_lab.policies import Policy

    env = RobotEnv(evolve, alpha=alpha, task=task)
    if isinstance(acting(policy), Policy):
        policy.fits(env.task.observation_size, env.simulation.model.nu)
    return env


def rollouts_of(shown: Rollout | Iterable[Rollout]) -> list[Rollout]:
    """Returns one or more rollouts as a list.

    Raises:
        SettingsError: If there are none, or they are something else.
    """
    runs = list(shown) if isinstance(shown, Iterable) else [shown]
    if not runs or not all(isinstance(run, Rollout) for run in runs):
        given = ", ".join(type(run).__name__ for run in runs) or "no rollouts"
        raise SettingsError(given, "rollouts, at least one", "Make them with rvl.lab.record.")
    return runs


def record(
    policy: Acting,
    evolve: Evolution | str,
    alpha: float,
    *,
    task: "str | Task | None" = None,
    seed: int = 0,
    steps: int | None = None,
    title: str = "",
) -> Rollout:
    """Let a policy act for one episode and keep the poses.

    Args:
        policy: Observation (O,) -> action (A,) in [-1, 1].
        evolve: The evolution, or the name of a registered one.
        alpha: Which robot, in [0, 1].
        task: A reward of the registered robot, by default its first; or a task for an evolution
            of your own.
        seed: Seed of the episode.
        steps: Stop after so many steps; by default when the episode ends.
        title: What to write under its picture.

    Returns:
        The episode so far.

    Raises:
        AlphaError: If alpha is outside [0, 1].
        PolicyFileError: If the policy is of another robot.
        SettingsError: If the policy is none, or seed or steps are no whole numbers.
        UnknownNameError: If there is no such robot or task.
    """
    if steps is not None:
        steps = count_of("steps", steps, 0, "Leave it out for a whole episode.")
    env = playable(policy, evolve, alpha, task)
    observation, _ = env.reset(seed=seed_of(seed))
    poses, rewards, held, ended = [env.simulation.data.qpos.copy()], [0.0], [0], False
    while not ended and (steps is None or len(rewards) <= steps):
        observation, reward, terminated, truncated, _ = env.step(policy(observation))
        poses.append(env.simulation.data.qpos.copy())
        rewards.append(reward)
        held.append(env.simulation.held)
        ended = terminated or truncated
    goal = env.task.goal_steps
    return Rollout(
        evolve=env.evolve, alpha=alpha, qpos=np.array(poses), rewards=np.array(rewards),
        places=env.simulation.data.mocap_pos.copy(), title=title, dt=float(env.task.step_seconds),
        held=None if goal is None else np.array(held), goal_steps=goal or 0,
    )  # fmt: skip
