"""Adam for P learners at once, each with its own moments and its own count of steps."""

import torch
from torch.optim.adam import adam


class Adam:
    """Adam (Kingma & Ba 2015) on flat weights; a learner that is masked out stays as it is.

    On the CPU torch's own fused kernel goes through the rows that move, once. On a device the
    mask is not known to the host, least of all in a captured graph, so all rows are computed and
    those that move are chosen.

    Args:
        weights: (P, D), changed in place.
        learning_rate: Step size.

    Attributes:
        first: Running mean of the gradients, (P, D).
        second: Running mean of their squares, (P, D).
        count: Steps taken by each learner, (P, 1).

    Example:
        >>> weights = torch.zeros(2, 3)
        >>> Adam(weights, 0.5).step(torch.full((2, 3), 7.0), torch.tensor([[True], [False]]))
        >>> weights[:, 0]
        tensor([-0.5000,  0.0000])
    """

    DECAY = (0.9, 0.999)
    EPSILON = 1e-8

    def __init__(self, weights: torch.Tensor, learning_rate: float):
        self.weights, self.learning_rate = weights, learning_rate
        self.first, self.second = torch.zeros_like(weights), torch.zeros_like(weights)
        self.count = torch.zeros(len(weights), 1, device=weights.device)

    def step(self, gradient: torch.Tensor, mask: torch.Tensor) -> None:
        """Takes one step where the mask says so.

        Args:
            gradient: (P, D).
            mask: Which learners step, (P, 1) bool.
        """
        if self.weights.device.type == "cpu":
            self._step_rows(gradient, mask.squeeze(1).nonzero().squeeze(1).tolist())
        else:
            self._step_masked(gradient, mask)

    def _step_rows(self, gradient: torch.Tensor, rows: list[int]) -> None:
        """Moves these rows by torch's fused kernel."""
        state = (self.weights, gradient, self.first, self.second)
        weights, gradients, firsts, seconds = ([array[row] for row in rows] for array in state)
        counts = [self.count[row, 0] for row in rows]
        adam(
            weights, gradients, firsts, seconds, [], counts, fused=True, amsgrad=False,
            beta1=self.DECAY[0], beta2=self.DECAY[1], lr=self.learning_rate, weight_decay=0.0,
            eps=self.EPSILON, maximize=False,
        )  # fmt: skip

    def _step_masked(self, gradient: torch.Tensor, mask: torch.Tensor) -> None:
        """Computes the step of every row, and takes it where the mask says so."""
        slow, slower = self.DECAY
        self.count += mask
        first = torch.lerp(self.first, gradient, 1 - slow)
        second = torch.addcmul(self.second * slower, gradient, gradient, value=1 - slower)
        bias = 1 - slow**self.count, 1 - slower**self.count
        size = self.learning_rate / bias[0]
        move = first / ((second / bias[1]).sqrt_().add_(self.EPSILON)) * size
        torch.where(mask, first, self.first, out=self.first)
        torch.where(mask, second, self.second, out=self.second)
        torch.where(mask, self.weights - move, self.weights, out=self.weights)

    def reset(self, learner: int) -> None:
        """Forgets the moments and the count of one learner."""
        for array in (self.first, self.second, self.count):
            array[learner] = 0
