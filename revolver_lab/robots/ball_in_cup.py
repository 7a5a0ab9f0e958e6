"""A ball in a cup: dm_control's, with motors that lose half their strength."""

from functools import partial

import mujoco

from revolver_lab.robots.installed import installed_spec, shrink_sky
from revolver_lab.robots.robot import Robot
from revolver_lab.tasks.catching import Catch, Toss

# facts, section 9
GEAR = (5.0, 2.5)  # of both motors at alpha = 0 and alpha = 1 [N]
TIMESTEP = 0.005  # [s]

DRAWN_SIZE = 0.004  # of the drawn motor, a sphere: radius by force [m/N]
DRAWN_AT = (0.0, 0.0, -0.12)  # under the bottom of the cup [m]
DRAWN_IN = (0.25, 0.3, 0.4, 1.0)


def ball_in_cup(gear: float) -> mujoco.MjSpec:
    """Return the cup on its two motors, and the ball on its string of 0.3 m.

    A force has no looks: the size of a site, which has no mass and touches nothing, shows it.

    Args:
        gear: Force of each motor at full control [N].
    """
    spec = installed_spec("dm_control", "suite/ball_in_cup.xml")
    shrink_sky(spec)
    spec.option.timestep = TIMESTEP
    for motor in spec.actuators:
        motor.gear = [gear, 0, 0, 0, 0, 0]
    drawn = spec.body("cup").add_site(name="motors", pos=DRAWN_AT, rgba=DRAWN_IN)
    drawn.size = [gear * DRAWN_SIZE, 0, 0]
    return spec


WEAK_MOTORS = Robot(
    name="ball-in-cup-weak-motors",
    domain="ball_in_cup",
    task="weak_motors",
    source=partial(ball_in_cup, GEAR[0]),
    target=partial(ball_in_cup, GEAR[1]),
    tasks={"sparse": Catch, "dense": Toss},
    camera="cam0",
    origin="dm_control.suite ball_in_cup (DeepMind), Apache-2.0",
    summary="motors 5 N -> 2.5 N",
)
