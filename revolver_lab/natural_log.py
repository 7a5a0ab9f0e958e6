"""What a gated transfer leaves behind: a transfer's log, and its iterations and successes."""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from revolver_lab.logs import Evaluation, Phase, TransferLog

EXAMINED = 10
"""Episodes of an evaluation that are played side by side."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Iteration:
    """One batch and one update, as trained: actions sampled, robots E(beta).

    Attributes:
        iteration: From 0.
        alpha: Where it was made.
        success: Fraction of its trajectories that succeeded.
        average: The gate's moving average after it.
        episode_return: Mean unshaped return.
        mean_beta: Mean beta.
        kl: Measured KL divergence of the update.
        log_std: Mean log_std after it.
        explained: Share of the returns' variance that the value net foresaw.
        steps: Environment steps since the transfer began, at its end [steps].
        wall_time: Seconds since the transfer began, at its end [s].
    """

    iteration: int
    alpha: float
    success: float
    average: float
    episode_return: float
    mean_beta: float
    kl: float
    log_std: float
    explained: float
    steps: int
    wall_time: float


@dataclasses.dataclass(frozen=True, kw_only=True)
class Trial(Evaluation):
    """An evaluation that also tells success.

    Attributes:
        successes: Which episodes succeeded.
        iteration: After how many iterations.
    """

    successes: tuple[bool, ...]
    iteration: int

    @property
    def success(self) -> float:
        """Returns the fraction that succeeded."""
        return sum(self.successes) / len(self.successes)

    @property
    def played(self) -> int:
        """Returns how many episodes it took: those side by side are played together."""
        return -(-len(self.returns) // EXAMINED) * EXAMINED

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Trial":
        """Reads a trial back."""
        read: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in value.items()}
        return cls(**read)


def phases_of(iterations: Sequence[Iteration], trajectories: int) -> tuple[Phase, ...]:
    """Returns the stretches of equal alpha.

    Args:
        iterations: What happened.
        trajectories: Of an iteration.
    """
    phases: list[Phase] = []
    for alpha, some in itertools.groupby(iterations, lambda i: i.alpha):
        stretch = [*some]
        phases.append(Phase(
            phase=len(phases), alpha=alpha, episodes=trajectories * len(stretch),
            steps=stretch[-1].steps, episode_return=stretch[-1].episode_return,
            mean_beta=stretch[-1].mean_beta, kept=0, wall_time=stretch[-1].wall_time,
        ))  # fmt: skip
    return tuple(phases)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class NaturalLog(TransferLog):
    """The outcome of a gated transfer; its phases are the stretches of equal alpha.

    Attributes:
        iterations: What happened, iteration by iteration.
        trials: Every evaluation; `evaluations` has those on the target.
        finished: Whether the gate's last demand, success at alpha = 1, was met.
    """

    iterations: tuple[Iteration, ...]
    trials: tuple[Trial, ...]
    finished: bool

    @property
    def success(self) -> float:
        """Returns the success of the last evaluation, nan where there is none."""
        return self.trials[-1].success if self.trials else float("nan")

    def to_json(self) -> dict[str, Any]:
        """Returns everything but the policy as plain JSON values."""
        plain = super().to_json()
        for name in ("iterations", "trials"):
            plain[name] = [dataclasses.asdict(record) for record in plain[name]]
        return plain

    def _tables(self) -> dict[str, Sequence[Any]]:
        """Returns the records of each table."""
        return {**super()._tables(), "iterations.csv": self.iterations}
