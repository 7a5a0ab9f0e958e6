"""What the tasks of a hand share: three rewards, a goal to hold, and 200 steps to do it in."""

from abc import abstractmethod

import mujoco
import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.tasks.base import State, Task

REWARDS = ("sparse", "staged", "dense")


class HandState(State):
    """A hand in its scene; sites and bodies are found by the ids that the task looked up."""

    site_xpos: np.ndarray
    xpos: np.ndarray

    def site(self, site: int) -> np.ndarray:
        """Where a site is, (n, 3) [m]."""
        return self.site_xpos[:, site]

    def body(self, body: int) -> np.ndarray:
        """Where a body is, (n, 3) [m]."""
        return self.xpos[:, body]


class Manipulation(Task[HandState]):
    """A hand has to bring something about, and keep it so.

    The observation, the actions, the length of a step and the starts are those of
    gymnasium-robotics' AdroitHand environments, version 1: places are those before the last of
    a step's five substeps. What differs from one episode to the next is the place of a mocap
    body (``scene``) or of an object (``initial_state``).

    The rewards are our own (facts, section 2):

    - "sparse": 1 for every step in which the goal holds. Nothing else.
    - "staged": bonuses for progress, and what the paper's authors call sparse.
    - "dense": the same, less what the hand is still away from its object. gymnasium-robotics
      1.4.2 *adds* the distance of the palm, a sign error mended in its version 2.

    Args:
        reward: One of these.

    Raises:
        SettingsError: If it is none of these.
    """

    fields = ("qpos", "qvel", "site_xpos", "xpos")
    state_class = HandState
    episode_steps = 200
    goal_steps = 25
    palm = 0

    def __init__(self, reward: str = "sparse"):
        if reward not in REWARDS:
            raise SettingsError(f"reward = {reward!r}", f"one of {REWARDS}", "Choose one.")
        self.kind = reward

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up the palm; see ``Task.bind``."""
        super().bind(model)
        self.palm = model.site("S_grasp").id

    @abstractmethod
    def success(self, robot: HandState) -> np.ndarray:
        """Return where the goal holds, (n,) bool."""

    @abstractmethod
    def bonuses(self, robot: HandState) -> np.ndarray:
        """Return what progress is worth, (n,)."""

    @abstractmethod
    def costs(self, robot: HandState) -> np.ndarray:
        """Return what the dense reward takes off for being away, (n,), >= 0."""

    def reward(self, robot: HandState, before: np.ndarray | None) -> np.ndarray:
        """Return the sparse, staged or dense reward, (n,); see the class."""
        if self.kind == "sparse":
            return self.success(robot).astype(float)
        if self.kind == "staged":
            return self.bonuses(robot)
        return self.bonuses(robot) - self.costs(robot)

    def initial_state(
        self, model: mujoco.MjModel, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the reference pose at rest; what is drawn is the ``scene``."""
        return model.qpos0.copy(), np.zeros(model.nv)


def scene_with(model: mujoco.MjModel, body: str, place: np.ndarray) -> np.ndarray:
    """Return the places of all mocap bodies, (nmocap, 3) [m], with one of them moved.

    Args:
        model: The robot.
        body: Name of a mocap body.
        place: Where to put it, (3,) [m].
    """
    mocap = model.body_mocapid
    places = model.body_pos[[int(np.flatnonzero(mocap == i)[0]) for i in range(model.nmocap)]]
    places[model.body(body).mocapid[0]] = place
    return places


def distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return |a - b|, (n,), of points (n, 3) [m].

    Example:
        >>> distance(np.zeros((1, 3)), np.array([[3.0, 4.0, 0.0]]))
        array([5.])
    """
    apart = a - b
    return np.sqrt((apart * apart).sum(axis=1))
