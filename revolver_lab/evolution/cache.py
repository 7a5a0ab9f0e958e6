"""The cache of intermediate robots (appendix B): lazy, and bounded in memory."""

from collections import OrderedDict

from revolver_lab.evolution.live import Arrays


class Cache:
    """What distinguishes each compiled robot from E(0), least recently used first to go.

    Args:
        max_bytes: Bound on the arrays held.

    Example:
        >>> import numpy as np
        >>> cache = Cache(max_bytes=100)
        >>> cache.put(0.5, {"body_mass": np.zeros(10)})
        >>> cache.put(0.6, {"body_mass": np.ones(10)})
        >>> cache.get(0.5) is None, len(cache), cache.nbytes
        (True, 1, 80)
    """

    def __init__(self, max_bytes: int):
        self.max_bytes, self.nbytes = max_bytes, 0
        self._robots: OrderedDict[float, Arrays] = OrderedDict()

    def __len__(self) -> int:
        return len(self._robots)

    def get(self, alpha: float) -> Arrays | None:
        """The arrays that differ from E(0)'s at this alpha, or None if they are not held."""
        arrays = self._robots.get(alpha)
        if arrays is not None:
            self._robots.move_to_end(alpha)
        return arrays

    def put(self, alpha: float, arrays: Arrays) -> None:
        """Hold these arrays, letting the least recently used go if they do not fit."""
        if alpha in self._robots:
            return
        self._robots[alpha] = arrays
        self.nbytes += _size(arrays)
        while self.nbytes > self.max_bytes and len(self._robots) > 1:
            _, dropped = self._robots.popitem(last=False)
            self.nbytes -= _size(dropped)


def _size(arrays: Arrays) -> int:
    return sum(array.nbytes for array in arrays.values())
