"""Checks of notebook 02: where the cliff is, how rare a reward is, and what zeros teach."""

from typing import Any

import numpy as np

from revolver_lab.exercises.recognising import over, recognise, values
from revolver_lab.exercises.verdict import Verdict, judge

TEXTS = {
    "one": "Where is the cliff? Write a function of two arrays, the alphas (rising, from 0) and "
    "the expert's return on each, that gives the first alpha at which the return is below half of "
    "what it is on the source.",
    "two": "An episode on the target meets a reward with probability p, each on its own. Write a "
    "function of p and n: the chance that n episodes meet at least one reward.",
    "three": "Every reward is 0, so the critic is fitted to the targets gamma Q, over and over. "
    "The expert's critic began with the value q (we leave out the entropy, and nothing ends). "
    "Write a function of q, gamma and k: the value after k such fits.",
}
"""What each exercise asks."""

ALPHAS = np.linspace(0, 1, 11)
CURVES = (
    np.array([156, 153, 58, 9, 9, 7, 4, 8, 4, 0, 0.0]),
    np.array([60, 90, 100, 65, 60, 45, 40, 35, 20, 10, 5.0]),
    np.array([100, 98, 97, 49, 80, 75, 70, 30, 20, 10, 0.0]),
)
"""Returns of an expert over alpha: one that falls at once, one that improves first, one that
recovers for a while."""

_CHANCES = ((0.01, 100), (0.002, 360), (0.5, 2), (0.0, 50), (1.0, 3))
_FITS = ((150.0, 0.99, 100), (80.0, 0.9, 3), (20.0, 0.5, 0))


def one(answer: Any) -> Verdict:
    """Exercise 1: the first alpha below half of the source's return.

    Args:
        answer: Function of alphas and returns, both (n,), that gives one alpha.
    """
    return judge(
        answer,
        _cliff_mistake,
        "Halves are a convention, the cliff is not: within a tenth or two of alpha nearly all is "
        "lost. A step of evolution has to be shorter than that.",
    )


def _first(below: np.ndarray) -> float:
    """The first alpha at which a condition holds, or 1."""
    return float(ALPHAS[np.argmax(below)]) if below.any() else 1.0


def _cliff_mistake(answer: Any) -> None:
    """Another threshold, another end, or another thing than an alpha."""
    cases = [(ALPHAS.copy(), curve.copy()) for curve in CURVES]
    found = values(answer, cases, "The alpha of the cliff")

    def each(formula: Any) -> np.ndarray:
        return np.array([formula(curve) for curve in CURVES])

    known = [
        (each(lambda r: np.argmax(r < r[0] / 2)), "That is the place in the array, counted from "
         "0. Which alpha stands there?"),
        (each(lambda r: _first(r < r.max() / 2)), "You halved the best return on the way. The "
         "second expert is better at alpha = 0.2 than at home; the measure is its return on the "
         "source, `returns[0]`."),
        (each(lambda r: _first(r < CURVES[0][0] / 2)), "Your threshold is a number that fits the "
         "first curve. Other experts start elsewhere: halve `returns[0]`."),
        (each(lambda r: ALPHAS[np.flatnonzero(r >= r[0] / 2)[-1]]), "That is the last alpha at "
         "which the expert is still good, not the first at which it is not."),
        (each(lambda r: ALPHAS[np.argmax(r < r[0] / 2) - 1]), "That is the last alpha before the "
         "cliff; asked for is the first beyond it."),
        (each(lambda r: ALPHAS[np.flatnonzero(r >= r[0] / 2)[-1] + 1]), "The third expert falls "
         "below half, recovers, and falls again. Asked for is the first fall."),
        (each(lambda r: ALPHAS[np.flatnonzero(r < r[0] / 2)[-1]]), "That is the last alpha below "
         "half. If you go through them in a loop, stop at the first one that you find."),
        (each(lambda r: ALPHAS[np.argmin(np.diff(r)) + 1]), "That is where the return drops most "
         "from one alpha to the next. Near, but asked for is where it is below half."),
        (each(lambda r: r[np.argmax(r < r[0] / 2)]), "That is the return there. At which alpha?"),
        (each(lambda r: _first(r > r[0] / 2)), "That is the first alpha where the return is ABOVE "
         "half; turn the comparison round."),
    ]  # fmt: skip
    recognise(found, each(lambda r: _first(r < r[0] / 2)), known,
              f"For the returns {CURVES[0].astype(int).tolist()} you say {found[0]:g}. Halve the "
              "first return, find where the others are below it, take the first.")  # fmt: skip


def two(answer: Any) -> Verdict:
    """Exercise 2: the chance of at least one reward in n episodes.

    Args:
        answer: Function of p and n.
    """
    return judge(
        answer,
        _chance_mistake,
        "With p = 1/500, 360 episodes, the whole budget of the course, stay without a single "
        "reward about every second time; with p = 0 no budget helps.",
    )


def _at_least_one(p: float, n: int) -> float:
    """The chance of a reward or more in n episodes."""
    return 1 - (1 - p) ** n


def _chance_mistake(answer: Any) -> None:
    """Probabilities that are added, multiplied the wrong way, or of another event."""
    known = [
        (over(_CHANCES, lambda p, n: n * p), "Chances do not add up: n p is the expected number of "
         "rewards, and it grows past 1. Of p = 1/2 and two episodes, a quarter has none."),
        (over(_CHANCES, lambda p, n: min(1.0, n * p)), "n p cut at 1 is no chance: p = 1/100 and "
         "100 episodes are far from certain. Ask first how likely it is that there is NO reward."),
        (over(_CHANCES, lambda p, n: p**n), "That is the chance that EVERY episode meets one."),
        (over(_CHANCES, lambda p, n: (1 - p) ** n), "That is the chance of no reward at all. One "
         "step is left."),
        (over(_CHANCES, lambda p, n: 1 - p**n), "That is the chance that not all of them meet one. "
         "The opposite of `at least one` is `none`."),
        (over(_CHANCES, lambda p, n: n * p * (1 - p) ** (n - 1)), "That is exactly one reward; two "
         "and more would do as well."),
        (over(_CHANCES, lambda p, n: p), "That is one episode's chance. More of them see more."),
    ]  # fmt: skip
    found, right = values(answer, _CHANCES, "The chance"), over(_CHANCES, _at_least_one)
    known.append((100 * right, "As a fraction, not in percent."))
    recognise(found, right, known,
              f"For p = 0.5 and n = 2 you say {found[2]:.4g}. List the four cases, and count those "
              "with a reward in them.")  # fmt: skip


def three(answer: Any) -> Verdict:
    """Exercise 3: what is left of a value after k fits to rewards of zero.

    Args:
        answer: Function of q, gamma and k.
    """
    return judge(
        answer,
        _forgetting_mistake,
        "Zeros are not harmless: they unlearn the expert. After 100 fits at gamma = 0.99 a good "
        "third is left, of the differences between actions too, and those were all that the actor "
        "followed.",
    )


def _forgetting_mistake(answer: Any) -> None:
    """A value that stays, falls once, falls along a line, or is confused with a return."""
    known = [
        (over(_FITS, lambda q, g, k: q), "The value does not stay: with r = 0 the target of each "
         "fit is gamma Q, which is less than Q."),
        (over(_FITS, lambda q, g, k: g * q), "That is one fit. The next one starts from there."),
        (over(_FITS, lambda q, g, k: k * g * q), "Fits do not add up: each multiplies what the "
         "one before has left."),
        (over(_FITS, lambda q, g, k: q * (1 - g**k)), "That is what was lost. What is left?"),
        (over(_FITS, lambda q, g, k: q * (1 - k * (1 - g))), "You took (1 - gamma) q away each "
         "time: a straight line, which ends below zero. Each fit takes its share of what is left."),
        (over(_FITS, lambda q, g, k: q * (1 - g**k) / (1 - g)), "That is the return of k rewards q."
         " Here every reward is 0, and q is a value."),
        (over(_FITS, lambda q, g, k: 0.0), "It ends at 0, but it takes its time: after one fit the "
         "value is gamma q."),
        (over(_FITS, lambda q, g, k: q * g ** (k + 1)), "One fit too many: after k = 0 fits the "
         "value is still q."),
        (over(_FITS, lambda q, g, k: q * (1 - g) ** k), "gamma is what a fit leaves; 1 - gamma is "
         "what it takes away."),
    ]  # fmt: skip
    found = values(answer, _FITS, "The value")
    recognise(found, over(_FITS, lambda q, g, k: q * g**k), known,
              f"For q = 80, gamma = 0.9 and k = 3 you say {found[1]:.4g}. Write down the value "
              "after one fit, then after two.")  # fmt: skip
