"""What a transfer leaves behind: a frozen log of phases and evaluations, saved atomically."""

import csv
import dataclasses
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from revolver_lab.files import output_file, write_atomically, write_json
from revolver_lab.policies import Policy


@dataclasses.dataclass(frozen=True, kw_only=True)
class Phase:
    """One phase of Algorithm 1; every return is unshaped.

    Attributes:
        phase: k, from 0.
        alpha: alpha_k.
        episodes: Episodes that ended in this phase.
        steps: Environment steps since the transfer began, at the end of this phase [steps].
        episode_return: Mean return of the phase's last episodes (as many as N_e), as trained:
            with actions drawn from the policy, on the robots E(beta).
        mean_beta: Mean beta of those episodes.
        kept: Transitions that the cleaning at its beginning left in the replay.
        wall_time: Seconds since the transfer began, at the end of this phase [s].
    """

    phase: int
    alpha: float
    episodes: int
    steps: int
    episode_return: float
    mean_beta: float
    kept: int
    wall_time: float


@dataclasses.dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Unshaped returns of the mean action on E(alpha), on episodes of their own.

    Attributes:
        steps: Environment steps of training before it [steps].
        alpha: The robot.
        returns: One return an episode.
    """

    steps: int
    alpha: float
    returns: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Returns the mean return."""
        return sum(self.returns) / len(self.returns)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class TransferLog:
    """The outcome of a transfer.

    Attributes:
        robot: Name of the evolution.
        phases: What happened, phase by phase.
        evaluations: Evaluations on the target E(1), in order; empty where none were asked for.
        steps: Environment steps of training [steps].
        evaluation_steps: Environment steps spent on evaluations at most, beyond `steps` [steps].
        wall_time: Seconds it took [s].
        reached_target: Whether the phase at alpha = 1 was completed.
        failure: Why it was stopped before its end, or "".
        seed: Seed of everything random.
        settings: Schedule, learner, versions, command and commit, as plain values.
        policy: The policy after the last update, critic included.
    """

    robot: str
    phases: tuple[Phase, ...]
    evaluations: tuple[Evaluation, ...]
    steps: int
    evaluation_steps: int
    wall_time: float
    reached_target: bool
    failure: str
    seed: int
    settings: Mapping[str, Any]
    policy: Policy

    def __repr__(self) -> str:
        """Says how it went, without what happened on the way."""
        last = (
            f"{self.evaluations[-1].mean:.4g} on the target"
            if self.evaluations
            else "not evaluated"
        )
        return (f"{type(self).__name__}({self.robot!r}, seed {self.seed}, {self.steps} steps, "
                f"{last}{', ' + self.failure if self.failure else ''})")  # fmt: skip

    @property
    def alphas(self) -> tuple[float, ...]:
        """Returns alpha of every phase."""
        return tuple(phase.alpha for phase in self.phases)

    @property
    def returns(self) -> tuple[float, ...]:
        """Returns the unshaped return at the end of every phase."""
        return tuple(phase.episode_return for phase in self.phases)

    def to_json(self) -> dict[str, Any]:
        """Returns everything but the policy as plain JSON values."""
        plain = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        del plain["policy"]
        for name in ("phases", "evaluations"):
            plain[name] = [dataclasses.asdict(record) for record in plain[name]]
        return {**plain, "settings": dict(self.settings)}

    def save(self, folder: str | Path) -> Path:
        """Saves policy.safetensors (with its card), tables as CSV and, last, log.json.

        Each is written atomically; without log.json it is not all there, or not of one transfer.

        Args:
            folder: Where they go; it is made if need be.

        Returns:
            The folder.
        """
        folder = Path(folder)
        for name in ("log.json", "iterations.csv"):  # of an older result, maybe of another kind
            (folder / name).unlink(missing_ok=True)
        self.policy.save(folder / "policy.safetensors")
        for name, records in self._tables().items():
            write_table(folder / name, [dataclasses.asdict(record) for record in records])
        write_json(folder / "log.json", self.to_json())
        return folder

    def _tables(self) -> dict[str, Sequence[Any]]:
        """Returns the records of each table."""
        return {"phases.csv": self.phases}


def write_table(path: str | Path, rows: list[dict[str, Any]]) -> Path:
    """Writes rows as CSV, atomically.

    Args:
        path: Where the table goes.
        rows: One dictionary a row; the header has the keys of all, and a cell without one is empty.
    """
    path, text = output_file(path), io.StringIO()
    names = list(dict.fromkeys(name for row in rows for name in row))
    writer = csv.DictWriter(text, fieldnames=names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return write_atomically(path, text.getvalue())
