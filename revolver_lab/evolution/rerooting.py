"""Roots a floating robot at another of its bodies, so that it moves as before."""

import mujoco
import numpy as np

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.canonical import canonical
from revolver_lab.evolution.copying import add_body, add_to_body
from revolver_lab.evolution.keyframes import restore_keyframes, stash_keyframes
from revolver_lab.evolution.rebuilding import (
    add_dependants,
    add_held,
    add_joints,
    of_subtrees,
    same_name,
)
from revolver_lab.evolution.rerooted_state import reroot_state, rotated, unit

_FREE, _BALL = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL
_QUAT = mujoco.mjtOrientation.mjORIENTATION_QUAT


def reroot(spec: mujoco.MjSpec, body_name: str) -> mujoco.MjSpec:
    """The same floating robot, with its free joint at another body.

    Every body keeps its own frame and what it holds. Along the path from the old root to the
    new one each joint passes to the body that used to be the parent. With T the pose of the
    child in the parent and J(q) the joint's motion, the child sat at T J1(q1) ... Jn(qn) in the
    parent; so the parent sits at T^-1 (T Jn^-1 T^-1) ... (T J1^-1 T^-1) in the child: the joints
    come in reverse, at the same places, about the opposite axes. So q, its limits and its motor
    keep their meaning, and the robot moves as before under the same controls.

    Accelerations agree to rounding (tested: 1e-12 relative, any velocity, springs, dampers and
    motors on; with contact at rest). In contact at speed MuJoCo leaves out dJ/dt v, which depends
    on the coordinates, so trajectories part slowly: 0.1 s with a floor stay within 5 mm.

    Damping, stiffness or armature of the free joint itself act at the new root. Of sensors of a
    subtree, those of the old root (the whole robot) follow the root. MuJoCo has no rotation after
    a ball joint in one body, so a ball that shares its body with another joint cannot turn round.

    Args:
        spec: A robot in which everything has a name; it is left as it was.
        body_name: The new root, a body of a tree with a free joint.

    Returns:
        The re-rooted robot in canonical form, with the same names and keyframes.

    Raises:
        MatchingError: If the body does not float, or an actuator drives a ball joint on the way.
    """
    donor = canonical(spec)
    path = _path(donor, body_name)
    if len(path) == 1:
        return donor
    _refuse_driven_balls(donor, path)
    before = donor.compile()
    host = donor.copy()
    stash = stash_keyframes(host)
    host.delete(host.body(path[0]))
    _hang_root(host, donor, before, path)
    add_dependants(host, donor)
    for sensor in host.sensors:
        for name in of_subtrees(sensor):
            if getattr(sensor, name) == path[0]:
                setattr(sensor, name, body_name)
    after = _compiled(host, body_name)
    restore_keyframes(host, stash, lambda state: _state(before, after, state))
    return host


def _compiled(spec: mujoco.MjSpec, body_name: str) -> mujoco.MjModel:
    """Compile the re-rooted robot; its joints may come in an order that MuJoCo does not take."""
    try:
        return spec.compile()
    except ValueError as error:
        raise MatchingError(
            f"the root {body_name!r}, with which MuJoCo says: {' '.join(str(error).split())}",
            "a root such that no ball joint is followed by another in its body",
            "Choose another root, or write the ball joint as three hinges.",
        ) from error


def _path(spec: mujoco.MjSpec, body_name: str) -> list[str]:
    """Bodies from the root with the free joint down to a body."""
    path, body = [], spec.body(body_name)
    while body is not None and body.name != "world":
        path.insert(0, body.name)
        if any(joint.type == _FREE for joint in body.joints):
            return path
        body = body.parent
    raise MatchingError(
        f"the body {body_name!r} as a root",
        "a body of a robot that floats by a free joint",
        "Leave the root out, or name another body.",
    )


def _refuse_driven_balls(spec: mujoco.MjSpec, path: list[str]) -> None:
    """Refuse to turn round a ball joint with an actuator, whose gear has no counterpart."""
    balls = {j.name for name in path[1:] for j in spec.body(name).joints if j.type == _BALL}
    for actuator in spec.actuators:
        if actuator.target in balls:
            raise MatchingError(
                f"the actuator {actuator.name!r} on the ball joint {actuator.target!r}",
                "ball joints without actuators between the two roots",
                "Write the ball joint as three hinges, or choose another root.",
            )


def _hang_root(
    host: mujoco.MjSpec, donor: mujoco.MjSpec, before: mujoco.MjModel, path: list[str]
) -> None:
    """Build the tree anew from its new root."""
    new, old = donor.body(path[-1]), donor.body(path[0])
    root = add_body(host.worldbody, new, new.name)
    data = mujoco.MjData(before)
    mujoco.mj_kinematics(before, data)
    _place(root, data.body(new.name).xpos, data.body(new.name).xquat)
    free = next(joint for joint in old.joints if joint.type == _FREE)
    copy = add_to_body(root, "joint", free, free.name, same_name)
    copy.align = mujoco.mjtAlignFree.mjALIGNFREE_FALSE
    _fill(root, donor, new.name, path)


def _fill(here: mujoco.MjsBody, donor: mujoco.MjSpec, name: str, path: list[str]) -> None:
    """Give a body its shapes and its children; on the path the old parent is a child."""
    body = donor.body(name)
    add_held(here, body)
    if name in path and path.index(name) > 0:
        _hang_parent(here, donor, body, path)
    for child in body.bodies:
        if child.name not in path:
            copy = add_body(here, child, child.name)
            add_joints(copy, child)
            _fill(copy, donor, child.name, path)


def _hang_parent(
    here: mujoco.MjsBody, donor: mujoco.MjSpec, body: mujoco.MjsBody, path: list[str]
) -> None:
    """Hang a body's parent below it, with the joints between the two turned round."""
    parent = body.parent
    pos, quat = np.array(body.pos), unit(body.quat)
    back_pos, back_quat = np.empty(3), np.empty(4)
    mujoco.mju_negPose(back_pos, back_quat, pos, quat)
    copy = add_body(here, parent, parent.name)
    _place(copy, back_pos, back_quat)
    for joint in reversed(body.joints):
        turned = add_to_body(copy, "joint", joint, joint.name, same_name)
        turned.pos = pos + rotated(joint.pos, quat)
        turned.axis = -rotated(joint.axis, quat)
    _fill(copy, donor, parent.name, path)


def _place(body: mujoco.MjsBody, pos: np.ndarray, quat: np.ndarray) -> None:
    """Set a body's frame."""
    body.pos, body.quat, body.alt.type = pos, quat, _QUAT


def _state(
    before: mujoco.MjModel, after: mujoco.MjModel, state: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """A keyframe's arrays for the re-rooted robot; controls and activations stay as they are."""
    qpos = state["qpos"] if len(state["qpos"]) else before.qpos0
    qvel = state["qvel"] if len(state["qvel"]) else np.zeros(before.nv)
    qpos, qvel = reroot_state(before, after, qpos, qvel)
    return state | {"qpos": qpos, "qvel": qvel}
