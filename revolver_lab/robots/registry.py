"""The registered robots: names, and what stands behind each."""

import difflib
import functools
import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from revolver_lab.errors import UnknownNameError

if TYPE_CHECKING:
    import mujoco

    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.evolution.ramps import RampSpec
    from revolver_lab.tasks.base import Task

# Name -> where its record is. Nothing of it is imported before it is asked for.
RECORDS = {
    "cheetah-front-leg": "revolver_lab.robots.cheetah:FRONT_LEG",
    "cheetah-short-legs": "revolver_lab.robots.cheetah:SHORT_LEGS",
    "cheetah-long-legs": "revolver_lab.robots.cheetah:LONG_LEGS",
    "cheetah-segment": "revolver_lab.robots.cheetah_segment:SEGMENT",
    "ball-in-cup-weak-motors": "revolver_lab.robots.ball_in_cup:WEAK_MOTORS",
    "ant-length-mass": "revolver_lab.robots.ant:LENGTH_MASS",
    "ant-leg-emerge": "revolver_lab.robots.ant:LEG_EMERGE",
    "humanoid-length-mass": "revolver_lab.robots.humanoid:LENGTH_MASS",
    "adroit-hammer": "revolver_lab.robots.adroit:HAMMER",
    "adroit-hammer-fingers": "revolver_lab.robots.adroit:HAMMER_FINGERS",
    "adroit-relocate": "revolver_lab.robots.adroit:RELOCATE",
    "adroit-relocate-fingers": "revolver_lab.robots.adroit:RELOCATE_FINGERS",
    "adroit-door": "revolver_lab.robots.adroit:DOOR",
    "adroit-door-fingers": "revolver_lab.robots.adroit:DOOR_FINGERS",
}


@dataclass(frozen=True, kw_only=True)
class Robot:
    """A registered evolution: two robots, what they are to do, and where they come from.

    Attributes:
        name: Registered name, "cheetah-front-leg".
        domain: What ``suite.load`` calls the robot, "cheetah".
        task: What ``suite.load`` calls the evolution, "front_leg".
        source: Builds the source robot.
        target: Builds the target robot.
        tasks: Name of a reward -> task; the first is the default.
        camera: A camera that every robot on the path has.
        origin: Where the files come from, and their licence.
        summary: What changes, in a few words.
        f: Interpolation, as ``Evolution`` takes it.
    """

    name: str
    domain: str
    task: str
    source: "Callable[[], mujoco.MjSpec]"
    target: "Callable[[], mujoco.MjSpec]"
    tasks: "Mapping[str, Callable[[], Task]]"
    camera: str
    origin: str
    summary: str
    f: "RampSpec" = "linear"

    def make_task(self, reward: str | None = None) -> "Task":
        """Return a new task of this robot.

        Args:
            reward: One of ``tasks``; by default the first.

        Raises:
            UnknownNameError: If the robot has no such reward.
        """
        reward = next(iter(self.tasks)) if reward is None else reward
        if reward not in self.tasks:
            raise unknown(f"task {reward!r} of {self.name}", reward, list(self.tasks))
        return self.tasks[reward]()


def unknown(given: str, name: str, names: list[str]) -> UnknownNameError:
    """Return the error for a name that is not among ``names``, near ones first."""
    near = difflib.get_close_matches(str(name), names, n=3, cutoff=0.4)
    remedy = f"Did you mean {' or '.join(map(repr, near))}?" if near else "Take one of these."
    return UnknownNameError(f"unknown {given}", ", ".join(names), remedy)


def names() -> list[str]:
    """Return the names of all registered evolutions.

    Example:
        >>> names()[0]
        'cheetah-front-leg'
    """
    return list(RECORDS)


def get(name: str) -> Robot:
    """Return the record of a registered evolution.

    Args:
        name: One of ``names()``.

    Raises:
        UnknownNameError: If there is none; the near names are in the message.

    Example:
        >>> get("cheetah-front-leg").summary
        'front leg 1 -> 0.4'
    """
    if name not in RECORDS:
        raise unknown(f"robot {name!r}", name, names())
    module, _, record = RECORDS[name].partition(":")
    return getattr(importlib.import_module(module), record)


@functools.lru_cache(maxsize=16)
def load(name: str) -> "Evolution":
    """Return the ``Evolution`` of a registered pair; one object per name, with its cache.

    Args:
        name: One of ``names()``.

    Raises:
        UnknownNameError: If there is none.
    """
    from revolver_lab.evolution.evolution import Evolution

    robot = get(name)
    return Evolution(robot.source(), robot.target(), f=robot.f, name=robot.name)


def find(domain: str, task: str) -> Robot:
    """Return the record that ``suite.load(domain, task)`` means.

    Raises:
        UnknownNameError: If there is none.
    """
    pairs = {f"{r.domain} {r.task}": r for r in map(get, names())}
    if f"{domain} {task}" not in pairs:
        raise unknown(f"task {domain!r}, {task!r}", f"{domain} {task}", list(pairs))
    return pairs[f"{domain} {task}"]
