"""What a caller gave, checked before anything is run."""

import dataclasses
import math
import numbers
import os
from collections.abc import Iterable

from revolver_lab.errors import SettingsError


def is_number(value: object) -> bool:
    """Says whether a value is a finite number that a float can hold, and not True or False.

    Example:
        >>> is_number(0.5), is_number(True), is_number(float("nan")), is_number(10**400)
        (True, False, False, False)
    """
    try:
        return (isinstance(value, numbers.Real) and not isinstance(value, bool)
                and math.isfinite(value))  # fmt: skip
    except OverflowError:
        return False


def is_whole(value: object, least: int = 0) -> bool:
    """Says whether a value is a whole number of at least this, and not True or False.

    Example:
        >>> is_whole(3, 1), is_whole(3.0), is_whole(True)
        (True, False, False)
    """
    whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    return whole and int(value) >= least  # type: ignore[call-overload]


def are_widths(value: object) -> bool:
    """Says whether a value is a list of one or more widths of layers.

    Example:
        >>> are_widths((64, 64)), are_widths(()), are_widths([0])
        (True, False, False)
    """
    return (isinstance(value, tuple | list) and len(value) > 0
            and all(is_whole(width, 1) for width in value))  # fmt: skip


def count_of(name: str, value: object, least: int, remedy: str, *, most: int | None = None) -> int:
    """Returns a number of things, if it is one.

    Args:
        name: What the caller knows it as.
        value: What was given.
        least: The smallest that works.
        remedy: What to do otherwise.
        most: The largest that works; None knows of none.

    Raises:
        SettingsError: If it is no whole number, smaller or larger.

    Example:
        >>> count_of("episodes", 3, 1, "Ask for 10.")
        3
    """
    count = int(value) if is_whole(value, least) else None  # type: ignore[call-overload]
    if count is None or (most is not None and count > most):
        end = "or more" if most is None else f"to {most}"
        raise SettingsError(f"{name} = {value!r}", f"a whole number, {least} {end}", remedy)
    return count


def seed_of(seed: object) -> int:
    """Returns a seed, if it is one.

    Raises:
        SettingsError: If it is no whole number of 0 or more.

    Example:
        >>> seed_of(3)
        3
    """
    return count_of("seed", seed, 0, "Try seed=0.")


def require(name: str, value: object, kind: type | tuple[type, ...], remedy: str) -> None:
    """Refuses a value of another type than is asked for.

    Args:
        name: What the caller knows it as.
        value: What was given.
        kind: What it has to be.
        remedy: How to get one.

    Raises:
        SettingsError: If it is something else.

    Example:
        >>> require("n", 3, int, "Try 3.")
    """
    if isinstance(value, kind):
        return
    kinds = kind if isinstance(kind, tuple) else (kind,)
    allowed = " or ".join("None" if k is type(None) else f"a {k.__name__}" for k in kinds)
    raise SettingsError(f"{name} = {value!r:.80}", allowed, remedy)


def require_path(name: str, value: object) -> None:
    """Refuses what is no path.

    Raises:
        SettingsError: If it is neither text nor a Path.

    Example:
        >>> require_path("folder", "out/runs")
    """
    require(name, value, (str, os.PathLike), "Try 'out'.")


def require_time(name: str, value: object) -> None:
    """Refuses what is no time that can pass; infinity, which never comes, is one.

    Raises:
        SettingsError: If it is no number above 0.

    Example:
        >>> require_time("every", 60)
    """
    if not (isinstance(value, numbers.Real) and not isinstance(value, bool)
            and float(value) > 0):  # fmt: skip
        raise SettingsError(f"{name} = {value!r:.80}", "a positive time in seconds", "Try 60.")


def require_fields(name: str, given: Iterable[object], kind: type) -> None:
    """Refuses names that no field of a dataclass has.

    Args:
        name: What the caller knows the fields' owner as.
        given: The names.
        kind: The dataclass.

    Raises:
        SettingsError: If there is an unknown one.
    """
    known = [field.name for field in dataclasses.fields(kind)]
    unknown = [each for each in given if each not in known]
    if unknown:
        raise SettingsError(f"{name} with {unknown!r:.80}", f"the fields {known}", "Leave it out.")


def require_call(name: str, value: object, remedy: str) -> None:
    """Refuses what is neither a function nor None.

    Raises:
        SettingsError: If it cannot be called.

    Example:
        >>> require_call("report", print, "Pass print.")
    """
    if value is not None and not callable(value):
        raise SettingsError(f"{name} = {value!r:.80}", "a function or None", remedy)
