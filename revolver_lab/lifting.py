"""Zero insertion: the weights of a policy for a robot that has gained joints (section 4.1)."""

from collections.abc import Mapping

import numpy as np


def insert_zeros(
    array: np.ndarray, where: np.ndarray, size: int, axis: int, fill: float = 0.0
) -> np.ndarray:
    """Returns an array grown along one axis, the old entries at `where`, `fill` elsewhere.

    Args:
        array: What is grown.
        where: New index of each old one, (array.shape[axis],).
        size: New length of the axis.
        axis: The axis.
        fill: What the new entries hold.

    Example:
        >>> insert_zeros(np.array([1.0, 2.0]), np.array([0, 2]), 3, axis=0)
        array([1., 0., 2.])
    """
    shape = list(array.shape)
    shape[axis] = size
    grown = np.full(shape, fill, dtype=array.dtype)
    index: list = [slice(None)] * array.ndim
    index[axis] = where
    grown[tuple(index)] = array
    return grown


def lift_weights(
    weights: Mapping[str, np.ndarray],
    layers: int,
    columns: np.ndarray,
    observation_size: int,
    rows: np.ndarray,
    action_size: int,
) -> dict[str, np.ndarray]:
    """Returns the weights of the same policy, and critic, for longer observations and actions.

    Args:
        weights: Arrays by name, as `Policy` has them.
        layers: Number of linear layers of the actor.
        columns: Where each old observation stands in the new one, (O,).
        observation_size: Length of the new observation.
        rows: Where each old action stands in the new one, (A,).
        action_size: Length of the new action.
    """
    both = np.concatenate([columns, observation_size + rows])
    lifted = {}
    for name, array in weights.items():
        network, _, rest = name.partition(".")
        if network.startswith("critic"):
            if rest.split(".", 1)[1] == "0.weight":  # a critic looks at observation and action
                array = insert_zeros(array, both, observation_size + action_size, axis=1)
        elif rest == "0.weight":
            array = insert_zeros(array, columns, observation_size, axis=1)
        elif rest in ("input_shift", "input_scale"):
            array = insert_zeros(array, columns, observation_size, 0, float(rest[-1] == "e"))
        if not network.startswith("critic") and _is_output(rest, layers):
            array = insert_zeros(array, rows, action_size, 0, float(rest == "output_scale"))
        lifted[name] = array
    return lifted


def _is_output(rest: str, layers: int) -> bool:
    """Says whether an actor's array has one row for each action."""
    heads = (f"{layers - 1}.", "log_std", "output_")
    return rest.startswith(heads)
