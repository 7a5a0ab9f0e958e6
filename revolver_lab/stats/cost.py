"""What a result cost, counted whole: environment steps of every kind, and seconds."""

from dataclasses import dataclass, fields

import numpy as np

from revolver_lab.errors import SettingsError


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Environment steps and time behind a result; costs add up.

    Attributes:
        steps: Environment steps of training.
        seconds: Wall-clock time [s].
        evaluation_steps: Environment steps of evaluations, gates and probes.
        expert_steps: Environment steps of training the experts that it began with.

    Raises:
        SettingsError: If a number is negative or not finite.

    Example:
        >>> total = Cost(steps=1_000_000, seconds=100) + Cost(steps=400_000, seconds=80,
        ...                                                   evaluation_steps=200_000)
        >>> print(total)
        1.4 M steps of training, 200 k of evaluation (1.6 M in all); 3 min
    """

    steps: int
    seconds: float
    evaluation_steps: int = 0
    expert_steps: int = 0

    def __post_init__(self) -> None:
        """Refuses what cannot be counted."""
        for each in fields(self):
            value = getattr(self, each.name)
            if not isinstance(value, int | float | np.number) or not 0 <= value < float("inf"):
                raise SettingsError(f"{each.name} = {value!r}", "a number, 0 or more",
                                    "Count the steps and the seconds as they pass.")  # fmt: skip

    @property
    def all_steps(self) -> int:
        """Environment steps in all."""
        return self.steps + self.evaluation_steps + self.expert_steps

    def __add__(self, other: "Cost") -> "Cost":
        """The cost of both."""
        if not isinstance(other, Cost):
            return NotImplemented
        return Cost(**{f.name: getattr(self, f.name) + getattr(other, f.name)
                       for f in fields(self)})  # fmt: skip

    def __str__(self) -> str:
        """The cost in one line, for the foot of a figure."""
        told = f"{_short(self.steps)} steps of training"
        if self.evaluation_steps:
            told += f", {_short(self.evaluation_steps)} of evaluation"
        if self.expert_steps:
            told += f", {_short(self.expert_steps)} for the expert"
        if self.all_steps != self.steps:
            told += f" ({_short(self.all_steps)} in all)"
        return f"{told}; {_duration(self.seconds)}"


def _short(count: float) -> str:
    """A count to three digits: 950, 25 k, 1.4 M."""
    if count < 1000:
        return f"{count:.0f}"
    for size, unit in ((1e3, "k"), (1e6, "M"), (1e9, "G")):
        if float(f"{count / size:.3g}") < 1000 or unit == "G":
            break
    return f"{float(f'{count / size:.3g}'):g} {unit}"


def _duration(seconds: float) -> str:
    """A time: 42 s, 3 min, 1.5 h."""
    if seconds < 59.5:
        return f"{seconds:.0f} s"
    if seconds < 59.5 * 60:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
