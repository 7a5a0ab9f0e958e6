"""What the files of a run hold: their shapes, checked in one place as they are read."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from revolver_lab.errors import SettingsError
from revolver_lab.given import is_number, is_whole

RESTORE = "Restore it, or delete the folder and train again."
_LARGEST = 2**53  # what a float counts up to


@dataclasses.dataclass(frozen=True)
class Kind:
    """What a single value may be.

    Attributes:
        words: What it is, in words.
        holds: Says whether a value is one.
    """

    words: str
    holds: Callable[[Any], bool]


Shape = Kind | Mapping[str, "Shape"] | list["Shape"]
"""A value; an object with these fields and maybe others, "?" after those it may lack; a list."""

TEXT = Kind("text", lambda v: isinstance(v, str))
FLAG = Kind("true or false", lambda v: isinstance(v, bool))
WHOLE = Kind("a whole number of 0 or more", lambda v: is_whole(v) and v < _LARGEST)
NUMBER = Kind("a finite number", is_number)
# A checkpoint has nan where a worker's other files have null.
MAYBE = Kind("a number or null", lambda v: v is None or v != v or is_number(v))
SOME = Kind("a list of finite numbers, one or more",
            lambda v: isinstance(v, list) and len(v) > 0 and all(map(is_number, v)))  # fmt: skip
_SHARDS = Kind("a whole number, 1 to 10,000", lambda v: is_whole(v, 1) and v <= 10_000)
_DIGESTS = Kind("digests by the names of tables", lambda v: isinstance(v, dict)
                and all(isinstance(digest, str) for digest in v.values()))  # fmt: skip
_POINT = Kind("steps and a return", lambda v: isinstance(v, list) and len(v) == 2
              and WHOLE.holds(v[0]) and MAYBE.holds(v[1]))  # fmt: skip

CARD: Shape = {"command": TEXT, "wall_time": NUMBER, "processes": _SHARDS, "expert_steps": WHOLE,
               "expert_return?": MAYBE, "digests?": _DIGESTS}  # fmt: skip
SHARDED: Shape = {"shards": _SHARDS}
FAILED: Shape = {"message": TEXT}
_PHASE: Shape = {"phase": WHOLE, "alpha": NUMBER, "episodes": WHOLE, "steps": WHOLE,
                 "episode_return": MAYBE, "mean_beta": MAYBE, "kept": WHOLE,
                 "wall_time": NUMBER}  # fmt: skip
_ITERATION: Shape = {"iteration": WHOLE, "alpha": NUMBER, "steps": WHOLE, "wall_time": NUMBER,
                     **dict.fromkeys(("success", "average", "episode_return", "mean_beta", "kl",
                                      "log_std", "explained"), MAYBE)}  # fmt: skip
_EVALUATION: Shape = {"steps": WHOLE, "alpha": NUMBER, "returns": SOME, "successes?": [FLAG]}
_CURVES: Shape = {"phases": [_PHASE], "evaluations": [_EVALUATION], "iterations?": [_ITERATION]}
LOGS: Shape = {"logs": [_CURVES]}
_ROW: Shape = {**_CURVES, "method": TEXT, "seed": WHOLE, "steps": WHOLE,
               "evaluation_steps": WHOLE, "wall_time": NUMBER, "reached_target": FLAG,
               "failure": TEXT}  # fmt: skip
DONE: Shape = {"learners": [_ROW], "versions": {}, "commit": TEXT}
_NATURAL_ROW: Shape = {**_ROW, "iterations": [_ITERATION], "finished": FLAG}
DONE_NATURAL: Shape = {**DONE, "learners": [_NATURAL_ROW]}
PROGRESS: Shape = {"seconds": NUMBER, "message": TEXT, "learners": [
    {"method": TEXT, "seed": WHOLE, "alpha": NUMBER, "phase": WHOLE, "phases": WHOLE,
     "steps": WHOLE, "episode_return": MAYBE, "evaluations": [_POINT], "over": FLAG,
     "failure": TEXT, "success?": MAYBE}]}  # fmt: skip


def check(value: Any, shape: Shape, path: Path) -> Any:
    """Returns what a file holds, if it is what this package writes there.

    Args:
        value: What was read.
        shape: What it has to be.
        path: The file, for the message.

    Raises:
        SettingsError: For the first thing that is not.
    """
    wrong = problem(value, shape)
    if wrong is not None:
        where, found, allowed = wrong
        raise SettingsError(f"{path}, whose {where} is {found}", allowed, RESTORE)
    return value


def problem(value: Any, shape: Shape, where: str = "content") -> tuple[str, str, str] | None:
    """Says where a value is not as it should be, what is there, and what should be; or None.

    Example:
        >>> problem({"shards": -1}, SHARDED)
        ('shards', '-1', 'a whole number, 1 to 10,000')
        >>> problem({"learners": [{}]}, {"learners": [{"seed": WHOLE}]})
        ('learners[0].seed', 'missing', 'a whole number of 0 or more')
    """
    if isinstance(shape, Kind):
        return None if shape.holds(value) else (where, _short(value), shape.words)
    if isinstance(shape, list):
        if not isinstance(value, list):
            return where, _short(value), "a list"
        inner = ((item, shape[0], f"{where}[{i}]") for i, item in enumerate(value))
    else:
        if not isinstance(value, dict):
            return where, _short(value), f"an object with {[*shape]}"
        prefix = "" if where == "content" else f"{where}."
        for name, kind in shape.items():
            if name not in value and not name.endswith("?"):
                return f"{prefix}{name}", "missing", kind.words if isinstance(kind, Kind) else "it"
        inner = ((value[name.rstrip("?")], kind, f"{prefix}{name.rstrip('?')}")
                 for name, kind in shape.items() if name.rstrip("?") in value)  # fmt: skip
    return next((found for each in inner if (found := problem(*each)) is not None), None)


def _short(value: Any) -> str:
    """Returns a value as text, cut where it is long."""
    try:
        return f"{value!r:.60}"
    except (ValueError, RecursionError):  # a number of thousands of digits, lists in lists
        return f"a {type(value).__name__} that is too long to show"
