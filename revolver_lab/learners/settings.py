"""The settings of an off-policy learner, with the course's and the paper's values; no torch."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from revolver_lab.errors import SettingsError


@dataclasses.dataclass(frozen=True, kw_only=True)
class LearnerSettings:
    """What one learner is made of.

    Attributes:
        algorithm: "SAC", "TD3", "DDPG", or any class derived from stable-baselines3's
            OffPolicyAlgorithm for continuous actions.
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
        options: Further arguments of the algorithm's constructor.
    """

    algorithm: str | type = "SAC"
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
    options: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuses settings that cannot work."""
        for name in ("batch_size", "simulations", "updates", "learning_starts", "buffer_size"):
            if getattr(self, name) < 1:
                raise SettingsError(f"{name} = {getattr(self, name)}", "1 or more",
                                    "The course preset is LearnerSettings().")  # fmt: skip
        for name in ("learning_rate", "gamma", "tau"):
            if not 0 < getattr(self, name) <= 1:
                raise SettingsError(f"{name} = {getattr(self, name)}", "a number in (0, 1]",
                                    "The course preset is LearnerSettings().")  # fmt: skip
        if not self.hidden or min(self.hidden) < 1:
            raise SettingsError(f"hidden = {self.hidden}", "one or more positive widths",
                                "The course uses (64, 64).")  # fmt: skip

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


COURSE = LearnerSettings()
"""Minutes on a laptop: two layers of 64, batch 64, one update for eight transitions."""

PAPER = LearnerSettings(
    hidden=(256, 256), layer_norm=False, batch_size=256, learning_rate=3e-4, tau=0.005,
    simulations=1, learning_starts=10_000, buffer_size=1_000_000, ent_coef=0.2,
)  # fmt: skip
"""The paper's values (appendix B); the temperature 0.2 is its published code's."""
