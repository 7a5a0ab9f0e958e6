"""Reading theta_S and theta_T off two robots, and finding what has no in-between."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from revolver_lab.errors import ParameterError
from revolver_lab.evolution.automatic import left_off
from revolver_lab.evolution.canonical import Element, Pairs, elements, has_fromto
from revolver_lab.evolution.parameters import CONTINUOUS, LINEAR, Parameter, discrete
from revolver_lab.evolution.ramps import Ramps, RampSpec
from revolver_lab.evolution.theta import Block, Switch, Theta

_QUANTITY = {mujoco.mjtJoint.mjJNT_SLIDE: "m"}
# Numbers whose meaning depends on a type: where it switches, they switch with it.
_MEANT_BY = {"gaintype": "gainprm", "biastype": "biasprm", "dyntype": "dynprm"}


def read_theta(
    source: mujoco.MjSpec,
    target: mujoco.MjSpec,
    pairs: Pairs,
    switches: tuple[Switch, ...],
    *,
    f: RampSpec,
    switch: float | Mapping[str, float] | None,
    held: Mapping[str, int],
) -> Theta:
    """Read theta_S and theta_T off two padded, aligned robots.

    Args:
        source: The source robot, canonical.
        target: The target robot, canonical.
        pairs: For each kind of element, (name in source, name in target).
        switches: What switches without being asked.
        f: The interpolation function, or patterns over the names of theta.
        switch: alpha at which discrete differences switch: one for all, or by name.
        held: Joints that one robot holds still, see `padding.Padded`.

    Raises:
        ParameterError: If discrete attributes differ and no alpha is named for them, or a
            continuous one has no in-between.
    """
    blocks: list[Block] = []
    differences: list[Switch] = []
    by_group = bool(source.option.disableactuator or target.option.disableactuator)
    for kind, parameters in CONTINUOUS.items():
        ours, theirs = elements(source, kind), elements(target, kind)
        for a, b in pairs.get(kind, []):
            if (kind, a) == ("body", "world"):
                continue
            found = _differences((kind, a), ours[a], theirs[b], discrete(kind, by_group=by_group))
            switching = {difference.attribute for difference in found}
            switching |= {_MEANT_BY.get(attribute) for attribute in switching}
            for parameter in parameters:
                if parameter.attribute not in switching:
                    blocks.extend(_block((kind, a), ours[a], theirs[b], parameter))
            differences += found
    asked = _switched(differences, switch)
    switches += asked + _followers(asked, source, target, pairs)
    return Theta(tuple(blocks), switches, Ramps(f), held)


def _differences(
    name: tuple[str, str], ours: Element, theirs: Element, attributes: tuple[str, ...]
) -> list[Switch]:
    """The discrete attributes, and those that leave something off, in which two elements differ."""
    values = [(a, _plain(ours, a), _plain(theirs, a)) for a in attributes]
    values = [(attribute, old, new) for attribute, old, new in values if old != new]
    if name[0] == "actuator" and not _MEANT_BY.keys() & {attribute for attribute, _, _ in values}:
        lopsided = sorted(left_off(ours) ^ left_off(theirs))
        values += [(a, _flat(ours, a).tolist(), _flat(theirs, a).tolist()) for a in lopsided]
    for parameter in CONTINUOUS[name[0]]:
        if parameter.off:
            old, new = (getattr(element, parameter.attribute) for element in (ours, theirs))
            values += [(parameter.attribute, old, new)] * ((old == 0.0) != (new == 0.0))
    return [
        Switch(element=name, attribute=attribute, source=old, target=new, alpha=1.0)
        for attribute, old, new in values
    ]


def _plain(element: Element, attribute: str) -> Any:
    """A discrete value; of an array, its numbers, for the array goes on being the element's."""
    value = getattr(element, attribute)
    return value.tolist() if isinstance(value, np.ndarray) else value


def _followers(
    switches: tuple[Switch, ...], source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs
) -> tuple[Switch, ...]:
    """The numbers of an actuator's law, which switch where its type does."""
    ours, theirs = elements(source, "actuator"), elements(target, "actuator")
    partner = dict(pairs.get("actuator", []))
    found = []
    for leader in switches:
        if attribute := _MEANT_BY.get(leader.attribute):
            a = leader.element[1]
            old, new = _flat(ours[a], attribute), _flat(theirs[partner[a]], attribute)
            found.append(replace(leader, attribute=attribute, source=old, target=new))
    return tuple(found)


def _flat(element: Element, attribute: str) -> np.ndarray:
    return np.array(getattr(element, attribute), dtype=float).reshape(-1)


_MOST = 20
"""Differences that an error lists."""
_NUMBERED = {"integrator": mujoco.mjtIntegrator, "cone": mujoco.mjtCone,
             "solver": mujoco.mjtSolver, "jacobian": mujoco.mjtJacobian}  # fmt: skip
_FLAGS = {"disableflags": mujoco.mjtDisableBit, "enableflags": mujoco.mjtEnableBit}
_STATED = ("mass", "ipos", "iquat", "inertia")


def _given(kind: str, element: Element, attribute: str) -> bool:
    """Whether an attribute is given, and not inferred from another one."""
    if not hasattr(element, attribute):
        return False
    if kind == "body" and attribute in _STATED:
        return bool(element.explicitinertial)
    if kind in ("geom", "site") and attribute in ("pos", "quat"):
        return not has_fromto(element)
    if kind == "geom" and attribute == "density":
        return not np.isfinite(element.mass)
    # "Not given" is not-a-number in the first place: for fromto, MuJoCo marks no other.
    value = _flat(element, attribute)
    return bool(len(value)) and bool(np.isfinite(value[0]))


def _block(
    name: tuple[str, str], ours: Element, theirs: Element, parameter: Parameter
) -> list[Block]:
    """The block of one attribute, or none where neither robot gives it."""
    kind = name[0]
    path = "/".join((*name, parameter.attribute))
    given = [_given(kind, element, parameter.attribute) for element in (ours, theirs)]
    if not any(given):
        return []
    source, target = _flat(ours, parameter.attribute), _flat(theirs, parameter.attribute)
    if parameter.rare and np.array_equal(source, target):
        return []
    if not all(given) or source.shape != target.shape:
        raise ParameterError(
            f"{path} given as {source.tolist()} in one robot and as {target.tolist()} in the other",
            "as many numbers in both",
            "Write this attribute in both files.",
        )
    _check_between(path, parameter, source, target)
    unit = _unit(kind, ours, parameter)
    size = len(source) if parameter.how == LINEAR else 3
    labels = [path] if size == 1 else [f"{path}[{i}]" for i in range(size)]
    names = tuple(f"{label} [{unit}]" if unit else label for label in labels)
    return [Block(element=name, parameter=parameter, source=source, target=target, names=names)]


def _unit(kind: str, element: Element, parameter: Parameter) -> str:
    """The unit of a parameter; a joint's depends on whether it turns or slides."""
    if kind != "joint":
        return parameter.unit
    return parameter.unit.format(q=_QUANTITY.get(element.type, "rad"))


def _check_between(path: str, parameter: Parameter, a: np.ndarray, b: np.ndarray) -> None:
    """Refuse two values between which there is nothing."""
    if parameter.attribute.startswith("solref") and np.any(a * b < 0):
        raise ParameterError(
            f"{path} = {a.tolist()} in one robot and {b.tolist()} in the other",
            "both positive (time constant, damping ratio) or both negative (stiffness, damping)",
            "Write both in the same of MuJoCo's two forms.",
        )


def _switched(
    differences: list[Switch], switch: float | Mapping[str, float] | None
) -> tuple[Switch, ...]:
    """Give every discrete difference its alpha, or refuse those that have none."""
    paths = [difference.path for difference in differences]
    if isinstance(switch, Mapping):
        table = dict(switch)
        _refuse_unknown(set(table) - set(paths), paths)
    else:
        table = {} if switch is None else dict.fromkeys(paths or ["switch"], switch)
    for name, alpha in table.items():
        if not isinstance(alpha, int | float) or not 0.0 < alpha <= 1.0:
            raise ParameterError(
                f"switch at alpha = {alpha!r} for {name!r}", "0 < alpha <= 1", "Name another alpha."
            )
    refused = [d for d in differences if d.path not in table]
    if refused:
        listed = "; ".join(map(_told, refused[:_MOST]))
        more = f"; and {len(refused) - _MOST} more" if len(refused) > _MOST else ""
        raise ParameterError(
            f"discrete attributes that differ: {listed}{more}",
            "equal ones, which can be interpolated around",
            "Make them equal, or name the alpha at which they switch: switch=0.5, or "
            f"switch={{{refused[0].path!r}: 0.5, ...}}.",
        )
    return tuple(replace(d, alpha=float(table[d.path])) for d in differences)


def _told(difference: Switch) -> str:
    """One difference in words: MuJoCo's numbers and names as an XML file has them."""
    ends = (difference.source, difference.target)
    return f"{difference.path}: {' -> '.join(_word(difference.attribute, end) for end in ends)}"


def _word(attribute: str, value: Any) -> str:
    """A discrete value as an XML file has it; of flags, those that are not as usual."""
    if attribute in _NUMBERED:
        value = _NUMBERED[attribute](value)
    if attribute in _FLAGS:
        bits = _FLAGS[attribute].__members__.values()
        return " and ".join(_name(b) for b in bits if "_" in b.name and b.value & value) or "none"
    return _name(value) if hasattr(value, "name") else str(value)


def _name(member: Any) -> str:
    return member.name.split("_", 1)[1].lower()


def _refuse_unknown(unknown: set[str], known: list[str]) -> None:
    """Refuse switches for what does not differ."""
    if unknown:
        raise ParameterError(
            f"switch for {sorted(unknown)}, which do not differ",
            f"{known}" if known else "nothing: the robots agree in every discrete attribute",
            "Remove them.",
        )
