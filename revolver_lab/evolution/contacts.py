"""Keeps created geoms out of contact while they are small."""

import mujoco
import numpy as np

_ROOM = 1.5


def excuse_contacts(host: mujoco.MjSpec, before: mujoco.MjModel, created: list[str]) -> None:
    """Give each created geom a negative margin as deep as it may be overlapped by accident.

    A geom that starts as a point may lie inside its parent's shape, or stick out of it onto the
    ground. MuJoCo adds up the margins of two geoms, and there is no contact until they overlap
    by more than a negative margin. The margin is the depth of the point in the robot's shapes, or
    its distance from the shapes of the bodies that carry it, whichever is larger, with half as
    much again for motion. It closes as the geom grows, since margin is a parameter of theta.

    Args:
        host: The robot with the created geoms, changed in place.
        before: The robot without them, compiled.
        created: Names of the created geoms.
    """
    if not created:
        return
    model = host.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    old = {before.geom(i).name for i in range(before.ngeom)}
    robot = [i for i in range(model.ngeom) if model.geom(i).name in old and _moves(model, i)]
    slack = float(model.geom_margin.max())
    for name in created:
        geom = model.geom(name).id
        if model.geom_contype[geom] or model.geom_conaffinity[geom]:
            host.geom(name).margin = -slack - _depth(model, data, geom, robot)
    for pair in host.pairs:
        margins = [host.geom(n).margin for n in (pair.geomname1, pair.geomname2) if n in created]
        pair.margin = min(margins) if margins else pair.margin


def _moves(model: mujoco.MjModel, geom: int) -> bool:
    """Whether a geom is the robot's, and not the scene's."""
    return bool(model.geom_bodyid[geom] != 0)


def _depth(model: mujoco.MjModel, data: mujoco.MjData, geom: int, others: list[int]) -> float:
    """How deep, or how far out, a created geom may be without being meant to touch [m]."""
    body = model.geom_bodyid[geom]
    carriers = {int(body)}
    while body:
        body = int(model.body_parentid[body])
        carriers.add(body)
    reach = float(model.geom_rbound[geom]) + 1e-3
    apart, deep = [], 0.0
    for other in others:
        distance = mujoco.mj_geomDistance(model, data, geom, other, 10.0, None)
        deep = max(deep, -distance)
        if int(model.geom_bodyid[other]) in carriers:
            apart.append(distance)
    return _ROOM * max(deep, min(apart, default=0.0), 0.0) + reach
