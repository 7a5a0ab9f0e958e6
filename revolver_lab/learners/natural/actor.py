"""The Gaussian policy as one vector of parameters: its mean, its score, its Fisher information."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from revolver_lab.cards import ModelCard
from revolver_lab.errors import PolicyFileError
from revolver_lab.learners.natural import gaussian, networks
from revolver_lab.learners.natural.steps import Product
from revolver_lab.policies import Policy

_AFFINE = ("input_shift", "input_scale", "output_shift", "output_scale")


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Rows:
    """State-action pairs, each with a weight.

    Attributes:
        observations: (N, O).
        actions: (N, A), not clipped.
        weights: (N,).
    """

    observations: np.ndarray
    actions: np.ndarray
    weights: np.ndarray


class Actor:
    """a ~ N(mean(s), exp(log_std)^2), the mean a network and log_std free of the state.

    Args:
        sizes: Widths of the network from O to A.
        flat: Parameters, the network's and then log_std, (D,); their type is computed in.
        activation: "tanh" or "relu".
        affine: "input_shift", "input_scale", "output_shift", "output_scale" where a policy has
            them; they are kept as they are and not learnt.

    Attributes:
        layers: The network's layers, views of `flat`.
        log_std: The log standard deviations, (A,), a view of `flat`.
    """

    def __init__(
        self, sizes: tuple[int, ...], flat: np.ndarray, activation: str = "tanh",
        affine: Mapping[str, np.ndarray] | None = None,
    ):  # fmt: skip
        self.sizes, self.flat, self.activation = sizes, flat, activation
        self.affine = {k: v.astype(flat.dtype) for k, v in (affine or {}).items()}
        self.layers = networks.split(flat, sizes)  # views, made once: acting asks for them often
        self.log_std = flat[len(flat) - sizes[-1] :]
        self._block = networks.block_rows(sizes)

    @staticmethod
    def takes(policy: Policy) -> bool:
        """Whether a policy has a Gaussian head whose log_std does not depend on the state."""
        return policy.head == "gaussian" and "actor.log_std.weight" not in policy.weights

    @classmethod
    def of(cls, policy: Policy, log_std: float, dtype: type = np.float32) -> "Actor":
        """Takes a policy's actor over.

        Args:
            policy: With a "gaussian" head, whose log_std does not depend on the state.
            log_std: What to start from where the policy has none.
            dtype: Type to compute in.

        Raises:
            PolicyFileError: If it has another head.
        """
        if not cls.takes(policy):
            raise PolicyFileError(
                f"a policy with the head {policy.head!r}",
                "a 'gaussian' head whose actor.log_std does not depend on the state",
                "Carry its clone: revolver_lab.learners.natural.cloning.gaussian_clone.",
            )
        weights, layers = policy.weights, policy.layers
        pairs = [(weights[f"actor.{i}.weight"], weights[f"actor.{i}.bias"]) for i in range(layers)]
        spread = weights.get("actor.log_std", np.full(policy.action_size, log_std))
        sizes = (policy.observation_size, *(len(bias) for _, bias in pairs))
        affine = {k: weights[f"actor.{k}"] for k in _AFFINE if f"actor.{k}" in weights}
        flat = np.concatenate([networks.flatten(pairs), spread]).astype(dtype)
        return cls(sizes, flat, policy.activation, affine)

    def moved(self, step: np.ndarray, floor: float) -> "Actor":
        """Returns the actor a step further, log_std not below a floor."""
        other = Actor(self.sizes, (self.flat + step).astype(self.flat.dtype), self.activation)
        other.affine = self.affine
        np.maximum(other.log_std, floor, out=other.log_std)
        return other

    def mean(self, observations: np.ndarray) -> np.ndarray:
        """Returns the mean action, (..., A), not clipped, of observations (..., O)."""
        inputs = self._normalised(observations)
        return self._scaled(networks.forward(self.layers, inputs, self.activation)[-1])

    def means(self, observations: np.ndarray) -> np.ndarray:
        """Returns the mean actions, (N, A), of many observations, (N, O), in blocks."""
        found = self.mean(networks.blocked(observations, self._block))
        return found.reshape(-1, self.sizes[-1])[: len(observations)]

    def gradient(self, rows: Rows) -> np.ndarray:
        """Returns sum_i w_i grad log pi(a_i | s_i), (D,) float64."""
        blocks = (networks.blocked(x.astype(self.flat.dtype, copy=False), self._block)
                  for x in (rows.observations, rows.actions, rows.weights))  # fmt: skip
        inputs, actions, weights = blocks
        values = networks.forward(self.layers, self._normalised(inputs), self.activation)
        by_mean, by_spread = gaussian.score(actions, self._scaled(values[-1]), self.log_std)
        slopes = networks.slopes_of(values, self.activation)
        weights = weights[..., None]
        network = networks.backward(self.layers, values, self._stretched(by_mean * weights), slopes)
        spread = (by_spread * weights).sum(axis=(0, 1))
        return np.concatenate([network, spread]).astype(np.float64)

    def fisher(self, observations: np.ndarray, damping: float = 0.0) -> Product:
        """Returns the product by the Fisher information F plus damping, averaged over states.

        F is the Hessian of the mean KL divergence from this policy, at this policy. For a
        Gaussian it is exact and free of second derivatives: J^T std^-2 J for the network, with
        J the mean's Jacobian, and 2 for every log_std.

        Args:
            observations: (N, O).
            damping: Added to the diagonal.
        """
        inputs = networks.blocked(observations.astype(self.flat.dtype, copy=False), self._block)
        layers = self.layers
        values = networks.forward(layers, self._normalised(inputs), self.activation)
        slopes = networks.slopes_of(values, self.activation)
        inside = np.zeros(inputs.shape[0] * inputs.shape[1], self.flat.dtype)
        inside[: len(observations)] = 1 / len(observations)
        scale = self.affine.get("output_scale", np.ones(1, self.flat.dtype))
        metric = inside.reshape(*inputs.shape[:2], 1) * np.square(scale * np.exp(-self.log_std))
        heads = len(self.flat) - self.sizes[-1]

        def product(v: np.ndarray) -> np.ndarray:
            tangents = networks.split(v.astype(self.flat.dtype), self.sizes)
            change = networks.forward_derivative(layers, values, tangents, slopes)
            change *= metric
            network = networks.backward(layers, values, change, slopes)
            return np.concatenate([network, 2 * v[heads:]]) + damping * v

        return product

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns copies of all arrays under the names that `Policy` gives them."""
        found = {f"actor.{k}": v.copy() for k, v in self.affine.items()}
        for i, (weight, bias) in enumerate(self.layers):
            found |= {f"actor.{i}.weight": weight.copy(), f"actor.{i}.bias": bias.copy()}
        return found | {"actor.log_std": self.log_std.copy()}

    def policy(self, card: ModelCard, extra: Mapping[str, np.ndarray]) -> Policy:
        """Returns the policy, with further arrays that travel along."""
        return Policy(weights=self.arrays() | dict(extra), head="gaussian",
                      activation=self.activation, card=card)  # fmt: skip

    def _normalised(self, observations: np.ndarray) -> np.ndarray:
        """Returns what the network sees."""
        x = observations.astype(self.flat.dtype, copy=False)
        shift, scale = self.affine.get("input_shift"), self.affine.get("input_scale")
        x = x if shift is None else x - shift
        return x if scale is None else x / scale

    def _scaled(self, output: np.ndarray) -> np.ndarray:
        """Returns the mean action that an output of the network stands for."""
        output = self._stretched(output)
        shift = self.affine.get("output_shift")
        return output if shift is None else output + shift

    def _stretched(self, output: np.ndarray) -> np.ndarray:
        """Returns an output, or a cotangent of the mean, times the output's scale."""
        scale = self.affine.get("output_scale")
        return output if scale is None else output * scale
