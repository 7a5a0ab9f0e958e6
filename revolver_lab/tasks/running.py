"""The cheetah's tasks: a speed trap after a run-up (sparse), and plain running (dense)."""

import mujoco
import numpy as np

from revolver_lab.tasks.base import State, Task

TRAP_START = 5.0
"""Where the speed trap begins [m]."""
TRAP_SPEED = 2.0
"""Speed that the trap asks for [m/s]."""
FULL_SPEED = 8.0
"""Speed at which the dense reward is 1 [m/s]."""
VELOCITY_SCALE = 0.1
"""Velocities are observed in tenths, so that they are of the size of the angles [s/m, s/rad]."""
START_NOISE = 0.1
"""Half-width of the start's angles [rad]; deviation of its velocities [m/s, rad/s]."""
CLEARANCE = 0.01
"""Gap between the lowest capsule and the ground at the start [m]."""


class RunnerState(State):
    """A planar runner: slides along x and z and a pitch at its root, then its joints."""

    def forward_position(self) -> np.ndarray:
        """How far the root has come, (n,) [m]."""
        return self.qpos[:, 0]

    def forward_speed(self) -> np.ndarray:
        """The root's velocity along x, (n,) [m/s]."""
        return self.qvel[:, 0]


class Running(Task[RunnerState]):
    """What both tasks share: 200 steps of 0.05 s, no early end, and what is seen.

    The observation is dm_control's (every position but the root's x, every velocity), with
    velocities in tenths, and one number more, clip(x / 5 m, -1, 1): without it the way to the
    speed trap would be hidden and the sparse reward would not be a function of what is seen.

    A start puts every angle of the robot, pitch included, at U(-0.1, 0.1) rad off its reference
    (within its range), gives every velocity N(0, 0.1), and sets the robot down so that its
    lowest capsule is 1 cm above the ground: legs of any length start standing. (dm_control draws
    angles from their whole ranges and lets 200 substeps of falling pass, which throws long legs,
    that start below the ground, into the air.)
    """

    state_class = RunnerState
    episode_steps = 200

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up the capsules to stand on; see ``Task.bind``."""
        super().bind(model)
        self.observation_size = model.nq - 1 + model.nv + 1
        self._scratch = mujoco.MjData(model)
        self._capsules = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE)

    def observe(self, robot: RunnerState) -> np.ndarray:
        """Return qpos[1:], 0.1 qvel and clip(x / 5 m, -1, 1), (n, nq + nv)."""
        run_up = np.clip(robot.forward_position() / TRAP_START, -1.0, 1.0)
        return np.concatenate(
            [robot.qpos[:, 1:], VELOCITY_SCALE * robot.qvel, run_up[:, None]], axis=1
        )

    def initial_state(
        self, model: mujoco.MjModel, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw a standing start; see the class."""
        qpos = model.qpos0 + rng.uniform(-START_NOISE, START_NOISE, model.nq)
        limited = model.jnt_limited.astype(bool)
        qpos[limited] = np.clip(qpos[limited], *model.jnt_range[limited].T)
        qpos[:2] = 0.0
        qpos[1] = CLEARANCE - self._lowest_point(model, qpos)
        return qpos, START_NOISE * rng.standard_normal(model.nv)

    def _lowest_point(self, model: mujoco.MjModel, qpos: np.ndarray) -> float:
        """Height of the lowest point of any capsule of the robot posed at ``qpos`` [m]."""
        data, geoms = self._scratch, self._capsules
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        drop = np.abs(data.geom_xmat[geoms, 8]) * model.geom_size[geoms, 1]
        return float(np.min(data.geom_xpos[geoms, 2] - drop - model.geom_size[geoms, 0]))


class SpeedTrap(Running):
    """Sparse: 1 for every step spent in the speed trap, fast enough."""

    def reward(self, robot: RunnerState, before: np.ndarray | None) -> np.ndarray:
        """Return 1 where x > 5 m and v_x > 2 m/s, else 0, (n,)."""
        in_the_trap = robot.forward_position() > TRAP_START
        fast_enough = robot.forward_speed() > TRAP_SPEED
        return np.where(in_the_trap & fast_enough, 1.0, 0.0)


class Dash(Running):
    """Dense, to train the expert with: the faster, the better."""

    def reward(self, robot: RunnerState, before: np.ndarray | None) -> np.ndarray:
        """Return clip(v_x / (8 m/s), -1, 1), (n,)."""
        return np.clip(robot.forward_speed() / FULL_SPEED, -1.0, 1.0)
