"""What is compared by natural policy gradient: each configures the loop in `natural_loop`."""

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from revolver_lab.errors import SettingsError, UnknownNameError
from revolver_lab.gates import EvaluatedGate, Gate, SampledGate, SteppedGate, gate_from_json
from revolver_lab.given import is_whole, require
from revolver_lab.learners.natural.algorithms import ALGORITHMS, IMITATORS
from revolver_lab.learners.natural.settings import PILOT, NaturalSettings
from revolver_lab.methods import look_up
from revolver_lab.trajectories import Success, half_of_home

if TYPE_CHECKING:
    from revolver_lab.tasks.base import Task

_XI = SampledGate.xi
_EPISODES = 25  # of the teacher, as many as people recorded for DAPG


@dataclasses.dataclass(frozen=True, kw_only=True)
class NaturalMethod:
    """A way of getting a policy for the target robot by natural policy gradient.

    Attributes:
        name: Its name.
        algorithm: "NPG", "DAPG" or "SOIL".
        gate: When alpha goes on; `alpha_start=1` stays on the target.
        settings: What the learner is made of.
        expert: Whether the expert is carried over; otherwise learning starts from scratch.
        demonstrations: Episodes that the expert plays on the source robot, by mean actions, for
            DAPG and SOIL to imitate; 0 for NPG.
        least_return: Where the task tells no success, the unshaped return from which on a
            trajectory counts as one.
    """

    name: str
    algorithm: str = "NPG"
    gate: Gate = SampledGate()  # noqa: RUF009 - frozen
    settings: NaturalSettings = PILOT
    expert: bool = True
    demonstrations: int = 0
    least_return: float | None = None

    def __post_init__(self) -> None:
        """Refuses what no method can be."""
        if self.algorithm not in ALGORITHMS:
            raise UnknownNameError(f"algorithm {self.algorithm!r}", ", ".join(ALGORITHMS),
                                   "Take NPG.")  # fmt: skip
        require("name", self.name, str, "Try 'mine'.")
        require("gate", self.gate, Gate, "Pass SampledGate(), or leave it out.")
        require("settings", self.settings, NaturalSettings, "Leave it out.")
        require("expert", self.expert, bool, "True carries the expert over.")
        Success(least_return=self.least_return)  # refuses what is no number
        if not is_whole(self.demonstrations) or (self.demonstrations > 0) != (
            self.algorithm in IMITATORS
        ):
            raise SettingsError(
                f"{self.algorithm} with demonstrations = {self.demonstrations!r}",
                f"1 episode or more for {sorted(IMITATORS)}, 0 for NPG", f"Try {_EPISODES}.",
            )  # fmt: skip

    @property
    def needs_expert(self) -> bool:
        """Whether there has to be an expert, to begin with or to imitate."""
        return self.expert or self.demonstrations > 0

    def to_json(self) -> dict[str, Any]:
        """Returns the method as plain JSON values."""
        plain = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return plain | {"gate": self.gate.to_json(), "settings": self.settings.to_json()}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "NaturalMethod":
        """Reads a method back.

        Example:
            >>> row = NATURAL_METHODS["dapg"]
            >>> NaturalMethod.from_json(row.to_json()) == row
            True
        """
        made = {"gate": gate_from_json(value["gate"]),
                "settings": NaturalSettings.from_json(value["settings"])}  # fmt: skip
        return cls(**{**value, **made})


def _gated(name: str, **changes: object) -> NaturalMethod:
    """Returns the usual method with another gate of the same kind."""
    gate = dataclasses.replace(SampledGate(), **changes)  # type: ignore[arg-type]
    return NaturalMethod(name=name, gate=gate)


def _learnt(name: str, **changes: object) -> NaturalMethod:
    """Returns the usual method with other settings."""
    settings = dataclasses.replace(PILOT, **changes)  # type: ignore[arg-type]
    return NaturalMethod(name=name, settings=settings)


_AT_TARGET = SampledGate(alpha_start=1.0)
_QUIET_GATE = SampledGate(xi=0.02, low=0.3, high=0.7)
_QUIET = dataclasses.replace(PILOT, carried_noise=0.5, noise_step_size=0.01, log_std_floor=-4.5)

_ROWS = (
    NaturalMethod(name="npg-revolver"),
    NaturalMethod(name="npg-direct", gate=_AT_TARGET),
    NaturalMethod(name="npg-scratch", gate=_AT_TARGET, expert=False),
    # Both begin with the expert, as direct transfer does, and imitate it as well.
    NaturalMethod(name="dapg", algorithm="DAPG", gate=_AT_TARGET, demonstrations=_EPISODES),
    NaturalMethod(name="soil", algorithm="SOIL", gate=_AT_TARGET, demonstrations=_EPISODES),
    NaturalMethod(name="soil-scratch", algorithm="SOIL", gate=_AT_TARGET, expert=False,
                  demonstrations=_EPISODES),
    # Is gradual needed? Equal jumps, each made when the usual gate would take its largest step.
    *(NaturalMethod(name=f"jumps-{n}", gate=SteppedGate(alpha_step=1 / n))
      for n in (1, 2, 4, 8, 16, 64)),
    # Randomisation and shaping.
    _gated("xi-0", xi=0.0),
    _gated("xi-0.2", xi=0.2),
    _gated("h-1", shaping=1.0),
    _gated("h-1-over-xi", shaping=round(1 / _XI, 6)),
    # The step, the gate, the value net.
    _learnt("step-1e-4", step_size=1e-4),
    _learnt("step-0.02", step_size=0.02),
    NaturalMethod(name="gate-evaluated", gate=EvaluatedGate()),
    NaturalMethod(name="gate-evaluated-0.05", gate=EvaluatedGate(alpha_step=0.05)),
    _learnt("value-without-beta", value_beta=False),
    # An end that has to be confirmed by 150 episodes more.
    _gated("confirmed", confirm_episodes=150),
    # For a task that sampled actions spoil: half the noise, which then finds its own measure; a
    # narrower window, and a gate that asks for less.
    NaturalMethod(name="quiet", gate=_QUIET_GATE, settings=_QUIET),
    NaturalMethod(name="quiet-confirmed", settings=_QUIET,
                  gate=dataclasses.replace(_QUIET_GATE, confirm_episodes=150)),
)  # fmt: skip

NATURAL_METHODS: Mapping[str, NaturalMethod] = {row.name: row for row in _ROWS}
"""Every natural method by name; xi, h and the step that a name does not tell are the pilot's."""


def natural_fitted(method: NaturalMethod, task: "Task", home: float | None) -> NaturalMethod:
    """Returns a method of the table for a task that tells no success, the cheetahs' for example.

    The table is written for the hand, whose tasks have a goal. Without one, what counts is
    `half_of_home`. Returns are of whole episodes, and so are the trajectories: as many that a
    batch takes as many steps as before.

    Args:
        method: One of `NATURAL_METHODS`.
        task: What the episodes are of.
        home: What the expert returns on the source, unshaped; None where nobody knows.

    Raises:
        SettingsError: If the expert returns no more there than a robot that does nothing.

    Example:
        >>> from revolver_lab.tasks.running import SpeedTrap
        >>> fitted = natural_fitted(NATURAL_METHODS["soil"], SpeedTrap(), 160.0)
        >>> fitted.least_return, fitted.settings.length, fitted.settings.trajectories
        (80.0, 200, 19)
    """
    usual = method.settings
    trajectories = max(round(usual.trajectories * usual.length / task.episode_steps), 1)
    settings = dataclasses.replace(usual, trajectories=trajectories, length=task.episode_steps)
    least = None if home is None else half_of_home(home, task.idle_return)
    return dataclasses.replace(method, settings=settings, least_return=least)


def natural_method(name: str) -> NaturalMethod:
    """Returns a method by name.

    Raises:
        UnknownNameError: If there is none of that name; near ones are listed first.

    Example:
        >>> natural_method("npg-direct").gate.alpha_start
        1.0
    """
    return look_up(name, NATURAL_METHODS)
