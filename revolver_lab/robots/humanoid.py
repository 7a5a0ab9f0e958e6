"""Gym's Humanoid: one leg grows above the knee, the other below it."""

import mujoco

from revolver_lab.robots.installed import feel_contacts, installed_spec
from revolver_lab.robots.robot import Robot
from revolver_lab.tasks.locomotion import HumanoidRun

ORIGIN = "Gymnasium's humanoid.xml (OpenAI, Farama Foundation), MIT"

# facts, section 1 [m]                source, left alpha = 1, right alpha = 1
THIGH_Z = {"source": -0.34, "left": -0.44, "right": -0.24}
THIGH_RADIUS = {"source": 0.06, "left": 0.07, "right": 0.07}
SHIN_BODY_Z = {"source": -0.403, "left": -0.503, "right": -0.303}
SHIN_Z = {"source": -0.30, "left": -0.20, "right": -0.40}
SHIN_RADIUS = {"source": 0.049, "left": 0.039, "right": 0.039}
FOOT_BODY_Z = {"source": -0.45, "left": -0.35, "right": -0.55}


def humanoid() -> mujoco.MjSpec:
    """Return Gym's Humanoid with a name for everything, and contact forces."""
    spec = installed_spec("gymnasium", "envs/mujoco/assets/humanoid.xml")
    spec.lights[0].name = "sun"
    spec.textures[0].name = "sky"
    spec.body("right_lower_arm").first_camera().name = "right_elbow"
    spec.nkey = 0
    for key in list(spec.keys):  # the five that the file reserves, all empty
        spec.delete(key)
    feel_contacts(spec, "torso")
    return spec


def lopsided_humanoid() -> mujoco.MjSpec:
    """Return the target: the left thigh and the right shin have grown, their pair shrunk."""
    spec = humanoid()
    for side in ("left", "right"):
        _end_at(spec.geom(f"{side}_thigh1"), THIGH_Z[side], THIGH_RADIUS[side])
        _end_at(spec.geom(f"{side}_shin1"), SHIN_Z[side], SHIN_RADIUS[side])
        _lower(spec.body(f"{side}_shin"), SHIN_BODY_Z[side])
        _lower(spec.body(f"{side}_foot"), FOOT_BODY_Z[side])
    return spec


def _end_at(geom: mujoco.MjsGeom, z: float, radius: float) -> None:
    """Let a capsule end at height z of its body's frame [m]."""
    geom.fromto = [*geom.fromto[:5], z]
    geom.size = [radius, 0, 0]


def _lower(body: mujoco.MjsBody, z: float) -> None:
    """Move a body's origin to height z of its parent's frame [m]."""
    body.pos = [*body.pos[:2], z]


LENGTH_MASS = Robot(
    name="humanoid-length-mass",
    domain="humanoid",
    task="length_mass",
    source=humanoid,
    target=lopsided_humanoid,
    tasks={"dense": HumanoidRun},
    camera="track",
    origin=ORIGIN,
    summary="left leg grows above the knee, right leg below it",
)
