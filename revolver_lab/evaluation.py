"""How good a policy is along the whole evolution: unshaped returns, robot by robot."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.policies import Policy

if TYPE_CHECKING:
    from revolver_lab.envs.vector import RobotVectorEnv
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task

_MOST_SIMULATIONS = 32  # a model of its own for each: memory, not time, sets this


def evaluate(
    policy: Policy,
    evolve: "Evolution | str",
    alphas: Sequence[float] | float,
    episodes: int = 10,
    seed: int = 0,
    *,
    task: "str | Task | None" = None,
    deterministic: bool = True,
) -> np.ndarray:
    """Plays episodes on E(alpha) for each alpha and returns their unshaped returns.

    Episode j starts in the same way on every robot, so that robots and policies can be compared
    in pairs.

    Args:
        policy: What acts.
        evolve: The evolution, or the name of a registered one.
        alphas: Which robots, each in [0, 1].
        episodes: Episodes on each robot.
        seed: Seed of the starts, and of the actions where they are drawn.
        task: A reward of the registered robot, or a task for an evolution of your own.
        deterministic: The mean action; otherwise actions are drawn from the policy.

    Returns:
        Returns, (len(alphas), episodes).

    Raises:
        SettingsError: If there are no episodes.
        PolicyFileError: If the policy does not fit the robot.
    """
    from revolver_lab.envs.vector import make_vec_env

    if episodes < 1:
        raise SettingsError(f"episodes = {episodes}", "1 or more", "Ask for 10.")
    env = make_vec_env(evolve, min(episodes, _MOST_SIMULATIONS), task=task, seed=seed, nthread=1,
                       autoreset_mode="NextStep")  # fmt: skip
    policy.fits(env.single_observation_space.shape[0], env.single_action_space.shape[0])  # type: ignore[index]
    rng = np.random.default_rng(seed)

    def act(observation: np.ndarray) -> np.ndarray:
        return policy(observation, deterministic=deterministic, rng=rng)

    returns = [returns_on(env, act, alpha, episodes, seed) for alpha in np.atleast_1d(alphas)]
    return np.array(returns)


def returns_on(
    env: "RobotVectorEnv", act: Callable[[np.ndarray], np.ndarray], alpha: float, episodes: int,
    seed: int,
) -> np.ndarray:  # fmt: skip
    """Plays episodes on one robot and returns their unshaped returns, (episodes,).

    Args:
        env: Simulations in NextStep mode; they play in parallel, as often as is needed.
        act: Maps observations (n, O) to actions (n, A).
        alpha: The robot, in [0, 1].
        episodes: How many episodes.
        seed: Seed of the starts.
    """
    found: list[np.ndarray] = []
    while len(found) * env.num_envs < episodes:
        first = {"seed": seed, "options": {"alpha": float(alpha)}}
        observation, _ = env.reset(**({} if found else first))
        total, alive = np.zeros(env.num_envs), np.ones(env.num_envs, dtype=bool)
        while alive.any():
            observation, reward, terminated, truncated, _ = env.step(act(observation))
            total += np.where(alive, reward, 0.0)
            alive &= ~(terminated | truncated)
        found.append(total)
    return np.concatenate(found)[:episodes]
