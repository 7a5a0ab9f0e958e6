"""One number from the scores of many runs: mean, interquartile mean, median, optimality gap."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError
from revolver_lab.stats.checks import number, numbers

Statistic = Callable[[ArrayLike], np.ndarray]


def mean(scores: ArrayLike) -> np.ndarray:
    """Mean over runs and tasks; (..., runs, tasks) -> (...)."""
    return _flat(scores).mean(axis=-1)


def median(scores: ArrayLike) -> np.ndarray:
    """The score that half of all runs of all tasks exceed; (..., runs, tasks) -> (...).

    rliable's median is another: the median over tasks of the mean over runs, which with one task
    is the mean.
    """
    return np.median(_flat(scores), axis=-1)


def iqm(scores: ArrayLike) -> np.ndarray:
    """Interquartile mean: the mean of the middle half of all scores (Agarwal et al. 2021, sec. 4).

    Of N = runs x tasks scores, floor(N / 4) are cut at either end. With fewer than four scores
    nothing is cut, and it is the mean.

    Args:
        scores: (..., runs, tasks), or (runs,) of one task.

    Returns:
        (...).

    Raises:
        SettingsError: If there are none, or some are no finite numbers.

    Example:
        >>> float(iqm([0.0, 1.0, 3.0, 100.0]))
        2.0
    """
    flat = np.sort(_flat(scores), axis=-1)
    cut = flat.shape[-1] // 4
    return flat[..., cut : flat.shape[-1] - cut].mean(axis=-1)


def optimality_gap(scores: ArrayLike, wanted: float = 1.0) -> np.ndarray:
    """How far runs stay below the wanted score on average; what is above does not count.

    mean of max(wanted - score, 0) (Agarwal et al. 2021, section 4), in the unit of the scores:
    scale them so that 1 is what is wanted. Smaller is better.

    Args:
        scores: (..., runs, tasks), or (runs,) of one task.
        wanted: The score that is good enough.

    Returns:
        (...).

    Raises:
        SettingsError: If there are no scores, or something is no finite number.
    """
    return np.maximum(number(wanted, "wanted") - _flat(scores), 0.0).mean(axis=-1)


def _flat(scores: ArrayLike) -> np.ndarray:
    """Scores of all runs and tasks side by side, (..., runs x tasks)."""
    given = numbers(scores, "scores")
    return given.reshape(*given.shape[:-2], -1)


STATISTICS: dict[str, Statistic] = {
    "mean": mean,
    "iqm": iqm,
    "median": median,
    "optimality gap": optimality_gap,
}


def find_statistic(name: str) -> Statistic:
    """Looks a statistic up.

    Raises:
        SettingsError: If there is none of this name.
    """
    if not isinstance(name, str) or name not in STATISTICS:
        raise SettingsError(f"statistic = {name!r}", " or ".join(map(repr, STATISTICS)),
                            "The mean is what the paper reports.")  # fmt: skip
    return STATISTICS[name]
