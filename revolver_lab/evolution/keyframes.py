"""Extends a robot's keyframes to joints and actuators that were added to it."""

from collections.abc import Callable

import mujoco
import numpy as np

_FIELDS = ("qpos", "qvel", "act", "ctrl", "mpos", "mquat")


def stash_keyframes(spec: mujoco.MjSpec) -> list[dict[str, np.ndarray]]:
    """The arrays of every keyframe, which is emptied so that the robot compiles at any size."""
    stash = []
    for key in spec.keys:
        arrays = {name: np.array(list(getattr(key, name))) for name in _FIELDS}
        for name in _FIELDS:
            setattr(key, name, [])
        stash.append(arrays)
    return stash


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
    indices = {
        "qpos": qpos_index(before, after),
        "qvel": qvel_index(before, after),
        "ctrl": ctrl_index(before, after),
        "act": act_index(before, after),
    }

    def extended(state: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """A keyframe's arrays for the larger robot."""
        data = mujoco.MjData(after)
        for name, index in indices.items():
            if len(state[name]):
                whole = np.array(getattr(data, name))
                whole[index] = state[name]
                state = state | {name: whole}
        return state

    restore_keyframes(spec, stash, extended)


def restore_keyframes(
    spec: mujoco.MjSpec,
    stash: list[dict[str, np.ndarray]],
    change: Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]],
) -> None:
    """Write back what `stash_keyframes` took, each keyframe's arrays changed by a function."""
    for key, arrays in zip(spec.keys, stash):
        for name, values in change(arrays).items():
            setattr(key, name, [float(value) for value in values])


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
