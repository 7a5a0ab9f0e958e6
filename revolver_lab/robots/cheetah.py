"""Cheetahs whose legs change length: dm_control's cheetah and a factor per leg."""

import warnings
from functools import partial

import mujoco

from revolver_lab.robots.installed import installed_spec, shrink_sky
from revolver_lab.robots.robot import Robot
from revolver_lab.tasks.running import Dash, SpeedTrap

ORIGIN = "dm_control.suite cheetah (DeepMind), Apache-2.0"
TASKS = {"sparse": SpeedTrap, "dense": Dash}

DENSITY = 637.0
"""Density of every geom of the source [kg/m^3]; total mass 13.5 kg."""

#        leg:   (segments,                     those whose body moves too)
LEGS = {
    "front": (("fthigh", "fshin", "ffoot"), ("fshin", "ffoot")),
    "back": (("bthigh", "bshin", "bfoot"), ("bshin", "bfoot")),
}


def cheetah(front: float = 1.0, back: float = 1.0, density: float = 1.0) -> mujoco.MjSpec:
    """Return the cheetah with legs of other lengths; joints, gears and radii stay.

    Args:
        front: Factor on the front leg's lengths.
        back: Factor on the back leg's lengths.
        density: Factor on the density of every geom.
    """
    with warnings.catch_warnings():  # the file itself uses the deprecated settotalmass
        warnings.filterwarnings("ignore", message=".*settotalmass", category=UserWarning)
        spec = installed_spec("dm_control", "suite/cheetah.xml")
        spec.compiler.settotalmass = -1  # mass follows geometry
    shrink_sky(spec)
    for geom in spec.geoms:
        geom.density = DENSITY * density
    _stretch(spec, "front", front)
    _stretch(spec, "back", back)
    return spec


def _stretch(spec: mujoco.MjSpec, leg: str, factor: float) -> None:
    """Multiply a leg's geom positions, half-lengths and inner body positions by ``factor``."""
    segments, moved = LEGS[leg]
    for name in segments:
        geom = spec.geom(name)
        geom.pos = geom.pos * factor
        geom.size = [geom.size[0], geom.size[1] * factor, geom.size[2]]
    for name in moved:
        body = spec.body(name)
        body.pos = body.pos * factor


def _cheetah_robot(task: str, summary: str, **target: float) -> Robot:
    """One row of the table below; ``target`` are the arguments of ``cheetah``."""
    return Robot(
        name=f"cheetah-{task.replace('_', '-')}",
        domain="cheetah",
        task=task,
        source=cheetah,
        target=partial(cheetah, **target),
        tasks=TASKS,
        camera="side",
        origin=ORIGIN,
        summary=summary,
    )


# facts, section 7
FRONT_LEG = _cheetah_robot("front_leg", "front leg 1 -> 0.4", front=0.4)
SHORT_LEGS = _cheetah_robot("short_legs", "both legs 1 -> 0.5", front=0.5, back=0.5)
LONG_LEGS = _cheetah_robot(
    "long_legs", "both legs 1 -> 1.8, density 1 -> 1.5", front=1.8, back=1.8, density=1.5
)
