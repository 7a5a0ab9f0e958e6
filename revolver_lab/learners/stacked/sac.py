"""Soft actor-critic for P learners at once."""

import math

import torch

from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.learners.stacked.adam import Adam
from revolver_lab.learners.stacked.algorithm import Algorithm, Batch

_LOG_STD = (-20.0, 2.0)
_TINY = 1e-6  # keeps log(1 - tanh^2) finite
_HALF_LOG_2PI = 0.5 * math.log(2 * math.pi)


class SAC(Algorithm):
    """SAC (Haarnoja et al. 2018) as stable-baselines3 has it, update for update.

    The temperature, alpha in that paper, is `ent_coef` here: fixed, or learnt by each learner
    for a target entropy of -A.
    """

    head = "squashed_gaussian"
    outputs_per_action = 2  # mean and log standard deviation

    def __init__(
        self, settings: LearnerSettings, observation_size: int, action_size: int, learners: int
    ):
        super().__init__(settings, observation_size, action_size, learners)
        self.automatic, start = initial_ent_coef(settings.ent_coef)
        self._start = math.log(start) if start > 0 else -math.inf
        self.log_ent_coef = torch.full((learners, 1), self._start, device=settings.device)
        self._adam = Adam(self.log_ent_coef, settings.learning_rate)

    def extras(self) -> dict[str, torch.Tensor]:
        """See `Algorithm.extras`: the temperatures and their optimiser."""
        adam = self._adam
        return {"log_ent_coef": self.log_ent_coef, "ent_coef_first": adam.first,
                "ent_coef_second": adam.second, "ent_coef_count": adam.count}  # fmt: skip

    def begin(self, learner: int) -> None:
        """See `Algorithm.begin`."""
        self.log_ent_coef[learner] = self._start
        self._adam.reset(learner)

    def explore(self, observation: torch.Tensor, noise: torch.Tensor) -> torch.Tensor:
        """See `Algorithm.explore`."""
        mean, log_std = self._spread(self.actor(observation))
        return torch.tanh(torch.addcmul(mean, log_std.exp(), noise))

    def _spread(self, output: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Splits an actor's output into mean and clipped log standard deviation, (P, B, A)."""
        mean, log_std = output.squeeze(1).chunk(2, dim=-1)
        return mean, log_std.clamp(*_LOG_STD)

    def act(
        self, observation: torch.Tensor, noise: torch.Tensor, *, train: bool
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns actions, (P, B, A), and their log-densities, (P, B).

        log pi(a | s) = sum_i -noise_i^2 / 2 - log std_i - log(2 pi) / 2 - log(1 - a_i^2 + 1e-6),
        with a = tanh(mean + std noise) (appendix C of Haarnoja et al. 2018).
        """
        mean, log_std = self._spread(self.actor(observation, train=train))
        action = torch.tanh(torch.addcmul(mean, log_std.exp(), noise))
        squash = torch.log(1 - action.square() + _TINY)
        density = -0.5 * noise.square() - log_std - _HALF_LOG_2PI - squash
        return action, density.sum(dim=-1)

    def update(
        self, batch: Batch, mask: torch.Tensor, actor_mask: torch.Tensor, with_actor: bool
    ) -> torch.Tensor:
        """See `Algorithm.update`; the actor learns whenever the critics do."""
        ent_coef = self.log_ent_coef.exp()
        action, log_prob = self.act(batch.observation, batch.noise[1], train=True)
        if self.automatic:
            self._warm(log_prob.detach(), mask)
        finite = self.regress(batch, self._target(batch, ent_coef), mask, weight=0.5)
        seen = torch.cat([batch.observation, action], dim=-1)
        lower = self.values(self.critic(seen)).amin(dim=1)
        self.losses["actor"] = (ent_coef * log_prob - lower).mean(dim=1)
        finite = self.actor.descend(self.losses["actor"], mask & finite) & finite
        self.critic.drag(self.settings.tau, mask & finite)
        return finite

    @torch.no_grad()
    def _target(self, batch: Batch, ent_coef: torch.Tensor) -> torch.Tensor:
        """Returns r + gamma (min Q(s', a') - ent_coef log pi(a' | s')), (P, B)."""
        action, log_prob = self.act(batch.following, batch.noise[0], train=False)
        seen = torch.cat([batch.following, action], dim=-1)
        value = self.values(self.critic.follow(seen)).amin(dim=1) - ent_coef * log_prob
        return batch.reward + batch.going_on * self.settings.gamma * value

    @torch.no_grad()
    def _warm(self, log_prob: torch.Tensor, mask: torch.Tensor) -> None:
        """Moves each temperature towards an entropy of A: loss -log_ent_coef (log pi - A)."""
        short = (log_prob - self.action_size).mean(dim=1, keepdim=True)
        self.losses["ent_coef"] = (-self.log_ent_coef * short).squeeze(1)
        self._adam.step(-short, mask & torch.isfinite(short))


def initial_ent_coef(ent_coef: float | str) -> tuple[bool, float]:
    """Returns whether a temperature is learnt, and where it starts.

    Args:
        ent_coef: A number, "auto", or "auto_0.1" to start at 0.1.

    Example:
        >>> initial_ent_coef("auto_0.1"), initial_ent_coef(0.2)
        ((True, 0.1), (False, 0.2))
    """
    if not isinstance(ent_coef, str):
        return False, float(ent_coef)
    return True, float(ent_coef.partition("_")[2] or 1.0)
