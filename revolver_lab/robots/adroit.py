"""Adroit hands that hammer, relocate and open doors, and lose three of their five fingers."""

from collections.abc import Callable
from functools import partial

import mujoco
import numpy as np

from revolver_lab.evolution.ramps import Ramp, ramp
from revolver_lab.robots.adroit_scenes import CAMERA, LOST, adroit
from revolver_lab.robots.robot import Robot
from revolver_lab.tasks.hammering import Hammering
from revolver_lab.tasks.manipulation import REWARDS
from revolver_lab.tasks.opening import Opening
from revolver_lab.tasks.relocating import Relocating

ORIGIN = "gymnasium-robotics' adroit_hand (V. Kumar; Farama Foundation), Apache-2.0 and MIT"

GONE = 1e-8
"""What is left of a length [m], and the factor of a mass or a range that vanishes: 0 is illegal."""

# All numbers below are those of facts, section 1; the value at alpha = 1.
PARTS = ("proximal", "middle", "distal")  # of a finger, from the knuckle on
KEPT = ("ffproximal", "ffmiddle", "ffdistal", "thproximal", "thmiddle", "thdistal")
KEPT_RADIUS = 0.007  # of index finger and thumb [m]
FROZEN = ("LFJ4", "FFJ0", "FFJ1", "FFJ3", "THJ0", "THJ1", "THJ2", "THJ4")
WIDENED = ("FFJ2", "THJ3")
WIDE = (np.pi / 6, 5 * np.pi / 6)  # [rad]
#       knuckle: place in its parent's frame [m]
MERGED = {
    "ffknuckle": (0.0, -0.01, 0.08),
    "mfknuckle": (-0.005, 0.001, 0.09),
    "rfknuckle": (-0.010, 0.001, 0.09),
    "lfknuckle": (0.002, 0.001, 0.046),
}
THUMB_PLACE, THUMB_TURN = (0.0, -0.01, 0.0), (1.0, 0.0, 0.0, 0.0)  # [m], quaternion
#        box: (x of its place, half-sizes) [m]
PALM = {
    "C_palm0": (0.0, (0.0111, 0.0111, 0.05)),
    "C_palm1": (0.0, (GONE, 0.0111, GONE)),
    "C_lfmetacarpal": (0.017, (GONE, 0.0111, GONE)),
}


def fingers_lost(scene: str) -> mujoco.MjSpec:
    """Return the hand whose middle, ring and little finger have shrunk to points.

    The path there is linear: of two readings (the other is the ramp s of the gripper) it is the
    one along which the experts fall where facts, section 6, has them fall.

    Args:
        scene: "hammer", "relocate" or "door".
    """
    spec = adroit(scene)
    for finger in LOST:
        for part in ("knuckle", *PARTS):
            spec.body(f"{finger}{part}").mass *= GONE
        for part in PARTS:
            _shrink(spec.body(f"{finger}{part}"))
    return spec


def _shrink(body: mujoco.MjsBody) -> None:
    """Draw a link into its parent's origin; its capsule and what feels touch become points."""
    body.pos = body.pos * GONE
    for geom in body.geoms:
        geom.pos, geom.size = geom.pos * GONE, [GONE, GONE, 0]
    for site in body.sites:
        site.pos, site.size = site.pos * GONE, site.size * GONE


def gripper(scene: str) -> mujoco.MjSpec:
    """Return the two-finger gripper: three fingers gone, index and thumb opposite each other.

    Args:
        scene: "hammer", "relocate" or "door".
    """
    spec = fingers_lost(scene)
    for part in KEPT:
        geom = spec.geom(f"C_{part}")
        geom.size = [KEPT_RADIUS, *geom.size[1:]]
    for joint in FROZEN:
        spec.joint(joint).range = spec.joint(joint).range * GONE
    for joint in WIDENED:
        spec.joint(joint).range = WIDE
    for knuckle, place in MERGED.items():
        spec.body(knuckle).pos = place
    spec.body("thbase").pos, spec.body("thbase").quat = THUMB_PLACE, THUMB_TURN
    for box, (x, half) in PALM.items():
        geom = spec.geom(box)
        geom.pos, geom.size = [x, *geom.pos[1:]], half
    return spec


def _gripper_ramps() -> dict[str, Ramp]:
    """Two overlapping ramps; what is in neither (radii, ranges, thumb, palm) is linear in alpha.

    s = min(2 alpha, 1) takes masses, places and lengths of three fingers, m = max(0, 2 alpha - 1)
    moves the knuckles.
    """
    s, m = ramp(0.0, 0.5), ramp(0.5, 1.0)
    links = [f"{finger}{part}" for finger in LOST for part in PARTS]
    ramps = {f"body/{finger}*/mass": s for finger in LOST}
    ramps |= {f"body/{link}/pos*": s for link in links}
    ramps |= {f"geom/C_{link}/pos*": s for link in links}
    ramps |= {f"geom/C_{link}/size?1?": s for link in links}  # half the length
    ramps |= {f"site/*_{finger}[pmdt]*": s for finger in LOST}
    return ramps | {f"body/{knuckle}/pos*": m for knuckle in MERGED}


def _hand(scene: str, task: type, path: str) -> Robot:
    """One row of the table below."""
    targets: dict[str, Callable] = {"gripper": gripper, "fingers": fingers_lost}
    gripping = path == "gripper"
    return Robot(
        name=f"adroit-{scene}" + ("" if gripping else f"-{path}"),
        domain="adroit",
        task=scene if gripping else f"{scene}_{path}",
        source=partial(adroit, scene),
        target=partial(targets[path], scene),
        tasks={reward: partial(task, reward) for reward in REWARDS},
        camera=CAMERA,
        origin=ORIGIN,
        summary="five fingers become a gripper of two" if gripping else "three fingers shrink",
        f=_gripper_ramps() if gripping else "linear",
    )


HAMMER, HAMMER_FINGERS = (_hand("hammer", Hammering, p) for p in ("gripper", "fingers"))
RELOCATE, RELOCATE_FINGERS = (_hand("relocate", Relocating, p) for p in ("gripper", "fingers"))
DOOR, DOOR_FINGERS = (_hand("door", Opening, p) for p in ("gripper", "fingers"))
