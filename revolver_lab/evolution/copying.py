"""Copies elements from one robot into another, attribute by attribute, under new names."""

from collections.abc import Callable
from enum import Enum

import mujoco
import numpy as np

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.twins import object_kind

Rename = Callable[[str, str], str | None]
_BOUND = ("name", "id", "signature", "info", "frame", "parent", "simple")
_VECTORS = ("MjDoubleVec", "MjIntVec", "MjFloatVec", "MjStringVec", "MjByteVec")
_ORIENTATIONS = ("alt", "ialt")
# Attributes that hold the name of another element, and the kind of that element.
_REFERENCES = {"meshname": "mesh", "material": "material", "hfieldname": "hfield"}
_TRN = mujoco.mjtTrn
DRIVEN = {
    _TRN.mjTRN_JOINT: "joint",
    _TRN.mjTRN_JOINTINPARENT: "joint",
    _TRN.mjTRN_BODY: "body",
    _TRN.mjTRN_SITE: "site",
    _TRN.mjTRN_SLIDERCRANK: "site",
    _TRN.mjTRN_TENDON: "tendon",
}
_WRAPPED = {
    mujoco.mjtWrap.mjWRAP_JOINT: "joint",
    mujoco.mjtWrap.mjWRAP_SITE: "site",
    mujoco.mjtWrap.mjWRAP_SPHERE: "geom",
    mujoco.mjtWrap.mjWRAP_CYLINDER: "geom",
}


def copy_attributes(donor: object, copy: object) -> None:
    """Give one element the numbers, flags and texts of another of its kind."""
    for name in dir(donor):
        if name.startswith("_") or name in _BOUND:
            continue
        value = getattr(donor, name)
        if isinstance(value, np.ndarray):
            setattr(copy, name, np.array(value))
        elif type(value).__name__ in _VECTORS:
            setattr(copy, name, list(value))
        elif isinstance(value, bool | int | float | str | Enum) or _is_enum(value):
            setattr(copy, name, value)
        elif name in _ORIENTATIONS:
            _copy_orientation(value, getattr(copy, name))


def _is_enum(value: object) -> bool:
    """Whether a value is one of MuJoCo's enumerations."""
    return type(value).__name__.startswith("mjt")


def _copy_orientation(donor: object, copy: object) -> None:
    """Give one alternative orientation the numbers of another."""
    for name in ("type", "axisangle", "xyaxes", "zaxis", "euler"):
        value = getattr(donor, name)
        setattr(copy, name, np.array(value) if isinstance(value, np.ndarray) else value)


def add_to_body(body: mujoco.MjsBody, kind: str, donor: object, name: str, rename: Rename):
    """Add a copy of a joint, geom, site, camera or light to a body.

    Args:
        body: Where to.
        kind: "joint", "geom", "site", "camera" or "light".
        donor: What to copy; of the same robot or of another in canonical form.
        name: The copy's name.
        rename: Gives the name here of a (kind, name) there; None if it is not here.

    Returns:
        The copy.
    """
    copy = getattr(body, f"add_{kind}")(name=name)
    copy_attributes(donor, copy)
    for attribute, kind_of in _REFERENCES.items():
        there = getattr(donor, attribute, "")
        if there:
            setattr(copy, attribute, rename(kind_of, there) or "")
    if kind in ("camera", "light") and donor.targetbody:  # type: ignore[attr-defined]
        copy.targetbody = rename("body", donor.targetbody) or ""  # type: ignore
    return copy


def add_body(parent: mujoco.MjsBody, donor: mujoco.MjsBody, name: str) -> mujoco.MjsBody:
    """Add a copy of a body without what it holds."""
    copy = parent.add_body(name=name)
    copy_attributes(donor, copy)
    return copy


def add_tendon(spec: mujoco.MjSpec, donor: mujoco.MjsTendon, name: str, rename: Rename):
    """Add a copy of a tendon with its path, over what its path is called here."""
    copy = spec.add_tendon(name=name)
    copy_attributes(donor, copy)
    if donor.material:
        copy.material = rename("material", donor.material) or ""
    for wrap in donor.path:
        kind = _WRAPPED.get(wrap.type)
        if kind is None:
            copy.wrap_pulley(wrap.divisor)
            continue
        target = needed(rename, kind, wrap.target.name, f"the tendon {donor.name!r}")
        if kind == "joint":
            copy.wrap_joint(target, wrap.coef)
        elif kind == "site":
            copy.wrap_site(target)
        else:
            side = wrap.sidesite.name if wrap.sidesite else ""
            copy.wrap_geom(target, (rename("site", side) or "") if side else "")
    return copy


def add_actuator(spec: mujoco.MjSpec, donor: mujoco.MjsActuator, name: str, rename: Rename):
    """Add a copy of an actuator that drives what its target is called here."""
    copy = spec.add_actuator(name=name)
    copy_attributes(donor, copy)
    what = f"the actuator {donor.name!r}"
    copy.target = needed(rename, DRIVEN[donor.trntype], donor.target, what)
    for attribute in ("refsite", "slidersite"):
        if getattr(donor, attribute):
            setattr(copy, attribute, needed(rename, "site", getattr(donor, attribute), what))
    return copy


def add_sensor(spec: mujoco.MjSpec, donor: mujoco.MjsSensor, name: str, rename: Rename):
    """Add a copy of a sensor, or none where it measures something that is not here."""
    names = [("objtype", "objname"), ("reftype", "refname")]
    found = {}
    for type_of, attribute in names:
        there = getattr(donor, attribute)
        here = rename(object_kind(getattr(donor, type_of)), there) if there else ""
        if here is None:
            return None
        found[attribute] = here
    copy = spec.add_sensor(name=name)
    copy_attributes(donor, copy)
    for attribute, here in found.items():
        setattr(copy, attribute, here)
    return copy


def add_equality(spec: mujoco.MjSpec, donor: mujoco.MjsEquality, name: str, rename: Rename):
    """Add a copy of an equality constraint between what its two objects are called here."""
    copy = spec.add_equality(name=name)
    copy_attributes(donor, copy)
    kind = equality_kind(donor)
    for attribute in ("name1", "name2"):
        there = getattr(donor, attribute)
        if there:
            what = f"the equality constraint {donor.name!r}"
            setattr(copy, attribute, needed(rename, kind, there, what))
    return copy


def add_contact(spec: mujoco.MjSpec, plural: str, donor: object, name: str, rename: Rename):
    """Add a copy of a contact pair or exclusion."""
    kind, add = {"pairs": ("geom", spec.add_pair), "excludes": ("body", spec.add_exclude)}[plural]
    copy = add(name=name)
    copy_attributes(donor, copy)
    for attribute in (f"{kind}name1", f"{kind}name2"):
        there = getattr(donor, attribute)
        setattr(copy, attribute, needed(rename, kind, there, f"{plural} {name!r}"))
    return copy


def equality_kind(equality: mujoco.MjsEquality) -> str:
    """The kind of element that an equality constraint ties together."""
    eq = mujoco.mjtEq
    kinds = {eq.mjEQ_JOINT: "joint", eq.mjEQ_TENDON: "tendon"}
    return kinds.get(equality.type) or object_kind(equality.objtype)


def needed(rename: Rename, kind: str, name: str, what: str) -> str:
    """The name here of something that a copy cannot do without.

    Raises:
        MatchingError: If it is not here.
    """
    here = rename(kind, name)
    if here is None:
        raise MatchingError(
            f"{what}, which needs the {kind} {name!r} of the scene",
            "what runs over the robot's own bodies",
            f"Move the {kind} {name!r} to a body of the robot, or remove {what}.",
        )
    return here
