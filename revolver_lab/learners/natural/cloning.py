"""A policy with a Gaussian head that acts as another one does, whatever head that one has."""

import dataclasses

import numpy as np

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.errors import SettingsError
from revolver_lab.given import are_widths, count_of, is_number, require, seed_of
from revolver_lab.learners.natural import networks
from revolver_lab.learners.natural.regressor import Regressor
from revolver_lab.learners.natural.settings import PILOT
from revolver_lab.policies import Policy

HIDDEN = (64, 64)
"""Widths of a clone's hidden layers, those of the course's experts."""
EPISODES = 100
"""Episodes of drawn actions from which an expert is cloned, where nothing else is said."""
_EPOCHS, _RATE, _BATCH = 60, 1e-3, 256
_WIDEST = 20  # of a log_std, either way


def gaussian_clone(
    policy: Policy, demonstrations: Demonstrations, seed: int = 0, *,
    hidden: tuple[int, ...] = HIDDEN, epochs: int = _EPOCHS,
    floor: float = PILOT.log_std_floor,
) -> Policy:  # fmt: skip
    """Fits a Gaussian policy to what another policy does in the states that it ran into.

    NPG and its kin take Gaussian heads; an expert of SAC has a squashed one, and its spread
    depends on the state. The clone's mean is fitted to the policy's mean action by least squares.
    Its spread, one number a motor, is the one of largest likelihood for the demonstrated actions:
    the root of their mean squared distance from the clone's mean. Of mean actions little is left
    but the floor; of drawn ones the clone keeps how random the policy was.

    Args:
        policy: What is cloned.
        demonstrations: Of this policy; drawn actions show more of what lies around its path.
        seed: Seed of the first weights and of the minibatches.
        hidden: Widths of the clone's hidden layers.
        epochs: How many times the demonstrations are gone through.
        floor: log_std is not below this.

    Returns:
        The clone, with the policy's card and a note.

    Raises:
        DemonstrationsError: If they are of a robot with other observations or actions.
        SettingsError: If there are no epochs, or no layers, or something is of another kind.
    """
    require("policy", policy, Policy, "Pass rvl.load_expert(name).")
    require("demonstrations", demonstrations, Demonstrations, "Record some of this policy.")
    epochs, seed = count_of("epochs", epochs, 1, f"Try {_EPOCHS}."), seed_of(seed)
    if not (are_widths(hidden) and is_number(floor) and abs(floor) <= _WIDEST):
        raise SettingsError(f"hidden = {hidden!r:.80}, floor = {floor!r:.80}",
                            f"one or more positive widths, and a number up to {_WIDEST}",
                            "Leave them out.")  # fmt: skip
    seen = demonstrations.fits(policy.observation_size, policy.action_size).observations
    net = Regressor(
        policy.observation_size, policy.action_size, hidden=hidden, learning_rate=_RATE,
        batch_size=_BATCH, rng=np.random.default_rng(seed),
    )  # fmt: skip
    net.fit(seen, policy(seen), epochs)
    spread = np.sqrt(np.square(demonstrations.actions - net.predict(seen)).mean(axis=0))
    log_std = np.log(np.maximum(spread, np.exp(floor)))
    card = dataclasses.replace(policy.card, episode_return=None,
                               note=f"A Gaussian clone, of {demonstrations.origin}.")  # fmt: skip
    return Policy(weights=_weights(net, log_std), head="gaussian", activation="tanh", card=card)


def _weights(net: Regressor, log_std: np.ndarray) -> dict[str, np.ndarray]:
    """Returns a fitted network as the arrays of an actor."""
    found = {"actor.input_shift": net.shift, "actor.input_scale": net.scale,
             "actor.output_shift": net.target_shift, "actor.output_scale": net.target_scale,
             "actor.log_std": log_std}  # fmt: skip
    for i, (weight, bias) in enumerate(networks.split(net.flat, net.sizes)):
        found |= {f"actor.{i}.weight": weight, f"actor.{i}.bias": bias}
    return {name: np.array(array, np.float32) for name, array in found.items()}
