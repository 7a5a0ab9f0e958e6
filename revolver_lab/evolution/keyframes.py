"""Extends a robot's keyframes to joints and actuators that were added to it."""

import mujoco
import numpy as np


def stash_keyframes(spec: mujoco.MjSpec) -> list[dict[str, np.ndarray]]:
    """The arrays of every keyframe, which is emptied so that the robot compiles at any size."""
    stash = []
    for key in spec.keys:
        arrays = {name: np.array(list(getattr(key, name))) for name in _FIELDS}
        for name in _FIELDS:
            setattr(key, name, [])
        stash.append(arrays)
    return stash


_FIELDS = ("qpos", "qvel", "act", "ctrl", "mpos", "mquat")


def extend_keyframes(spec: mujoco.MjSpec, before: mujoco.MjModel) -> None:
    """Rewrite every keyframe for the robot as it is now; what is new rests at its reference.

    Args:
        spec: The robot with elements added, changed in place.
        before: The robot before, compiled, with the same keyframes.
    """
    stash = stash_keyframes(spec)
    if not stash:
        return
    after = spec.compile()
    for key, old in zip(spec.keys, stash):
        data = mujoco.MjData(after)
        if len(old["qpos"]):
            key.qpos = _scattered(data.qpos, old["qpos"], qpos_index(before, after))
        if len(old["qvel"]):
            key.qvel = _scattered(data.qvel, old["qvel"], qvel_index(before, after))
        if len(old["ctrl"]):
            key.ctrl = _scattered(data.ctrl, old["ctrl"], ctrl_index(before, after))
        if len(old["act"]):
            key.act = _scattered(data.act, old["act"], act_index(before, after))
        if len(old["mpos"]) == 3 * after.nmocap:
            key.mpos, key.mquat = list(old["mpos"]), list(old["mquat"])


def _scattered(base: np.ndarray, values: np.ndarray, index: np.ndarray) -> list[float]:
    """The values at their new places, the rest as in `base`."""
    base = np.array(base)
    base[index] = values
    return list(base)


def qpos_index(before: mujoco.MjModel, after: mujoco.MjModel) -> np.ndarray:
    """Place in `after` of each entry of qpos in `before`, by the joints' names, (nq,)."""
    widths = {0: 7, 1: 4, 2: 1, 3: 1}
    return _joint_index(before, after, "jnt_qposadr", widths)


def qvel_index(before: mujoco.MjModel, after: mujoco.MjModel) -> np.ndarray:
    """Place in `after` of each entry of qvel in `before`, by the joints' names, (nv,)."""
    return _joint_index(before, after, "jnt_dofadr", {0: 6, 1: 3, 2: 1, 3: 1})


def _joint_index(
    before: mujoco.MjModel, after: mujoco.MjModel, address: str, widths: dict[int, int]
) -> np.ndarray:
    """Places of the entries of every joint."""
    index = []
    for i in range(before.njnt):
        twin = after.joint(before.joint(i).name).id
        first = int(getattr(after, address)[twin])
        index += range(first, first + widths[int(before.jnt_type[i])])
    return np.array(index, dtype=int)


def ctrl_index(before: mujoco.MjModel, after: mujoco.MjModel) -> np.ndarray:
    """Place in `after` of each entry of ctrl in `before`, by the actuators' names, (nu,)."""
    return _actuator_index(before, after, "actuator_ctrladr", "actuator_ctrlnum")


def act_index(before: mujoco.MjModel, after: mujoco.MjModel) -> np.ndarray:
    """Place in `after` of each activation in `before`, by the actuators' names, (na,)."""
    return _actuator_index(before, after, "actuator_actadr", "actuator_actnum")


def _actuator_index(
    before: mujoco.MjModel, after: mujoco.MjModel, address: str, number: str
) -> np.ndarray:
    """Places of the entries of every actuator; one each where the model has no such table."""
    index: list[int] = []
    for i in range(len(before.actuator_trntype)):
        twin = after.actuator(before.actuator(i).name).id
        first = int(getattr(after, address)[twin]) if hasattr(after, address) else twin
        count = int(getattr(before, number)[i]) if hasattr(before, number) else 1
        index += range(first, first + count) if first >= 0 else ()
    return np.array(index, dtype=int)
