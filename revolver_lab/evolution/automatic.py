"""Numbers by which MuJoCo finds a value by itself, or has none: no other number is next to them."""

from collections.abc import Callable

import mujoco
import numpy as np

from revolver_lab.errors import ParameterError
from revolver_lab.evolution.canonical import Element

_RELPOSE, _RELQUAT = slice(3, 10), slice(6, 10)  # of a weld's data

Models = tuple[mujoco.MjModel, mujoco.MjModel]


def spell_out(kind: str, a: Element, b: Element, models: Models) -> None:
    """Let both elements state what one states and MuJoCo finds for the other.

    What it finds for both stays as it is, and is found anew along the path.

    Args:
        kind: Of the two.
        a: Of the source, changed in place.
        b: Of the target, changed in place.
        models: Both robots, compiled.
    """
    for is_automatic, write in FOUND.get(kind, ()):
        if is_automatic(a, models[0]) != is_automatic(b, models[1]):
            write(a, models[0])
            write(b, models[1])
    if _is_posed(a) and _is_posed(b):
        _turn_alike(a, b)


def left_off(actuator: Element) -> set[str]:
    """Attributes of an actuator that leave something off, as no number next to theirs does."""
    off = {name for name in ("velrange", "ffrange") if not np.any(getattr(actuator, name))}
    if actuator.dyntype == mujoco.mjtDyn.mjDYN_PID and actuator.dynprm[0] == 0.0:
        off.add("dynprm")  # imax, a bound on what is integrated
    return off


def refuse_other_states(a: Element, b: Element, models: Models) -> None:
    """Refuse actuators of the same dynamics where one has more activations than the other.

    Args:
        a: Of the source.
        b: Of the target.
        models: Both robots, compiled.

    Raises:
        ParameterError: If one has.
    """
    ours, theirs = (int(m.actuator_actnum[each.id]) for each, m in zip((a, b), models))
    if a.dyntype == b.dyntype and ours != theirs:
        raise ParameterError(
            f"actuator {a.name!r} with {ours} activations in one robot and {theirs} in the other",
            "as many in both: what leaves one out has no number next to it",
            "Let both have it or none; slewmax='1e9' has one, and limits nothing.",
        )


def _has_springdamper(joint: Element, _: mujoco.MjModel) -> bool:
    """Whether a joint's spring is told by what it does to the inertia that it moves."""
    return bool(np.any(joint.springdamper))


def _state_spring(joint: Element, model: mujoco.MjModel) -> None:
    dof = model.jnt_dofadr[joint.id]
    joint.stiffness[0] = model.jnt_stiffness[joint.id]
    joint.damping[0] = model.dof_damping[dof]
    joint.springdamper = np.zeros(2)


def _rests_as_it_is(tendon: Element, _: mujoco.MjModel) -> bool:
    """Whether a tendon's spring is at rest where the robot is at its reference."""
    return bool(np.all(np.array(tendon.springlength) == -1.0))


def _state_rest(tendon: Element, model: mujoco.MjModel) -> None:
    tendon.springlength = model.tendon_lengthspring[tendon.id]


def _is_weld(equality: Element) -> bool:
    """Whether a constraint welds two bodies, and so may state how one is placed at the other."""
    weld = equality.type == mujoco.mjtEq.mjEQ_WELD
    return weld and equality.objtype == mujoco.mjtObj.mjOBJ_BODY


def _holds_as_it_is(equality: Element, _: mujoco.MjModel) -> bool:
    """Whether a weld holds two bodies as the reference has them."""
    return _is_weld(equality) and not np.any(equality.data[_RELQUAT])


def _state_pose(equality: Element, model: mujoco.MjModel) -> None:
    if _is_weld(equality):
        data = np.array(equality.data)
        data[_RELPOSE] = model.eq_data[equality.id][_RELPOSE]
        equality.data = data


def _is_posed(element: Element) -> bool:
    """Whether an element is a weld that states how it holds."""
    return (
        isinstance(element, mujoco.MjsEquality)
        and _is_weld(element)
        and bool(np.any(element.data[_RELQUAT]))
    )


def _turn_alike(a: Element, b: Element) -> None:
    """Write the target's quaternion with the sign that is nearer, or halfway it could be none."""
    data = np.array(b.data)
    if data[_RELQUAT] @ np.array(a.data)[_RELQUAT] < 0.0:
        data[_RELQUAT] *= -1.0
        b.data = data


def _has_dampratio(actuator: Element, model: mujoco.MjModel) -> bool:
    """Whether a servo's damping is told by its ratio: it is then, where MuJoCo writes over it."""
    return actuator.biasprm[2] > 0.0 and model.actuator_biasprm[actuator.id][2] <= 0.0


def _state_damping(actuator: Element, model: mujoco.MjModel) -> None:
    biasprm = np.array(actuator.biasprm)
    biasprm[2] = model.actuator_biasprm[actuator.id][2]
    actuator.biasprm = biasprm


def _inherits_range(actuator: Element, _: mujoco.MjModel) -> bool:
    """Whether a servo's range is that of its joint."""
    return actuator.inheritrange > 0.0


def _state_range(actuator: Element, model: mujoco.MjModel) -> None:
    actuator.ctrlrange = model.actuator_ctrlrange[model.actuator_ctrladr[actuator.id]]
    actuator.actrange = model.actuator_actrange[actuator.id]
    actuator.inheritrange = 0.0


def _slides_as_it_pushes(pair: Element, _: mujoco.MjModel) -> bool:
    """Whether a pair's friction is as stiff as the contact is along its normal."""
    return not np.any(pair.solreffriction)


def _state_friction(pair: Element, _: mujoco.MjModel) -> None:
    if not np.any(pair.solreffriction):
        pair.solreffriction = np.array(pair.solref)


# For each kind of element: how to tell that MuJoCo finds a value, and how to state the value.
FOUND: dict[str, tuple[tuple[Callable[[Element, mujoco.MjModel], bool],
                              Callable[[Element, mujoco.MjModel], None]], ...]] = {
    "joint": ((_has_springdamper, _state_spring),),
    "tendon": ((_rests_as_it_is, _state_rest),),
    "equality": ((_holds_as_it_is, _state_pose),),
    "actuator": ((_has_dampratio, _state_damping), (_inherits_range, _state_range)),
    "pair": ((_slides_as_it_pushes, _state_friction),),
}  # fmt: skip
