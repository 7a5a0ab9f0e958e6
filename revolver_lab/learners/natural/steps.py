"""The natural step: conjugate gradients, and the length at which the KL is what was asked."""

from collections.abc import Callable

import numpy as np

Product = Callable[[np.ndarray], np.ndarray]
"""Multiplies a vector by a symmetric matrix that is never written out."""


def conjugate_gradient(
    product: Product, b: np.ndarray, iterations: int, tolerance: float = 1e-10
) -> np.ndarray:
    """Solves A x = b for a symmetric positive A (Hestenes and Stiefel 1952).

    Args:
        product: x -> A x.
        b: Right-hand side, (D,).
        iterations: At most; D of them are exact, up to rounding.
        tolerance: Ends at |A x - b|^2 below this fraction of |b|^2.

    Returns:
        x, (D,).

    Example:
        >>> conjugate_gradient(lambda x: 2 * x, np.array([2.0, 4.0]), 3)
        array([1., 2.])
    """
    x, residual = np.zeros_like(b), b.copy()
    direction, squared = residual.copy(), float(b @ b)
    least = tolerance * squared
    for _ in range(iterations):
        if squared <= least:
            break
        along = product(direction)
        length = squared / float(direction @ along)
        x += length * direction
        residual -= length * along
        before, squared = squared, float(residual @ residual)
        direction = residual + (squared / before) * direction
    return x


def natural_step(gradient: np.ndarray, direction: np.ndarray, step_size: float) -> np.ndarray:
    """Returns the normalised natural step, sqrt(step_size / g^T x) x with x = F^-1 g.

    To second order the KL divergence of a step d is d^T F d / 2, here step_size / 2. This is the
    convention of Rajeswaran et al. (2018), whose step is 0.05.

    Args:
        gradient: g, (D,).
        direction: x, (D,).
        step_size: Twice the KL divergence that is asked for.

    Returns:
        The step, (D,); zeros where there is no way up.

    Example:
        >>> natural_step(np.array([3.0, 4.0]), np.array([3.0, 4.0]), 1.0)
        array([0.6, 0.8])
    """
    slope = float(gradient @ direction)
    if not (np.isfinite(slope) and slope > 0):
        return np.zeros_like(gradient)
    return np.sqrt(step_size / slope) * direction
