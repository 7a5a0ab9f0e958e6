"""The curves of a run at any moment: whether it is new, running, stopped or finished."""

import dataclasses
import math
from pathlib import Path
from typing import Any

from revolver_lab.runs import checkpoint, store
from revolver_lab.runs.tables import read_results


@dataclasses.dataclass(frozen=True, kw_only=True)
class Curves:
    """What one learner has been through so far; every return is unshaped.

    Attributes:
        method: Name of its method.
        seed: Its seed.
        phases: One dictionary a phase that is over, see `revolver_lab.logs.Phase`; of a natural
            method one an iteration, see `revolver_lab.natural_log.Iteration`.
        evaluations: Environment steps and mean return on the target, of each evaluation.
    """

    method: str
    seed: int
    phases: tuple[dict[str, Any], ...]
    evaluations: tuple[tuple[int, float], ...]


def so_far(folder: str | Path) -> tuple[Curves, ...]:
    """Returns the curves of a run; those of a running one are as old as its checkpoints.

    Args:
        folder: The run's.

    Returns:
        One record a learner that has anything to show, in the order of the plan.

    Raises:
        SettingsError: If there is no run, or one of another version.
    """
    folder = Path(folder)
    plan = store.read_plan(folder)
    if (folder / store.CARD).exists():
        return tuple(
            Curves(method=one.method, seed=one.seed, phases=one.iterations or one.phases,
                   evaluations=tuple(zip(one.steps.tolist(), one.curve.tolist())))
            for one in read_results(folder).learners
        )  # fmt: skip
    found: dict[str, Curves] = {}
    for shard in range(store.count_shards(folder)):
        found |= _shard(folder, shard)
    return tuple(found[m.name] for m in plan.members if m.name in found)


def _shard(folder: Path, shard: int) -> dict[str, Curves]:
    """Returns the curves of one shard's learners, by name."""
    work, plan = store.shard_folder(folder, shard), store.read_plan(folder)
    if (work / store.DONE).exists():
        logs = store.read_shard(folder, plan, shard)["learners"]
    else:
        logs = checkpoint.read_logs(work)
    members = store.shard_members(folder, plan, shard)
    return {
        member.name: Curves(
            method=member.method.name, seed=member.seed,
            phases=tuple(map(_with_nan, log.get("iterations") or log["phases"])),
            evaluations=tuple((e["steps"], sum(e["returns"]) / len(e["returns"]))
                              for e in log["evaluations"]),
        )
        for member, log in zip(members, logs)
    }  # fmt: skip


def _with_nan(phase: dict[str, Any]) -> dict[str, Any]:
    """Puts nan where JSON has null."""
    return {name: math.nan if value is None else value for name, value in phase.items()}
