"""How good a policy is along the whole evolution: unshaped returns, robot by robot."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.evolution.evolution import checked_alpha
from revolver_lab.given import count_of, require, seed_of
from revolver_lab.policies import Policy

if TYPE_CHECKING:
    from revolver_lab.envs.vector import RobotVectorEnv
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task

MOST_EPISODES = 10**9
"""More would take years, and their returns more memory than there is."""
_MOST_SIMULATIONS = 256  # a model of its own for each: memory, not time, sets this
_MOST_STARTS = 32  # episodes beyond these go on with the streams of the first


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

    All robots play side by side. Episode j starts in the same way on every robot, so that robots
    and policies can be compared in pairs.

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
    return _along(policy, evolve, alphas, episodes, seed, task, deterministic)[0]


def evaluate_success(
    policy: Policy, evolve: "Evolution | str", alphas: Sequence[float] | float, episodes: int = 10,
    seed: int = 0, *, task: "str | Task | None" = None, deterministic: bool = True,
) -> np.ndarray:  # fmt: skip
    """Plays episodes on E(alpha) for each alpha and says which of them succeeded.

    They are the episodes that `evaluate` plays; see there for the arguments.

    Returns:
        Successes, (len(alphas), episodes) bool.

    Raises:
        SettingsError: If there are no episodes, or the task has no goal.
        PolicyFileError: If the policy does not fit the robot.
    """
    return evaluate_both(policy, evolve, alphas, episodes, seed, task=task,
                         deterministic=deterministic)[1]  # fmt: skip


def evaluate_both(
    policy: Policy, evolve: "Evolution | str", alphas: Sequence[float] | float, episodes: int = 10,
    seed: int = 0, *, task: "str | Task | None" = None, deterministic: bool = True,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Plays episodes once, for both what `evaluate` and what `evaluate_success` return.

    Returns:
        Unshaped returns, and bool successes, each (len(alphas), episodes).

    Raises:
        SettingsError: If there are no episodes, or the task has no goal.
        PolicyFileError: If the policy does not fit the robot.
    """
    from revolver_lab.envs.core import Stage

    told = Stage(evolve, task).task
    if told.goal_steps is None:
        raise SettingsError(f"the success of {type(told).__name__}, which has no goal",
                            "a task with success() and goal_steps", "Look at returns.")  # fmt: skip
    returns, won = _along(policy, evolve, alphas, episodes, seed, task, deterministic)
    return returns, won.astype(bool)


def _along(
    policy: Policy, evolve: "Evolution | str", alphas: Sequence[float] | float, episodes: int,
    seed: int, task: "str | Task | None", deterministic: bool,
) -> np.ndarray:  # fmt: skip
    """Plays a policy on several robots, as many side by side as memory has room for."""
    require("policy", policy, Policy, "Pass rvl.load_expert(name), or Policy.load(path).")
    seed = seed_of(seed)
    robots = np.array([checked_alpha(alpha) for alpha in np.atleast_1d(alphas)])
    episodes = count_of("episodes", episodes, 1, "Ask for 10.", most=MOST_EPISODES)
    side_by_side = max(_MOST_SIMULATIONS // min(episodes, _MOST_STARTS), 1)
    played = [np.empty((2, 0, episodes))]
    for i in range(0, len(robots), side_by_side):
        some = robots[i : i + side_by_side]
        played.append(_play([policy] * len(some), evolve, some, episodes, [seed] * len(some), task,
                            deterministic))  # fmt: skip
    return np.concatenate(played, axis=1)


def evaluate_each(
    policies: Sequence[Policy],
    evolve: "Evolution | str",
    alpha: float,
    episodes: int,
    seeds: Sequence[int],
    *,
    task: "str | Task | None" = None,
    nthread: int = 0,
) -> np.ndarray:
    """Plays episodes of several policies on one robot, side by side.

    Args:
        policies: What acts, by mean actions.
        evolve: The evolution, or the name of a registered one.
        alpha: The robot, in [0, 1].
        episodes: Episodes of each policy.
        seeds: Seed of each policy's starts; what a policy meets does not depend on its company.
        task: As in `evaluate`.
        nthread: Threads of the physics; 0 for one per CPU. Results do not depend on it.

    Returns:
        Unshaped returns, (len(policies), episodes).
    """
    most = max(_MOST_SIMULATIONS // min(episodes, _MOST_STARTS), 1)
    played = []
    for i in range(0, len(policies), most):
        some = policies[i : i + most]
        alphas = np.full(len(some), float(alpha))
        part = seeds[i : i + most]
        played.append(_play(some, evolve, alphas, episodes, part, task, True, nthread)[0])
    return np.concatenate(played)


def episodes_played(episodes: int) -> int:
    """Returns how many episodes are played where so many are asked for: as many from each start.

    Example:
        >>> episodes_played(10), episodes_played(40)
        (10, 64)
    """
    starts = min(episodes, _MOST_STARTS)
    return -(-episodes // starts) * starts


def _play(
    policies: Sequence[Policy], evolve: "Evolution | str", alphas: np.ndarray, episodes: int,
    seeds: Sequence[int], task: "str | Task | None", deterministic: bool, nthread: int = 0,
) -> np.ndarray:  # fmt: skip
    """Plays each policy on its robot, all at once; returns and successes, (2, policies, episodes).

    Successes are 1 and 0, and NaN where the task has no goal.
    """
    from revolver_lab.envs.vector import make_vec_env

    starts = min(episodes, _MOST_STARTS)
    env = make_vec_env(evolve, len(policies) * starts, task=task, alphas=np.repeat(alphas, starts),
                       seed=seeds, nthread=nthread, autoreset_mode="NextStep")  # fmt: skip
    for policy in policies:
        policy.fits(env.single_observation_space.shape[0], env.single_action_space.shape[0])  # type: ignore[index]
    streams = [np.random.default_rng(seed) for seed in seeds]

    def act(observation: np.ndarray) -> np.ndarray:
        blocks = observation.reshape(len(policies), starts, -1)
        drawn = [policy(block, deterministic=deterministic, rng=rng)
                 for policy, block, rng in zip(policies, blocks, streams)]  # fmt: skip
        return np.concatenate(drawn)

    found: list[np.ndarray] = []
    while len(found) * starts < episodes:
        returns = returns_of(env, act, None if found else seeds)
        goal = env.task.goal_steps
        # What is over rests, and its count of steps with the goal with it.
        won = np.full(env.num_envs, np.nan) if goal is None else env.held > goal
        found.append(np.stack([returns, won]).reshape(2, len(policies), starts))
    return np.concatenate(found, axis=2)[:, :, :episodes]


def returns_of(
    env: "RobotVectorEnv", act: Callable[[np.ndarray], np.ndarray], seeds: Sequence[int] | None
) -> np.ndarray:
    """Plays one episode in every simulation and returns their unshaped returns, (n,).

    Args:
        env: Simulations in NextStep mode.
        act: Maps observations (n, O) to actions (n, A).
        seeds: Seeds of the starts, see `make_vec_env`; None goes on with the streams there are.
    """
    observation, _ = env.reset(seed=seeds)
    env.halted[:] = False
    total = np.zeros(env.num_envs)
    while not env.halted.all():
        observation, reward, terminated, truncated, _ = env.step(act(observation))
        total += reward
        env.halted |= terminated | truncated
    env.halted[:] = False
    return total
