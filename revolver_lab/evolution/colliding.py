"""Geoms that collide at one end of a path only, in one layout for all of it."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from revolver_lab.evolution.canonical import Element

COLLIDES = ("contype", "conaffinity")


def compiled(geoms: Sequence[Element], compile_: Callable[[], mujoco.MjModel]) -> mujoco.MjModel:
    """Compiles a robot as if all these geoms collided, and then lets them collide as they say.

    MuJoCo makes bounding volumes and convex hulls for geoms that collide, and no others.

    Args:
        geoms: Those that collide somewhere on the path, and elsewhere do not.
        compile_: Compiles the robot.
    """
    said = [(geom.contype, geom.conaffinity) for geom in geoms]
    for geom in geoms:
        geom.contype = geom.conaffinity = 1
    try:
        model = compile_()
    finally:
        for geom, (contype, conaffinity) in zip(geoms, said):
            geom.contype, geom.conaffinity = contype, conaffinity
    for geom, (contype, conaffinity) in zip(geoms, said):
        i = model.geom(geom.name).id
        model.geom_contype[i], model.geom_conaffinity[i] = contype, conaffinity
    for body in {int(model.geom(geom.name).bodyid[0]) for geom in geoms}:
        first = model.body_geomadr[body]
        mine = slice(first, first + model.body_geomnum[body])
        model.body_contype[body] = np.bitwise_or.reduce(model.geom_contype[mine])
        model.body_conaffinity[body] = np.bitwise_or.reduce(model.geom_conaffinity[mine])
    return model
