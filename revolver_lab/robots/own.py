"""Robots of one's own: a record in a file, known by name here and to every worker."""

import hashlib
import importlib
import importlib.util
import os
import re
import sys
from pathlib import Path

from revolver_lab.errors import SettingsError
from revolver_lab.robots.robot import Robot

VARIABLE = "REVOLVER_LAB_ROBOTS"
"""The environment variable that names them, "FILE.py:RECORD" or "package.module:RECORD" each."""

_BETWEEN = ";"
_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,47}")
_LOADED: dict[str, tuple[float, Robot]] = {}


def places() -> list[str]:
    """Return where the robots of one's own are, as ``register`` or the user put it."""
    return [place for place in os.environ.get(VARIABLE, "").split(_BETWEEN) if place.strip()]


def own_robots() -> dict[str, Robot]:
    """Return the records by name; a file that has changed is read again.

    Raises:
        SettingsError: If one of them cannot be read.
    """
    return {robot.name: robot for robot in map(read_record, places())}


def read_record(place: str) -> Robot:
    """Return a record from where it is.

    Args:
        place: "FILE.py:RECORD" or "package.module:RECORD". The file is executed.

    Raises:
        SettingsError: If there is none, or its name cannot be that of a folder.
    """
    found, colon, attribute = place.strip().rpartition(":")
    if not colon or not found or not attribute.isidentifier():
        raise _refusal(f"{place!r}")
    stamp = os.stat(found).st_mtime if found.endswith(".py") and Path(found).is_file() else 0.0
    if place in _LOADED and _LOADED[place][0] == stamp:
        return _LOADED[place][1]
    try:
        module = _execute(Path(found)) if found.endswith(".py") else importlib.import_module(found)
        robot = getattr(module, attribute)
    except Exception as problem:  # whatever its author has done
        raise _refusal(f"{place!r} ({type(problem).__name__}: {problem})") from problem
    if not isinstance(robot, Robot):
        raise _refusal(f"{place!r}, a {type(robot).__name__}")
    if not isinstance(robot.name, str) or not _NAME.fullmatch(robot.name) or not robot.tasks:
        raise SettingsError(
            f"{place!r} with the name {robot.name!r} and the tasks {[*robot.tasks]}",
            "small letters, digits, '-' and '_', 48 at most; and a task", "Mend the record.",
        )  # fmt: skip
    _LOADED[place] = stamp, robot
    return robot


def likeness(robot: Robot) -> str:
    """Return a hash of the two robots as MuJoCo writes them down, the content of meshes left out.

    Args:
        robot: A record.
    """
    from revolver_lab.evolution.reading import read_robot

    texts = [read_robot(made()).to_xml() for made in (robot.source, robot.target)]
    return hashlib.sha256("".join(texts).encode()).hexdigest()[:16]


def absolute(place: str) -> str:
    """Return a place that means the same from every folder."""
    found, colon, attribute = place.strip().rpartition(":")
    return f"{Path(found).resolve()}{colon}{attribute}" if found.endswith(".py") else place.strip()


def remember(place: str) -> None:
    """Put a place among those that workers started from here on are told."""
    kept = [known for known in places() if known != place]
    os.environ[VARIABLE] = _BETWEEN.join([*kept, place])


def _execute(path: Path) -> object:
    """Run a file as a module of its own; it can import what lies beside it."""
    path = path.resolve()
    name = f"revolver_lab_own_{hashlib.sha256(str(path).encode()).hexdigest()[:8]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(path)
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # which dataclasses look up
    spec.loader.exec_module(module)
    return module


def _refusal(what: str) -> SettingsError:
    """Build the error for what leads to no robot."""
    allowed = "'FILE.py:RECORD' or 'package.module:RECORD', a revolver_lab.robots.Robot"
    return SettingsError(what, allowed, "See CONTRIBUTING.md, 'A robot of your own'.")
