"""A replay whose transitions know the robot they came from, so that it can be cleaned."""

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples

from revolver_lab import shaping as _shaping
from revolver_lab.errors import SettingsError


class TaggedReplay(ReplayBuffer):
    """stable-baselines3's replay, tagged with beta.

    Rewards are stored as the robot earned them; exp(h beta) (equation 5 of the paper, line 22 of
    Algorithm 1) multiplies them when they are sampled. Cleaning keeps an interval of beta and
    moves what is kept together, in the order it came; whatever is left can be sampled, with
    replacement, however little it is.

    Args:
        buffer_size: Transitions it holds at most, over all simulations.
        observation_space: A Box, (O,).
        action_space: A Box, (A,).
        device: Where samples go.
        n_envs: Simulations that bring one transition each per `add`.
        optimize_memory_usage: Not supported; must stay False.
        handle_timeout_termination: Whether an episode that ran out of time counts as unfinished.
        shaping: h in the paper.
        seed: Seed of the sampling.

    Attributes:
        alpha: Of the phase, for the forms of shaping that ask for it.
        xi: Likewise.
        shaping_form: See `revolver_lab.shaping`.
    """

    def __init__(
        self,
        buffer_size: int,
        observation_space: spaces.Space,
        action_space: spaces.Space,
        device: torch.device | str = "auto",
        n_envs: int = 1,
        optimize_memory_usage: bool = False,
        handle_timeout_termination: bool = True,
        shaping: float = 0.0,
        seed: int | np.random.SeedSequence | None = None,
    ):
        if optimize_memory_usage:
            raise SettingsError("optimize_memory_usage = True", "False",
                                "Lower buffer_size instead: cleaning moves rows.")  # fmt: skip
        super().__init__(buffer_size, observation_space, action_space, device, 1,
                         optimize_memory_usage, handle_timeout_termination)  # fmt: skip
        self.simulations = n_envs
        self.shaping, self.shaping_form = shaping, "absolute"
        self.alpha, self.xi = 0.0, 0.0
        self.betas = np.zeros(self.buffer_size)  # float64: the interval's ends are compared exactly
        self.rng = np.random.default_rng(seed)

    def add(
        self, obs: np.ndarray, next_obs: np.ndarray, action: np.ndarray, reward: np.ndarray,
        done: np.ndarray, infos: list[dict[str, Any]],
    ) -> None:  # fmt: skip
        """Stores one transition of each simulation; beta is read from infos[i]["alpha"].

        Args:
            obs: Observations before the step, (n, O).
            next_obs: Observations after it, (n, O), of the episode that ends if one does.
            action: Actions in [-1, 1], (n, A).
            reward: Unshaped rewards, (n,).
            done: Whether the episode ended, (n,).
            infos: One dictionary a simulation.
        """
        betas = np.array([info.get("alpha", 0.0) for info in infos])
        timeout = np.array([info.get("TimeLimit.truncated", False) for info in infos])
        over = np.asarray(done) & ~(timeout & self.handle_timeout_termination)
        self.extend(obs, next_obs, action, reward, over, betas)

    def extend(
        self, obs: np.ndarray, next_obs: np.ndarray, action: np.ndarray, reward: np.ndarray,
        terminated: np.ndarray, betas: np.ndarray,
    ) -> None:  # fmt: skip
        """Stores n transitions; `terminated` says which have no future, `betas` whose they are."""
        rows = (self.pos + np.arange(len(reward))) % self.buffer_size
        self.observations[rows, 0] = obs
        self.next_observations[rows, 0] = next_obs
        self.actions[rows, 0] = action
        self.rewards[rows, 0] = reward
        self.dones[rows, 0] = terminated
        self.betas[rows] = betas
        self.full |= self.pos + len(reward) >= self.buffer_size
        self.pos = (self.pos + len(reward)) % self.buffer_size

    def clean(self, low: float, high: float, latest: int | None = None) -> int:
        """Keeps the transitions with beta in [low, high] (Algorithm 1, line 31).

        Args:
            low: Lower end, included.
            high: Upper end, included.
            latest: Keep this many at most, the latest; None keeps all of the interval.

        Returns:
            How many transitions are left.
        """
        order = np.arange(self.pos)
        if self.full:
            order = np.concatenate([np.arange(self.pos, self.buffer_size), order])
        kept = order[(self.betas[order] >= low) & (self.betas[order] <= high)]
        if latest is not None:
            kept = kept[max(len(kept) - latest, 0) :]
        if len(kept) < self.buffer_size:
            for array in (self.observations, self.next_observations, self.actions, self.rewards,
                          self.dones, self.betas):  # fmt: skip
                array[: len(kept)] = array[kept]
            self.pos, self.full = len(kept), False
        return len(kept)

    def sample(self, batch_size: int, env: Any = None) -> ReplayBufferSamples:
        """Samples transitions uniformly, with replacement, their rewards shaped.

        Args:
            batch_size: How many.
            env: Not used; a VecNormalize has no place in this loop.
        """
        return self._get_samples(self.rng.integers(0, self.size(), size=batch_size), env)

    def _get_samples(self, batch_inds: np.ndarray, env: Any = None) -> ReplayBufferSamples:
        """Returns the transitions at these rows; r' = r exp(h beta), or another form of it."""
        betas = self.betas[batch_inds, None]
        shaped = self.rewards[batch_inds] * _shaping.weight(
            betas, self.alpha, self.xi, self.shaping, self.shaping_form
        )
        arrays = (
            self.observations[batch_inds, 0], self.actions[batch_inds, 0],
            self.next_observations[batch_inds, 0], self.dones[batch_inds],
            shaped.astype(np.float32),
        )  # fmt: skip
        return ReplayBufferSamples(
            *(torch.as_tensor(array, device=self.device) for array in arrays)
        )
