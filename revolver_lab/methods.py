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


_ROWS = (
    Method(name="scratch", schedule=Schedule(alpha_start=1.0), expert=False),
    Method(name="direct", schedule=Schedule(alpha_start=1.0)),
    Method(name="deterministic", schedule=Schedule(xi=0.0)),
    Method(name="revolver", schedule=Schedule()),
    Method(name="revolver-h1", schedule=Schedule(shaping=1.0)),
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
