"""The gymnasium door: one robot of the continuum, E(alpha), on its task."""

from typing import TYPE_CHECKING, Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.spaces import Box

from revolver_lab.envs.core import Stage
from revolver_lab.envs.simulation import Simulation
from revolver_lab.evolution.evolution import checked_alpha

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task


def spaces_of(observation_size: int, actions: int) -> tuple[Box, Box]:
    """Return the observation and action space of a robot; they are the same at every alpha."""
    return (
        Box(-np.inf, np.inf, (observation_size,), np.float32),
        Box(-1.0, 1.0, (actions,), np.float32),
    )


class RobotEnv(gymnasium.Env):
    """E(alpha) on its task, one robot.

    Actions in [-1, 1] are scaled to the control ranges. An episode ends by the task's rule
    (``terminated``), by divergence (``terminated``, ``info["diverged"]``) or by the task's number
    of steps (``truncated``); its last info has "episode": {"r": unshaped return, "l": steps},
    and "success" where the task has a goal.

    Args:
        robot: A registered name, or an ``Evolution``.
        alpha: Which robot of the continuum, in [0, 1].
        task: "sparse", "dense" or what the robot offers; or a ``Task``.
        simulation: Which simulation of a vector environment with the same seed this one equals.
        render_mode: None or "rgb_array".
        width: Of a frame [pixels].
        height: Of a frame [pixels].

    Raises:
        UnknownNameError: If there is no such robot or task.
        AlphaError: If alpha is not in [0, 1].
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012 - gymnasium's way

    def __init__(
        self,
        robot: "str | Evolution",
        *,
        alpha: float = 0.0,
        task: "str | Task | None" = None,
        simulation: int = 0,
        render_mode: str | None = None,
        width: int = 320,
        height: int = 240,
    ):
        stage = Stage(robot, task)
        self.evolve, self.task = stage.evolve, stage.task
        self.alpha, self.render_mode = checked_alpha(alpha), render_mode
        self._picture = {"width": width, "height": height, "camera_id": stage.camera}
        self._physics: Any = None
        model = self.evolve.model(alpha)
        self.simulation = Simulation(model, mujoco.MjData(model), self.task, simulation)
        self.observation_space, self.action_space = spaces_of(self.task.observation_size, model.nu)
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": round(1.0 / float(self.task.step_seconds)),
        }
        self._seeded = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Restarts the random streams; None goes on with them.
            options: {"alpha": a} makes this and the following episodes those of E(a).

        Returns:
            The observation, (O,) float32, and {"alpha", "diverged"}.
        """
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self.simulation.seed(int(self.np_random_seed or 0))
            self._seeded = True
        if options and "alpha" in options:
            self.evolve.write_model(self.simulation.model, options["alpha"])
            self.alpha = float(options["alpha"])
        return self.simulation.begin(), {"alpha": self.alpha, "diverged": False}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Take one step.

        Args:
            action: (nu,) in [-1, 1].

        Returns:
            Observation, unshaped reward, terminated, truncated, info.
        """
        outcome = self.simulation.advance(action)
        terminated = bool(outcome.terminated[0])
        truncated = self.simulation.out_of_time and not terminated
        info: dict[str, Any] = {"alpha": self.alpha, "diverged": bool(outcome.diverged[0])}
        if terminated or truncated:
            info["episode"] = {"r": self.simulation.total_reward, "l": self.simulation.steps}
            if self.task.goal_steps is not None:
                info["episode"]["success"] = self.simulation.held > self.task.goal_steps
        observation = outcome.observation[0].copy()
        return observation, float(outcome.reward[0]), terminated, truncated, info

    def render(self) -> np.ndarray | None:
        """Return a frame of the robot as it is, (height, width, 3) uint8, in "rgb_array" mode.

        dm_control draws it, in one GL context for the life of the environment.
        """
        if self.render_mode != "rgb_array":
            return None
        if self._physics is None:
            self._physics = self.evolve(self.alpha)
        self._physics.data.qpos[:] = self.simulation.data.qpos
        self._physics.data.mocap_pos[:] = self.simulation.data.mocap_pos
        self.evolve.set_alpha(self._physics, self.alpha)
        return self._physics.render(**self._picture)

    def close(self) -> None:
        """Free the GL context, if a frame was ever drawn."""
        if self._physics is not None:
            self._physics.free()
            self._physics = None
