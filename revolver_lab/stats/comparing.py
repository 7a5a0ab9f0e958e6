"""Whether one method is better than another: how often it wins, and by how much on equal seeds."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError
from revolver_lab.given import is_whole
from revolver_lab.stats.bootstrap import Interval, ends, interval
from revolver_lab.stats.checks import Seed, as_scores, check_confidence, check_count, generator

_EXACT = 12
"""Up to so many pairs all 2^n signs are tried."""
_ROWS = 10_000
_ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True)
class Paired:
    """Two methods on the same seeds.

    Attributes:
        difference: Mean of x - y over seeds, with its bootstrap interval.
        p: Two-sided p-value of the sign-flip test of no difference.
        pairs: Seeds in common, n.
        exact: Whether all 2^n signs were tried, and not a sample of them.
    """

    difference: Interval
    p: float
    pairs: int
    exact: bool

    @property
    def smallest_p(self) -> float:
        """The smallest p that so many pairs can give: 2^(1-n); 0.0625 with five seeds."""
        return 2.0 ** (1 - self.pairs)


def probability_of_improvement(
    x: ArrayLike,
    y: ArrayLike,
    confidence: float = 0.95,
    *,
    resamples: int = 10_000,
    seed: Seed = 0,
) -> Interval:
    """How often a run of x beats a run of y: P(X > Y) + P(X = Y) / 2, averaged over tasks.

    It is the Mann-Whitney U over the number of pairs (Agarwal et al. 2021, section 4). Runs of x
    and of y are drawn again on their own, within each task. Where every run of x beats every run
    of y the interval has no width: no overlap was seen.

    Args:
        x: (runs, tasks), or (runs,) for one task.
        y: The other method, of as many tasks; its number of runs may differ.
        confidence: In (0, 1).
        resamples: How often the runs are drawn again.
        seed: Seed of the draws.

    Returns:
        The probability, whose `seeds` are those of the method with fewer; one alone leaves
        everything from 0 to 1 open.

    Raises:
        SettingsError: As in `interval`; or if the numbers of tasks differ.

    Example:
        >>> probability_of_improvement([1.0, 2.0, 3.0], [1.0, 0.0]).value
        0.9166666666666666
    """
    ours, theirs = as_scores(x, "x"), as_scores(y, "y")
    check_confidence(confidence)
    check_count(resamples, "resamples")
    if ours.shape[1] != theirs.shape[1]:
        raise SettingsError(f"x with {ours.shape[1]} tasks and y with {theirs.shape[1]}",
                            "the same tasks", "Compare on tasks that both have run.")  # fmt: skip
    rng, again, values = generator(seed), np.zeros(resamples), []
    for mine, other in zip(ours.T, theirs.T, strict=True):
        wins = (np.sign(mine[:, None] - other) + 1) / 2
        often = [_weights(len(group), resamples, rng) for group in (mine, other)]
        again += ((often[0] @ wins) * often[1]).sum(axis=1)
        values.append(wins.mean())
    seeds = min(len(ours), len(theirs))
    low, high = ends(again / ours.shape[1], confidence, seeds, 0.0, 1.0)
    return Interval(value=float(np.mean(values)), low=float(low), high=float(high),
                    confidence=confidence, seeds=seeds)  # fmt: skip


def _weights(runs: int, resamples: int, rng: np.random.Generator) -> np.ndarray:
    """Share of each run in each resample, (resamples, runs)."""
    return rng.multinomial(runs, np.full(runs, 1 / runs), size=resamples) / runs


def paired(
    x: ArrayLike | Mapping[int, float],
    y: ArrayLike | Mapping[int, float],
    confidence: float = 0.95,
    *,
    resamples: int = 10_000,
    seed: Seed = 0,
) -> Paired:
    """Compares two methods that ran on the same seeds, pair by pair.

    If the methods did not differ, the sign of each seed's x - y would be a coin flip. p is the
    fraction of all signs whose mean difference is at least as far from 0 as the one seen: all
    2^n of them for up to 12 pairs, otherwise (1 + hits) / (1 + resamples) of random ones (Phipson
    and Smyth 2010). Few pairs cannot give a small p: see `Paired.smallest_p`.

    Args:
        x: Seed -> score; or (runs,) or (runs, tasks) in the order of the seeds. Tasks of one
            seed are averaged and flip together.
        y: The other method, on the same seeds and tasks.
        confidence: In (0, 1), of the interval of the mean difference.
        resamples: How often seeds are drawn again, and signs where not all are tried.
        seed: Seed of the draws.

    Raises:
        SettingsError: If the seeds or the shapes differ, or as in `interval`.

    Example:
        >>> found = paired({0: 5.0, 1: 7.0, 2: 6.0}, {0: 4.0, 1: 5.0, 2: 3.0})
        >>> found.difference.value, found.p, found.pairs
        (2.0, 0.25, 3)
    """
    ours, theirs = _same_seeds(x, y)
    difference = (ours - theirs).mean(axis=1)
    pairs, rng = len(difference), generator(seed)
    found = interval(difference, "mean", confidence, resamples=resamples, seed=rng)
    exact = pairs <= _EXACT
    p = _all_signs(difference) if exact else _some_signs(difference, resamples, rng)
    return Paired(difference=found, p=p, pairs=pairs, exact=exact)


def _same_seeds(
    x: ArrayLike | Mapping[int, float], y: ArrayLike | Mapping[int, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Scores of both methods, (runs, tasks), seed beside seed."""
    if isinstance(x, Mapping) and isinstance(y, Mapping):
        if set(x) != set(y) or not all(is_whole(seed) for seed in x):
            raise SettingsError(f"seeds {[*x]} and {[*y]}", "the same seeds, whole numbers",
                                "Compare on seeds that both have run.")  # fmt: skip
        return _same_seeds([x[seed] for seed in sorted(x)], [y[seed] for seed in sorted(x)])
    if isinstance(x, Mapping) or isinstance(y, Mapping):
        raise SettingsError("seeds for one method only", "both as seed -> score, or both as arrays",
                            "Give both in the same way.")  # fmt: skip
    ours, theirs = as_scores(x, "x"), as_scores(y, "y")
    if ours.shape != theirs.shape:
        raise SettingsError(f"x of shape {ours.shape} and y of shape {theirs.shape}",
                            "the same seeds and tasks", "Without pairs, see "
                            "probability_of_improvement.")  # fmt: skip
    return ours, theirs


def _all_signs(difference: np.ndarray) -> float:
    """p over all signs; the first can stay, since a mean and its negative count alike."""
    others = np.array(list(product((1.0, -1.0), repeat=len(difference) - 1)))
    sums = difference[0] + others.reshape(len(others), -1) @ difference[1:]
    return float(_as_far(sums, difference).mean())


def _some_signs(difference: np.ndarray, resamples: int, rng: np.random.Generator) -> float:
    """p over random signs; those seen count as one of them, so that p is never 0."""
    hits = 0
    for done in range(0, resamples, _ROWS):
        signs = rng.choice((1.0, -1.0), size=(min(_ROWS, resamples - done), len(difference)))
        hits += int(_as_far(signs @ difference, difference).sum())
    return (1 + hits) / (1 + resamples)


def _as_far(sums: np.ndarray, difference: np.ndarray) -> np.ndarray:
    """Whether each sum is at least as far from 0 as the one seen, rounding aside."""
    slack = _ROUNDING * np.abs(difference).sum()
    return np.abs(sums) >= abs(difference.sum()) - slack
