"""What a robot's tree needs that is built anew under the same names."""

import mujoco

from revolver_lab.evolution.copying import (
    add_actuator,
    add_contact,
    add_equality,
    add_sensor,
    add_tendon,
    add_to_body,
)

SUBTREE = (
    mujoco.mjtSensor.mjSENS_SUBTREECOM,
    mujoco.mjtSensor.mjSENS_SUBTREELINVEL,
    mujoco.mjtSensor.mjSENS_SUBTREEANGMOM,
)
"""Sensors of a body and all that hangs below it, which another tree changes."""
_HELD = {"geom": "geoms", "site": "sites", "camera": "cameras", "light": "lights"}
_DEPENDANTS = ("tendons", "actuators", "equalities", "pairs", "excludes", "sensors")


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
