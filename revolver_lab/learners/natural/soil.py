"""SOIL: imitation of states alone, the actions between them told by a model learnt on the way."""

from typing import Any

import numpy as np

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.learners.natural.imitating import Imitator
from revolver_lab.learners.natural.regressor import Regressor
from revolver_lab.trajectories import Trajectories


class SOIL(Imitator):
    """State-only imitation learning (Radosavovic et al. 2020).

    An inverse dynamics model a = h(s, s') is fitted to the policy's own latest batches, and so
    knows the robot being trained, not the teacher's. What it says of the teacher's transitions
    is imitated as in DAPG. With a weight of 0 it is NPG, bit for bit.

    """

    def prepare(self) -> None:
        """Makes the inverse model, which has seen nothing yet."""
        observation_size, action_size = self.actor.sizes[0], self.actor.sizes[-1]
        self.inverse = Regressor(
            2 * observation_size, action_size, hidden=self.settings.inverse_hidden,
            learning_rate=self.settings.inverse_rate, batch_size=self.settings.value_batch,
            rng=self.streams["inverse"],
        )  # fmt: skip
        self._memory: list[tuple[np.ndarray, np.ndarray]] = []

    def require(self, teacher: Demonstrations) -> None:
        """Raises DemonstrationsError unless the states are the robot's; the actions may not be."""
        teacher.fits(self.actor.sizes[0], teacher.action_size)

    def taught(self, batch: Trajectories, teacher: Demonstrations) -> np.ndarray:
        """Returns the actions that the model, fitted to this batch too, tells, (N, A)."""
        self.learn(batch)
        return self.tell(teacher)

    def learn(self, batch: Trajectories) -> None:
        """Fits the inverse model to this and the latest batches.

        The robot was moved by clipped actions: these are fitted to.

        Args:
            batch: As `sample` gives it; the last `inverse_batches` are remembered.
        """
        inside = batch.inside
        pairs = _pairs(batch.observations[:-1][inside], batch.observations[1:][inside])
        self._memory.append((pairs, np.clip(batch.actions[inside], -1, 1)))
        del self._memory[: -self.settings.inverse_batches]
        x, y = (np.concatenate(parts) for parts in zip(*self._memory))
        self.inverse.fit(x, y, self.settings.inverse_epochs)

    def tell(self, teacher: Demonstrations) -> np.ndarray:
        """Returns which actions lead from state to state, (N, A), on the robot it has learnt of.

        Args:
            teacher: Its states are looked at, its actions are not.
        """
        told = self.inverse.predict(_pairs(teacher.observations, teacher.next_observations))
        return np.clip(told, -1, 1)

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns all that `restore` needs, the inverse model and its memory included."""
        arrays, plain = super().state()
        inverse, values = self.inverse.state()
        arrays |= {f"inverse/{k}": v for k, v in inverse.items()}
        for i, (x, y) in enumerate(self._memory):
            arrays |= {f"memory/{i}/x": x.copy(), f"memory/{i}/y": y.copy()}
        return arrays, plain | {"inverse": values, "memory": len(self._memory)}

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned."""
        super().restore(arrays, plain)
        self.inverse.restore({k.removeprefix("inverse/"): v for k, v in arrays.items()
                              if k.startswith("inverse/")}, plain["inverse"])  # fmt: skip
        self._memory = [(arrays[f"memory/{i}/x"].copy(), arrays[f"memory/{i}/y"].copy())
                        for i in range(plain["memory"])]  # fmt: skip


def _pairs(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Returns state and change, (N, 2 O): small changes stay visible beside large states."""
    return np.concatenate([before, after - before], axis=1)
