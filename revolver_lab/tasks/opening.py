"""The hand's door: turn the latch and pull the door open."""

import mujoco
import numpy as np

from revolver_lab.tasks.manipulation import HandState, Manipulation, distance, scene_with

OPEN = 1.35
"""Angle of the hinge from which on the door is open [rad]."""
#        angle beyond which a bonus is paid [rad]: bonus
BONUSES = {0.2: 2.0, 1.0: 8.0, OPEN: 10.0}
_ANGLES, _PAID = np.array([*BONUSES]), np.cumsum([0.0, *BONUSES.values()])
HINGE_END = 1.57  # [rad]
HINGE_COST, PALM_COST, SPEED_COST = 0.1, 0.1, 1e-5
AJAR = 1.0
"""Angle beyond which the last observed number is 1 instead of -1 [rad]."""
FRAME = ((-0.3, -0.2), (0.25, 0.35), (0.252, 0.35))
"""Box in which the door's frame stands [m]."""


class Opening(Manipulation):
    """Open a door that is latched, and hold it open; its frame stands elsewhere every time."""

    observation_size = 39

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up hinge and handle; see ``Task.bind``."""
        super().bind(model)
        self._hinge = int(model.joint("door_hinge").qposadr[0])
        self._handle = model.site("S_handle").id

    def hinge(self, robot: HandState) -> np.ndarray:
        """Return how far the door is open, (n,) [rad]."""
        return robot.qpos[:, self._hinge]

    def observe(self, robot: HandState) -> np.ndarray:
        """Return joints (27), latch, hinge, palm, handle, their difference, and +-1, (n, 39)."""
        hinge, palm, handle = self.hinge(robot), robot.site(self.palm), robot.site(self._handle)
        ajar = np.where(hinge > AJAR, 1.0, -1.0)
        angles = [robot.qpos[:, 1:-2], robot.qpos[:, -1:], hinge[:, None]]
        return np.concatenate([*angles, palm, handle, palm - handle, ajar[:, None]], axis=1)

    def success(self, robot: HandState) -> np.ndarray:
        """Return where the hinge is open by at least 1.35 rad, (n,) bool."""
        return self.hinge(robot) >= OPEN

    def bonuses(self, robot: HandState) -> np.ndarray:
        """Return 2 beyond 0.2 rad, 8 more beyond 1.0 rad, 10 more beyond 1.35 rad, (n,)."""
        return _PAID[_ANGLES.searchsorted(self.hinge(robot))]  # how many it is beyond

    def costs(self, robot: HandState) -> np.ndarray:
        """Return 0.1 |palm - handle| + 0.1 (hinge - 1.57)^2 + 1e-5 |qvel|^2, (n,)."""
        away = distance(robot.site(self.palm), robot.site(self._handle))
        closed = np.square(self.hinge(robot) - HINGE_END)
        speed = np.square(robot.qvel).sum(axis=1)
        return PALM_COST * away + HINGE_COST * closed + SPEED_COST * speed

    def scene(self, model: mujoco.MjModel, rng: np.random.Generator) -> np.ndarray:
        """Draw where the frame stands; see ``Task.scene``."""
        return scene_with(model, "frame", rng.uniform(*np.transpose(FRAME)))
