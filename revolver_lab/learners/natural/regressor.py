"""A small network fitted by least squares, which serves as value and as inverse dynamics."""

from typing import Any

import numpy as np

from revolver_lab.learners.natural import networks

_FIRST, _SECOND, _EPSILON = 0.9, 0.999, 1e-8  # Adam's (Kingma and Ba 2015)
_FARTHEST = 10.0  # normalised inputs are clipped here, for joints that hardly moved at first


class Regressor:
    """Predicts (N, K) from (N, I) with tanh layers, Adam and minibatches.

    The leading inputs are normalised by the mean and spread of the first data it is fitted to,
    the targets by those of the data at hand: the last layer is rewritten as they change, so that
    predictions do not (van Hasselt et al. 2016). Before the first fit it predicts 0.

    Args:
        inputs: I.
        outputs: K.
        hidden: Widths of the hidden layers.
        learning_rate: Of Adam.
        batch_size: Rows in a minibatch.
        normalised: How many of the leading inputs are normalised; None is all.
        rng: Draws the first weights and the minibatches.
    """

    def __init__(
        self, inputs: int, outputs: int, *, hidden: tuple[int, ...], learning_rate: float,
        batch_size: int, rng: np.random.Generator, normalised: int | None = None,
    ):  # fmt: skip
        self.sizes, self._rng = (inputs, *hidden, outputs), rng
        self._rate, self._batch = learning_rate, batch_size
        self._leading = inputs if normalised is None else normalised
        self.flat = networks.initial(self.sizes, rng)
        self.moments = np.zeros((2, len(self.flat)), np.float32)
        self.shift, self.scale = np.zeros(inputs, np.float32), np.ones(inputs, np.float32)
        self.target_shift, self.target_scale = np.zeros(outputs), np.ones(outputs)
        self.updates, self._block = 0, networks.block_rows(self.sizes)

    @property
    def fitted(self) -> bool:
        """Whether it has seen any data."""
        return self.updates > 0

    def predict(self, x: np.ndarray) -> np.ndarray:
        """Returns predictions, (N, K) float64, for inputs (N, I)."""
        if not self.fitted:
            return np.zeros((len(x), self.sizes[-1]))
        blocks = networks.blocked(self._normalised(x), self._block)
        out = networks.forward(networks.split(self.flat, self.sizes), blocks, "tanh")[-1]
        out = out.reshape(-1, self.sizes[-1])[: len(x)]
        return out * self.target_scale + self.target_shift

    def fit(self, x: np.ndarray, y: np.ndarray, epochs: int) -> None:
        """Goes through data in minibatches.

        Args:
            x: Inputs, (N, I).
            y: Targets, (N, K).
            epochs: How many times.
        """
        if not self.fitted:
            lead = x[:, : self._leading]
            self.shift[: self._leading] = lead.mean(axis=0)
            self.scale[: self._leading] = np.maximum(lead.std(axis=0), 1e-3)
        self._rescale(y)
        x = self._normalised(x)
        y = ((y - self.target_shift) / self.target_scale).astype(np.float32)
        for _ in range(epochs):
            order = self._rng.permutation(len(x))
            for i in range(0, len(x), self._batch):
                self._update(x[order[i : i + self._batch]], y[order[i : i + self._batch]])

    def _rescale(self, y: np.ndarray) -> None:
        """Takes the targets' mean and spread over, and leaves every prediction as it was."""
        shift, scale = y.mean(axis=0), y.std(axis=0)
        scale = np.where(scale > 1e-6, scale, self.target_scale)
        if self.fitted:
            weight, bias = networks.split(self.flat, self.sizes)[-1]
            weight *= (self.target_scale / scale)[:, None]
            bias[:] = (bias * self.target_scale + self.target_shift - shift) / scale
        self.target_shift, self.target_scale = shift, scale

    def _update(self, x: np.ndarray, y: np.ndarray) -> None:
        """Takes one step of Adam down the mean squared error."""
        weights = np.full((len(x), 1), 1 / len(x), np.float32)
        x, y, weights = (networks.blocked(a, self._block) for a in (x, y, weights))
        layers = networks.split(self.flat, self.sizes)
        values = networks.forward(layers, x, "tanh")
        error = (values[-1] - y) * weights
        gradient = networks.backward(layers, values, error, networks.slopes_of(values, "tanh"))
        self.updates += 1
        first, second = self.moments
        first += (1 - _FIRST) * (gradient - first)
        second += (1 - _SECOND) * (gradient * gradient - second)
        size = np.sqrt(second / np.float32(1 - _SECOND**self.updates)) + np.float32(_EPSILON)
        self.flat -= np.float32(self._rate / (1 - _FIRST**self.updates)) * first / size

    def _normalised(self, x: np.ndarray) -> np.ndarray:
        """Returns what the network sees, float32."""
        return np.clip((x - self.shift) / self.scale, -_FARTHEST, _FARTHEST).astype(np.float32)

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns all that `restore` needs, but for the stream it was given."""
        arrays = {name: getattr(self, name).copy() for name in _ARRAYS}
        return arrays, {"updates": self.updates}

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned."""
        for name in _ARRAYS:
            setattr(self, name, arrays[name].copy())
        self.updates = int(plain["updates"])


_ARRAYS = ("flat", "moments", "shift", "scale", "target_shift", "target_scale")
