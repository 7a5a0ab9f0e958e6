"""Evolution reward shaping: what a reward earned on E(beta) is multiplied with in training."""

import difflib

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError, UnknownNameError

FORMS = ("absolute", "relative", "normalised")
"""exp(h beta) as in the paper, exp(h (beta - alpha)), and the latter over its mean in the phase."""


def weight(beta: ArrayLike, alpha: ArrayLike, xi: ArrayLike, h: ArrayLike, form: str) -> np.ndarray:
    """Returns the factor of the rewards of E(beta) in the phase at alpha (equation 5).

    Within a phase the three forms are multiples of each other, so they prefer the same robots
    (Theorem 1); they differ in the size of the reward. "absolute" makes it grow with alpha,
    "relative" is 1 at beta = alpha, and "normalised" has the mean 1 over
    beta ~ U(alpha, min(alpha + xi, 1)), as without shaping:

        y exp(h (beta - alpha)) / (exp(y) - 1)   with y = h (min(alpha + xi, 1) - alpha)

    Every form is exactly 1 where h = 0. The arrays broadcast against each other.

    Args:
        beta: Whose rewards they are; below alpha too, where a replay keeps older robots.
        alpha: Of the phase, in [0, 1].
        xi: Width of the window that beta is drawn from, 0 or more.
        h: The shaping factor.
        form: One of `FORMS`.

    Raises:
        UnknownNameError: If there is no such form.

    Example:
        >>> weight([0.2, 0.3], alpha=0.2, xi=0.1, h=1.0, form="normalised").round(4)
        array([0.9508, 1.0508])
    """
    beta, alpha, h = np.asarray(beta), np.asarray(alpha), np.asarray(h)
    if form == "absolute":
        # The other arguments take part in the shape alone, so that all forms return the same.
        return np.exp(h * (beta + np.zeros(np.broadcast_shapes(alpha.shape, np.shape(xi)))))
    if form == "relative":
        return np.exp(h * (beta - alpha + np.zeros(np.shape(xi))))
    if form == "normalised":
        width = np.minimum(alpha + np.asarray(xi), 1.0) - alpha
        return np.exp(h * (beta - alpha) - _log_mean(h * width))
    near = difflib.get_close_matches(str(form), FORMS, n=1, cutoff=0.4)
    remedy = f"Did you mean {near[0]!r}?" if near else "The paper's is 'absolute'."
    raise UnknownNameError(f"shaping form {form!r}", ", ".join(FORMS), remedy)


def mean_weight(alpha: ArrayLike, xi: ArrayLike, h: ArrayLike, form: str) -> np.ndarray:
    """Returns the mean of `weight` over the phase: by how much all rewards are rescaled.

    Args:
        alpha: Of the phase.
        xi: Width of the window.
        h: The shaping factor.
        form: One of `FORMS`.

    Example:
        >>> alphas = np.array([0.0, 0.5, 1.0])  # the paper's form pays more and more
        >>> mean_weight(alphas, xi=0.1, h=1.0, form="absolute").round(2)
        array([1.05, 1.73, 2.72])
    """
    normalised = weight(alpha, alpha, xi, h, "normalised")
    return weight(alpha, alpha, xi, h, form) / normalised


def effective_ent_coef(ent_coef: float, factor: ArrayLike) -> np.ndarray:
    """Returns SAC's temperature as it acts when every reward is multiplied by one factor w.

    SAC maximises the sum of w r + ent_coef H. Divided by w, which moves no optimum, that is the
    sum of r + (ent_coef / w) H: a larger reward explores less.

    Args:
        ent_coef: SAC's temperature, fixed.
        factor: w, more than 0, such as a `mean_weight`.

    Raises:
        SettingsError: If a factor is not positive.

    Example:
        >>> float(effective_ent_coef(0.2, np.exp(1.0)).round(3))  # h = 1, at alpha = 1
        0.074
    """
    if not (np.asarray(factor) > 0).all():
        raise SettingsError(f"factor = {factor}", "more than 0", "Take it from mean_weight.")
    return np.asarray(ent_coef / np.asarray(factor))


def _log_mean(y: np.ndarray) -> np.ndarray:
    """Returns log((exp(y) - 1) / y), the log of the mean of exp over [0, y]; 0 at y = 0.

    Written with exp(-|y|), which neither overflows for large y nor cancels for small ones.
    """
    size = np.abs(y)
    safe = np.where(size == 0, 1.0, size)
    return np.maximum(y, 0.0) + np.where(size == 0, 0.0, np.log(-np.expm1(-safe) / safe))
