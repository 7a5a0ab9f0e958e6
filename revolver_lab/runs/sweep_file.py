"""A sweep as a TOML file: robots times rewards times methods times seeds, as plans."""

import dataclasses
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from revolver_lab.errors import SettingsError
from revolver_lab.gates import GATES, Gate
from revolver_lab.natural_methods import NATURAL_METHODS, NaturalMethod, natural_method
from revolver_lab.runs.plan import Plan

_LISTS = ("robots", "methods", "seeds", "tasks")
_NUMBERS = ("steps", "evaluate_episodes")
_OWN = ("like", "algorithm", "gate", "settings", "expert", "demonstrations", "least_return")
_EXAMPLE = """robots = ["adroit-door"]
methods = ["npg-revolver", "wide"]
seeds = [0, 1, 2]
steps = 1_000_000

[method.wide]
like = "npg-revolver"
settings = { trajectories = 64 }
gate = { alpha_step = 0.02 }"""


def read_sweep(path: str | Path) -> tuple[Plan, ...]:
    """Reads a sweep: one plan for each robot and reward.

    `robots`, `methods` and `seeds` are lists; `tasks` names rewards, by default the first of each
    robot; `steps` and `evaluate_episodes` are as in a plan. A table `[method.NAME]` defines a
    natural method: another one (`like`) with changes to its `gate` and `settings`. A gate of
    another `kind` keeps what both kinds know.

    Args:
        path: A TOML file.

    Returns:
        The plans, in order.

    Raises:
        SettingsError: If the file cannot be read, or says something unknown.
        UnknownNameError: If there is no such robot, reward or method.
    """
    path = Path(path)
    try:
        found = tomllib.loads(path.read_text())
    except (OSError, ValueError, RecursionError) as problem:  # of which some are torn TOML
        raise _refusal(f"{path}, which cannot be read ({problem})") from problem
    return plans_of(found, str(path))


def plans_of(found: Mapping[str, Any], origin: str = "a sweep") -> tuple[Plan, ...]:
    """Returns the plans of a sweep.

    Args:
        found: As a file says it.
        origin: Where it was found, for the message.

    Example:
        >>> sweep = {"robots": ["adroit-door"], "methods": ["npg-direct"], "seeds": [0, 1]}
        >>> [len(plan.members) for plan in plans_of(sweep | {"tasks": ["sparse", "dense"]})]
        [2, 2]
    """
    unknown = set(found) - {*_LISTS, *_NUMBERS, "method"}
    lacking = {"robots", "methods", "seeds"} - set(found)
    if unknown or lacking:
        raise _refusal(f"{origin} with unknown {sorted(unknown)} and without {sorted(lacking)}")
    for name in _LISTS:
        values = found.get(name, [0])
        if not isinstance(values, list) or not values:
            raise _refusal(f"{name} = {values!r} in {origin}, which is no list")
        if len({repr(value) for value in values}) < len(values):
            raise _refusal(f"{name} = {values!r} in {origin}, which says something twice")
    own = found.get("method", {})
    if not isinstance(own, Mapping):
        raise _refusal(f"method = {own!r} in {origin}, which is no table")
    made = {name: _own(name, changes, origin) for name, changes in own.items()}
    methods: list[Any] = [made.get(str(n), n) for n in found["methods"]]
    numbers = {name: found[name] for name in _NUMBERS if name in found}
    return tuple(_plan(robot, task, methods, found["seeds"], numbers)
                 for robot in found["robots"] for task in found.get("tasks", [None]))  # fmt: skip


def _plan(
    robot: str, task: str | None, methods: Sequence[NaturalMethod | str], seeds: Sequence[int],
    numbers: Mapping[str, Any],
) -> Plan:  # fmt: skip
    """Returns the plan of one robot and reward."""
    steps: Any = numbers.get("steps")  # None is what is usual
    episodes: Any = numbers.get("evaluate_episodes")
    return Plan(robot=robot, methods=methods, seeds=seeds, task=task, steps=steps,
                evaluate_episodes=episodes)  # fmt: skip


def _own(name: str, changes: Any, origin: str) -> NaturalMethod:
    """Returns a natural method that is like another one, with changes."""
    if not isinstance(changes, Mapping) or set(changes) - set(_OWN):
        raise _refusal(f"method.{name} = {changes!r} in {origin}")
    if name in NATURAL_METHODS:
        raise _refusal(f"method.{name} in {origin}, a name that is taken")
    for part in ("gate", "settings"):
        if not isinstance(changes.get(part, {}), Mapping):
            raise _refusal(f"method.{name}.{part} = {changes[part]!r} in {origin}, no table")
    base = natural_method(changes.get("like", "npg-revolver"))
    given: dict[str, Any] = {k: v for k, v in changes.items() if k != "like"}
    gate = dict(given.get("gate", {}))
    kind = GATES.get(str(gate.pop("kind", type(base.gate).__name__)))
    if kind is None:
        raise _refusal(f"gate.kind = {given['gate']['kind']!r} in {origin}; one of {[*GATES]}")
    try:
        given["gate"] = kind(**{**_shared(base.gate, kind), **gate})
        settings = {k: tuple(v) if isinstance(v, list) else v
                    for k, v in given.get("settings", {}).items()}  # fmt: skip
        given["settings"] = dataclasses.replace(base.settings, **settings)
        return dataclasses.replace(base, name=name, **given)
    except TypeError as problem:
        raise _refusal(f"method.{name} in {origin}: {problem}") from problem


def _shared(gate: Gate, kind: type[Gate]) -> dict[str, Any]:
    """Returns what a gate says that one of another kind can say too."""
    known = {field.name for field in dataclasses.fields(kind)}
    return {name: value for name, value in vars(gate).items() if name in known}


def _refusal(what: str) -> SettingsError:
    """Builds the error for what is no sweep."""
    allowed = (f"lists robots, methods, seeds and tasks; numbers {_NUMBERS}; tables [method.NAME] "
               f"of {_OWN}")  # fmt: skip
    return SettingsError(what, allowed, f"For example:\n{_EXAMPLE}")
