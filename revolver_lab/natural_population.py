"""Learners by natural policy gradient, one after another, to be stopped and resumed anywhere."""

import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from revolver_lab.demonstration_sources import record
from revolver_lab.demonstrations import Demonstrations
from revolver_lab.envs.core import Stage
from revolver_lab.errors import SettingsError
from revolver_lab.learners.natural.actor import Actor
from revolver_lab.learners.natural.algorithms import IMITATORS
from revolver_lab.learners.natural.cloning import EPISODES, gaussian_clone
from revolver_lab.methods import Member
from revolver_lab.natural_log import Iteration, NaturalLog
from revolver_lab.natural_loop import NaturalTransfer
from revolver_lab.policies import Policy
from revolver_lab.population import EVALUATION_SEEDS
from revolver_lab.trajectories import Success

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task


class NaturalPopulation:
    """Learners on one evolution, each with a natural method and a seed of its own.

    One of them fills a core with its simulations, so they go one after another; each draws the
    same numbers in any company.

    Args:
        evolve: The evolution, or the name of a registered one.
        members: The learners, their methods each a `NaturalMethod`.
        expert: pi on E(0) for the methods that carry one or imitate one. What is carried has a
            Gaussian head: of another expert, its clone.
        steps: Environment steps at which a learner ends if its gate has not [steps].
        task: A reward of the registered robot, or a task for an evolution of your own.
        evaluate_episodes: Fresh episodes on the target at the end of each; 0 plays none.
        nthread: Threads of the physics; results do not depend on it.
        report: Called after every iteration of a learner.

    Raises:
        PolicyFileError: If the expert does not fit the robot.
        SettingsError: If the task does not tell success.
    """

    def __init__(
        self, evolve: "Evolution | str", members: Sequence[Member], *, expert: Policy | None = None,
        steps: int | None = None, task: "str | Task | None" = None, evaluate_episodes: int = 100,
        nthread: int = 1, report: Callable[[Member, Iteration], None] | None = None,
    ):  # fmt: skip
        self.members, self._episodes = tuple(members), evaluate_episodes
        self._make = (evolve, expert, steps, task, nthread)
        self._report = report
        self._teachers: dict[int, Demonstrations] = {}
        judge = Stage(evolve, task).task
        for member in self.members:  # before an expert is cloned or plays
            Success(least_return=member.method.least_return).check(judge)
        self.loops = [self._loop(self.members[0])]

    def _loop(self, member: Member) -> NaturalTransfer:
        """Makes the loop of a learner."""
        evolve, _, steps, task, nthread = self._make
        method, teacher = member.method, None
        if method.algorithm in IMITATORS:
            teacher = self._teacher(method.demonstrations)
        heard = functools.partial(self._report, member) if self._report else None
        return NaturalTransfer(
            self._carried if method.expert else None, evolve, method.gate,
            algorithm=method.algorithm,
            settings=method.settings, demonstrations=teacher, steps=steps, seed=member.seed,
            task=task, success=Success(least_return=method.least_return), nthread=nthread,
            report=heard,
        )  # fmt: skip

    @functools.cached_property
    def _carried(self) -> Policy | None:
        """Returns the expert, or its clone; the same for every learner, in any process."""
        evolve, expert, _, task, _ = self._make
        if expert is None or Actor.takes(expert):
            return expert
        drawn = record(expert, evolve, EPISODES, seed=EVALUATION_SEEDS, task=task,
                       deterministic=False)  # fmt: skip
        return gaussian_clone(expert, drawn)

    def _teacher(self, episodes: int) -> Demonstrations:
        """Returns what the expert does on the source robot, the same for every learner."""
        evolve, expert, _, task, _ = self._make
        if expert is None:
            raise SettingsError("a teacher to imitate, and expert = None", "the teacher's policy",
                                "Pass expert=rvl.load_expert(name).")  # fmt: skip
        if episodes not in self._teachers:
            found = record(expert, evolve, episodes, seed=EVALUATION_SEEDS, task=task)
            self._teachers[episodes] = found
        return self._teachers[episodes]

    @property
    def seconds(self) -> float:
        """Returns the time that all have taken so far [s]."""
        return sum(loop.seconds for loop in self.loops)

    @property
    def over(self) -> bool:
        """Whether every learner has come to its end."""
        return len(self.loops) == len(self.members) and self.loops[-1].resting

    def run(self, pause: Callable[[], bool] | None = None) -> bool:
        """Trains until all learners are done, or until asked to pause.

        Args:
            pause: Asked before every iteration; True stops there.

        Returns:
            Whether all are done.
        """
        while True:
            loop = self.loops[-1]
            if not loop.run(pause):
                return False
            if self._episodes and not loop.resting:
                loop.examine(1.0, self._episodes)
            loop.rest()
            if self.over:
                return True
            self.loops.append(self._loop(self.members[len(self.loops)]))

    def policy(self) -> Policy:
        """Returns the policy of the learner at work."""
        return self.loops[-1].result().policy

    def results(self) -> tuple[NaturalLog, ...]:
        """Returns what every learner that has begun came to, in the order of the members."""
        logs = []
        for member, loop in zip(self.members, self.loops):
            log = loop.result()
            log.settings["method"] = member.method.to_json()  # type: ignore[index]
            logs.append(log)
        return tuple(logs)

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns all that `restore` needs: arrays by name, and plain values."""
        states = [loop.state() for loop in self.loops]
        arrays = {f"{p}/{k}": v for p, (found, _) in enumerate(states) for k, v in found.items()}
        return arrays, {"loops": [plain for _, plain in states],
                        "logs": [log.to_json() for log in self.results()]}  # fmt: skip

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned; from there on, nothing is different."""
        for p, values in enumerate(plain["loops"]):
            if p:
                self.loops.append(self._loop(self.members[p]))
            mine = {k.removeprefix(f"{p}/"): v for k, v in arrays.items() if k.startswith(f"{p}/")}
            self.loops[p].restore(mine, values)
            if p + 1 < len(plain["loops"]):
                self.loops[p].rest()
