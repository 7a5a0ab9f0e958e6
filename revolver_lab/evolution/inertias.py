"""Inertias that are written down, in place of what a compiler infers from geoms."""

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
    """Write down the inertia that the compiler found for a body, if it found any.

    Args:
        body: Changed in place.
        model: Its robot, compiled.
    """
    i = model.body(body.name).id
    if model.body_mass[i] > 0.0:
        stated(body)
        for attribute in ("mass", "ipos", "iquat", "inertia"):
            setattr(body, attribute, getattr(model, f"body_{attribute}")[i])


def stop_inferring(spec: mujoco.MjSpec) -> None:
    """Let the inertias that are written down stand as they are."""
    compiler = spec.compiler
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    compiler.settotalmass, compiler.balanceinertia = -1.0, False
    compiler.boundmass = compiler.boundinertia = 0.0


def let_move(body: mujoco.MjsBody, model: mujoco.MjModel) -> None:
    """Give a body that stood still the least inertia that MuJoCo asks of one that moves.

    Args:
        body: A body that a joint is created for, changed in place.
        model: Its robot before, compiled.
    """
    i = model.body(body.name).id
    mass, inertia = model.body_mass[i], model.body_inertia[i]
    if min(mass, *inertia) <= mujoco.mjMINVAL:
        stated(body)
        body.mass, body.inertia = max(mass, TINY_MASS), np.maximum(inertia, TINY_INERTIA)
        body.ipos, body.iquat = model.body_ipos[i], model.body_iquat[i]
