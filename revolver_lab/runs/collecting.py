"""The end of a run: the shards' results become one set of tables, policies and a card."""

import contextlib
import os
import shutil
from pathlib import Path
from typing import Any

from revolver_lab.files import write_json
from revolver_lab.logs import write_table
from revolver_lab.policies import Policy
from revolver_lab.runs import store
from revolver_lab.runs.claim import claimed
from revolver_lab.runs.plan import Plan

_PATIENCE = 30.0  # with somebody else who collects the same run [s]


def collect(folder: Path, plan: Plan) -> None:
    """Writes the tables, the policies and, last, the card; then the shards may go.

    It can be interrupted and repeated; of two that do it at once, one waits for the other.

    Args:
        folder: The run's.
        plan: What was asked for.
    """
    try:
        with claimed(folder / store.WORK, _PATIENCE):
            if not (folder / store.CARD).exists():
                _collect(folder, plan)
    except FileNotFoundError:  # somebody else was faster, and has cleared away
        if not (folder / store.CARD).exists():
            raise


def _collect(folder: Path, plan: Plan) -> None:
    """Writes everything; nobody else does at the time."""
    shards = store.shard_folders(folder)
    done = [store.read_shard(folder, plan, shard) for shard in range(len(shards))]
    place = {member.name: i for i, member in enumerate(plan.members)}
    rows = [row for one in done for row in one["learners"]]
    rows.sort(key=lambda row: place[f"{row['method']}-{row['seed']}"])
    for work in shards:
        _move(work / store.POLICIES, folder / store.POLICIES)
    digests = {name: store.digest_of(write_table(folder / name, table))
               for name, table in store.flatten(rows).items()}  # fmt: skip
    write_json(folder / store.CARD, {
        "command": plan.command, "commit": done[0]["commit"], "versions": done[0]["versions"],
        "wall_time": max(_seconds(one["learners"], plan) for one in done), "processes": len(shards),
        "steps": sum(row["steps"] for row in rows),
        "evaluation_steps": sum(row["evaluation_steps"] for row in rows),
        **_expert(folder, plan),
        "failures": {f"{row['method']}-{row['seed']}": row["failure"]
                     for row in rows if row["failure"]},
        "digests": digests,
    })  # fmt: skip
    shutil.rmtree(folder / store.WORK, ignore_errors=True)


def _seconds(rows: list[dict[str, Any]], plan: Plan) -> float:
    """Returns how long a worker trained [s]: its natural learners one after another."""
    times = [row["wall_time"] for row in rows]
    return round(sum(times), 3) if plan.learner is None else max(times)


def _move(source: Path, target: Path) -> None:
    """Moves every file of a folder, those that are there."""
    target.mkdir(parents=True, exist_ok=True)
    for path in [*source.glob("*.safetensors"), *source.glob("*.json")]:
        with contextlib.suppress(FileNotFoundError):
            os.replace(path, target / path.name)


def _expert(folder: Path, plan: Plan) -> dict[str, Any]:
    """Returns what the expert cost, and earned at home where its card speaks of that."""
    path = folder / store.EXPERT
    if not path.exists():
        return {"expert_steps": 0, "expert_return": None}
    card = Policy.load(path).card
    at_home = card.robot == plan.robot and card.alpha == 0.0
    return {"expert_steps": card.steps, "expert_return": card.episode_return if at_home else None}
