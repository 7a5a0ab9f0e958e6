"""One way to write a robot: radians, quaternions, no frames."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import ParameterError
from revolver_lab.evolution.tendon_paths import places

# An MjsBody, MjsGeom, ...: the bindings give them no common type.
Element = Any
Pairs = dict[str, list[tuple[str, str]]]

LISTS = {
    "body": "bodies",
    "joint": "joints",
    "geom": "geoms",
    "site": "sites",
    "mesh": "meshes",
    "hfield": "hfields",
    "actuator": "actuators",
    "tendon": "tendons",
    "equality": "equalities",
    "pair": "pairs",
    "sensor": "sensors",
    "camera": "cameras",
    "light": "lights",
    "key": "keys",
}
_ANGULAR = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_BALL)
_ALIGN = mujoco.mjtAlignFree
_RADIANS_PER_DEGREE = np.pi / 180.0


def elements(spec: mujoco.MjSpec, kind: str) -> dict[str, Element]:
    """The elements of one kind by name; a "wrap" is a place on a tendon's path."""
    if kind == "option":
        return {"world": spec.option}
    if kind == "wrap":
        return dict(places(spec))
    return {element.name: element for element in getattr(spec, LISTS[kind])}


def canonical(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """A copy of the robot that compiles to the same model and is written in the one form.

    Angles become radians, every orientation a quaternion, nested frames are folded into what
    they hold, "auto" limits are spelled out, and primitives fitted to a mesh are plain ones.

    Args:
        spec: A robot that compiles; it is left as it was.
    """
    refuse_scaled_frames(spec)
    spec = spec.copy()
    model = spec.compile()
    for kind in ("body", "geom", "site", "camera"):
        for element in getattr(spec, LISTS[kind]):
            _fold_orientation(spec, element)
    for joint in spec.joints:
        _fold_joint(joint, model)
    for light in spec.lights:
        light.dir, light.pos = (
            _folded(light.frame, light.dir, rotate_only=True),
            _folded(light.frame, light.pos),
        )
    for frame in spec.frames:
        frame.pos, frame.quat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        frame.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    spec.compiler.degree = False
    _spell_out_limits(spec, model)
    _spell_out_fits(spec, model)
    return spec


def _resolved(spec: mujoco.MjSpec, element: Element, quat: str = "quat", alt: str = "alt"):
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


def _frame_pose(frame: Element) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) and quaternion (4,) of a frame in its body, through the frames around it."""
    orientation = frame.alt
    quat = np.array(frame.quat)
    if orientation.type != mujoco.mjtOrientation.mjORIENTATION_QUAT:
        compiler = frame.compiler
        quat = np.array(
            mujoco.MjSpec.resolve_orientation(
                degree=compiler.degree, sequence=compiler.eulerseq, orientation=orientation
            )
        )
    pos = np.array(frame.pos)
    around = frame.frame
    if around is None:
        return pos, quat
    return _in_frame(around, pos, quat)


def _in_frame(frame: Element, pos: np.ndarray, quat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A pose within a frame, re-expressed in the frame's body."""
    frame_pos, frame_quat = _frame_pose(frame)
    mujoco.mju_normalize4(frame_quat)
    out_pos, out_quat = np.empty(3), np.empty(4)
    mujoco.mju_mulPose(out_pos, out_quat, frame_pos, frame_quat, pos, quat)
    return out_pos, out_quat


def _folded(frame: Element | None, vector: ArrayLike, *, rotate_only: bool = False):
    """A point, or a direction, given within a frame, re-expressed in the frame's body, (3,)."""
    point = np.array(vector, dtype=float)
    if frame is None:
        return point
    pos, _ = _in_frame(frame, point, np.array([1.0, 0, 0, 0]))
    return pos - _frame_pose(frame)[0] if rotate_only else pos


def _fold_orientation(spec: mujoco.MjSpec, element: Element) -> None:
    """Write an element's pose as pos and quat in its body."""
    quat = _resolved(spec, element)
    element.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    pos, frame = np.array(element.pos), element.frame
    if frame is not None and has_fromto(element):  # the two ends are its whole pose
        ends = np.array(element.fromto).reshape(2, 3)
        element.fromto = np.ravel([_folded(frame, end) for end in ends])
        return
    if frame is not None:
        mujoco.mju_normalize4(quat)
        pos, quat = _in_frame(frame, pos, quat)
    element.pos, element.quat = pos, quat


def _fold_joint(joint: Element, model: mujoco.MjModel) -> None:
    """Write a joint in its body, in radians, with its spring's constants spelled out."""
    j = joint
    j.pos, j.axis = _folded(j.frame, j.pos), _folded(j.frame, j.axis, rotate_only=True)
    limited = bool(model.jnt_limited[j.id])
    if j.compiler.degree and j.type in _ANGULAR:
        # MuJoCo leaves the range of an unlimited joint as it was written.
        for attribute in ("range", "ref", "springref") if limited else ("ref", "springref"):
            setattr(j, attribute, np.array(getattr(j, attribute)) * _RADIANS_PER_DEGREE)
    j.limited = int(limited)
    j.actfrclimited = int(model.jnt_actfrclimited[j.id])
    # MuJoCo aligns a free body to its inertia only where nothing hangs on it.
    asked = j.compiler.alignfree if j.align == _ALIGN.mjALIGNFREE_AUTO else int(j.align)
    j.align = _ALIGN.mjALIGNFREE_TRUE if asked and not j.parent.bodies else _ALIGN.mjALIGNFREE_FALSE


def _spell_out_limits(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Replace "auto" limits of actuators and tendons by what the compiler made of them."""
    for i, actuator in enumerate(spec.actuators):
        for flag in ("forcelimited", "actlimited"):
            setattr(actuator, flag, int(getattr(model, f"actuator_{flag}")[i]))
        if model.actuator_ctrlnum[i]:  # of several controls it tells of the first
            # Where its only control is a velocity, that has a range of its own.
            limited = model.actuator_ctrllimited[model.actuator_ctrladr[i]]
            low, high = actuator.ctrlrange
            actuator.ctrllimited = int(limited and (low < high or actuator.inheritrange > 0.0))
    for i, tendon in enumerate(spec.tendons):
        tendon.limited = int(model.tendon_limited[i])
        tendon.actfrclimited = int(model.tendon_actfrclimited[i])


def _spell_out_fits(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Write down the primitives that the compiler fits to meshes, each robot's in its own way."""
    for geom in spec.geoms:
        if geom.meshname and geom.type != mujoco.mjtGeom.mjGEOM_MESH:
            for attribute in ("pos", "quat", "size"):
                value = getattr(model, f"geom_{attribute}")[geom.id]
                setattr(geom, attribute, np.array(value))
            geom.meshname = ""


def has_fromto(element: Element) -> bool:
    """Whether a geom or site is written by its two ends."""
    fromto = getattr(element, "fromto", None)
    return fromto is not None and bool(np.isfinite(fromto[0]))


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
