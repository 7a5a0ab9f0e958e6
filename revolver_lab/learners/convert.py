"""The bridge between stable-baselines3 models and policies: one table of names for both ways."""

from collections.abc import Iterable
from typing import cast

import torch
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from torch import nn

from revolver_lab.cards import ModelCard, versions
from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.policies import Policy
from revolver_lab.weights import with_targets

_ACTIVATIONS = {nn.ReLU: "relu", nn.Tanh: "tanh"}


def tensors(model: OffPolicyAlgorithm) -> dict[str, torch.Tensor]:
    """Returns every weight of a model, live, under the name that `Policy` gives it.

    Args:
        model: SAC, TD3, DDPG or a relative, with MLP networks and without gSDE.

    Raises:
        SettingsError: If it has no actor made of linear layers.
    """
    policy = model.policy
    actor = getattr(policy, "actor", None)
    if actor is None or getattr(model, "use_sde", False):
        raise SettingsError(f"model = {type(model).__name__}{' with gSDE' if actor else ''}",
                            "an off-policy algorithm with an actor, as SAC, TD3 or DDPG",
                            "Train with SAC or TD3, and use_sde=False.")  # fmt: skip
    found = _actor("actor", actor)
    if hasattr(policy, "actor_target"):
        found |= _actor("actor_target", cast(nn.Module, policy.actor_target))
    for name in ("critic", "critic_target"):
        for twin, network in enumerate(getattr(policy, name).q_networks):
            found |= _network(f"{name}.{twin}", network)
    return found


def _actor(name: str, actor: nn.Module) -> dict[str, torch.Tensor]:
    """Names the weights of SAC's actor (latent_pi, mu, log_std) or TD3's (mu alone)."""
    if not hasattr(actor, "latent_pi"):
        return _network(name, actor.mu)  # type: ignore[arg-type]
    found = _network(name, [*actor.latent_pi, actor.mu])  # type: ignore[misc]
    return found | _pair(f"{name}.log_std", actor.log_std)  # type: ignore[arg-type]


def _network(name: str, modules: Iterable[nn.Module]) -> dict[str, torch.Tensor]:
    """Names the weights of a stack of layers, counting the linear ones."""
    found, layer = {}, -1
    for module in modules:
        if isinstance(module, nn.Linear):
            layer += 1
            found |= _pair(f"{name}.{layer}", module)
        elif isinstance(module, nn.LayerNorm):
            found |= _pair(f"{name}.{layer}.norm", module)
    return found


def _pair(name: str, module: nn.Linear | nn.LayerNorm) -> dict[str, torch.Tensor]:
    """Names weight and bias of one module."""
    return {f"{name}.weight": module.weight, f"{name}.bias": module.bias}


def from_sb3(model: OffPolicyAlgorithm, card: ModelCard | None = None) -> Policy:
    """Converts a stable-baselines3 model into a policy, critic included.

    Args:
        model: What was trained, with actions in [-1, 1].
        card: Where it comes from; by default its algorithm, steps, seed and versions.

    Raises:
        SettingsError: If the model is of a kind that no `Policy` can be.
    """
    weights = {k: v.detach().cpu().numpy().copy() for k, v in tensors(model).items()}
    return Policy(
        weights=weights,
        head="squashed_gaussian" if "actor.log_std.weight" in weights else "tanh",
        activation=_activation(model),
        card=card or ModelCard(algorithm=type(model).__name__, steps=model.num_timesteps,
                               seed=model.seed, versions=versions()),
    )  # fmt: skip


def _activation(model: OffPolicyAlgorithm) -> str:
    """Returns the name of the activation between the layers.

    Raises:
        SettingsError: If it is none that a `Policy` knows.
    """
    kind = getattr(model.policy, "activation_fn", None)
    if kind not in _ACTIVATIONS:
        raise SettingsError(f"activation_fn = {kind}", "torch.nn.ReLU or torch.nn.Tanh",
                            "Set policy_kwargs=dict(activation_fn=torch.nn.ReLU).")  # fmt: skip
    return _ACTIVATIONS[kind]


def to_sb3(policy: Policy, model: OffPolicyAlgorithm) -> OffPolicyAlgorithm:
    """Writes a policy into a stable-baselines3 model of the same shape.

    The critic is carried over where the policy has one. A target network that the policy lacks
    starts as a copy of what it follows. Optimisers are left as they are.

    Args:
        policy: The policy.
        model: The model, which is changed.

    Returns:
        The model.

    Raises:
        PolicyFileError: If a shape does not fit, or the critic is of another make.
    """
    live = tensors(model)
    given = with_targets(policy.parameters(), policy.head)
    if not any(name.startswith("critic.") for name in given):
        live = {k: v for k, v in live.items() if not k.startswith("critic")}
    missing = sorted(set(live) ^ set(given))
    wrong = [k for k in set(live) & set(given) if tuple(live[k].shape) != given[k].shape]
    if missing or wrong:
        raise PolicyFileError(
            f"a policy that differs in {(missing + wrong)[:3]}",
            f"the networks of this {type(model).__name__}",
            "Use the settings the expert was trained with, or expert.without_critic().",
        )
    with torch.no_grad():
        for name, tensor in live.items():
            tensor.copy_(torch.as_tensor(given[name]))
    return model
