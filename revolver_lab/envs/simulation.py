"""One robot being simulated: the arithmetic behind the gymnasium and the dm_env door."""

import mujoco
import numpy as np

from revolver_lab.envs.core import Controls, Outcome, Purpose, first_look, judge, stream
from revolver_lab.tasks.base import Task


class Simulation:
    """A model and its data on a task; episodes start, step and end as in the vector environment.

    Args:
        model: The robot; the caller may change it between episodes (``Evolution.write_model``).
        data: Its data.
        task: The task; bound here.
        simulation: Which simulation of a vector environment this one equals, for its streams.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, task: Task, simulation: int = 0):
        task.bind(model)
        self.model, self.data, self.task, self.simulation = model, data, task, simulation
        self.robot = task.state_class({f: getattr(data, f)[None] for f in task.fields})
        self._meet()
        self.steps, self.held, self.total_reward = 0, 0, 0.0
        self._last = np.zeros((1, task.observation_size), np.float32)

    def _meet(self) -> None:
        """Note what of the robot is not in its state: what an action means, how long a step is."""
        self.controls = Controls.of(self.model)
        self._step_seconds = self.task.seconds_of([self.model])

    def seed(self, seed: int) -> None:
        """Restart the random streams from ``seed``."""
        self._start = stream(seed, self.simulation, Purpose.START)

    def begin(self) -> np.ndarray:
        """Start an episode.

        Returns:
            The first observation, (O,) float32.
        """
        self._meet()
        mujoco.mj_resetData(self.model, self.data)
        places = self.task.scene(self.model, self._start)
        if places is not None:
            self.data.mocap_pos[:] = places
        self.data.qpos[:], self.data.qvel[:] = self.task.initial_state(self.model, self._start)
        mujoco.mj_forward(self.model, self.data)
        self.steps, self.held, self.total_reward = 0, 0, 0.0
        self._last = first_look(self.task, self.robot)
        return self._last[0].copy()

    def advance(self, action: np.ndarray) -> Outcome:
        """Take one step.

        Args:
            action: (nu,) in [-1, 1]; what is outside is clipped.

        Returns:
            The outcome, its arrays with a leading axis of length 1.
        """
        before = self.task.remember(self.robot)
        self.data.ctrl[:] = self.controls(action, self.data.ctrl.shape)
        warned = self._step()
        self.task.step_seconds = self._step_seconds
        outcome = judge(self.task, self.robot, before, np.array([warned]), self._last)
        self._last = outcome.observation
        self.steps += 1
        self.held += int(outcome.success[0])  # steps in which the goal held
        self.total_reward += float(outcome.reward[0])
        return outcome

    def _step(self) -> bool:
        """Run the physics; return whether MuJoCo warned or failed."""
        warnings = self.data.warning.number.sum()
        try:
            mujoco.mj_step(self.model, self.data, self.task.n_substeps)
            if self.task.needs_derived:
                mujoco.mj_forward(self.model, self.data)
        except mujoco.FatalError:
            return True
        return bool(self.data.warning.number.sum() != warnings)

    @property
    def out_of_time(self) -> bool:
        """Whether the episode has had all its steps."""
        return self.steps >= self.task.episode_steps
