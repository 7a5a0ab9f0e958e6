"""Two robots in the same form, wherever their authors wrote the same thing in two ways."""

from collections.abc import Iterable

import mujoco
import numpy as np

from revolver_lab.errors import ParameterError
from revolver_lab.evolution.automatic import FOUND, refuse_other_states, spell_out
from revolver_lab.evolution.canonical import Element, Pairs, elements, has_fromto
from revolver_lab.evolution.inertias import infer_alike, state_inertia, stop_inferring
from revolver_lab.evolution.laws import align_activations, align_laws, align_muscles
from revolver_lab.evolution.parameters import DISCRETE
from revolver_lab.evolution.terrains import align_terrains

_ROUND = (
    mujoco.mjtGeom.mjGEOM_CAPSULE,
    mujoco.mjtGeom.mjGEOM_CYLINDER,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID,
)


def align(
    source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs, *, switching: bool = False
) -> None:
    """Bring two canonical robots to the same form wherever they were written differently.

    Ends become pose and size where only one robot gives ends, or something depends on the frame
    that MuJoCo makes of them; masses become explicit where one robot states an inertia, or a mass,
    that the other infers; so do terrains, and all else that MuJoCo finds by itself. A motor beside
    a servo is a servo of no stiffness.

    Args:
        source: A canonical robot, changed in place.
        target: The other one, changed in place.
        pairs: For each kind of element, (name in source, name in target); "wrap" and "hfield" are
            added.
        switching: Whether what differs may switch somewhere along the path.
    """
    motors = list(_paired(source, target, pairs, "actuator"))
    align_activations(source, target, motors, switching=switching)
    models = source.compile(), target.compile()
    if models[1].narena > models[0].narena:  # one memory for the whole path
        source.memory = int(models[1].narena)
    pairs["wrap"] = _paired_wraps(source, target, pairs)
    pairs["hfield"] = align_terrains(source, target, pairs, models)
    felt = [_sensed(spec, mujoco.mjtObj.mjOBJ_GEOM) for spec in (source, target)]
    for kind in ("geom", "site"):
        for a, b in _paired(source, target, pairs, kind):
            if np.array_equal(a.fromto, b.fromto, equal_nan=True):
                continue
            plain = all(_is_all_ends(each, names) for each, names in zip((a, b), felt))
            if not plain:
                _ends_to_pose(a, models[0], kind)
                _ends_to_pose(b, models[1], kind)
            elif _are_opposed(a, b):  # halfway between their ends it would have no length
                b.fromto = np.roll(b.fromto, 3)
    for kind in FOUND:
        for a, b in _paired(source, target, pairs, kind):
            spell_out(kind, a, b, models)
    for a, b in motors:
        refuse_other_states(a, b, models)
        align_muscles(a, b, models)
        align_laws(a, b)
    for a, b in _paired(source, target, pairs, "key"):
        _align_keys(a, b, models)
    seen = [_sensed(spec, mujoco.mjtObj.mjOBJ_CAMERA) for spec in (source, target)]
    for a, b in _paired(source, target, pairs, "camera"):
        if a.name not in seen[0] and b.name not in seen[1]:  # it is only looked through
            for attribute in DISCRETE["camera"]:
                setattr(b, attribute, getattr(a, attribute))
    for a, b in _paired(source, target, pairs, "body"):
        if _simple_in_places(a, b, models):
            a.simple = b.simple = 0
    _align_inertias(source, target, pairs, models)


def _paired(
    source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs, kind: str
) -> Iterable[tuple[Element, Element]]:
    """The paired elements of one kind."""
    ours, theirs = elements(source, kind), elements(target, kind)
    return ((ours[a], theirs[b]) for a, b in pairs.get(kind, []))


def _paired_wraps(
    source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs
) -> list[tuple[str, str]]:
    """The places on paired tendons, in the order of their paths."""
    paired = []
    for a, b in _paired(source, target, pairs, "tendon"):
        lengths = len(a.path), len(b.path)
        if lengths[0] != lengths[1]:
            raise ParameterError(
                f"tendon {a.name!r} over {lengths[0]} places, and over {lengths[1]}",
                "as many places on both paths",
                "Give both tendons the same path; a coefficient of 0 adds a place without effect.",
            )
        paired += [(f"{a.name}.{i}", f"{b.name}.{i}") for i in range(lengths[0])]
    return paired


def _ends_to_pose(element: Element, model: mujoco.MjModel, kind: str) -> None:
    """Replace fromto by the pos, quat and size that the compiler made of it."""
    if not has_fromto(element):
        return
    for attribute in ("pos", "quat", "size"):
        value = getattr(model, f"{kind}_{attribute}")[element.id]
        setattr(element, attribute, np.array(value))
    element.fromto = np.array([np.nan, 0, 0, 0, 0, 0])


def _are_opposed(a: Element, b: Element) -> bool:
    """Whether the ends of one are given in the other order."""
    (start, end), (begin, stop) = (np.array(each.fromto).reshape(2, 3) for each in (a, b))
    return bool((stop - begin) @ (end - start) < 0.0)


def _sensed(spec: mujoco.MjSpec, kind: mujoco.mjtObj) -> set[str]:
    """Names of the geoms, or cameras, that a sensor refers to, and may tell the frame of."""
    named = [(each.objtype, each.objname) for each in spec.sensors]
    named += [(each.reftype, each.refname) for each in spec.sensors]
    return {name for found, name in named if found == kind}


def _is_all_ends(element: Element, sensed: set[str]) -> bool:
    """Whether nothing depends on more of an element than where its two ends are.

    MuJoCo turns z to the line between them, the shortest way: with the ends swapped, or for one
    that points down at first and then nearly so, that is another frame about the same line. Sites
    push and measure in it, boxes have corners, surfaces move along it.
    """
    if not has_fromto(element) or element.type not in _ROUND:
        return False
    site = isinstance(element, mujoco.MjsSite)
    return not (site or element.name in sensed or np.any(element.surfacevel))


def _align_keys(a: Element, b: Element, models: tuple[mujoco.MjModel, mujoco.MjModel]) -> None:
    """Let both keyframes state what only one states."""
    for field in ("qpos", "qvel", "act", "ctrl", "mpos", "mquat"):
        if bool(len(getattr(a, field))) != bool(len(getattr(b, field))):
            for key, model in zip((a, b), models):
                setattr(key, field, getattr(model, f"key_{field}")[key.id].tolist())


def _simple_in_places(
    a: Element, b: Element, models: tuple[mujoco.MjModel, mujoco.MjModel]
) -> bool:
    """Whether MuJoCo's shortcut for bodies of diagonal inertia can hold here and not there.

    It changes the layout of a model. It depends on where the centre of mass and the axes are.
    """
    told = []
    for body, model in zip((a, b), models):
        joints = slice(model.body_jntadr[body.id], model.body_jntadr[body.id] + len(body.joints))
        told.append((model.body_ipos[body.id], model.body_iquat[body.id],
                     model.jnt_pos[joints], model.jnt_axis[joints]))  # fmt: skip
    simple = any(model.body_simple[body.id] for body, model in zip((a, b), models))
    return simple and any(not np.array_equal(x, y) for x, y in zip(*told))


def _states_inertia(body: Element) -> bool:
    """Whether a body's inertia is written down, and not inferred from its geoms."""
    from_geoms = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    return bool(body.explicitinertial) and body.compiler.inertiafromgeom != from_geoms


def _align_inertias(
    source: mujoco.MjSpec,
    target: mujoco.MjSpec,
    pairs: Pairs,
    models: tuple[mujoco.MjModel, mujoco.MjModel],
) -> None:
    """Let paired bodies state their inertia both, or infer it both in the same way."""
    differ = not infer_alike(source.compiler, target.compiler)
    mixed = _mixed_masses(source, target, pairs)
    for a, b in _paired(source, target, pairs, "body"):
        if a.name == "world":
            continue
        if differ or _states_inertia(a) or _states_inertia(b) or a.name in mixed:
            state_inertia(a, models[0])
            state_inertia(b, models[1])
    for a, b in _paired(source, target, pairs, "geom"):
        if a.parent.name in mixed:
            a.mass = b.mass = np.nan
    if differ:
        stop_inferring(source.compiler)
        stop_inferring(target.compiler)


def _mixed_masses(source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs) -> set[str]:
    """Names of source bodies with a geom of two types, or of which one robot alone states the mass.

    Or counts it: a compiler may look at the geoms of some groups only.
    """
    ranges = [spec.compiler.inertiagrouprange for spec in (source, target)]
    return {
        a.parent.name
        for a, b in _paired(source, target, pairs, "geom")
        if np.isnan(a.mass) != np.isnan(b.mass) or a.type != b.type
        or len({low <= e.group <= high for e, (low, high) in zip((a, b), ranges)}) > 1
    }  # fmt: skip
