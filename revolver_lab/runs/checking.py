"""What a plan refuses before anything is trained, and what a run refuses on this machine."""

import json
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from revolver_lab.errors import SettingsError
from revolver_lab.given import is_whole
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.methods import Method
from revolver_lab.natural_methods import NaturalMethod
from revolver_lab.policies import Policy
from revolver_lab.preflight import capacity_of, check_memory
from revolver_lab.trajectories import Success

if TYPE_CHECKING:
    from revolver_lab.envs.vector import RobotVectorEnv
    from revolver_lab.runs.plan import Plan

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


def check_kinds(plan: "Plan") -> None:
    """Refuses values of the wrong kind, one field after another.

    Args:
        plan: As it was asked for.

    Raises:
        SettingsError: For the first that is wrong.
    """
    _require(isinstance(plan.robot, str), "robot", plan.robot, "a registered name",
             "See rvl.names().")  # fmt: skip
    kinds = str | Method | NaturalMethod
    _require(_several(plan.methods) and all(isinstance(m, kinds) for m in plan.methods)
             and len(plan.methods) > 0, "methods", plan.methods,
             "a list of names and Methods, one or more",
             'Try methods=["direct", "revolver"].')  # fmt: skip
    seeds = plan.seeds
    _require(_several(seeds) and all(is_whole(seed, 0) for seed in seeds), "seeds", seeds,
             "a list of whole numbers of 0 or more", "Try range(5).")  # fmt: skip
    for name, least in (("steps", 1), ("evaluate_every", 0), ("evaluate_episodes", 1)):
        value = getattr(plan, name)
        _require(is_whole(value, least), name, value, f"a whole number, {least} or more",
                 "Ask for 72,000 steps, evaluated every 24,000 with 10 episodes.")  # fmt: skip
        object.__setattr__(plan, name, int(value))
    for name in ("task", "expert"):
        value = getattr(plan, name)
        _require(value is None or isinstance(value, str), name, value, "None, or text",
                 "Leave it out.")  # fmt: skip
    if plan.learner is not None:
        _check_learner(plan.learner)


def check_one_kind(methods: Sequence[Method | NaturalMethod], learner: Any) -> None:
    """Refuses natural methods beside others, or with a learner that is not theirs.

    Args:
        methods: What is compared.
        learner: What was asked for, or None.
    """
    natural = [each.name for each in methods if isinstance(each, NaturalMethod)]
    if natural and (len(natural) < len(methods) or learner is not None):
        raise SettingsError(
            f"natural methods {natural} beside others, or with a learner",
            "natural methods alone, with learner=None", "Make a plan for each kind.",
        )  # fmt: skip


def _check_learner(learner: Any) -> None:
    """Refuses learners that a worker could not make from a file, or not resume."""
    _require(isinstance(learner, LearnerSettings), "learner", learner, "LearnerSettings",
             "The course's are revolver_lab.learners.settings.COURSE.")  # fmt: skip
    if not learner.stacks:
        raise SettingsError(
            f"a run with {learner.name} of stable-baselines3", "SAC or TD3 of the stacked engine, "
            "by name and without options: only they can be resumed", "Train it by rvl.transfer.",
        )  # fmt: skip


def check_names(methods: Sequence[Method | NaturalMethod]) -> None:
    """Refuses names that cannot be the names of files, or that fall together.

    Args:
        methods: What is compared.
    """
    for each in methods:
        _require(isinstance(each.name, str) and _NAME.fullmatch(each.name) is not None,
                 "the name of a method", each.name, "letters, digits, '.', '_' and '-', 64 at most",
                 "It becomes the name of a file.")  # fmt: skip
    names = [each.name.lower() for each in methods]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise SettingsError(f"several methods named {twice}", "a name of its own for each, in "
                            "small letters too", "Give every method its own name: "
                            "dataclasses.replace(method, name=...).")  # fmt: skip


def check_plain(value: Any) -> None:
    """Refuses what JSON cannot hold: it would not come back the same.

    Args:
        value: The plan as plain values.
    """
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError) as problem:
        raise SettingsError(f"settings that JSON cannot hold ({problem})",
                            "text, whole numbers, finite floats, None",
                            "Convert them: float(x), int(x).") from problem  # fmt: skip


def check_machine(plan: "Plan", expert: Policy | None) -> None:
    """Refuses what this machine cannot hold, and an expert that does not fit the robot.

    Args:
        plan: All of it is trained at once.
        expert: What methods with an expert begin with.

    Raises:
        SettingsError: If the replays would not fit into memory; it says what would.
        PolicyFileError: If the expert has other observations or actions.
    """
    from revolver_lab.envs.vector import make_vec_env

    env = make_vec_env(plan.robot, 1, task=plan.task, nthread=1)
    sizes = env.single_observation_space.shape[0], env.single_action_space.shape[0]  # type: ignore[index]
    if expert is not None:
        expert.fits(*sizes)
    if plan.learner is None:
        check_natural(plan, env)
        return
    capacity = capacity_of(plan.steps, plan.members, plan.learner, env.task.episode_steps)
    check_memory(len(plan.members), capacity, *sizes)


def check_natural(plan: "Plan", env: "RobotVectorEnv") -> None:
    """Refuses a task that does not tell success.

    Args:
        plan: Of natural methods.
        env: A simulation of its robot.
    """
    for each in plan.methods:
        Success(least_return=each.least_return).check(env.task)  # type: ignore[union-attr]


def _several(value: Any) -> bool:
    """Says whether a value is a collection, and not text."""
    return hasattr(value, "__iter__") and hasattr(value, "__len__") and not isinstance(value, str)


def _require(holds: bool, name: str, value: Any, allowed: str, remedy: str) -> None:
    """Raises SettingsError unless something holds."""
    if not holds:
        raise SettingsError(f"{name} = {value!r}", allowed, remedy)
