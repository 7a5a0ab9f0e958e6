"""How far a number from few seeds can be trusted: stratified bootstrap intervals and bands."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError
from revolver_lab.stats.aggregates import find_statistic
from revolver_lab.stats.checks import (
    Seed,
    as_scores,
    check_confidence,
    check_count,
    generator,
    numbers,
)

_CHUNK = 2_000_000
"""Numbers held at once while resampling, 16 MB."""


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A number and how far the seeds leave it open.

    Attributes:
        value: The statistic of the scores as they are.
        low: Lower end; -infinity (0 for a fraction) where one seed leaves it open.
        high: Upper end; infinity (1 for a fraction) where one seed leaves it open.
        confidence: How often such intervals are meant to cover the truth.
        seeds: Runs in each task; of two groups, the smaller.
    """

    value: float
    low: float
    high: float
    confidence: float
    seeds: int

    @property
    def known(self) -> bool:
        """Whether there are two seeds or more: one alone says nothing about others."""
        return self.seeds > 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """Numbers along an axis, each with its own (pointwise) interval.

    Attributes:
        value: The statistic at each of K points, (K,).
        low: Lower ends, (K,).
        high: Upper ends, (K,).
        confidence: How often the interval at one point is meant to cover the truth there; all
            points together are covered less often.
        seeds: Runs in each task.
    """

    value: np.ndarray = field(repr=False)
    low: np.ndarray = field(repr=False)
    high: np.ndarray = field(repr=False)
    confidence: float
    seeds: int


def interval(
    scores: ArrayLike,
    statistic: str = "mean",
    confidence: float = 0.95,
    *,
    resamples: int = 10_000,
    seed: Seed = 0,
) -> Interval:
    """A statistic with its stratified bootstrap interval (Agarwal et al. 2021, section 4).

    Runs are drawn again with replacement, within each task on its own, and the interval holds
    the middle `confidence` of what the statistic becomes (the percentile method).

    It is too narrow for few seeds. For the mean of normal scores a 95 % interval was measured to
    cover the truth in 75 % of cases with 3 seeds, 84 % with 5, 89 % with 10, 93 % with 20. One
    seed leaves everything open: the ends are infinite. Seeds that all score the same give an
    interval without width, which means that no spread was seen, not that there is none; for
    successes use `success`.

    Args:
        scores: (runs, tasks), or (runs,) for one task; a run is a seed.
        statistic: A name in `STATISTICS`.
        confidence: In (0, 1).
        resamples: How often the runs are drawn again.
        seed: Seed of the draws.

    Raises:
        SettingsError: If scores are empty, not finite or of another shape, or a setting is
            outside its range.

    Example:
        >>> found = interval([3.0, 5.0, 4.0, 6.0, 7.0])
        >>> found.value, found.low, found.high, found.seeds
        (5.0, 3.8, 6.2, 5)
        >>> interval([3.0]).low
        -inf
    """
    table, compute = as_scores(scores), find_statistic(statistic)
    check_confidence(confidence)
    columns = np.arange(table.shape[1])
    again = [compute(table[chosen, columns]) for chosen in _draws(table, resamples, seed)]
    low, high = ends(np.concatenate(again), confidence, table.shape[0])
    return Interval(value=float(compute(table)), low=float(low), high=float(high),
                    confidence=confidence, seeds=table.shape[0])  # fmt: skip


def band(
    curves: ArrayLike,
    statistic: str = "mean",
    confidence: float = 0.95,
    *,
    resamples: int = 10_000,
    seed: Seed = 0,
) -> Band:
    """A statistic over seeds at each point of their curves; whole curves are drawn again.

    Each point has the interval that `interval` gives to the scores there.

    Args:
        curves: (S, K): a row for each seed.
        statistic: A name in `STATISTICS`.
        confidence: In (0, 1), of each point on its own.
        resamples: How often the seeds are drawn again.
        seed: Seed of the draws.

    Raises:
        SettingsError: As in `interval`.
    """
    table, compute = numbers(curves, "curves"), find_statistic(statistic)
    check_confidence(confidence)
    if table.ndim != 2:
        raise SettingsError(f"curves of shape {table.shape}", "(seeds, points)",
                            "Give a row for each seed.")  # fmt: skip
    again = [
        np.stack([compute(curve[chosen]) for curve in table.T], axis=-1)
        for chosen in _draws(table[:, :1], resamples, seed)
    ]
    value = np.array([compute(curve[:, None]) for curve in table.T])
    low, high = ends(np.concatenate(again), confidence, table.shape[0])
    return Band(value=value, low=low, high=high, confidence=confidence, seeds=table.shape[0])


def performance_profile(
    scores: ArrayLike,
    thresholds: ArrayLike,
    confidence: float = 0.95,
    *,
    resamples: int = 10_000,
    seed: Seed = 0,
) -> Band:
    """Fraction of runs that score more than each threshold (Agarwal et al. 2021, section 4.1).

    Args:
        scores: (runs, tasks), or (runs,) for one task.
        thresholds: (K,).
        confidence: In (0, 1), of each threshold on its own.
        resamples: How often the runs are drawn again, within each task.
        seed: Seed of the draws.

    Raises:
        SettingsError: As in `interval`; or if thresholds are not finite, or not (K,).

    Example:
        >>> performance_profile([0.2, 0.4, 0.9, 1.0], [0.0, 0.4, 1.0]).value.tolist()
        [1.0, 0.5, 0.0]
    """
    table, steps = as_scores(scores), numbers(thresholds, "thresholds")
    check_confidence(confidence)
    if steps.ndim != 1:
        raise SettingsError(f"thresholds of shape {steps.shape}", "(K,)", "Give a list.")
    columns = np.arange(table.shape[1])
    picked = (table[chosen, columns] for chosen in _draws(table, resamples, seed))
    again = np.concatenate([_above(each, steps) for each in picked])
    low, high = ends(again, confidence, table.shape[0], 0.0, 1.0)
    return Band(value=_above(table, steps), low=low, high=high, confidence=confidence,
                seeds=table.shape[0])  # fmt: skip


def ends(
    again: np.ndarray, confidence: float, seeds: int, least: float = -np.inf, most: float = np.inf
) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the middle `confidence` of resampled values, (resamples, ...) -> two of (...).

    Args:
        again: The statistic of each resample.
        confidence: In (0, 1).
        seeds: Runs behind it; with one, the ends are all that is possible.
        least: The least value that is possible.
        most: The greatest value that is possible.
    """
    if seeds == 1:
        shape = again.shape[1:]
        return np.full(shape, least), np.full(shape, most)
    tail = (1 - confidence) / 2
    low, high = np.quantile(again, [tail, 1 - tail], axis=0)
    return low, high


def _above(scores: np.ndarray, thresholds: np.ndarray) -> np.ndarray:
    """Fraction of scores above each threshold; (..., runs, tasks) -> (..., K)."""
    return np.stack([(scores > tau).mean(axis=(-2, -1)) for tau in thresholds], axis=-1)


def _draws(table: np.ndarray, resamples: int, seed: Seed) -> Iterator[np.ndarray]:
    """Which runs each resample holds, some at a time: (some, runs, tasks)."""
    check_count(resamples, "resamples")
    rng, rows = generator(seed), max(1, _CHUNK // table.size)
    for done in range(0, resamples, rows):
        size = min(rows, resamples - done)
        yield rng.integers(table.shape[0], size=(size, *table.shape))
