"""A camera for robots that have none: near enough to see everything, far enough to keep it."""

import mujoco
import numpy as np

from revolver_lab.errors import SettingsError

_ROOM = 1.3
"""Distance of the camera, times what would just hold the standing robot."""
_SIDE = (90.0, -8.0)
_QUARTER = (130.0, -18.0)
"""Azimuth and elevation [degrees]: from the side, and three quarters from the front."""
_STRAIGHT = 0.99
"""An axis counts as along y above this cosine."""
_LARGEST = 4096
"""Longest side of a picture [pixels]."""


def fitted(
    model: mujoco.MjModel, box: np.ndarray, size: tuple[int, int], moved: np.ndarray
) -> mujoco.MjvCamera:
    """A camera that shows a box, and goes along when the robot travels.

    Planar robots are seen from the side, others three quarters from the front.

    Args:
        model: The robot.
        box: Low and high corner of the standing robot, (2, 3) [m].
        size: Width and height of the picture [pixels].
        moved: How far the robot is from where it stood, (3,) [m]; its height is not followed.

    Returns:
        A free camera.
    """
    azimuth, elevation = _SIDE if planar(model) else _QUARTER
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation = azimuth, elevation
    slope = np.tan(np.deg2rad(model.vis.global_.fovy) / 2)
    camera.distance = _ROOM * _distance(np.ptp(box, axis=0) / 2, (azimuth, elevation), slope, size)
    camera.lookat = box.mean(axis=0) + moved * (1, 1, 0)
    return camera


def planar(model: mujoco.MjModel) -> bool:
    """Whether every joint keeps the robot in its x-z plane.

    Example:
        >>> body = "<mujoco><worldbody><body><joint axis='{}'/><geom size='.1'/></body>"
        >>> axes = "0 1 0", "0 0 1"
        >>> robots = [body.format(axis) + "</worldbody></mujoco>" for axis in axes]
        >>> [planar(mujoco.MjModel.from_xml_string(robot)) for robot in robots]
        [True, False]
    """
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE.value, mujoco.mjtJoint.mjJNT_HINGE.value
    kinds, across = model.jnt_type, np.abs(model.jnt_axis[:, 1])
    turns = (kinds == hinge) & (across > _STRAIGHT)
    slides = (kinds == slide) & (across < 1 - _STRAIGHT)
    return bool((turns | slides).all()) and model.njnt > 0


def _distance(
    half: np.ndarray, angles: tuple[float, float], slope: float, size: tuple[int, int]
) -> float:
    """How far away [m] a box of these half extents, (3,), just fits into the picture."""
    azimuth, elevation = np.deg2rad(angles)
    forward = np.array([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)])
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, forward), -forward])
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    across, up, near = axes @ (signs * half).T
    width, height = size
    return float((np.maximum(np.abs(up), np.abs(across) * height / width) / slope + near).max())


def checked_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of a picture [pixels], if it can be drawn.

    Raises:
        SettingsError: If it cannot.
    """
    for side in (width, height):
        if not isinstance(side, int) or not 16 <= side <= _LARGEST:
            raise SettingsError(
                f"a picture of {width!r} x {height!r}",
                f"whole numbers from 16 to {_LARGEST}",
                "Try 480 x 360.",
            )
    return width, height
