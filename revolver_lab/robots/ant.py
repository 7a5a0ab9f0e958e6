"""Ants: Gym's Ant with legs of other lengths and masses, and one that grows a fourth link."""

from functools import partial

import mujoco
import numpy as np

from revolver_lab.evolution.lifting import lift
from revolver_lab.robots.installed import feel_contacts, installed_spec
from revolver_lab.robots.robot import Robot
from revolver_lab.tasks.locomotion import AntRun

ORIGIN = "Gymnasium's ant.xml (OpenAI, Farama Foundation), MIT"
DENSITY = 5.0
"""Density of every geom of the source [kg/m^3]."""

#     leg: (x, y),  geom at the torso, upper geom,        lower geom
LEGS = {
    1: ((+1, +1), "aux_1_geom", "left_leg_geom", "left_ankle_geom"),
    2: ((-1, +1), "aux_2_geom", "right_leg_geom", "right_ankle_geom"),
    3: ((-1, -1), "aux_3_geom", "back_leg_geom", "third_ankle_geom"),
    4: ((+1, -1), "aux_4_geom", "rightback_leg_geom", "fourth_ankle_geom"),
}
HIP, UPPER, LOWER = 0.2, 0.2, 0.4
"""x and y component of the three links of a leg [m]."""

# Ant-length-mass was never published. Ours is asymmetric: the legs on the left grow and become
# heavier, those on the right shrink and become lighter, front more than back, so that a gait that
# runs straight at alpha = 0 pushes more on one side at alpha = 1. The shipped expert returns
# 1,695 at alpha = 0, 824 at 0.25 and -988 at alpha = 1 (100 episodes).
#              leg: (length, density) at alpha = 1
LENGTH_MASS_TARGET = {1: (1.5, 2.0), 2: (1.25, 1.5), 3: (0.75, 0.75), 4: (0.5, 0.5)}

# Ant-leg-emerge (facts, section 1)     alpha = 0, alpha = 1
EMERGE_LOWER = (0.4, 0.35)  # x and y component of the ankle geom [m]
EMERGE_FOOT = (1e-7, 0.12)  # x and y component of the new foot geom [m]
EMERGE_GEAR = (1e-8, 60.0)  # gear of the new foot motor
FOOT_RADIUS = 0.07  # [m]
FOOT_RANGE = (10.0, 20.0)  # [deg], mirrored on the side of negative x


def ant() -> mujoco.MjSpec:
    """Return Gym's Ant with a name for everything, and contact forces."""
    spec = installed_spec("gymnasium", "envs/mujoco/assets/ant.xml")
    for leg in LEGS:
        spec.body(f"aux_{leg}").first_body().name = f"ankle_{leg}"
    for actuator in spec.actuators:
        actuator.name = actuator.target
    spec.lights[0].name = "sun"
    spec.textures[0].name = "sky"
    feel_contacts(spec, "torso")
    return spec


def ant_with_legs(legs: dict[int, tuple[float, float]]) -> mujoco.MjSpec:
    """Return the Ant with a factor on the lengths and one on the densities of each leg.

    Args:
        legs: Leg, 1 to 4 -> (length factor, density factor).
    """
    spec = ant()
    for leg, (length, density) in legs.items():
        (x, y), *geoms = LEGS[leg]
        for name, reach in zip(geoms, (HIP, UPPER, LOWER)):
            _reach(spec.geom(name), x * reach * length, y * reach * length)
            spec.geom(name).density = DENSITY * density
        spec.body(f"aux_{leg}").pos = [x * HIP * length, y * HIP * length, 0]
        spec.body(f"ankle_{leg}").pos = [x * UPPER * length, y * UPPER * length, 0]
    return spec


def ant_with_feet(lower: float, foot: float, gear: float) -> mujoco.MjSpec:
    """Return the Ant with a foot, a hinge and a motor at the tip of each leg.

    Args:
        lower: x and y component of the ankle geom [m].
        foot: x and y component of the foot geom [m].
        gear: Gear of the foot's motor [N m].
    """
    spec = ant()
    for leg, ((x, y), _, _, ankle) in LEGS.items():
        _reach(spec.geom(ankle), x * lower, y * lower)
        body = spec.body(f"ankle_{leg}").add_body(name=f"foot_{leg}", pos=[x * lower, y * lower, 0])
        geom = body.add_geom(name=f"foot_{leg}_geom", type=mujoco.mjtGeom.mjGEOM_CAPSULE)
        geom.size = [FOOT_RADIUS, 0, 0]
        _reach(geom, x * foot, y * foot)
        joint = body.add_joint(name=f"foot_{leg}", axis=[-1 if x * y > 0 else 1, 1, 0])
        joint.range = sorted(x * limit for limit in FOOT_RANGE)
        _add_motor(spec, f"foot_{leg}", gear)
    return spec


def ant_that_grows(end: int) -> mujoco.MjSpec:
    """Return the source (0) or the target (1) whose feet emerge."""
    return ant_with_feet(EMERGE_LOWER[end], EMERGE_FOOT[end], EMERGE_GEAR[end])


def ant_places() -> tuple[np.ndarray, int, np.ndarray, int]:
    """Return the arguments of ``Policy.lifted`` that carry an Ant's policy over to one with feet.

    Returns:
        Columns of the Ant's 111 observations, 143, rows of its 8 actions, 12.

    Example:
        >>> columns, observations, rows, actions = ant_places()
        >>> observations, actions, rows.tolist()
        (143, 12, [0, 1, 2, 3, 4, 5, 6, 7])
    """
    plain, grown = ant().compile(), ant_that_grows(0).compile()
    lifting = lift(plain, grown)
    bodies = [grown.body(plain.body(index).name).id for index in range(plain.nbody)]
    before = grown.nq - 2 + grown.nv  # as AntRun.observe: qpos[2:], qvel, six forces a body
    forces = before + np.add.outer(6 * np.array(bodies), np.arange(6)).ravel()
    columns = np.concatenate([lifting.qpos[2:] - 2, grown.nq - 2 + lifting.qvel, forces])
    return columns, before + 6 * grown.nbody, lifting.ctrl, grown.nu


def _reach(geom: mujoco.MjsGeom, x: float, y: float) -> None:
    """Let a capsule reach from its body's origin to (x, y, 0) [m]."""
    geom.fromto = [0, 0, 0, x, y, 0]


def _add_motor(spec: mujoco.MjSpec, joint: str, gear: float) -> None:
    """Add a motor like the Ant's own: control in [-1, 1]."""
    motor = spec.add_actuator(name=joint, target=joint)
    motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
    motor.ctrllimited, motor.ctrlrange = True, [-1, 1]
    motor.gear = [gear, 0, 0, 0, 0, 0]


LENGTH_MASS = Robot(
    name="ant-length-mass",
    domain="ant",
    task="length_mass",
    source=ant,
    target=partial(ant_with_legs, LENGTH_MASS_TARGET),
    tasks={"dense": AntRun},
    camera="track",
    origin=ORIGIN,
    summary="left legs grow heavier, right legs shrink: lengths x 1.5 to x 0.5",
)
LEG_EMERGE = Robot(
    name="ant-leg-emerge",
    domain="ant",
    task="leg_emerge",
    source=partial(ant_that_grows, 0),
    target=partial(ant_that_grows, 1),
    tasks={"dense": AntRun},
    camera="track",
    origin=ORIGIN,
    summary="a foot with a motor grows at the tip of each leg",
)
