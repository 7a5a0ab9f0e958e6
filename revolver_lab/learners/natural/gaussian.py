"""Diagonal Gaussians over actions: log-density, its derivatives, and the KL divergence."""

import numpy as np

_LOG_2PI = float(np.log(2 * np.pi))


def log_density(actions: np.ndarray, mean: np.ndarray, log_std: np.ndarray) -> np.ndarray:
    """Returns log N(a; mean, exp(log_std)^2), summed over the A components.

    Args:
        actions: a, (..., A), not clipped.
        mean: (..., A).
        log_std: (A,).

    Example:
        >>> log_density(np.zeros(2), np.zeros(2), np.zeros(2)).round(4)
        np.float64(-1.8379)
    """
    z = (actions - mean) * np.exp(-log_std)
    return -0.5 * (z * z + _LOG_2PI).sum(axis=-1) - log_std.sum()


def score(
    actions: np.ndarray, mean: np.ndarray, log_std: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the derivatives of `log_density` by mean and by log_std, (..., A) each.

    They are (a - mean) / std^2 and ((a - mean) / std)^2 - 1.
    """
    inverse = np.exp(-log_std)
    z = (actions - mean) * inverse
    return z * inverse, z * z - 1


def kl(
    mean: np.ndarray, log_std: np.ndarray, other_mean: np.ndarray, other_log_std: np.ndarray
) -> np.ndarray:
    """Returns KL(p || q) of p = N(mean, std^2) from q = N(other_mean, other_std^2), (...).

    The sum over components of log(other_std / std) + (std^2 + (mean - other_mean)^2) /
    (2 other_std^2) - 1/2.

    Example:
        >>> kl(np.zeros(3), np.zeros(3), np.ones(3), np.zeros(3))
        np.float64(1.5)
    """
    variance, other = np.exp(2 * log_std), np.exp(2 * other_log_std)
    apart = np.square(mean - other_mean)
    return (other_log_std - log_std + (variance + apart) / (2 * other) - 0.5).sum(axis=-1)
