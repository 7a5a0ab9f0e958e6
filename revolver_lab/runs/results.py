"""What the learners of a run came to, read from its tables; several runs can be put together."""

import csv
import dataclasses
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.policies import Policy
from revolver_lab.runs import store
from revolver_lab.runs.plan import Plan
from revolver_lab.stats import Cost

_RESTORE = "Restore it, or delete the folder and train again."


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class LearnerResult:
    """One learner; every return is unshaped.

    Attributes:
        method: Name of its method.
        seed: Its seed.
        returns: Of the last evaluation on the target, (episodes,).
        steps: Environment steps of the evaluations, (K,) [steps].
        curve: Mean return of each evaluation, (K,).
        phases: One dictionary a phase, see `revolver_lab.logs.Phase`.
        cost: What it cost, its expert not counted; the time is its own, or its share of a
            worker's.
        failure: Why it was stopped before its end, or "".
        folder: The run that it belongs to.
        successes: Which episodes of the last evaluation succeeded, (episodes,); None where the
            method does not tell.
        iterations: One dictionary an iteration, see `revolver_lab.natural_log.Iteration`; empty
            for methods without.
        finished: Whether the gate's last demand was met; None for methods without a gate.
    """

    method: str
    seed: int
    returns: np.ndarray
    steps: np.ndarray
    curve: np.ndarray
    phases: tuple[dict[str, float], ...]
    cost: Cost
    failure: str
    folder: Path
    successes: np.ndarray | None = None
    iterations: tuple[dict[str, float], ...] = ()
    finished: bool | None = None

    def policy(self) -> Policy:
        """Loads its policy.

        Raises:
            PolicyFileError: If it was not kept.
        """
        home = self.folder / store.POLICIES
        path = home / f"{self.method}-{self.seed}.safetensors"
        if not path.is_file():
            kept = sorted(found.stem for found in home.glob("*.safetensors"))
            raise PolicyFileError(
                f"the policy of {path.stem}, which was not kept", f"one of {kept}",
                "Take one of these, or train the run again.",
            )  # fmt: skip
        return Policy.load(path)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Results:
    """Learners of one robot, task and setting, of one run or of several.

    Attributes:
        robot: Name of the evolution.
        learners: What each came to.
        expert_steps: Environment steps that the expert cost [steps].
        commands: The commands that train them again.
        expert_return: Mean unshaped return of the expert on the source robot, by the robot's usual
            reward, where it is known.
        task: The reward that the returns are of; None is the robot's usual one.
    """

    robot: str
    learners: tuple[LearnerResult, ...]
    expert_steps: int
    commands: tuple[str, ...]
    expert_return: float | None = None
    task: str | None = None

    @property
    def methods(self) -> tuple[str, ...]:
        """Returns the names of the methods, in order."""
        return tuple(dict.fromkeys(one.method for one in self.learners))

    def of(self, method: str) -> tuple[LearnerResult, ...]:
        """Returns the learners of a method, by seed.

        Raises:
            SettingsError: If there are none.
        """
        found = sorted((one for one in self.learners if one.method == method),
                       key=lambda one: one.seed)  # fmt: skip
        if not found:
            raise SettingsError(f"method {method!r}", f"one of {self.methods}",
                                "Train it, or ask for another.")  # fmt: skip
        return tuple(found)

    def seeds(self, method: str) -> tuple[int, ...]:
        """Returns the seeds of a method."""
        return tuple(one.seed for one in self.of(method))

    def finals(self, method: str) -> np.ndarray:
        """Returns the returns on the target at the end, (seeds, episodes)."""
        return np.stack([one.returns for one in self.of(method)])

    def scores(self, methods: Iterable[str] | None = None) -> dict[str, np.ndarray]:
        """Returns the mean return of every learner at the end: method -> (seeds,)."""
        return {name: self.finals(name).mean(axis=1) for name in methods or self.methods}

    def curve(self, method: str) -> tuple[np.ndarray, np.ndarray]:
        """Returns steps, (K,), and mean returns on the target, (seeds, K)."""
        some = self.of(method)
        return some[0].steps, np.stack([one.curve for one in some])

    def kept(self, method: str) -> np.ndarray:
        """Returns what each cleaning left in the replay, (seeds, phases) [transitions]."""
        return np.array([[phase["kept"] for phase in one.phases] for one in self.of(method)])

    @property
    def cost(self) -> Cost:
        """Returns what all of it cost: training, evaluations, and the expert once."""
        total = Cost(steps=0, seconds=0.0, expert_steps=self.expert_steps)
        for one in self.learners:
            total = total + one.cost
        return total

    def select(self, methods: Sequence[str], seeds: Iterable[int] | None = None) -> "Results":
        """Returns some of the learners.

        Args:
            methods: Which methods, in the order wanted.
            seeds: Which seeds; None takes all.
        """
        wanted = None if seeds is None else {*seeds}
        some = [one for name in methods for one in self.of(name)
                if wanted is None or one.seed in wanted]  # fmt: skip
        return dataclasses.replace(self, learners=tuple(some))


def read_results(folder: Path) -> Results:
    """Reads a finished run.

    Args:
        folder: The run's.

    Raises:
        SettingsError: If it is not finished, torn, or of another version.
    """
    card, plan = store.read_json(folder / store.CARD), store.read_plan(folder)
    names = (store.LEARNERS, store.PHASES, store.EVALUATIONS)
    try:
        rows, phases, evaluations = (_rows(folder / name, card) for name in names)
        _check_members(rows, plan, folder)
        natural = plan.learner is None or store.ITERATIONS in card.get("digests", {})
        iterations = _rows(folder / store.ITERATIONS, card) if natural else []
        # Natural learners go one after another, each by its own clock; others share a worker's.
        share = 1.0 if plan.learner is None else int(card["processes"]) / max(len(rows), 1)
        tables = phases, evaluations, iterations
        learners = [_learner(row, tables, folder, share) for row in rows]
        return Results(robot=plan.robot, learners=tuple(learners),
                       expert_steps=int(card["expert_steps"]), commands=(card["command"],),
                       expert_return=card.get("expert_return"), task=plan.task)  # fmt: skip
    except (KeyError, IndexError, ValueError, TypeError, AttributeError) as problem:
        if isinstance(problem, SettingsError):
            raise
        raise SettingsError(f"the tables of {folder}, which are torn ({problem!r})",
                            "those of a finished run", _RESTORE) from problem  # fmt: skip


def _check_members(rows: list[dict[str, str]], plan: Plan, folder: Path) -> None:
    """Refuses learners that nobody asked for: their names become those of files and folders."""
    planned = {(member.method.name, str(member.seed)) for member in plan.members}
    found = [(row["method"], row["seed"]) for row in rows]
    if len(found) != len(planned) or {*found} != planned:
        others = sorted({*found} ^ planned)
        raise SettingsError(
            f"{folder / store.LEARNERS} and {store.CONFIG}, which differ in {others[:3]!r:.200}",
            "each learner of the plan, once", _RESTORE,
        )  # fmt: skip


def _learner(
    row: dict[str, str], tables: tuple[list[dict[str, str]], ...], folder: Path, share: float
) -> LearnerResult:  # fmt: skip
    """Puts one learner together from the tables."""

    def mine(rows: list[dict[str, str]]) -> list[dict[str, str]]:
        return [r for r in rows if (r["method"], r["seed"]) == (row["method"], row["seed"])]

    def numbers(rows: list[dict[str, str]]) -> tuple[dict[str, float], ...]:
        return tuple({k: float(v or "nan") for k, v in r.items() if k not in ("method", "seed")}
                     for r in mine(rows))  # fmt: skip

    phases, evaluations, iterations = tables
    tried = mine(evaluations)
    played = [np.array(r["returns"].split(), dtype=float) for r in tried]
    won = tried[-1].get("successes")
    return LearnerResult(
        method=row["method"], seed=int(row["seed"]), returns=played[-1],
        steps=np.array([int(r["steps"]) for r in tried]),
        curve=np.array([returns.mean() for returns in played]), phases=numbers(phases),
        cost=Cost(steps=int(row["steps"]), seconds=share * float(row["wall_time"]),
                  evaluation_steps=int(row["evaluation_steps"])),
        failure=row["failure"], folder=folder, iterations=numbers(iterations),
        successes=np.array([*won]) == "1" if won else None,
        finished=row["finished"] == "True" if "finished" in row else None,
    )  # fmt: skip


def _rows(path: Path, card: dict[str, Any]) -> list[dict[str, str]]:
    """Reads a table, if it is the one that was written."""
    try:
        whole = card.get("digests", {}).get(path.name) in (None, store.digest_of(path))
        with open(path, newline="") as file:
            rows = [*csv.DictReader(file)]
    except OSError as problem:
        raise SettingsError(f"{path}, which cannot be read", "the table of a finished run",
                            _RESTORE) from problem  # fmt: skip
    if not whole:
        raise SettingsError(f"{path}, which is torn or was altered", "the table that was written",
                            _RESTORE)  # fmt: skip
    return rows
