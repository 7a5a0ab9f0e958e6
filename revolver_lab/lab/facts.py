"""What changed on a robot along alpha: parameters, total mass, and how long its limbs are."""

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from revolver_lab.evolution.evolution import Evolution
from revolver_lab.lab import poses

_GEOM = mujoco.mjtGeom
MASS, LIMB, PARAMETER = "total mass", "limb lengths", "parameters that change"
_SAME = 1e-9
"""Lengths [m] that differ by less are the same."""


@dataclass(frozen=True, kw_only=True)
class Fact:
    """One number of a robot on its way from source to target.

    Attributes:
        kind: Which heading it stands under: MASS, LIMB or PARAMETER.
        name: What it is, such as "fshin" or "geom/fshin/size[1]".
        source: Its value at alpha 0.
        now: Its value at this alpha.
        target: Its value at alpha 1.
        unit: Its unit, "" where it has none.
    """

    kind: str
    name: str
    source: float
    now: float
    target: float
    unit: str


class Facts:
    """Looks up the facts of E(alpha); the two ends are read once.

    Args:
        evolve: The evolution.

    Example:
        >>> import revolver_lab as rvl
        >>> facts = Facts(rvl.load("cheetah-front-leg")).at(0.5)
        >>> [f"{fact.name} {fact.now:.2f} {fact.unit}" for fact in facts if fact.kind == LIMB]
        ['fthigh 0.28 m', 'fshin 0.24 m', 'ffoot 0.19 m']
    """

    def __init__(self, evolve: Evolution):
        self._evolve = evolve
        self._model = evolve.model(0.0)
        self._ends = [self._measure(alpha) for alpha in (0.0, 1.0)]
        source, target = (limbs for _, limbs, _ in self._ends)
        self._limbs = [name for name in source if abs(source[name] - target[name]) > _SAME]
        self._names = [
            name.partition(" [")
            for name, changed in zip(evolve.theta_names, evolve.theta_changed)
            if changed
        ]

    def at(self, alpha: float) -> list[Fact]:
        """Total mass [kg], limbs that change [m], and parameters that change, in this order.

        Raises:
            AlphaError: If alpha is outside [0, 1].
        """
        return list(self._each(self._measure(alpha)))

    def _each(self, now: "tuple[float, dict[str, float], np.ndarray]") -> Iterator[Fact]:
        """Facts from what was measured."""
        (mass0, limbs0, theta0), (mass1, limbs1, theta1) = self._ends
        mass, limbs, theta = now
        yield Fact(kind=MASS, name="all bodies", source=mass0, now=mass, target=mass1, unit="kg")
        for name in self._limbs:
            yield Fact(kind=LIMB, name=name, source=limbs0[name], now=limbs[name],
                       target=limbs1[name], unit="m")  # fmt: skip
        for (name, _, unit), start, value, end in zip(self._names, theta0, theta, theta1):
            yield Fact(kind=PARAMETER, name=name, source=float(start), now=float(value),
                       target=float(end), unit=unit.rstrip("]"))  # fmt: skip

    def _measure(self, alpha: float) -> "tuple[float, dict[str, float], np.ndarray]":
        """Total mass [kg], length of every limb [m], and the part of theta that changes."""
        self._evolve.write_model(self._model, alpha)
        theta = self._evolve.theta(alpha)[self._evolve.theta_changed]
        return total_mass(self._model), limb_lengths(self._model), theta


def total_mass(model: mujoco.MjModel) -> float:
    """Mass of everything that is not the world [kg].

    Example:
        >>> ball = "<mujoco><worldbody><body><freejoint/><geom size='.1' mass='2'/></body>"
        >>> total_mass(mujoco.MjModel.from_xml_string(ball + "</worldbody></mujoco>"))
        2.0
    """
    return float(model.body_mass[1:].sum())


def limb_lengths(model: mujoco.MjModel) -> dict[str, float]:
    """How long each body is [m]: the full length of its longest geom, rounded ends included.

    Returns:
        Body name -> length, for bodies with visible geoms.

    Example:
        >>> rod = "<mujoco><worldbody><body name='rod'><geom type='capsule' size='.1 .4'/></body>"
        >>> limb_lengths(mujoco.MjModel.from_xml_string(rod + "</worldbody></mujoco>"))
        {'rod': 1.0}
    """
    found: dict[str, float] = {}
    for geom in poses.robot_geoms(model):
        body = model.body(model.geom_bodyid[geom]).name
        found[body] = max(found.get(body, 0.0), _length(model, int(geom)))
    return found


def _length(model: mujoco.MjModel, geom: int) -> float:
    """Longest extent of one geom [m]."""
    kind, size, mesh = model.geom_type[geom], model.geom_size[geom], model.geom_dataid[geom]
    if kind == _GEOM.mjGEOM_MESH and mesh >= 0:
        first = model.mesh_vertadr[mesh]
        points = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
        return float(np.ptp(points, axis=0).max())
    if kind == _GEOM.mjGEOM_CAPSULE:
        return float(2 * (size[0] + size[1]))
    return float(2 * size.max())
