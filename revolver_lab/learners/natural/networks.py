"""Multilayer perceptrons as arrays: outputs, directional derivatives and gradients by hand."""

import itertools
from collections.abc import Sequence

import numpy as np

from revolver_lab.policies import ACTIVATIONS

Layers = list[tuple[np.ndarray, np.ndarray]]
"""Weight (out, in) and bias (out,) of each layer, as `Policy` has them."""

SLOPES = {"relu": lambda h: (h > 0).astype(h.dtype), "tanh": lambda h: 1 - h * h}
"""Derivative of an activation, told from its value."""

# OpenBLAS multiplies matrices on one thread up to this many products. Beyond it the threads that
# it wakes spin in the way of the physics', so rows are multiplied in blocks that stay below.
_MOST_PRODUCTS = 1 << 18


def initial(sizes: Sequence[int], rng: np.random.Generator, last: float = 1.0) -> np.ndarray:
    """Returns random parameters: weights uniform within 1 / sqrt(inputs), biases zero.

    Args:
        sizes: Widths from input to output.
        rng: The stream to draw from.
        last: Factor on the weights of the last layer.
    """
    layers = []
    for i, (width, out) in enumerate(itertools.pairwise(sizes)):
        bound = (last if i == len(sizes) - 2 else 1.0) / np.sqrt(width)
        layers.append((rng.uniform(-bound, bound, (out, width)), np.zeros(out)))
    return flatten(layers).astype(np.float32)


def flatten(layers: Layers) -> np.ndarray:
    """Returns all numbers of the layers in one vector."""
    return np.concatenate([array.ravel() for pair in layers for array in pair])


def split(flat: np.ndarray, sizes: Sequence[int]) -> Layers:
    """Returns the layers as views of a vector that begins with their numbers.

    Example:
        >>> [(w.shape, b.shape) for w, b in split(np.zeros(11), (2, 3, 0))]
        [((3, 2), (3,)), ((0, 3), (0,))]
    """
    layers, at = [], 0
    for width, out in itertools.pairwise(sizes):
        weight = flat[at : at + out * width].reshape(out, width)
        at += out * width
        layers.append((weight, flat[at : at + out]))
        at += out
    return layers


def block_rows(sizes: Sequence[int]) -> int:
    """Returns how many rows a block may have for a network of these widths."""
    largest = max(a * b for a, b in itertools.pairwise(sizes))
    return int(min(max(_MOST_PRODUCTS // largest, 1), 64))


def blocked(x: np.ndarray, rows: int) -> np.ndarray:
    """Returns rows (N, ...) as blocks (B, rows, ...), zeros after the last; not to be written.

    Example:
        >>> blocked(np.arange(3.0), 2)
        array([[0., 1.],
               [2., 0.]])
    """
    blocks = -(-len(x) // rows)
    if len(x) == blocks * rows:
        return x.reshape(blocks, rows, *x.shape[1:])
    out = np.zeros((blocks * rows, *x.shape[1:]), x.dtype)
    out[: len(x)] = x
    return out.reshape(blocks, rows, *x.shape[1:])


def _times(x: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Returns x W^T; BLAS takes half as long for many blocks if W^T has its numbers in order."""
    return x @ (np.ascontiguousarray(weight.T) if x.ndim > 2 else weight.T)


def forward(layers: Layers, x: np.ndarray, activation: str) -> list[np.ndarray]:
    """Returns the input and the value of each layer, the last one the output.

    Args:
        layers: The network.
        x: (..., inputs).
        activation: Between the layers, "tanh" or "relu".
    """
    values = [x]
    for i, (weight, bias) in enumerate(layers):
        out = _times(values[-1], weight)
        out += bias
        values.append(out if i == len(layers) - 1 else ACTIVATIONS[activation](out))
    return values


def forward_derivative(
    layers: Layers, values: list[np.ndarray], tangents: Layers, slopes: list[np.ndarray]
) -> np.ndarray:
    """Returns J v: how the outputs change as the parameters move along v.

    Args:
        layers: The network.
        values: What `forward` returned.
        tangents: v, in the shape of the layers.
        slopes: Derivatives of the activations at `values`, one a hidden layer.

    Returns:
        (..., outputs).
    """
    change = _times(values[0], tangents[0][0])
    change += tangents[0][1]
    for i in range(1, len(layers)):
        change *= slopes[i - 1]
        change = _times(change, layers[i][0])
        change += _times(values[i], tangents[i][0])
        change += tangents[i][1]
    return change


def backward(
    layers: Layers, values: list[np.ndarray], cotangent: np.ndarray, slopes: list[np.ndarray]
) -> np.ndarray:
    """Returns J^T u, summed over rows: the gradient of sum(u * outputs) by the parameters.

    Args:
        layers: The network.
        values: What `forward` returned, (B, rows, ...) each.
        cotangent: u, (B, rows, outputs).
        slopes: Derivatives of the activations at `values`, one a hidden layer.

    Returns:
        The gradient in one vector.
    """
    found: Layers = []
    for i in reversed(range(len(layers))):
        weight = (cotangent.swapaxes(1, 2) @ values[i]).sum(axis=0)
        found.append((weight, cotangent.sum(axis=(0, 1))))
        if i:
            cotangent = cotangent @ layers[i][0]
            cotangent *= slopes[i - 1]
    return flatten(found[::-1])


def slopes_of(values: list[np.ndarray], activation: str) -> list[np.ndarray]:
    """Returns the derivatives of the activations at the values of the hidden layers."""
    return [SLOPES[activation](value) for value in values[1:-1]]
