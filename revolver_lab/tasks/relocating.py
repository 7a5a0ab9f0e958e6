"""The hand's ball: pick it up and hold it where a green one floats."""

import mujoco
import numpy as np

from revolver_lab.tasks.manipulation import HandState, Manipulation, distance, scene_with

NEAR, VERY_NEAR = 0.1, 0.05
"""Distances of the ball from its target that are paid [m]; the first is the goal."""
LIFTED = 0.04
"""Height above which the ball has left the table [m]."""
LIFT_BONUS, NEAR_BONUS, VERY_NEAR_BONUS = 1.0, 10.0, 20.0
PALM_COST, CARRY_COST = 0.1, 0.5
BALL = ((-0.15, 0.15), (-0.15, 0.3))
TARGET = ((-0.2, 0.2), (-0.2, 0.2), (0.15, 0.35))
"""Where the ball starts on the table, and where it is to be [m]."""


class Relocating(Manipulation):
    """Bring a ball to a place in the air; both places differ every time."""

    observation_size = 39

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up ball and target; see ``Task.bind``."""
        super().bind(model)
        self._ball, self._target = model.body("Object").id, model.site("target").id

    def observe(self, robot: HandState) -> np.ndarray:
        """Return joints (30), palm - ball, palm - target, ball - target, (n, 39)."""
        palm, ball, target = self._places(robot)
        joints = robot.qpos[:, :-6]
        return np.concatenate([joints, palm - ball, palm - target, ball - target], axis=1)

    def _places(self, robot: HandState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where palm, ball and target are, (n, 3) each [m]."""
        return robot.site(self.palm), robot.body(self._ball), robot.site(self._target)

    def _left(self, robot: HandState) -> np.ndarray:
        """Return how far the ball still is from its target, (n,) [m]."""
        return distance(robot.body(self._ball), robot.site(self._target))

    def _lifted(self, robot: HandState) -> np.ndarray:
        """Return where the ball is off the table, (n,) bool."""
        return robot.body(self._ball)[:, 2] > LIFTED

    def success(self, robot: HandState) -> np.ndarray:
        """Return where the ball is within 0.1 m of its target, (n,) bool."""
        return self._left(robot) < NEAR

    def bonuses(self, robot: HandState) -> np.ndarray:
        """Return 1 when lifted, 10 within 0.1 m, 20 more within 0.05 m, (n,)."""
        left = self._left(robot)
        near, very_near = (left < NEAR) * NEAR_BONUS, (left < VERY_NEAR) * VERY_NEAR_BONUS
        return self._lifted(robot) * LIFT_BONUS + near + very_near

    def costs(self, robot: HandState) -> np.ndarray:
        """Return 0.1 |palm - ball|, and when lifted 0.5 (|palm - target| + |ball - target|), (n,).

        As published, the second part is only paid in the air, where the bonus for lifting
        outweighs it.
        """
        palm, ball, target = self._places(robot)
        carrying = CARRY_COST * (distance(palm, target) + distance(ball, target))
        return PALM_COST * distance(palm, ball) + self._lifted(robot) * carrying

    def scene(self, model: mujoco.MjModel, rng: np.random.Generator) -> np.ndarray:
        """Draw where the target is; see ``Task.scene``."""
        return scene_with(model, "goal", rng.uniform(*np.transpose(TARGET)))

    def initial_state(
        self, model: mujoco.MjModel, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw where on the table the ball lies; the hand is at its reference pose, at rest."""
        qpos, qvel = super().initial_state(model, rng)
        slide = model.joint("OBJTx").qposadr[0]
        qpos[slide : slide + 2] = rng.uniform(*np.transpose(BALL)) - model.body("Object").pos[:2]
        return qpos, qvel
