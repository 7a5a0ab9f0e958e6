"""What a robot's tree needs that is built anew under the same names."""

from collections.abc import Callable

import mujoco

from revolver_lab.evolution.copying import (
    add_actuator,
    add_body,
    add_contact,
    add_equality,
    add_sensor,
    add_tendon,
    add_to_body,
)
from revolver_lab.evolution.keyframes import extend_keyframes, restore_keyframes, stash_keyframes

_SUBTREE = (
    mujoco.mjtSensor.mjSENS_SUBTREECOM,
    mujoco.mjtSensor.mjSENS_SUBTREELINVEL,
    mujoco.mjtSensor.mjSENS_SUBTREEANGMOM,
)
_CONTACT, _TREE = mujoco.mjtSensor.mjSENS_CONTACT, mujoco.mjtObj.mjOBJ_XBODY
_HELD = {"geom": "geoms", "site": "sites", "camera": "cameras", "light": "lights"}
_DEPENDANTS = ("tendons", "actuators", "equalities", "pairs", "excludes", "sensors")


def of_subtrees(sensor: mujoco.MjsSensor) -> list[str]:
    """Which names of a sensor mean a body and all that hangs below it, which another tree changes.

    Of a contact sensor a subtree is told by the type of its object.

    Returns:
        Of "objname" and "refname", those.
    """
    if sensor.type in _SUBTREE:
        return ["objname"]
    if sensor.type != _CONTACT:
        return []
    named = {"objname": sensor.objtype, "refname": sensor.reftype}
    return [name for name, kind in named.items() if kind == _TREE]


def same_name(_: str, name: str) -> str:
    """Names stay as they are within one robot."""
    return name


def add_joints(body: mujoco.MjsBody, donor: mujoco.MjsBody) -> None:
    """Give a body copies of another one's joints."""
    for joint in donor.joints:
        add_to_body(body, "joint", joint, joint.name, same_name)


def add_held(body: mujoco.MjsBody, donor: mujoco.MjsBody) -> None:
    """Give a body copies of another one's geoms, sites, cameras and lights."""
    for kind, plural in _HELD.items():
        for element in getattr(donor, plural):
            add_to_body(body, kind, element, element.name, same_name)


def add_whole_body(here: mujoco.MjsBody, donor: mujoco.MjsBody) -> mujoco.MjsBody:
    """Hang a copy of a body with all that it holds, and none of the bodies below it."""
    copy = add_body(here, donor, donor.name)
    add_joints(copy, donor)
    add_held(copy, donor)
    return copy


def rebuilt(
    donor: mujoco.MjSpec, hang: Callable[[mujoco.MjsBody, mujoco.MjsBody], None]
) -> mujoco.MjSpec:
    """A robot with every body built anew, under the same names and with the same keyframes.

    Args:
        donor: A robot in canonical form; it is left as it was.
        hang: Hangs, in a body, a copy of another one with all below it.
    """
    before = donor.compile()
    host = donor.copy()
    stash = stash_keyframes(host)  # which MuJoCo would shorten with each body that goes
    for body in list(host.worldbody.bodies):
        host.delete(body)
    for body in donor.worldbody.bodies:
        hang(host.worldbody, body)
    add_dependants(host, donor)
    restore_keyframes(host, stash, lambda state: state)
    extend_keyframes(host, before)
    return host


def add_dependants(host: mujoco.MjSpec, donor: mujoco.MjSpec) -> None:
    """Make anew all that refers to bodies, joints and sites, under the same names and in order.

    Args:
        host: A robot whose bodies were built anew, which loses what referred to them.
        donor: The robot that they were copied from.
    """
    for plural in _DEPENDANTS:
        for element in list(getattr(host, plural)):
            host.delete(element)

    for plural, add in (
        ("tendons", add_tendon),
        ("actuators", add_actuator),
        ("equalities", add_equality),
    ):
        for element in getattr(donor, plural):
            add(host, element, element.name, same_name)
    for plural in ("pairs", "excludes"):
        for element in getattr(donor, plural):
            add_contact(host, plural, element, element.name, same_name)
    for sensor in donor.sensors:
        add_sensor(host, sensor, sensor.name, same_name)
