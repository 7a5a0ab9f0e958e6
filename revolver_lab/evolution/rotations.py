"""Rotations between two frames or two axes, as the rotation vectors that theta holds."""

import mujoco
import numpy as np


def between_frames(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Rotation vector, in the source's frame, that carries it to the target's.

    Args:
        source: Unit quaternion (w, x, y, z), (4,).
        target: The same for the target.

    Returns:
        Rotation vector [rad], (3,), of length at most pi.

    Example:
        >>> between_frames(np.array([1.0, 0, 0, 0]), np.array([0.0, 1.0, 0, 0])) / np.pi
        array([1., 0., 0.])
    """
    inverse, turn, vector = np.empty(4), np.empty(4), np.empty(3)
    mujoco.mju_negQuat(inverse, source)
    mujoco.mju_mulQuat(turn, inverse, target)
    mujoco.mju_quat2Vel(vector, turn, 1.0)
    return vector


def turned_frame(source: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """The source's quaternion turned by a rotation vector of its own frame, (4,).

    With vector = f between_frames(source, target) this is slerp(source, target, f).

    Example:
        >>> turned_frame(np.array([1.0, 0, 0, 0]), np.array([np.pi, 0, 0])).round(6)
        array([0., 1., 0., 0.])
    """
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return source
    turn, result = np.empty(4), np.empty(4)
    mujoco.mju_axisAngle2Quat(turn, vector / angle, angle)
    mujoco.mju_mulQuat(result, source, turn)
    return result


def between_axes(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Shortest rotation vector [rad], (3,), that carries one axis to the other.

    Opposite axes have no shortest arc; they turn about the coordinate axis furthest from both.

    Example:
        >>> between_axes(np.array([1.0, 0, 0]), np.array([0, 2.0, 0])) / np.pi
        array([0. , 0. , 0.5])
    """
    a, b = source / np.linalg.norm(source), target / np.linalg.norm(target)
    normal = np.cross(a, b)
    sine, cosine = float(np.linalg.norm(normal)), float(a @ b)
    if sine < 1e-12:
        if cosine > 0.0:
            return np.zeros(3)
        normal = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        sine = 0.0
    return normal / np.linalg.norm(normal) * np.arctan2(sine, cosine)


def turned_axis(source: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """The unit axis of the source, turned by a rotation vector, (3,).

    Example:
        >>> turned_axis(np.array([1.0, 0, 0]), np.array([0, 0, np.pi / 2])).round(6)
        array([0., 1., 0.])
    """
    angle = float(np.linalg.norm(vector))
    axis = source / np.linalg.norm(source)
    if angle == 0.0:
        return source
    turn, result = np.empty(4), np.empty(3)
    mujoco.mju_axisAngle2Quat(turn, vector / angle, angle)
    mujoco.mju_rotVecQuat(result, axis, turn)
    return result
