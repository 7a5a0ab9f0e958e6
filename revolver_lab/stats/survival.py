"""How long runs take to get there when some never do: Kaplan-Meier and the restricted mean."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from revolver_lab.errors import SettingsError
from revolver_lab.given import require
from revolver_lab.stats.checks import check_confidence, number, numbers

_ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Survival:
    """A Kaplan-Meier curve: the fraction of runs that have not got there yet.

    It is 1 before the first of `times` (where there is no interval) and steps down at each.

    Attributes:
        times: The times at which runs got there, sorted, each once, (K,).
        survival: S just after each, (K,).
        low: Lower ends of S, (K,).
        high: Upper ends of S, (K,).
        at_risk: Runs still watched and not there just before each, (K,).
        events: Runs that got there at each, (K,).
        censored: Until when each run that did not get there was watched, sorted.
        longest: The last time at which any run was watched.
        confidence: How often the interval at one time is meant to cover S there.
        seeds: Runs in all.
    """

    times: np.ndarray = field(repr=False)
    survival: np.ndarray = field(repr=False)
    low: np.ndarray = field(repr=False)
    high: np.ndarray = field(repr=False)
    at_risk: np.ndarray = field(repr=False)
    events: np.ndarray = field(repr=False)
    censored: np.ndarray = field(repr=False)
    longest: float
    confidence: float
    seeds: int

    @property
    def median(self) -> float:
        """The first time by which half of the runs are there; infinity if that was not seen."""
        there = self.survival <= 0.5 + _ROUNDING
        return float(self.times[there][0]) if there.any() else float("inf")

    @property
    def left(self) -> float:
        """S at the end: the fraction that was never seen to get there."""
        return float(self.survival[-1]) if self.survival.size else 1.0

    def at(self, time: ArrayLike) -> np.ndarray:
        """S at any times; NaN after the last run was watched, unless all were there by then.

        Args:
            time: Times, of any shape.
        """
        when = numbers(time, "time")
        found = np.append(1.0, self.survival)[np.searchsorted(self.times, when, side="right")]
        return np.where((when > self.longest) & (self.left > 0), np.nan, found)


@dataclass(frozen=True, kw_only=True)
class RestrictedMean:
    """Mean time to get there, where no run counts for longer than `until`.

    Attributes:
        value: The area below S from 0 to `until`.
        low: Lower end of the normal interval, 0 or more.
        high: Upper end, `until` or less.
        standard_error: Of the value; infinite for one seed.
        until: Where time is cut.
        confidence: How often such intervals are meant to cover the truth.
        seeds: Runs in all.
    """

    value: float
    low: float
    high: float
    standard_error: float
    until: float
    confidence: float
    seeds: int


def kaplan_meier(times: ArrayLike, observed: ArrayLike, confidence: float = 0.95) -> Survival:
    """The survival curve of times of which some are censored (Kaplan and Meier 1958).

    S(t) is the product over times t_i <= t of 1 - d_i / n_i, with d_i runs getting there of n_i
    at risk; a run censored at t_i is still at risk there. The interval is symmetric in
    log(-log S), with Greenwood's variance sum d_i / (n_i (n_i - d_i)), and so stays in [0, 1].
    Where S is 0 that has no value: the interval is from 0 to the upper end before it, which
    holds since S never rises.

    Args:
        times: When each run got there, or until when it was watched, (S,), 0 or more.
        observed: Whether it got there, (S,).
        confidence: In (0, 1).

    Raises:
        SettingsError: If something is empty or not finite, or the shapes do not match.

    Example:
        >>> curve = kaplan_meier([10, 20, 20, 30], [True, True, False, False])
        >>> curve.times.tolist(), curve.survival.tolist(), curve.median
        ([10.0, 20.0], [0.75, 0.5], 20.0)
    """
    when, seen = _checked(times, observed)
    check_confidence(confidence)
    at, events = np.unique(when[seen], return_counts=True)
    at_risk = (when[:, None] >= at).sum(axis=0)
    survival = np.cumprod((at_risk - events) / at_risk)
    low, high = _log_log(survival, np.cumsum(_greenwood(events, at_risk)), confidence)
    return Survival(times=at, survival=survival, low=low, high=high, at_risk=at_risk,
                    events=events, censored=np.sort(when[~seen]), longest=float(when.max()),
                    confidence=confidence, seeds=len(when))  # fmt: skip


def restricted_mean(curve: Survival, until: float) -> RestrictedMean:
    """Mean time to get there, cut at `until`: the area below the survival curve.

    Its variance is the sum of A_i^2 d_i / (n_i (n_i - d_i)), with A_i the area from t_i to
    `until` (Klein and Moeschberger 2003, section 4.5). Compare methods at the same `until`.
    A 95 % interval was measured to cover the truth in 85 % of cases with 5 seeds, 90 % with 10,
    93 % with 20. One seed leaves everything from 0 to `until` open. Runs that all take the same
    time give an interval without width: no spread was seen.

    Args:
        curve: What `kaplan_meier` returns.
        until: Where time is cut; no run may be censored for good before it.

    Raises:
        SettingsError: If it is not positive, or beyond what was watched.
    """
    require("curve", curve, Survival, "Pass what kaplan_meier returns.")
    cut = number(until, "until")
    if cut <= 0 or (cut > curve.longest and curve.left > 0):
        raise SettingsError(f"until = {cut:g}", f"a time in (0, {curve.longest:g}]",
                            "What happens after the last evaluation is not known.")  # fmt: skip
    kept = curve.times < cut
    edges = np.concatenate([[0.0], curve.times[kept], [cut]])
    areas = np.diff(edges) * np.append(1.0, curve.survival[kept])
    after = np.cumsum(areas[:0:-1])[::-1]
    terms = _greenwood(curve.events[kept], curve.at_risk[kept])
    # where all are there no area is left, and infinity times 0 is meant to be 0
    variance = np.sum(after**2 * np.where(np.isfinite(terms), terms, 0.0))
    error = float(np.sqrt(variance)) if curve.seeds > 1 else float("inf")
    value, reach = float(areas.sum()), float(ndtri((1 + curve.confidence) / 2)) * error
    return RestrictedMean(value=value, low=max(value - reach, 0.0), high=min(value + reach, cut),
                          standard_error=error, until=cut, confidence=curve.confidence,
                          seeds=curve.seeds)  # fmt: skip


def _checked(times: ArrayLike, observed: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Times, and whether each was observed, as arrays of one shape."""
    when, seen = numbers(times, "times"), numbers(observed, "observed")
    if when.ndim != 1 or when.shape != seen.shape:
        raise SettingsError(f"times of shape {when.shape} and observed of shape {seen.shape}",
                            "(S,) and (S,)", "Give one of each for every seed.")  # fmt: skip
    if (when < 0).any() or not np.isin(seen, (0, 1)).all():
        raise SettingsError(f"times from {when.min():g} and observed up to {seen.max():g}",
                            "times of 0 or more, observed true or false",
                            "See time_to_threshold.")  # fmt: skip
    return when, seen.astype(bool)


def _greenwood(events: np.ndarray, at_risk: np.ndarray) -> np.ndarray:
    """d / (n (n - d)) at each time; infinite where all that are left get there."""
    left = at_risk * (at_risk - events)
    return np.divide(events, left, out=np.full(len(events), np.inf), where=left > 0)


def _log_log(
    survival: np.ndarray, variance: np.ndarray, confidence: float
) -> tuple[np.ndarray, np.ndarray]:
    """Ends S^exp(+-z sigma / |log S|); where S is 0, from 0 to the end before."""
    low, high = np.zeros(len(survival)), np.ones(len(survival))
    some = survival > 0
    reach = ndtri((1 + confidence) / 2) * np.sqrt(variance[some]) / -np.log(survival[some])
    low[some], high[some] = survival[some] ** np.exp(reach), survival[some] ** np.exp(-reach)
    return low, np.where(some, high, high[some][-1] if some.any() else 1.0)
