"""Carries states and policies of an unpadded robot over to the padded one, by inserting zeros."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.keyframes import act_index, ctrl_index, qpos_index, qvel_index


@dataclass(frozen=True, kw_only=True)
class Lift:
    """Where the numbers of a robot are in its padded twin.

    Attributes:
        qpos: Place of each position of the robot, (nq,).
        qvel: Place of each velocity, (nv,).
        ctrl: Place of each control, (nu,).
        act: Place of each activation, (na,).
        qpos0: Reference positions of the padded robot, its nq.
        nv: Velocities of the padded robot.
        nu: Controls of the padded robot.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray
    act: np.ndarray
    qpos0: np.ndarray
    nv: int
    nu: int

    def state(self, qpos: np.ndarray, qvel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The padded robot's qpos and qvel where its own part is given and the rest at rest."""
        whole = self.qpos0.copy()
        whole[self.qpos] = qpos
        return whole, insert_zeros(qvel, self.qvel, self.nv)

    def control(self, ctrl: np.ndarray) -> np.ndarray:
        """The padded robot's controls, (..., nu), zero for what was created."""
        return insert_zeros(ctrl, self.ctrl, self.nu)


def lift(robot: mujoco.MjModel, padded: mujoco.MjModel) -> Lift:
    """Find the places of a robot's numbers in its padded twin, by its joints' and actuators' names.

    Args:
        robot: The robot as it was.
        padded: The same robot with joints and actuators created.

    Raises:
        MatchingError: If the padded robot lacks a joint or actuator of the robot.
    """
    try:
        return Lift(
            qpos=qpos_index(robot, padded),
            qvel=qvel_index(robot, padded),
            ctrl=ctrl_index(robot, padded),
            act=act_index(robot, padded),
            qpos0=padded.qpos0.copy(),
            nv=padded.nv,
            nu=padded.nu,
        )
    except KeyError as error:
        raise MatchingError(
            f"a padded robot without one of the robot's own names ({error.args[0]})",
            "the padded twin of the same robot",
            "Lift from the robot that was padded.",
        ) from error


def insert_zeros(
    values: np.ndarray, places: Sequence[int] | np.ndarray, size: int, axis: int = -1
) -> np.ndarray:
    """Spread one axis of an array over a longer one, with zeros in between.

    On the observation axis of a first layer's weights, and on the action axis of a last layer's,
    this lifts a policy: what was created is not looked at and not moved.

    Args:
        values: Any array.
        places: Where each entry along the axis goes.
        size: New length of the axis.
        axis: The axis.

    Returns:
        The longer array.

    Raises:
        MatchingError: If places and axis differ in length, or a place is taken twice or outside.

    Example:
        >>> insert_zeros(np.array([[1, 2], [3, 4]]), [0, 2], 3)
        array([[1, 0, 2],
               [3, 0, 4]])
    """
    values, index = np.asarray(values), np.asarray(places, dtype=int)
    fits = len(index) == values.shape[axis] and len(set(index.tolist())) == len(index)
    if not fits or (len(index) and not 0 <= index.min() <= index.max() < size):
        raise MatchingError(
            f"{len(index)} places for an axis of {values.shape[axis]} to be spread over {size}",
            f"one place in 0..{size - 1} for each entry, none twice",
            "Take the places from the Lift of these two robots.",
        )
    moved = np.moveaxis(values, axis, -1)
    spread = np.zeros((*moved.shape[:-1], size), dtype=values.dtype)
    spread[..., index] = moved
    return np.moveaxis(spread, -1, axis)
