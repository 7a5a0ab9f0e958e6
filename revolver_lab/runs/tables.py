"""The tables of a finished run, read: whole, of its plan's learners, and nothing else."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.runs import shapes, store
from revolver_lab.runs.plan import Plan
from revolver_lab.runs.results import LearnerResult, Results
from revolver_lab.stats import Cost


def read_results(folder: Path) -> Results:
    """Reads a finished run.

    Args:
        folder: The run's.

    Raises:
        SettingsError: If it is not finished, torn, or of another version.
    """
    card, plan = store.read_card(folder), store.read_plan(folder)
    names = (store.LEARNERS, store.PHASES, store.EVALUATIONS)
    try:
        rows, phases, evaluations = (_rows(folder / name, card) for name in names)
        _check_members(rows, plan, folder)
        natural = plan.learner is None or store.ITERATIONS in card.get("digests", {})
        iterations = _rows(folder / store.ITERATIONS, card) if natural else []
        # Natural learners go one after another, each by its own clock; others share a worker's.
        share = 1.0 if plan.learner is None else card["processes"] / len(rows)
        tables = [phases, evaluations, *([iterations] if natural else [])]
        learners = [_learner(row, tables, folder, share) for row in rows]
        return Results(robot=plan.robot, learners=tuple(learners),
                       expert_steps=card["expert_steps"], commands=(card["command"],),
                       expert_return=card.get("expert_return"), task=plan.task)  # fmt: skip
    except SettingsError:
        raise
    except (KeyError, IndexError, ValueError, TypeError, AttributeError, csv.Error) as problem:
        raise SettingsError(f"the tables of {folder}, which are torn ({problem!r})",
                            "those of a finished run", shapes.RESTORE) from problem  # fmt: skip


def _check_members(rows: list[dict[str, str]], plan: Plan, folder: Path) -> None:
    """Refuses learners that nobody asked for: their names become those of files and folders."""
    planned = {(member.method.name, str(member.seed)) for member in plan.members}
    found = [(row["method"], row["seed"]) for row in rows]
    if len(found) != len(planned) or {*found} != planned:
        others = sorted({*found} ^ planned)
        raise SettingsError(
            f"{folder / store.LEARNERS} and {store.CONFIG}, which differ in {others[:3]!r:.200}",
            "each learner of the plan, once", shapes.RESTORE,
        )  # fmt: skip


def _learner(
    row: dict[str, str], tables: list[list[dict[str, str]]], folder: Path, share: float
) -> LearnerResult:  # fmt: skip
    """Puts one learner together from the tables."""

    def mine(rows: list[dict[str, str]]) -> list[dict[str, str]]:
        return [r for r in rows if (r["method"], r["seed"]) == (row["method"], row["seed"])]

    phases, tried, *iterations = map(mine, tables)
    if not all((phases, tried, *iterations)):
        raise ValueError(f"a table without {row['method']}-{row['seed']}")
    played = [np.array(r["returns"].split(), dtype=float) for r in tried]
    if not all(len(returns) and np.isfinite(returns).all() for returns in played):
        raise ValueError("returns that are no numbers")
    won = tried[-1].get("successes")
    return LearnerResult(
        method=row["method"], seed=int(row["seed"]), returns=played[-1],
        steps=np.array([_count(r["steps"]) for r in tried]),
        curve=np.array([returns.mean() for returns in played]),
        phases=_numbers(phases, "steps", "alpha"),
        cost=Cost(steps=_count(row["steps"]), seconds=share * float(row["wall_time"]),
                  evaluation_steps=_count(row["evaluation_steps"])),
        failure=row["failure"], folder=folder,
        iterations=_numbers(iterations[0], "steps", "alpha", "iteration") if iterations else (),
        successes=np.array([*won]) == "1" if won else None,
        finished=row["finished"] == "True" if "finished" in row else None,
    )  # fmt: skip


def _count(text: str) -> int:
    """Returns a number of steps.

    Raises:
        ValueError: If it is none.
    """
    if not shapes.WHOLE.holds(int(text)):
        raise ValueError(f"{text:.40} steps")
    return int(text)


def _numbers(rows: list[dict[str, str]], *known: str) -> tuple[dict[str, float], ...]:
    """Returns the numbers of a learner's phases or iterations.

    Raises:
        ValueError: If one that has to be known is not.
    """
    found = [{k: float(v or "nan") for k, v in r.items() if k not in ("method", "seed")}
             for r in rows]  # fmt: skip
    if not all("episode_return" in one and all(math.isfinite(one[name]) for name in known)
               for one in found):  # fmt: skip
        raise ValueError(f"{known} that are no numbers, or no episode_return")
    return tuple(found)


def _rows(path: Path, card: dict[str, Any]) -> list[dict[str, str]]:
    """Reads a table, if it is the one that was written."""
    try:
        whole = card.get("digests", {}).get(path.name) in (None, store.digest_of(path))
        with open(path, newline="") as file:
            rows = [*csv.DictReader(file)]
    except OSError as problem:
        raise SettingsError(f"{path}, which cannot be read", "the table of a finished run",
                            shapes.RESTORE) from problem  # fmt: skip
    if not whole:
        raise SettingsError(f"{path}, which is torn or was altered", "the table that was written",
                            shapes.RESTORE)  # fmt: skip
    return rows
