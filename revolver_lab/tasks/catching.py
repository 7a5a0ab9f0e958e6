"""The ball in a cup: catch it (sparse), and the same with a reward for height (dense)."""

import mujoco
import numpy as np

from revolver_lab.tasks.base import State, Task

POSITION_SCALE = 3.0
"""Positions are observed in thirds of a metre [1/m]."""
VELOCITY_SCALE = 0.3
"""Velocities are observed at three tenths [s/m]."""
START_BELOW = (0.07, 0.10)
"""How far below the cup the ball starts [m]; the string, 0.3 m long, is slack."""
START_ASIDE = 0.02
"""How far to either side of the cup it starts at most [m]."""
HEIGHT_BONUS = 0.5
"""What a step with the ball at the height of the cup's rim or above it earns."""
HEIGHT_SPAN = 0.3
"""How far below the rim that bonus begins [m]."""

CUP, BALL = slice(0, 2), slice(2, 4)  # x and z of each, in qpos and qvel


class CupState(State):
    """A cup that slides along x and z, and a ball that does the same on its string."""

    def cup(self) -> np.ndarray:
        """How far the cup is from where its model has it, x and z, (n, 2) [m]."""
        return self.qpos[:, CUP]

    def ball(self) -> np.ndarray:
        """How far the ball is from where its model has it, x and z, (n, 2) [m]."""
        return self.qpos[:, BALL]


class CatchTheBall(Task[CupState]):
    """What both tasks share: 100 steps of 0.04 s, no early end, and what is seen.

    The observation is dm_control's, positions times 3 and velocities times 0.3. A start hangs
    the ball 7 to 10 cm below the cup and up to 2 cm to one side, string slack, all at rest.
    (dm_control starts it anywhere around the cup, often above it, where it may just fall in.)

    The sizes of cup and ball, and where the model has them, are those of the robot that the task
    was bound to: an evolution that changes them needs a task of its own.
    """

    state_class = CupState
    n_substeps = 8
    episode_steps = 100

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up sizes and reference places of cup and ball; see ``Task.bind``."""
        super().bind(model)
        self.observation_size = model.nq + model.nv
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        ball = data.body("ball").xpos[[0, 2]]
        self._apart = data.site("target").xpos[[0, 2]] - ball
        self._room = model.site("target").size[[0, 2]] - model.geom("ball").size[0]
        self._rim = float(data.body("cup").xpos[2] - ball[1])
        self._start = data.site("cup").xpos[[0, 2]] - ball

    def observe(self, robot: CupState) -> np.ndarray:
        """Return 3 qpos and 0.3 qvel, (n, 8)."""
        return np.concatenate([POSITION_SCALE * robot.qpos, VELOCITY_SCALE * robot.qvel], axis=1)

    def caught(self, robot: CupState) -> np.ndarray:
        """Return where the whole ball is inside the box that the cup encloses, (n,) bool.

        dm_control's ``in_target``: |target - ball| < half size of the box - radius, in x and z.
        """
        apart = self._apart + robot.cup() - robot.ball()
        return (np.abs(apart) < self._room).all(axis=1)

    def height(self, robot: CupState) -> np.ndarray:
        """Return how high the ball is: 0 at 0.3 m below the cup's rim, 1 at the rim, (n,)."""
        below = self._rim + robot.cup()[:, 1] - robot.ball()[:, 1]
        return np.clip(1.0 - below / HEIGHT_SPAN, 0.0, 1.0)

    def initial_state(
        self, model: mujoco.MjModel, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw where the ball hangs; see the class."""
        qpos = np.zeros(model.nq)
        aside, below = rng.uniform(-START_ASIDE, START_ASIDE), rng.uniform(*START_BELOW)
        qpos[BALL] = self._start + np.array([aside, -below])
        return qpos, np.zeros(model.nv)


class Catch(CatchTheBall):
    """Sparse: 1 for every step with the ball in the cup."""

    def reward(self, robot: CupState, before: np.ndarray | None) -> np.ndarray:
        """Return 1 where the ball is in the cup, else 0, (n,)."""
        return self.caught(robot).astype(float)


class Toss(CatchTheBall):
    """Dense, to train the expert with: the same, and half as much for height alone."""

    def reward(self, robot: CupState, before: np.ndarray | None) -> np.ndarray:
        """Return caught + 0.5 height, (n,); height is 0 to 1."""
        return self.caught(robot) + HEIGHT_BONUS * self.height(robot)
