"""Theorem 1 of the paper, checked: which robot of the window a shaped objective is best for."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.optimize import minimize_scalar, root_scalar

from revolver_lab import shaping
from revolver_lab.errors import SettingsError

PAPER_COEFFICIENT = 1 / 4
"""What the paper's Theorem 1 says of h xi^2; `coefficient` says what follows."""
_SUBNORMAL = 1e-300  # below it floats lose their digits, and nothing is lost by taking 0


def _require(holds: bool, given: str, allowed: str, remedy: str) -> None:
    """Raises SettingsError unless the condition holds."""
    if not holds:
        raise SettingsError(given, allowed, remedy)


def _check(h: ArrayLike, xi: ArrayLike, power: float = 1.0, q: float = 0.5) -> None:
    """Refuses windows and regrets that the theorem is not about."""
    _require(bool(np.isfinite(h).all()), f"h = {h}", "finite numbers", "The paper uses 1.")
    _require(bool((np.isfinite(xi) & (np.asarray(xi) >= 0)).all()), f"xi = {xi}",
             "finite numbers of 0 and more", "The published code has 0.1.")  # fmt: skip
    _require(math.isfinite(power) and power >= 1, f"power = {power}", "a number of 1 and more",
             "1 is the V of the proof, 2 a parabola; less is not convex.")  # fmt: skip
    _require(0 < q < 1, f"q = {q}", "a number between 0 and 1",
             "q = D+ / (D+ + D-), the share of the slope towards more evolved robots.")  # fmt: skip


def regret(
    phi: float, h: float, xi: float, alpha: float = 0.0, power: float = 1.0, q: float = 0.5
) -> float:
    """Returns what the policy that is best on E(phi) loses over the window, weighted and averaged.

    On E(beta) that policy loses D- |beta - phi|^p where beta < phi, and D+ |beta - phi|^p
    elsewhere; D- = 1 - q and D+ = q, in units of (D- + D+) xi^p. The weights are exp(h beta)
    over their mean. The paper's objective is a constant minus a multiple of this.

    Args:
        phi: Which robot the policy is best for, in [alpha, alpha + xi].
        h: The shaping factor.
        xi: Width of the window, more than 0.
        alpha: Where the window begins.
        power: p; 1 is the V of the paper's proof, 2 a smooth optimum.
        q: D+ / (D+ + D-); one half is the paper's symmetric regret.
    """
    _check(h, xi, power, q)
    _require(xi > 0, f"xi = {xi}", "more than 0", "A window of one robot has one best policy.")
    place, y = (phi - alpha) / xi, h * xi

    def weighted(u: float) -> float:
        weight = float(shaping.weight(u, 0.0, 1.0, y, "normalised"))
        return weight * (q if u > place else 1 - q) * abs(u - place) ** power

    return sum(quad(weighted, *ends)[0] for ends in ((0, place), (place, 1)))


def best_phi(h: float, xi: float, alpha: float = 0.0, power: float = 1.0, q: float = 0.5) -> float:
    """Returns the phi of least `regret`, found by search: no formula of the theorem is used.

    Args:
        h: The shaping factor.
        xi: Width of the window.
        alpha: Where it begins.
        power: p of the regret |beta - phi|^p.
        q: D+ / (D+ + D-).

    Example:
        >>> best_phi(h=1.0, xi=0.1) - best_phi(h=0.0, xi=0.1)  # 1/8 h xi^2, not 1/4
        0.00124...
    """
    _check(h, xi, power, q)
    if xi == 0:
        return alpha
    found = minimize_scalar(
        lambda u: regret(alpha + u * xi, h, xi, alpha, power, q),
        bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-9},
    )  # fmt: skip
    return alpha + xi * float(found.x)  # pyright: ignore[reportAttributeAccessIssue]


def phi_v(h: ArrayLike, xi: ArrayLike, alpha: ArrayLike = 0.0, q: float = 0.5) -> np.ndarray:
    """Returns phi under a V-shaped regret: the weighted median of beta, or its q-quantile.

        phi = alpha + ln(1 + q (e^{h xi} - 1)) / h
            = alpha + q xi + q (1 - q) h xi^2 / 2 + ...
            = alpha + xi/2 + h xi^2 / 8 - h^3 xi^4 / 192 + ...      for q = 1/2

    Setting the derivative over phi to zero gives D- (weight below phi) = D+ (weight above phi).

    Args:
        h: The shaping factor.
        xi: Width of the window.
        alpha: Where it begins.
        q: D+ / (D+ + D-).

    Example:
        >>> float(phi_v(h=1.0, xi=0.1)) < 0.05 + 0.002  # less than one published step l_k
        True
    """
    _check(h, xi, q=q)
    y = np.asarray(h, dtype=float) * xi
    # Seen from the end of the window, h and q are mirrored: only exp(-|y|) is ever needed.
    share, none = np.where(y > 0, 1 - q, q), np.abs(y) < _SUBNORMAL
    size = np.where(none, 1.0, np.abs(y))
    place = np.where(none, share, -np.log1p(share * np.expm1(-size)) / size)
    return np.asarray(alpha) + np.asarray(xi) * np.where(y > 0, 1 - place, place)


def phi_quadratic(h: ArrayLike, xi: ArrayLike, alpha: ArrayLike = 0.0) -> np.ndarray:
    """Returns phi under a quadratic regret: the weighted mean of beta.

        phi = alpha + xi / (1 - e^{-h xi}) - 1/h
            = alpha + xi/2 + h xi^2 / 12 - h^3 xi^4 / 720 + ...

    Args:
        h: The shaping factor.
        xi: Width of the window.
        alpha: Where it begins.

    Example:
        >>> float(phi_quadratic(h=0.0, xi=0.1, alpha=0.4))
        0.45
    """
    _check(h, xi)
    y = np.asarray(h, dtype=float) * xi
    safe = np.where(np.abs(y) < 0.03, 1.0, y)
    # Near y = 0 the closed form is a difference of two large numbers; the series is exact there.
    place = np.where(np.abs(y) < 0.03, 1 / 2 + y / 12 - y**3 / 720 + y**5 / 30240,
                     1 / 2 + 1 / (2 * np.tanh(safe / 2)) - 1 / safe)  # fmt: skip
    return np.asarray(alpha + np.asarray(xi) * place)


def phi_paper(h: ArrayLike, xi: ArrayLike, alpha: ArrayLike = 0.0) -> np.ndarray:
    """Returns phi where the paper's own condition holds, before it is expanded.

    The proof integrates a derivative over beta, the integration variable. What is left of such an
    integral are its two ends: e^{h alpha} (phi - alpha) = e^{h (alpha + xi)} (alpha + xi - phi),

        phi = alpha + xi / (1 + e^{-h xi}) = alpha + xi/2 + h xi^2 / 4 + ...

    which balances the weighted regret of the first robot with that of the last, and minimises
    nothing: see `best_phi`.

    Args:
        h: The shaping factor.
        xi: Width of the window.
        alpha: Where it begins.
    """
    _check(h, xi)
    y = np.asarray(h, dtype=float) * xi
    return np.asarray(alpha) + np.asarray(xi) * (1 + np.tanh(y / 2)) / 2


def coefficient(power: float = 1.0) -> float:
    """Returns c of phi = alpha + xi/2 + c h xi^2 + ... under |beta - phi|^p: 1 / (4 (p + 1)).

    To first order in h the derivative over phi of the regret is balanced where
    c = (mean of |v|^p) / ((p - 1) (mean of |v|^(p-2))), v uniform on [-1/2, 1/2].

    Args:
        power: p; 1 gives 1/8, 2 gives 1/12, and none of 1 and more gives the paper's 1/4.

    Example:
        >>> [1 / coefficient(power) for power in (1, 2)], 1 / PAPER_COEFFICIENT
        ([8.0, 12.0], 4.0)
    """
    _check(0.0, 0.0, power)
    return 1 / (4 * (power + 1))


def coefficient_v(q: float = 0.5) -> float:
    """Returns c of phi = alpha + q xi + c h xi^2 + ... under a V with two slopes: q (1 - q) / 2.

    Args:
        q: D+ / (D+ + D-); 1/8 at one half, and less on either side.
    """
    _check(0.0, 0.0, q=q)
    return q * (1 - q) / 2


_CLOSED: dict[float, Callable[..., np.ndarray]] = {1: phi_v, 2: phi_quadratic}


def shift(h: float, xi: float, power: float = 1.0) -> float:
    """Returns how far h moves the optimum, phi(h) - phi(0), in units of alpha.

    Args:
        h: The shaping factor.
        xi: Width of the window.
        power: p of the regret; 1 and 2 in closed form, others by search.

    Example:
        >>> round(shift(h=1.0, xi=0.1) / 0.002, 3)  # in published steps l_k
        0.625
    """
    _check(h, xi, power)
    find = _CLOSED.get(power)
    phi = best_phi(h, xi, power=power) if find is None else float(find(h, xi))
    return phi - xi / 2


def h_for_shift(distance: float, xi: float, power: float = 1.0) -> float:
    """Returns the h that moves the optimum by a distance, such as one step l_k.

    Args:
        distance: In units of alpha; no h moves it by xi/2, to the end of the window.
        xi: Width of the window.
        power: p of the regret, 1 or 2.

    Example:
        >>> round(h_for_shift(0.002, xi=0.1), 2)
        1.6
    """
    _check(distance, xi, power)
    _require(power in _CLOSED, f"power = {power}", "1 or 2", "The others have no closed form.")
    _require(abs(distance) < 0.499 * xi, f"distance = {distance} with xi = {xi}",
             "less than 0.499 xi", "Widen xi: the optimum stays in the window.")  # fmt: skip
    end = 1e4 / xi
    found = root_scalar(lambda h: shift(h, xi, power) - distance, bracket=(-end, end))
    return float(found.root)
