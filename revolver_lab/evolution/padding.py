"""Gives two robots the same bodies, joints and actuators, created at zero size where lacking."""

import functools
from dataclasses import dataclass

import mujoco
import numpy as np

from revolver_lab.errors import MatchingError, RevolverError
from revolver_lab.evolution.assets import copy_asset
from revolver_lab.evolution.canonical import LISTS, Pairs, canonical, refuse_scaled_frames
from revolver_lab.evolution.growing import Grower, Twins
from revolver_lab.evolution.matching import Matching
from revolver_lab.evolution.naming import free_name
from revolver_lab.evolution.rerooting import reroot
from revolver_lab.evolution.shrinking import FREELY_SIZED
from revolver_lab.evolution.theta import Switch
from revolver_lab.evolution.touching import align_contacts

_KINDS = {
    "body": "bodies",
    "joint": "joints",
    "geom": "geoms",
    "site": "sites",
    "tendon": "tendons",
    "actuator": "actuators",
    "equality": "equalities",
    "sensor": "sensors",
    "pair": "pairs",
    "exclude": "excludes",
}


@dataclass(frozen=True, kw_only=True)
class Padded:
    """Two robots with the same bodies, joints and actuators.

    Attributes:
        source: The source, with what only the target has, at zero size.
        target: The target, likewise; its elements may come in another order.
        pairs: For each kind ("body", "joint", ...), (name in source, name in target).
        held: Joints that one robot has and the other holds still, by their names in the source:
            at which alpha they are held, 0 or 1.
        switches: What acts on the way, and not at all in the robot that lacks it.
    """

    source: mujoco.MjSpec
    target: mujoco.MjSpec
    pairs: dict[str, list[tuple[str, str]]]
    held: dict[str, int]
    switches: tuple[Switch, ...]


def pad(source: mujoco.MjSpec, target: mujoco.MjSpec, matching: Matching) -> Padded:
    """Create on either side, at zero size, what only the other one has.

    Where nothing has to be created both are returned as they are, and compile to the same arrays.
    The source keeps its root; a target that is rooted elsewhere is re-rooted. What is created
    hangs at the place that it has in the other robot, its lengths times `shrinking.EPSILON`.
    World geoms, lights, cameras and keyframes that only one robot has stay where they are.

    Args:
        source: A robot from `read_robot`.
        target: Another.
        matching: What corresponds in the two.

    Returns:
        The two padded robots, both of which compile, and what corresponds in them.

    Raises:
        MatchingError: If something to be created depends on a part of the other robot's scene,
            or a robot does not compile with it.
    """
    try:
        return _padded(source, target, matching)
    except RevolverError:
        raise
    except (ValueError, mujoco.FatalError) as error:
        message = " ".join(str(error).split())
        raise MatchingError(
            f"a robot that does not compile with what the other one has: MuJoCo says: {message}",
            "parts that either robot can have",
            "Mend what it names, or remove it from both robots.",
        ) from error


def _padded(source: mujoco.MjSpec, target: mujoco.MjSpec, matching: Matching) -> Padded:
    """Create on either side what only the other one has."""
    ours, theirs = _floating_root(source), _floating_root(target)
    moved = matching.source_root != ours or matching.target_root != theirs
    twins, back = _twins(matching)
    if not moved and not _lacks(source, target, twins, back):
        same = source.copy(), target.copy()
        return _finished(source, target, same, twins, {})
    for spec in (source, target):
        refuse_scaled_frames(spec)
    host, guest = canonical(source), canonical(target)
    if matching.source_root != ours:
        host = reroot(host, matching.source_root)
    if matching.target_root != theirs:
        guest = reroot(guest, matching.target_root)
    grown = host.copy(), guest.copy()
    growing = Grower(grown[0], guest, back), Grower(grown[1], host, twins)
    to_source, to_target = (one.grow() for one in growing)
    names = _joined(to_target, to_source)
    held = {here: end for here, there in names["joint"].items()
            for end, name in enumerate((here, there)) if name in growing[end].held}  # fmt: skip
    if matching.source_root != ours:
        grown = reroot(grown[0], ours), reroot(grown[1], names["body"][ours])
    return _finished(source, target, grown, names, held)


def _finished(
    source: mujoco.MjSpec, target: mujoco.MjSpec, grown: tuple[mujoco.MjSpec, mujoco.MjSpec],
    names: Twins, held: dict[str, int],
) -> Padded:  # fmt: skip
    """Settle what two robots with the same bodies, joints and actuators share besides."""
    _separate_meshes(*grown, names)
    pairs = _pairs(*grown, names)
    align_contacts(source, target, grown, pairs)
    switches = _released(source, target, grown[0], pairs)
    return Padded(source=grown[0], target=grown[1], pairs=pairs, held=held,
                  switches=switches)  # fmt: skip


def _released(
    source: mujoco.MjSpec, target: mujoco.MjSpec, grown: mujoco.MjSpec, pairs: Pairs
) -> tuple[Switch, ...]:
    """Let go of constraints exactly in the robot that lacks them.

    MuJoCo's least impedance, 1e-4, is still felt there. Anywhere else they hold as they are told.
    """
    ours = {equality.name for equality in source.equalities}
    theirs = {equality.name for equality in target.equalities}
    after_0 = float(np.nextafter(0.0, 1.0))
    return tuple(
        Switch(element=("equality", a), attribute="active", source=a in ours, target=b in theirs,
               alpha=1.0 if a in ours else after_0)
        for a, b in pairs["equality"]
        if not (a in ours and b in theirs) and grown.equality(a).active
    )  # fmt: skip


def _floating_root(spec: mujoco.MjSpec) -> str:
    """The first body with a free joint, "" where there is none."""
    free = mujoco.mjtJoint.mjJNT_FREE
    return next((b.name for b in spec.bodies if any(j.type == free for j in b.joints)), "")


def _twins(matching: Matching) -> tuple[Twins, Twins]:
    """The matched names of each kind, from source to target and back."""
    forth: Twins = {}
    back: Twins = {}
    for kind, plural in _KINDS.items():
        pairs = [(s, t) for s, t in getattr(matching, plural) if s is not None and t is not None]
        forth[kind] = dict(pairs)
        back[kind] = {t: s for s, t in pairs}
    return forth, back


def _lacks(source: mujoco.MjSpec, target: mujoco.MjSpec, twins: Twins, back: Twins) -> bool:
    """Whether one robot has something to be created in the other."""
    return any(
        element.name not in known[kind]
        for kind in ("body", "joint", "geom", "site", "tendon", "actuator", "equality", "sensor")
        for spec, known in ((source, twins), (target, back))
        for element in getattr(spec, _KINDS[kind])
        if not _is_scenery(kind, element)
    )


def _is_scenery(kind: str, element: object) -> bool:
    """Whether an element belongs to the scene, which is the source's."""
    if kind == "geom":
        return element.parent.name == "world" or element.type in FREELY_SIZED  # type: ignore
    return kind == "body" and element.name == "world"  # type: ignore[attr-defined]


def _joined(forth: Twins, back: Twins) -> Twins:
    """What corresponds after both have grown: source to target."""
    joined: Twins = {}
    for kind in _KINDS:
        joined[kind] = dict(forth.get(kind, {}))
        for there, here in back.get(kind, {}).items():
            joined[kind].setdefault(here, there)
        joined[kind].pop("world", None)
    return joined


def _pairs(
    source: mujoco.MjSpec, target: mujoco.MjSpec, twins: Twins
) -> dict[str, list[tuple[str, str]]]:
    """Pairs of every kind, in the source's order; cameras, lights and keys by equal names."""
    pairs: dict[str, list[tuple[str, str]]] = {}
    for kind, plural in (_KINDS | LISTS).items():
        names = [element.name for element in getattr(source, plural)]
        if kind in ("camera", "light", "key"):
            there = {element.name for element in getattr(target, plural)}
            pairs[kind] = [(name, name) for name in names if name in there]
        elif kind not in ("mesh", "hfield"):
            pairs[kind] = [(n, twins[kind][n]) for n in names if n in twins[kind]]
    pairs["mesh"] = _paired_meshes(source, target, pairs["geom"])
    return pairs


def _paired_meshes(
    source: mujoco.MjSpec, target: mujoco.MjSpec, geoms: list[tuple[str, str]]
) -> list[tuple[str, str]]:
    """Meshes of paired geoms, each source mesh once."""
    found: dict[str, str] = {}
    for a, b in geoms:
        meshes = source.geom(a).meshname, target.geom(b).meshname
        if all(meshes):
            found.setdefault(*meshes)
    return list(found.items())


def _separate_meshes(source: mujoco.MjSpec, target: mujoco.MjSpec, names: Twins) -> None:
    """Copy a mesh under a new name where its geoms become, or come from, different meshes."""
    forth: dict[str, str] = {}
    back: dict[str, str] = {}
    compiled = [functools.cache(spec.compile) for spec in (source, target)]
    for a, b in names["geom"].items():
        ours, theirs = source.geom(a), target.geom(b)
        if not ours.meshname or not theirs.meshname:
            continue
        if forth.get(ours.meshname, theirs.meshname) != theirs.meshname:
            _take_own_mesh(source, compiled[0](), ours)
        if back.get(theirs.meshname, ours.meshname) != ours.meshname:
            _take_own_mesh(target, compiled[1](), theirs)
        forth[ours.meshname], back[theirs.meshname] = theirs.meshname, ours.meshname


def _take_own_mesh(spec: mujoco.MjSpec, model: mujoco.MjModel, geom: mujoco.MjsGeom) -> None:
    """Give a geom a copy of its mesh."""
    mesh = next(m for m in spec.meshes if m.name == geom.meshname)
    name = free_name(mesh.name, {m.name for m in spec.meshes})
    copy_asset(spec, spec, model, "mesh", mesh, name)
    geom.meshname = name
