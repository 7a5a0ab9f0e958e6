"""How each kind of element is written at zero size: there in name, absent in effect."""

from typing import Any

import mujoco
import numpy as np

from revolver_lab.evolution.inertias import TINY_INERTIA, TINY_MASS, stated

EPSILON = 1e-3
"""Factor of every created length.

Measured with random controls on all motors, created ones included, over three seeds: largest
difference in qpos between the untouched robot and its padded twin after 100 / 300 / 1000 steps.

| pair | flight | with the ground |
|---|---|---|
| Ant, a foot on every leg (12 nodes) | 9e-13 / 7e-13 / 6e-12 | 4e-12 / 3e-9 / 4 (chaos) |
| cheetah, a toe (3 nodes) | 3e-14 / 9e-14 / 2e-12 | 7e-14 / 8e-13 / 5e-8 |
| planar arm, a third link (3 nodes) | 4e-14 / 6e-14 / 1e-13 | |

The same at 1e-1 and 1e-5: a created limb is not felt at any size, since its mass is 1e-13 kg and
its joints' inertia is armature. So the size is chosen for what else depends on it: small enough
not to be seen (1 mm in a metre), and large enough for MuJoCo's least mesh volume.
"""

WEAK = 1e-6
"""Factor of the gear of every created actuator, and of the pull of every created tendon."""

SLOW = 1e4
"""Factor of the time constant of a created constraint between bodies that are apart."""

HOLD = 1e4
"""Times a joint's own inertia that holds a joint created where the bodies are welded.

Measured on an Ant with one more hinge at a hip: differences in qpos after 10 / 100 / 1000 steps of
2e-8 / 3e-8 / 1e-7 in flight, 2e-8 / 1e-6 / 1 (chaos) on the ground. They fall as 1 / HOLD up to
1e4; from 1e5 on MuJoCo's solver stops too early for the other joints, and they rise again.
"""

# MuJoCo refuses moving bodies below 1e-15. In air a robot of grams must not feel the rest of one
# of tons. In a medium the drag follows the size that mass and inertia imply: 0.8 mm here.
_FACTOR = 1e-12
_TINY_MASS_IN_MEDIUM, _TINY_INERTIA_IN_MEDIUM = 2e-8, 2e-15
_RK4 = mujoco.mjtIntegrator.mjINT_RK4
_SLIDE = mujoco.mjtJoint.mjJNT_SLIDE
_MUSCLE_FORCE, _MUSCLE_SCALE = 2, 3  # places in gainprm and biasprm
_LEAST_VOLUME = 1e-14  # [m^3], of a mesh; MuJoCo refuses those below 1e-15
FREELY_SIZED = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)


def shrink_body(
    body: mujoco.MjsBody, model: mujoco.MjModel, donor: str, *, inner: bool, medium: bool
) -> None:
    """Shrink a created body's frame and inertia.

    Args:
        body: The copy.
        model: The compiled robot that it was copied from.
        donor: Its name there.
        inner: Whether its parent is created too; a body on a matched parent keeps its place.
        medium: Whether the robot moves in a fluid with density or viscosity.
    """
    i = model.body(donor).id
    if inner:
        body.pos = np.array(body.pos) * EPSILON
    body.gravcomp = 0.0
    if model.body_mass[i] > 0.0:  # otherwise it is as light as it is there
        stated(body)
        body.mass = _TINY_MASS_IN_MEDIUM if medium else TINY_MASS
        body.inertia = [_TINY_INERTIA_IN_MEDIUM if medium else TINY_INERTIA] * 3
        body.ipos, body.iquat = model.body_ipos[i] * EPSILON, model.body_iquat[i]


def shrink_joint(
    joint: mujoco.MjsJoint, model: mujoco.MjModel, donor: str, option: mujoco.MjOption
) -> None:
    """Shrink a joint of a created body; it keeps its timing, where the clock is fine enough.

    The inertia that the joint loses with its limb is given to its armature, so stiffness,
    damping and limits act as fast as they do at full size. Armature does not push back on the
    parent body, so nothing of this is felt by the rest of the robot.

    Args:
        joint: The copy.
        model: The compiled robot that it was copied from.
        donor: Its name there.
        option: Of the robot that it is created in.
    """
    joint.pos = np.array(joint.pos) * EPSILON
    if joint.type == _SLIDE:
        for attribute in ("range", "ref", "springref"):
            setattr(joint, attribute, np.array(getattr(joint, attribute)) * EPSILON)
    first = model.joint(donor).dofadr[0]
    count = 3 if joint.type == mujoco.mjtJoint.mjJNT_BALL else 1
    joint.armature = float(np.max(model.dof_M0[first : first + count]))
    spell_out_spring(joint, model, donor)
    explicit = option.integrator == _RK4 != model.opt.integrator
    if option.timestep > model.opt.timestep or explicit:
        # A coarser clock, or a Runge-Kutta's, would make of quick damping a growing oscillation.
        quickest = np.max(joint.damping) * option.timestep
        stiffest = np.max(joint.stiffness) * (2 * option.timestep) ** 2
        joint.armature = float(max(joint.armature, quickest, stiffest))


def spell_out_spring(joint: mujoco.MjsJoint, model: mujoco.MjModel, donor: str) -> None:
    """Replace springdamper, which depends on inertia, by the constants of the full size."""
    if np.any(joint.springdamper):
        i = model.joint(donor).id
        joint.stiffness = [float(model.jnt_stiffness[i]), 0.0, 0.0]
        joint.damping = [float(model.dof_damping[model.jnt_dofadr[i]]), 0.0, 0.0]
        joint.springdamper = [0.0, 0.0]


def hold_joint(joint: mujoco.MjsJoint, inertia: float, timestep: float) -> None:
    """Hold a joint at its reference, by inertia and a slow, critically damped spring.

    Limits and friction leak a hundred times as much (measured), and a stiff spring is unstable;
    a spring of frequency 0.1 / timestep is slow enough for every integrator.

    Args:
        joint: A joint between two bodies that are welded in this robot.
        inertia: What the joint carries, as MuJoCo's dof_M0.
        timestep: Of the simulation [s].
    """
    rate = 0.1 / timestep
    joint.armature = HOLD * inertia
    joint.springdamper = [0.0, 0.0]
    joint.stiffness = [joint.armature * rate**2, 0.0, 0.0]
    joint.damping = [2.0 * joint.armature * rate, 0.0, 0.0]
    joint.springref = joint.ref
    joint.frictionloss = 0.0
    low, high = np.array(joint.range)
    low = 0.0 if joint.type == mujoco.mjtJoint.mjJNT_BALL else min(low, joint.ref - 1.0)
    joint.range = [low, max(high, joint.ref + 1.0)]


def shrink_shape(shape: Any, *, inner: bool) -> None:
    """Shrink a created geom or site, about its own middle on a matched body.

    Args:
        shape: The copy.
        inner: Whether its body is created too, so that its place shrinks as well.
    """
    shape.size = np.array(shape.size) * EPSILON
    ends = np.array(shape.fromto).reshape(2, 3)
    middle = np.zeros(3) if inner else ends.mean(axis=0)
    if np.isfinite(ends).all():
        shape.fromto = (middle + (ends - middle) * EPSILON).ravel()
    if inner:
        shape.pos = np.array(shape.pos) * EPSILON
    if np.isfinite(getattr(shape, "mass", np.nan)):
        shape.mass *= _FACTOR
    if hasattr(shape, "density"):
        shape.density *= EPSILON


def can_shrink(geom: mujoco.MjsGeom) -> bool:
    """Whether a geom has a size of its own; planes and height fields belong to the scene."""
    return geom.type not in FREELY_SIZED


def shrink_mesh(mesh: mujoco.MjsMesh, model: mujoco.MjModel, donor: str, volume: float) -> None:
    """Shrink a mesh, but not below the volume that MuJoCo accepts.

    Args:
        mesh: The copy.
        model: The compiled robot that it was copied from.
        donor: Its name there.
        volume: About its full volume [m^3]; that of a sheet may be far less.
    """
    factor = max(EPSILON, (1e-12 / max(volume, 1e-12)) ** (1 / 3))
    least = max(_enclosed(model, model.mesh(donor).id), _LEAST_VOLUME)
    mesh.scale = np.array(mesh.scale) * max(factor, (_LEAST_VOLUME / least) ** (1 / 3))


def _enclosed(model: mujoco.MjModel, mesh: int) -> float:
    """Volume that the faces of a compiled mesh enclose [m^3]."""
    first, faces = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    points = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
    corners = points[model.mesh_face[faces : faces + model.mesh_facenum[mesh]]]
    return float(abs(np.linalg.det(corners).sum()) / 6.0)


def shrink_actuator(actuator: mujoco.MjsActuator, model: mujoco.MjModel, donor: str) -> None:
    """Let a created actuator push with almost no force."""
    actuator.damping = np.array(actuator.damping) * WEAK
    actuator.armature = actuator.armature * WEAK
    if actuator.gaintype != mujoco.mjtGain.mjGAIN_MUSCLE:
        actuator.gear = np.array(actuator.gear) * WEAK
        return
    # A muscle's peak force may be told by what its gear accelerates: a weak gear would change
    # nothing. Its length at zero size is outside the range found there, so it keeps its own.
    for attribute in ("gainprm", "biasprm"):
        values = np.array(getattr(actuator, attribute))
        values[_MUSCLE_SCALE] *= WEAK
        values[_MUSCLE_FORCE] *= WEAK if values[_MUSCLE_FORCE] > 0 else 1.0
        setattr(actuator, attribute, values)
    actuator.lengthrange = model.actuator_lengthrange[model.actuator(donor).id]


def shrink_tendon(tendon: mujoco.MjsTendon) -> None:
    """Let a created tendon pull with almost no force, and never reach its limits."""
    for attribute in ("stiffness", "damping"):
        setattr(tendon, attribute, np.array(getattr(tendon, attribute)) * WEAK)
    tendon.frictionloss *= WEAK
    tendon.armature *= WEAK
    if tendon.limited:
        low, high = np.array(tendon.range)
        room = 10.0 * max(1.0, abs(low), abs(high))
        tendon.range = [low - room, high + room]


def shrink_equality(equality: mujoco.MjsEquality, *, anchored: bool, apart: bool) -> None:
    """Let a created equality constraint hold with almost no force.

    Args:
        equality: The copy.
        anchored: Whether the body that it is told in is created too.
        apart: Whether it would pull at the robot even at zero size, see `ties.pulls`. MuJoCo
            divides the stiffness by the square of the impedance: what pulls has to be slow as well.
    """
    equality.solimp = [1e-4, 1e-4, 1e-3, 0.5, 2.0]
    if anchored and equality.type in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
        data = np.array(equality.data)
        data[:6] *= EPSILON
        equality.data = data
    if apart:
        solref = np.array(equality.solref)
        equality.solref = solref * ([SLOW, 1.0] if solref[0] > 0.0 else WEAK)
