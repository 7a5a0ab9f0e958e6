"""The settings of NPG, DAPG and SOIL, with the pilot's and the published values."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from revolver_lab.errors import SettingsError
from revolver_lab.given import are_widths, is_number, is_whole


@dataclasses.dataclass(frozen=True, kw_only=True)
class NaturalSettings:
    """What a natural policy gradient is made of; an iteration is a batch and one update.

    Attributes:
        trajectories: Trajectories in a batch, each on its own robot.
        length: Steps of a trajectory at most [steps].
        step_size: The normalised step: twice the KL divergence of an update.
        gamma: Discount of a step.
        gae: Decay of generalised advantage estimation, lambda there.
        bootstrap: Whether the value of the last state follows a time limit; the published code
            of the hand took 0.
        cg_iterations: Of conjugate gradients.
        damping: Added to the Fisher information's diagonal.
        hidden: Widths of the policy's hidden layers, where it starts from scratch.
        log_std_start: Of a policy that has none.
        log_std_floor: log_std is learnt, and does not fall below this.
        noise_step_size: A step of its own for log_std, normalised as `step_size` is; None lets it
            share the other parameters' step, of which it gets next to nothing.
        carried_noise: Factor on the standard deviations of an expert that is carried over.
        value_hidden: Widths of the value net's hidden layers.
        value_beta: Whether the value net sees beta.
        value_epochs: Epochs on this and the last batch, after each update.
        value_rate: Adam's learning rate.
        value_batch: States in a minibatch.
        warm_batches: Batches that the value net is fitted to before the first update.
        warm_epochs: Epochs of that fit.
        imitation_weight: lambda_0 of DAPG and SOIL: what the demonstrations count at first.
        imitation_decay: lambda_1: that weight's factor from one iteration to the next.
        inverse_hidden: Widths of SOIL's inverse dynamics model.
        inverse_epochs: Epochs on the last `inverse_batches` batches, before each update.
        inverse_batches: Batches that the inverse model remembers.
        inverse_rate: Adam's learning rate.
    """

    trajectories: int = 32
    length: int = 120
    step_size: float = 0.05
    gamma: float = 0.995
    gae: float = 0.97
    bootstrap: bool = True
    cg_iterations: int = 10
    damping: float = 1e-4
    hidden: tuple[int, ...] = (32, 32)
    log_std_start: float = 0.0
    log_std_floor: float = -3.0
    carried_noise: float = 1.0
    noise_step_size: float | None = None
    value_hidden: tuple[int, ...] = (64, 64)
    value_beta: bool = True
    value_epochs: int = 3
    value_rate: float = 1e-3
    value_batch: int = 256
    warm_batches: int = 6
    warm_epochs: int = 20
    imitation_weight: float = 0.1
    imitation_decay: float = 0.95
    inverse_hidden: tuple[int, ...] = (64, 64)
    inverse_epochs: int = 2
    inverse_batches: int = 4
    inverse_rate: float = 1e-3

    def __post_init__(self) -> None:
        """Refuses settings that cannot work."""
        for name in ("trajectories", "length", "cg_iterations", "value_batch", "inverse_batches",
                     "value_epochs", "inverse_epochs", "warm_epochs"):  # fmt: skip
            self._require(name, is_whole(getattr(self, name), 1), "a whole number, 1 or more")
        self._require("warm_batches", is_whole(self.warm_batches, 0), "a whole number, 0 or more")
        for name in ("step_size", "value_rate", "inverse_rate", "carried_noise"):
            value = getattr(self, name)
            self._require(name, is_number(value) and value > 0, "a number above 0")
        step = self.noise_step_size
        held = step is None or (is_number(step) and step > 0)
        self._require("noise_step_size", held, "a number above 0, or None")
        for name in ("gamma", "gae", "imitation_decay"):
            value = getattr(self, name)
            self._require(name, is_number(value) and 0 <= value <= 1, "a number in [0, 1]")
        for name in ("damping", "imitation_weight"):
            value = getattr(self, name)
            self._require(name, is_number(value) and value >= 0, "a number, 0 or more")
        for name in ("hidden", "value_hidden", "inverse_hidden"):
            self._require(name, are_widths(getattr(self, name)), "one or more positive widths")
        for name in ("bootstrap", "value_beta"):
            self._require(name, isinstance(getattr(self, name), bool), "True or False")
        within = is_number(self.log_std_start) and is_number(self.log_std_floor)
        within = within and -20 <= self.log_std_floor <= self.log_std_start <= 2
        self._require("log_std_start", within, f"from log_std_floor = {self.log_std_floor} to 2")

    def _require(self, name: str, holds: bool, allowed: str) -> None:
        """Raises SettingsError unless a setting holds."""
        if not holds:
            raise SettingsError(f"{name} = {getattr(self, name)!r}", allowed,
                                "The pilot's preset is NaturalSettings().")  # fmt: skip

    def to_json(self) -> dict[str, Any]:
        """Returns the settings as plain JSON values."""
        plain = dataclasses.asdict(self)
        # Folders are named by a hash of this: what came later is told only where it is used.
        for name in _LATER:
            if plain[name] == getattr(type(self), name):
                del plain[name]
        return {k: list(v) if isinstance(v, tuple) else v for k, v in plain.items()}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "NaturalSettings":
        """Reads settings back.

        Example:
            >>> NaturalSettings.from_json(PUBLISHED.to_json()) == PUBLISHED
            True
        """
        read: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in value.items()}
        return cls(**read)


_LATER = ("carried_noise", "noise_step_size")


PILOT = NaturalSettings()
"""The door in about 130 iterations of 32 trajectories (facts, section 8, run 2)."""

PUBLISHED = NaturalSettings(
    trajectories=16, length=200, step_size=1e-4, bootstrap=False, value_beta=False, warm_batches=0,
)  # fmt: skip
"""The published runs of the hand: 16 trajectories and the tiny step (facts, section 3)."""
