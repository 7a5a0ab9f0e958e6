"""Pairs everything that hangs on corresponding bodies and joints: geoms, sites, actuators, ..."""

from collections.abc import Callable, Hashable, Sequence

import mujoco
import numpy as np

Names = tuple[tuple[str | None, str | None], ...]
Key = Callable[[object], Hashable]
_Twins = dict[str | None, str | None]
_MESH = mujoco.mjtGeom.mjGEOM_MESH


def match_elements(
    source: mujoco.MjSpec, target: mujoco.MjSpec, bodies: _Twins, joints: _Twins, switching: bool
) -> dict[str, Names]:
    """Pair elements whose referents correspond and whose structure is the same.

    Equal names come first, then the order in the file.

    Args:
        source: The source robot.
        target: The target robot.
        bodies: Target's body of each source body, None where there is none.
        joints: The same for joints.
        switching: Whether a geom that touches may correspond to one that is only drawn.

    Returns:
        Pairs of names for each kind, by the plural that Matching uses.
    """
    twins: dict[str, _Twins] = {"body": {**bodies, "world": "world"}, "joint": joints}
    cameras = {camera.name for camera in target.cameras}  # which correspond by their names
    twins["camera"] = {each.name: each.name for each in source.cameras if each.name in cameras}
    found: dict[str, Names] = {}

    def add(plural: str, kind: str, *keys: tuple[Key, Key]) -> None:
        """Pair one kind and remember it for the kinds that refer to it."""
        first, second = getattr(source, plural), getattr(target, plural)
        found[plural] = _pair(first, second, *keys)
        twins[kind] = {s: t for s, t in found[plural] if s is not None}

    shapes = _mesh_shapes(source), _mesh_shapes(target)
    driven = _driven_sites(source), _driven_sites(target)
    # What is only drawn goes with what is only drawn; where one may switch, then with the rest.
    add("geoms", "geom", *(
        (_geom_key(shapes[0], twins, finer), _geom_key(shapes[1], None, finer))
        for finer in ((True, False) if switching else (True,))
    ))  # fmt: skip
    add("sites", "site", (_site_key(driven[0], twins), _site_key(driven[1], None)))
    found["geoms"], found["scenery"] = _without_lone_scenery(source, target, found["geoms"])
    add("tendons", "tendon", (lambda e: _path(e, twins), lambda e: _path(e, None)))
    add("actuators", "actuator", (lambda e: _drive(e, twins), lambda e: _drive(e, None)))
    for plural, key in (("equalities", _equality), ("pairs", _contact), ("excludes", _exclude)):
        add(plural, plural, (lambda e, k=key: k(e, twins), lambda e, k=key: k(e, None)))
    add("sensors", "sensor", (lambda e: _sensor(e, twins), lambda e: _sensor(e, None)))
    found["meshes"] = _used_meshes(source, target, found["geoms"])
    return found


def _pair(ours: Sequence, theirs: Sequence, *rounds: tuple[Key, Key]) -> Names:
    """Pair elements of equal keys, round by round: equal names first, then in order."""
    pairs: dict[str, str] = {}
    for our_key, their_key in rounds:
        taken = set(pairs.values())
        waiting: dict[Hashable, list[str]] = {}
        for element in theirs:
            if element.name not in taken:
                waiting.setdefault(their_key(element), []).append(element.name)
        keys = {element.name: our_key(element) for element in ours if element.name not in pairs}
        for name, key in keys.items():
            if key is not None and name in waiting.get(key, []):
                waiting[key].remove(name)
                pairs[name] = name
        for name, key in keys.items():
            if name not in pairs and key is not None and waiting.get(key):
                pairs[name] = waiting[key].pop(0)
    taken = set(pairs.values())
    lone = [(None, element.name) for element in theirs if element.name not in taken]
    return (*((element.name, pairs.get(element.name)) for element in ours), *lone)


def _twin(twins: dict[str, _Twins] | None, kind: str, name: str) -> str | None:
    """What a referent is called in the target: itself for the target's own elements."""
    if twins is None or not name:
        return name
    return twins.get(kind, {}).get(name)


def _geom_key(shapes: dict[str, Hashable], twins: dict[str, _Twins] | None, finer: bool) -> Key:
    """Geoms correspond in corresponding bodies if their type, and a mesh's topology, agree.

    The finer key tells those that touch nothing from the others, but for the scene's: they stay.
    """

    def key(geom: mujoco.MjsGeom) -> Hashable:
        body = _twin(twins, "body", geom.parent.name)
        shape = shapes.get(geom.meshname) if geom.type == _MESH else geom.hfieldname
        touches = bool(geom.contype or geom.conaffinity)
        touches = touches and finer and geom.parent.name != "world"
        return None if body is None else (body, geom.type, shape, touches)

    return key


def _site_key(driven: set[tuple[str, object]], twins: dict[str, _Twins] | None) -> Key:
    """Sites correspond in corresponding bodies; those with an actuator among themselves."""
    drives = dict(driven)

    def key(site: object) -> Hashable:
        body = _twin(twins, "body", site.parent.name)  # type: ignore[attr-defined]
        drive = drives.get(site.name)  # type: ignore[attr-defined]
        return None if body is None else (body, site.type, drive)  # type: ignore[attr-defined]

    return key


def _driven_sites(spec: mujoco.MjSpec) -> set[tuple[str, object]]:
    """Sites that an actuator pulls on, with the kind of transmission."""
    kinds = (mujoco.mjtTrn.mjTRN_SITE, mujoco.mjtTrn.mjTRN_SLIDERCRANK)
    return {(a.target, a.trntype) for a in spec.actuators if a.trntype in kinds}


def _mesh_shapes(spec: mujoco.MjSpec) -> dict[str, Hashable]:
    """Number of vertices and the faces of each mesh, as compiled, and how it is mirrored.

    Between a mesh and its mirror image there is a flat one, which is none.
    """
    if not spec.meshes:
        return {}
    model = spec.compile()
    shapes = {}
    for mesh in spec.meshes:
        i = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_MESH, mesh.name)
        first = model.mesh_faceadr[i]
        faces = model.mesh_face[first : first + model.mesh_facenum[i]]
        mirrored = tuple(np.array(mesh.scale) < 0.0)
        shapes[mesh.name] = (int(model.mesh_vertnum[i]), faces.tobytes(), mirrored)
    return shapes


def _without_lone_scenery(
    source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Names
) -> tuple[Names, Names]:
    """Part the scene's geoms that only one robot has from the others: the scene is the source's.

    What has no size of its own, a plane say, cannot be created, and counts as scene on any body.
    """
    endless = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    scene = [
        {g.name for g in spec.geoms if g.parent.name == "world" or g.type in endless}
        for spec in (source, target)
    ]
    lone = tuple(p for p in pairs if None in p and (p[0] in scene[0] or p[1] in scene[1]))
    return tuple(p for p in pairs if p not in lone), lone


def _path(tendon: object, twins: dict[str, _Twins] | None) -> Hashable:
    """What a tendon runs over: tendons correspond if their whole paths do."""
    kinds = {
        mujoco.mjtWrap.mjWRAP_JOINT: "joint",
        mujoco.mjtWrap.mjWRAP_SITE: "site",
        mujoco.mjtWrap.mjWRAP_SPHERE: "geom",
        mujoco.mjtWrap.mjWRAP_CYLINDER: "geom",
    }
    path = []
    for wrap in tendon.path:  # type: ignore[attr-defined]
        kind = kinds.get(wrap.type)
        name = _twin(twins, kind, wrap.target.name) if kind else ""
        side = wrap.sidesite.name if kind == "geom" and wrap.sidesite else ""
        path.append((wrap.type, name, _twin(twins, "site", side)))
    return None if any(None in step for step in path) else tuple(path)


def _drive(actuator: object, twins: dict[str, _Twins] | None) -> Hashable:
    """What an actuator drives, and how."""
    trn = mujoco.mjtTrn
    kinds = {
        trn.mjTRN_JOINT: "joint",
        trn.mjTRN_JOINTINPARENT: "joint",
        trn.mjTRN_BODY: "body",
        trn.mjTRN_SITE: "site",
        trn.mjTRN_SLIDERCRANK: "site",
        trn.mjTRN_TENDON: "tendon",
    }
    a = actuator
    names = (
        _twin(twins, kinds[a.trntype], a.target),  # type: ignore[attr-defined]
        _twin(twins, "site", a.refsite),  # type: ignore[attr-defined]
        _twin(twins, "site", a.slidersite),  # type: ignore[attr-defined]
    )
    return None if None in names else (a.trntype, *names)  # type: ignore[attr-defined]


def _equality(equality: object, twins: dict[str, _Twins] | None) -> Hashable:
    """What an equality constraint ties together."""
    eq = mujoco.mjtEq
    e = equality
    kind = {eq.mjEQ_JOINT: "joint", eq.mjEQ_TENDON: "tendon"}.get(e.type)  # type: ignore
    kind = kind or object_kind(e.objtype)  # type: ignore[attr-defined]
    names = _twin(twins, kind, e.name1), _twin(twins, kind, e.name2)  # type: ignore[attr-defined]
    return None if None in names else (e.type, e.objtype, *names)  # type: ignore[attr-defined]


def _contact(pair: object, twins: dict[str, _Twins] | None) -> Hashable:
    """The two geoms of an explicit contact pair, in any order."""
    names = [_twin(twins, "geom", n) for n in (pair.geomname1, pair.geomname2)]  # type: ignore
    return None if None in names else frozenset(names)


def _exclude(exclude: object, twins: dict[str, _Twins] | None) -> Hashable:
    """The two bodies of an excluded contact, in any order."""
    names = [_twin(twins, "body", n) for n in (exclude.bodyname1, exclude.bodyname2)]  # type: ignore
    return None if None in names else frozenset(names)


def _sensor(sensor: object, twins: dict[str, _Twins] | None) -> Hashable:
    """What a sensor measures, and on what."""
    s = sensor
    names = (
        _twin(twins, object_kind(s.objtype), s.objname),  # type: ignore[attr-defined]
        _twin(twins, object_kind(s.reftype), s.refname),  # type: ignore[attr-defined]
    )
    return None if None in names else (s.type, s.objtype, s.reftype, *names)  # type: ignore


def object_kind(object_type: mujoco.mjtObj) -> str:
    """The kind of element that an mjtObj means; both frames of a body are the body's.

    Example:
        >>> object_kind(mujoco.mjtObj.mjOBJ_XBODY)
        'body'
    """
    name = mujoco.mjtObj(object_type).name.removeprefix("mjOBJ_").lower()
    return "body" if name == "xbody" else name


def _used_meshes(source: mujoco.MjSpec, target: mujoco.MjSpec, geoms: Names) -> Names:
    """Meshes of paired geoms: each source mesh with the first target mesh it meets."""
    pairs: dict[str, str] = {}
    for s, t in geoms:
        if s is not None and t is not None and source.geom(s).type == _MESH:
            partner = target.geom(t).meshname
            if partner not in pairs.values():
                pairs.setdefault(source.geom(s).meshname, partner)
    return tuple(pairs.items())
