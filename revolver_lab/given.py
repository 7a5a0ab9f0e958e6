"""What a caller gave, checked before anything is run."""

import math
import numbers

from revolver_lab.errors import SettingsError


def is_number(value: object) -> bool:
    """Says whether a value is a finite number, and not True or False.

    Example:
        >>> is_number(0.5), is_number(True), is_number(float("nan"))
        (True, False, False)
    """
    return (isinstance(value, numbers.Real) and not isinstance(value, bool)
            and math.isfinite(value))  # fmt: skip


def is_whole(value: object, least: int = 0) -> bool:
    """Says whether a value is a whole number of at least this, and not True or False.

    Example:
        >>> is_whole(3, 1), is_whole(3.0), is_whole(True)
        (True, False, False)
    """
    whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    return whole and int(value) >= least  # type: ignore[call-overload]


def count_of(name: str, value: object, least: int, remedy: str) -> int:
    """Returns a number of things, if it is one.

    Args:
        name: What the caller knows it as.
        value: What was given.
        least: The smallest that works.
        remedy: What to do otherwise.

    Raises:
        SettingsError: If it is no whole number, or smaller.

    Example:
        >>> count_of("episodes", 3, 1, "Ask for 10.")
        3
    """
    if not is_whole(value, least):
        raise SettingsError(f"{name} = {value!r}", f"a whole number, {least} or more", remedy)
    return int(value)  # type: ignore[call-overload]


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
