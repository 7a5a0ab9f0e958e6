"""What a run is asked to do, as data; its hash is the name of the run's folder."""

import dataclasses
import hashlib
import json
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from revolver_lab.errors import RevolverError, SettingsError
from revolver_lab.experts import course_learner, home_return, load_expert
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.methods import METHODS, Member, Method, fitted, look_up, members
from revolver_lab.natural_methods import NATURAL_METHODS, NaturalMethod, natural_fitted
from revolver_lab.policies import Policy
from revolver_lab.preflight import check_steps
from revolver_lab.robots import registry
from revolver_lab.robots.own import likeness
from revolver_lab.runs.checking import check_kinds, check_names, check_one_kind, check_plain
from revolver_lab.weights import digest

FORMAT = 1
"""Of a run's folder; another number is another layout of files."""

_EVERY = 24_000
_USUAL = {"steps": 72_000, "evaluate_episodes": 10}
_NATURAL = {"steps": 1_536_000, "evaluate_episodes": 100}
_BY_PLAN = "revolver-lab transfer --plan config.json"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Plan:
    """A population to be trained: methods times seeds on one registered evolution.

    Attributes:
        robot: Registered name.
        methods: What is compared; names are looked up in `revolver_lab.methods`, and fitted to
            the length of the task's episodes, or in `revolver_lab.natural_methods`, and fitted to
            a task that tells no success. All are of one kind.
        seeds: Seeds of every method.
        steps: Environment steps of each learner [steps]; None is 72,000, or 1,536,000 for natural
            methods, which may end before.
        learner: Networks and rates, shared by all; None is what the course uses on this robot,
            which is put in here. Natural methods bring their own, and leave it None.
        task: The reward, by its name; None is the robot's first.
        evaluate_every: Environment steps between evaluations on the target [steps]; 0 is only
            at the end, as it is always for natural methods.
        evaluate_episodes: Episodes of an evaluation; None is 10, or 100 for natural methods.
        expert: Hash of the weights that methods with an expert begin with; by default those of
            the robot's own expert, which is put in here.
        likeness: Hash of a robot of your own, which is put in here; None for ours.

    Raises:
        UnknownNameError: If there is no such robot, task or method.
        SettingsError: If something cannot work.
        PolicyFileError: If a method needs an expert and none is shipped.

    Example:
        >>> plan = Plan(robot="cheetah-front-leg", methods=["direct", "revolver"], seeds=range(5))
        >>> len(plan.members), plan == Plan.from_json(plan.to_json())
        (10, True)
    """

    robot: str
    methods: Sequence[Method | NaturalMethod | str]
    seeds: Sequence[int]
    steps: int = None  # type: ignore[assignment]
    learner: LearnerSettings = None  # type: ignore[assignment]
    task: str | None = None
    evaluate_every: int = _EVERY
    evaluate_episodes: int = None  # type: ignore[assignment]
    expert: str | None = None
    likeness: str | None = None

    def __post_init__(self) -> None:
        """Looks names up, and refuses what cannot work before anything is trained."""
        self._fill_in()
        check_kinds(self)
        self._check_likeness()
        task = registry.get(self.robot).make_task(self.task)
        chosen = tuple(_named(m, self.robot, self.task) for m in self.methods)
        check_one_kind(chosen, self.learner)
        if self.learner is None and not _natural(chosen):
            object.__setattr__(self, "learner", course_learner(self.robot))
        if _natural(chosen):
            object.__setattr__(self, "evaluate_every", 0)
        object.__setattr__(self, "methods", chosen)
        object.__setattr__(self, "seeds", tuple(int(seed) for seed in self.seeds))
        object.__setattr__(self, "task", self.task or registry.get(self.robot).usual_task)
        check_names(chosen)
        members(chosen, self.seeds)
        for schedule in (m.schedule for m in chosen if isinstance(m, Method)):
            schedule.check(self.learner.simulations, task.episode_steps)
            check_steps(self.steps, schedule, self.learner.simulations, task.episode_steps)
        check_plain(self.to_json())
        if self.expert is None and any(m.needs_expert for m in chosen):
            object.__setattr__(self, "expert", digest(load_expert(self.robot).weights))

    def _fill_in(self) -> None:
        """Puts in what is usual for the kind of method, where nothing was asked for."""
        first = next(iter(self.methods), None) if isinstance(self.methods, Sequence) else None
        natural = isinstance(first, NaturalMethod)
        natural = natural or (isinstance(first, str) and first in NATURAL_METHODS)
        for name, usual in (_NATURAL if natural else _USUAL).items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, usual)

    def _check_likeness(self) -> None:
        """Refuses a robot that has changed since the plan was made."""
        robot = registry.get(self.robot)
        found = None if self.robot in registry.RECORDS else likeness(robot)
        if self.likeness not in (None, found):
            raise SettingsError(
                f"{self.robot}, which has changed", f"the robots with the hash {self.likeness}",
                "Restore its files, or make a new plan.",
            )  # fmt: skip
        object.__setattr__(self, "likeness", found)

    @property
    def members(self) -> tuple[Member, ...]:
        """Returns the learners."""
        return members(self.methods, self.seeds)

    @property
    def name(self) -> str:
        """Returns the name of the run's folder: the robot, and a hash of everything asked for."""
        text = json.dumps(self.to_json(), sort_keys=True)
        return f"{self.robot}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"

    @property
    def command(self) -> str:
        """Returns the command that trains it again.

        Example:
            >>> Plan(robot="cheetah-front-leg", methods=["scratch"], seeds=[0, 1]).command
            'revolver-lab transfer cheetah-front-leg --methods scratch --seeds 0 1 --steps 72000'
        """
        names = [*dict.fromkeys(member.method.name for member in self.members)]
        words = ["revolver-lab", "transfer", self.robot, "--methods", *names, "--seeds",
                 *map(str, self.seeds), "--steps", str(self.steps)]  # fmt: skip
        if self.task != registry.get(self.robot).usual_task:
            words += ["--task", str(self.task)]
        return shlex.join(words) if self._is_of_the_table(names) else _BY_PLAN

    def _is_of_the_table(self, names: Sequence[str]) -> bool:
        """Says whether names, seeds, steps and reward say all there is to say."""
        if not {*METHODS, *NATURAL_METHODS} >= {*names}:
            return False
        try:
            usual = Plan(robot=self.robot, methods=names, seeds=self.seeds, steps=self.steps,
                         task=self.task)  # fmt: skip
        except RevolverError:  # the table's own methods may not fit the steps
            return False
        return self == usual

    def to_json(self) -> dict[str, Any]:
        """Returns the plan as plain JSON values."""
        plain = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        if self.likeness is None:  # folders are named by a hash of this: ours keep their names
            del plain["likeness"]
        return plain | {
            "format": FORMAT, "methods": [m.to_json() for m in self.methods],  # type: ignore[union-attr]
            "seeds": list(self.seeds), "learner": self.learner.to_json() if self.learner else None,
        }  # fmt: skip

    @classmethod
    def from_json(cls, value: Any, *, path: str = "a plan") -> "Plan":
        """Reads a plan back.

        Args:
            value: What `to_json` returned.
            path: The file it came from, for the message.

        Raises:
            SettingsError: If it is of another version, or no plan.
        """
        known = {field.name for field in dataclasses.fields(cls)} | {"format"}
        fits = isinstance(value, Mapping) and set(value) | {"likeness"} == known
        if not fits or value.get("format") != FORMAT:
            found = value.get("format") if isinstance(value, Mapping) else type(value).__name__
            raise SettingsError(f"{path} of format {found!r}", f"format {FORMAT}, with the fields "
                                f"{sorted(known)}", "It was written by another version of "
                                "revolver_lab: train it again with this one.")  # fmt: skip
        given = {name: item for name, item in value.items() if name != "format"}
        try:
            natural = value["learner"] is None
            kind = NaturalMethod if natural else Method
            learner = None if natural else LearnerSettings.from_json(value["learner"])
            given |= {"methods": [kind.from_json(m) for m in value["methods"]],
                      "learner": learner}  # fmt: skip
        except (TypeError, KeyError, AttributeError, ValueError) as problem:
            raise SettingsError(
                f"{path}, whose methods or learner cannot be read ({problem})",
                "settings of this version", "Restore it, or train it again with this version.",
            ) from problem  # fmt: skip
        return cls(**given)

    def check_expert(self, expert: Policy) -> Policy:
        """Returns the expert if it is the one that was planned with.

        Raises:
            SettingsError: If it is another.
        """
        if self.expert not in (None, digest(expert.weights)):
            raise SettingsError(
                "an expert of other weights", f"weights with the hash {self.expert}",
                "The expert has changed since: make a new plan.",
            )  # fmt: skip
        return expert


def _named(
    given: Method | NaturalMethod | str, robot: str, task: str | None
) -> Method | NaturalMethod:
    """Returns a method of either table by name, fitted to the task; a method stays as it is."""
    if not isinstance(given, str):
        return given
    made = registry.get(robot).make_task(task)
    row = look_up(given, {**METHODS, **NATURAL_METHODS})
    if isinstance(row, Method):
        return fitted(row, made.episode_steps)
    if made.goal_steps is not None:
        return row
    return natural_fitted(row, made, home_return(robot, task))


def _natural(methods: Sequence[Method | NaturalMethod]) -> bool:
    """Whether they are natural methods; a plan's are all of one kind."""
    return isinstance(methods[0], NaturalMethod)
