"""Inertias that are written down, in place of what a compiler infers from geoms."""

from collections.abc import Collection

import mujoco
import numpy as np

TINY_MASS, TINY_INERTIA = 1e-13, 1e-14
"""Of a created body [kg, kg m^2]; MuJoCo refuses moving bodies below 1e-15."""


def stated(body: mujoco.MjsBody) -> None:
    """Let a body's inertia be what its mass, inertia, ipos and iquat say."""
    body.explicitinertial = True
    body.fullinertia = [np.nan, 0, 0, 0, 0, 0]
    body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT


def state_inertia(body: mujoco.MjsBody, model: mujoco.MjModel) -> None:
    """Write down the inertia that the compiler found for a body, be it none.

    Args:
        body: Changed in place.
        model: Its robot, compiled.
    """
    i = model.body(body.name).id
    stated(body)
    for attribute in ("mass", "ipos", "iquat", "inertia"):
        setattr(body, attribute, getattr(model, f"body_{attribute}")[i])


def stop_inferring(compiler: mujoco.MjsCompiler) -> None:
    """Let the inertias that are written down stand as they are."""
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    compiler.settotalmass, compiler.balanceinertia = -1.0, False
    compiler.boundmass = compiler.boundinertia = 0.0


def infer_alike(a: mujoco.MjsCompiler, b: mujoco.MjsCompiler) -> bool:
    """Whether two compilers would infer the same inertias from the same geoms."""
    rules = ("inertiafromgeom", "settotalmass", "balanceinertia", "boundmass", "boundinertia")
    same = all(getattr(a, rule) == getattr(b, rule) for rule in rules)
    return same and np.array_equal(a.inertiagrouprange, b.inertiagrouprange)


def let_move(body: mujoco.MjsBody, model: mujoco.MjModel) -> None:
    """Give a body that stood still the least inertia that MuJoCo asks of one that moves.

    Massless ones that it was welded to get it too: they may move without, but only as long as a
    welded child has a mass.

    Args:
        body: A body that a joint is created for, changed in place.
        model: Its robot before, compiled.
    """
    _at_least_tiny(body, model)
    above = body.parent
    while above.name != "world" and model.body(above.name).mass <= mujoco.mjMINVAL:
        _at_least_tiny(above, model)
        above = above.parent


def _at_least_tiny(body: mujoco.MjsBody, model: mujoco.MjModel) -> None:
    """Write down the inertia of a body that has next to none."""
    i = model.body(body.name).id
    mass, inertia = model.body_mass[i], model.body_inertia[i]
    if min(mass, *inertia) <= mujoco.mjMINVAL:
        stated(body)
        body.mass, body.inertia = max(mass, TINY_MASS), np.maximum(inertia, TINY_INERTIA)
        body.ipos, body.iquat = model.body_ipos[i], model.body_iquat[i]


def stay_massless(spec: mujoco.MjSpec, model: mujoco.MjModel, created: Collection[str]) -> None:
    """Keep bodies without mass as they are, whatever geoms are created on them.

    The compiler would infer a mass from them, so small a one that it then refuses its inertia.

    Args:
        spec: Changed in place.
        model: The same robot before, compiled.
        created: Names of the created geoms.
    """
    old = {model.body(i).name for i in range(1, model.nbody) if model.body_mass[i] == 0.0}
    for name in {spec.geom(geom).parent.name for geom in created} & old:
        state_inertia(spec.body(name), model)
