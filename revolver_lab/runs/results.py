"""What the learners of a run came to; several runs can be put together."""

import dataclasses
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.policies import Policy
from revolver_lab.runs import store
from revolver_lab.stats import Cost


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
        """Returns the returns on the target at the end, (seeds, episodes).

        Raises:
            SettingsError: If some were evaluated with more episodes than others.
        """
        some = [one.returns for one in self.of(method)]
        if len({*map(len, some)}) > 1:
            raise _uneven(method, "evaluate_episodes", sorted({*map(len, some)}))
        return np.stack(some)

    def scores(self, methods: Iterable[str] | None = None) -> dict[str, np.ndarray]:
        """Returns the mean return of every learner at the end: method -> (seeds,)."""
        return {name: np.array([one.returns.mean() for one in self.of(name)])
                for name in methods or self.methods}  # fmt: skip

    def curve(self, method: str) -> tuple[np.ndarray, np.ndarray]:
        """Returns steps, (K,), and mean returns on the target, (seeds, K).

        Raises:
            SettingsError: If some were evaluated at other steps than others.
        """
        some = self.of(method)
        if len({tuple(one.steps.tolist()) for one in some}) > 1:
            raise _uneven(method, "evaluate_every", sorted({len(one.steps) for one in some}))
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


def _uneven(method: str, field: str, counts: list[int]) -> SettingsError:
    """Builds the error for learners that cannot be put into one array."""
    return SettingsError(
        f"learners of {method} whose plans differ in {field} ({counts} of each)",
        "learners that were evaluated alike", f"Ask for them apart: recorded(..., "
        f"settings={{{field!r}: ...}}).",
    )  # fmt: skip
