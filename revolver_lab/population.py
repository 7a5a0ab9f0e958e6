"""Many learners on their paths at once, which can be stopped and resumed at any step."""

import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from revolver_lab.algorithm1 import Algorithm1
from revolver_lab.cards import ModelCard, command, commit, versions
from revolver_lab.envs import snapshot
from revolver_lab.errors import SettingsError
from revolver_lab.evaluation import evaluate_each
from revolver_lab.learners.engines import make_engine
from revolver_lab.learners.settings import COURSE, LearnerSettings
from revolver_lab.logs import TransferLog
from revolver_lab.methods import Member
from revolver_lab.policies import Policy
from revolver_lab.preflight import (
    capacity_of,
    check_evaluations,
    check_memory,
    check_steps,
)
from revolver_lab.recorder import Progress, Recorder

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task

EVALUATION_SEEDS = 1_000_000
"""Evaluations start elsewhere than the training of any seed: at this and the learner's seed."""

Report = Callable[[Member, Progress], None]


class Population:
    """P learners of one shape on one evolution, each with a method and a seed of its own.

    A learner draws the same numbers in any company: alone, among twenty, or in two halves.

    Args:
        evolve: The evolution, or the name of a registered one.
        members: The learners.
        settings: The learning algorithm, shared by all.
        expert: pi on E(0) for the methods that carry one, critic included where it has one; or
            one expert a member.
        steps: Environment steps of each learner [steps]; None ends with its schedule.
        task: A reward of the registered robot, or a task for an evolution of your own.
        evaluate_every: Environment steps between evaluations on the last robot; 0 is at the end.
        evaluate_episodes: Episodes of an evaluation; 0 evaluates never.
        report: Called as episodes of a learner end.

    Raises:
        SettingsError: If something cannot work: a phase shorter than an episode, steps that do
            not reach alpha = 1, more memory than the machine has.
        MissingExtraError: If torch is not installed.
        PolicyFileError: If an expert does not fit the robot or the learner.
    """

    def __init__(
        self, evolve: "Evolution | str", members: Sequence[Member], *,
        settings: LearnerSettings = COURSE, expert: Policy | Sequence[Policy | None] | None = None,
        steps: int | None = None, task: "str | Task | None" = None, evaluate_every: int = 0,
        evaluate_episodes: int = 10, report: Report | None = None,
    ):  # fmt: skip
        from revolver_lab.envs.vector import make_vec_env

        self.members, self.settings, self._task = tuple(members), settings, task
        self.env = make_vec_env(
            evolve, settings.simulations * len(members), task=task, seed=self.seeds, nthread=1,
            autoreset_mode="NextStep",
        )  # fmt: skip
        self._check(steps)
        check_evaluations(evaluate_every, evaluate_episodes)
        self._episodes = evaluate_episodes
        self._experts = _one_each(expert, self.members)
        self.learner = self._make_learner(steps)
        self.logs = [self._log(member, steps, evaluate_every, report) for member in members]
        schedules = [member.method.schedule for member in members]
        examine = self._examine if evaluate_episodes else None
        self.loop = Algorithm1(self.learner, self.env, schedules, self.logs, examine)
        self.begun = False

    @property
    def seeds(self) -> list[int]:
        """Returns the seed of each learner."""
        return [member.seed for member in self.members]

    def _check(self, steps: int | None) -> None:
        """Refuses what cannot work, before anything is made."""
        length = self.env.task.episode_steps
        for member in self.members:
            member.method.schedule.check(self.settings.simulations, length)
            check_steps(steps, member.method.schedule, self.settings.simulations, length)

    def _make_learner(self, steps: int | None) -> Any:
        """Makes the learners and gives them what they start from."""
        sizes = self.env.observation_space.shape[1], self.env.action_space.shape[1]  # type: ignore[index]
        capacity = capacity_of(steps, self.members, self.settings, self.env.task.episode_steps)
        check_memory(len(self.members), capacity, *sizes)
        learner = make_engine(self.settings, *sizes, self.members, capacity)
        for p, expert in enumerate(self._experts):
            if expert is not None:
                learner.adopt(p, expert)
        return learner

    def _log(
        self, member: Member, steps: int | None, evaluate_every: int, report: Report | None
    ) -> Recorder:
        """Makes one learner's log."""
        heard = functools.partial(report, member) if report else None
        return Recorder(member.method.schedule, self.env.task.episode_steps, steps=steps,
                        evaluate_every=evaluate_every, report=heard)  # fmt: skip

    def _examine(self, learners: Sequence[int], policies: Sequence[Policy]) -> np.ndarray:
        """Plays evaluations on the last robot of each learner's path, by mean actions."""
        ends = np.array([self.members[p].method.schedule.alphas[-1] for p in learners])
        found = np.empty((len(learners), self._episodes))
        for end in np.unique(ends):
            some = np.flatnonzero(ends == end).tolist()
            found[some] = evaluate_each(
                [policies[i] for i in some], self.env.evolve, end, self._episodes,
                [EVALUATION_SEEDS + self.members[learners[i]].seed for i in some],
                task=self._task, nthread=1,
            )  # fmt: skip
        return found

    @property
    def over(self) -> bool:
        """Whether every learner has come to its end."""
        return bool(self.loop.over.all())

    @property
    def seconds(self) -> float:
        """Returns the time they have taken so far [s]."""
        return self.logs[0].seconds

    def policy(self) -> Policy:
        """Returns the policy of the first learner."""
        return self.learner.policy(0)

    def run(self, pause: Callable[[], bool] | None = None) -> bool:
        """Trains until all learners are done, or until asked to pause.

        Args:
            pause: Asked before every step of the simulations; True stops there.

        Returns:
            Whether all are done.
        """
        if not self.begun:
            self.loop.begin(self.seeds)
            self.begun = True
        while not self.over:
            if pause is not None and pause():
                return False
            self.loop.tick()
        late = [p for p, log in enumerate(self.logs) if not log.evaluated_last]
        self.loop.evaluate(late)
        return True

    def results(self, *, keep_best: bool = False) -> tuple[TransferLog, ...]:
        """Returns what every learner came to, in the order of the members.

        Args:
            keep_best: The policy of the best evaluation, rather than the last policy.
        """
        return tuple(self._result(p, keep_best) for p in range(len(self.members)))

    def _result(self, p: int, keep_best: bool) -> TransferLog:
        """Freezes what happened to one learner."""
        log, member = self.logs[p], self.members[p]
        policy = log.best if keep_best and log.best else self.learner.policy(p)
        scores = [record.mean for record in log.evaluations]
        score = (max(scores) if policy is log.best else scores[-1]) if scores else None
        expert, last = self._experts[p], log.phases[-1]
        # A learner that was stopped on its way is evaluated at the way's end, as all are.
        measured = log.evaluations[-1].alpha if log.evaluations else last.alpha
        card = ModelCard(
            robot=self.env.evolve.name, alpha=measured, algorithm=self.settings.name,
            seed=member.seed, steps=log.steps, episode_return=score, versions=versions(),
            command=command(), commit=commit(), note=log.failure,
        )  # fmt: skip
        settings = {
            "method": member.method.to_json(), "schedule": member.method.schedule.to_json(),
            "learner": self.settings.to_json(), "expert": expert.card.to_json() if expert else None,
            "versions": card.versions, "command": card.command, "commit": card.commit,
        }  # fmt: skip
        return TransferLog(
            robot=self.env.evolve.name, phases=tuple(log.phases),
            evaluations=tuple(log.evaluations), steps=log.steps,
            evaluation_steps=log.evaluation_steps, wall_time=round(log.seconds, 3),
            reached_target=not log.failure and last.episodes > 0, failure=log.failure,
            seed=member.seed, settings=settings, policy=policy.with_card(card),
        )  # fmt: skip

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns all that `restore` needs: arrays by name, and plain values."""
        parts = {"learner": self.learner.state(), "env": snapshot.take(self.env),
                 "loop": self.loop.state()}  # fmt: skip
        arrays = {f"{part}/{name}": array for part, (found, _) in parts.items()
                  for name, array in found.items()}  # fmt: skip
        for p, log in enumerate(self.logs):
            if log.best is not None:
                arrays |= {f"best/{p}/{k}": v for k, v in log.best.weights.items()}
        plain = {part: values for part, (_, values) in parts.items()}
        return arrays, plain | {"logs": [log.state() for log in self.logs], "begun": self.begun}

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned; from there on, nothing is different."""
        parts = {part: _below(arrays, part) for part in ("learner", "env", "loop")}
        self.learner.restore(parts["learner"], plain["learner"])
        snapshot.put_back(self.env, parts["env"], plain["env"])
        self.loop.restore(parts["loop"], plain["loop"])
        for p, log in enumerate(self.logs):
            log.restore(plain["logs"][p])
            best = _below(arrays, f"best/{p}")
            log.best = Policy(weights=best, head=self.learner.policy(p).head) if best else None
        self.begun = plain["begun"]


def _below(arrays: dict[str, np.ndarray], part: str) -> dict[str, np.ndarray]:
    """Returns the arrays of one part, under their own names."""
    return {k[len(part) + 1 :]: v for k, v in arrays.items() if k.startswith(f"{part}/")}


def _one_each(
    expert: Policy | Sequence[Policy | None] | None, members: Sequence[Member]
) -> list[Policy | None]:
    """Returns what each learner starts from; those from scratch start from nothing."""
    given = [expert] * len(members) if expert is None or isinstance(expert, Policy) else [*expert]
    if len(given) != len(members):
        raise SettingsError(f"{len(given)} experts for {len(members)} learners", "one for all, or "
                            "one each", "Give one expert a learner.")  # fmt: skip
    return [e if member.method.expert else None for e, member in zip(given, members)]
