"""The replays of P learners: one block of memory, each transition tagged with its beta."""

import numpy as np
import torch

from revolver_lab.learners.stacked.algorithm import Batch


class StackedReplay:
    """P replays of equal size; what one learner stores, forgets or samples moves no other.

    Rewards are stored as earned. A transition is one row, so that a batch is one gather:
    observation, next observation, action, reward, 1 where the episode goes on.

    Args:
        learners: P.
        capacity: Transitions that each holds at most; the oldest go first.
        observation_size: O.
        action_size: A.
        device: Where the rows live; the tags stay with the host.

    Attributes:
        rows: (P, capacity, 2 O + A + 2); memory is taken as it is written.
        betas: (P, capacity), float64: the ends of an interval are compared exactly.
        size: Transitions held by each, (P,).

    Example:
        >>> replay = StackedReplay(1, 10, observation_size=3, action_size=2)

        (torch.Size([1, 10, 10]), 480)
    """

    def __init__(
        self, learners: int, capacity: int, observation_size: int, action_size: int,
        device: str = "cpu",
    ):  # fmt: skip
        self.capacity = capacity
        self.widths = (observation_size, observation_size, action_size, 1, 1)
        self.rows = torch.empty(learners, capacity, sum(self.widths), device=device)
        self.betas = np.empty((learners, capacity))
        self.size, self._next = np.zeros(learners, dtype=int), np.zeros(learners, dtype=int)

    def extend(
        self, owner: np.ndarray, observation: np.ndarray, action: np.ndarray, reward: np.ndarray,
        following: np.ndarray, terminated: np.ndarray, betas: np.ndarray,
    ) -> None:  # fmt: skip
        """Stores m transitions.

        Args:
            owner: Whose each is, (m,), ascending.
            observation: (m, O).
            action: (m, A).
            reward: Unshaped, (m,).
            following: Next observations, (m, O).
            terminated: (m,) bool; an episode that ran out of time is not terminated.
            betas: (m,).
        """
        counts = np.bincount(owner, minlength=len(self.size))
        first = np.cumsum(counts) - counts
        place = (self._next[owner] + np.arange(len(owner)) - first[owner]) % self.capacity
        going_on = ~np.asarray(terminated, dtype=bool)
        columns = (observation, following, action, reward[:, None], going_on[:, None])
        block = torch.as_tensor(np.concatenate(columns, axis=1, dtype=np.float32))
        flat = torch.as_tensor(owner * self.capacity + place, device=self.rows.device)
        self.rows.view(-1, self.rows.shape[2])[flat] = block.to(self.rows.device)
        self.betas[owner, place] = betas
        self._next = (self._next + counts) % self.capacity
        self.size = np.minimum(self.size + counts, self.capacity)

    def clean(self, learner: int, low: float, high: float, latest: int | None = None) -> int:
        """Keeps one learner's transitions with beta in [low, high] (Algorithm 1, line 31).

        Args:
            learner: Whose.
            low: Lower end, included.
            high: Upper end, included.
            latest: Keep this many at most, the latest; None keeps all of the interval.

        Returns:
            How many are left.
        """
        order = self._order(learner)
        betas = self.betas[learner, order]
        kept = order[(betas >= low) & (betas <= high)]
        if latest is not None:
            kept = kept[max(len(kept) - latest, 0) :]
        if len(kept) < len(order):
            rows = self.rows[learner, torch.as_tensor(kept, device=self.rows.device)]
            self.load(learner, rows, self.betas[learner, kept])
        return len(kept)

    def _order(self, learner: int) -> np.ndarray:
        """Returns where one learner's transitions are, oldest first."""
        size = self.size[learner]
        return (self._next[learner] - size + np.arange(size)) % self.capacity

    def dump(self, learner: int) -> tuple[torch.Tensor, np.ndarray]:
        """Returns one learner's rows and betas, oldest first."""
        order = self._order(learner)
        rows = self.rows[learner, torch.as_tensor(order, device=self.rows.device)]
        return rows, self.betas[learner, order]

    def load(self, learner: int, rows: torch.Tensor, betas: np.ndarray) -> None:
        """Replaces what one learner holds by rows and betas, oldest first."""
        count = len(betas)
        self.rows[learner, :count], self.betas[learner, :count] = rows, betas
        self.size[learner], self._next[learner] = count, count % self.capacity

    def draw(self, learner: int, batch_size: int, rng: np.random.Generator) -> np.ndarray:
        """Draws ages of transitions uniformly, with replacement: places in its memory, (B,)."""
        drawn = rng.integers(0, max(self.size[learner], 1), batch_size)
        return (self._next[learner] - self.size[learner] + drawn) % self.capacity

    def gather(self, places: np.ndarray, weights: np.ndarray, noise: np.ndarray) -> Batch:
        """Returns the batches at these places, their rewards multiplied by the weights.

        Args:
            places: One row of places a learner, (P, B).
            weights: exp(h beta) or its kin, (P, B) (equation 5).
            noise: Standard normal numbers, (2, P, B, A) float32.
        """
        learners, size = places.shape
        flat = (np.arange(learners)[:, None] * self.capacity + places).ravel()
        device = self.rows.device
        index = torch.as_tensor(flat, device=device)
        rows = self.rows.view(-1, self.rows.shape[2]).index_select(0, index)
        parts = rows.view(learners, size, -1).split(self.widths, dim=2)
        weight = torch.as_tensor(weights.astype(np.float32), device=device)
        return Batch(
            observation=parts[0], following=parts[1], action=parts[2],
            reward=parts[3].squeeze(2) * weight, going_on=parts[4].squeeze(2),
            noise=torch.as_tensor(noise, device=device),
        )  # fmt: skip
