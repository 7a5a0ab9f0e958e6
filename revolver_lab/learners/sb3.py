"""stable-baselines3's off-policy algorithms as learners that Algorithm 1 can drive."""

from typing import Any, cast

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import DDPG, DQN, SAC, TD3
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from torch import nn

from revolver_lab.cards import ModelCard
from revolver_lab.errors import SettingsError
from revolver_lab.learners.convert import from_sb3, to_sb3
from revolver_lab.learners.replay import TaggedReplay
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.methods import Member, Method
from revolver_lab.policies import Policy

ALGORITHMS: dict[str, type[OffPolicyAlgorithm]] = {"SAC": SAC, "TD3": TD3, "DDPG": DDPG}


class Sb3Learner:
    """One learner: a stable-baselines3 model with a replay that is tagged with beta.

    Args:
        settings: What it is made of.
        observation_size: O.
        action_size: A.
        member: Its method, and the seed of weights, exploration and sampling.

    Attributes:
        model: The stable-baselines3 model.
        broken: Whether its numbers are no longer finite, (1,) bool.
    """

    def __init__(
        self, settings: LearnerSettings, observation_size: int, action_size: int, member: Member
    ):
        torch.set_num_threads(1)  # two one-thread processes beat one process with two threads
        self.settings = settings
        self.method: Method = member.method
        self.adopted, self._started = False, False
        schedule = member.method.schedule
        self.model = build(settings, observation_size, action_size, shaping=schedule.shaping,
                           seed=member.seed)  # fmt: skip
        self.replay.xi, self.replay.shaping_form = schedule.xi, schedule.shaping_form
        self.broken = np.zeros(1, dtype=bool)
        self._rng = np.random.default_rng(np.random.SeedSequence(member.seed, spawn_key=(1,)))

    @property
    def replay(self) -> TaggedReplay:
        """Returns the model's replay."""
        return cast(TaggedReplay, self.model.replay_buffer)  # build() made it so

    def adopt(self, p: int, expert: Policy) -> None:
        """Takes over the expert's actor, critics and targets, under fresh optimisers."""
        size, width = self.model.observation_space.shape, self.model.action_space.shape
        expert.fits(size[0], width[0])  # type: ignore[index]
        carried = expert if self.method.critic == "carried" else expert.without_critic()
        to_sb3(carried, self.model)
        self.adopted = True

    def enter(self, p: int, alpha: float) -> int:
        """Begins a phase: cleans the replay (line 31), renews Adam if asked."""
        self.replay.alpha = alpha
        if self.method.optimiser == "fresh":
            for part in (self.model.policy.actor, self.model.policy.critic):
                cast(Any, part).optimizer.state.clear()
        schedule = self.method.schedule
        return self.replay.clean(*schedule.kept(alpha), schedule.latest)

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Draws a ~ pi(. | s) (line 19 of Algorithm 1); uniform until a scratch run has begun.

        Args:
            observation: (n, O).

        Returns:
            Actions in [-1, 1], (n, A) float32.
        """
        if not self.adopted and not self._started:
            shape = (len(observation), *self.model.action_space.shape)  # type: ignore[misc]
            return self._rng.uniform(-1, 1, shape).astype(np.float32)
        action, _ = self.model.predict(observation, deterministic=False)
        if self.model.action_noise is not None:
            noise = [self.model.action_noise() for _ in action]
            action = np.clip(action + np.stack(noise), -1, 1)
        return action.astype(np.float32)

    def store(
        self, moved: np.ndarray, observation: np.ndarray, action: np.ndarray, reward: np.ndarray,
        following: np.ndarray, terminated: np.ndarray, betas: np.ndarray,
    ) -> None:  # fmt: skip
        """Puts what moved into the replay (line 23), rewards as earned; see `TaggedReplay`."""
        parts = (observation, following, action, reward, terminated, betas)
        self.replay.extend(*(array[moved] for array in parts))
        self.model.num_timesteps += int(moved.sum())

    def update(self, active: np.ndarray) -> None:
        """Trains on samples of the replay (lines 24 and 25), once enough has been seen.

        After that it never waits again: a replay that the cleaning has emptied is sampled as
        soon as it holds anything, for a pause would cripple some variants and not others.
        """
        self._started = self._started or self.replay.size() >= self.settings.learning_starts
        if active[0] and self._started and self.replay.size() > 0:
            self.model.train(self.settings.updates, self.settings.batch_size)

    def policy(self, p: int = 0, card: ModelCard | None = None) -> Policy:
        """Returns a copy of what has been learnt so far, critic included."""
        return from_sb3(self.model, card)


def build(
    settings: LearnerSettings, observation_size: int, action_size: int, *,
    shaping: float = 0.0, seed: int = 0,
) -> OffPolicyAlgorithm:  # fmt: skip
    """Builds a stable-baselines3 model that needs no environment of its own.

    Args:
        settings: What it is made of.
        observation_size: O.
        action_size: A.
        shaping: h in the paper, for the replay.
        seed: Seed of weights, exploration and sampling.

    Raises:
        SettingsError: If the algorithm is none of stable-baselines3's off-policy ones.
    """
    kind = cast(Any, _kind(settings))
    arguments: dict[str, Any] = {
        "learning_rate": settings.learning_rate, "buffer_size": settings.buffer_size,
        "batch_size": settings.batch_size, "tau": settings.tau, "gamma": settings.gamma,
        "seed": seed, "device": "cpu", "replay_buffer_class": TaggedReplay,
        "replay_buffer_kwargs": {"shaping": shaping, "seed": np.random.SeedSequence(seed)},
        "policy_kwargs": {"net_arch": list(settings.hidden),
                          "optimizer_kwargs": {"fused": True}},  # the same Adam in one kernel
    }  # fmt: skip
    if issubclass(kind, SAC):
        arguments["ent_coef"] = settings.ent_coef
        arguments["target_entropy"] = -float(action_size)
    if issubclass(kind, TD3):
        noise = np.full(action_size, settings.action_noise)
        arguments["action_noise"] = NormalActionNoise(np.zeros(action_size), noise)
    policy: Any = kind.policy_aliases["MlpPolicy"]
    policy = with_layer_norm(policy) if settings.layer_norm else policy
    arguments |= dict(settings.options)
    arguments["_init_setup_model"] = False
    model: OffPolicyAlgorithm = kind(policy, cast(Any, None), **arguments)
    model.observation_space = spaces.Box(-np.inf, np.inf, (observation_size,), np.float32)
    model.action_space = spaces.Box(-1, 1, (action_size,), np.float32)
    model.n_envs = settings.simulations
    model._setup_model()  # as stable-baselines3's own load() does
    model._logger = Logger(None, [])
    return model


def _kind(settings: LearnerSettings) -> type[OffPolicyAlgorithm]:
    """Returns the class that the settings name."""
    given = settings.algorithm
    kind: Any = ALGORITHMS.get(given) if isinstance(given, str) else given
    fits = isinstance(kind, type) and issubclass(kind, OffPolicyAlgorithm)
    if not fits or issubclass(kind, DQN):  # DQN's actions are discrete
        raise SettingsError(
            f"algorithm = {settings.name!r}",
            f"{sorted(ALGORITHMS)}, or a class derived from stable-baselines3's "
            "OffPolicyAlgorithm for continuous actions",
            "Take SAC.",
        )
    return kind


def with_layer_norm(policy_class: type) -> type:
    """Returns a policy class whose critics normalise each hidden layer before its activation."""

    class LayerNormCritics(policy_class):
        """The same policy with LayerNorm in its critics."""

        def make_critic(self, features_extractor: nn.Module | None = None) -> nn.Module:
            """Builds a critic and inserts the normalisations."""
            critic = super().make_critic(features_extractor)
            for twin, network in enumerate(critic.q_networks):
                modules = [*network]
                for i in reversed(range(len(modules) - 1)):
                    if isinstance(modules[i], nn.Linear):
                        modules.insert(i + 1, nn.LayerNorm(modules[i].out_features))
                critic.q_networks[twin] = nn.Sequential(*modules).to(self.device)
                setattr(critic, f"qf{twin}", critic.q_networks[twin])
            return critic

    return LayerNormCritics
