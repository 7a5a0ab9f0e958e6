"""The state in which a re-rooted robot is where the original is."""

from typing import Any

import mujoco
import numpy as np

_FREE, _BALL = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL


def reroot_state(
    before: mujoco.MjModel, after: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The state in which the re-rooted robot is where the original is, and moves as it does.

    Args:
        before: The original robot.
        after: The robot that `reroot` made of it, compiled.
        qpos: Positions of the original, (nq,).
        qvel: Velocities of the original, (nv,).

    Returns:
        qpos and qvel of the re-rooted robot.
    """
    data = mujoco.MjData(before)
    data.qpos[:], data.qvel[:] = qpos, qvel
    mujoco.mj_forward(before, data)
    new_qpos, new_qvel = after.qpos0.copy(), np.zeros(after.nv)
    for i in range(after.njnt):
        joint, twin = after.joint(i), before.joint(after.joint(i).name)
        owner, held = after.body(after.jnt_bodyid[i]).name, before.jnt_bodyid[twin.id]
        q, v = int(joint.qposadr[0]), int(joint.dofadr[0])
        old_q, old_v = int(twin.qposadr[0]), int(twin.dofadr[0])
        kind = int(after.jnt_type[i])
        if kind == _FREE:
            new_qpos[q : q + 7], new_qvel[v : v + 6] = _free_state(before, data, owner)
        elif kind == _BALL and before.body(held).name != owner:
            there = data.qpos[old_q : old_q + 4], data.qvel[old_v : old_v + 3]
            turned = _turned_ball(before.body_quat[held], *there)
            new_qpos[q : q + 4], new_qvel[v : v + 3] = turned
        else:
            width = 4 if kind == _BALL else 1
            new_qpos[q : q + width] = data.qpos[old_q : old_q + width]
            width = 3 if kind == _BALL else 1
            new_qvel[v : v + width] = data.qvel[old_v : old_v + width]
    return new_qpos, new_qvel


def _free_state(
    model: mujoco.MjModel, data: mujoco.MjData, body: str
) -> tuple[np.ndarray, np.ndarray]:
    """Pose (7,), and velocity (6,) as a free joint counts it, of any body."""
    found, velocity = data.body(body), np.empty(6)
    kind = mujoco.mjtObj.mjOBJ_XBODY
    mujoco.mj_objectVelocity(model, data, kind, found.id, velocity, 0)
    turning = found.xmat.reshape(3, 3).T @ velocity[:3]
    return np.concatenate([found.xpos, found.xquat]), np.concatenate([velocity[3:], turning])


def _turned_ball(
    frame: np.ndarray, quat: np.ndarray, velocity: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """State of a ball joint seen from its other side; `frame` is the child's in the parent."""
    inverse, back, half, turned = (np.empty(4) for _ in range(4))
    mujoco.mju_negQuat(inverse, unit(quat))
    mujoco.mju_negQuat(back, frame)
    mujoco.mju_mulQuat(half, frame, inverse)
    mujoco.mju_mulQuat(turned, half, back)
    return turned, -rotated(rotated(velocity, unit(quat)), frame)


def unit(quat: Any) -> np.ndarray:
    """A quaternion of length one, (4,)."""
    unit = np.array(quat, dtype=float)
    mujoco.mju_normalize4(unit)
    return unit


def rotated(vector: Any, quat: np.ndarray) -> np.ndarray:
    """A vector turned by a unit quaternion, (3,)."""
    out = np.empty(3)
    mujoco.mju_rotVecQuat(out, np.array(vector, dtype=float), quat)
    return out
