"""Gives a name to every element of a robot that has none."""

import mujoco

from revolver_lab.errors import RobotFileError

# Elements that are named silently, and the attribute holding the element to name them after.
_SILENT = {
    "geom": ("geoms", "parent"),
    "site": ("sites", "parent"),
    "camera": ("cameras", "parent"),
    "light": ("lights", "parent"),
    "actuator": ("actuators", "target"),
    "tendon": ("tendons", None),
    "equality": ("equalities", "name1"),
    "sensor": ("sensors", "objname"),
    "pair": ("pairs", "geomname1"),
    "exclude": ("excludes", "bodyname1"),
    "key": ("keys", None),
    "mesh": ("meshes", None),
    "material": ("materials", None),
    "texture": ("textures", None),
    "hfield": ("hfields", None),
}


def name_everything(spec: mujoco.MjSpec, where: str, unnamed: str = "refuse") -> None:
    """Name what has no name: joints and bodies by number if asked to, all the rest silently.

    A free joint counts with the rest, as a body has at most one.

    Args:
        spec: The robot, changed in place.
        where: What to call it in an error.
        unnamed: "refuse" or "number".

    Raises:
        RobotFileError: If a body or joint has no name and `unnamed` is "refuse".
    """
    for body in spec.bodies:
        _name(body, spec.bodies, "body", f"a child of {_around(body)}", where, unnamed)
    for joint in spec.joints:
        free = joint.type == mujoco.mjtJoint.mjJNT_FREE
        kind = f"{joint.parent.name}_{'free' if free else 'joint'}"
        place = f"a joint of body {joint.parent.name!r}"
        _name(joint, spec.joints, kind, place, where, "number" if free else unnamed)
    for kind, (group, owner) in _SILENT.items():
        members = list(getattr(spec, group))
        taken = {member.name for member in members}
        for member in members:
            if not member.name:
                member.name = free_name(_silent_name(member, kind, owner), taken)
                taken.add(member.name)


def _around(body: mujoco.MjsBody) -> str:
    """What to call the surroundings of a body without a name."""
    return f"body {body.parent.name!r}" if body.parent is not None else "the world"


def _name(element: object, group: object, stem: str, place: str, where: str, unnamed: str) -> None:
    """Name one body or joint, or refuse it."""
    if element.name:  # type: ignore[attr-defined]
        return
    if unnamed == "refuse":
        raise RobotFileError(
            f"{where} has {place} without a name",
            "bodies and joints with names, since names say what corresponds",
            'Name it in the file, or pass unnamed="number".',
        )
    element.name = free_name(stem, {other.name for other in group})  # type: ignore


def _silent_name(element: object, kind: str, owner: str | None) -> str:
    """A name after the element's body, joint or file."""
    value = getattr(element, owner) if owner else getattr(element, "file", "")
    stem = getattr(value, "name", value) or ""
    if not owner:
        stem = str(stem).replace("\\", "/").rsplit("/", 1)[-1].split(".")[0]
        return stem or kind
    return f"{stem}_{kind}" if stem else kind


def free_name(stem: str, taken: set[str]) -> str:
    """The stem itself, or the first of stem2, stem3, ... that is not taken.

    Example:
        >>> free_name("leg", {"leg", "leg2"})
        'leg3'
    """
    names = (stem if i == 1 else f"{stem}{i}" for i in range(1, len(taken) + 2))
    return next(name for name in names if name not in taken)
