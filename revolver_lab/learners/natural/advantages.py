"""How much better an action was than expected: generalised advantage estimation."""

import numpy as np


def gae(
    rewards: np.ndarray, values: np.ndarray, lengths: np.ndarray, terminated: np.ndarray, *,
    gamma: float, decay: float, bootstrap: bool = True,
) -> np.ndarray:  # fmt: skip
    """Returns A_t = sum_k (gamma decay)^k delta_(t+k) (Schulman et al. 2016, equation 16).

    delta_t = r_t + gamma V(s_(t+1)) - V(s_t), where V is 0 behind a failure. Behind a time limit
    it is V as well, since the task went on and only the watching ended; the published code of
    the hand took 0 there, too.

    Args:
        rewards: (T, n).
        values: V of every state, that behind the last step included, (T + 1, n).
        lengths: Steps of each trajectory, (n,), at most T; what is beyond is ignored.
        terminated: Which trajectories ended by failing, (n,) bool; the others ran out of time.
        gamma: Discount of a step.
        decay: lambda; 1 gives discounted returns less V, 0 gives delta.
        bootstrap: Whether a time limit is followed by V.

    Returns:
        Advantages, (T, n); 0 beyond the lengths.

    Example:
        >>> gae(np.ones((2, 1)), np.zeros((3, 1)), np.array([2]), np.array([True]),
        ...     gamma=0.5, decay=1.0).ravel()
        array([1.5, 1. ])
    """
    ended = terminated if bootstrap else np.ones_like(terminated)
    t = np.arange(len(rewards))[:, None]
    following = np.where((lengths == t + 1) & ended, 0.0, values[1:])
    delta = rewards + gamma * following - values[:-1]
    advantages, running = np.where(t < lengths, delta, 0.0), np.zeros(rewards.shape[1])
    for now in advantages[::-1]:  # beyond the lengths all is 0, and so `running` starts there
        now += gamma * decay * running
        running = now
    return advantages


def whitened(advantages: np.ndarray) -> np.ndarray:
    """Returns advantages, (N,), of mean 0 and variance 1; zeros where all are equal.

    Example:
        >>> whitened(np.array([1.0, 3.0]))
        array([-1.,  1.])
    """
    centred = advantages - advantages.mean()
    spread = centred.std()
    return centred / spread if spread > 1e-12 else np.zeros_like(centred)
