"""Zero insertion: the weights of a policy for a robot that has gained joints (section 4.1)."""

from collections.abc import Mapping

import numpy as np

from revolver_lab.evolution.lifting import insert_zeros


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
            array = _around(rest, array, columns, observation_size)
        if not network.startswith("critic") and _is_output(rest, layers):
            array = _around(rest, array, rows, action_size)
        lifted[name] = array
    return lifted


def _is_output(rest: str, layers: int) -> bool:
    """Says whether an actor's array has one row for each action."""
    heads = (f"{layers - 1}.", "log_std", "output_")
    return rest.startswith(heads)


def _around(name: str, array: np.ndarray, where: np.ndarray, size: int) -> np.ndarray:
    """Inserts zeros along the first axis; ones into what scales."""
    neutral = 1.0 if name.endswith("_scale") else 0.0
    return insert_zeros(array - neutral, where, size, axis=0) + neutral
