"""The random streams of P learners, each named by its seed and its purpose."""

import enum
from collections.abc import Sequence
from typing import Any

import numpy as np

from revolver_lab.learners.stacked.replay import StackedReplay


class Purpose(enum.IntEnum):
    """What a stream is for; the environments' own streams have longer names."""

    INITIAL = 10
    EXPLORE = 11
    SAMPLE = 12


def stream(seed: int, purpose: Purpose) -> np.random.Generator:
    """Returns the stream of this name; it does not depend on who else learns.

    Args:
        seed: Of the learner, 0 or more.
        purpose: What will be drawn.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(purpose),)))


class Streams:
    """Everything that P learners draw.

    Args:
        seeds: One a learner.
    """

    def __init__(self, seeds: Sequence[int]):
        self.seeds = list(seeds)
        self._explore = [stream(seed, Purpose.EXPLORE) for seed in seeds]
        self._sample = [stream(seed, Purpose.SAMPLE) for seed in seeds]

    def initial(self, p: int) -> np.random.Generator:
        """Returns the stream of learner p's first weights."""
        return stream(self.seeds[p], Purpose.INITIAL)

    def explore(self, uniform: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
        """Draws exploration, (P, *shape) float32.

        Args:
            uniform: Who draws actions from [-1, 1], (P,) bool; the others standard normal noise.
            shape: Simulations a learner, and A.
        """
        drawn = np.empty((len(self.seeds), *shape), np.float32)
        for p, rng in enumerate(self._explore):
            drawn[p] = rng.uniform(-1, 1, shape) if uniform[p] else rng.standard_normal(
                shape, np.float32)  # fmt: skip
        return drawn

    def batch(
        self, learning: np.ndarray, replay: StackedReplay, size: int, action_size: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draws which transitions to learn from, and the noise of their actions.

        Args:
            learning: Who learns, (P,) bool; the others draw nothing.
            replay: Whose transitions are sampled.
            size: B.
            action_size: A.

        Returns:
            Places, (P, B), and noise, (2, P, B, A) float32.
        """
        places = np.zeros((len(self.seeds), size), dtype=int)
        noise = np.zeros((2, len(self.seeds), size, action_size), np.float32)
        for p in np.flatnonzero(learning).tolist():
            places[p] = replay.draw(p, size, self._sample[p])
            noise[:, p] = self._sample[p].standard_normal((2, size, action_size), np.float32)
        return places, noise

    def state(self) -> list[list[dict[str, Any]]]:
        """Returns the state of every stream, as plain values."""
        streams = (self._explore, self._sample)
        return [[rng.bit_generator.state for rng in some] for some in streams]  # type: ignore[misc]

    def restore(self, state: list[list[dict[str, Any]]]) -> None:
        """Puts back what `state` returned."""
        for some, held in zip((self._explore, self._sample), state, strict=True):
            for rng, value in zip(some, held, strict=True):
                rng.bit_generator.state = value
