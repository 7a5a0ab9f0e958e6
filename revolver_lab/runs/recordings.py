"""Recorded runs, read: all that is kept of a robot, put together."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from revolver_lab.errors import SettingsError
from revolver_lab.experts import load_expert
from revolver_lab.files import asset_folder
from revolver_lab.methods import METHODS, look_up
from revolver_lab.natural_methods import NATURAL_METHODS
from revolver_lab.robots import registry
from revolver_lab.runs import store
from revolver_lab.runs.plan import Plan
from revolver_lab.runs.results import Results
from revolver_lab.runs.tables import read_results
from revolver_lab.weights import digest


def recorded(robot: str, methods: Sequence[str] | None = None, *, folder: Path | None = None,
             settings: dict[str, Any] | None = None, natural: bool = False) -> Results:  # fmt: skip
    """Returns the recorded learners of a robot, of all its recorded runs together.

    Args:
        robot: Registered name.
        methods: Which methods, in the order wanted; None takes all.
        folder: Where recorded runs are; None is those that are shipped.
        settings: What else the plans have to agree on, field by field; by default the course's
            steps, learner and task, and the shipped expert where a method begins with one.
        natural: Whether natural methods are meant; their plans agree on the task alone.

    Raises:
        SettingsError: If nothing is recorded, or a method is not.

    Example:
        >>> recorded("cheetah-front-leg", ["direct", "revolver"]).methods
        ('direct', 'revolver')
    """
    home = folder or asset_folder("results")
    usual = Plan(robot=robot, methods=["npg-scratch" if natural else "scratch"], seeds=[0])
    agreed = ("learner", "task") if natural else ("steps", "learner", "task")
    wanted = {k: getattr(usual, k) for k in agreed} | (settings or {})
    expert = wanted.pop("expert", None) or digest(load_expert(robot).weights)
    found: list[Results] = []
    for path in sorted(home.glob(f"{robot}-*/{store.CARD}")):
        plan = store.read_plan(path.parent)
        fits = plan.robot == robot and plan.expert in (None, expert)
        if fits and all(getattr(plan, k) == v for k, v in wanted.items()):
            found.append(read_results(path.parent))
    if not found:
        raise SettingsError(f"no recorded run of {robot!r} in {home}", "a run that was recorded",
                            "Train one: revolver-lab transfer.")  # fmt: skip
    merged = _merge(found)
    known = {**METHODS, **NATURAL_METHODS}
    return merged.select([look_up(name, known).name for name in methods]) if methods else merged


def recorded_kinds(robot: str, *, folder: Path | None = None) -> list[tuple[str, Results]]:
    """Returns all tables of a robot, each with a title: the course's, and natural ones by task.

    Args:
        robot: Registered name.
        folder: Where recorded runs are; None is those that are shipped.

    Raises:
        SettingsError: If nothing is recorded.
    """
    home = folder or asset_folder("results")
    plans = [store.read_plan(p.parent) for p in sorted(home.glob(f"{robot}-*/{store.CARD}"))]
    tasks = dict.fromkeys(p.task for p in plans if p.robot == robot and p.learner is None)
    usual = registry.get(robot).usual_task
    found: list[tuple[str, Results]] = []
    if any(p.robot == robot and p.learner is not None for p in plans) or not tasks:
        found.append((robot, recorded(robot, folder=folder)))
    for task in sorted(tasks, key=lambda task: (task != usual, task)):
        title = robot if task == usual and not found else f"natural methods, {task}"
        some = recorded(robot, folder=folder, settings={"task": task}, natural=True)
        found.append((title, some))
    return found


def _merge(found: list[Results]) -> Results:
    """Puts runs together; a learner that is in several is taken once."""
    learners = {(one.method, one.seed): one for results in found for one in results.learners}
    known = [r.expert_return for r in found if r.expert_return is not None]
    return Results(robot=found[0].robot, learners=tuple(learners.values()),
                   expert_steps=max(results.expert_steps for results in found),
                   expert_return=next(iter(known), None), task=found[0].task,
                   commands=tuple(c for results in found for c in results.commands))  # fmt: skip
