"""The record of a registered evolution: two robots, what they are to do, where they come from."""

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from revolver_lab.errors import UnknownNameError

if TYPE_CHECKING:
    import mujoco

    from revolver_lab.evolution.ramps import RampSpec
    from revolver_lab.tasks.base import Task


@dataclass(frozen=True, kw_only=True, eq=False)
class Robot:
    """A registered evolution: two robots, what they are to do, and where they come from.

    Attributes:
        name: Registered name, "cheetah-front-leg".
        source: Builds the source robot: an MjSpec, or a file's path.
        target: Builds the target robot.
        tasks: Name of a reward -> task; the first is the default.
        domain: What ``suite.load`` calls the robot, "cheetah".
        task: What ``suite.load`` calls the evolution, "front_leg"; by default the name.
        camera: A camera that every robot on the path has; -1 is MuJoCo's free one.
        origin: Where the files come from, and their licence.
        summary: What changes, in a few words.
        f: Interpolation, as ``Evolution`` takes it.
        expert: A policy's file that works on the source; None is the shipped one.
    """

    name: str
    source: "Callable[[], mujoco.MjSpec | str | Path]"
    target: "Callable[[], mujoco.MjSpec | str | Path]"
    tasks: "Mapping[str, Callable[[], Task]]"
    domain: str = "own"
    task: str = ""
    camera: str | int = -1
    origin: str = "your own"
    summary: str = ""
    f: "RampSpec" = "linear"
    expert: str | Path | None = None

    @property
    def usual_task(self) -> str:
        """Name of the reward that is meant where none is named."""
        return next(iter(self.tasks))

    def make_task(self, reward: str | None = None) -> "Task":
        """Return a new task of this robot.

        Args:
            reward: One of ``tasks``; by default the first.

        Raises:
            UnknownNameError: If the robot has no such reward.
        """
        reward = self.usual_task if reward is None else reward
        if not isinstance(reward, str) or reward not in self.tasks:
            raise unknown(f"task {reward!r} of {self.name}", reward, list(self.tasks))
        return self.tasks[reward]()


def unknown(
    given: str, name: str, names: Sequence[str], usual: str = "Take one of these."
) -> UnknownNameError:
    """Return the error for a name that is not among ``names``, near ones first."""
    near = difflib.get_close_matches(str(name), names, n=3, cutoff=0.4)
    remedy = f"Did you mean {' or '.join(map(repr, near))}?" if near else usual
    return UnknownNameError(f"unknown {given}", ", ".join(names), remedy)
