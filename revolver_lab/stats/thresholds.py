"""When a run first reached a threshold, and whether it did: the input of a survival curve."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError
from revolver_lab.stats.checks import number, numbers


class Times(NamedTuple):
    """One time for each run.

    Attributes:
        times: When it got there, or until when it was watched, (S,).
        observed: Whether it got there, (S,) bool; otherwise it is censored.
    """

    times: np.ndarray
    observed: np.ndarray


def time_to_threshold(steps: ArrayLike, returns: ArrayLike, threshold: float) -> Times:
    """When each run's evaluations first return the threshold or more.

    A run that never does is censored at its last evaluation, never dropped. The true time lies
    between the evaluation before and this one, so time has the grain of the evaluations; a run
    may fall below the threshold later.

    Args:
        steps: When the evaluations were, (K,), increasing.
        returns: Evaluation curves, (S, K), or (K,) for one run.
        threshold: What is to be reached.

    Raises:
        SettingsError: If something is empty or not finite, or the shapes do not match.

    Example:
        >>> time_to_threshold([10, 20, 30], [[1, 5, 6], [0, 1, 2]], threshold=5)
        Times(times=array([20., 30.]), observed=array([ True, False]))
    """
    at, curves = numbers(steps, "steps"), np.atleast_2d(numbers(returns, "returns"))
    if at.ndim != 1 or (np.diff(at) <= 0).any() or at[0] < 0:
        raise SettingsError(f"steps of shape {at.shape} from {at.flat[0]:g} to {at.flat[-1]:g}",
                            "(K,), 0 or more and increasing", "Sort the evaluations.")  # fmt: skip
    if curves.shape != (len(curves), len(at)):
        raise SettingsError(f"returns of shape {curves.shape} for {len(at)} evaluations",
                            f"(S, {len(at)}) or ({len(at)},)",
                            "Give a row for each seed.")  # fmt: skip
    reached = curves >= number(threshold, "threshold")
    observed = np.asarray(reached.any(axis=1))
    return Times(np.where(observed, at[reached.argmax(axis=1)], at[-1]), observed)
