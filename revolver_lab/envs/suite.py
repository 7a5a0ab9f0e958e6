"""The dm_env door: ``suite.load("cheetah", "front_leg", alpha=0.3)``."""

from typing import TYPE_CHECKING

import dm_env
import numpy as np
from dm_env import specs

from revolver_lab.envs.core import Stage, fresh_seed
from revolver_lab.envs.simulation import Simulation
from revolver_lab.robots import registry

if TYPE_CHECKING:
    from dm_control.mujoco import Physics

    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import State, Task


def load(
    domain: str,
    task: str,
    *,
    alpha: float = 0.0,
    reward: "str | Task | None" = None,
    seed: int | None = None,
) -> "SuiteEnv":
    """Return E(alpha) on its task as a dm_env environment.

    Args:
        domain: What robot: "cheetah", "ant", "humanoid".
        task: What becomes of it: "front_leg", "length_mass", ...
        alpha: Which robot of the continuum, in [0, 1].
        reward: "sparse", "dense" or what the robot offers, by default its first; or a ``Task``.
        seed: Seed of the random streams; None takes one from the system.

    Raises:
        UnknownNameError: If there is no such domain, task or reward.
        AlphaError: If alpha is not in [0, 1].
    """
    return SuiteEnv(registry.find(domain, task).name, alpha=alpha, task=reward, seed=seed)


class SuiteEnv(dm_env.Environment):
    """One robot as dm_env sees it; same seed, same trajectory as ``RobotEnv``, bit for bit.

    An episode that runs out of time ends with discount 1, one that fails or diverges with 0.

    Args:
        robot: A registered name, or an ``Evolution``.
        alpha: Which robot of the continuum, in [0, 1].
        task: See ``load``.
        seed: See ``load``.
    """

    def __init__(
        self,
        robot: "str | Evolution",
        *,
        alpha: float = 0.0,
        task: "str | Task | None" = None,
        seed: int | None = None,
    ):
        stage = Stage(robot, task)
        self.evolve, self.task, self._physics = stage.evolve, stage.task, stage.evolve(alpha)
        self.simulation = Simulation(self._physics.model.ptr, self._physics.data.ptr, self.task)
        self.simulation.seed(fresh_seed() if seed is None else seed)
        self.diverged, self._over = False, True

    @property
    def physics(self) -> "Physics":
        """The dm_control Physics, to look at and to render."""
        return self._physics

    @property
    def robot(self) -> "State":
        """The robot in the words of its task, arrays with a leading axis of length 1."""
        return self.simulation.robot

    def set_alpha(self, alpha: float) -> None:
        """Make the episodes to come those of E(alpha); the Physics and its GL context stay.

        Raises:
            AlphaError: If alpha is not in [0, 1].
        """
        self.evolve.set_alpha(self._physics, alpha)
        self._over = True

    def reset(self) -> dm_env.TimeStep:
        """Start an episode."""
        self._over, self.diverged = False, False
        return dm_env.restart(self.simulation.begin())

    def step(self, action: np.ndarray) -> dm_env.TimeStep:
        """Take one step, or start an episode if there is none.

        Args:
            action: (nu,) in [-1, 1].
        """
        if self._over:
            return self.reset()
        outcome = self.simulation.advance(action)
        observation, reward = outcome.observation[0].copy(), float(outcome.reward[0])
        self.diverged = bool(outcome.diverged[0])
        if outcome.terminated[0]:
            self._over = True
            return dm_env.termination(reward, observation)
        self._over = self.simulation.out_of_time
        finish = dm_env.truncation if self._over else dm_env.transition
        return finish(reward, observation)

    def observation_spec(self) -> specs.Array:
        """Shape and type of an observation: (O,) float32."""
        return specs.Array((self.task.observation_size,), np.float32, name="observation")

    def action_spec(self) -> specs.BoundedArray:
        """Shape and bounds of an action: (nu,) in [-1, 1]."""
        nu = self.simulation.model.nu
        return specs.BoundedArray((nu,), np.float32, minimum=-1.0, maximum=1.0, name="action")

    def close(self) -> None:
        """Free the Physics and its GL context."""
        self._physics.free()
