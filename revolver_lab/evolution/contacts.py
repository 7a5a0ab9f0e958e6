"""Keeps created geoms out of contact while they are small."""

import mujoco

from revolver_lab.errors import ParameterError

_ROOM = 1.5
_OVERRIDE = mujoco.mjtEnableBit.mjENBL_OVERRIDE


def refuse_override(what: str, *models: mujoco.MjModel) -> None:
    """Refuse to keep something from touching where a robot gives all contacts one margin.

    Args:
        what: What has to be kept from touching.
        models: Both robots, compiled.

    Raises:
        ParameterError: If one of them does.
    """
    if any(model.opt.enableflags & _OVERRIDE for model in models):
        raise ParameterError(
            f"{what}, in a robot with <flag override='enable'/>, whose o_margin is that of every "
            "contact",
            "contacts with margins of their own: what must not touch at one end has a negative one",
            "Take the flag away, and give the geoms margin, solref, solimp and friction instead.",
        )


def excuse_contacts(
    host: mujoco.MjSpec, before: mujoco.MjModel, donor: mujoco.MjModel, created: list[str]
) -> None:
    """Give each created geom a negative margin as deep as it may be overlapped by accident.

    A geom that starts as a point may get inside another shape of the robot, or stick out of its
    parent's onto the ground. MuJoCo adds up the margins of two geoms, and there is no contact
    until they overlap by more than a negative margin. The margin is the half thickness of the
    robot's thickest shape, deeper than which nothing can get, or half as much again as the point
    sticks out of the bodies that carry it, whichever is larger. It closes as the geom grows,
    since margin is a parameter of theta.

    Args:
        host: The robot with the created geoms, changed in place.
        before: The robot without them, compiled.
        donor: The robot that they were copied from, compiled.
        created: Names of the created geoms.

    Raises:
        ParameterError: If margins mean nothing in one of the two robots.
    """
    if not created:
        return
    model = host.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)  # contacts would be many, and are not asked for
    old = {before.geom(i).name for i in range(before.ngeom)}
    robot = [i for i in range(model.ngeom) if model.geom(i).name in old and _collides(model, i)]
    thickest = max((_half_thickness(model, i) for i in robot), default=0.0)
    slack = float(model.geom_margin.max())
    for name in created:
        geom = model.geom(name).id
        if model.geom_contype[geom] or model.geom_conaffinity[geom]:
            refuse_override(f"the geom {name!r}, which only one robot has", before, donor)
            depth = max(thickest, _sticks_out(model, data, geom, robot))
            reach = float(model.geom_rbound[geom]) + 1e-3
            host.geom(name).margin = -(slack + depth + reach)
    for pair in host.pairs:
        margins = [host.geom(n).margin for n in (pair.geomname1, pair.geomname2) if n in created]
        if margins:
            refuse_override(f"the contact pair {pair.name!r}", before, donor)
            pair.margin = min(margins)


def _collides(model: mujoco.MjModel, geom: int) -> bool:
    """Whether a geom is the robot's, and not the scene's, and touches anything at all."""
    touches = model.geom_contype[geom] or model.geom_conaffinity[geom]
    return bool(model.geom_bodyid[geom] != 0 and touches)


def _half_thickness(model: mujoco.MjModel, geom: int) -> float:
    """Radius of the largest ball inside a geom, or a little more [m]."""
    return float(model.geom_aabb[geom, 3:].min())


def _sticks_out(model: mujoco.MjModel, data: mujoco.MjData, geom: int, others: list[int]) -> float:
    """How far out of the bodies that carry it a created geom is, and half as much again [m]."""
    body = int(model.geom_bodyid[geom])
    carriers = {body}
    while body:
        body = int(model.body_parentid[body])
        carriers.add(body)
    apart = [
        mujoco.mj_geomDistance(model, data, geom, other, 10.0, None)
        for other in others
        if int(model.geom_bodyid[other]) in carriers
    ]
    return _ROOM * max(min(apart, default=0.0), 0.0)
