"""The settings of an off-policy learner, with the course's and the paper's values; no torch."""

import dataclasses
import re
from collections.abc import Mapping
from typing import Any

from revolver_lab.errors import SettingsError
from revolver_lab.given import are_widths, is_number, is_whole, require

ENGINES = ("auto", "stacked", "stable-baselines3")
STACKED = ("SAC", "TD3")
"""Algorithms of the stacked engine."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class LearnerSettings:
    """What one learner is made of.

    Attributes:
        algorithm: "SAC", "TD3", "DDPG", or any class derived from stable-baselines3's
            OffPolicyAlgorithm for continuous actions.
        engine: "stacked", our own SAC and TD3, for many learners at once; "stable-baselines3",
            one learner at a time; "auto" takes the first wherever it can.
        hidden: Widths of the hidden layers of actor and critics.
        layer_norm: Whether the critics normalise their layers.
        batch_size: Transitions in an update.
        learning_rate: Of Adam, for actor and critics.
        gamma: Discount of a step.
        tau: Rate at which the target networks follow.
        simulations: Simulations that collect, each with its own beta.
        updates: Gradient updates after each tick (one step of all simulations).
        learning_starts: Transitions in the replay before the first update. Later the replay
            may be emptied by the cleaning; updates then go on with what there is.
        buffer_size: Transitions that the replay holds at most.
        ent_coef: SAC's temperature, a number or "auto", "auto_0.1" (SAC only).
        action_noise: Standard deviation of the exploration noise (TD3 and DDPG only).
        policy_delay: Critic updates for each update of the actor and the targets (TD3 only).
        target_noise: Standard deviation of the target's action noise (TD3 only).
        target_noise_clip: Bound on that noise (TD3 only).
        device: "cpu" or "cuda", for the stacked engine.
        options: Further arguments of stable-baselines3's constructor.
    """

    algorithm: str | type = "SAC"
    engine: str = "auto"
    hidden: tuple[int, ...] = (64, 64)
    layer_norm: bool = True
    batch_size: int = 64
    learning_rate: float = 5e-4
    gamma: float = 0.99
    tau: float = 0.01
    simulations: int = 8
    updates: int = 1
    learning_starts: int = 2000
    buffer_size: int = 200_000
    ent_coef: float | str = 0.01
    action_noise: float = 0.1
    policy_delay: int = 2
    target_noise: float = 0.2
    target_noise_clip: float = 0.5
    device: str = "cpu"
    options: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuses settings that cannot work."""
        for name in ("batch_size", "simulations", "updates", "learning_starts", "buffer_size",
                     "policy_delay"):  # fmt: skip
            value = getattr(self, name)
            _require(is_whole(value, 1), name, value, "a whole number, 1 or more")
        for name in ("learning_rate", "gamma", "tau"):
            value = getattr(self, name)
            _require(is_number(value) and 0 < value <= 1, name, value, "a number in (0, 1]")
        for name in ("action_noise", "target_noise", "target_noise_clip"):
            value = getattr(self, name)
            _require(is_number(value) and value >= 0, name, value, "a number, 0 or more")
        _require(are_widths(self.hidden), "hidden", self.hidden, "one or more positive widths")
        for name, kind in (("algorithm", (str, type)), ("layer_norm", bool), ("options", Mapping)):
            require(name, getattr(self, name), kind, "Leave it out.")
        known = isinstance(self.device, str) and re.fullmatch(r"cpu|cuda(:\d+)?", self.device)
        _require(bool(known), "device", self.device, '"cpu" or "cuda"')
        _require(self.engine in ENGINES, "engine", self.engine, f"one of {ENGINES}")
        _require(_temperature(self.ent_coef), "ent_coef", self.ent_coef,
                 'a number of 0 or more, "auto", or "auto_0.1"')  # fmt: skip
        self._require_stackable()

    def _require_stackable(self) -> None:
        """Refuses what the stacked engine was asked for by name and cannot do."""
        if self.engine == "stacked" and not self.stacks:
            raise SettingsError(
                f"engine = 'stacked' with algorithm = {self.name!r} and options = {self.options}",
                f"one of {STACKED}, without options", "Take engine='stable-baselines3'.",
            )  # fmt: skip

    @property
    def stacks(self) -> bool:
        """Whether the stacked engine trains it."""
        able = self.algorithm in STACKED and not self.options
        return able and self.engine != "stable-baselines3"

    @property
    def name(self) -> str:
        """Returns the name of the algorithm."""
        return getattr(self.algorithm, "__name__", str(self.algorithm))

    def to_json(self) -> dict[str, Any]:
        """Returns the settings as plain JSON values; what is not plain is written as text."""
        plain = dataclasses.asdict(self)
        options = {k: v if isinstance(v, str | int | float) else repr(v)
                   for k, v in self.options.items()}  # fmt: skip
        return {**plain, "algorithm": self.name, "hidden": list(self.hidden), "options": options}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "LearnerSettings":
        """Reads settings back.

        Example:
            >>> LearnerSettings.from_json(LearnerSettings(hidden=(8,)).to_json()).hidden
            (8,)
        """
        return cls(**{**value, "hidden": tuple(value["hidden"])})


def _require(holds: bool, name: str, value: Any, allowed: str) -> None:
    """Raises SettingsError unless a setting holds."""
    if not holds:
        raise SettingsError(f"{name} = {value!r}", allowed,
                            "The course preset is LearnerSettings().")  # fmt: skip


def _temperature(value: Any) -> bool:
    """Says whether a value can be SAC's temperature."""
    if not isinstance(value, str):
        return is_number(value) and value >= 0
    start = re.fullmatch(r"auto(?:_(\d*\.?\d+(?:e-?\d+)?))?", value)
    return start is not None and (start[1] is None or float(start[1]) > 0)


COURSE = LearnerSettings()
"""Minutes on a laptop: two layers of 64, batch 64, one update for eight transitions."""

PAPER = LearnerSettings(
    hidden=(256, 256), layer_norm=False, batch_size=256, learning_rate=3e-4, tau=0.005,
    simulations=1, learning_starts=10_000, buffer_size=1_000_000, ent_coef=0.2,
)  # fmt: skip
"""The paper's values (appendix B); the temperature 0.2 is its published code's."""
