"""Twin delayed deterministic policy gradient for P learners at once."""

import torch

from revolver_lab.learners.stacked.algorithm import Algorithm, Batch


class TD3(Algorithm):
    """TD3 (Fujimoto et al. 2018) as stable-baselines3 has it, update for update."""

    head = "tanh"
    slow_actor = True

    def explore(self, observation: torch.Tensor, noise: torch.Tensor) -> torch.Tensor:
        """See `Algorithm.explore`: the mean action and Gaussian noise, clipped."""
        action = self._act(self.actor(observation))
        return (action + self.settings.action_noise * noise).clamp(-1, 1)

    def _act(self, output: torch.Tensor) -> torch.Tensor:
        """Squashes an actor's output, (P, 1, B, A) -> (P, B, A)."""
        return torch.tanh(output.squeeze(1))

    def update(
        self, batch: Batch, mask: torch.Tensor, actor_mask: torch.Tensor, with_actor: bool
    ) -> torch.Tensor:
        """See `Algorithm.update`; the actor and all targets move every `policy_delay` steps."""
        finite = self.regress(batch, self._target(batch), mask, weight=1.0)
        if with_actor:
            action = self._act(self.actor(batch.observation, train=True))
            seen = torch.cat([batch.observation, action], dim=-1)
            self.losses["actor"] = -self.values(self.critic(seen))[:, 0].mean(dim=1)
            moving = actor_mask & mask & finite
            finite = self.actor.descend(self.losses["actor"], moving) & finite
            for networks in (self.critic, self.actor):
                networks.drag(self.settings.tau, moving & finite)
        return finite

    @torch.no_grad()
    def _target(self, batch: Batch) -> torch.Tensor:
        """Returns r + gamma min Q(s', a' + clipped noise), (P, B)."""
        limit = self.settings.target_noise_clip
        noise = (self.settings.target_noise * batch.noise[0]).clamp(-limit, limit)
        action = (self._act(self.actor.follow(batch.following)) + noise).clamp(-1, 1)
        seen = torch.cat([batch.following, action], dim=-1)
        value = self.values(self.critic.follow(seen)).amin(dim=1)
        return batch.reward + batch.going_on * self.settings.gamma * value
