"""What the paper compares, each a configuration of the one loop in `algorithm1`."""

import dataclasses

from revolver_lab.errors import UnknownNameError
from revolver_lab.schedule import Schedule


@dataclasses.dataclass(frozen=True, kw_only=True)
class Method:
    """A way of getting a policy for the target robot.

    Attributes:
        name: Its name.
        schedule: The path of alpha.
        expert: Whether the expert's actor and critic are carried over.
    """

    name: str
    schedule: Schedule
    expert: bool = True


# 360 episodes each, 72,000 steps of a cheetah: the path takes 25 phases of 8, alpha = 1 the rest.
_PATH = Schedule(episodes_per_phase=8, final_episodes=160)
_TARGET_ONLY = Schedule(alpha_start=1.0, final_episodes=360)

_ROWS = (
    Method(name="scratch", schedule=_TARGET_ONLY, expert=False),
    Method(name="direct", schedule=_TARGET_ONLY),
    Method(name="deterministic", schedule=dataclasses.replace(_PATH, xi=0.0)),
    Method(name="revolver", schedule=_PATH),
    Method(name="revolver-h1", schedule=dataclasses.replace(_PATH, shaping=1.0)),
)

METHODS = {row.name: row for row in _ROWS}
"""Every method at course scale, by name."""


def method(name: str) -> Method:
    """Returns a method by name.

    Raises:
        UnknownNameError: If there is none of that name.

    Example:
        >>> method("direct").schedule.alphas
        (1.0,)
    """
    if name not in METHODS:
        raise UnknownNameError(f"method {name!r}", ", ".join(METHODS), "Choose one of these.")
    return METHODS[name]
