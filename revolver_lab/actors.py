"""Which arrays make an actor that can act, and what is wrong with others."""

from collections.abc import Mapping

import numpy as np

from revolver_lab.weights import count_layers


def actor_problem(weights: Mapping[str, np.ndarray]) -> str | None:
    """Says what is wrong with the arrays of a policy, or None.

    Args:
        weights: By name, as `revolver_lab.policies.Policy` describes them.

    Example:
        >>> actor_problem({"actor.0.weight": np.eye(2, 3), "actor.0.bias": np.zeros(3)})
        'actor.0.bias missing or not of shape (2,)'
    """
    for name, array in weights.items():
        finite = isinstance(array, np.ndarray) and array.dtype.kind == "f"
        if not finite or not np.isfinite(array).all():
            return f"numbers in {name} that are not finite floats"
    shapes = {name: array.shape for name, array in weights.items()}
    if len(shapes.get("actor.0.weight", ())) != 2:
        return "no actor.0.weight of shape (out, in)"
    inputs = width = shapes["actor.0.weight"][1]
    for i in range(count_layers(weights, "actor")):
        weight, before = shapes[f"actor.{i}.weight"], width
        if len(weight) != 2 or weight[1] != before:
            return f"actor.{i}.weight of shape {weight} after a width of {before}"
        width = weight[0]
        if shapes.get(f"actor.{i}.bias") != (width,):
            return f"actor.{i}.bias missing or not of shape ({width},)"
    return _spread_problem(shapes, before, width) or _affine_problem(weights, inputs, width)


def _spread_problem(shapes: Mapping[str, tuple[int, ...]], before: int, actions: int) -> str | None:
    """Says what is wrong with the spread of an actor.

    Args:
        shapes: Of the arrays by name.
        before: Width of what the last layer looks at.
        actions: A.
    """
    wanted = {"actor.log_std": (actions,), "actor.log_std.weight": (actions, before),
              "actor.log_std.bias": (actions,)}  # fmt: skip
    for name, shape in wanted.items():
        if shapes.get(name, shape) != shape:
            return f"{name} of shape {shapes[name]}, not {shape}"
    return _alone(shapes, "actor.log_std.weight", "actor.log_std.bias")


def _affine_problem(weights: Mapping[str, np.ndarray], inputs: int, actions: int) -> str | None:
    """Says what is wrong with what shifts and scales inputs and outputs."""
    for side, size in (("input", inputs), ("output", actions)):
        shift, scale = f"actor.{side}_shift", f"actor.{side}_scale"
        for name in (shift, scale):
            if name in weights and weights[name].shape != (size,):
                return f"{name} of shape {weights[name].shape}, not ({size},)"
        if scale in weights and not weights[scale].all():
            return f"zeros in {scale}"
        if problem := _alone(weights, shift, scale):
            return problem
    return None


def _alone(known: Mapping[str, object], one: str, other: str) -> str | None:
    """Says which of two names is there without the other."""
    if (one in known) == (other in known):
        return None
    return f"{one} without {other}" if one in known else f"{other} without {one}"
