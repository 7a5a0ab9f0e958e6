"""From a learner's arrays to a policy's, and back: one table of names for both ways."""

from collections.abc import Mapping

import numpy as np

from revolver_lab.cards import ModelCard
from revolver_lab.errors import PolicyFileError
from revolver_lab.learners.stacked.algorithm import Algorithm
from revolver_lab.policies import Policy
from revolver_lab.weights import with_targets

Arrays = dict[str, np.ndarray]


def policy_of(algorithm: Algorithm, learner: int, card: ModelCard | None = None) -> Policy:
    """Returns a copy of one learner as a policy, critic included.

    Args:
        algorithm: All learners.
        learner: Which.
        card: Where it comes from.
    """
    weights: Arrays = {}
    for part, networks in algorithm.parts().items():
        for target in (False, True):
            if target and networks.target is None:
                continue
            name = f"{part}_target." if target else f"{part}."
            weights |= {name + k: v for k, v in networks.arrays(learner, target=target).items()}
    weights = _split(weights, algorithm)
    return Policy(weights=weights, head=algorithm.head, card=card or ModelCard())


def _split(weights: Arrays, algorithm: Algorithm) -> Arrays:
    """Splits the last layer of a squashed Gaussian into mean and log_std, as `Policy` has them."""
    if algorithm.outputs_per_action == 1:
        return weights
    last = len(algorithm.settings.hidden)
    for kind in ("weight", "bias"):
        mean, log_std = np.split(weights.pop(f"actor.{last}.{kind}"), 2)
        weights |= {f"actor.{last}.{kind}": mean, f"actor.log_std.{kind}": log_std}
    return weights


def _join(weights: Mapping[str, np.ndarray], algorithm: Algorithm) -> Arrays:
    """Undoes `_split`."""
    joined = dict(weights)
    if algorithm.outputs_per_action == 1:
        return joined
    last = len(algorithm.settings.hidden)
    for kind in ("weight", "bias"):
        parts = [joined.get(f"actor.{last}.{kind}"), joined.pop(f"actor.log_std.{kind}", None)]
        if all(part is not None for part in parts):
            joined[f"actor.{last}.{kind}"] = np.concatenate(parts)  # type: ignore[arg-type]
    return joined


def adopt(algorithm: Algorithm, learner: int, expert: Policy, *, critic: bool = True) -> None:
    """Writes an expert's actor, critics and targets into one learner; optimisers stay as they are.

    Args:
        algorithm: All learners.
        learner: Which.
        expert: The policy; where it has no critic, the learner keeps its own.
        critic: Whether the critic is taken over.

    Raises:
        PolicyFileError: If its networks are of another make.
    """
    given = _join(with_targets(expert.parameters(), expert.head), algorithm)
    carried = critic and any(name.startswith("critic.") for name in given)
    for part, networks in algorithm.parts().items():
        if part == "critic" and not carried:
            continue
        for target in (False, True):
            if target and networks.target is None:
                continue
            prefix = f"{part}_target." if target else f"{part}."
            found = {k.removeprefix(prefix): v for k, v in given.items() if k.startswith(prefix)}
            _require_same(networks.arrays(learner), found, prefix, expert, algorithm)
            networks.write(learner, found, target=target)


def _require_same(
    mine: Arrays, given: Arrays, prefix: str, expert: Policy, algorithm: Algorithm
) -> None:
    """Refuses arrays of other names or shapes, or of another head."""
    names = sorted(set(mine) ^ set(given))
    names += [k for k in set(mine) & set(given) if mine[k].shape != given[k].shape]
    if names or expert.head != algorithm.head or expert.activation != "relu":
        differs = f"differs in {[prefix + name for name in names[:3]]}"
        kind = f"has the head {expert.head!r} and the activation {expert.activation!r}"
        raise PolicyFileError(
            f"a policy that {differs if names else kind}",
            f"the networks of this {algorithm.settings.name}: hidden = "
            f"{algorithm.settings.hidden}, layer_norm = {algorithm.settings.layer_norm}, relu",
            "Use the settings the expert was trained with, or expert.without_critic().",
        )
