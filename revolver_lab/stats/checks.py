"""What may go into a statistic: finite numbers, one per run and task."""

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError

Seed = int | np.random.Generator


def numbers(values: ArrayLike, name: str) -> np.ndarray:
    """Returns finite floats of any shape but an empty one.

    Args:
        values: What was given.
        name: What to call it in an error.

    Raises:
        SettingsError: If there is nothing in it, or something that is not a finite number.
    """
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise SettingsError(f"{name} of type {type(values).__name__}", "an array of numbers",
                            "Give one number for each run and task.") from None  # fmt: skip
    if array.size == 0:
        raise SettingsError(f"{name} of shape {array.shape}", "one number or more",
                            "Without runs there is nothing to say.")  # fmt: skip
    if not np.isfinite(array).all():
        count = int((~np.isfinite(array)).sum())
        raise SettingsError(
            f"{name} with {count} of {array.size} not finite", "finite numbers",
            "Score a run that failed with what its policy returned; do not drop it.",
        )  # fmt: skip
    return array


def number(value: ArrayLike, name: str) -> float:
    """Returns one finite float.

    Args:
        value: What was given.
        name: What to call it in an error.

    Raises:
        SettingsError: If it is no finite number, or several.
    """
    found = numbers(value, name)
    if found.ndim:
        raise SettingsError(f"{name} of shape {found.shape}", "one number", "Ask one by one.")
    return float(found)


def as_scores(values: ArrayLike, name: str = "scores") -> np.ndarray:
    """Returns scores as (runs, tasks); (runs,) is one task.

    Args:
        values: What was given; a run is a seed.
        name: What to call it in an error.

    Raises:
        SettingsError: If it is empty, not finite, or of another shape.
    """
    array = numbers(values, name)
    if array.ndim not in (1, 2):
        raise SettingsError(f"{name} of shape {array.shape}", "(runs,) or (runs, tasks)",
                            "Put seeds first; average episodes of one seed first.")  # fmt: skip
    return array[:, None] if array.ndim == 1 else array


def check_confidence(confidence: float) -> None:
    """Refuses a confidence outside (0, 1).

    Raises:
        SettingsError: If it is no number in (0, 1).
    """
    if not isinstance(confidence, int | float | np.floating) or not 0 < confidence < 1:
        raise SettingsError(f"confidence = {confidence!r}", "a number in (0, 1)", "Try 0.95.")


def check_count(count: int, name: str) -> None:
    """Refuses a count that is no whole number, or less than one.

    Raises:
        SettingsError: If it is not 1 or more.
    """
    if not isinstance(count, int | np.integer) or isinstance(count, bool) or count < 1:
        raise SettingsError(f"{name} = {count!r}", "a whole number, 1 or more", "Try 10000.")


def generator(seed: Seed) -> np.random.Generator:
    """Returns the stream of a seed; a generator is used as it is.

    Raises:
        SettingsError: If it is no seed.
    """
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError):
        raise SettingsError(f"seed = {seed!r}", "a whole number, 0 or more, or a Generator",
                            "Try 0.") from None  # fmt: skip
