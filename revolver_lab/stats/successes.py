"""Which fraction of seeds succeeds, with an interval that holds for few seeds too."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import betaincinv

from revolver_lab.errors import SettingsError
from revolver_lab.stats.bootstrap import Interval
from revolver_lab.stats.checks import check_confidence, numbers


def success(successes: ArrayLike, confidence: float = 0.95) -> Interval:
    """Fraction of runs that succeeded, with its Clopper-Pearson interval (1934).

    The interval holds every p under which so many successes, or more extreme ones, have a
    probability above (1 - confidence) / 2 on either side. It covers the truth at least as often
    as it says, whatever the truth and the number of seeds; Wilson's is narrower and falls short
    of 95 % where p is near 0 or 1, which is where ablations of few seeds end. It says something
    even where all succeed: 10 of 10 is 0.69 to 1, and 1 of 1 is 0.025 to 1.

    Args:
        successes: (runs,), true or false; one for each seed, not for each episode, since episodes
            of one policy are not independent runs.
        confidence: In (0, 1).

    Raises:
        SettingsError: If it is empty, of another shape, or holds more than true and false.

    Example:
        >>> found = success([True, True, True, True, False])
        >>> round(found.value, 3), round(found.low, 3), round(found.high, 3)
        (0.8, 0.284, 0.995)
    """
    given = numbers(successes, "successes")
    check_confidence(confidence)
    if given.ndim != 1 or not np.isin(given, (0, 1)).all():
        raise SettingsError(f"successes of shape {given.shape} from {given.min():g} to "
                            f"{given.max():g}", "(runs,) of true and false",
                            "Say first when a run counts as a success.")  # fmt: skip
    n, k, tail = given.size, int(given.sum()), (1 - confidence) / 2
    low = float(betaincinv(k, n - k + 1, tail)) if k > 0 else 0.0
    high = float(betaincinv(k + 1, n - k, 1 - tail)) if k < n else 1.0
    return Interval(value=k / n, low=low, high=high, confidence=confidence, seeds=n)
