"""What the three doors share: resolving names, scaling actions, judging a step, random streams."""

import enum
import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.robots import registry
from revolver_lab.tasks.base import State, Task

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution

DrawAlpha = Callable[[int, np.random.Generator], float]
"""Draws the alpha of an episode: (simulation, its stream) -> alpha in [0, 1]."""

HUGE = mujoco.mjMAXVAL
"""Magnitude at which MuJoCo calls a number bad (1e10)."""


class Stage:
    """A robot on its way into an environment: the evolution, its task, a camera."""

    def __init__(self, robot: "str | Evolution", task: "str | Task | None" = None):
        """Resolve names.

        Args:
            robot: A registered name, or any ``Evolution``.
            task: A reward of the registered robot ("sparse", "dense"; by default its first), or
                a ``Task``, which an ``Evolution`` that is not registered needs.

        Raises:
            UnknownNameError: If there is no such robot or reward.
            SettingsError: If it is neither, or an unregistered one comes without a ``Task``.
        """
        self.evolve = registry.evolution_of(robot)
        name = self.evolve.name
        record = registry.get(name) if name in registry.names() else None
        if isinstance(task, Task):
            self.task = task
        elif record is not None:
            self.task = record.make_task(task)
        else:
            raise SettingsError(
                f"task = {task!r} for {name!r}, which is not registered", "a Task, ready made",
                "Pass task=SpeedTrap(), or one of your own.",
            )  # fmt: skip
        self.camera = record.camera if record is not None else -1


class Purpose(enum.IntEnum):
    """What a random stream is for."""

    START = 0
    ALPHA = 1


def stream(seed: int, simulation: int, purpose: Purpose) -> np.random.Generator:
    """Return the random stream with this name; it does not depend on how many there are.

    Args:
        seed: Seed of the environment, >= 0.
        simulation: Index of the simulation within it.
        purpose: What will be drawn.

    Example:
        >>> bool(stream(1, 2, Purpose.START).random() == stream(1, 2, Purpose.START).random())
        True
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(simulation, int(purpose))))


def fresh_seed() -> int:
    """Return a seed from the system's entropy."""
    return int(np.random.SeedSequence().generate_state(1)[0])


@dataclass(frozen=True, kw_only=True)
class Controls:
    """The way from an action in [-1, 1] to a control within its range.

    Attributes:
        low: Lower ends of the control ranges, (nu,), or (n, nu) of n robots.
        high: Upper ends, of the same shape.
    """

    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, model: mujoco.MjModel) -> "Controls":
        """Read the ranges of a robot; an actuator without one gets [-1, 1].

        Raises:
            SettingsError: If it has no actuator.
        """
        alone = cls.each([model])
        return cls(low=alone.low[0], high=alone.high[0])

    @classmethod
    def each(cls, models: Sequence[mujoco.MjModel]) -> "Controls":
        """Read the ranges of n robots of one layout, which may change along the path, (n, nu)."""
        if models[0].nu == 0:
            raise SettingsError(
                "a robot without actuators", "one or more: an action has a number for each",
                "To a URDF, which has none: MjSpec.from_file, add_actuator; pass that MjSpec.",
            )  # fmt: skip
        limited = np.array([model.actuator_ctrllimited for model in models], dtype=bool)
        ranges = np.array([model.actuator_ctrlrange for model in models])
        ranges = np.where(limited[..., None], ranges, [-1.0, 1.0])
        return cls(low=ranges[..., 0].copy(), high=ranges[..., 1].copy())

    @functools.cached_property
    def _half(self) -> np.ndarray:
        return 0.5 * (self.high - self.low)

    def __call__(self, actions: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        """Return low + (clip(a, -1, 1) + 1) (high - low) / 2, float64.

        Args:
            actions: In [-1, 1]; what is outside is clipped, NaN is passed on (and diverges).
            shape: The shape that the actions must have, (..., nu).

        Raises:
            SettingsError: If they have another.

        Example:
            >>> to_ctrl = Controls(low=np.array([0.0]), high=np.array([4.0]))
            >>> to_ctrl(np.array([[-1.0], [0.5], [9.0]]), (3, 1)).ravel()
            array([0., 3., 4.])
        """
        given = np.asarray(actions, dtype=np.float64)
        if given.shape != shape:
            raise SettingsError(
                f"actions of shape {given.shape}", f"shape {shape}", "Give one number per motor."
            )
        unit = np.minimum(np.maximum(given, -1.0), 1.0)  # np.clip takes thrice as long on so few
        return self.low + (unit + 1.0) * self._half


class Outcome(NamedTuple):
    """What a step came to, for n robots.

    Attributes:
        observation: (n, O) float32, always finite.
        reward: (n,) float64, never shaped, always finite.
        terminated: (n,) bool; a diverged robot's episode is terminated.
        diverged: (n,) bool.
        success: Where the goal holds, (n,) bool; nowhere without one.
    """

    observation: np.ndarray
    reward: np.ndarray
    terminated: np.ndarray
    diverged: np.ndarray
    success: np.ndarray

    def without(self, idle: np.ndarray) -> "Outcome":
        """Return the outcome in which nothing happened to the robots of a mask, (n,) bool."""
        flags = (self.terminated, self.diverged, self.success)
        return Outcome(self.observation, np.where(idle, 0.0, self.reward),
                       *(flag & ~idle for flag in flags))  # fmt: skip


def judge(
    task: Task, robot: State, before: np.ndarray | None, suspect: np.ndarray, last: np.ndarray
) -> Outcome:
    """Observe and reward the robots after a step, and catch those whose simulation diverged.

    A robot has diverged if MuJoCo warned or failed, or if anything of its observation or reward
    is not finite or beyond 1e10. It is shown where it last was, and gets nothing for the step.

    Args:
        task: The task, bound.
        robot: The robots after the step.
        before: What ``task.remember`` returned before it.
        suspect: Which simulations MuJoCo warned about in this step, (n,) bool.
        last: The observations before the step, (n, O) float32.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        observation = task.observe(robot)
        reward = np.array(task.reward(robot, before), dtype=float)
        if observation.shape != last.shape or reward.shape != suspect.shape:
            _refuse(task, observation.shape, last.shape, reward.shape, suspect.shape)
        outcome = Outcome(observation.astype(np.float32), reward, task.terminated(robot),
                          suspect, task.success(robot))  # fmt: skip
        diverged = suspect
        if not (_small(observation) and _small(reward)):
            sane = (np.abs(observation) < HUGE).all(axis=1) & (np.abs(reward) < HUGE)
            diverged = suspect | ~sane
    if not np.count_nonzero(diverged):
        return outcome
    outcome.observation[diverged] = last[diverged]
    outcome = outcome.without(diverged)
    return outcome._replace(terminated=outcome.terminated | diverged, diverged=diverged)


def _small(x: np.ndarray) -> bool:
    """Say at a glance that no number is near HUGE, as in nearly every step; False says nothing.

    OpenBLAS sums up to 10,000 products on one thread; more would wake threads that spin.
    """
    return x.size <= 10_000 and np.vdot(x, x) < HUGE


def first_look(task: Task, robot: State) -> np.ndarray:
    """Observe robots that have just started, (n, O) float32; what is not finite is shown as 0."""
    observation, n = task.observe(robot), len(robot.qpos)
    if observation.shape != (n, task.observation_size):
        _refuse(task, observation.shape, (n, task.observation_size))
    sane = np.abs(observation) < HUGE
    return np.where(sane, observation, 0.0).astype(np.float32)


def _refuse(task: Task, *shapes: tuple[int, ...]) -> None:
    """Refuse observations, and rewards, of another shape than the task says: given, wanted, ..."""
    names = ("observations", "rewards")[: len(shapes) // 2]
    given = " and ".join(f"{name} of shape {shape}" for name, shape in zip(names, shapes[::2]))
    raise SettingsError(
        f"{given} from {type(task).__name__}", " and ".join(map(str, shapes[1::2])),
        "A task sees n robots at once: observe returns (n, observation_size), reward (n,).",
    )  # fmt: skip
