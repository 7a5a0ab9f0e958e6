"""One way to write a robot: radians, quaternions, no frames; and two robots in the same form."""

from collections.abc import Iterable, Sequence

import mujoco
import numpy as np

from revolver_lab.errors import ParameterError
from revolver_lab.evolution.tendon_paths import places

Pairs = dict[str, list[tuple[str, str]]]

LISTS = {
    "body": "bodies",
    "joint": "joints",
    "geom": "geoms",
    "site": "sites",
    "mesh": "meshes",
    "actuator": "actuators",
    "tendon": "tendons",
    "equality": "equalities",
    "pair": "pairs",
    "camera": "cameras",
    "light": "lights",
    "key": "keys",
}
_ANGULAR = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_BALL)
_RADIANS_PER_DEGREE = np.pi / 180.0


def elements(spec: mujoco.MjSpec, kind: str) -> dict[str, object]:
    """The elements of one kind by name; a "wrap" is a place on a tendon's path."""
    if kind == "option":
        return {"world": spec.option}
    if kind == "wrap":
        return dict(places(spec))
    return {element.name: element for element in getattr(spec, LISTS[kind])}


def canonical(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """A copy of the robot that compiles to the same model and is written in the one form.

    Angles become radians, every orientation a quaternion, nested frames are folded into what
    they hold, and "auto" limits are spelled out.

    Args:
        spec: A robot that compiles; it is left as it was.
    """
    spec = spec.copy()
    model = spec.compile()
    for kind in ("body", "geom", "site", "camera"):
        for element in getattr(spec, LISTS[kind]):
            _fold_orientation(spec, element)
    for joint in spec.joints:
        _fold_joint(joint, model)
    for light in spec.lights:
        light.dir, light.pos = _folded(light.frame, light.dir, rotate_only=True), _folded(
            light.frame, light.pos
        )
    for frame in spec.frames:
        frame.pos, frame.quat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        frame.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    spec.compiler.degree = False
    _spell_out_limits(spec, model)
    return spec


def _resolved(spec: mujoco.MjSpec, element: object, quat: str = "quat", alt: str = "alt"):
    """The orientation of an element as a quaternion, however it was written, (4,)."""
    orientation = getattr(element, alt)
    if orientation.type == mujoco.mjtOrientation.mjORIENTATION_QUAT:
        return np.array(getattr(element, quat))
    compiler = getattr(element, "compiler", None) or spec.compiler
    return np.array(
        spec.resolve_orientation(
            degree=compiler.degree, sequence=compiler.eulerseq, orientation=orientation
        )
    )


def _frame_pose(frame: object) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) and quaternion (4,) of a frame in its body, through the frames around it."""
    orientation = frame.alt  # type: ignore[attr-defined]
    quat = np.array(frame.quat)  # type: ignore[attr-defined]
    if orientation.type != mujoco.mjtOrientation.mjORIENTATION_QUAT:
        compiler = frame.compiler  # type: ignore[attr-defined]
        quat = np.array(
            mujoco.MjSpec.resolve_orientation(
                degree=compiler.degree, sequence=compiler.eulerseq, orientation=orientation
            )
        )
    pos = np.array(frame.pos)  # type: ignore[attr-defined]
    around = frame.frame  # type: ignore[attr-defined]
    if around is None:
        return pos, quat
    return _in_frame(around, pos, quat)


def _in_frame(frame: object, pos: np.ndarray, quat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A pose within a frame, re-expressed in the frame's body."""
    frame_pos, frame_quat = _frame_pose(frame)
    mujoco.mju_normalize4(frame_quat)
    out_pos, out_quat = np.empty(3), np.empty(4)
    mujoco.mju_mulPose(out_pos, out_quat, frame_pos, frame_quat, pos, quat)
    return out_pos, out_quat


def _folded(frame: object | None, vector: Sequence[float], *, rotate_only: bool = False):
    """A point, or a direction, given within a frame, re-expressed in the frame's body, (3,)."""
    point = np.array(vector, dtype=float)
    if frame is None:
        return point
    pos, _ = _in_frame(frame, point, np.array([1.0, 0, 0, 0]))
    return pos - _frame_pose(frame)[0] if rotate_only else pos


def _fold_orientation(spec: mujoco.MjSpec, element: object) -> None:
    """Write an element's pose as pos and quat in its body."""
    quat = _resolved(spec, element)
    element.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT  # type: ignore[attr-defined]
    pos, frame = np.array(element.pos), element.frame  # type: ignore[attr-defined]
    if frame is not None:
        if has_fromto(element):
            ends = np.array(element.fromto).reshape(2, 3)  # type: ignore[attr-defined]
            element.fromto = np.ravel([_folded(frame, end) for end in ends])  # type: ignore
        mujoco.mju_normalize4(quat)
        pos, quat = _in_frame(frame, pos, quat)
    element.pos, element.quat = pos, quat  # type: ignore[attr-defined]


def _fold_joint(joint: object, model: mujoco.MjModel) -> None:
    """Write a joint in its body, in radians, with its spring's constants spelled out."""
    j = joint
    j.pos, j.axis = _folded(j.frame, j.pos), _folded(j.frame, j.axis, rotate_only=True)  # type: ignore
    limited = bool(model.jnt_limited[j.id])  # type: ignore[attr-defined]
    if j.compiler.degree and j.type in _ANGULAR:  # type: ignore[attr-defined]
        # MuJoCo leaves the range of an unlimited joint as it was written.
        for attribute in ("range", "ref", "springref") if limited else ("ref", "springref"):
            setattr(j, attribute, np.array(getattr(j, attribute)) * _RADIANS_PER_DEGREE)
    j.limited = int(limited)  # type: ignore[attr-defined]
    j.actfrclimited = int(model.jnt_actfrclimited[j.id])  # type: ignore[attr-defined]


def _spell_out_limits(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Replace "auto" limits of actuators and tendons by what the compiler made of them."""
    flags = ("ctrllimited", "forcelimited", "actlimited")
    for i, actuator in enumerate(spec.actuators):
        for flag in flags:
            values = getattr(model, f"actuator_{flag}")
            if len(values) == len(spec.actuators):
                setattr(actuator, flag, int(values[i]))
    for i, tendon in enumerate(spec.tendons):
        tendon.limited = int(model.tendon_limited[i])
        tendon.actfrclimited = int(model.tendon_actfrclimited[i])


def has_fromto(element: object) -> bool:
    """Whether a geom or site is written by its two ends."""
    fromto = getattr(element, "fromto", None)
    return fromto is not None and bool(np.isfinite(fromto[0]))


def align(source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs) -> None:
    """Bring two canonical robots to the same form wherever they were written differently.

    Ends become pose and size where only one robot gives ends; masses become explicit where one
    robot states an inertia, or a mass, that the other infers.

    Args:
        source: A canonical robot, changed in place.
        target: The other one, changed in place.
        pairs: For each kind of element, (name in source, name in target); "wrap" is added.
    """
    models = source.compile(), target.compile()
    pairs["wrap"] = _paired_wraps(source, target, pairs)
    for kind in ("geom", "site"):
        for a, b in _paired(source, target, pairs, kind):
            if has_fromto(a) != has_fromto(b):
                _ends_to_pose(a, models[0], kind)
                _ends_to_pose(b, models[1], kind)
    for a, b in _paired(source, target, pairs, "joint"):
        if np.any(a.springdamper) != np.any(b.springdamper):  # type: ignore[attr-defined]
            _spell_out_spring(a, models[0])
            _spell_out_spring(b, models[1])
    _align_inertias(source, target, pairs, models)


def _paired(
    source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs, kind: str
) -> Iterable[tuple[object, object]]:
    """The paired elements of one kind."""
    ours, theirs = elements(source, kind), elements(target, kind)
    return ((ours[a], theirs[b]) for a, b in pairs.get(kind, []))


def _paired_wraps(
    source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs
) -> list[tuple[str, str]]:
    """The places on paired tendons, in the order of their paths."""
    paired = []
    for a, b in _paired(source, target, pairs, "tendon"):
        lengths = len(a.path), len(b.path)  # type: ignore[attr-defined]
        if lengths[0] != lengths[1]:
            raise ParameterError(
                f"tendon {a.name!r} over {lengths[0]} places, and over {lengths[1]}",  # type: ignore
                "as many places on both paths",
                "Give both tendons the same path; a coefficient of 0 adds a place without effect.",
            )
        paired += [(f"{a.name}.{i}", f"{b.name}.{i}") for i in range(lengths[0])]  # type: ignore
    return paired


def _ends_to_pose(element: object, model: mujoco.MjModel, kind: str) -> None:
    """Replace fromto by the pos, quat and size that the compiler made of it."""
    if not has_fromto(element):
        return
    for attribute in ("pos", "quat", "size"):
        value = getattr(model, f"{kind}_{attribute}")[element.id]  # type: ignore[attr-defined]
        setattr(element, attribute, np.array(value))
    element.fromto = np.array([np.nan, 0, 0, 0, 0, 0])  # type: ignore[attr-defined]


def _spell_out_spring(joint: object, model: mujoco.MjModel) -> None:
    """Replace springdamper by the stiffness and damping that the compiler made of it."""
    dof = model.jnt_dofadr[joint.id]  # type: ignore[attr-defined]
    joint.stiffness[0] = model.jnt_stiffness[joint.id]  # type: ignore[attr-defined]
    joint.damping[0] = model.dof_damping[dof]  # type: ignore[attr-defined]
    joint.springdamper = np.zeros(2)  # type: ignore[attr-defined]


def _infers_differently(source: mujoco.MjSpec, target: mujoco.MjSpec) -> bool:
    """Whether the two compilers would infer different inertias from the same geoms."""
    rules = ("inertiafromgeom", "settotalmass", "balanceinertia", "boundmass", "boundinertia")
    a, b = source.compiler, target.compiler
    same = all(getattr(a, rule) == getattr(b, rule) for rule in rules)
    return not (same and np.array_equal(a.inertiagrouprange, b.inertiagrouprange))


def _states_inertia(body: object, spec: mujoco.MjSpec) -> bool:
    """Whether a body's inertia is written down, and not inferred from its geoms."""
    from_geoms = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    return bool(body.explicitinertial) and spec.compiler.inertiafromgeom != from_geoms  # type: ignore


def _align_inertias(
    source: mujoco.MjSpec,
    target: mujoco.MjSpec,
    pairs: Pairs,
    models: tuple[mujoco.MjModel, mujoco.MjModel],
) -> None:
    """Let paired bodies state their inertia both, or infer it both in the same way."""
    differ = _infers_differently(source, target)
    mixed = _mixed_masses(source, target, pairs)
    for a, b in _paired(source, target, pairs, "body"):
        if a.name == "world":  # type: ignore[attr-defined]
            continue
        stated = _states_inertia(a, source), _states_inertia(b, target)
        if differ or any(stated) or a.name in mixed:  # type: ignore[attr-defined]
            _state_inertia(a, models[0])
            _state_inertia(b, models[1])
    for a, b in _paired(source, target, pairs, "geom"):
        if a.parent.name in mixed:  # type: ignore[attr-defined]
            a.mass = b.mass = np.nan  # type: ignore[attr-defined]
    if differ:
        _stop_inferring(source.compiler)
        _stop_inferring(target.compiler)


def _mixed_masses(source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs) -> set[str]:
    """Names of source bodies with a geom that states its mass on one side only, or of two types."""
    return {
        a.parent.name  # type: ignore[attr-defined]
        for a, b in _paired(source, target, pairs, "geom")
        if np.isnan(a.mass) != np.isnan(b.mass) or a.type != b.type  # type: ignore[attr-defined]
    }


def _state_inertia(body: object, model: mujoco.MjModel) -> None:
    """Write down the inertia that the compiler found for a body."""
    i = body.id  # type: ignore[attr-defined]
    if model.body_mass[i] <= 0.0:
        return
    body.explicitinertial = True  # type: ignore[attr-defined]
    body.fullinertia = [np.nan, 0, 0, 0, 0, 0]  # type: ignore[attr-defined]
    body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT  # type: ignore[attr-defined]
    for attribute in ("mass", "ipos", "iquat", "inertia"):
        setattr(body, attribute, getattr(model, f"body_{attribute}")[i])


def _stop_inferring(compiler: object) -> None:
    """Let the stated inertias stand as they are."""
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO  # type: ignore
    compiler.settotalmass, compiler.balanceinertia = -1.0, False  # type: ignore[attr-defined]
    compiler.boundmass, compiler.boundinertia = 0.0, 0.0  # type: ignore[attr-defined]


def refuse_scaled_frames(spec: mujoco.MjSpec) -> None:
    """Refuse frames that scale what they hold: their scale has no canonical form here.

    Raises:
        ParameterError: If a frame has a scale other than one.
    """
    for frame in spec.frames:
        if not np.allclose(getattr(frame, "scale", 1.0), 1.0):
            raise ParameterError(
                f"frame {frame.name!r} with a scale",
                "frames that only move and turn",
                "Write the scaled sizes out in the file.",
            )
