"""The value baseline: it knows the time and the robot, and learns from this and the last batch."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from revolver_lab.learners.natural.advantages import gae
from revolver_lab.learners.natural.regressor import Regressor
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.trajectories import Trajectories


class Value:
    """V(s, t, beta), fitted to discounted returns.

    Args:
        observation_size: O.
        settings: Its share of them.
        rng: Draws the first weights and the minibatches.
    """

    def __init__(self, observation_size: int, settings: NaturalSettings, rng: np.random.Generator):
        self.settings = settings
        self.net = Regressor(
            observation_size + 3 + settings.value_beta, 1, hidden=settings.value_hidden,
            learning_rate=settings.value_rate, batch_size=settings.value_batch, rng=rng,
            normalised=observation_size,
        )  # fmt: skip
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def fitted(self) -> bool:
        """Whether it has seen any data."""
        return self.net.fitted

    def features(self, batch: Trajectories) -> np.ndarray:
        """Returns what the net sees of every state: s, t, t^2, t^3 and beta, (T + 1, n, I).

        t is in trajectories, so that it runs from 0 to 1 at the most.
        """
        seen = batch.observations
        t = np.arange(len(seen), dtype=np.float32)[:, None, None] / self.settings.length
        clock = np.broadcast_to(np.concatenate([t, t * t, t**3], axis=2), (*seen.shape[:2], 3))
        robot = np.broadcast_to(batch.betas[None, :, None], (*seen.shape[:2], 1))
        known = [seen, clock, robot] if self.settings.value_beta else [seen, clock]
        return np.concatenate(known, axis=2, dtype=np.float32)

    def predict(self, batch: Trajectories) -> np.ndarray:
        """Returns V of every state, that behind the last step included, (T + 1, n)."""
        features = self.features(batch)
        flat = features.reshape(-1, features.shape[-1])
        return self.net.predict(flat).reshape(features.shape[:2])

    def targets(
        self, batch: Trajectories, rewards: np.ndarray, values: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns features (N, I) and discounted returns (N, 1) of the steps inside.

        Behind a time limit the return goes on with V, as in `gae`, whose advantages for a decay
        of 1 are the returns less V.
        """
        settings = self.settings
        rest = gae(rewards, values, batch.lengths, batch.terminated, gamma=settings.gamma,
                   decay=1.0, bootstrap=settings.bootstrap)  # fmt: skip
        inside = batch.inside
        return self.features(batch)[:-1][inside], (rest + values[:-1])[inside][:, None]

    def warm(self, played: Sequence[Trajectories], rewards: Sequence[np.ndarray]) -> None:
        """Fits the net for the first time.

        Args:
            played: Batches of the policy as it starts.
            rewards: Of each, as trained.
        """
        some = [self.targets(b, r, self.predict(b)) for b, r in zip(played, rewards)]
        x, y = (np.concatenate(parts) for parts in zip(*some))
        self.net.fit(x, y, self.settings.warm_epochs)
        self._last = some[-1]

    def fit(
        self, batch: Trajectories, rewards: np.ndarray, values: np.ndarray, epochs: int
    ) -> float:
        """Goes through this and the last batch.

        Args:
            batch: The batch.
            rewards: As trained, (T, n).
            values: What `predict` gave for it.
            epochs: How many times.

        Returns:
            The share of the returns' variance that `values` explained.
        """
        x, y = self.targets(batch, rewards, values)
        known = [(x, y)] if self._last is None else [(x, y), self._last]
        known_x, known_y = (np.concatenate(parts) for parts in zip(*known))
        self.net.fit(known_x, known_y, epochs)
        self._last = x, y
        missed, spread = np.var(y[:, 0] - values[:-1][batch.inside]), np.var(y)
        return float(1 - missed / spread) if spread > 0 else 0.0

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the net's arrays under names that a policy can carry along."""
        found, _ = self.net.state()
        return {f"value.{name}": array for name, array in found.items()}

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns all that `restore` needs, the last batch included."""
        arrays, plain = self.net.state()
        if self._last is not None:
            arrays |= {"last_x": self._last[0].copy(), "last_y": self._last[1].copy()}
        return arrays, plain

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned."""
        self.net.restore(arrays, plain)
        self._last = (arrays["last_x"], arrays["last_y"]) if "last_x" in arrays else None
