"""Whether an equality constraint that is created would pull at the robot that it is created in."""

from collections.abc import Collection, Mapping

import mujoco

_JOINT = mujoco.mjtObj.mjOBJ_JOINT
_RIGID = (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD)


def pulls(
    equality: mujoco.MjsEquality,
    donor: mujoco.MjSpec,
    matched: Collection[str],
    twins: Mapping[str, Mapping[str, str]],
    before: mujoco.MjModel,
) -> bool:
    """Whether a constraint ties together what moves in the host without what is created.

    It does if it ties sites, which need not come together; tendons, which may run over whatever the
    host has; bodies that hang on different ones of the host; or a joint that the host has.

    Args:
        equality: The donor's constraint.
        donor: The robot that has it.
        matched: Names of the donor's bodies that the host has.
        twins: By kind, the donor's names and the host's.
        before: The host without what is created, compiled.
    """
    names = (equality.name1, equality.name2)
    tendon = equality.type == mujoco.mjtEq.mjEQ_TENDON
    if tendon or equality.objtype == mujoco.mjtObj.mjOBJ_SITE:
        return True
    if equality.type == mujoco.mjtEq.mjEQ_JOINT:
        ours = [twins["joint"][name] for name in names if name]
        return any(mujoco.mj_name2id(before, _JOINT, name) >= 0 for name in ours)
    if equality.type not in _RIGID:
        return False
    carriers = set()
    for name in names:
        body = donor.body(name or "world")
        while body.name not in matched:
            body = body.parent
        carriers.add(body.name)
    return len(carriers) > 1
