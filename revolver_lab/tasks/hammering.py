"""The hand's hammer: pick it up and drive a nail into its board."""

import mujoco
import numpy as np

from revolver_lab.tasks.manipulation import HandState, Manipulation, distance, scene_with

DRIVEN, ALMOST = 0.010, 0.020
"""Distances of the nail from its place that are paid [m]; the first is the goal."""
DRIVEN_BONUS, ALMOST_BONUS, LIFT_BONUS = 75.0, 25.0, 2.0
LIFTED = 0.04
"""Height above which hammer and head have left the table [m]."""
NAIL_COST, PALM_COST, HEAD_COST, SPEED_COST = 10.0, 0.1, 1.0, 1e-2
BOARD_HEIGHT = (0.1, 0.25)
"""Heights at which the nail's board hangs [m]."""
_LEVEL = 1e-15
"""Cosine of the pitch below which roll and yaw are one and the same."""


class HammerState(HandState):
    """A hand, a hammer and a nail."""

    xquat: np.ndarray
    sensordata: np.ndarray


class Hammering(Manipulation):
    """Drive a nail in; the board with the nail hangs at another height every time."""

    fields = (*Manipulation.fields, "xquat", "sensordata")
    state_class = HammerState
    observation_size = 46

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up hammer, head, nail and goal; see ``Task.bind``."""
        super().bind(model)
        self._hammer, self._head = model.body("Object").id, model.site("tool").id
        self._nail, self._goal = model.site("S_target").id, model.site("nail_goal").id
        self._touch = model.sensor("S_nail").adr[0]

    def observe(self, robot: HammerState) -> np.ndarray:
        """Return joints and nail (27), the hammer's speed (6), four places and the blow, (n, 46).

        The places are palm, hammer, the hammer's angles [rad], and nail. The speed and the force
        on the nail's head are clipped to +-1.
        """
        speed = np.clip(robot.qvel[:, -6:], -1.0, 1.0)
        palm, hammer, nail = self._places(robot)
        turned = angles(robot.xquat[:, self._hammer])
        blow = np.clip(robot.sensordata[:, [self._touch]], -1.0, 1.0)
        return np.concatenate([robot.qpos[:, :-6], speed, palm, hammer, turned, nail, blow], axis=1)

    def _places(self, robot: HandState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where palm, hammer and nail are, (n, 3) each [m]."""
        return robot.site(self.palm), robot.body(self._hammer), robot.site(self._nail)

    def _left(self, robot: HandState) -> np.ndarray:
        """Return how far the nail still stands out, (n,) [m]."""
        return distance(robot.site(self._nail), robot.site(self._goal))

    def success(self, robot: HandState) -> np.ndarray:
        """Return where the nail is within 0.010 m of its place, (n,) bool."""
        return self._left(robot) < DRIVEN

    def bonuses(self, robot: HandState) -> np.ndarray:
        """Return 2 when lifted, 25 below 0.02 m, 75 more below 0.01 m, less 10 |nail - goal|."""
        left = self._left(robot)
        height = np.minimum(robot.body(self._hammer)[:, 2], robot.site(self._head)[:, 2])
        driven = (left < ALMOST) * ALMOST_BONUS + (left < DRIVEN) * DRIVEN_BONUS
        return (height > LIFTED) * LIFT_BONUS + driven - NAIL_COST * left

    def costs(self, robot: HandState) -> np.ndarray:
        """Return 0.1 |palm - hammer| + |head - nail| + 0.01 |qvel|, (n,)."""
        palm, hammer, nail = self._places(robot)
        speed = np.linalg.norm(robot.qvel, axis=1)
        aside = HEAD_COST * distance(robot.site(self._head), nail)
        return PALM_COST * distance(palm, hammer) + aside + SPEED_COST * speed

    def scene(self, model: mujoco.MjModel, rng: np.random.Generator) -> np.ndarray:
        """Draw the height of the board; see ``Task.scene``."""
        place = model.body("nail_board").pos.copy()
        place[2] = rng.uniform(*BOARD_HEIGHT)
        return scene_with(model, "nail_board", place)


def angles(quat: np.ndarray) -> np.ndarray:
    """Return roll, pitch and yaw [rad] of unit quaternions (w, x, y, z), (n, 4) -> (n, 3).

    With R = Rx(roll) Ry(pitch) Rz(yaw): pitch = asin R_02, roll = atan2(-R_12, R_22) and
    yaw = atan2(-R_01, R_00), written with two arguments each; where the pitch is +-90 degrees
    the roll is taken as 0. gymnasium-robotics observes the hammer so.

    Example:
        >>> angles(np.array([[np.cos(0.25), 0, 0, np.sin(0.25)]])).round(3) + 0.0
        array([[0. , 0. , 0.5]])
    """
    w, x, y, z = quat.T
    r00, r01 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z)
    r10, r11 = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z)
    r02, r12 = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x)
    r22 = 1.0 - 2.0 * (x * x + y * y)
    level = np.hypot(r22, r12)
    regular = level > _LEVEL
    roll = np.where(regular, -np.arctan2(r12, r22), 0.0)
    yaw = np.where(regular, -np.arctan2(r01, r00), np.arctan2(r10, r11))
    return np.stack([roll, np.arctan2(r02, level), yaw], axis=1)
