"""The weights of P networks of one shape as one array, (P, D), and the layers as views of it."""

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
import torch

_ALIGN = 16  # floats: every layer starts on a cache line, so that its products round alike


@dataclasses.dataclass(frozen=True)
class Layout:
    """Where each named array of a network stands in its flat vector of weights.

    Weights are (inputs, outputs), biases (1, outputs): as they are multiplied and added. `Policy`
    and torch have them the other way round; `export` and `load` go between.

    Attributes:
        shapes: Array name -> shape, in order.

    Example:
        >>> layout = Layout({"0.weight": (3, 2), "0.bias": (1, 2)})
        >>> layout.size, layout.offsets["0.bias"]
        (32, 16)
    """

    shapes: Mapping[str, tuple[int, ...]]

    @property
    def offsets(self) -> dict[str, int]:
        """Returns where each array begins."""
        offsets, end = {}, 0
        for name, shape in self.shapes.items():
            offsets[name] = end
            end += _padded(math.prod(shape))
        return offsets

    @property
    def size(self) -> int:
        """Returns D, padding included."""
        return sum(_padded(math.prod(shape)) for shape in self.shapes.values())

    def views(self, flat: torch.Tensor) -> dict[str, torch.Tensor]:
        """Returns the arrays of P networks by name, (P, *shape) each, as views.

        Args:
            flat: (P, D), rows contiguous.
        """
        found = {}
        for (name, shape), start in zip(self.shapes.items(), self.offsets.values(), strict=True):
            part = flat[:, start : start + math.prod(shape)]
            found[name] = part.unflatten(1, shape)
        return found


def _padded(count: int) -> int:
    """Rounds up to whole cache lines."""
    return -(-count // _ALIGN) * _ALIGN


def mlp(sizes: Sequence[int], *, norm: bool) -> Layout:
    """Lays out a multilayer perceptron.

    Args:
        sizes: Widths of input, hidden layers and output.
        norm: Whether LayerNorm follows each hidden layer.
    """
    shapes: dict[str, tuple[int, ...]] = {}
    for i, (inputs, outputs) in enumerate(itertools.pairwise(sizes)):
        shapes |= {f"{i}.weight": (inputs, outputs), f"{i}.bias": (1, outputs)}
        if norm and i < len(sizes) - 2:
            shapes |= {f"{i}.norm.weight": (1, outputs), f"{i}.norm.bias": (1, outputs)}
    return Layout(shapes)


def export(name: str, array: np.ndarray) -> np.ndarray:
    """Returns an array of a layout as `Policy` has it: weights (outputs, inputs), others (n,)."""
    return array.T if _is_weight(name) else array[0]


def load(name: str, array: np.ndarray) -> np.ndarray:
    """Returns an array of a `Policy` as a layout has it; undoes `export`."""
    return array.T if _is_weight(name) else array[None]


def _is_weight(name: str) -> bool:
    """Says whether an array is a layer's matrix."""
    return name.endswith(".weight") and not name.endswith(".norm.weight")


def fresh(layout: Layout, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Draws the weights of one network, uniform within 1 / sqrt(inputs) as torch's Linear does.

    Args:
        layout: Its arrays.
        rng: The learner's own stream.
    """
    drawn, bound = {}, 0.0
    for name, shape in layout.shapes.items():
        if ".norm." in name:
            drawn[name] = np.full(shape, float(name.endswith("weight")), np.float32)
            continue
        if name.endswith("weight"):
            bound = 1 / math.sqrt(shape[0])
        drawn[name] = rng.uniform(-bound, bound, shape).astype(np.float32)
    return drawn


def forward(weights: Mapping[str, torch.Tensor], x: torch.Tensor) -> torch.Tensor:
    """Applies P perceptrons to P batches: x W + b, LayerNorm where there is one, ReLU.

    Args:
        weights: (P, *shape) each, as `Layout.views` gives them.
        x: (P, B, inputs).

    Returns:
        (P, B, outputs).
    """
    last = sum(name.endswith(".bias") and ".norm." not in name for name in weights) - 1
    for i in range(last + 1):
        weight, bias = weights[f"{i}.weight"], weights[f"{i}.bias"]
        x = torch.baddbmm(bias, x, weight)
        if f"{i}.norm.weight" in weights:
            scale, shift = weights[f"{i}.norm.weight"], weights[f"{i}.norm.bias"]
            x = torch.nn.functional.layer_norm(x, x.shape[-1:])
            x = torch.addcmul(shift, x, scale)
        if i < last:
            x = torch.relu_(x)  # in place: what it needs for its gradient is what it returns
    return x
