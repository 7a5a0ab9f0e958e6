"""The files of a run's folder: who writes what, where, and how it is read back."""

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from revolver_lab.errors import SettingsError
from revolver_lab.files import write_json
from revolver_lab.logs import TransferLog
from revolver_lab.methods import Member
from revolver_lab.runs import shapes
from revolver_lab.runs.plan import Plan

CONFIG, CARD, EXPERT = "config.json", "card.json", "expert.safetensors"
LEARNERS, PHASES, EVALUATIONS = "learners.csv", "phases.csv", "evaluations.csv"
ITERATIONS = "iterations.csv"
POLICIES, WORK, SHARDS, STOP = "policies", "work", "work/shards.json", "work/stop"
PROGRESS, LOG, DONE, FAILED, LOCK = "progress.json", "log.txt", "done.json", "failed.json", "lock"
CURRENT = "current.safetensors"


def read_json(path: Path, shape: shapes.Shape | None = None) -> Any:
    """Reads JSON that this package wrote.

    Args:
        path: The file.
        shape: What it has to hold; None is anything.

    Raises:
        SettingsError: If it is missing or torn, or holds something else.
    """
    try:
        value = json.loads(path.read_text())
    except (OSError, ValueError, RecursionError) as problem:
        raise SettingsError(f"{path}, which cannot be read ({problem})", "a file of a run",
                            shapes.RESTORE) from problem  # fmt: skip
    return value if shape is None else shapes.check(value, shape, path)


def read_card(folder: Path) -> dict[str, Any]:
    """Returns the card of a finished run.

    Raises:
        SettingsError: If there is none, or it is torn.
    """
    return read_json(folder / CARD, shapes.CARD)


def read_shard(folder: Path, plan: Plan, shard: int) -> dict[str, Any]:
    """Returns what `write_shard` wrote of a shard that is done.

    Raises:
        SettingsError: If it is torn, or of other learners than the shard's.
    """
    path = shard_folder(folder, shard) / DONE
    found = read_json(path, shapes.DONE_NATURAL if plan.learner is None else shapes.DONE)
    planned = [(m.method.name, m.seed) for m in shard_members(folder, plan, shard)]
    told = [(row["method"], row["seed"]) for row in found["learners"]
            if row["phases"] and row["evaluations"] and row.get("iterations", True)]  # fmt: skip
    if told != planned:
        raise SettingsError(f"{path} that tells of {told!r:.200}", f"{planned!r:.200}",
                            shapes.RESTORE)  # fmt: skip
    return found


def digest_of(path: Path) -> str:
    """Returns the SHA-256 of a table, however its lines end."""
    return hashlib.sha256(path.read_bytes().replace(b"\r\n", b"\n")).hexdigest()


def read_plan(folder: Path) -> Plan:
    """Returns the plan of a run's folder.

    Raises:
        SettingsError: If there is none, or it is of another version.
    """
    path = folder / CONFIG
    return Plan.from_json(read_json(path), path=str(path))


def shard_folder(folder: Path, shard: int) -> Path:
    """Returns where the worker of a shard keeps its files."""
    return folder / WORK / f"shard-{shard}"


def count_shards(folder: Path) -> int:
    """Returns how many shards a run was parted into, 0 where it has not begun."""
    path = folder / SHARDS
    return read_json(path, shapes.SHARDED)["shards"] if path.exists() else 0


def shard_folders(folder: Path) -> list[Path]:
    """Returns where the workers of all shards keep their files."""
    return [shard_folder(folder, shard) for shard in range(count_shards(folder))]


def shard_members(folder: Path, plan: Plan, shard: int) -> tuple[Member, ...]:
    """Returns the learners of a shard: every so-many-th of the plan's."""
    return plan.members[shard :: count_shards(folder)]


def write_shard(work: Path, results: Sequence[TransferLog], command: str) -> None:
    """Writes what the learners of a shard came to; the last file says that all is there.

    Args:
        work: The shard's folder.
        results: One log a learner.
        command: What trains the run again, for the cards.
    """
    rows = []
    for log in results:
        plain = log.to_json()
        name = f"{plain['settings']['method']['name']}-{log.seed}"
        card = dataclasses.replace(log.policy.card, command=command)
        log.policy.with_card(card).save(work / POLICIES / f"{name}.safetensors")
        kept = ("phases", "evaluations", "steps", "evaluation_steps", "wall_time", "failure",
                "reached_target", "seed")  # fmt: skip
        natural = {k: plain[k] for k in ("iterations", "finished") if k in plain}
        rows.append({"method": name.rpartition("-")[0]} | {k: plain[k] for k in kept} | natural)
    first = results[0].settings
    made = {name: first[name] for name in ("versions", "commit")}
    write_json(work / DONE, {"learners": rows, **made})


def flatten(rows: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Returns the tables of a run from its learners' rows, one list of rows a file.

    Natural methods have a table of iterations besides, and say which episodes succeeded.

    Args:
        rows: As `write_shard` wrote them.
    """
    natural = any("iterations" in row for row in rows)
    names = (LEARNERS, PHASES, EVALUATIONS, *([ITERATIONS] if natural else []))
    tables: dict[str, list[dict[str, Any]]] = {name: [] for name in names}
    for row in rows:
        who = {"method": row["method"], "seed": row["seed"]}
        tables[PHASES] += [who | _compact(phase) for phase in row["phases"]]
        tables[EVALUATIONS] += [who | _evaluation(e) for e in row["evaluations"]]
        plain = ("steps", "evaluation_steps", "wall_time", "reached_target", "failure")
        tables[LEARNERS].append(who | {name: row[name] for name in plain})
        if natural:
            tables[LEARNERS][-1]["finished"] = row["finished"]
            tables[ITERATIONS] += [who | _rounded(made) for made in row["iterations"]]
    return tables


def _evaluation(played: dict[str, Any]) -> dict[str, Any]:
    """Returns a row of the evaluations; successes as a word of zeros and ones."""
    row = {"steps": played["steps"], "alpha": played["alpha"],
           "returns": " ".join(f"{r:.9g}" for r in played["returns"])}  # fmt: skip
    if "successes" in played:
        row["successes"] = "".join(str(int(won)) for won in played["successes"])
    return row


def _rounded(made: dict[str, Any]) -> dict[str, Any]:
    """Rounds an iteration to what a table is read for; alpha stays as it was."""
    return {k: float(f"{v:.4g}") if isinstance(v, float) and k != "alpha" else v
            for k, v in made.items()}  # fmt: skip


def _compact(phase: dict[str, Any]) -> dict[str, Any]:
    """Rounds a phase to what a table is read for: recorded runs hold thousands of them."""
    rounded = {name: float(f"{phase[name]:.6g}") if phase[name] is not None else None
               for name in ("episode_return", "mean_beta")}  # fmt: skip
    return phase | rounded | {"wall_time": round(phase["wall_time"], 1)}
