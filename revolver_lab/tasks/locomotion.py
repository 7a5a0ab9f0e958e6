"""Gym's locomotion: the Ant and the Humanoid run forward without falling."""

import mujoco
import numpy as np

from revolver_lab.tasks.base import State, Task, normalized_root

ANT_HEIGHT = (0.2, 1.0)
"""Heights of the torso between which an Ant is up [m]."""
ANT_ALIVE = 1.0
ANT_CONTROL_COST = 0.5
ANT_CONTACT_COST = 5e-4
ANT_CONTACT_CLIP = 1.0
"""Contact forces and torques are clipped to +-1 [N, N m]."""
ANT_POSITION_NOISE = 0.1
ANT_VELOCITY_NOISE = 0.1

HUMANOID_HEIGHT = (1.0, 2.0)
"""Heights of the torso between which a Humanoid is up [m]."""
HUMANOID_FORWARD_WEIGHT = 1.25
HUMANOID_ALIVE = 5.0
HUMANOID_CONTROL_COST = 0.1
HUMANOID_CONTACT_COST = 5e-7
HUMANOID_CONTACT_COST_MAX = 10.0
HUMANOID_NOISE = 0.01


class WalkerState(State):
    """A robot that floats freely: its root is a free joint, its torso the first body."""

    ctrl: np.ndarray
    cfrc_ext: np.ndarray

    def torso_position(self) -> np.ndarray:
        """The torso's x, (n,) [m]."""
        return self.qpos[:, 0]

    def torso_height(self) -> np.ndarray:
        """The torso's z, (n,) [m]."""
        return self.qpos[:, 2]

    def effort(self) -> np.ndarray:
        """Sum of the squared controls, (n,)."""
        return np.square(self.ctrl).sum(axis=1)

    def contact_forces(self, clip: float = np.inf) -> np.ndarray:
        """External force and torque on every body, world included, (n, 6 nbody) [N m, N]."""
        return np.clip(self.cfrc_ext, -clip, clip).reshape(len(self.cfrc_ext), -1)


class HumanoidState(WalkerState):
    """A walker whose progress is that of its centre of mass."""

    subtree_com: np.ndarray
    cinert: np.ndarray
    cvel: np.ndarray
    qfrc_actuator: np.ndarray

    def mass_center_position(self) -> np.ndarray:
        """The whole body's centre of mass along x, (n,) [m]."""
        return self.subtree_com[:, 1, 0]


class AntRun(Task[WalkerState]):
    """Run forward on four legs; 1000 steps of 0.05 s, ends unless 0.2 m <= z <= 1 m.

    As Gym's Ant with contact forces (its observation of 111 numbers), but for this: the contact
    forces are those of the state after the step, where Gym reports the last intermediate state
    of the integrator; the velocity is the change of the root's x itself, not of a copy one
    substep old; a start's quaternion is normalized. Starts: qpos0 + U(-0.1, 0.1), N(0, 0.1).
    """

    fields = ("qpos", "qvel", "ctrl", "cfrc_ext")
    state_class = WalkerState
    needs_derived = True
    idle_return = ANT_ALIVE * Task.episode_steps

    def bind(self, model: mujoco.MjModel) -> None:
        """See ``Task.bind``."""
        super().bind(model)
        self.observation_size = model.nq - 2 + model.nv + 6 * model.nbody

    def observe(self, robot: WalkerState) -> np.ndarray:
        """Return qpos[2:], qvel and the clipped contact forces, (n, nq - 2 + nv + 6 nbody)."""
        forces = robot.contact_forces(ANT_CONTACT_CLIP)
        return np.concatenate([robot.qpos[:, 2:], robot.qvel, forces], axis=1)

    def remember(self, robot: WalkerState) -> np.ndarray:
        """Return where the torso is, (n,) [m]."""
        return robot.torso_position().copy()

    def reward(self, robot: WalkerState, before: np.ndarray | None) -> np.ndarray:
        """Return v_x + 1 - 0.5 |a|^2 - 0.0005 |clip(contact forces, -1, 1)|^2, (n,).

        v_x is the torso's mean velocity over the step [m/s] (facts, section 2).
        """
        forward_speed = (robot.torso_position() - before) / self.step_seconds
        contact = np.square(robot.contact_forces(ANT_CONTACT_CLIP)).sum(axis=1)
        return (
            forward_speed
            + ANT_ALIVE
            - ANT_CONTROL_COST * robot.effort()
            - ANT_CONTACT_COST * contact
        )

    def terminated(self, robot: WalkerState) -> np.ndarray:
        """Return which Ants have fallen or flown, (n,) bool."""
        low, high = ANT_HEIGHT
        return ~((robot.torso_height() >= low) & (robot.torso_height() <= high))

    def initial_state(
        self, model: mujoco.MjModel, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw qpos0 + U(-0.1, 0.1) and velocities N(0, 0.1)."""
        noise = rng.uniform(-ANT_POSITION_NOISE, ANT_POSITION_NOISE, model.nq)
        qvel = ANT_VELOCITY_NOISE * rng.standard_normal(model.nv)
        return normalized_root(model.qpos0 + noise), qvel


class HumanoidRun(Task[HumanoidState]):
    """Run forward on two legs; 1000 steps of 0.015 s, ends unless 1 m <= z <= 2 m.

    As Gym's Humanoid (376 numbers), with the deviations that ``AntRun`` lists: all derived
    quantities, actuator forces included, are those of the state after the step.
    Starts: qpos0 + U(-0.01, 0.01), velocities U(-0.01, 0.01).
    """

    fields = (
        "qpos",
        "qvel",
        "ctrl",
        "cinert",
        "cvel",
        "qfrc_actuator",
        "cfrc_ext",
        "subtree_com",
    )
    state_class = HumanoidState
    needs_derived = True
    idle_return = HUMANOID_ALIVE * Task.episode_steps

    def bind(self, model: mujoco.MjModel) -> None:
        """See ``Task.bind``."""
        super().bind(model)
        self.observation_size = model.nq - 2 + 2 * model.nv + 22 * model.nbody

    def observe(self, robot: HumanoidState) -> np.ndarray:
        """Return qpos[2:], qvel, cinert, cvel, actuator forces, contact forces, (n, O)."""
        n = len(robot.qpos)
        return np.concatenate(
            [
                robot.qpos[:, 2:],
                robot.qvel,
                robot.cinert.reshape(n, -1),
                robot.cvel.reshape(n, -1),
                robot.qfrc_actuator,
                robot.contact_forces(),
            ],
            axis=1,
        )

    def remember(self, robot: HumanoidState) -> np.ndarray:
        """Return where the centre of mass is, (n,) [m]."""
        return robot.mass_center_position().copy()

    def reward(self, robot: HumanoidState, before: np.ndarray | None) -> np.ndarray:
        """Return 1.25 v_x + 5 - 0.1 |ctrl|^2 - min(5e-7 |contact forces|^2, 10), (n,).

        v_x is the centre of mass's mean velocity over the step [m/s] (facts, section 2).
        """
        forward_speed = (robot.mass_center_position() - before) / self.step_seconds
        contact = HUMANOID_CONTACT_COST * np.square(robot.contact_forces()).sum(axis=1)
        return (
            HUMANOID_FORWARD_WEIGHT * forward_speed
            + HUMANOID_ALIVE
            - HUMANOID_CONTROL_COST * robot.effort()
            - np.minimum(contact, HUMANOID_CONTACT_COST_MAX)
        )

    def terminated(self, robot: HumanoidState) -> np.ndarray:
        """Return which Humanoids have fallen or jumped, (n,) bool."""
        low, high = HUMANOID_HEIGHT
        return ~((robot.torso_height() >= low) & (robot.torso_height() <= high))

    def initial_state(
        self, model: mujoco.MjModel, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw qpos0 + U(-0.01, 0.01) and velocities U(-0.01, 0.01)."""
        noise = rng.uniform(-HUMANOID_NOISE, HUMANOID_NOISE, model.nq)
        qvel = rng.uniform(-HUMANOID_NOISE, HUMANOID_NOISE, model.nv)
        return normalized_root(model.qpos0 + noise), qvel
