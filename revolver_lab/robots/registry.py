"""The registered robots: names, and what stands behind each."""

import functools
import importlib
from typing import TYPE_CHECKING

from revolver_lab.errors import SettingsError
from revolver_lab.given import require
from revolver_lab.robots import own
from revolver_lab.robots.robot import Robot, unknown

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution

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


def names() -> list[str]:
    """Return the names of all registered evolutions, your own last.

    Example:
        >>> names()[0]
        'cheetah-front-leg'
    """
    return [*RECORDS, *_own()]


def _own() -> dict[str, Robot]:
    """Return the records of your own robots by name.

    Raises:
        SettingsError: If one of them has a name of ours.
    """
    mine = own.own_robots()
    for name in mine.keys() & RECORDS.keys():
        raise SettingsError(f"a robot in {own.VARIABLE} with the name {name!r}",
                            "a name that is not taken", "Give it another name.")  # fmt: skip
    return mine


def register(place: str) -> str:
    """Make a robot of your own known by name, here and to all workers started from here on.

    Everything that takes the name of a robot then takes yours: environments, transfers, plans,
    runs and sweeps, the lab. Outside of Python the environment variable REVOLVER_LAB_ROBOTS
    does the same; several are separated by semicolons.

    Args:
        place: "FILE.py:RECORD" or "package.module:RECORD", where RECORD is a ``Robot``. The
            file is executed; what it imports may lie beside it.

    Returns:
        The robot's name.

    Raises:
        SettingsError: If there is no such record, or its name is taken.
    """
    if not isinstance(place, str):
        raise SettingsError(f"place = {place!r:.80}", "'FILE.py:RECORD'", "Save it in a file.")
    place = own.absolute(place)
    name = own.read_record(place).name
    taken = {own.read_record(other).name for other in own.places() if other != place}
    if name in RECORDS or name in taken:
        raise SettingsError(f"{place!r} with the name {name!r}", "a name that is not taken",
                            "Give it another name.")  # fmt: skip
    own.remember(place)
    return name


def get(name: str) -> Robot:
    """Return the record of a registered evolution.

    Args:
        name: One of ``names()``.

    Raises:
        UnknownNameError: If there is none; the near names are in the message.
        SettingsError: If it is no name.

    Example:
        >>> get("cheetah-front-leg").summary
        'front leg 1 -> 0.4'
    """
    require("name", name, str, "See rvl.names().")
    if name not in RECORDS:
        mine = _own()
        if name in mine:
            return mine[name]
        usual = "Take one of these, or register('FILE.py:RECORD') of revolver_lab.robots."
        raise unknown(f"robot {name!r}", name, names(), usual)
    module, _, record = RECORDS[name].partition(":")
    return getattr(importlib.import_module(module), record)


def load(name: str) -> "Evolution":
    """Return the ``Evolution`` of a registered pair; one object per name, with its cache.

    Args:
        name: One of ``names()``.

    Raises:
        UnknownNameError: If there is none.
    """
    return _made(get(name))


@functools.lru_cache(maxsize=16)
def _made(robot: Robot) -> "Evolution":
    """Make the evolution of a record, once."""
    from revolver_lab.evolution.evolution import Evolution

    return Evolution(robot.source(), robot.target(), f=robot.f, name=robot.name)


def evolution_of(robot: "Evolution | str") -> "Evolution":
    """Return an evolution as it is, and a name's as `load` does.

    Args:
        robot: A registered name, or any ``Evolution``.

    Raises:
        UnknownNameError: If there is none of that name.
        SettingsError: If it is neither.
    """
    from revolver_lab.evolution.evolution import Evolution

    require("robot", robot, (str, Evolution), "See rvl.names(), or pass rvl.Evolution(a, b).")
    return load(robot) if isinstance(robot, str) else robot


def find(domain: str, task: str) -> Robot:
    """Return the record that ``suite.load(domain, task)`` means.

    Raises:
        UnknownNameError: If there is none.
    """
    pairs = {f"{r.domain} {r.task or r.name}": r for r in map(get, names())}
    if f"{domain} {task}" not in pairs:
        raise unknown(f"task {domain!r}, {task!r}", f"{domain} {task}", list(pairs))
    return pairs[f"{domain} {task}"]
