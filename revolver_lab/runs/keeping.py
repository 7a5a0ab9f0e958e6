"""Recorded runs: what of a finished run is worth keeping beside the code, and what is not."""

import csv
import itertools
import math
import os
import shlex
import tempfile
from pathlib import Path

from revolver_lab.errors import SettingsError
from revolver_lab.files import write_atomically, write_json
from revolver_lab.logs import write_table
from revolver_lab.runs import store
from revolver_lab.runs.results import LearnerResult, Results
from revolver_lab.runs.tables import read_results

_MOST_ROWS = 400
"""Of a learner in a table."""

_TABLES = (store.LEARNERS, store.PHASES, store.EVALUATIONS, store.ITERATIONS)


def keep(folder: str | Path, out: str | Path) -> Path:
    """Copies a finished run into a folder of recorded ones, without what is large.

    Every number of every learner stays, but for long natural runs, whose iterations are thinned.
    Of the policies only the actor of each method's lowest seed stays, and the expert goes: the
    plan holds the hash of its weights. A copy that is there already is replaced as a whole, once
    the new one is complete.

    Args:
        folder: The run's folder.
        out: The folder of recorded runs, such as "assets/results".

    Returns:
        The new folder, of the same name; `Results` read it as they read the whole.

    Raises:
        SettingsError: If the run is not finished, or is the copy itself.
        PolicyFileError: If a policy that is kept is missing or torn.
    """
    folder = Path(folder)
    plan, results = store.read_plan(folder), read_results(folder)
    target = Path(out) / plan.name
    if target.resolve() == folder.resolve():
        raise SettingsError(f"{folder}, which is in {out} already", "a run from elsewhere",
                            "Keep runs of out/runs in assets/results.")  # fmt: skip
    config = (Path(plan.name) if target.is_absolute() else target) / store.CONFIG
    command = plan.command.replace(store.CONFIG, shlex.quote(str(config)))
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".keep-", dir=target.parent) as aside:
        copy = Path(aside) / plan.name
        _copy(folder, results, plan.learner is None, copy, command)
        _put(copy, target, Path(aside) / "before")
    return target


def _copy(folder: Path, results: Results, natural: bool, copy: Path, command: str) -> None:
    """Writes what is kept of a run into a new folder."""
    kept = [results.of(method)[0] for method in results.methods]
    for one in kept:
        _keep_actor(one, copy)
    card = store.read_card(folder)
    for name in (name for name in _TABLES if (folder / name).exists()):
        write_atomically(copy / name, (folder / name).read_bytes())
        if name in (store.ITERATIONS, store.PHASES) and natural:
            _thin(copy / name)
            altered = {name: store.digest_of(copy / name)}
            card["digests"] = card.get("digests", {}) | altered
    write_atomically(copy / store.CONFIG, (folder / store.CONFIG).read_bytes())
    left_out = _left_out(kept, len(results.learners))
    write_json(copy / store.CARD, card | {"command": command, "left_out": left_out})


def _put(copy: Path, target: Path, before: Path) -> None:
    """Puts a whole folder where it belongs; the one before goes only as the new one comes."""
    if target.exists():
        os.replace(target, before)
    try:
        os.replace(copy, target)
    except BaseException:
        if before.exists():
            os.replace(before, target)
        raise


def _thin(path: Path) -> None:
    """Leaves every so-many-th row of a long learner in a table, its last one included."""
    with open(path, newline="") as file:
        rows = [*csv.DictReader(file)]
    left = []
    for _, some in itertools.groupby(rows, lambda row: (row["method"], row["seed"])):
        mine = [*some]
        every = math.ceil(len(mine) / _MOST_ROWS)
        left += mine[(len(mine) - 1) % every :: every]
    if len(left) < len(rows):
        write_table(path, left)


def _keep_actor(one: LearnerResult, target: Path) -> None:
    """Saves a learner's policy without its critic."""
    path = target / store.POLICIES / f"{one.method}-{one.seed}.safetensors"
    one.policy().without_critic().save(path)
    path.with_suffix(".json").unlink()  # the card is in the file, too


def _left_out(kept: list[LearnerResult], learners: int) -> str:
    """Says what a reader will not find."""
    names = ", ".join(f"{one.method}-{one.seed}" for one in kept)
    return (f"The expert, all critics, and the policies of {learners - len(kept)} of {learners} "
            f"learners; the actors of {names} are here.")  # fmt: skip
