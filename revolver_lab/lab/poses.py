"""How a robot stands for its picture: a legal pose, lowered or lifted onto the floor."""

import mujoco
import numpy as np

_GEOM = mujoco.mjtGeom
_FREE, _SLIDE = mujoco.mjtJoint.mjJNT_FREE.value, mujoco.mjtJoint.mjJNT_SLIDE.value
_FLAT = 0.99
"""A plane or axis counts as horizontal or vertical above this cosine."""


def standing(model: mujoco.MjModel) -> np.ndarray:
    """Pose to show a robot in, with its lowest point on the floor.

    The pose is the keyframe "home" or "stand" where there is one, else the reference pose; joints
    outside their range are moved to its edge. A robot that is fixed to the world, or guided by it
    along a slide with limits, is left where it is.

    Args:
        model: Any robot; not changed.

    Returns:
        qpos, (nq,).

    Example:
        >>> ball = "<mujoco><worldbody><body pos='0 0 3'><freejoint/><geom size='.2'/></body>"
        >>> model = mujoco.MjModel.from_xml_string(ball + "</worldbody></mujoco>")
        >>> round(float(standing(model)[2]), 9)
        0.2
    """
    qpos = _legal_pose(model)
    lift = _vertical_coordinate(model)
    if lift is not None:
        data = mujoco.MjData(model)
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        address, direction = lift
        qpos[address] -= direction * (box(model, data)[0][2] - floor_height(model))
    return qpos


def robot_geoms(model: mujoco.MjModel) -> np.ndarray:
    """Ids of the visible geoms of the robot, which is every body but the world, (n,)."""
    shown = (model.geom_group <= 2) & (model.geom_type != _GEOM.mjGEOM_PLANE)
    return np.flatnonzero((model.geom_bodyid > 0) & shown)


def box(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corner of the robot, (3,) each [m], after mj_kinematics; zeros if it has none.

    Example:
        >>> rod = "<mujoco><worldbody><body><geom type='capsule' size='.1 .4'/></body>"
        >>> model = mujoco.MjModel.from_xml_string(rod + "</worldbody></mujoco>")
        >>> data = mujoco.MjData(model)
        >>> mujoco.mj_kinematics(model, data)
        >>> box(model, data)[1]
        array([0.1, 0.1, 0.5])
    """
    corners = [_box(model, data, geom) for geom in robot_geoms(model)]
    if not corners:
        return np.zeros(3), np.zeros(3)
    low, high = zip(*corners, strict=True)
    return np.min(low, axis=0), np.max(high, axis=0)


def floor_height(model: mujoco.MjModel) -> float:
    """Height of the highest horizontal plane of the world [m]; 0 where there is none."""
    planes = floors(model)
    return float(model.geom_pos[planes, 2].max()) if planes.size else 0.0


def floors(model: mujoco.MjModel) -> np.ndarray:
    """Ids of the horizontal planes that are fixed to the world, (n,)."""
    fixed = (model.geom_bodyid == 0) & (model.geom_type == _GEOM.mjGEOM_PLANE)
    w, x, y, z = model.geom_quat.T
    return np.flatnonzero(fixed & (w * w - x * x - y * y + z * z > _FLAT))


def _legal_pose(model: mujoco.MjModel) -> np.ndarray:
    """Keyframe or reference pose, every limited joint inside its range."""
    names = [model.key(key).name for key in range(model.nkey)]
    key = next((names.index(name) for name in ("home", "stand") if name in names), None)
    qpos = (model.qpos0 if key is None else model.key_qpos[key]).copy()
    scalar = model.jnt_limited.astype(bool) & (model.jnt_type >= _SLIDE)
    where = model.jnt_qposadr[scalar]
    qpos[where] = np.clip(qpos[where], *model.jnt_range[scalar].T)
    return qpos


def _vertical_coordinate(model: mujoco.MjModel) -> tuple[int, float] | None:
    """qpos address and sign (+1, -1) of what lifts the whole robot; None if it is fixed."""
    if model.nbody < 2:
        return None
    roots = model.body_rootid
    root = int(np.argmax(np.bincount(roots[1:], minlength=model.nbody)))
    first = model.body_jntadr[root]
    for joint in range(first, first + model.body_jntnum[root]):
        kind, address = model.jnt_type[joint], int(model.jnt_qposadr[joint])
        if kind == _FREE:
            return address + 2, 1.0
        upright = abs(model.jnt_axis[joint, 2]) > _FLAT and not model.jnt_limited[joint]
        if kind == _SLIDE and upright:
            return address, float(np.sign(model.jnt_axis[joint, 2]))
    return None


def _box(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corner of one geom, (3,) each [m], from the support function of its shape."""
    turn, place = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
    kind, mesh = model.geom_type[geom], model.geom_dataid[geom]
    if kind == _GEOM.mjGEOM_MESH and mesh >= 0:
        first = model.mesh_vertadr[mesh]
        points = model.mesh_vert[first : first + model.mesh_vertnum[mesh]] @ turn.T
        return place + points.min(axis=0), place + points.max(axis=0)
    half = _half_extents(kind, model.geom_size[geom], turn)
    return place - half, place + half


def _half_extents(kind: int, size: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """How far a primitive reaches along each world axis, (3,) [m]; `turn` is its (3, 3) frame."""
    along = np.abs(turn[:, 2])
    if kind == _GEOM.mjGEOM_SPHERE:
        return np.full(3, size[0])
    if kind == _GEOM.mjGEOM_CAPSULE:
        return size[0] + along * size[1]
    if kind == _GEOM.mjGEOM_CYLINDER:
        return size[0] * np.sqrt(np.maximum(1 - along**2, 0)) + along * size[1]
    if kind == _GEOM.mjGEOM_ELLIPSOID:
        return np.linalg.norm(turn * size, axis=1)
    return np.abs(turn) @ size
