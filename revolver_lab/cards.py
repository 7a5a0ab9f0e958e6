"""The model card of a policy: what it is, how good it is, and the command that makes it again."""

import dataclasses
import importlib.metadata
import json
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from revolver_lab.errors import PolicyFileError

_PACKAGES = ("revolver-lab", "mujoco", "dm-control", "gymnasium", "numpy", "torch",
             "stable-baselines3")  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True)
class ModelCard:
    """Where a policy comes from.

    Attributes:
        robot: Name of the evolution it was trained on, as in `revolver_lab.names()`.
        alpha: Evolution parameter of the robot that `episode_return` was measured on, in [0, 1];
            where it was not, of the last one it was trained on. A log tells how far alpha came.
        algorithm: Name of the learning algorithm.
        steps: Environment steps spent on it [steps], expert not counted.
        seed: Seed of the run, or None where there was none.
        episode_return: Mean unshaped return on that robot, or None where not measured.
        versions: Package name to version, of the machine it was trained on.
        command: The command that trains it again.
        commit: Commit of this repository, or "".
        note: Anything a reader should know, in a sentence.
    """

    robot: str = ""
    alpha: float = 0.0
    algorithm: str = ""
    steps: int = 0
    seed: int | None = None
    episode_return: float | None = None
    versions: Mapping[str, str] = dataclasses.field(default_factory=dict)
    command: str = ""
    commit: str = ""
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        """Returns the card as plain JSON values."""
        return {**dataclasses.asdict(self), "versions": dict(self.versions)}

    @classmethod
    def from_json(cls, value: Any, *, path: str = "card") -> "ModelCard":
        """Reads a card back.

        Args:
            value: What `json.loads` returned.
            path: The file it came from, for the message.

        Raises:
            PolicyFileError: If it is not an object, or has fields that no card has.
        """
        known = {field.name for field in dataclasses.fields(cls)}
        if not isinstance(value, dict) or not set(value) <= known:
            raise PolicyFileError(
                f"card in {path} = {json.dumps(value)[:80]}",
                f"an object with the fields {sorted(known)}",
                "Save the policy again with this version of revolver_lab.",
            )
        return cls(**value)


def versions() -> dict[str, str]:
    """Returns the versions of Python and of the packages a result depends on.

    Example:
        >>> sorted(versions())[:3]
        ['dm-control', 'gymnasium', 'mujoco']
    """
    found = {"python": ".".join(map(str, sys.version_info[:3]))}
    for name in _PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def commit() -> str:
    """Returns the commit of the repository this package runs from, or "" outside of one."""
    try:
        answer = subprocess.run(
            ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short=12", "HEAD"],
            capture_output=True, text=True, timeout=10, check=False,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.strip() if answer.returncode == 0 else ""


def command() -> str:
    """Returns the command line of this process, as one would type it."""
    program = Path(sys.argv[0])
    if program.suffix == ".py" and program.parent.name == "revolver_lab":
        return shlex.join(["python", "-m", f"revolver_lab.{program.stem}", *sys.argv[1:]])
    return shlex.join([program.name, *sys.argv[1:]])
