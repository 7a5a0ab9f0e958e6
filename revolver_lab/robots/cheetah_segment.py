"""A cheetah whose back foot grows one more segment, with a hinge and a motor of its own."""

from functools import partial

import mujoco
import numpy as np

from revolver_lab.evolution.lifting import lift
from revolver_lab.robots.cheetah import DENSITY, ORIGIN, TASKS, cheetah
from revolver_lab.robots.robot import Robot

# As facts, section 9, but longer: at the pilot's 0.40 m direct transfer gets there too, 150.9 of
# 200 in the mean of four learners against REvolveR's 151.7; at 0.60 m it is 0 against 149.6.
# What grows, times k:
LENGTH = 0.60  # [m]
RADIUS = 0.046  # [m]
GEAR = 30.0  # [N m]
# What does not:
RANGE = 50.0  # [deg], either way
STIFFNESS = 60.0  # [N m/rad]
DAMPING = 1.5  # [N m s/rad]
ARMATURE = 0.1  # [kg m^2]

GROWTH = (0.02, 1.0)  # k at alpha = 0 and alpha = 1

# dm_control's bfoot: where the capsule's middle is, how it is tilted, how long half of it is
FOOT_MIDDLE = (0.03, 0.0, -0.097)  # [m]
FOOT_TILT = -15.0  # [deg] about y
FOOT_HALF_LENGTH = 0.094  # [m]

_BIT = 2  # contact bit of the new geom, which only the ground answers


def cheetah_with_segment(k: float) -> mujoco.MjSpec:
    """Return the cheetah with a segment at the tip of its back foot.

    Source and target both have it, the source's next to nothing: so observation and action have
    one size all along, and every number of the segment, its gear included, is in theta and chosen
    by the table above. (Between the plain cheetah and the target, ``Evolution`` would create the
    segment itself, vanishing in its own way.)

    Args:
        k: Size of the segment, from 0 (not reached) to 1: factor on length, radius and gear.
    """
    spec = cheetah()
    tilt = np.radians(FOOT_TILT)
    tip = np.array(FOOT_MIDDLE) - FOOT_HALF_LENGTH * np.array([np.sin(tilt), 0, np.cos(tilt)])
    body = spec.body("bfoot").add_body(name="bsegment", pos=tip)
    joint = body.add_joint(name="bsegment", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    joint.limited, joint.range = True, [-RANGE, RANGE]
    joint.stiffness, joint.damping, joint.armature = [STIFFNESS, 0, 0], [DAMPING, 0, 0], ARMATURE
    geom = body.add_geom(name="bsegment", type=mujoco.mjtGeom.mjGEOM_CAPSULE, density=DENSITY)
    geom.fromto, geom.size = [0, 0, 0, 0, 0, -LENGTH * k], [RADIUS * k, 0, 0]
    geom.friction, geom.material = spec.geom("bfoot").friction, spec.geom("bfoot").material
    geom.contype, geom.conaffinity = 0, _BIT
    spec.geom("ground").contype |= _BIT
    motor = spec.add_actuator(name="bsegment", target="bsegment")
    motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
    motor.ctrllimited, motor.ctrlrange = True, [-1, 1]
    motor.gear = [GEAR * k, 0, 0, 0, 0, 0]
    return spec


def cheetah_places() -> tuple[np.ndarray, int, np.ndarray, int]:
    """Return the arguments of ``Policy.lifted`` that carry a cheetah's policy over to this robot.

    The robot that is padded by hand gets the same zero insertion (section 4.1) as one that
    ``Evolution`` pads, with places found by the names of joints and actuators.

    Returns:
        Columns of the cheetah's 18 observations, 20, rows of its 6 actions, 7.

    Example:
        >>> columns, observations, rows, actions = cheetah_places()
        >>> observations, actions, rows.tolist()
        (20, 7, [0, 1, 2, 3, 4, 5])
    """
    plain, grown = cheetah().compile(), cheetah_with_segment(GROWTH[0]).compile()
    lifting = lift(plain, grown)
    positions = lifting.qpos[1:] - 1  # as Running.observe: qpos without x, qvel, run-up
    columns = np.concatenate([positions, grown.nq - 1 + lifting.qvel, [grown.nq - 1 + grown.nv]])
    return columns, grown.nq + grown.nv, lifting.ctrl, grown.nu


SEGMENT = Robot(
    name="cheetah-segment",
    domain="cheetah",
    task="segment",
    source=partial(cheetah_with_segment, GROWTH[0]),
    target=partial(cheetah_with_segment, GROWTH[1]),
    tasks=TASKS,
    camera="side",
    origin=ORIGIN,
    summary="a segment with a motor grows at the tip of the back foot",
)
