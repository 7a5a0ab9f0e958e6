"""A policy without torch: arrays, a numpy forward pass, and a card that says where from."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from revolver_lab.actors import actor_problem
from revolver_lab.cards import ModelCard
from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.files import output_file, write_json
from revolver_lab.weights import count_layers, load_weights, refusal, save_weights

HEADS = ("squashed_gaussian", "tanh", "gaussian")
ACTIVATIONS = {"relu": lambda x: np.maximum(x, 0), "tanh": np.tanh}
LOG_STD_RANGE = (-20.0, 2.0)  # stable-baselines3's clip of the squashed Gaussian's log std
_SPREADS = {"actor.log_std", "actor.log_std.weight"}
_FORMAT = "revolver_lab.policy/1"


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Policy:
    """A multilayer perceptron that maps observations to actions in [-1, 1].

    Attributes:
        weights: Arrays by name. The actor is `actor.0.weight` (out, in), `actor.0.bias`, ...,
            one pair per layer, the last one the mean; `actor.log_std.weight` and `.bias` where
            the spread depends on the state, or `actor.log_std` alone where it does not; and,
            optionally, `actor.input_shift`, `input_scale`, `output_shift`, `output_scale`.
            A critic may travel along: `critic.K.I.weight` for layer I of twin K, with
            `critic.K.I.norm.weight` where LayerNorm follows the layer, and `critic_target.*`.
        head: "squashed_gaussian" (SAC), "tanh" (TD3), or "gaussian" (NPG; clipped to [-1, 1]).
        activation: "relu" or "tanh", between the layers of actor and critic alike.
        card: Where the policy comes from.

    Example:
        >>> weights = {"actor.0.weight": np.eye(2, 3), "actor.0.bias": np.zeros(2)}
        >>> policy = Policy(weights=weights, head="tanh")
        >>> policy(np.array([0.0, 100.0, 5.0]))
        array([0., 1.])
    """

    weights: Mapping[str, np.ndarray]
    head: str = "squashed_gaussian"
    activation: str = "relu"
    card: ModelCard = dataclasses.field(default_factory=ModelCard)

    def __post_init__(self) -> None:
        """Refuses weights that cannot act."""
        _check(self)

    def __repr__(self) -> str:
        """Says what it is, without its weights."""
        sizes = f"{self.observation_size} observations, {self.action_size} actions"
        return f"Policy({sizes}, {self.head}, {self.activation}, from {self.card.algorithm or '?'})"

    @property
    def layers(self) -> int:
        """Returns the number of linear layers of the actor."""
        return count_layers(self.weights, "actor")

    @property
    def observation_size(self) -> int:
        """Returns O, the length of an observation."""
        return self.weights["actor.0.weight"].shape[1]

    @property
    def action_size(self) -> int:
        """Returns A, the length of an action."""
        return self.weights[f"actor.{self.layers - 1}.weight"].shape[0]

    def parameters(self) -> dict[str, np.ndarray]:
        """Returns a copy of every array by name."""
        return {name: np.array(value) for name, value in self.weights.items()}

    def __call__(
        self,
        observation: np.ndarray,
        *,
        deterministic: bool = True,
        rng: np.random.Generator | None = None,
    ) -> np.ndarray:
        """Acts.

        Args:
            observation: (O,) or (n, O).
            deterministic: The mean action; otherwise one drawn from the policy.
            rng: The stream to draw from, needed when not deterministic.

        Returns:
            Actions in [-1, 1], (A,) or (n, A).

        Raises:
            SettingsError: If an action is to be drawn and no stream is given.
        """
        mean, log_std = self._distribution(np.asarray(observation))
        if not deterministic and log_std is not None:
            if rng is None:
                raise SettingsError(
                    "rng = None with deterministic = False",
                    "a np.random.Generator",
                    "Pass rng=np.random.default_rng(0).",
                )
            mean = mean + np.exp(log_std) * rng.standard_normal(mean.shape).astype(mean.dtype)
        return np.clip(mean, -1, 1) if self.head == "gaussian" else np.tanh(mean)

    def _distribution(self, observation: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Returns mean and log standard deviation before the squashing, (..., A) each."""
        weights, last = self.weights, self.layers - 1
        x = observation.astype(weights["actor.0.weight"].dtype, copy=False)
        if "actor.input_shift" in weights:
            x = (x - weights["actor.input_shift"]) / weights["actor.input_scale"]
        for i in range(last):
            x = ACTIVATIONS[self.activation](_linear(weights, f"actor.{i}", x))
        mean = _linear(weights, f"actor.{last}", x)
        if "actor.output_shift" in weights:
            mean = mean * weights["actor.output_scale"] + weights["actor.output_shift"]
        if "actor.log_std.weight" in weights:
            return mean, np.clip(_linear(weights, "actor.log_std", x), *LOG_STD_RANGE)
        return mean, weights.get("actor.log_std")

    def with_card(self, card: ModelCard) -> "Policy":
        """Returns the same policy under another card."""
        return dataclasses.replace(self, card=card)

    def without_critic(self) -> "Policy":
        """Returns the actor alone."""
        actor = {k: v for k, v in self.weights.items() if k.startswith("actor.")}
        return dataclasses.replace(self, weights=actor)

    def fits(self, observation_size: int, action_size: int) -> "Policy":
        """Returns the policy itself if it fits a robot of these sizes.

        Raises:
            PolicyFileError: If it does not.
        """
        mine = self.observation_size, self.action_size
        if mine != (observation_size, action_size):
            raise PolicyFileError(
                f"a policy of {mine[0]} observations and {mine[1]} actions",
                f"{observation_size} observations and {action_size} actions",
                "Load the expert of this robot, or lift one by policy.lifted(...).",
            )
        return self

    def lifted(
        self, observation_columns: Sequence[int] | np.ndarray, observation_size: int,
        action_rows: Sequence[int] | np.ndarray, action_size: int,
    ) -> "Policy":  # fmt: skip
        """Returns the policy of a padded robot by zero insertion (section 4.1).

        What was created is neither looked at nor moved: new observations have zero weights,
        new actions have mean zero.

        Args:
            observation_columns: Where each old observation stands in the new one, (O,).
            observation_size: Length of the new observation.
            action_rows: Where each old action stands in the new one, (A,).
            action_size: Length of the new action.
        """
        from revolver_lab.lifting import lift_weights

        weights = lift_weights(
            self.weights, self.layers, np.asarray(observation_columns), observation_size,
            np.asarray(action_rows), action_size,
        )  # fmt: skip
        return dataclasses.replace(self, weights=weights)

    def save(self, path: str | Path) -> Path:
        """Saves the policy as safetensors, its card beside it as JSON; returns the former's path.

        The card travels inside the safetensors file, which alone is read back: a process killed
        between the two files leaves a policy and its own card. The JSON is for people.

        Args:
            path: Name of the safetensors file; its ending is put on if there is none.

        Raises:
            SettingsError: If that is no name of a file, or that of the card.
        """
        path, card = output_file(path, ".safetensors"), self.card.to_json()
        if path.suffix == ".json":  # the card's
            raise SettingsError(f"{str(path)!r} for a policy", ".safetensors", "Leave it out.")
        save_weights(path, self.weights, {
            "format": _FORMAT, "head": self.head, "activation": self.activation,
            "card": json.dumps(card, sort_keys=True),
        })  # fmt: skip
        write_json(path.with_suffix(".json"), card)
        return path

    @classmethod
    def load(cls, path: str | Path) -> "Policy":
        """Loads a policy; nothing in the file is ever executed.

        Args:
            path: A file that `save` wrote.

        Raises:
            PolicyFileError: If the file is missing, torn, altered, or of another kind.
        """
        weights, metadata = load_weights(path)
        if metadata.get("format") != _FORMAT:
            raise refusal(path, f"has the format {metadata.get('format')!r}")
        try:
            card = json.loads(metadata.get("card", "null"))
        except (ValueError, RecursionError) as error:
            raise refusal(path, "has a card that is not JSON") from error
        head, activation = metadata.get("head", ""), metadata.get("activation", "")
        return cls(weights=weights, head=head, activation=activation,
                   card=ModelCard.from_json(card, path=str(path)))  # fmt: skip


def _linear(weights: Mapping[str, np.ndarray], name: str, x: np.ndarray) -> np.ndarray:
    """Applies one layer, x W^T + b."""
    return x @ weights[f"{name}.weight"].T + weights[f"{name}.bias"]


def _check(policy: Policy) -> None:
    """Refuses a policy whose head, activation, shapes or numbers cannot act."""
    problem = actor_problem(policy.weights)
    if policy.head not in HEADS:
        problem = f"the head {policy.head!r}, not one of {HEADS}"
    elif policy.activation not in ACTIVATIONS:
        problem = f"the activation {policy.activation!r}, not one of {tuple(ACTIVATIONS)}"
    elif policy.head == "squashed_gaussian" and not _SPREADS & {*policy.weights}:
        problem = problem or "a squashed Gaussian without actor.log_std"
    if problem:
        raise PolicyFileError(f"a policy with {problem}", "weights as Policy describes them",
                              "Convert the model by revolver_lab.learners.from_sb3.")  # fmt: skip
