"""What a lesson trains where it trains: the rows of its notebook, or the same rows cut short."""

import dataclasses
from collections.abc import Sequence

from revolver_lab.experts import course_learner
from revolver_lab.methods import Method, method
from revolver_lab.natural_methods import NATURAL_METHODS, NaturalMethod
from revolver_lab.runs.plan import Plan

_FAST_STEPS = 4800  # two phases of one episode in each simulation, and the last
_NATURAL_STEPS = 800_000  # of a learner that does not get there; some five minutes on a core


def is_natural(methods: Sequence[str]) -> bool:
    """Whether all rows are natural methods.

    Example:
        >>> is_natural(["npg-direct", "npg-revolver"]), is_natural(["direct"])
        (True, False)
    """
    return all(name in NATURAL_METHODS for name in methods)


def live_plan(robot: str, methods: Sequence[str], seeds: int) -> Plan:
    """Returns the very rows that were recorded, with fewer seeds.

    Args:
        robot: Registered name.
        methods: Names of the rows.
        seeds: Of each.
    """
    if is_natural(methods):
        return Plan(robot=robot, methods=methods, seeds=range(seeds), steps=_NATURAL_STEPS)
    return Plan(robot=robot, methods=methods, seeds=range(seeds), evaluate_every=12_000)


def fast_plan(robot: str, methods: Sequence[str]) -> Plan:
    """Returns the rows on so short a path that the returns mean nothing.

    Args:
        robot: Registered name.
        methods: Names of the rows.
    """
    if is_natural(methods):
        rows = Plan(robot=robot, methods=methods, seeds=range(1)).methods  # fitted to the task
        few = [_few(row) for row in rows if isinstance(row, NaturalMethod)]
        return Plan(robot=robot, methods=few, seeds=range(1), steps=480, evaluate_episodes=2)
    rows = [_shortened(method(name)) for name in methods]
    quick = dataclasses.replace(course_learner(robot), learning_starts=200)
    return Plan(robot=robot, methods=rows, seeds=range(2), steps=_FAST_STEPS, learner=quick,
                evaluate_every=1600, evaluate_episodes=2)  # fmt: skip


def _shortened(row: Method) -> Method:
    """Returns a method on a path of three phases of one episode in each simulation."""
    schedule = row.schedule
    xi = 0.6 if schedule.xi else 0.0  # wider than a step, or none
    window = schedule.window if schedule.window is None else max(schedule.window, xi)
    short = dataclasses.replace(
        schedule, alpha_step=0.5, xi=xi, window=window, episodes_per_phase=8,
        final_episodes=24 if schedule.alpha_start == 1 else 8,
    )  # fmt: skip
    return dataclasses.replace(row, schedule=short)


def _few(row: NaturalMethod) -> NaturalMethod:
    """Returns a method with batches of a few short trajectories."""
    settings = dataclasses.replace(row.settings, trajectories=4, length=30, warm_batches=1)
    return dataclasses.replace(row, settings=settings)
