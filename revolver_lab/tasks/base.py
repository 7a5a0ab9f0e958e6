"""What every task is: observation, reward and ending, written once over n robots at a time."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Generic, TypeVar

import mujoco
import numpy as np


class State:
    """The state of n robots, speaking in words; its attributes are MjData fields, (n, ...) each.

    In the vector environment the arrays are those that ``mujoco.batch.Batch`` refreshes, in the
    single one they are views of one MjData with a leading axis of length 1. Either way they are
    live: read them after a step, copy what has to outlive it.

    Args:
        fields: MjData field name -> array with a leading axis of robots.

    Example:
        >>> State({"qpos": np.zeros((3, 2)), "qvel": np.ones((3, 2))}).qvel.shape
        (3, 2)
    """

    qpos: np.ndarray
    qvel: np.ndarray

    def __init__(self, fields: Mapping[str, np.ndarray]):
        self.__dict__.update(fields)


S = TypeVar("S", bound=State)


class Task(ABC, Generic[S]):
    """A task: what is seen, what is rewarded, when it ends; n robots at a time.

    A task never sees alpha: the robots of one call may all be different, as long as they share
    the layout of their states. Subclasses set the class attributes below.

    Attributes:
        fields: The MjData fields that ``state_class`` reads.
        state_class: The class whose methods are the words of this task.
        needs_derived: Whether the fields hold more than qpos, qvel and ctrl. If so the
            environments run ``mj_forward`` after a step, so that everything a task reads
            describes the state *after* the step (plain ``mj_step`` leaves derived fields one
            substep behind, and Gym's Ant and Humanoid read them so).
        n_substeps: Calls to ``mj_step`` in one environment step.
        episode_steps: Environment steps until the episode is truncated.
        goal_steps: An episode is a success if the goal holds in more steps than this; None for
            a task without a goal.
        idle_return: What an episode returns at the most to a robot that does nothing: the least
            that a success has to exceed, where returns have to tell it.
        observation_size: O, known after ``bind``.
        step_seconds: Duration of one environment step [s], known after ``bind``; (n,) while robots
            are judged whose timesteps differ.
    """

    fields: tuple[str, ...] = ("qpos", "qvel")
    state_class: type[State] = State
    needs_derived: bool = False
    n_substeps: int = 5
    episode_steps: int = 1000
    goal_steps: int | None = None
    idle_return: float = 0.0
    observation_size: int = 0
    step_seconds: float | np.ndarray = 0.0

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up in ``model`` what the task needs to know: sizes, ids, the length of a step.

        Args:
            model: Any robot of the evolution; its layout is that of all.
        """
        self.step_seconds = self.seconds_of([model])

    def seconds_of(self, models: Sequence[mujoco.MjModel]) -> float | np.ndarray:
        """Return how long a step of each robot takes [s], (n,), or one number if it is that of all.

        Args:
            models: The robots.
        """
        each = np.array([model.opt.timestep for model in models]) * self.n_substeps
        return each if np.ptp(each) else float(each[0])

    @abstractmethod
    def observe(self, robot: S) -> np.ndarray:
        """Return what the policy sees, (n, O), float64."""

    def remember(self, robot: S) -> np.ndarray | None:
        """Return a copy of what ``reward`` must know from before the step, (n,), or None."""
        return None

    @abstractmethod
    def reward(self, robot: S, before: np.ndarray | None) -> np.ndarray:
        """Return the reward of the step that just ended, (n,), never shaped.

        Args:
            robot: The robots after the step.
            before: What ``remember`` returned before it.
        """

    def terminated(self, robot: S) -> np.ndarray:
        """Return which robots have failed, (n,) bool; by default none ever does."""
        return np.zeros(len(robot.qpos), dtype=bool)

    def success(self, robot: S) -> np.ndarray:
        """Return where the goal holds now, (n,) bool; a task without one never gets there."""
        return np.zeros(len(robot.qpos), dtype=bool)

    def scene(self, model: mujoco.MjModel, rng: np.random.Generator) -> np.ndarray | None:
        """Draw where an episode's mocap bodies are, before ``initial_state`` draws.

        What stands elsewhere in every episode (a door, a target) hangs on a mocap body: so its
        place is part of the simulation's state, and the model stays E(alpha).

        Args:
            model: The robot that starts.
            rng: The stream to draw from; the same draws are made for every robot.

        Returns:
            Places, (nmocap, 3) [m], or None to leave them where the model has them.
        """
        return None

    @abstractmethod
    def initial_state(
        self, model: mujoco.MjModel, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw a start for one robot.

        Args:
            model: The robot that starts.
            rng: The stream to draw from; the same draws are made for every robot.

        Returns:
            qpos (nq,) and qvel (nv,).
        """


def normalized_root(qpos: np.ndarray) -> np.ndarray:
    """Return ``qpos`` with the quaternion of its leading free joint (entries 3 to 6) made unit.

    Example:
        >>> normalized_root(np.array([0, 0, 1, 2, 0, 0, 0.0]))
        array([0., 0., 1., 1., 0., 0., 0.])
    """
    out = qpos.copy()
    out[3:7] /= np.linalg.norm(out[3:7])
    return out
