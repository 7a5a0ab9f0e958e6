"""What several commands share: where a policy comes from, progress, and last words."""

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from revolver_lab.errors import MissingExtraError, SettingsError
from revolver_lab.experts import load_expert
from revolver_lab.policies import Policy
from revolver_lab.progress import ProgressLines
from revolver_lab.runs import Results, Run
from revolver_lab.runs.store import CONFIG

if TYPE_CHECKING:
    from revolver_lab.recorder import Progress

Arguments = argparse.Namespace
BAD_USE = 2
"""Exit code after an error that the user can mend; argparse uses it too."""


def policy_of(name: str, given: str) -> Policy:
    """Returns the shipped expert of a robot, or the policy in a file or in a run's folder.

    Args:
        name: The robot.
        given: "expert", a file, a folder, or FOLDER:METHOD-SEED.

    Raises:
        PolicyFileError: If there is none.
        SettingsError: If a folder holds several and none is named.
    """
    if given == "expert":
        return load_expert(name)
    folder, _, learner = given.rpartition(":")
    if Path(given).is_dir():
        folder, learner = given, ""
    if folder and (Path(folder) / CONFIG).is_file():
        return _learner_of(Run.open(folder).results(), learner)
    if Path(given).is_dir():
        return Policy.load(Path(given) / "policy.safetensors")
    return Policy.load(given)


def _learner_of(results: Results, learner: str) -> Policy:
    """Returns the policy of a learner of a run; of the only one, where none is named."""
    named = {f"{one.method}-{one.seed}": one for one in results.learners}
    if learner not in named and not (len(named) == 1 and not learner):
        raise SettingsError(f"learner {learner!r}", f"one of {[*named]}",
                            f"Name one: FOLDER:{next(iter(named))}.")  # fmt: skip
    return named.get(learner, results.learners[0]).policy()


@contextlib.contextmanager
def training() -> Iterator[None]:
    """Says how to get torch, where it is missing."""
    try:
        yield
    except ModuleNotFoundError as problem:
        if (problem.name or "").partition(".")[0] not in ("torch", "stable_baselines3"):
            raise
        raise MissingExtraError(
            f"{problem.name} is missing", "the train extra", "pip install 'revolver-lab[train]'"
        ) from problem


def shown(name: str) -> "Callable[[Progress], None]":
    """Returns a callback that tells on stderr how a training is doing."""
    lines = ProgressLines(sys.stderr)
    return lambda progress: lines.show({name: progress})


def wrote(path: str | Path | None) -> int:
    """Names the file or folder that was written."""
    if path is not None:
        print(f"wrote {path}")
    return 0
