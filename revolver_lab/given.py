"""What a caller gave, checked before anything is run."""

import numbers

from revolver_lab.errors import SettingsError


def seed_of(seed: object) -> int:
    """Returns a seed, if it is one.

    Raises:
        SettingsError: If it is no whole number of 0 or more.

    Example:
        >>> seed_of(3)
        3
    """
    whole = isinstance(seed, numbers.Integral) and not isinstance(seed, bool)
    if not whole or int(seed) < 0:  # type: ignore[call-overload]
        raise SettingsError(f"seed = {seed!r}", "a whole number of 0 or more", "Try seed=0.")
    return int(seed)  # type: ignore[call-overload]


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
