"""Where demonstrations come from: a policy that is watched, or Minari's datasets."""

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from revolver_lab.demonstrations import Demonstrations, refusal
from revolver_lab.errors import DemonstrationsError, MissingExtraError
from revolver_lab.given import count_of, require, seed_of
from revolver_lab.policies import Policy
from revolver_lab.trajectories import Success, Trajectories, sample

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task

_SIDE_BY_SIDE = 10  # episodes recorded at a time


def record(
    policy: Policy, evolve: "Evolution | str", episodes: int = 10, *, alpha: float = 0.0,
    seed: int = 0, task: "str | Task | None" = None, deterministic: bool = True,
    success: Success | None = None,
) -> Demonstrations:  # fmt: skip
    """Records episodes of a policy on E(alpha).

    Args:
        policy: The teacher.
        evolve: The evolution, or the name of a registered one.
        episodes: How many to record.
        alpha: The robot, in [0, 1].
        seed: Seed of the starts, and of the actions where they are drawn.
        task: A reward of the registered robot, or a task for an evolution of your own.
        deterministic: The mean action; otherwise actions are drawn from the policy.
        success: Keep only the episodes that succeeded; None keeps all.

    Raises:
        SettingsError: If there are no episodes.
        DemonstrationsError: If none of them succeeded.
        PolicyFileError: If the policy does not fit the robot.
    """
    from revolver_lab.envs.vector import make_vec_env

    require("policy", policy, Policy, "Pass rvl.load_expert(name), or Policy.load(path).")
    require("success", success, (Success, type(None)), "Success() keeps those of the task's goal.")
    seed = seed_of(seed)
    episodes = count_of("episodes", episodes, 1, "Ask for 10.")
    n = min(episodes, _SIDE_BY_SIDE)
    env = make_vec_env(evolve, n, alphas=alpha, task=task, seed=seed, autoreset_mode="NextStep")
    policy.fits(env.observation_space.shape[1], env.action_space.shape[1])  # type: ignore[index]
    rng = np.random.default_rng(seed)
    kept: list[dict[str, np.ndarray]] = []
    for at in range(0, episodes, n):
        played = sample(env, lambda _, seen: policy(seen, deterministic=deterministic, rng=rng),
                        env.task.episode_steps)  # fmt: skip
        good = np.ones(n, bool) if success is None else success.check(env.task)(env, played)
        kept += [_episode(played, int(i)) for i in np.flatnonzero(good[: episodes - at])]
    if not kept:
        raise refusal(f"{episodes} episodes of which none succeeded")
    origin = f"{len(kept)} of {episodes} episodes of {policy.card.algorithm or 'a policy'} on " \
             f"{env.evolve.name} at alpha = {alpha:g}, seed {seed}"  # fmt: skip
    return Demonstrations(**{k: np.concatenate([e[k] for e in kept]) for k in kept[0]},
                          origin=origin)  # fmt: skip


def _episode(played: Trajectories, i: int) -> dict[str, np.ndarray]:
    """Returns the transitions of one trajectory."""
    steps = int(played.lengths[i])
    seen = played.observations[: steps + 1, i]
    return {"lengths": np.array([steps]), "observations": seen[:-1],
            "actions": played.actions[:steps, i], "next_observations": seen[1:],
            "rewards": played.rewards[:steps, i]}  # fmt: skip


def from_minari(dataset: Any, episodes: Sequence[int] | None = None) -> Demonstrations:
    """Reads a Minari dataset, D4RL's human demonstrations of the hand for example.

    Args:
        dataset: The name of a dataset, "D4RL/door/human-v2", which is downloaded if it is not on
            this machine; or a MinariDataset.
        episodes: Which episodes; None is all.

    Raises:
        MissingExtraError: If Minari is not installed.
        DemonstrationsError: If there is no such dataset, or its spaces are no boxes of vectors.
    """
    if isinstance(dataset, str):
        dataset = _load(dataset)
    if not hasattr(dataset, "iterate_episodes"):
        raise DemonstrationsError(f"a {type(dataset).__name__}", "a MinariDataset, or its name",
                                  "Try 'D4RL/door/human-v2'.")  # fmt: skip
    origin = dataset.spec.dataset_id
    kept = [_read(episode) for episode in dataset.iterate_episodes(episodes)]
    if not kept:
        raise refusal(f"the dataset {origin!r} without episodes")
    return Demonstrations(**{k: np.concatenate([e[k] for e in kept]) for k in kept[0]},
                          origin=f"Minari's {origin}")  # fmt: skip


def _load(name: str) -> Any:
    """Returns a MinariDataset by name."""
    try:
        minari = importlib.import_module("minari")
        return minari.load_dataset(name, download=True)
    except ImportError as error:
        raise MissingExtraError(f"Minari missing ({error})", "the extra 'demos'",
                                "pip install 'revolver-lab[demos]'") from error  # fmt: skip
    except Exception as error:  # Minari answers with its own, its storage's and the network's
        raise DemonstrationsError(
            f"dataset {name!r}: {type(error).__name__}: {str(error)[:120]}",
            "a Minari dataset that is on this machine or can be downloaded",
            "See minari.farama.org for names, and MINARI_DATASETS_PATH for the folder.",
        ) from error


def _read(episode: Any) -> dict[str, np.ndarray]:
    """Returns the transitions of one episode, which has one observation more than actions."""
    seen, actions = episode.observations, episode.actions
    if not (isinstance(seen, np.ndarray) and seen.ndim == 2 and isinstance(actions, np.ndarray)):
        raise refusal(f"observations of type {type(seen).__name__}")
    return {"lengths": np.array([len(actions)]), "observations": seen[:-1], "actions": actions,
            "next_observations": seen[1:], "rewards": episode.rewards}  # fmt: skip
