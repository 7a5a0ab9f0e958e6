"""What SAC and TD3 share: an actor, twin critics, and one update of every learner at once."""

import abc
from typing import NamedTuple

import torch

from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.learners.stacked.layout import mlp
from revolver_lab.learners.stacked.networks import Networks


class Batch(NamedTuple):
    """One batch of each learner, and the noise drawn for it.

    Attributes:
        observation: (P, B, O).
        action: (P, B, A), in [-1, 1].
        reward: (P, B), shaped.
        following: Next observations, (P, B, O).
        going_on: 1 where the episode goes on, 0 where it terminated, (P, B).
        noise: Standard normal numbers, (2, P, B, A): for the next action and for this one.
    """

    observation: torch.Tensor
    action: torch.Tensor
    reward: torch.Tensor
    following: torch.Tensor
    going_on: torch.Tensor
    noise: torch.Tensor


class Algorithm(abc.ABC):
    """P actors and their critics.

    Args:
        settings: Shared by all learners.
        observation_size: O.
        action_size: A.
        learners: P.

    Attributes:
        actor: The P actors.
        critic: Their twin critics and the slow copies of these.
        losses: The latest loss of each learner by name, (P,) each.
        head: What `Policy` calls this kind of actor.
    """

    head = ""
    outputs_per_action = 1
    slow_actor = False

    def __init__(
        self, settings: LearnerSettings, observation_size: int, action_size: int, learners: int
    ):
        self.settings, self.action_size = settings, action_size
        device, rate = settings.device, settings.learning_rate
        outputs = self.outputs_per_action * action_size
        self.actor = Networks(
            mlp([observation_size, *settings.hidden, outputs], norm=False), learners, rate,
            target=self.slow_actor, device=device,
        )  # fmt: skip
        self.critic = Networks(
            mlp([observation_size + action_size, *settings.hidden, 1], norm=settings.layer_norm),
            learners, rate, twins=2, target=True, device=device,
        )  # fmt: skip
        self.losses: dict[str, torch.Tensor] = {}

    def parts(self) -> dict[str, Networks]:
        """Returns the networks by name."""
        return {"actor": self.actor, "critic": self.critic}

    def extras(self) -> dict[str, torch.Tensor]:
        """Returns whatever else is learnt, live, by name."""
        return {}

    def begin(self, learner: int) -> None:  # noqa: B027
        """Puts what else is learnt by one learner at its start."""

    @abc.abstractmethod
    def explore(self, observation: torch.Tensor, noise: torch.Tensor) -> torch.Tensor:
        """Draws actions a ~ pi(. | s).

        Args:
            observation: (P, S, O).
            noise: Standard normal numbers, (P, S, A).

        Returns:
            Actions in [-1, 1], (P, S, A).
        """

    @abc.abstractmethod
    def update(
        self, batch: Batch, mask: torch.Tensor, actor_mask: torch.Tensor, with_actor: bool
    ) -> torch.Tensor:
        """Takes one gradient step of every learner, on its own batch.

        Args:
            batch: One batch a learner.
            mask: Who learns, (P, 1) bool; the others stay as they are.
            actor_mask: Whose actor learns too, (P, 1) bool.
            with_actor: Whether any does; a plain bool, so that it can choose a captured graph.

        Returns:
            Whose numbers are finite, (P, 1) bool; a step that is not finite is not taken.
        """

    def values(self, networks_output: torch.Tensor) -> torch.Tensor:
        """Drops the critics' output axis: (P, 2, B, 1) -> (P, 2, B)."""
        return networks_output.squeeze(-1)

    def regress(
        self, batch: Batch, target: torch.Tensor, mask: torch.Tensor, weight: float
    ) -> torch.Tensor:
        """Fits both critics to their target, and says whose gradients are finite.

        Args:
            batch: One batch a learner.
            target: What Q(s, a) should be, (P, B).
            mask: Who learns, (P, 1) bool.
            weight: Factor on the sum of both mean squared errors.
        """
        seen = torch.cat([batch.observation, batch.action], dim=-1)
        error = self.values(self.critic(seen, train=True)) - target[:, None]
        self.losses["critic"] = weight * error.square().mean(dim=2).sum(dim=1)
        return self.critic.descend(self.losses["critic"], mask)
